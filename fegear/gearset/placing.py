"""Places and angles of the gears of a set, for drawings.

Angles in radians, counter-clockwise from the x axis; lengths in metres.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from fegear.gearset.model import GearSet, Mesh
from fegear.gearset.phases import mesh_phases, rolling_sense, tooth_axis
from meshes import SpurGear
from meshes.profile import Points


@dataclass(frozen=True)
class Place:
    """A gear's centre, the direction of one tooth's axis, its sense of rotation.

    sense : 1 turns counter-clockwise, -1 clockwise
    layer : 0 in front; gears on a shaft are one behind the other
    """

    x: float
    y: float
    tooth_angle: float
    sense: int
    layer: int = 0


@dataclass(frozen=True)
class Layout:
    """Places of the gears by index, and directions from drivers to driven gears."""

    places: dict[int, Place]
    directions: dict[int, float]


def at_place(points: Points, gear: SpurGear, place: Place, turn: int) -> Points:
    """Points (n, 2) of a tooth's frame in the picture [m].

    turn : number of the tooth clockwise from the one at the place's angle, on an
        internal gear counter-clockwise
    """
    x, y = points.T
    direction = place.tooth_angle - gear.pitch_angle * turn
    flat = (y - 1j * x) * cmath.exp(1j * direction)
    return np.stack([place.x + flat.real, place.y + flat.imag], axis=-1)


def layout(gear_set: GearSet) -> Layout:
    """Gears along their centre lines, the first mesh in contact at its pitch point.

    Without a centre line they are in a row. An idler's next mesh is then turned
    out of the row just so far that its drive flanks are at the given phase, and
    further meshes of one gear branch off at right angles. A second gear on a shaft
    is clocked to its phase; unconnected gears start a row of their own below.
    """
    phases = mesh_phases(gear_set)
    places: dict[int, Place] = {}
    directions: dict[int, float] = {}
    waiting = dict(enumerate(gear_set.meshes))
    while waiting:
        number = _next_mesh(gear_set, waiting, places)
        mesh = waiting.pop(number)
        row = _row(gear_set, mesh, directions)
        if mesh.driven in places and _on_axis(gear_set, mesh.driver, places) is None:
            directions[number] = row
            driven = places[mesh.driven]
            places[mesh.driver] = _mate_place(mesh, driven, False, row)
            continue
        if mesh.driver not in places:  # clocked to the mesh's phase
            sense = gear_set.senses[mesh.driver]
            pitches = rolling_sense(mesh, mesh.driver, sense) * phases[number].value
            turn = pitches * mesh.pair.driver.pitch_angle
            angle = tooth_axis(mesh, True, sense, row) + turn
            places[mesh.driver] = _new_place(gear_set, mesh.driver, angle, places)
        driver = places[mesh.driver]
        directions[number] = direction = _direction(mesh, driver, row)
        if mesh.driven not in places:  # in closed trains leave it as it is
            places[mesh.driven] = _mate_place(mesh, driver, True, direction)
    for index in range(len(gear_set.gears)):
        if index not in places:
            places[index] = _new_place(gear_set, index, 0.0, places)
    return Layout(places, directions)


def _row(gear_set: GearSet, mesh: Mesh, directions: dict[int, float]) -> float:
    """The centre line, if given.

    Else straight on from the mesh before; a quarter turn for each mesh alike.
    """
    if mesh.center_line is not None:
        return mesh.center_line
    done = {
        number: gear_set.meshes[number]
        for number in directions
        if gear_set.meshes[number].center_line is None
    }
    before = [n for n, other in done.items() if other.driven == mesh.driver]
    leaving = sum(other.driver == mesh.driver for other in done.values())
    entering = sum(other.driven == mesh.driven for other in done.values())
    straight = directions[before[0]] if before else 0.0
    return straight + 0.5 * math.pi * (leaving - entering)


def _next_mesh(
    gear_set: GearSet, waiting: dict[int, Mesh], places: dict[int, Place]
) -> int:
    """A mesh whose driver is placed, else one that touches a gear, else an input's."""
    driven = {mesh.driven for mesh in waiting.values()}
    ranks = {
        number: (
            _on_axis(gear_set, mesh.driver, places) is None,
            mesh.driven not in places,
            not driven.isdisjoint(gear_set.axis(mesh.driver)),
            number,
        )
        for number, mesh in waiting.items()
    }
    return min(ranks, key=lambda number: ranks[number])


def _on_axis(gear_set: GearSet, index: int, places: dict[int, Place]) -> int | None:
    """A placed gear on the same axis, None if there is none."""
    return next((gear for gear in gear_set.axis(index) if gear in places), None)


def _new_place(
    gear_set: GearSet, index: int, tooth_angle: float, places: dict[int, Place]
) -> Place:
    """Place of a gear that no mesh positions: on its shaft's axis, or below everything
    else.
    """
    coaxial = _on_axis(gear_set, index, places)
    if coaxial is None:
        below, sense = _free_height(gear_set, index, places), gear_set.senses[index]
        return Place(0.0, below, tooth_angle, sense)
    axis = places[coaxial]
    return Place(axis.x, axis.y, tooth_angle, axis.sense, axis.layer + 1)


def _direction(mesh: Mesh, driver: Place, row: float) -> float:
    """From driver to driven: along the row, or near it where a phase requires it."""
    if mesh.phase is None or mesh.center_line is not None:
        return row
    ahead = driver.tooth_angle - tooth_axis(mesh, True, driver.sense, row)
    pitch = mesh.pair.driver.pitch_angle
    sense = rolling_sense(mesh, mesh.driver, driver.sense)
    return row + math.remainder(ahead - sense * mesh.phase * pitch, pitch)


def _mate_place(mesh: Mesh, place: Place, drives: bool, direction: float) -> Place:
    """Place of the other gear of a mesh, with its loaded flank on the placed gear's.

    drives : whether the placed gear is the driver
    """
    gear, mate = mesh.pair.driver, mesh.pair.driven
    distance, sense = mesh.pair.center_distance, place.sense
    if not drives:
        gear, mate, distance = mate, gear, -distance
    ahead = place.tooth_angle - tooth_axis(mesh, drives, sense, direction)
    turned = ahead * gear.base_radius / mate.base_radius
    mate_sense = -sense * mesh.pair.sign
    return Place(
        place.x + distance * math.cos(direction),
        place.y + distance * math.sin(direction),
        tooth_axis(mesh, not drives, mate_sense, direction) - turned,
        mate_sense,
        place.layer,
    )


def _free_height(gear_set: GearSet, index: int, places: dict[int, Place]) -> float:
    """Height of a centre below everything that is placed, 0 for the first."""
    if not places:
        return 0.0
    lowest = min(
        place.y - gear_set.gears[other].geometry.outer_radius
        for other, place in places.items()
    )
    return lowest - 1.2 * gear_set.gears[index].geometry.outer_radius
