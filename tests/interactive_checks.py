"""What an interactive figure has in common with its figure of matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D


def check_figure(figure: Figure, shown: Any) -> None:
    """Lines with their data, entries of legends, and scales of axes are the same."""
    for axes in figure.axes:
        if axes.get_visible() and not hasattr(axes, "_colorbar"):
            for line in axes.lines:
                assert _is_drawn(line, shown), line
    entries = sum("showlegend" in t and bool(t.showlegend) for t in shown.data)
    assert entries == sum(len(legend.get_texts()) for legend in _legends(figure))
    scales = {
        scale
        for axes in figure.axes
        if axes.get_visible() and not hasattr(axes, "_colorbar")
        for scale in (axes.get_xscale(), axes.get_yscale())
    }
    names = [n for n in shown.layout.to_plotly_json() if n[1:5] == "axis"]
    assert {shown.layout[name].type or "linear" for name in names} == scales
    assert set(shown.layout.meta) == {"breakpoint", "narrow", "wide"}


def _is_drawn(line: Line2D, shown: Any) -> bool:
    """Whether a trace, or a shape across a panel, has all points of a line."""
    if not line.get_visible() or (
        line.get_linestyle() == "None" and line.get_marker() in ("None", None, "")
    ):
        return True
    x, y = (np.asarray(values, float) for values in line.get_data(orig=False))
    for trace in shown.data:
        if trace.type == "scatter" and len(trace.x) == x.size:
            pair = np.array(trace.x, float), np.array(trace.y, float)
            if all(map(_equal, pair, (x, y))):
                return True
    corners = [x[0], y[0], x[-1], y[-1]]
    return any([s.x0, s.y0, s.x1, s.y1] == corners for s in shown.layout.shapes)


def _equal(one: np.ndarray, two: np.ndarray) -> bool:
    return bool(np.array_equal(one, two, equal_nan=True))


def _legends(figure: Figure) -> list[Legend]:
    return [legend for legend in figure.findobj(Legend) if legend.get_visible()]
