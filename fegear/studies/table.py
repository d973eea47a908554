"""Tables of results: columns with units in their names, as CSV and as frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fegear.result import frame
from lumped.csv_text import format_csv

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of named columns; names end with units.

    rows : called for them, so that long tables need no memory
    header : lines above the names of the columns
    """

    names: Sequence[str]
    rows: Callable[[], Iterable[Sequence[Any]]]
    header: Mapping[str, str] = field(default_factory=dict)

    def csv(self) -> str:
        return format_csv(list(self.names), self.rows(), dict(self.header))

    def to_frame(self) -> DataFrame:
        """A pandas frame; ImportError where pandas is missing."""
        columns = zip(*self.rows(), strict=True)
        return frame(dict(zip(self.names, columns, strict=False)))
