"""Colour bars, which are axes in matplotlib and belong to the layout in plotly."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.figures.interactive.elements import Element
from fegear.figures.interactive.styles import css
from fegear.figures.interactive.texts import markup, number_markup

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar

THICKNESS = 14  # pixels
FONT, TICK_FONT = {"size": 12}, {"size": 11}


def color_bar_of(axes: Axes) -> Colorbar | None:
    """The colour bar whose axes these are."""
    bar: Colorbar | None = getattr(axes, "_colorbar", None)
    return bar


def color_axis(bar: Colorbar) -> Element:
    """A colour axis from 0 to 1 along the bar, with the numbers of its ticks."""
    axis = bar.ax.yaxis if bar.orientation == "vertical" else bar.ax.xaxis
    texts = [label.get_text() for label in axis.get_majorticklabels()]
    places = _fractions(bar, axis.get_majorticklocs())
    ticks = [
        (place, number_markup(text))
        for place, text in zip(places, texts, strict=True)
        if -1e-9 <= place <= 1.0 + 1e-9
    ]
    label = bar.ax.get_ylabel() or bar.ax.get_xlabel()
    return {
        "cmin": 0.0,
        "cmax": 1.0,
        "colorscale": _scale(bar),
        "colorbar": {
            "tickmode": "array",
            "tickvals": [place for place, _ in ticks],
            "ticktext": [text for _, text in ticks],
            "thickness": THICKNESS,
            "title": {"text": markup(label), "side": "right", "font": FONT},
            "ticks": "outside",
            "tickfont": TICK_FONT,
            "lenmode": "fraction",
            "xanchor": "left",
            "yanchor": "middle",
            "xpad": 0,
            "ypad": 0,
            "outlinewidth": 1,
            "ticklen": 4,
        },
    }


def _fractions(bar: Colorbar, values: Any) -> list[float]:
    """Places of values along the bar, from 0 to 1."""
    column = 1 if bar.orientation == "vertical" else 0
    points = np.zeros((len(values), 2)) + np.asarray(values, float)[:, None]
    with np.errstate(all="ignore"):
        axes_points = (bar.ax.transData - bar.ax.transAxes).transform(points)
    return [float(place) for place in np.round(axes_points[:, column], 9)]


def _scale(bar: Colorbar) -> list[tuple[float, str]]:
    """Colours of the bar's cells between their edges."""
    edges, colors = _cells(bar)
    places = np.clip(_fractions(bar, edges), 0.0, 1.0)
    places[0], places[-1] = 0.0, 1.0
    steps = zip(places[:-1], places[1:], colors, strict=True)
    return [(float(at), color) for a, b, color in steps for at in (a, b)]


def _cells(bar: Colorbar) -> tuple[np.ndarray, list[str]]:
    solids: Any = bar.solids
    if solids is None:  # of contour lines
        raise TypeError("no interactive form of a colour bar of lines")
    corners = solids.get_coordinates()
    edges = corners[:, 0, 1 if bar.orientation == "vertical" else 0]
    colors = bar.cmap(bar.norm(solids.get_array().ravel()))
    return edges, [css(color) for color in colors]
