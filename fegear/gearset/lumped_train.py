"""From a gear set to a lumped gear train under torque.

Rotations and torques are counter-clockwise; the first mesh's driver turns
counter-clockwise. Torques follow from statics: T2 = T1 z2 / z1 at each mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import lumped.train.train as lumped
from fegear.files.errors import InputError
from fegear.gearset.inertia import inertia_of, mass_of
from fegear.gearset.model import GearSet, PlanetCarrier
from fegear.gearset.phases import mesh_phases
from fegear.gearset.power_path import external_torques, power_path
from lumped.train.rolling_supports import linearise_bearings

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
    translations : gears with bearings move in the plane; else no centre moves. Those
        on rolling bearings also have the bearings' stiffnesses under load
    damping_ratio : of every mode, in place of the gear set's
    """
    carrier = gear_set.carrier
    bodies = *gear_set.gears, *((carrier,) if carrier else ())
    rolling = any(gear.rolling_bearing for gear in gear_set.gears)
    if translations and not rolling and not any(b.bearing_stiffness for b in bodies):
        raise InputError(
            f"{gear_set.name}: no gear has bearing_kx_N_per_m and bearing_ky_N_per_m; "
            "at least one is needed for translations"
        )
    torques = external_torques(gear_set, torque)
    try:
        train = lumped.Train(
            gears=tuple(
                _lumped_gear(gear_set, index, torques[index], translations)
                for index in range(len(gear_set.gears))
            ),
            meshes=tuple(_lumped_meshes(gear_set)),
            shafts=tuple(_lumped_shafts(gear_set)),
            damping_ratio=_damping_ratio(gear_set, damping_ratio),
            carrier=_lumped_carrier(carrier, torques[-1], translations)
            if carrier
            else None,
        )
        return linearise_bearings(train) if translations else train
    except lumped.TrainError as error:
        raise InputError(f"{gear_set.name}: {error}") from None


def with_efficiency(
    gear_set: GearSet, train: lumped.Train, efficiency: float
) -> lumped.Train:
    """A train whose output torque is lowered by what its meshes lose."""
    if gear_set.carrier is not None:
        raise InputError(
            "torque_of = input; a planetary set has the nominal torque alone, use "
            "nominal"
        )
    out = power_path(gear_set).out
    gears = list(train.gears)
    gears[out] = replace(gears[out], torque=efficiency * gears[out].torque)
    return replace(train, gears=tuple(gears))


def _damping_ratio(gear_set: GearSet, override: float | None) -> float:
    named = (override, gear_set.damping_ratio, DAMPING_RATIO)
    return next(ratio for ratio in named if ratio is not None)


def _lumped_gear(
    gear_set: GearSet, index: int, torque: float, translations: bool
) -> lumped.Gear:
    gear, carrier = gear_set.gears[index], gear_set.carrier
    return lumped.Gear(
        name=gear.name,
        teeth=gear.geometry.teeth,
        base_radius=gear.geometry.base_radius,
        inertia=inertia_of(gear),
        mass=mass_of(gear),
        bearing_stiffness=gear.bearing_stiffness if translations else None,
        rolling_bearing=gear.rolling_bearing if translations else None,
        coupling_stiffness=gear.coupling_stiffness,
        torque=torque,
        is_held=carrier is not None and carrier.is_held(index),
    )


def _lumped_carrier(
    carrier: PlanetCarrier, torque: float, translations: bool
) -> lumped.Carrier:
    return lumped.Carrier(
        name=carrier.name,
        gears=carrier.planets,
        radius=carrier.radius,
        angles=carrier.angles,
        inertia=carrier.inertia,
        mass=carrier.mass,
        bearing_stiffness=carrier.bearing_stiffness if translations else None,
        coupling_stiffness=carrier.coupling_stiffness,
        torque=torque,
        is_held=carrier.members.held == "carrier",
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
