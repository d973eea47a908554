"""The interface by which a task stores its records, without opening a checkpoint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray


class Records(Protocol):
    """Storage of what a task has finished, as `fegear.files.store.Records`."""

    @property
    def records(self) -> list[Any]: ...
    @property
    def state(self) -> Mapping[str, NDArray[Any]] | None: ...
    def add_record(self, record: Any, state: Mapping[str, NDArray[Any]]) -> None: ...
