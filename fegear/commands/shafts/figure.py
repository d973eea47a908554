"""Deflections and bending moments of shafts, and loads over the width of meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fegear.commands.shafts.loads import MeshOnShafts, ShaftUnderLoad
from lumped.common.array_types import Array
from lumped.figures.drawing import draw_legend, draw_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    parts = figure.subfigures(2, 1, squeeze=False, height_ratios=[2, 1])
    of_shafts, of_meshes = parts.flat
    top = of_shafts.subplots(2, len(shafts), squeeze=False, sharex="col", sharey="row")
    bottom = of_meshes.subplots(1, len(meshes), squeeze=False)
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
