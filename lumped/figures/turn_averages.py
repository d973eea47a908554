"""Averages of signals over a turn of a gear, their residuals and lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.common.array_types import Array
from lumped.figures.drawing import draw_legend, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN_HARMONICS = 4  # of the mesh, in spectra
MIN_RELATIVE_AMPLITUDE = 1e-4  # of lines that are drawn, over the largest
MESH_COLOR, SIDEBAND_COLOR, PEAK_COLOR = "black", "tab:red", "tab:blue"


@dataclass(frozen=True, eq=False, kw_only=True)
class AverageCurves:
    """Average of one signal over a turn.

    name : of the signal, with its unit
    average, residual : (p,) without the mean
    amplitude : (p // 2 + 1,) at 0, 1, ... cycles per turn
    has_residual : whether the residual is more than round-off
    """

    name: str
    average: Array
    residual: Array
    amplitude: Array
    has_residual: bool


def draw_turn_averages(
    curves: Sequence[AverageCurves], tooth: Array, orders: Sequence[int], title: str
) -> Figure:
    """Plot average, residual and spectrum of each signal.

    tooth : (p,) rising over a turn, whole where a tooth is at the pitch point
    orders : cycles per turn whose multiples are those of meshes
    """
    rows, teeth = len(curves), round(len(tooth) * float(tooth[1] - tooth[0]))
    figure, axes_grid = panels(rows, 3, size=(14.0, 1.2 + 2.5 * rows))
    for (average, residual, lines), one in zip(axes_grid, curves, strict=True):
        _draw_over_turn(average, residual, one, tooth)
        _draw_lines(lines, one, teeth, orders)
        for axes in (average, residual):
            axes.set_xlim(tooth[0], tooth[0] + teeth)
    titles = "average over a turn, without mean", "residual", "spectrum of the average"
    for axes, heading in zip(axes_grid[0], titles, strict=True):
        axes.set_title(heading, fontsize=10)
    for axes in axes_grid[-1][:2]:
        axes.set_xlabel("tooth at the pitch point")
    axes_grid[-1][2].set_xlabel("cycles per turn")
    _draw_legend(figure)
    draw_title(figure, title)
    return figure


def draw_measured_averages(
    measured: Sequence[AverageCurves],
    computed: Sequence[AverageCurves],
    tooth: Array,
    orders: Sequence[int],
    title: str,
) -> Figure:
    """Plot average and spectrum of measured signals, and beside them of computed ones.

    computed : empty where there are none
    tooth, orders : as in `draw_turn_averages`
    """
    rows = max(len(measured), len(computed))
    sides = [("measured", measured)] + [("computed", computed)] * bool(computed)
    size = 1.0 + 6.5 * len(sides), 1.4 + 2.5 * rows
    figure, axes_grid = panels(rows, 2 * len(sides), size=size)
    teeth = round(len(tooth) * float(tooth[1] - tooth[0]))
    for side, (name, curves) in enumerate(sides):
        pairs = [axes_row[2 * side : 2 * side + 2] for axes_row in axes_grid]
        for average, lines in pairs[len(curves) :]:
            average.set_visible(False)
            lines.set_visible(False)
        pairs = pairs[: len(curves)]
        for (average, lines), one in zip(pairs, curves, strict=True):
            average.plot(tooth, one.average, "k", lw=0.9)
            average.set_ylabel(one.name)
            average.set_xlim(tooth[0], tooth[0] + teeth)
            _draw_lines(lines, one, teeth, orders)
        pairs[0][0].set_title(f"{name}: average over a turn, without mean", fontsize=10)
        pairs[0][1].set_title(f"{name}: spectrum of the average", fontsize=10)
        pairs[-1][0].set_xlabel("tooth at the pitch point")
        pairs[-1][1].set_xlabel("cycles per turn")
    draw_legend(figure, _legend_lines(), 2)
    draw_title(figure, title)
    return figure


def draw_averages_of_gears(
    curves: Sequence[AverageCurves], tooth: Sequence[Array], title: str
) -> Figure:
    """Plot average and residual of one signal over the turns of several gears.

    Residuals have one scale.

    curves : of each gear, named after it
    tooth : (p,) of each gear as in `draw_turn_averages`
    """
    rows = len(curves)
    figure, axes_grid = panels(rows, 2, size=(11.0, 1.2 + 1.9 * rows))
    for (average, residual), one, axis in zip(axes_grid, curves, tooth, strict=True):
        _draw_over_turn(average, residual, one, axis)
        for axes in (average, residual):
            axes.set_xlim(axis[0], 2.0 * axis[-1] - axis[-2])
    largest = max(residual.get_ylim()[1] for _, residual in axes_grid)
    for _, residual in axes_grid:
        residual.set_ylim(-largest, largest)
    headings = "average over the teeth, without mean", "residual"
    for axes, heading in zip(axes_grid[0], headings, strict=True):
        axes.set_title(heading, fontsize=10)
    for axes in axes_grid[-1]:
        axes.set_xlabel("tooth at the pitch point")
    draw_title(figure, title)
    return figure


def _draw_over_turn(
    average: Axes, residual: Axes, curves: AverageCurves, tooth: Array
) -> None:
    average.plot(tooth, curves.average, "k", lw=0.9)
    average.set_ylabel(curves.name)
    height = curves.residual if curves.has_residual else np.zeros_like(curves.residual)
    residual.plot(tooth, height, color=SIDEBAND_COLOR, lw=0.9)
    if curves.has_residual:
        peak = int(np.abs(height).argmax())
        residual.plot(tooth[[peak]], height[[peak]], "o", color=PEAK_COLOR, ms=5)
    residual.set_ylim(*_limits(curves))


def _limits(curves: AverageCurves) -> tuple[float, float]:
    """Limits of the ordinate: of the residual, or of the average without one."""
    shown = curves.residual if curves.has_residual else curves.average
    largest = 1.15 * float(np.abs(shown).max()) or 1.0
    return -largest, largest


def _draw_lines(
    axes: Axes, curves: AverageCurves, teeth: int, orders: Sequence[int]
) -> None:
    order = np.arange(curves.amplitude.size)
    last = (SHOWN_HARMONICS + 0.5) * teeth
    shown = (order > 0) & (order <= last)
    largest = float(curves.amplitude[shown].max(initial=0.0)) or 1.0
    floor = MIN_RELATIVE_AMPLITUDE * largest
    shown &= curves.amplitude > floor
    of_mesh = np.any([order % one == 0 for one in orders], axis=0)
    for chosen, color in ((shown & ~of_mesh, SIDEBAND_COLOR), (shown & of_mesh, "k")):
        axes.vlines(order[chosen], floor, curves.amplitude[chosen], color=color, lw=1.0)
    axes.set_yscale("log")
    axes.set_ylim(floor, 3.0 * largest)
    axes.set_xlim(0.0, last)
    axes.set_xticks([harmonic * teeth for harmonic in range(SHOWN_HARMONICS + 1)])


def _draw_legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    peak = {"color": PEAK_COLOR, "marker": "o", "ls": "none", "ms": 5}
    handles = [
        *_legend_lines(),
        Line2D([], [], label="largest residual", **peak),  # type: ignore[arg-type]
    ]
    draw_legend(figure, handles, len(handles))


def _legend_lines() -> list[Any]:
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=MESH_COLOR, lw=1.2, label="multiples of the mesh"),
        Line2D([], [], color=SIDEBAND_COLOR, lw=1.2, label="sidebands, residual"),
    ]
