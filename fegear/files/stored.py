"""Responses as the records of a task, plain values and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lumped.steady.response import RESPONSE_QUANTITIES, Response, Status


class Records(Protocol):
    """Storage of what a task has finished, as `fegear.files.store.Records`."""

    @property
    def records(self) -> list[Any]: ...
    @property
    def state(self) -> Mapping[str, NDArray[Any]] | None: ...
    def add_record(
        self, record: Mapping[str, Any], state: Mapping[str, NDArray[Any]]
    ) -> None: ...


def response_values(response: Response) -> dict[str, Any]:
    """Plain values of a response, its state left out."""
    names = (entry.name for entry in fields(response) if entry.name != "state")
    values = {name: getattr(response, name) for name in names}
    arrays = (*RESPONSE_QUANTITIES, "period_multiple")
    return (
        values
        | {name: values[name].tolist() for name in arrays}
        | {"status": str(response.status)}
    )


def stored_response(stored: Mapping[str, Any], state: Any = None) -> Response:
    """The response of `response_values`, with a state that is stored with it."""
    values = dict(stored)
    values |= {name: np.array(values[name], float) for name in RESPONSE_QUANTITIES}
    values["period_multiple"] = np.array(values["period_multiple"], np.int64)
    values["status"] = Status(values["status"])
    return Response(**values, state=state)
