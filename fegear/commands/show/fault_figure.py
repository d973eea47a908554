"""Faults of teeth in the picture of a gear set."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Any

from fegear.commands.show.faulty_teeth import FaultyTeeth, faulty_teeth
from fegear.gearset.model import GearSet
from fegear.gearset.placing import Layout, Place, at_place
from lumped.common.units import TO_MM

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from meshes.profile import Points

AXIS = "#000000"
# name and look of what is drawn as a line, by the kind of fault
LINES: dict[str, tuple[str, dict[str, Any]]] = {
    "cracks": ("crack", {"color": "#dd0000", "lw": 1.8}),
    "spalls": ("spall", {"color": "#ee7700", "lw": 3.5}),
    "worn": ("worn flank", {"color": "#008866", "lw": 2.0}),
}
DEPTH = 26  # above gears and lines of action
ARROW_LENGTH = 0.3  # of an eccentricity, in outer radii


def draw_faults(axes: Axes, gear_set: GearSet, placed: Layout) -> None:
    """Cracks, spalls and wear of teeth, and the offset of their centre."""
    for index, gear in enumerate(gear_set.gears):
        if not gear.faults.any:
            continue
        teeth, place = faulty_teeth(gear_set, placed, index), placed.places[index]
        curves = {
            "worn": teeth.worn(),
            "spalls": teeth.spalls(),
            "cracks": teeth.cracks(),
        }
        for kind, lines in curves.items():
            for tooth, points in lines:
                _draw_line(axes, teeth, place, tooth, points, LINES[kind][1])
        if gear.faults.eccentricity:
            direction = placed.directions[gear_set.meshes_of[index][0]]
            if gear_set.meshes[gear_set.meshes_of[index][0]].driven == index:
                direction += math.pi
            _draw_offset(axes, teeth, place, direction)


def _draw_line(
    axes: Axes,
    teeth: FaultyTeeth,
    place: Place,
    tooth: int,
    points: Points,
    style: dict[str, Any],
) -> None:
    placed = TO_MM * at_place(points, teeth.gear, place, teeth.turn(tooth))
    axes.plot(*placed.T, zorder=DEPTH, solid_capstyle="butt", **style)


def _draw_offset(
    axes: Axes, teeth: FaultyTeeth, place: Place, direction: float
) -> None:
    """A cross on the axis of rotation, an arrow toward the centre of the teeth.

    direction : from the gear to its mate
    """
    faults = teeth.faults
    length = TO_MM * ARROW_LENGTH * teeth.gear.outer_radius
    axis = TO_MM * complex(place.x, place.y)
    end = axis + cmath.rect(length, direction + faults.eccentricity_angle)
    style: dict[str, Any] = {"zorder": DEPTH, "annotation_clip": True}
    axes.plot(axis.real, axis.imag, "+", color=AXIS, ms=10, mew=1.4, zorder=DEPTH)
    axes.annotate(
        "",
        (end.real, end.imag),
        (axis.real, axis.imag),
        arrowprops={"arrowstyle": "-|>", "color": AXIS, "shrinkA": 0, "shrinkB": 0},
        **style,
    )
    axes.annotate(
        f"centre of teeth, {1e6 * faults.eccentricity:.4g} um",
        (end.real, end.imag),
        (0.0, 5.0 if end.imag >= axis.imag else -11.0),
        textcoords="offset points",
        ha="center",
        fontsize=7,
        **style,
    )


def fault_handles(gear_set: GearSet) -> list[Artist]:
    """Lines of a legend for the faults that are drawn as lines."""
    from matplotlib.lines import Line2D

    kinds = {kind for gear in gear_set.gears for kind in gear.faults.kinds}
    return [
        Line2D([], [], label=label, **style)
        for kind, (label, style) in LINES.items()
        if kind in kinds
    ]
