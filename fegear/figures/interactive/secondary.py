"""Secondary axes: numbers of another unit along a side of a panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fegear.figures.interactive.coordinates import FigurePanel, from_screen
from fegear.figures.interactive.elements import Element
from fegear.figures.interactive.texts import markup, number_markup


def secondary_axes(
    traces: list[Element], panels: Sequence[FigurePanel]
) -> dict[str, Element]:
    """Axes by name; each needs a trace, which has no points, to be shown."""
    from matplotlib.axes._secondary_axes import SecondaryAxis

    axes_by_name: dict[str, Element] = {}
    for panel in panels:
        for child in panel.axes.child_axes:
            if isinstance(child, SecondaryAxis) and child.get_visible():
                number = len(panels) + len(axes_by_name) + 1
                key = child._orientation  # type: ignore[attr-defined]
                axes_by_name[f"{key}axis{number}"] = _axis(panel, child, key)
                ends = {
                    "xaxis": panel.x,
                    "yaxis": panel.y,
                    f"{key}axis": f"{key}{number}",
                }
                point: Element = {"type": "scatter", "x": [None], "y": [None]}
                traces.append(point | ends | {"showlegend": False, "hoverinfo": "skip"})
    return axes_by_name


def _axis(panel: FigurePanel, child: Any, key: str) -> Element:
    """An axis on that of the panel, with the numbers of the other unit."""
    is_x = key == "x"
    axis = child.xaxis if is_x else child.yaxis
    low, high = sorted(axis.get_view_interval())
    places = [place for place in axis.get_majorticklocs() if low <= place <= high]
    points = np.zeros((len(places), 2)) + np.array(places)[:, None]
    column = 0 if is_x else 1
    screen = child.transData.transform(points)
    screen[:, 1 - column] = panel.axes.bbox.get_points()[0, 1 - column]
    texts = axis.get_major_formatter().format_ticks(places)
    label = child.get_xlabel() if is_x else child.get_ylabel()
    side = child._loc
    return {
        "overlaying": panel.x if is_x else panel.y,
        "showgrid": False,
        "matches": panel.x if is_x else panel.y,
        "tickmode": "array",
        "tickvals": from_screen(panel, screen)[:, column].tolist(),
        "ticktext": [number_markup(text) for text in texts],
        "side": side if isinstance(side, str) else ("top" if is_x else "right"),
        "anchor": panel.y if is_x else panel.x,
        "title": {"text": markup(label)},
        "ticks": "outside",
        "zeroline": False,
    }
