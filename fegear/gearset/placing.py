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
    rotated = (y - 1j * x) * cmath.exp(1j * direction)
    return np.stack([place.x + rotated.real, place.y + rotated.imag], axis=-1)


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
    unplaced_meshes = dict(enumerate(gear_set.meshes))
    while unplaced_meshes:
        number = _next_mesh(gear_set, unplaced_meshes, places)
        mesh = unplaced_meshes.pop(number)
        row_direction = _row_direction(gear_set, mesh, directions)
        if (
            mesh.driven in places
            and _find_coaxial_gear(gear_set, mesh.driver, places) is None
        ):
            directions[number] = row_direction
            driven = places[mesh.driven]
            places[mesh.driver] = _mate_place(mesh, driven, False, row_direction)
            continue
        if mesh.driver not in places:  # clocked to the mesh's phase
            sense = gear_set.senses[mesh.driver]
            pitches = rolling_sense(mesh, mesh.driver, sense) * phases[number].value
            turn = pitches * mesh.pair.driver.pitch_angle
            angle = tooth_axis(mesh, True, sense, row_direction) + turn
            places[mesh.driver] = _new_place(gear_set, mesh.driver, angle, places)
        driver = places[mesh.driver]
        directions[number] = direction = _center_line_direction(
            mesh, driver, row_direction
        )
        if mesh.driven not in places:  # in closed trains leave it as it is
            places[mesh.driven] = _mate_place(mesh, driver, True, direction)
    for index in range(len(gear_set.gears)):
        if index not in places:
            places[index] = _new_place(gear_set, index, 0.0, places)
    return Layout(places, directions)


def _row_direction(
    gear_set: GearSet, mesh: Mesh, directions: dict[int, float]
) -> float:
    """The centre line, if given.

    Else straight on from the mesh before; a quarter turn for each mesh alike.
    """
    if mesh.center_line is not None:
        return mesh.center_line
    meshes_in_row = {
        number: gear_set.meshes[number]
        for number in directions
        if gear_set.meshes[number].center_line is None
    }
    meshes_before = [
        n for n, other in meshes_in_row.items() if other.driven == mesh.driver
    ]
    n_of_driver = sum(other.driver == mesh.driver for other in meshes_in_row.values())
    n_of_driven = sum(other.driven == mesh.driven for other in meshes_in_row.values())
    direction_before = directions[meshes_before[0]] if meshes_before else 0.0
    return direction_before + 0.5 * math.pi * (n_of_driver - n_of_driven)


def _next_mesh(
    gear_set: GearSet, unplaced_meshes: dict[int, Mesh], places: dict[int, Place]
) -> int:
    """A mesh whose driver is placed, else one that touches a gear, else an input's."""
    driven_gears = {mesh.driven for mesh in unplaced_meshes.values()}
    ranks = {
        number: (
            _find_coaxial_gear(gear_set, mesh.driver, places) is None,
            mesh.driven not in places,
            not driven_gears.isdisjoint(gear_set.axis(mesh.driver)),
            number,
        )
        for number, mesh in unplaced_meshes.items()
    }
    return min(ranks, key=lambda number: ranks[number])


def _find_coaxial_gear(
    gear_set: GearSet, index: int, places: dict[int, Place]
) -> int | None:
    """A placed gear on the same axis, None if there is none."""
    return next((gear for gear in gear_set.axis(index) if gear in places), None)


def _new_place(
    gear_set: GearSet, index: int, tooth_angle: float, places: dict[int, Place]
) -> Place:
    """Place of a gear that no mesh positions: on its shaft's axis, or below everything
    else.
    """
    coaxial_gear = _find_coaxial_gear(gear_set, index, places)
    if coaxial_gear is None:
        height, sense = (
            _height_below_all(gear_set, index, places),
            gear_set.senses[index],
        )
        return Place(0.0, height, tooth_angle, sense)
    coaxial_place = places[coaxial_gear]
    return Place(
        coaxial_place.x,
        coaxial_place.y,
        tooth_angle,
        coaxial_place.sense,
        coaxial_place.layer + 1,
    )


def _center_line_direction(mesh: Mesh, driver: Place, row_direction: float) -> float:
    """From driver to driven: along the row, or near it where a phase requires it."""
    if mesh.phase is None or mesh.center_line is not None:
        return row_direction
    angle_ahead = driver.tooth_angle - tooth_axis(
        mesh, True, driver.sense, row_direction
    )
    pitch = mesh.pair.driver.pitch_angle
    sense = rolling_sense(mesh, mesh.driver, driver.sense)
    return row_direction + math.remainder(
        angle_ahead - sense * mesh.phase * pitch, pitch
    )


def _mate_place(mesh: Mesh, place: Place, drives: bool, direction: float) -> Place:
    """Place of the other gear of a mesh, with its loaded flank on the placed gear's.

    drives : whether the placed gear is the driver
    """
    gear, mate = mesh.pair.driver, mesh.pair.driven
    distance, sense = mesh.pair.center_distance, place.sense
    if not drives:
        gear, mate, distance = mate, gear, -distance
    angle_ahead = place.tooth_angle - tooth_axis(mesh, drives, sense, direction)
    mate_turn = angle_ahead * gear.base_radius / mate.base_radius
    mate_sense = -sense * mesh.pair.sign
    return Place(
        place.x + distance * math.cos(direction),
        place.y + distance * math.sin(direction),
        tooth_axis(mesh, not drives, mate_sense, direction) - mate_turn,
        mate_sense,
        place.layer,
    )


def _height_below_all(gear_set: GearSet, index: int, places: dict[int, Place]) -> float:
    """Height of a centre below everything that is placed, 0 for the first."""
    if not places:
        return 0.0
    lowest_point = min(
        place.y - gear_set.gears[other].geometry.outer_radius
        for other, place in places.items()
    )
    return lowest_point - 1.2 * gear_set.gears[index].geometry.outer_radius
