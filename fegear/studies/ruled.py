"""A table without a frame that continues below where the screen is too narrow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import replace

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Column, Table

GAP = 2  # letters between two columns
NARROW = 12  # letters to which a column of words is folded before numbers move down


class Ruled(Table):
    """Words, which are folded, and numbers, which never are.

    Parts of a table that is too wide begin with its first column and its words.
    """

    def __init__(self, title: str | None = None) -> None:
        super().__init__(
            title=title,
            title_justify="left",
            title_style="",
            box=box.SIMPLE_HEAD,
            pad_edge=False,
            padding=(0, 1, 0, 0),
        )

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        for part in self._column_slices(options.max_width):
            yield from Table.__rich_console__(part, console, options)

    def _column_slices(self, room: int) -> Iterator[Table]:
        """Tables of as many columns as fit."""
        first, rest = self.columns[:1], self.columns[1:]
        text_columns = first + [column for column in rest if not column.no_wrap]
        numbers = [column for column in rest if column.no_wrap]
        needed = sum(min(NARROW, _width(column)) + 1 for column in text_columns)
        slices = list(parts([_width(column) - 1 for column in numbers], room - needed))
        if len(slices) < 2:
            yield self
            return
        for number, span in enumerate(slices):
            part = copy(self)
            shown = [*text_columns, *numbers[span]]
            part.columns = [replace(column, _index=i) for i, column in enumerate(shown)]
            part.title = None if number else self.title
            yield part


def _width(column: Column) -> int:
    """Letters of a column, and a space after it."""
    return width([str(column.header), *map(str, column.cells)]) + 1


def width(cells: Iterable[str]) -> int:
    """Letters of the longest line."""
    return max(len(line) for cell in cells for line in cell.splitlines() or [""])


def parts(widths: Sequence[int], room: int) -> Iterator[slice]:
    """Columns that fit into a width side by side, at least one."""
    start, used = 0, 0
    for i, letters in enumerate(widths):
        if i > start and used + letters + GAP > room:
            yield slice(start, i)
            start, used = i, 0
        used += letters + GAP
    yield slice(start, len(widths))
