"""Pressure over the flank, and load and root stress over the face width."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fegear.commands.stiffness.figure import torque_colors
from fegear.contact.path import face_along_path
from fegear.contact.result import FaceLoads
from lumped.common.array_types import Array, Indices
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

    from fegear.statics.mesh_result import StaticsResult
    from fegear.statics.root_stress import RootOverWidth

BEYOND_PATH = 0.15  # that is drawn of the path on either side [base pitches]
PATH_POINTS = 400
LEGEND_ROOM = 1.35  # height of a panel over that of its curves, for the legend
PLACES_LABEL = (
    "place over the face width [mm], from its middle: near end left, far end right"
)


def draw_face(result: StaticsResult, title: str = "") -> Figure:
    """Largest pressure on a flank at the largest torque, and what is over the width.

    A tooth passes all places of the path in one turn.
    """
    if result.cycle.face.is_uniform:
        raise ValueError("loads are equal over the face width")
    over_width = result.roots.over_width if result.roots else ()
    heights = (3.0, 2.0, 2.0) if over_width else (3.0, 2.0)
    size = 9.0, 1.0 + 1.4 * sum(heights)
    figure, rows = panels(len(heights), size=size, heights=heights, share=True)
    flank, load, *of_roots = (row[0] for row in rows)
    drawn = draw_flank(flank, result)
    label = "contact pressure [MPa], that of edges beyond the scale"
    figure.colorbar(drawn, ax=[row[0] for row in rows], label=label, extend="max")
    draw_load(load, result)
    for axes in of_roots:
        draw_roots(axes, result, over_width)
    rows[-1][0].set_xlabel(PLACES_LABEL)
    draw_title(figure, title)
    return figure


def draw_flank(flank: Axes, result: StaticsResult) -> QuadMesh:
    """Draw the contact pattern: the largest pressure at the largest torque."""
    cycle, (start, end) = result.cycle, result.problem.pair.path
    face, largest = cycle.face, int(np.argmax(cycle.torque))
    path = np.linspace(start - BEYOND_PATH, end + BEYOND_PATH, PATH_POINTS)
    pressure = face_along_path(cycle, face.pressure[largest], path)
    half_step = 0.5 * (path[1] - path[0])
    # edges have no limit and would take all the colours
    most = np.where(face.on_path, face.pressure[largest], 0.0).max()
    ends, of_slice = _slice_ends(face)
    drawn = flank.pcolormesh(
        1e3 * ends,
        np.append(path - half_step, path[-1] + half_step),
        1e-6 * np.ma.masked_invalid(_in_places(pressure, of_slice)),
        rasterized=True,
        cmap="viridis",
        vmin=0.0,
        vmax=1e-6 * most,
    )
    for place in (start, end):
        flank.axhline(place, color="0.4", linewidth=0.8, linestyle="--")
    flank.axhline(0.0, color="0.7", linewidth=0.8)
    flank.set_ylabel(
        "place on the path of contact\n[base pitches from the pitch point]"
    )
    flank.set_title(
        f"{cycle.torque[largest]:g} N m; dashed: ends of the path", fontsize=9
    )
    return drawn


def _slice_ends(face: FaceLoads) -> tuple[Array, Indices]:
    """Ends of stretches from the middle of the width (s + 1,) [m], and their slices.

    A groove is a stretch of its own, of slice -1.
    """
    half, count = 0.5 * face.width / face.place.size, face.place.size
    ends = np.append(face.place - half, face.place[-1] + half)
    if not face.groove:
        return ends, np.arange(count)
    middle = count // 2
    return (
        np.insert(ends, middle, -0.5 * face.groove),
        np.insert(np.arange(count), middle, -1),
    )


def _in_places(values: Array, of_slice: Indices) -> Array:
    """Values (..., m) of slices over the stretches of the width, NaN in a groove."""
    return np.where(of_slice < 0, np.nan, values[..., of_slice])


def draw_load(axes: Axes, result: StaticsResult) -> None:
    """Draw the load per width at every torque, its mean and range over the cycle."""
    face = result.cycle.face
    ends, of_slice = _slice_ends(face)
    places = np.repeat(1e3 * ends, 2)[1:-1]
    colors = torque_colors(result.table)
    for t, torque in enumerate(result.cycle.torque):
        per_width = 1e-3 * face.per_width[t]
        color, label = colors[t], f"{torque:g} N m"
        low, high, mean = (
            _in_places(reduce(per_width, axis=0), of_slice)
            for reduce in (np.min, np.max, np.mean)
        )
        # slices, of which the outer ones reach to the ends of the width
        below, above = np.repeat((low, high), 2, axis=1)
        axes.fill_between(places, below, above, color=color, alpha=0.2, linewidth=0)
        axes.plot(places, np.repeat(mean, 2), color=color, lw=1.4, label=label)
    axes.set_ylabel("load per width of slices [N/mm]\nmean and range over the cycle")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def draw_roots(
    axes: Axes, result: StaticsResult, roots: Sequence[RootOverWidth]
) -> None:
    """Draw the largest tension of all teeth over the cycle."""
    gears = ("driver", "-"), ("driven gear", "--")
    colors = torque_colors(result.table)
    for t, torque in enumerate(result.cycle.torque):
        for root, (gear, style) in zip(roots, gears, strict=True):
            largest = 1e-6 * root.over_cycle[t]
            label = f"{gear}, {torque:g} N m"
            place = 1e3 * root.place
            if result.cycle.face.groove:
                at = place.size // 2
                place, largest = (
                    np.insert(place, at, 0.0),
                    np.insert(largest, at, np.nan),
                )
            axes.plot(place, largest, style, color=colors[t], label=label)
    axes.set_ylabel("root stress [MPa]\nlargest over the cycle")
    axes.set_ylim(0.0, LEGEND_ROOM * axes.get_ylim()[1])
    axes.legend(fontsize=8, ncols=2)
