"""Tables of results: columns with units in their names, as CSV and as frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fegear.result import frame
from lumped.common.csv_text import format_csv

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

    @classmethod
    def of(cls, columns: Mapping[str, ArrayLike], header: Mapping[str, str]) -> Table:
        """Columns of equal length, which may be arrays."""
        lists = [np.asarray(column).tolist() for column in columns.values()]
        return cls(tuple(columns), lambda: zip(*lists, strict=True), header)

    def csv(self) -> str:
        return format_csv(list(self.names), self.rows(), dict(self.header))

    def to_frame(self) -> DataFrame:
        """A pandas frame; ImportError where pandas is missing."""
        columns = zip(*self.rows(), strict=True)
        return frame(dict(zip(self.names, columns, strict=False)))


def finite_or_none(value: float) -> float | None:
    """A finite number, or None as JSON has it."""
    return value if math.isfinite(value) else None
