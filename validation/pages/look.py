"""The look of figures in a report; narrow, so that a phone can show them.

Black is the color of the finite elements and of all words; a page turns it into
its own ink.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lumped.figures.drawing import panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 4.8  # inches; a phone shows them at about four fifths of it
COLORS = ("#d1495b", "#2b83ba", "#3a9d5d", "#c77f0a", "#8e6bbf", "#7a7a7a")


def grid(
    rows: int, columns: int, size: tuple[float, float], share: bool = False
) -> tuple[Figure, list[list[Axes]]]:
    """Panels by row and column in the look of a report."""
    import matplotlib

    style: dict[Any, Any] = {"font.size": 9.0, "axes.facecolor": "none"}
    with matplotlib.rc_context(style):
        figure, every = panels(rows, columns, size=size, share=share)
    for axes in (axes for row in every for axes in row):
        axes.grid(alpha=0.18, color="black", lw=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    return figure, every
