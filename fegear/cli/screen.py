"""What reaches the terminal: everything that a command prints passes here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import typer

from fegear.files.errors import one_line
from fegear.files.output import strict_json
from fegear.files.printable import printable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table

WIDEST = 24  # letters of a column


def print_line(text: str) -> None:
    """A line on the screen, as long as it is."""
    typer.echo(printable(text))


def print_error(message: str) -> None:
    """One line on the error stream."""
    typer.echo(f"fegear: {printable(one_line(message))}", err=True)


def print_announcement(line: str) -> None:
    """A warning or another line, on the error stream."""
    from fegear.files.codes import is_warning

    if is_warning(line):
        print_warnings([line])
    else:
        print_error(line)


def print_warnings(warnings: Iterable[str]) -> None:
    """A line for each on the error stream; ValueError for one without its code."""
    from fegear.files.codes import require_warning_code

    for warning in warnings:
        line = require_warning_code(" ".join(warning.split()))
        typer.echo(f"warning: {printable(line)}", err=True)


def print_json(values: Mapping[str, Any]) -> None:
    typer.echo(strict_json(values), nl=False)


def screen() -> Console:
    """For tables and lines that are broken at the screen's width."""
    from rich.console import Console

    class Screen(Console):
        def render(
            self, renderable: RenderableType, options: ConsoleOptions | None = None
        ) -> Iterable[Segment]:
            return map(_printable_segment, super().render(renderable, options))

    return Screen(highlight=False, markup=False)


def ruled_table(
    *columns: str, title: str | None = None, text_columns: Sequence[str] | None = None
) -> Table:
    """A table without a frame; text_columns : names, by default the first column."""
    from fegear.cli.ruled import Ruled

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
    from fegear.cli.ruled import parts, width

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
