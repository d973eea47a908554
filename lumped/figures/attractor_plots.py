"""Bifurcation diagrams: Poincaré sections and exponents over a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.attractors.attractor_sweeps import AttractorBranch
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOR_NUMBERS = {"up": 0, "down": 1}  # numbers of the colours
MARKER_SIZES = (
    (1_000, 4.5),
    (20_000, 2.5),
)  # largest number of points of a panel, their size
MIN_MARKER_SIZE = 0.9  # size of more points


def draw_attractors(
    branches: Sequence[AttractorBranch], label: str, title: str = ""
) -> Figure:
    """Plot deflections at the start of common periods, with a panel for each mesh, and
    below them the largest Lyapunov exponent.

    label : label of the parameter
    """
    meshes = max(
        attractor.deflection.shape[1] for b in branches for attractor in b.attractors
    )
    heights = (*[2.2] * meshes, 1.3)
    size = (9.0, 3.0 + 3.0 * meshes)
    figure, rows = panels(meshes + 1, size=size, heights=heights, share=True)
    for m, (axes,) in enumerate(rows[:-1]):
        for branch in branches:
            _draw_sections(axes, branch, m)
        axes.set_ylabel(f"mesh {m + 1}: dynamic transmission\nerror at sections [um]")
        axes.margins(x=0.01)
    (axes,) = rows[-1]
    axes.axhline(0.0, color="0.4", lw=0.8)
    for branch in branches:
        exponents = [attractor.exponent for attractor in branch.attractors]
        color = color_of(COLOR_NUMBERS[branch.direction])
        axes.plot(branch.values, exponents, ".-", color=color, lw=0.9, ms=2.5)
    axes.set_ylabel("largest Lyapunov\nexponent [1/period]")
    axes.set_xlabel(label)
    draw_legend(figure, _handles(branches), 2)
    draw_title(figure, title)
    return figure


def _draw_sections(axes: Axes, branch: AttractorBranch, m: int) -> None:
    points = [attractor.deflection[:, m] for attractor in branch.attractors]
    values = np.repeat(branch.values, [section.size for section in points])
    size = next(
        (size for max_points, size in MARKER_SIZES if values.size < max_points),
        MIN_MARKER_SIZE,
    )
    color = color_of(COLOR_NUMBERS[branch.direction])
    errors = 1e6 * np.concatenate(points)
    axes.plot(values, errors, ".", color=color, ms=size, mew=0.0, rasterized=True)


def _handles(branches: Sequence[AttractorBranch]) -> list[Any]:
    from matplotlib.lines import Line2D

    dot: dict[str, Any] = {"ls": "", "marker": "o", "ms": 4}
    return [
        Line2D([], [], **dot, color=color_of(COLOR_NUMBERS[direction]), label=text)
        for direction, text in (("up", "rising values"), ("down", "falling values"))
        if any(branch.direction == direction for branch in branches)
    ]
