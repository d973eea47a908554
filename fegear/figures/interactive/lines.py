"""Lines of matplotlib as traces, and those across a panel as shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.figures.interactive.coordinates import FigurePanel, data_points, in_data
from fegear.figures.interactive.elements import Element, Elements, label_of, trace
from fegear.figures.interactive.styles import line_style, marker_style
from fegear.figures.interactive.texts import markup

if TYPE_CHECKING:
    from matplotlib.lines import Line2D

LINE_ZORDER = 2.0  # of lines in matplotlib; what is above it is above all traces


def add_line(elements: Elements, panel: FigurePanel, line: Line2D) -> None:
    """A trace; a shape for a line from side to side, which stays so at each zoom."""
    if line.get_markevery() is not None:
        raise TypeError("no interactive form of a line with some of its markers")
    joins, marks = line_style(line), marker_style(line)
    if joins is None and marks is None:
        return
    if marks is None and np.shape(line.get_xydata()) == (2, 2) and _spans(panel, line):
        elements.shapes.append(_spanning(panel, line))
        return
    x, y = data_points(panel, line.get_transform(), line.get_xydata()).T
    style: dict[str, Any] = {} if joins is None else {"line": joins}
    if marks is not None:
        style["marker"] = marks
    mode = "+".join(["lines"] * (joins is not None) + ["markers"] * (marks is not None))
    elements.traces.append(trace(panel, line, x, y, mode=mode, **style))


def _spans(panel: FigurePanel, line: Line2D) -> bool:
    """Whether x or y of a line are parts of the panel."""
    transforms = panel.axes.get_xaxis_transform(), panel.axes.get_yaxis_transform()
    return line.get_transform() in (*transforms, panel.axes.transAxes)


def _spanning(panel: FigurePanel, line: Line2D) -> Element:
    style = line_style(line) or {}
    style.pop("shape", None)
    (x0, y0), (x1, y1) = np.asarray(line.get_xydata(), float).tolist()
    corners = {"x0": x0, "y0": y0, "x1": x1, "y1": y1}
    return {
        "type": "line",
        "line": style,
        "name": markup(label_of(line)),
        **corners,
        **references(panel, line.get_transform()),
        "layer": layer(line.get_zorder()),
    }


def references(panel: FigurePanel, transform: Any) -> dict[str, str]:
    """Axes or, for parts of the panel, domains that coordinates are measured in."""
    x_is_data, y_is_data = in_data(panel, transform)
    return {
        "xref": panel.x if x_is_data else f"{panel.x} domain",
        "yref": panel.y if y_is_data else f"{panel.y} domain",
    }


def layer(zorder: float) -> str:
    """Layer of a shape beside traces."""
    return "above" if zorder > LINE_ZORDER else "below"
