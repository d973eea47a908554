"""Gear sets whose gears move in space, as lumped trains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.load_variation import StandingMesh, standing_mesh
from fegear.statics.machine import MachineAtRest, machine_at_rest
from fegear.train.rolling_bearings import bearings_at_rest
from fegear.train.rotors import rotor_system, whirl_problem
from lumped.common.progress import Progress, silent
from lumped.rotors.description import MeshSpring
from lumped.train.bodies import TrainError
from lumped.train.space import motion_in_space
from lumped.train.system import LumpedSystem
from lumped.train.width_springs import WidthLaw, width_law, with_mean_matrix

POSITIONS = 64  # of a mesh cycle, at which its loads are solved
ELEMENTS = 12  # of a shaft, at least


def loaded_machine(
    gear_set: GearSet,
    torque: float,
    excitation: ExcitationSettings,
    report: Progress = silent,
) -> MachineAtRest:
    """All meshes at rest on shafts that yield, at a torque on the input gear [N m].

    Raises InputError for a mesh without torque.
    """
    for number, on_mesh in enumerate(mesh_torques_at(gear_set, torque), start=1):
        if not on_mesh:
            raise InputError(
                f"{gear_set.name}: mesh {number} has no torque; every mesh needs one "
                "for the stiffness of teeth in contact"
            )
    statics = replace(excitation.statics, shafts=None)
    return machine_at_rest(statics.on_shafts(gear_set), torque, statics, report)


def standing_meshes(
    machine: MachineAtRest, report: Progress = silent
) -> list[StandingMesh]:
    """Loads of all meshes over their cycles."""
    meshes = []
    for mesh in range(len(machine.problems)):
        report("loads of teeth", mesh, len(machine.problems))
        meshes.append(standing_mesh(machine, mesh, POSITIONS))
    return meshes


def law_of(mesh: MeshSpring, standing: StandingMesh) -> WidthLaw:
    """Law of a mesh at its torque."""
    axes = np.broadcast_to(standing.axes, (standing.error.size, standing.axes.size))
    motions = np.column_stack([standing.error, axes])
    return width_law(mesh, motions, standing.loads, standing.stiffness)


def system_in_space(
    gear_set: GearSet,
    machine: MachineAtRest,
    damping_ratio: float | None = None,
    report: Progress = silent,
) -> LumpedSystem:
    """The lumped system of gears that move in space.

    machine : at rest at its torque, see `loaded_machine`
    damping_ratio : of every mode, in place of the gear set's
    """
    torque, meshes = machine.torque, standing_meshes(machine, report)
    rolling = bearings_at_rest(gear_set, torque, machine.loads_on_gears)
    ones = [1.0] * len(meshes)
    bare = rotor_system(gear_set, ones, ELEMENTS, "space", rolling=rolling)
    whirl_problem(gear_set, bare)  # refused where nothing holds a housing
    laws = []
    for number, pair in enumerate(zip(bare.meshes, meshes, strict=True), start=1):
        try:
            laws.append(law_of(*pair))
        except TrainError as error:
            raise InputError(f"{gear_set.name}: mesh {number}: {error}") from None
    springs = map(with_mean_matrix, bare.meshes, laws)
    train = train_of(gear_set, torque, damping_ratio=damping_ratio)
    places = {
        gear: (number, position)
        for number, shaft in enumerate(gear_set.shafts)
        if shaft.body
        for gear, position in zip(shaft.gears, shaft.body.gear_positions, strict=True)
    }
    try:
        space = motion_in_space(
            replace(bare, meshes=tuple(springs)),
            laws,
            [places[gear] for gear in range(len(gear_set.gears))],
            [gear.torque for gear in train.gears],
        )
        excitations = tuple(law.excitation for law in laws)
        return LumpedSystem(train, excitations, space=space)
    except TrainError as error:
        raise InputError(f"{gear_set.name}: {error}") from None
