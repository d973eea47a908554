"""Phases of the meshes: how far each is in its cycle when the first is at 0.

At position p of a mesh the drive flank of some tooth of the driver is p base pitches
past the pitch point. A gear in two meshes has one set of teeth for both, which ties
their positions together:

    driver: axis = chi - sigma h + sigma p tau
    driven: axis = chi + pi + sigma h + sigma p tau

axis : direction of a tooth's axis, any of the gear's teeth
chi : direction of the centre line, from driver to driven gear
sigma : 1 where the gear turns counter-clockwise, -1 where clockwise
h : from the tooth's axis to its flank at the operating pitch radius
tau : the gear's pitch angle

Of an internal gear h and tau are negative, and so is sigma where it turns
counter-clockwise; chi of its meshes is from the driven to the driving gear. The axis of
a tooth points where the tooth does.

A position is that in the middle of the common face width. Axes are of teeth in the
middle of the gear's own width; helical teeth are there

    sigma r_b twist z / p_b

base pitches further, z from the middle of the gear to that of the common width, with
sigma, base radius and twist of the mesh's driver: p is larger by that in the equations
above. Of an internal driver that turns counter-clockwise sigma and r_b are negative. A
positive twist is right-handed, and gears are seen from the end z = -b / 2.

Angles in radians, counter-clockwise from the x axis.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

from fegear.gearset.model import GearSet, Mesh

SAME_DIRECTION = 1e-9  # rad, far below any manufacture


@dataclass(frozen=True)
class MeshPhase:
    """Position [base pitches] of a mesh when the first is at its pitch point.

    origin : where the value comes from, in words
    """

    value: float
    origin: str


@dataclass(frozen=True)
class Link:
    """A mesh and another, whose position is known, with a gear in common.

    rank : 0 where the other mesh drives the common gear and this one is driven by it
    """

    rank: int
    mesh: int
    other: int
    gear: int


@lru_cache(maxsize=16)
def mesh_phases(gear_set: GearSet) -> tuple[MeshPhase, ...]:
    """A phase for every mesh: given, derived from the geometry, or chosen.

    Derived values are the ones nearest to 0. What is listed first is derived first,
    but an idler's next mesh from the mesh that drives the idler where there is one.
    """
    phases = _given_phases(gear_set)
    meshes_without_phase = [n for n in range(len(gear_set.meshes)) if n not in phases]
    while meshes_without_phase:
        links = [
            link
            for n in meshes_without_phase
            for link in _links_to_known(gear_set, n, phases)
        ]
        if links:
            link = min(links, key=lambda link: (link.rank, link.mesh, link.other))
            value = _linked_phase(gear_set, link, phases[link.other].value)
            index, phase = (
                link.mesh,
                MeshPhase(value, _origin_of_derived(gear_set, link)),
            )
        else:
            index = meshes_without_phase[0]
            phase = MeshPhase(0.0, _origin_of_chosen(gear_set, index, phases))
        phases[index] = phase
        meshes_without_phase.remove(index)
    return tuple(phases[number] for number in range(len(gear_set.meshes)))


def geometric_phase(gear_set: GearSet, number: int) -> float | None:
    """Phase [base pitches], nearest to 0, that follows from a mesh's geometry.

    Whatever phase is given for it. None where no earlier mesh determines it: two
    gears on a shaft may be clocked at will.
    """
    phases = mesh_phases(gear_set)
    links = _links_to_known(gear_set, number, range(number))
    if not links:
        return None
    link = min(links, key=lambda link: (link.rank, link.other))
    return _linked_phase(gear_set, link, phases[link.other].value)


@lru_cache(maxsize=16)
def first_teeth(gear_set: GearSet) -> Mapping[tuple[int, int], int]:
    """Which tooth of a gear is in each mesh's reference pair, by (mesh, gear).

    Teeth count clockwise from the reference pair of the gear's first mesh, at the
    time when the first mesh is at its pitch point.
    """
    senses = gear_set.senses
    first_axes: dict[int, float] = {}
    teeth: dict[tuple[int, int], int] = {}
    for number, phase in enumerate(mesh_phases(gear_set)):
        mesh = gear_set.meshes[number]
        for gear in mesh.gears:
            pitch = gear_set.gears[gear].geometry.pitch_angle
            axis = _tooth_axis_in_mesh(mesh, gear, senses[gear])
            position = phase.value + _lead(gear_set, number, gear)
            axis += rolling_sense(mesh, gear, senses[gear]) * position * pitch
            first_axes.setdefault(gear, axis)
            teeth[number, gear] = -round((axis - first_axes[gear]) / pitch)
    return MappingProxyType(teeth)


def tooth_axis(mesh: Mesh, drives: bool, sense: int, direction: float) -> float:
    """Direction of a tooth's axis at position 0 of the mesh [rad].

    drives : whether of the driver or of the driven gear
    sense : of that gear; direction : of the centre line
    """
    pair = mesh.pair
    gear = pair.driver if drives else pair.driven
    flank_angle = gear.half_angle(
        gear.base_radius / math.cos(pair.operating_pressure_angle)
    )
    flank_angle *= gear.sign * sense
    if pair.is_internal:
        direction += math.pi
    return direction - flank_angle if drives else direction + math.pi + flank_angle


def rolling_sense(mesh: Mesh, gear: int, sense: int) -> int:
    """Sense of rotation, opposite for an internal gear, whose pitch is negative."""
    pair = mesh.pair
    return sense * (pair.driver if gear == mesh.driver else pair.driven).sign


@lru_cache(maxsize=16)
def rolling_senses(gear_set: GearSet) -> tuple[int, ...]:
    """Sense of rotation of every gear, opposite for an internal gear."""
    return tuple(
        sense * gear.geometry.sign
        for sense, gear in zip(gear_set.senses, gear_set.gears, strict=True)
    )


def _given_phases(gear_set: GearSet) -> dict[int, MeshPhase]:
    phases = {
        number: MeshPhase(mesh.phase, "given")
        for number, mesh in enumerate(gear_set.meshes)
        if mesh.phase is not None
    }
    return phases | {0: MeshPhase(0.0, "reference")}


def _links_to_known(
    gear_set: GearSet, number: int, known_meshes: Collection[int]
) -> list[Link]:
    """Links of a mesh that fix its position, to those of the known meshes."""
    mesh, links = gear_set.meshes[number], []
    neighbours = {n for gear in mesh.gears for n in gear_set.meshes_of[gear]} - {number}
    for index in sorted(neighbours.intersection(known_meshes)):
        other = gear_set.meshes[index]
        common_gears = {mesh.driver, mesh.driven} & {other.driver, other.driven}
        if _is_open_branch(mesh, other):
            continue
        is_driven_by_other = mesh.driver == other.driven
        gear = mesh.driver if is_driven_by_other else min(common_gears)
        links.append(Link(0 if is_driven_by_other else 1, number, index, gear))
    return links


def _is_open_branch(mesh: Mesh, other: Mesh) -> bool:
    """A gear in the same role in both meshes, and nothing says in what directions.

    The two mates cannot be in the same place, so this is no row.
    """
    has_same_role = mesh.driver == other.driver or mesh.driven == other.driven
    return has_same_role and mesh.center_line is None and other.center_line is None


def _linked_phase(gear_set: GearSet, link: Link, position: float) -> float:
    """Phase of a mesh from the position of the other, by the gear in common."""
    mesh, other = gear_set.meshes[link.mesh], gear_set.meshes[link.other]
    sense = gear_set.senses[link.gear]
    pitch_angle = gear_set.gears[link.gear].geometry.pitch_angle
    axis_turn = _tooth_axis_in_mesh(other, link.gear, sense) - _tooth_axis_in_mesh(
        mesh, link.gear, sense
    )
    axis_turn *= rolling_sense(mesh, link.gear, sense)
    in_middle = position + _lead(gear_set, link.other, link.gear)
    in_middle += axis_turn / pitch_angle
    return math.remainder(in_middle - _lead(gear_set, link.mesh, link.gear), 1.0)


def _lead(gear_set: GearSet, number: int, gear: int) -> float:
    """Position of a mesh in the middle of a gear's width, less that of the mesh.

    In base pitches, zero unless the gears are helical.
    """
    mesh = gear_set.meshes[number]
    driver = mesh.pair.driver
    if not driver.twist:
        return 0.0
    middle = gear_set.width_middles(number)[mesh.gears.index(gear)]
    lead = driver.base_radius * driver.twist * middle / driver.base_pitch
    return rolling_sense(mesh, mesh.driver, gear_set.senses[mesh.driver]) * lead


def _tooth_axis_in_mesh(mesh: Mesh, gear: int, sense: int) -> float:
    return tooth_axis(mesh, gear == mesh.driver, sense, mesh.direction)


def _origin_of_derived(gear_set: GearSet, link: Link) -> str:
    directions = [gear_set.meshes[n].direction for n in (link.mesh, link.other)]
    direction_change = math.remainder(directions[0] - directions[1], 2.0 * math.pi)
    if abs(direction_change) < SAME_DIRECTION:
        return "derived, centres in line"
    return "derived from the centre lines"


def _origin_of_chosen(
    gear_set: GearSet, number: int, known_meshes: Collection[int]
) -> str:
    """Why a mesh without links to any known one may be at 0."""
    mesh = gear_set.meshes[number]
    known_gears = {g for n in known_meshes for g in gear_set.meshes[n].gears}
    if not known_gears.isdisjoint(mesh.gears):
        return "chosen, no centre line is given where the train branches"
    coaxial_gears = {g for gear in mesh.gears for g in gear_set.axis(gear)}
    if not known_gears.isdisjoint(coaxial_gears):
        return "chosen, gears on a shaft can be clocked at will"
    return "chosen, not linked to the first mesh"
