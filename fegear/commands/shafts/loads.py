"""Shafts and meshes of a gear set at rest: loads, deflections and misalignments."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.shaft_bodies import ShaftEnd
from fegear.gearset.torsion import torque_ends
from fegear.statics.axes import SLOPES
from fegear.statics.machine import MachineAtRest, mean_loads
from fegear.statics.mesh_table import mesh_name
from lumped.common.array_types import Array
from lumped.rotors.description import Bearing
from lumped.rotors.free_shafts import TILT_X
from lumped.rotors.matrices import section_at
from lumped.rotors.rolling_statics import states_at
from lumped.rotors.statics import (
    ShaftLoad,
    ShaftSolution,
    ShaftStatics,
    shaft_statics,
)

ELEMENTS = 48  # of a shaft, at least, for its curves
RIGID = 1e9  # factor on the moduli of a shaft that only its bearings let move
SLOPE_ALONG_PUSH = 3  # of the motions of an axis


@dataclass(frozen=True, eq=False)
class ShaftUnderLoad:
    """A shaft under the mean tooth forces on its gears.

    number : of the shaft in the gear set, from 1
    gears : their names, joined
    gear_positions, bearing_positions : from the first end [m]
    tilt_stiffness : of the bearings, the larger one of both diameters [N m/rad]
    pressures : largest contact pressures of its rolling bearings [Pa]; none of linear
        bearings
    solution : deflections, internal forces and reactions
    bending_stress : at the surface just before and just after every node (n, 2) [Pa]
    imbalance : largest sum of reactions and tooth forces along an axis, over the
        largest of these forces
    """

    number: int
    gears: str
    gear_positions: tuple[float, ...]
    bearing_positions: tuple[float, ...]
    tilt_stiffness: tuple[float, ...]
    pressures: tuple[float, ...]
    solution: ShaftSolution
    bending_stress: Array
    imbalance: float


@dataclass(frozen=True, eq=False)
class MeshOnShafts:
    """A mesh whose axes yield, beside the same contact with axes that are held.

    number : of the mesh, from 1
    name : its number and gears
    torque : on the driver [N m]
    width : common face width [m]
    place : middles of the slices, from the middle of that width [m]
    per_width : mean load per face width of the slices [N/m]
    held_per_width : the same with axes that are held
    factor, held_factor : K_Hbeta
    center : mean place of the load [m]
    misalignment : gap along the line of action at the far end of the common width less
        that at the near end, by tilted axes and bodies that twist [m]
    by_shafts, by_bearings, by_torsion : parts of it that driver and driven gear have
        from the bending of their shafts, from their bearings and from the torsion of
        their bodies [m]
    to_mend : misalignment under the loads of aligned axes that are held, without leads,
        which are those of all meshes once leads take their misalignments away [m]
    away : lead slope of either gear that does so, of its whole face width, in place of
        leads that there are; it takes the misalignment of the gear set away too [m]
    """

    number: int
    name: str
    torque: float
    width: float
    place: Array
    per_width: Array
    held_per_width: Array
    factor: float
    held_factor: float
    center: float
    misalignment: float
    by_shafts: tuple[float, float]
    by_bearings: tuple[float, float]
    by_torsion: tuple[float, float]
    to_mend: float
    away: tuple[float, float]


@dataclass(frozen=True)
class TorsionOfGear:
    """Torsion of a gear over its face width.

    gear : its name
    end : of its shaft, toward which the torque passes; None where torsion is left out
    reason : why it is, else empty
    """

    gear: str
    end: ShaftEnd | None
    reason: str


def torsion_of_gears(gear_set: GearSet) -> Iterator[TorsionOfGear]:
    """Which gears twist, of those on shafts that yield."""
    for one in torque_ends(gear_set):
        yield TorsionOfGear(gear_set.gears[one.gear].name, one.end, one.reason)


def loaded_shafts(machine: MachineAtRest) -> Iterator[ShaftUnderLoad]:
    """Shafts that yield, under the loads of a machine at rest."""
    for index, (statics, _) in sorted(machine.axes.shafts.items()):
        loads = _shaft_loads(machine, index, statics)
        fine = shaft_statics(statics.rotor, statics.places, ELEMENTS)
        solution = fine.solve(loads)
        bearings = statics.rotor.bearings
        yield ShaftUnderLoad(
            number=index + 1,
            gears=statics.rotor.name,
            gear_positions=statics.places,
            bearing_positions=tuple(one.position for one in bearings),
            tilt_stiffness=tuple(map(_tilt_stiffness, bearings)),
            pressures=_pressures(machine, index, fine.motions_of_bearings(solution)),
            solution=solution,
            bending_stress=bending_stress(fine, solution),
            imbalance=_imbalance(loads, solution),
        )


def _tilt_stiffness(bearing: Bearing) -> float:
    if bearing.linearised is None:
        return bearing.tilt_stiffness
    return float(np.diag(bearing.linearised.stiffness)[TILT_X:].max())


def _pressures(machine: MachineAtRest, shaft: int, motions: Array) -> tuple[float, ...]:
    """Largest contact pressures of rolling bearings by motions (b, 5) in them [Pa]."""
    rolling = machine.axes.rolling.get(shaft)
    if rolling is None:
        return ()
    return tuple(max(one.pressures) for one in states_at(rolling.supports, motions))


def _shaft_loads(
    machine: MachineAtRest, index: int, statics: ShaftStatics
) -> list[ShaftLoad]:
    """Tooth forces on the gears of a shaft, about the middles of these gears.

    And the torque at its first end, where it enters or leaves there.
    """
    torques = tooth_torques(machine.gear_set, machine.torque)
    shaft = machine.gear_set.shafts[index]
    loads = []
    if shaft.body is not None and shaft.body.driven_from == "start":
        outside = -float(torques[list(shaft.gears)].sum())
        loads.append(ShaftLoad(position=0.0, moment=(0.0, 0.0, outside)))
    for gear, position in zip(shaft.gears, statics.places, strict=True):
        x, y, z, *moment = (SLOPES.T @ machine.loads_on_gears[gear]).tolist()
        loads.append(
            ShaftLoad(
                position=position,
                force=(x, y, z),
                moment=(*moment, float(torques[gear])),
            )
        )
    return loads


def tooth_torques(gear_set: GearSet, torque: float) -> Array:
    """Torques (g,) of teeth on all gears, counter-clockwise from the near end [N m].

    torque : on the input gear [N m]
    """
    torques, senses = np.zeros(len(gear_set.gears)), gear_set.senses
    of_meshes = zip(gear_set.meshes, mesh_torques_at(gear_set, torque), strict=True)
    for mesh, on_driver in of_meshes:
        ratio = mesh.pair.driven.teeth / mesh.pair.driver.teeth
        torques[mesh.driver] -= senses[mesh.driver] * on_driver
        torques[mesh.driven] += senses[mesh.driven] * on_driver * ratio
    return torques


def bending_stress(statics: ShaftStatics, solution: ShaftSolution) -> Array:
    """Bending stress at the surface before and after every node (n, 2) [Pa]."""
    rotor, nodes = statics.rotor, solution.position
    modulus = np.array(
        [
            2.0 * section.second_moment / section.diameter
            for section in (
                section_at(rotor, 0.5 * (low + high))
                for low, high in pairwise(nodes.tolist())
            )
        ]
    )
    # the first node has no element before it, the last one none after it
    sides = np.stack([modulus[[0, *range(modulus.size)]], np.append(modulus, np.inf)])
    sides[1, -1] = modulus[-1]
    return np.asarray(np.hypot(*np.moveaxis(solution.moment, -1, 0)) / sides.T)


def _imbalance(loads: Sequence[ShaftLoad], solution: ShaftSolution) -> float:
    forces = np.array([*(load.force for load in loads), *solution.reactions[:, :3]])
    largest = float(np.abs(forces).max())
    return float(np.abs(forces.sum(axis=0)).max()) / largest if largest else 0.0


def meshes_on_shafts(machine: MachineAtRest) -> Iterator[MeshOnShafts]:
    """Meshes that carry load, with the parts of their misalignments."""
    held = _with_contacts(machine, _on_held_axes)
    aligned = _with_contacts(machine, _on_aligned_axes)
    by_bearings = _motions_by_bearings(machine)
    for mesh, (cycle, held_cycle, aligned_cycle) in enumerate(
        zip(machine.cycles, held.cycles, aligned.cycles, strict=True)
    ):
        if cycle is None or held_cycle is None or aligned_cycle is None:
            continue
        total, of_bearings, to_mend = (
            _gaps_of_tilts(machine, mesh, motions)
            for motions in (machine.motions, by_bearings, aligned.motions)
        )
        of_torsion, of_aligned = (
            _gaps_of_torsion(machine.problems[mesh], one)
            for one in (cycle, aligned_cycle)
        )
        of_shafts, gap = total - of_bearings, float((to_mend + of_aligned).sum())
        gap_of_set = machine.gear_set.meshes[mesh].misalignment
        face, held_face = cycle.face, held_cycle.face
        yield MeshOnShafts(
            number=mesh + 1,
            name=mesh_name(machine.gear_set, mesh),
            torque=float(cycle.torque[0]),
            width=machine.gear_set.common_width(mesh),
            place=face.place,
            per_width=face.per_width[0].mean(axis=0),
            held_per_width=held_face.per_width[0].mean(axis=0),
            factor=float(face.distribution_factor[0]),
            held_factor=float(held_face.distribution_factor[0]),
            center=float(face.center[0].mean()),
            misalignment=float((total + of_torsion).sum()),
            by_shafts=(float(of_shafts[0]), float(of_shafts[1])),
            by_bearings=(float(of_bearings[0]), float(of_bearings[1])),
            by_torsion=(float(of_torsion[0]), float(of_torsion[1])),
            to_mend=gap,
            away=_opposite_slopes(machine.gear_set, mesh, gap + gap_of_set),
        )


def _gaps_of_tilts(machine: MachineAtRest, mesh: int, motions: Array) -> Array:
    """Gaps (2,) at the far end less those at the near end, by both gears [m].

    motions : (g, 5) of the axes
    """
    gears = list(machine.gear_set.meshes[mesh].gears)
    slopes = (motions[gears] @ machine.axes.frames[mesh].T)[:, SLOPE_ALONG_PUSH]
    # the driven gear yields along the push of the driver, which opens a gap
    width = machine.gear_set.common_width(mesh)
    return np.asarray(width * np.array([-1.0, 1.0]) * slopes)


def _gaps_of_torsion(problem: ContactProblem, cycle: ContactCycle) -> Array:
    """Gaps (2,) at the far end less those at the near end, by twists of both gears [m].

    Under the mean loads of a cycle.
    """
    gaps, contact, face = np.zeros(2), problem.solver, cycle.face
    if not isinstance(contact, WidthContact) or contact.supports is None:
        return gaps
    force = face.load[0].mean(axis=0).sum(axis=0) * face.slice_length
    ends = 0.5 * contact.width * np.array([-1.0, 1.0])
    gears = problem.pair.driver, problem.pair.driven
    for i, (gear, support, offset) in enumerate(
        zip(gears, contact.supports.gears, contact.offsets, strict=True)
    ):
        if support.torsion is not None:
            torque = gear.base_radius * math.cos(face.base_helix_angle) * force
            twist = support.torsion.between(ends + offset, face.place + offset)
            gaps[i] = gear.base_radius * np.diff(twist @ torque)[0]
    return gaps


def _opposite_slopes(
    gear_set: GearSet, mesh: int, misalignment: float
) -> tuple[float, float]:
    """Lead slopes of driver and driven gear over their whole widths [m]."""
    tilt = misalignment / gear_set.common_width(mesh)
    gears = gear_set.meshes[mesh].gears
    driver, driven = (-tilt * gear_set.gears[gear].face_width for gear in gears)
    return driver, driven


def _with_contacts(
    machine: MachineAtRest, changed: Callable[[ContactProblem], ContactProblem]
) -> MachineAtRest:
    """The machine with other contacts, and loads by them."""
    problems = tuple(map(changed, machine.problems))
    cycles = tuple(
        None if cycle is None else solve_cycle(problem, cycle.torque, cycle.position)
        for problem, cycle in zip(problems, machine.cycles, strict=True)
    )
    loads = np.zeros_like(machine.loads)
    for mesh, (problem, cycle) in enumerate(zip(problems, cycles, strict=True)):
        if cycle is not None:
            loads[mesh] = mean_loads(problem, cycle)
    return replace(machine, problems=problems, cycles=cycles, loads=loads)


def _on_held_axes(problem: ContactProblem) -> ContactProblem:
    if not isinstance(problem.solver, WidthContact):
        return problem
    return replace(problem, solver=replace(problem.solver, supports=None))


def _on_aligned_axes(problem: ContactProblem) -> ContactProblem:
    """The contact of axes that are held and aligned, without leads."""
    held = _on_held_axes(problem)
    if isinstance(held.solver, WidthContact):
        aligned = replace(held.solver, gap=np.zeros_like(held.solver.gap))
        held = replace(held, solver=aligned)
    driver, driven = (replace(flank, lead=None) for flank in held.flanks)
    return replace(held, driver=driver, driven=driven)


def _motions_by_bearings(machine: MachineAtRest) -> Array:
    """Motions (g, 5) of axes whose shafts are rigid, under the same loads.

    Rolling bearings are linearised as they are with shafts that bend.
    """
    motions = np.zeros_like(machine.motions)
    for statics, gears in machine.axes.shafts.values():
        rotor = statics.rotor
        rigid = replace(
            rotor,
            young_modulus=RIGID * rotor.young_modulus,
            shear_modulus=RIGID * rotor.shear_modulus,
        )
        of_bearings = shaft_statics(rigid, statics.places)
        loads = machine.loads_on_gears[list(gears)] @ SLOPES
        moved = of_bearings.offset + of_bearings.compliance @ loads.ravel()
        moved = moved.reshape(loads.shape)
        motions[list(gears)] = moved @ SLOPES.T
    return motions
