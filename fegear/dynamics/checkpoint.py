"""Finished speeds of finite-element dynamics, kept and found again."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fegear.dynamics.stepper import MotionState
from fegear.files.records import Records
from lumped.common.array_types import Array
from lumped.steady.response import Response


@dataclass(frozen=True, eq=False)
class StoredBranch:
    """Responses of a branch among the records of a task, as lumped's sweep keeps it."""

    records: Records

    def finished(self) -> list[Response]:
        responses, arrays = self.records.records, self.records.state
        if responses and arrays is not None:
            responses[-1] = replace(responses[-1], state=_state(dict(arrays)))
        return responses

    def add(self, response: Response) -> None:
        self.records.add_record(replace(response, state=None), _arrays(response.state))


def _arrays(state: MotionState) -> dict[str, Array]:
    fields = {f"field{i}": field for i, field in enumerate(state.fields)}
    return {"motion": state.motion, "touch": state.contact} | fields


def _state(arrays: dict[str, Array]) -> MotionState:
    fields = tuple(arrays[f"field{i}"] for i in range(len(arrays) - 2))
    return MotionState(arrays["motion"], arrays["touch"], fields)
