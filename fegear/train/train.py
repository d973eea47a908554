"""From a gear set to a lumped gear train under torque.

Rotations and torques are counter-clockwise; the first mesh's driver turns
counter-clockwise. Torques follow from statics: T2 = T1 z2 / z1 at each mesh.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

from fegear.files.errors import InputError
from fegear.gearset.inertia import inertia_of, mass_of
from fegear.gearset.model import Gear, GearSet, Mesh
from fegear.gearset.phases import mesh_phases
from lumped.train import train as lumped

DAMPING_RATIO = 0.04  # where neither the caller nor the gear set says otherwise


def train_of(
    gear_set: GearSet,
    torque: float,
    translations: bool = False,
    damping_ratio: float | None = None,
) -> lumped.Train:
    """The lumped train; raises InputError where the gear set does not give one.

    torque : on the input gear, in its sense of rotation [N m]; what the last driven
        gear takes resists it, all gears between are free. Both balance without
        friction, see `with_efficiency`
    translations : gears with bearings move in the plane; else no centre moves
    damping_ratio : of every mode, in place of the gear set's
    """
    if translations and not any(gear.bearing_stiffness for gear in gear_set.gears):
        raise InputError(
            f"{gear_set.name}: no gear has bearing_kx_N_per_m and bearing_ky_N_per_m; "
            "at least one is needed for translations"
        )
    torques = external_torques(gear_set, torque)
    try:
        return lumped.Train(
            gears=tuple(
                _lumped_gear(gear, external, translations)
                for gear, external in zip(gear_set.gears, torques, strict=True)
            ),
            meshes=tuple(_lumped_meshes(gear_set)),
            shafts=tuple(_lumped_shafts(gear_set)),
            damping_ratio=_damping_ratio(gear_set, damping_ratio),
        )
    except lumped.TrainError as error:
        raise InputError(f"{gear_set.name}: {error}") from None


def input_torques(gear_set: GearSet) -> tuple[float, ...]:
    """The gear set's load cases on the input gear [N m], or empty."""
    steps = _power_path(gear_set)
    return gear_set.meshes[steps[0].mesh].torques


def mesh_torques_at(gear_set: GearSet, torque: float) -> tuple[float, ...]:
    """Torque on every mesh's driver [N m] at a torque on the input gear.

    0 in a mesh that passes no power on.
    """
    _require_torque(gear_set, torque)
    factors = {step.mesh: step.factor for step in _power_path(gear_set)}
    return tuple(torque * factors.get(n, 0.0) for n in range(len(gear_set.meshes)))


def external_torques(gear_set: GearSet, torque: float) -> tuple[float, ...]:
    """Torque on every gear from outside [N m], counter-clockwise."""
    _require_torque(gear_set, torque)
    steps, senses = _power_path(gear_set), gear_set.senses
    last = gear_set.meshes[steps[-1].mesh]
    torques = [0.0] * len(gear_set.gears)
    into, out = gear_set.meshes[steps[0].mesh].driver, last.driven
    torques[into] = senses[into] * torque
    torques[out] = -senses[out] * torque * steps[-1].factor * _ratio(last)
    return tuple(torques)


def power_meshes(gear_set: GearSet) -> tuple[int, ...]:
    """Meshes that pass power on, from the input gear on."""
    return tuple(step.mesh for step in _power_path(gear_set))


def with_efficiency(
    gear_set: GearSet, train: lumped.Train, efficiency: float
) -> lumped.Train:
    """A train whose output torque is lowered by what its meshes lose."""
    out = gear_set.meshes[power_meshes(gear_set)[-1]].driven
    gears = list(train.gears)
    gears[out] = replace(gears[out], torque=efficiency * gears[out].torque)
    return replace(train, gears=tuple(gears))


@dataclass(frozen=True)
class Step:
    """A mesh that passes power on; the torque on its driver per input torque."""

    mesh: int
    factor: float


def _power_path(gear_set: GearSet) -> list[Step]:
    """Meshes from the input gear on, in the order in which power passes them."""
    number: int | None = _first_mesh(gear_set)
    steps: list[Step] = []
    factor = 1.0
    while number is not None and all(step.mesh != number for step in steps):
        steps.append(Step(number, factor))
        mesh = gear_set.meshes[number]
        factor *= _ratio(mesh)
        number = _driven_on(gear_set, mesh.driven)
    if number is not None:
        name = gear_set.gears[gear_set.meshes[number].driver].name
        raise InputError(
            f'{gear_set.name}: power returns to gear "{name}"; a train that ends in '
            "a driven gear is needed"
        )
    return steps


def _first_mesh(gear_set: GearSet) -> int:
    """The loaded mesh whose driver nothing drives; without loads the first mesh."""
    meshes = gear_set.meshes
    driven = {mesh.driven for mesh in meshes}
    number = 0
    if any(mesh.torques for mesh in meshes):
        number = next(
            n
            for n, mesh in enumerate(meshes)
            if mesh.torques and driven.isdisjoint(gear_set.axis(mesh.driver))
        )
    _driven_on(gear_set, meshes[number].driver)  # refuses a branch
    return number


def _driven_on(gear_set: GearSet, gear: int) -> int | None:
    """The mesh that a gear or another on its shaft drives, None if there is none."""
    axis = gear_set.axis(gear)
    found = [n for n, mesh in enumerate(gear_set.meshes) if mesh.driver in axis]
    if len(found) > 1:
        raise InputError(
            f'{gear_set.name}: gear "{gear_set.gears[gear].name}" or its shaft drives '
            f"{len(found)} meshes; the split of the torque is ambiguous, one mesh is "
            "allowed"
        )
    return found[0] if found else None


def _ratio(mesh: Mesh) -> float:
    return mesh.pair.driven.teeth / mesh.pair.driver.teeth


def _require_torque(gear_set: GearSet, torque: float) -> None:
    if not 0.0 <= torque < math.inf:
        raise InputError(
            f"{gear_set.name}: torque = {torque:g} N m on the input gear; must be 0 "
            "or more and finite, in the sense of rotation"
        )


def _damping_ratio(gear_set: GearSet, given: float | None) -> float:
    named = (given, gear_set.damping_ratio, DAMPING_RATIO)
    return next(ratio for ratio in named if ratio is not None)


def _lumped_gear(gear: Gear, torque: float, translations: bool) -> lumped.Gear:
    return lumped.Gear(
        name=gear.name,
        teeth=gear.geometry.teeth,
        base_radius=gear.geometry.base_radius,
        inertia=inertia_of(gear),
        mass=mass_of(gear),
        bearing_stiffness=gear.bearing_stiffness if translations else None,
        coupling_stiffness=gear.coupling_stiffness,
        torque=torque,
    )


def _lumped_meshes(gear_set: GearSet) -> Iterator[lumped.Mesh]:
    for mesh, phase in zip(gear_set.meshes, mesh_phases(gear_set), strict=True):
        yield lumped.Mesh(
            driver=mesh.driver,
            driven=mesh.driven,
            pressure_angle=mesh.pair.operating_pressure_angle,
            center_line=mesh.direction,
            backlash=mesh.backlash,
            phase=phase.value,
        )


def _lumped_shafts(gear_set: GearSet) -> Iterator[lumped.Shaft]:
    """A shaft of more than two gears is a chain of shafts between neighbours."""
    for shaft in gear_set.shafts:
        for ends in pairwise(shaft.gears):
            yield lumped.Shaft(gears=ends, stiffness=shaft.stiffness)
