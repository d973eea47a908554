"""The page of a result as text: its lines, and its tables as wide as the screen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from typing import IO, TYPE_CHECKING

from fegear.files.printable import printable
from fegear.studies.page import ColumnTable, Page, RowTable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table

WIDEST = 24  # letters of a column


def page_text(page: Page) -> str:
    """A page as a command prints it into a file."""
    text = StringIO()
    print_page(page, screen(text))
    return text.getvalue().removesuffix("\n")


def print_page(page: Page, console: Console) -> None:
    """Print a page; lines are wrapped at the width of a terminal only."""
    for part in page:
        if isinstance(part, RowTable):
            table = ruled_table(
                *part.columns, title=part.title, text_columns=part.text_columns
            )
            table.columns[0].no_wrap = part.whole or table.columns[0].no_wrap
            for cells in part.cells():
                table.add_row(*cells)
            console.print(table)
        elif isinstance(part, ColumnTable):
            print_columns(console, part.corner, part.labels, part.columns, part.title)
        elif console.is_terminal:
            console.print(part)
        else:
            console.file.write(f"{printable(part)}\n")


def screen(file: IO[str] | None = None) -> Console:
    """For tables and lines that are broken at the screen's width.

    file : in place of the screen
    """
    from rich.console import Console

    class Screen(Console):
        def render(
            self, renderable: RenderableType, options: ConsoleOptions | None = None
        ) -> Iterable[Segment]:
            return map(_printable_segment, super().render(renderable, options))

    return Screen(highlight=False, markup=False, file=file)


def ruled_table(
    *columns: str, title: str | None = None, text_columns: Sequence[str] | None = None
) -> Table:
    """A table without a frame; text_columns : names, by default the first column."""
    from fegear.studies.ruled import Ruled

    table = Ruled(title)
    for name in columns:
        if name in (columns[:1] if text_columns is None else text_columns):
            table.add_column(name, overflow="fold")
        else:
            table.add_column(name, justify="right", no_wrap=True)
    return table


def print_columns(
    console: Console,
    corner: str,
    labels: Iterable[str],
    columns: Mapping[str, Sequence[str]],
    title: str | None = None,
) -> None:
    """A row for each label; tables below each other where the screen is too narrow."""
    from fegear.studies.ruled import parts, width

    labels = list(labels)
    widths = [min(WIDEST, width([name, *cells])) for name, cells in columns.items()]
    room, names = console.width - width([corner, *labels]), list(columns)
    for part in parts(widths, room):
        table = ruled_table(corner, *names[part], title=title)
        for column in table.columns:
            column.no_wrap, column.overflow = False, "fold"
        shown = (columns[name] for name in names[part])
        for row in zip(labels, *shown, strict=True):
            table.add_row(*row)
        console.print(table)


def _printable_segment(segment: Segment) -> Segment:
    """Text that is shown; control segments are the console's own."""
    if segment.control:
        return segment
    return segment._replace(text=printable(segment.text))
