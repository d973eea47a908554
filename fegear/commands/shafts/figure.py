"""Deflections and bending moments of shafts, and loads over the width of meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.shafts.loads import MeshOnShafts, ShaftUnderLoad
from lumped.common.array_types import Array
from lumped.figures.drawing import draw_legend, draw_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

PANEL = 3.6, 2.7  # size of a panel [inch]
MIN_WIDTH = 7.2  # of the figure, for the legend [inch]
AXES = "xy"
AXIS_COLORS = "tab:blue", "tab:orange"
YIELDING, HELD = "tab:purple", "0.5"
GEAR_COLOR, BEARING_COLOR = "tab:green", "k"


def draw_shafts(
    shafts: Sequence[ShaftUnderLoad], meshes: Sequence[MeshOnShafts], title: str = ""
) -> Figure:
    """Draw a column for every shaft, and below them a panel for every mesh.

    The first row has deflections, the second one bending moments, the third one the
    load over the face width, which is a mean over the mesh cycle.
    """
    from matplotlib.figure import Figure

    size = max(MIN_WIDTH, PANEL[0] * max(len(shafts), len(meshes))), 3.3 * PANEL[1]
    figure = Figure(figsize=size, layout="constrained")
    # as many columns as both rows of panels divide
    grid = figure.add_gridspec(3, math.lcm(len(shafts), len(meshes)))
    top = _panels(figure, grid, (0, 1), len(shafts))
    bottom = _panels(figure, grid, (2,), len(meshes))
    for (deflection, moment), shaft in zip(top.T, shafts, strict=True):
        _draw_deflection(deflection, shaft)
        _draw_moment(moment, shaft)
    top[0, 0].set_ylabel("deflection of the axis [um]")
    top[1, 0].set_ylabel("bending moment [N m]")
    for axes, mesh in zip(bottom[0], meshes, strict=True):
        _draw_load(axes, mesh)
    bottom[0, 0].set_ylabel("load per width [N/mm]")
    for axes in (*top.flat, *bottom.flat):
        axes.grid(alpha=0.25)
    handles = [
        *top[0, 0].get_legend_handles_labels()[0],
        *bottom[0, 0].get_legend_handles_labels()[0],
    ]
    draw_legend(figure, handles, len(handles))
    draw_title(figure, title)
    return figure


def _panels(
    figure: Figure, grid: GridSpec, rows: Sequence[int], count: int
) -> NDArray[Any]:
    """Axes (rows, count) of rows of a grid, with shared scales of each row."""
    step = grid.ncols // count
    panels = np.empty((len(rows), count), object)
    for i, row in enumerate(rows):
        for j in range(count):
            panels[i, j] = figure.add_subplot(
                grid[row, step * j : step * (j + 1)],
                sharex=panels[0, j] if i else None,
                sharey=panels[i, 0] if j and len(rows) > 1 else None,
            )
    if len(rows) > 1:
        for axes in panels[:-1].flat:
            axes.tick_params(labelbottom=False)
        for axes in panels[:, 1:].flat:
            axes.tick_params(labelleft=False)
    return panels


def _draw_deflection(axes: Axes, shaft: ShaftUnderLoad) -> None:
    place = 1e3 * shaft.solution.position
    for axis, color, values in zip(
        AXES, AXIS_COLORS, 1e6 * shaft.solution.deflection.T[:2], strict=True
    ):
        axes.plot(place, values, color=color, label=f"along or about {axis}")
    _mark_parts(axes, shaft)
    axes.set_title(f"shaft {shaft.number}: {shaft.gears}", fontsize=9)


def _draw_moment(axes: Axes, shaft: ShaftUnderLoad) -> None:
    place = np.repeat(1e3 * shaft.solution.position, 2)
    for axis, color in enumerate(AXIS_COLORS):
        axes.plot(place, shaft.solution.moment[..., axis].ravel(), color=color)
    _mark_parts(axes, shaft)
    axes.set_xlabel("place from the near end [mm]")


def _mark_parts(axes: Axes, shaft: ShaftUnderLoad) -> None:
    """Mark bearings and gears on the line of zero."""
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    for positions, marker, color, label in (
        (shaft.bearing_positions, "^", BEARING_COLOR, "bearing"),
        (shaft.gear_positions, "s", GEAR_COLOR, "middle of a gear"),
    ):
        axes.plot(
            1e3 * np.array(positions),
            np.zeros(len(positions)),
            marker,
            color=color,
            label=label,
            linestyle="none",
        )


def _draw_load(axes: Axes, mesh: MeshOnShafts) -> None:
    half = 0.5 * mesh.width / mesh.place.size
    places = 1e3 * np.stack([mesh.place - half, mesh.place + half], axis=-1).ravel()
    curves: tuple[tuple[Array, str, str, str], ...] = (
        (mesh.held_per_width, HELD, "--", "load, axes held"),
        (mesh.per_width, YIELDING, "-", "load, on shafts"),
    )
    for values, color, style, label in curves:
        axes.plot(places, np.repeat(1e-3 * values, 2), style, color=color, label=label)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("place over the face width [mm]")
    axes.set_title(
        f"mesh {mesh.name}\nK_Hbeta {mesh.factor:.3f}, axes held "
        f"{mesh.held_factor:.3f}",
        fontsize=9,
    )
