"""Indicators of signals over the sizes of faults, or over another axis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Labelled = tuple[str, NDArray[Any]]
MAX_GROUPS = 6  # colours of the second axis; further values share them in ranges


@dataclass(frozen=True, eq=False, kw_only=True)
class IndicatorPoints:
    """Indicators of one signal.

    name, unit : of the signal
    residual : (r,) RMS of the residual of every run; kurtosis : (r,) of it
    """

    name: str
    unit: str
    residual: Array
    kurtosis: Array


def draw_indicators(
    signals: Sequence[IndicatorPoints],
    abscissa: Labelled,
    groups: Labelled | None,
    title: str,
) -> Figure:
    """Plot RMS and kurtosis of the residuals of signals over an axis.

    abscissa : label and values (r,) of the axis
    groups : of another axis, whose values give colours, or None
    """
    rows = len(signals)
    figure, axes_grid = panels(rows, 2, size=(11.0, 1.6 + 2.4 * rows))
    label, values = abscissa
    members = list(_grouped(groups, len(values)))
    for (left, right), signal in zip(axes_grid, signals, strict=True):
        for axes, heights in ((left, signal.residual), (right, signal.kurtosis)):
            for number, (text, chosen) in enumerate(members):
                axes.plot(
                    *(values[chosen], heights[chosen], "o"),
                    color=color_of(number),
                    ms=4,
                    label=text,
                )
        left.set_ylabel(f"{signal.name}\n[{signal.unit}]")
    titles = "RMS of the residual", "kurtosis of the residual"
    for axes, heading in zip(axes_grid[0], titles, strict=True):
        axes.set_title(heading, fontsize=10)
    for axes in axes_grid[-1]:
        axes.set_xlabel(label)
    if groups is not None:
        draw_legend(figure, axes_grid[0][0].lines, columns=3)
    draw_title(figure, title)
    return figure


def _grouped(
    groups: Labelled | None, count: int
) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Texts and members (r,) of groups with equal or near values."""
    if groups is None:
        yield "", np.ones(count, bool)
        return
    label, values = groups
    distinct = np.unique(values)
    for part in np.array_split(distinct, min(MAX_GROUPS, len(distinct))):
        span = f"{part[0]:.6g}"
        if len(part) > 1:
            span += f" to {part[-1]:.6g}"
        yield f"{label} {span}", (values >= part[0]) & (values <= part[-1])
