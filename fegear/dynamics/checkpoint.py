"""Finished speeds of finite-element dynamics, kept and found again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.stepper import MotionState
from fegear.files.stored import Records, response_values, stored_response
from lumped.steady.response import Response

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StoredBranch:
    """Responses of a branch among the records of a task, as lumped's sweep keeps it."""

    records: Records

    def finished(self) -> list[Response]:
        responses = [stored_response(record) for record in self.records.records]
        arrays = self.records.state
        if responses and arrays is not None:
            responses[-1] = replace(responses[-1], state=_state(dict(arrays)))
        return responses

    def add(self, response: Response) -> None:
        self.records.add_record(response_values(response), _arrays(response.state))


def _arrays(state: MotionState) -> dict[str, Array]:
    fields = {f"field{i}": field for i, field in enumerate(state.fields)}
    return {"motion": state.motion, "touch": state.contact} | fields


def _state(arrays: dict[str, Array]) -> MotionState:
    fields = tuple(arrays[f"field{i}"] for i in range(len(arrays) - 2))
    return MotionState(arrays["motion"], arrays["touch"], fields)
