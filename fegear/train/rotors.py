"""From a gear set to spinning shafts that bend, with its gears as rigid disks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal

from fegear.files.errors import InputError
from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.faults.checks import require_nominal
from fegear.gearset.inertia import inertia_of, mass_of
from fegear.gearset.leads import require_one_helix
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import Gear, GearSet, Shaft
from fegear.gearset.problems import shown
from fegear.gearset.shaft_bodies import ShaftBody
from fegear.gearset.shaft_rotors import shaft_rotor
from fegear.gearset.yielding import missing_thrust_path
from fegear.train.rolling_bearings import NO_BEARINGS, LinearisedBearings
from lumped.common.array_types import Array
from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorError,
    RotorSystem,
)
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem
from lumped.train.coordinates import line_of_action, rolling_sense
from lumped.train.train import Train

Motion = Literal["plane", "space"]


def rotor_system(
    gear_set: GearSet,
    mean_stiffness: Sequence[float],
    elements: int,
    motion: Motion | None = None,
    matrices: Sequence[Array] = (),
    rolling: LinearisedBearings = NO_BEARINGS,
) -> RotorSystem:
    """Shafts, gears, bearings and meshes; InputError where a shaft is not described.

    mean_stiffness : of every mesh [N/m]
    elements : least number of elements of every shaft
    motion : see `has_axial_motion`
    matrices : of every mesh, see `MeshSpring.matrix`; none where stiffnesses are spread
        evenly over the planes of action
    rolling : bearings of shafts on rolling bearings, by the shaft's index
    """
    require_nominal(gear_set, "shafts that bend")
    require_one_helix(gear_set, "shafts that bend")
    bodies = require_bodies(gear_set)
    train = train_of(gear_set, 0.0)
    axial_motion = has_axial_motion(gear_set, motion)
    try:
        return RotorSystem(
            rotors=tuple(
                _rotor(gear_set, train, (shaft, body), rolling.get(index, ()))
                for index, (shaft, body) in enumerate(
                    zip(gear_set.shafts, bodies, strict=True)
                )
            ),
            meshes=tuple(
                replace(mesh, **_in_space(gear_set, number, matrices))
                if axial_motion
                else mesh
                for number, mesh in enumerate(
                    _meshes(gear_set, train, bodies, mean_stiffness)
                )
            ),
            elements=elements,
            axial_motion=axial_motion,
            housing=None if gear_set.housing is None else gear_set.housing.housing,
        )
    except RotorError as error:
        raise InputError(f"{gear_set.name}: {error}") from None


def whirl_problem(gear_set: GearSet, system: RotorSystem) -> WhirlProblem:
    """The machine in its modes at rest; InputError where nothing holds its housing."""
    where = gear_set.name
    if gear_set.housing is not None:
        where += f": housing: file = {shown(gear_set.housing.file)}"
    try:
        problem = WhirlProblem(assemble(system))
    except RotorError as error:
        raise InputError(f"{where}; {error}") from None
    free = int((problem.squares == 0.0).sum())
    if gear_set.housing is not None and free:
        raise InputError(
            f"{where}; nothing holds {free} motions of the machine; stiffness must "
            "have the feet of the housing, or nodes leave bearings on ground"
        )
    return problem


def has_axial_motion(gear_set: GearSet, motion: Motion | None) -> bool:
    """Whether shafts move along their axes, and helical gears have their helix.

    motion : None for space where there are helical gears and the bearings of all their
        shafts take thrust, else plane; InputError for space where they do not
    """
    refusal = missing_thrust_path(gear_set)
    if motion == "space" and refusal:
        raise InputError(f"{refusal}, or the helix left out, motion = plane")
    if motion is None:
        return refusal is None and any(mesh.is_helical for mesh in gear_set.meshes)
    return motion == "space"


def require_bodies(gear_set: GearSet) -> list[ShaftBody]:
    """Bodies of all shafts; InputError for a gear that is on none."""
    if gear_set.carrier is not None:
        raise InputError(
            f"{gear_set.name}: planetary sets have no shafts that bend; gears on "
            "fixed axes are needed"
        )
    on_bodies = {g for shaft in gear_set.shafts if shaft.body for g in shaft.gears}
    for index, gear in enumerate(gear_set.gears):
        if index not in on_bodies:
            raise InputError(
                f'{gear_set.name}: gear "{gear.name}" is on no [[shaft]] with '
                "lengths_mm, diameters_mm and positions_mm"
            )
    bodies = [shaft.body for shaft in gear_set.shafts if shaft.body]
    for number, body in enumerate(bodies, start=1):
        if len({bearing.position for bearing in body.bearings}) < 2:
            raise InputError(
                f"{gear_set.name}: shaft {number}: bearing_positions_mm has "
                f"{len(body.bearings)} entries; two bearings or more are needed, in "
                "different places"
            )
    return bodies


def transverse_inertia(gear: Gear) -> float:
    """About a diameter, of a flat body as wide as the teeth [kg m2]."""
    return 0.5 * inertia_of(gear) + mass_of(gear) * gear.face_width**2 / 12.0


def _rotor(
    gear_set: GearSet,
    train: Train,
    on_body: tuple[Shaft, ShaftBody],
    rolling: tuple[Bearing, ...],
) -> Rotor:
    shaft, body = on_body
    gears = [gear_set.gears[index] for index in shaft.gears]
    wheels = [
        Disk(
            position=position,
            mass=mass_of(gear),
            polar_inertia=inertia_of(gear),
            transverse_inertia=transverse_inertia(gear),
        )
        for gear, position in zip(gears, body.gear_positions, strict=True)
    ]
    disks = [
        Disk(
            position=disk.position,
            mass=disk.mass,
            polar_inertia=disk.inertia,
            transverse_inertia=disk.transverse_inertia,
        )
        for disk in body.disks
    ]
    # springs to ground turn with their gear
    springs = [
        Bearing(
            position=position,
            stiffness=(0.0, 0.0, 0.0, 0.0),
            torsional_stiffness=gear.coupling_stiffness,
        )
        for gear, position in zip(gears, body.gear_positions, strict=True)
        if gear.coupling_stiffness
    ]
    bare = shaft_rotor(gear_set, shaft, body)
    return replace(
        bare,
        disks=(*wheels, *disks),
        bearings=(*bare.bearings, *rolling, *springs),
        speed_ratio=float(train.speeds[shaft.gears[0]]),
    )


def _meshes(
    gear_set: GearSet,
    train: Train,
    bodies: Sequence[ShaftBody],
    mean_stiffness: Sequence[float],
) -> Iterator[MeshSpring]:
    places = {
        gear: (number, position)
        for number, (shaft, body) in enumerate(
            zip(gear_set.shafts, bodies, strict=True)
        )
        for gear, position in zip(shaft.gears, body.gear_positions, strict=True)
    }
    for number, mesh in enumerate(train.meshes):
        (one, first), (other, second) = places[mesh.driver], places[mesh.driven]
        driver, driven = train.gears[mesh.driver], train.gears[mesh.driven]
        yield MeshSpring(
            rotors=(one, other),
            positions=(first, second),
            offsets=gear_set.width_middles(number),
            base_radii=(driver.base_radius, driven.base_radius),
            direction=line_of_action(train, mesh),
            sense=rolling_sense(train, mesh),
            stiffness=float(mean_stiffness[number]),
            width=gear_set.common_width(number),
            teeth=driver.teeth,
        )


def _in_space(
    gear_set: GearSet, mesh: int, matrices: Sequence[Array]
) -> dict[str, Any]:
    """Values of `MeshSpring` of a mesh whose gears move in space."""
    helix = _helix(gear_set, mesh)
    if not len(matrices):
        return helix
    return helix | {"matrix": tuple(map(tuple, matrices[mesh].tolist()))}


def _helix(gear_set: GearSet, mesh: int) -> dict[str, Any]:
    """Values of `MeshSpring` of a helical mesh, none of a spur one."""
    pair = gear_set.meshes[mesh].pair
    if not gear_set.meshes[mesh].is_helical:
        return {}
    # of a force of 1 N in the section, which the driver has the opposite one of
    axial_force = -axial_force_on_driver(gear_set, mesh, pair.driver_arm)
    return {
        "base_helix_angle": math.atan(axial_force),
        "pressure_angle": pair.operating_pressure_angle,
        "path": (pair.path_start, pair.path_end),
    }
