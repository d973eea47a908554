"""Pressure over the flank, and load and root stress over the face width."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fegear.contact.path import face_along_path
from fegear.contact.result import FaceLoads
from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.statics.mesh_result import StaticsResult
    from fegear.statics.root_stress import RootOverWidth

BEYOND_PATH = 0.15  # that is drawn of the path on either side [base pitches]
PATH_POINTS = 400


def draw_face(result: StaticsResult, title: str = "") -> Figure:
    """Largest pressure on a flank at the largest torque, and what is over the width.

    A tooth passes all places of the path in one turn.
    """
    cycle, (start, end) = result.cycle, result.problem.pair.path
    face = cycle.face
    if face.is_uniform:
        raise ValueError("loads are equal over the face width")
    largest = int(np.argmax(cycle.torque))
    over_width = result.roots.over_width if result.roots else ()
    heights = (3.0, 2.0, 2.0) if over_width else (3.0, 2.0)
    size = 9.0, 1.0 + 1.4 * sum(heights)
    figure, rows = panels(len(heights), size=size, heights=heights, share=True)
    flank, load, *of_roots = (row[0] for row in rows)
    path = np.linspace(start - BEYOND_PATH, end + BEYOND_PATH, PATH_POINTS)
    pressure = face_along_path(cycle, face.pressure[largest], path)
    half_step = 0.5 * (path[1] - path[0])
    # edges have no limit and would take all the colours
    most = np.where(face.on_path, face.pressure[largest], 0.0).max()
    drawn = flank.pcolormesh(
        1e3 * _slice_ends(face),
        np.append(path - half_step, path[-1] + half_step),
        1e-6 * pressure,
        rasterized=True,
        cmap="viridis",
        vmin=0.0,
        vmax=1e-6 * most,
    )
    label = "contact pressure [MPa], that of edges beyond the scale"
    figure.colorbar(drawn, ax=[row[0] for row in rows], label=label, extend="max")
    for place in (start, end):
        flank.axhline(place, color="0.4", linewidth=0.8, linestyle="--")
    flank.axhline(0.0, color="0.7", linewidth=0.8)
    flank.set_ylabel(
        "place on the path of contact\n[base pitches from the pitch point]"
    )
    flank.set_title(
        f"{cycle.torque[largest]:g} N m; dashed: ends of the path", fontsize=9
    )
    _draw_load(load, face, result)
    for axes in of_roots:
        _draw_roots(axes, over_width, result.cycle.torque)
    rows[-1][0].set_xlabel(
        "place over the face width [mm], from its middle: near end left, far end right"
    )
    draw_title(figure, title)
    return figure


def _slice_ends(face: FaceLoads) -> Array:
    """Ends of the slices, from the middle of the width (m + 1,) [m]."""
    half = 0.5 * face.width / face.place.size
    return np.append(face.place - half, face.place[-1] + half)


def _draw_load(axes: Axes, face: FaceLoads, result: StaticsResult) -> None:
    places = np.repeat(1e3 * _slice_ends(face), 2)[1:-1]
    for t, torque in enumerate(result.cycle.torque):
        per_width = 1e-3 * face.per_width[t]
        color, label = color_of(t), f"{torque:g} N m"
        low, high = per_width.min(axis=0), per_width.max(axis=0)
        # slices, of which the outer ones reach to the ends of the width
        below, above = np.repeat((low, high), 2, axis=1)
        axes.fill_between(places, below, above, color=color, alpha=0.2, linewidth=0)
        mean = np.repeat(per_width.mean(axis=0), 2)
        axes.plot(places, mean, color=color, lw=1.4, label=label)
    axes.set_ylabel("load per width of slices [N/mm]\nmean and range over the cycle")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def _draw_roots(axes: Axes, roots: Sequence[RootOverWidth], torques: Array) -> None:
    """Largest tension of all teeth over the cycle."""
    gears = ("driver", "-"), ("driven gear", "--")
    for t, torque in enumerate(torques):
        for root, (gear, style) in zip(roots, gears, strict=True):
            largest = 1e-6 * root.over_cycle[t]
            label = f"{gear}, {torque:g} N m"
            axes.plot(1e3 * root.place, largest, style, color=color_of(t), label=label)
    axes.set_ylabel("root stress [MPa]\nlargest over the cycle")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8, ncols=2)
