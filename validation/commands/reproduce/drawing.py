"""A figure of a source drawn from what its parts gave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_legend, panels
from lumped.figures.rattle import color_of_motion
from validation.commands.reproduce.parts import QUANTITIES, Curve, Style
from validation.commands.reproduce.runs import COLUMNS, FigureResult
from validation.commands.reproduce.source_figures import SourceFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 7.2, 3.0  # inches, of all panels and of one
LINE_STYLES: Mapping[Style, dict[str, Any]] = {
    "line": {"ls": "-", "lw": 1.4},
    "wide": {"ls": "-", "lw": 5.0, "alpha": 0.4},
    "dashed": {"ls": "--", "lw": 1.0},
    "dotted": {"ls": ":", "lw": 1.2},
    "dots": {"ls": "", "marker": "o", "ms": 2.6},
    "circles": {"ls": "", "marker": "o", "ms": 4.0, "mfc": "none", "mew": 0.7},
    "crosses": {"ls": "", "marker": "x", "ms": 6.0, "mew": 1.4},
    "points": {"ls": "", "marker": ".", "ms": 2.0},
    "pale": {"ls": "", "marker": ".", "ms": 2.0, "alpha": 0.12},
    "cells": {"ls": "", "marker": "s", "ms": 6.0},
    "outline": {"ls": "-", "lw": 1.0},
    "broken outline": {"ls": "--", "lw": 0.8},
}
OUTLINE_STYLES = ("outline", "broken outline")  # as long along both axes
DIRECTIONS: Mapping[Style, str] = {"dots": "up", "circles": "down"}
STYLES_AS_LINES: Mapping[Style, dict[str, Any]] = {  # of the second of two methods
    "dots": {"ls": "-", "lw": 1.0},
    "circles": {"ls": "--", "lw": 1.0},
}
COLORS_ON_CELLS = {
    "chaos": "black",
    "attractors": "white",
    "stable orbits": "white",
    "unstable orbits": "white",
    "grazing": "white",
    "pre-image 1 of grazing": "black",
    "pre-image 2 of grazing": "yellow",
    "stable manifold of P(1,1,0)": "magenta",
    "stable manifold of P(1,1,1)": "lime",
}
CONTOUR_LEVELS = 12  # of a surface
TITLE_WIDTH = 72  # of titles side by side
INTEGER_AXES = ("mode",)  # axes of whole numbers
MARK_PLACES = 300  # of marks along an axis
NEAR_ZERO = 0.5  # of the largest value, below which an axis begins at 0


def draw_figure(result: FigureResult) -> Figure:
    """Panels in the order of the parts; surfaces as contours side by side."""
    from matplotlib.ticker import MaxNLocator

    figure, curves = result.figure, result.curves
    names = list(dict.fromkeys(_panel_name(figure, curve) for curve in curves))
    labels = list(dict.fromkeys(_label_without_direction(curve) for curve in curves))
    has_surface = any(curve.style == "surface" for curve in curves)
    columns = 2 if len(names) > (1 if has_surface else 3) else 1
    rows = -(-len(names) // columns)
    has_shared_axes = not (has_surface or any(part.panel for part in figure.part))
    size = WIDTH, 0.8 + HEIGHT * rows
    drawing, grid = panels(rows, columns, size=size, share=has_shared_axes)
    all_axes = [axes for row in grid for axes in row]
    label = figure.y or QUANTITIES[figure.quantity][0]
    own_labels = {part.panel: part.y for part in figure.part if part.y}
    for axes, name in zip(all_axes, names, strict=False):
        panel_curves = [curve for curve in curves if _panel_name(figure, curve) == name]
        cells = [curve for curve in panel_curves if curve.style == "cells"]
        for curve in panel_curves:
            if curve.style != "cells":
                _draw_curve(
                    axes, curve, _color(curve, labels), _line_style(curve, labels)
                )
        axes.set_ylabel(own_labels.get(name, label))
        axes.set_title(fill(name, TITLE_WIDTH // columns), fontsize=10)
        if cells:
            size = _set_cell_limits(axes, cells)
            for curve in cells:
                _fill_cells(axes, curve, size)
            _set_cell_limits(axes, cells)
        elif not has_surface:
            _scale_axes(axes, panel_curves)
    for axes in all_axes[len(names) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel(figure.x or _speed_label(figure.relative))
        if figure.x in INTEGER_AXES:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    handles = [] if has_surface else _legend_handles(curves, labels)
    if handles:
        draw_legend(drawing, handles, 3)
        if any(curve.style == "cells" for curve in curves):  # some marks are white
            drawing.legends[0].get_frame().set_facecolor("0.75")
    return drawing


def column_names(result: FigureResult) -> tuple[str, ...]:
    """Column names of a table of the curves: axes carry the labels and units of the
    picture.
    """
    figure = result.figure
    y = figure.y or QUANTITIES[figure.quantity][0]
    has_surface = any(curve.style == "surface" for curve in result.curves)
    value = QUANTITIES[figure.quantity][0] if has_surface else "value"
    return (*COLUMNS[:4], figure.x or _speed_label(figure.relative), y, value)


def _color(curve: Curve, labels: Sequence[str]) -> Any:
    """That of the motion over all pictures for cells; light ones for curves on them.

    With two methods at several values, a color identifies the value.
    """
    if curve.style == "cells":
        return color_of_motion(curve.label)
    name, methods = _label_without_direction(curve), _methods(labels)
    if methods:
        values = list(dict.fromkeys(_method_and_value(label)[1] for label in labels))
        return color_of(values.index(_method_and_value(name)[1]))
    return COLORS_ON_CELLS.get(curve.label, color_of(labels.index(name)))


def _method_and_value(label: str) -> tuple[str, str]:
    """`model 1, 50 N m` into the method and the value."""
    method, _, value = label.partition(", ")
    return method, value


def _methods(labels: Sequence[str]) -> list[str]:
    """Two methods that are each there at the same values, two at least; or none."""
    parts = [_method_and_value(label) for label in labels]
    methods = list(dict.fromkeys(method for method, _ in parts))
    values = {value for _, value in parts}
    all_combinations = {(method, value) for method in methods for value in values}
    is_comparison = len(methods) == 2 and len(values) > 1 and "" not in values
    return methods if is_comparison and all_combinations == set(parts) else []


def _line_style(curve: Curve, labels: Sequence[str]) -> dict[str, Any]:
    methods = _methods(labels)
    if methods and _method_and_value(_label_without_direction(curve))[0] == methods[1]:
        return STYLES_AS_LINES.get(curve.style, LINE_STYLES[curve.style])
    return LINE_STYLES.get(curve.style, {})


def _set_cell_limits(axes: Axes, cells: Sequence[Curve]) -> tuple[float, float]:
    """Limits around all cells of a panel; the size of one."""
    points = np.array([point for curve in cells for point in curve.points])
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = (float(np.diff(np.unique(c)).min()) for c in points.T)
    axes.set_xlim(low[0] - 0.5 * width, high[0] + 0.5 * width)
    axes.set_ylim(low[1] - 0.5 * height, high[1] + 0.5 * height)
    axes.grid(visible=False)
    return width, height


def _fill_cells(axes: Axes, curve: Curve, size: tuple[float, float]) -> None:
    """Cells of a grid, of which some are missing, by the size of one."""
    points, (width, height) = np.array(curve.points), size
    left, low = points.min(axis=0)
    column = np.round((points[:, 0] - left) / width).astype(int)
    row = np.round((points[:, 1] - low) / height).astype(int)
    image = np.zeros((row.max() + 1, column.max() + 1, 4))
    image[row, column] = (*color_of_motion(curve.label), 1.0)
    right, high = left + (column.max() + 0.5) * width, low + (row.max() + 0.5) * height
    axes.imshow(
        image,
        origin="lower",
        extent=(left - 0.5 * width, right, low - 0.5 * height, high),
        aspect="auto",
        interpolation="nearest",
    )


def _panel_name(figure: SourceFigure, curve: Curve) -> str:
    mesh = f"mesh {curve.mesh}" if curve.mesh and len(figure.meshes) > 1 else ""
    return ", ".join(filter(None, (curve.panel, mesh)))


def _direction_suffix(style: Style) -> str:
    """Ending of the label of a sweep; its markers already show it."""
    return f", {DIRECTIONS[style]}" if style in DIRECTIONS else "\0"


def _label_without_direction(curve: Curve) -> str:
    return curve.label.removesuffix(_direction_suffix(curve.style))


def _speed_label(relative: bool) -> str:
    if relative:
        return "mesh frequency over natural frequency 1"
    return "mesh frequency of mesh 1 [Hz]"


def _scale_axes(axes: Axes, curves: Sequence[Curve]) -> None:
    """Outlines as they are, values from 0, but where all of them are far from it."""
    if any(curve.style in OUTLINE_STYLES for curve in curves):
        axes.set_aspect("equal", adjustable="datalim")
        return
    axes.margins(x=0.01)
    values = np.array([point[1] for curve in curves for point in curve.points])
    if 0.0 <= np.nanmin(values) < NEAR_ZERO * np.nanmax(values):
        axes.set_ylim(bottom=0.0)


def _draw_curve(axes: Axes, curve: Curve, color: Any, look: Mapping[str, Any]) -> None:
    points = np.array(curve.points, float)
    if curve.style != "surface":
        shown = points if look["ls"] else _distinct_marks(points)
        axes.plot(*shown.T, color=color, **look)
        return
    x, y = (np.unique(column) for column in points.T[:2])
    values = points[:, 2].reshape(x.size, y.size).T
    lines = axes.contour(x, y, values, CONTOUR_LEVELS, linewidths=1.0)
    axes.clabel(lines, fontsize=7)
    axes.grid(visible=False)


def _distinct_marks(points: Array) -> Array:
    """Marks (n, 2), no two of them in the same place of a panel."""
    size = np.nanmax(points, axis=0) - np.nanmin(points, axis=0)
    places = np.round(points / np.where(size > 0.0, size, 1.0) * MARK_PLACES)
    return points[np.sort(np.unique(places, axis=0, return_index=True)[1])]


def _legend_handles(curves: Sequence[Curve], labels: Sequence[str]) -> list[Any]:
    from matplotlib.lines import Line2D

    styles = dict.fromkeys(curve.style for curve in curves)
    methods, handles = _methods(labels), list[Any]()
    if methods and set(styles) <= DIRECTIONS.keys():
        return _legend_handles_of_methods(curves, labels, methods)
    for label in labels:
        first = next(
            curve for curve in curves if _label_without_direction(curve) == label
        )
        line_style = first.style
        look = LINE_STYLES[line_style] | (
            {"ms": 6.0, "alpha": 1.0} if line_style == "points" else {}
        )
        handles.append(Line2D([], [], color=_color(first, labels), label=label, **look))
    meanings: dict[Style, str] = {}
    if {"line", "dashed"} <= styles.keys():
        meanings |= {"line": "stable", "dashed": "unstable"}
    if any(curve.label.endswith(_direction_suffix(curve.style)) for curve in curves):
        meanings |= {"dots": "speed rises", "circles": "speed falls"}
    handles += [
        Line2D([], [], color="black", label=word, **LINE_STYLES[style])
        for style, word in meanings.items()
        if style in styles
    ]
    if "pale" in styles:
        look = LINE_STYLES["pale"] | {"ms": 6.0, "alpha": 0.4}
        handles.append(
            Line2D([], [], color="black", label="unstable closed form", **look)
        )
    return [handle for handle in handles if handle.get_label()]


def _legend_handles_of_methods(
    curves: Sequence[Curve], labels: Sequence[str], methods: Sequence[str]
) -> list[Any]:
    """A color for each value, a mark or line for each method and direction."""
    from matplotlib.lines import Line2D

    handles: list[Any] = []
    for curve in curves:
        method, value = _method_and_value(_label_without_direction(curve))
        if method == methods[0] and value not in [
            handle.get_label() for handle in handles
        ]:
            color = _color(curve, labels)
            handles.append(Line2D([], [], color=color, label=value, lw=3.0))
    for method, looks in zip(methods, (LINE_STYLES, STYLES_AS_LINES), strict=True):
        style: Style
        for style, direction in (("dots", "rises"), ("circles", "falls")):
            label = f"{method}, speed {direction}"
            handles.append(Line2D([], [], color="black", label=label, **looks[style]))
    return handles
