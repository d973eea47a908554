"""Finished speeds of finite-element dynamics, kept and found again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.stepper import MotionState
from lumped.response import FIGURES, Response, Status

Array = NDArray[np.float64]


class Records(Protocol):
    """Where a task keeps what it has finished, as `fegear.store.Records`."""

    @property
    def kept(self) -> list[Any]: ...
    @property
    def state(self) -> Mapping[str, NDArray[Any]] | None: ...
    def keep(
        self, record: Mapping[str, Any], state: Mapping[str, NDArray[Any]]
    ) -> None: ...


@dataclass(frozen=True, eq=False)
class StoredBranch:
    """Responses of a branch among the records of a task, as lumped's sweep keeps it."""

    records: Records

    def finished(self) -> list[Response]:
        responses = [stored_response(each) for each in self.records.kept]
        arrays = self.records.state
        if responses and arrays is not None:
            responses[-1] = replace(responses[-1], state=_state(dict(arrays)))
        return responses

    def add(self, response: Response) -> None:
        self.records.keep(response_values(response), _arrays(response.state))


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
