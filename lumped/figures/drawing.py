"""Common parts of plots: panels, titles, legends; Matplotlib is imported on use."""

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
LETTERS_PER_INCH = 11  # letters of a title per inch
# Inches of a letter in a legend, and of a key with gaps
LETTER_WIDTH, KEY_WIDTH = 0.072, 0.5


def color_of(number: int) -> str:
    """Colour of one of several curves, numbered from 0."""
    return COLORS[number % len(COLORS)]


def panels(
    rows: int,
    columns: int = 1,
    *,
    size: tuple[float, float],
    heights: Sequence[float] | None = None,
    share: bool = False,
) -> tuple[Figure, list[list[Axes]]]:
    """Create a plot of a size [inch] and its panels by row and column, with grids.

    share : whether panels of a column share the abscissa
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    sharing: Any = "col" if share else False
    axes_grid = figure.subplots(
        *(rows, columns), squeeze=False, sharex=sharing, height_ratios=heights
    )
    for axes in axes_grid.flat:
        axes.grid(alpha=0.25)
    return figure, axes_grid.tolist()


def draw_title(figure: Figure, title: str) -> None:
    """Draw a title above a plot, with line breaks to fit the width."""
    letters = int(LETTERS_PER_INCH * figure.get_figwidth())
    lines = [part for line in title.splitlines() for part in wrap(line, letters)]
    figure.suptitle("\n".join(lines), fontsize=11)


def draw_legend(figure: Figure, handles: Iterable[Any], columns: int) -> None:
    """Draw a legend below all panels, with fewer columns if they do not fit."""
    entries = list(handles)
    lengths = [len(str(handle.get_label())) for handle in entries]
    while columns > 1 and _legend_width(lengths, columns) > figure.get_figwidth():
        columns -= 1
    figure.legend(
        handles=entries, loc="outside lower center", ncols=columns, fontsize=8
    )


def _legend_width(lengths: Sequence[int], columns: int) -> float:
    """Width [inch] of labels of given lengths, which fill one column after another."""
    rows, remainder = divmod(len(lengths), columns)
    longest, start = 0, 0
    for column in range(columns):
        end = start + rows + (column < remainder)
        longest += max(lengths[start:end], default=0)
        start = end
    return LETTER_WIDTH * longest + KEY_WIDTH * columns
