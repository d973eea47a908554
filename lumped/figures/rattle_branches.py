"""Plots of branches of orbits and of curves of bifurcations over parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.common.array_types import Array
from lumped.continuation.bifurcations import DOUBLING, FOLD, stability_segments
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels
from lumped.rattle.branches import GRAZING, OrbitBranch
from lumped.rattle.curves import GRAZING_FOLD, BifurcationCurve

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = {FOLD: "-", DOUBLING: "-.", GRAZING: "--"}
MARKERS = {FOLD: "o", DOUBLING: "d", GRAZING: "x"}


def draw_orbit_branches(
    branches: Sequence[OrbitBranch],
    settled: Array,
    limits: tuple[float, float],
    label: str,
    title: str,
) -> Figure:
    """Plot speeds of lift-off from the upper flank over a parameter of the machine.

    Stable orbits are solid lines, unstable ones dashed.

    settled : (d, 2) values and speeds at the end of long runs
    limits : limits of the parameter
    label : label of the parameter, with its unit
    """
    figure, ((axes,),) = panels(1, size=(8.0, 5.5))
    axes.plot(*settled.T, ".", color="0.6", ms=1.5, zorder=0)
    names = list(dict.fromkeys(branch.itinerary.name for branch in branches))
    for branch in branches:
        color = color_of(names.index(branch.itinerary.name))
        for stable, points in stability_segments(branch.points):
            values = [point.parameter for point in points]
            speeds = [[speed for _, speed in point.departures] for point in points]
            style = "-" if stable else "--"
            axes.plot(values, np.array(speeds), color=color, ls=style, lw=1.3)
        for point in branch.bifurcations:
            for _, speed in point.departures:
                axes.plot(
                    point.parameter, speed, MARKERS[point.kind], color=color, ms=5
                )
    axes.set_xlabel(label)
    axes.set_ylabel("speed of lift-off [rad per turn]")
    axes.set_xlim(*limits)
    axes.set_ylim(bottom=0.0)
    draw_legend(figure, _handles(branches, names), 4)
    draw_title(figure, title)
    return figure


def draw_curves(
    curves: Sequence[BifurcationCurve], labels: Sequence[str], title: str
) -> Figure:
    """Plot bifurcations over two parameters.

    labels : labels of both parameters, with their units
    """
    figure, ((axes,),) = panels(1, size=(8.0, 5.5))
    for number, curve in enumerate(curves):
        values = [(point.first, point.second) for point in curve.points]
        name = f"{curve.kind} of {curve.itinerary.name}"
        style = STYLES[curve.kind]
        axes.plot(*np.array(values).T, style, color=color_of(number), label=name)
        for point in curve.points:
            if point.kind == GRAZING_FOLD:
                axes.plot(point.first, point.second, "k*", ms=10)
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    handles = axes.get_legend_handles_labels()[0]
    draw_legend(figure, handles, 3)
    draw_title(figure, title)
    return figure


def _handles(branches: Sequence[OrbitBranch], names: Sequence[str]) -> list[Any]:
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color=color_of(i), label=name) for i, name in enumerate(names)
    ]
    lines += [
        Line2D([], [], color="k", label="stable"),
        Line2D([], [], color="k", ls="--", label="unstable"),
        Line2D([], [], color="0.6", ls="", marker=".", label="long runs"),
    ]
    kinds = {point.kind for branch in branches for point in branch.bifurcations}
    marks = [
        Line2D([], [], color="k", ls="", marker=marker, label=kind)
        for kind, marker in MARKERS.items()
        if kind in kinds
    ]
    return lines + marks
