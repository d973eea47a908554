"""What reaches the terminal: everything that a command prints passes here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import typer

from fegear.output import strict_json
from fegear.printable import printable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table


def say(text: str) -> None:
    """A line on the screen, as long as it is."""
    typer.echo(printable(text))


def complain(message: str) -> None:
    """One line on the error stream."""
    typer.echo(f"fegear: {printable(' '.join(message.split()))}", err=True)


def print_json(values: Mapping[str, Any]) -> None:
    typer.echo(strict_json(values), nl=False)


def screen() -> Console:
    """For tables and lines that are broken at the screen's width."""
    from rich.console import Console

    class Screen(Console):
        def render(
            self, renderable: RenderableType, options: ConsoleOptions | None = None
        ) -> Iterable[Segment]:
            return map(_harmless, super().render(renderable, options))

    return Screen(highlight=False, markup=False)


def ruled_table(*columns: str, title: str | None = None, text: int = 1) -> Table:
    """A table without a frame; the first `text` columns are words, others numbers."""
    from rich import box
    from rich.table import Table

    table = Table(
        title=title,
        title_justify="left",
        title_style="",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for i, name in enumerate(columns):
        if i < text:
            table.add_column(name, overflow="fold")
        else:
            table.add_column(name, justify="right", no_wrap=True)
    return table


def _harmless(segment: Segment) -> Segment:
    """Text that is shown; control segments are the console's own."""
    if segment.control:
        return segment
    return segment._replace(text=printable(segment.text))
