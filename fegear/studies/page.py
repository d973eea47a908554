"""What a result shows on a screen: lines and tables of words."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any, Protocol

ROUND_OFF = 1e-9  # of micrometres, newtons and per cents


Cell = Callable[[Mapping[str, Any]], str]
Columns = dict[str, Cell]  # cell of a row, by name


@dataclass(frozen=True)
class RowTable:
    """A table of words with the names of its columns, which may have lines.

    Given as rows of values, and what to make of each, by column.

    text_columns : columns of text, the first one where it is None
    whole : whether words are not folded
    """

    rows: Sequence[Mapping[str, Any]]
    columns: Columns
    title: str | None = None
    text_columns: Sequence[str] | None = None
    whole: bool = False

    def cells(self) -> Iterator[list[str]]:
        for row in self.rows:
            yield [cell(row) for cell in self.columns.values()]


@dataclass(frozen=True)
class ColumnTable:
    """A row of words for each label; columns by their names.

    corner : what the labels are
    """

    labels: Sequence[str]
    columns: Mapping[str, Sequence[str]]
    corner: str = ""
    title: str | None = None


def cell(
    key: str, digits: int = 4, scale: float = 1.0, over: str = "", none: str = ""
) -> Cell:
    """A number of a row; over : key of what it is divided by; none : for None."""

    def shown(row: Mapping[str, Any]) -> str:
        value = row[key]
        if value is None:
            return none
        return number(scale * value / (row[over] if over else 1.0), digits)

    return shown


Page = Iterator[str | RowTable | ColumnTable]


class HasDescription(Protocol):
    """Subject of a study.

    inferences : values that its source lacks
    """

    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def inferences(self) -> Sequence[str]: ...


def heading(subject: HasDescription) -> Page:
    """First lines of a page: name and description."""
    yield f"{subject.name}: {subject.description or 'no description'}"
    yield from (f"inferred: {inference}" for inference in subject.inferences)


def number(value: float, figures: int = 5) -> str:
    """At least so many figures, without an exponent while it can be read.

    Values below ROUND_OFF are shown as 0.
    """
    if abs(value) < ROUND_OFF:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{figures}g}"
    decimals = figures - 1 - floor(log10(abs(value)))
    return f"{value:.{max(0, decimals)}f}"


def pluralize(count: int, one: str, many: str = "") -> str:
    """`1 mesh`, `2 meshes`; many : by an s where it is empty."""
    return f"{count} {one if count == 1 else many or one + 's'}"
