"""What reaches the terminal: everything that a command prints passes here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any

import typer

from fegear.output import strict_json
from fegear.printable import printable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table

ROUND_OFF = 1e-9  # of micrometres, newtons and per cents


def say(text: str) -> None:
    """A line on the screen, as long as it is."""
    typer.echo(printable(text))


def complain(message: str) -> None:
    """One line on the error stream."""
    typer.echo(f"fegear: {printable(' '.join(message.split()))}", err=True)


def warn(warnings: Iterable[str]) -> None:
    """A line for each on the error stream."""
    for warning in warnings:
        complain(f"warning: {warning}")


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


def ruled_table(
    *columns: str, title: str | None = None, words: Sequence[str] | None = None
) -> Table:
    """A table without a frame; words : columns of text, by default the first one."""
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
    for name in columns:
        if name in (columns[:1] if words is None else words):
            table.add_column(name, overflow="fold")
        else:
            table.add_column(name, justify="right", no_wrap=True)
    return table


def number(value: float, figures: int = 5) -> str:
    """At least so many figures, without an exponent while it can be read.

    Of values in units that fit them: what is nothing but round-off is 0.
    """
    if abs(value) < ROUND_OFF:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{figures}g}"
    decimals = figures - 1 - floor(log10(abs(value)))
    return f"{value:.{max(0, decimals)}f}"


def _harmless(segment: Segment) -> Segment:
    """Text that is shown; control segments are the console's own."""
    if segment.control:
        return segment
    return segment._replace(text=printable(segment.text))
