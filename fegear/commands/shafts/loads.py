"""Shafts and meshes of a gear set at rest: loads, deflections and misalignments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.axes import SLOPES
from fegear.statics.machine import MachineAtRest
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
        that at the near end, by tilted axes [m]
    by_shafts, by_bearings : parts of it that driver and driven gear have from the
        bending of their shafts and from their bearings [m]
    away : lead slope of either gear that takes the misalignment away, over the whole
        face width of that gear [m]
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
    away: tuple[float, float]


def loaded_shafts(machine: MachineAtRest) -> Iterator[ShaftUnderLoad]:
    """Shafts that yield, under the loads of a machine at rest."""
    for index, (statics, gears) in machine.axes.shafts.items():
        loads = _shaft_loads(machine, statics, gears)
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
    machine: MachineAtRest, statics: ShaftStatics, gears: Sequence[int]
) -> list[ShaftLoad]:
    """Tooth forces on the gears of a shaft, about the middles of these gears."""
    torques = tooth_torques(machine.gear_set, machine.torque)
    loads = []
    for gear, position in zip(gears, statics.places, strict=True):
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
    by_bearings = _motions_by_bearings(machine)
    for mesh, cycle in enumerate(machine.cycles):
        if cycle is not None:
            yield _mesh_on_shafts(machine, mesh, cycle, by_bearings)


def _mesh_on_shafts(
    machine: MachineAtRest, mesh: int, cycle: ContactCycle, by_bearings: Array
) -> MeshOnShafts:
    gear_set = machine.gear_set
    spec, width = gear_set.meshes[mesh], gear_set.common_width(mesh)
    held = solve_cycle(
        _with_held_axes(machine.problems[mesh]), cycle.torque, cycle.position
    )
    frame, gears = machine.axes.frames[mesh], list(spec.gears)
    # the driven gear yields along the push of the driver, which opens a gap
    opens = width * np.array([-1.0, 1.0])
    total, of_bearings = (
        opens * (motions[gears] @ frame.T)[:, SLOPE_ALONG_PUSH]
        for motions in (machine.motions, by_bearings)
    )
    of_shafts = total - of_bearings
    misalignment = float(total.sum())
    face, held_face = cycle.face, held.face
    return MeshOnShafts(
        number=mesh + 1,
        name=mesh_name(gear_set, mesh),
        torque=float(cycle.torque[0]),
        width=width,
        place=face.place,
        per_width=face.per_width[0].mean(axis=0),
        held_per_width=held_face.per_width[0].mean(axis=0),
        factor=float(face.distribution_factor[0]),
        held_factor=float(held_face.distribution_factor[0]),
        center=float(face.center[0].mean()),
        misalignment=misalignment,
        by_shafts=(float(of_shafts[0]), float(of_shafts[1])),
        by_bearings=(float(of_bearings[0]), float(of_bearings[1])),
        away=_opposite_slopes(gear_set, gears, misalignment / width),
    )


def _opposite_slopes(
    gear_set: GearSet, gears: Sequence[int], tilt: float
) -> tuple[float, float]:
    driver, driven = (-tilt * gear_set.gears[gear].face_width for gear in gears)
    return driver, driven


def _with_held_axes(problem: ContactProblem) -> ContactProblem:
    if not isinstance(problem.solver, WidthContact):
        return problem
    return replace(problem, solver=replace(problem.solver, supports=None))


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
