"""Stability charts: growth of vibration over speed and a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.figures.drawing import COLORS, draw_legend, draw_title, panels
from lumped.stability.intervals import StabilityScan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Label and colour of combinations other than the widest
OTHERS_LABEL, OTHERS_COLOR = "others", "0.6"


def draw_chart(
    values: Sequence[float],
    columns: Sequence[StabilityScan],
    speeds: tuple[float, float],
    label: str,
    title: str,
) -> Figure:
    """Plot intervals of speed over a parameter, coloured by the modes that take part.

    The widest have individual colours. Edges by perturbation are dashed.

    label : label of the parameter
    """
    from matplotlib.patches import Patch

    figure, ((axes,),) = panels(1, size=(9.0, 7.0))
    spans: dict[str, float] = {}
    for column in columns:
        for interval in column.intervals:
            spans[interval.kind] = (
                spans.get(interval.kind, 0.0) + interval.high - interval.low
            )
    widest = sorted(spans, key=lambda kind: -spans[kind])
    named = dict(zip(widest, COLORS, strict=False))
    handles: list[Any] = []
    for kind in widest[len(named) :]:
        _fill(axes, values, columns, kind, OTHERS_COLOR)
    for kind, color in named.items():
        handles.append(_fill(axes, values, columns, kind, color))
        handles[-1].set_label(kind)
    if len(widest) > len(named):
        handles.append(Patch(color=OTHERS_COLOR, label=OTHERS_LABEL))
    handles += _draw_expected(axes, values, columns)
    if len(set(values)) > 1:
        axes.set_xlim(min(values), max(values))
    axes.set_ylim(*speeds)
    axes.set_xlabel(label)
    axes.set_ylabel("mesh frequency of the first mesh [Hz]")
    if handles:
        draw_legend(figure, handles, 4)
    draw_title(figure, title)
    return figure


def _fill(
    axes: Axes,
    values: Sequence[float],
    columns: Sequence[StabilityScan],
    kind: str,
    color: str,
) -> Any:
    """Fill areas of one kind, joining intervals that overlap at successive values."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.patches import Patch

    intervals = [[i for i in c.intervals if i.kind == kind] for c in columns]
    areas = [
        [(x, one.low), (y, two.low), (y, two.high), (x, one.high)]
        for (x, left), (y, right) in pairwise(zip(values, intervals, strict=True))
        for one in left
        for two in right
        if one.low <= two.high and two.low <= one.high
    ]
    lines = [
        [(x, interval.low), (x, interval.high)]
        for x, column in zip(values, intervals, strict=True)
        for interval in column
    ]
    look: dict[str, Any] = {"color": color, "lw": 1.0, "zorder": 2}
    axes.add_collection(PolyCollection(areas, **look))
    axes.add_collection(LineCollection(lines, **look))
    return Patch(color=color)


def _draw_expected(
    axes: Axes, values: Sequence[float], columns: Sequence[StabilityScan]
) -> list[Any]:
    pairs = [
        (combination.name, value, combination.low, combination.high)
        for value, column in zip(values, columns, strict=True)
        for combination in column.expected
        if combination.unstable
    ]
    lines: list[Any] = []
    for _, group in groupby(sorted(pairs), key=lambda pair: pair[0]):
        rows = np.array([pair[1:] for pair in group])
        for edge in (1, 2):
            lines = axes.plot(rows[:, 0], rows[:, edge], "k--", lw=0.7, zorder=3)
    if lines:
        lines[0].set_label("perturbation")
    return lines[:1]
