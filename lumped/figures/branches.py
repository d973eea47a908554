"""Plots of branches of periodic motions over a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.branches.points import KINDS, BranchPoint, PeriodicBranch
from lumped.continuation.bifurcations import stability_segments
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = dict(zip(KINDS, "odsx", strict=True))


def draw_branches(
    branches: Sequence[PeriodicBranch], label: str, title: str = ""
) -> Figure:
    """Plot the RMS of the dynamic transmission error, with a panel for each mesh.

    Stable motions are solid lines, unstable ones dashed.

    label : label of the parameter, with its unit
    """
    meshes = branches[0].points[0].figures["dte_rms"].size
    figure, rows = panels(meshes, size=(9.0, 1.4 + 3.4 * meshes), share=True)
    multiples = sorted({branch.multiple for branch in branches})
    for m, (axes,) in enumerate(rows):
        for branch in branches:
            _draw_branch(axes, branch, m, color_of(multiples.index(branch.multiple)))
        axes.set_ylabel(f"mesh {m + 1}: RMS of dynamic\ntransmission error [um]")
        axes.set_ylim(bottom=0.0)
        axes.margins(x=0.01)
    rows[-1][0].set_xlabel(label)
    draw_legend(figure, _handles(branches, multiples), 4)
    draw_title(figure, title)
    return figure


def _draw_branch(axes: Axes, branch: PeriodicBranch, m: int, color: str) -> None:
    for stable, points in stability_segments(branch.points):
        axes.plot(*_curve(points, m), color=color, ls="-" if stable else "--", lw=1.3)
    for point in branch.bifurcations:
        axes.plot(*_curve([point], m), MARKERS[point.kind], color=color, ms=4)


def _curve(points: Sequence[BranchPoint], m: int) -> tuple[Any, Any]:
    rms = [1e6 * point.figures["dte_rms"][m] for point in points]
    return np.array([point.parameter for point in points]), np.array(rms)


def _handles(branches: Sequence[PeriodicBranch], multiples: Sequence[int]) -> list[Any]:
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color=color_of(i), label=f"repeats after {multiple} periods")
        for i, multiple in enumerate(multiples)
    ]
    lines[0].set_label("repeats after 1 period" if multiples[0] == 1 else "")
    lines += [
        Line2D([], [], color="k", label="stable"),
        Line2D([], [], color="k", ls="--", label="unstable"),
    ]
    kinds = {point.kind for branch in branches for point in branch.bifurcations}
    marks = [
        Line2D([], [], color="k", ls="", marker=marker, label=kind)
        for kind, marker in MARKERS.items()
        if kind in kinds
    ]
    return lines + marks
