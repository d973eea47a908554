"""What figures share: panels, titles, legends; Matplotlib loads where it draws."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = (
    *("tab:blue", "tab:red", "tab:green", "tab:purple", "tab:brown"),
    *("tab:orange", "tab:cyan", "tab:olive", "tab:pink", "gold", "navy", "lime"),
)
LETTERS = 11  # of a title in an inch
LETTER, SIGN = 0.072, 0.5  # inches of a letter in a legend, and of a sign with its gaps


def color_of(number: int) -> str:
    """A colour for the first, second, ... of several curves, from 0."""
    return COLORS[number % len(COLORS)]


def panels(
    rows: int,
    columns: int = 1,
    *,
    size: tuple[float, float],
    heights: Sequence[float] | None = None,
    share: bool = False,
) -> tuple[Figure, list[list[Axes]]]:
    """A figure of a size [inch] and its panels by row and column, with grids.

    share : whether panels of a column have one abscissa
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    sharing: Any = "col" if share else False
    every = figure.subplots(
        *(rows, columns), squeeze=False, sharex=sharing, height_ratios=heights
    )
    for axes in every.flat:
        axes.grid(alpha=0.25)
    return figure, every.tolist()


def draw_title(figure: Figure, title: str) -> None:
    """Above a figure, broken so that it fits the width."""
    letters = int(LETTERS * figure.get_figwidth())
    lines = [each for line in title.splitlines() for each in wrap(line, letters)]
    figure.suptitle("\n".join(lines), fontsize=11)


def draw_legend(figure: Figure, handles: Iterable[Any], columns: int) -> None:
    """Below all panels, in so many columns or fewer if they would not fit."""
    entries = list(handles)
    lengths = [len(str(each.get_label())) for each in entries]
    while columns > 1 and _legend_width(lengths, columns) > figure.get_figwidth():
        columns -= 1
    figure.legend(
        handles=entries, loc="outside lower center", ncols=columns, fontsize=8
    )


def _legend_width(lengths: Sequence[int], columns: int) -> float:
    """Inches of labels of so many letters, which fill one column after another."""
    rows, more = divmod(len(lengths), columns)
    longest, start = 0, 0
    for column in range(columns):
        end = start + rows + (column < more)
        longest += max(lengths[start:end], default=0)
        start = end
    return LETTER * longest + SIGN * columns
