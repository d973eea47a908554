"""Finished speeds of finite-element dynamics, kept and found again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.stepper import MotionState
from fegear.errors import file_error
from fegear.store import Checkpoint
from lumped.response import FIGURES, Response, Status

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StoredBranch:
    """A branch by its name in a checkpoint, as lumped's sweep keeps it."""

    checkpoint: Checkpoint
    name: str

    def finished(self) -> list[Response]:
        stored = self.checkpoint.finished(self.name)
        responses = [stored_response(each) for each in stored]
        arrays = self.checkpoint.state(self.name)
        if responses and arrays is not None:
            responses[-1] = replace(responses[-1], state=_state(arrays))
        return responses

    def add(self, response: Response) -> None:
        values, arrays = response_values(response), _arrays(response.state)
        try:
            self.checkpoint.add(self.name, values, arrays)
        except OSError as error:
            raise file_error(self.checkpoint.path, "written", error) from None


def _arrays(state: MotionState) -> dict[str, Array]:
    fields = {f"field{i}": field for i, field in enumerate(state.fields)}
    return {"motion": state.motion, "touch": state.contact} | fields


def _state(arrays: dict[str, Array]) -> MotionState:
    fields = tuple(arrays[f"field{i}"] for i in range(len(arrays) - 2))
    return MotionState(arrays["motion"], arrays["touch"], fields)


def response_values(response: Response) -> dict[str, Any]:
    """Plain values of a response, its state left out."""
    names = (entry.name for entry in fields(response) if entry.name != "state")
    values = {name: getattr(response, name) for name in names}
    arrays = (*FIGURES, "period_multiple")
    return (
        values
        | {name: values[name].tolist() for name in arrays}
        | {"status": str(response.status)}
    )


def stored_response(stored: Mapping[str, Any], state: Any = None) -> Response:
    """The response of `response_values`, with a state that is kept beside it."""
    values = dict(stored)
    values |= {name: np.array(values[name], float) for name in FIGURES}
    values["period_multiple"] = np.array(values["period_multiple"], np.int64)
    values["status"] = Status(values["status"])
    return Response(**values, state=state)
