"""Axes of matplotlib as axes of plotly: scales, limits, ticks and labels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fegear.figures.interactive.coordinates import FigurePanel
from fegear.figures.interactive.elements import Element
from fegear.figures.interactive.styles import css
from fegear.figures.interactive.texts import number_markup

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

INK = "#222222"
GRID = "rgba(0,0,0,0.12)"
FONT = {"size": 11, "color": INK}
SCALES = ("linear", "log")
LABEL_GAP = 3  # pixels from the numbers of an axis to its label
DECADES_OF_DIGITS = 2.5  # decades up to which digits are numbered within each


def axis_pair(panel: FigurePanel, panels: Sequence[FigurePanel]) -> dict[str, Element]:
    """Both axes of a panel, by their names in a layout."""
    axes, ending = panel.axes, panel.ending
    x, y = _axis(axes, "x"), _axis(axes, "y")
    x |= {"anchor": panel.y, "domain": [0.0, 1.0]}
    y |= {"anchor": panel.x, "domain": [0.0, 1.0]}
    for key, axis in (("x", x), ("y", y)):
        first = _first_sharing(panel, panels, key)
        if first is not None:
            axis["matches"] = f"{key}{first.ending}"
    host = twin_host(panel, panels)
    if host is not None:
        _lay_over(axes, host, x, y)
    _keep_aspect(panel, x, y)
    return {f"xaxis{ending}": x, f"yaxis{ending}": y}


def _axis(axes: Axes, key: str) -> Element:
    axis = axes.xaxis if key == "x" else axes.yaxis
    scale = axis.get_scale()
    if scale not in SCALES:
        raise TypeError(f"no interactive form of a {scale} axis")
    limits = [float(limit) for limit in axis.get_view_interval()]
    limits = sorted(limits, reverse=bool(axis.get_inverted()))
    if scale == "log":
        limits = [math.log10(limit) for limit in limits]
    style = {
        "type": scale,
        "range": limits,
        "tickfont": FONT,
        "showgrid": _has_grid(axis),
        "gridcolor": GRID,
        "zeroline": False,
        "showline": True,
        "linecolor": INK,
        "linewidth": 1,
        "mirror": _mirror(axes),
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": INK,
        "automargin": False,
        "exponentformat": "power",
        "showticklabels": _has_numbers(axis),
        "title": {"text": "", "standoff": LABEL_GAP, "font": {"size": 12}},
        "side": _side(axis, key),
        "visible": bool(axes.axison and axis.get_visible()),
    }
    return style | _ticks(axis, limits)


def _side(axis: Any, key: str) -> str:
    position = axis.get_ticks_position()
    other = "top" if key == "x" else "right"
    usual = "bottom" if key == "x" else "left"
    return other if position == other else usual


def _mirror(axes: Axes) -> bool:
    """Whether a panel has a frame."""
    return bool(axes.spines["top"].get_visible() and axes.spines["right"].get_visible())


def _has_grid(axis: Any) -> bool:
    return any(line.get_visible() for line in axis.get_gridlines())


def _has_numbers(axis: Any) -> bool:
    """Whether ticks are numbered on any side."""
    parameters = axis.get_tick_params(which="major")
    sides = ("labelbottom", "labeltop", "labelleft", "labelright")
    shown = [parameters[side] for side in sides if side in parameters]
    return any(shown) if shown else True


def _ticks(axis: Any, limits: list[float]) -> Element:
    from matplotlib.ticker import (
        FixedFormatter,
        FixedLocator,
        FuncFormatter,
        LogLocator,
        NullLocator,
    )

    locator, formatter = axis.get_major_locator(), axis.get_major_formatter()
    if isinstance(locator, NullLocator):
        return {"showticklabels": False, "ticks": ""}
    if isinstance(locator, FixedLocator):
        places = [float(place) for place in axis.get_majorticklocs()]
        if isinstance(formatter, FixedFormatter | FuncFormatter):
            texts = [label.get_text() for label in axis.get_majorticklabels()]
        else:
            texts = list(formatter.format_ticks(places))
        marked = [number_markup(text) for text in texts]
        return {"tickmode": "array", "tickvals": places, "ticktext": marked}
    if getattr(locator, "_integer", False):
        return {"tickformat": "d"}
    if (
        isinstance(locator, LogLocator)
        and abs(limits[1] - limits[0]) < DECADES_OF_DIGITS
    ):
        return {"dtick": "D1" if abs(limits[1] - limits[0]) < 1.0 else "D2"}
    return {"dtick": 1} if isinstance(locator, LogLocator) else {}


def _first_sharing(
    panel: FigurePanel, panels: Sequence[FigurePanel], key: str
) -> FigurePanel | None:
    """The first panel whose axis zooms with that of a panel; None for itself."""
    axes = panel.axes
    shared = axes.get_shared_x_axes() if key == "x" else axes.get_shared_y_axes()
    earlier = panels[: panel.number - 1]
    return next((other for other in earlier if shared.joined(axes, other.axes)), None)


def twin_host(panel: FigurePanel, panels: Sequence[FigurePanel]) -> FigurePanel | None:
    """The panel before it in whose frame a panel lies, as a twin does."""
    axes = panel.axes
    for other in panels[: panel.number - 1]:
        is_shared = axes.get_shared_x_axes().joined(axes, other.axes) or (
            axes.get_shared_y_axes().joined(axes, other.axes)
        )
        if is_shared and axes.get_position().bounds == other.axes.get_position().bounds:
            return other
    return None


def _lay_over(axes: Axes, host: FigurePanel, x: Element, y: Element) -> None:
    """Axes of a twin: one is its host's and not shown again, the other is beside it."""
    shares_x = axes.get_shared_x_axes().joined(axes, host.axes)
    hidden, shown = (x, y) if shares_x else (y, x)
    hidden["visible"] = False
    shown["mirror"] = False
    shown["showgrid"] = False
    x["overlaying"], y["overlaying"] = host.x, host.y


def _keep_aspect(panel: FigurePanel, x: Element, y: Element) -> None:
    """A unit along y as long as along x, or another ratio."""
    aspect = panel.axes.get_aspect()
    if aspect == "auto":
        y["scaleanchor"] = False  # which an image of plotly would set
        return
    y |= {"scaleanchor": panel.x, "scaleratio": float(aspect)}
    box = panel.axes.get_adjustable() == "box"
    for axis in (x, y):
        axis["constrain"] = "domain" if box else "range"


def background(axes: Axes) -> str:
    """Colour behind a panel."""
    return css(axes.get_facecolor())
