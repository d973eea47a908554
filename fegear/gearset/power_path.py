"""The way of power through a gear train, and the torques that follow from statics.

Torque on a driven gear is that on its driver by the ratio, T2 = T1 z2 / z1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from fegear.files.errors import InputError
from fegear.gearset.model import GearSet, Mesh, PlanetCarrier
from lumped.common.checks import format_number


@dataclass(frozen=True)
class PowerPath:
    """Meshes that pass power on, in order, from the input gear to the output gear.

    factors : torque on the driver of every mesh of the train per torque on the input
        gear; 0 for a mesh that passes no power on
    into, out : indices of the input gear and the output gear
    """

    meshes: tuple[int, ...]
    factors: tuple[float, ...]
    into: int
    out: int


@lru_cache(maxsize=64)
def power_path(gear_set: GearSet) -> PowerPath:
    """The power path; raises InputError where a train branches or has no end.

    In a planetary set all meshes pass on an equal share, and an input or output that
    is the carrier has the index after that of the last gear.
    """
    if gear_set.carrier is not None:
        return _planetary_path(gear_set, gear_set.carrier)
    first = _first_mesh(gear_set)
    number: int | None = first
    factors: dict[int, float] = {}
    factor = 1.0
    while number is not None and number not in factors:
        factors[number] = factor
        mesh = gear_set.meshes[number]
        factor *= _ratio(mesh)
        number = _driven_on(gear_set, mesh.driven)
    if number is not None:
        name = gear_set.gears[gear_set.meshes[number].driver].name
        raise InputError(
            f'{gear_set.name}: power returns to gear "{name}"; a train that ends in '
            "a driven gear is needed"
        )
    return PowerPath(
        meshes=tuple(factors),
        factors=tuple(factors.get(n, 0.0) for n in range(len(gear_set.meshes))),
        into=gear_set.meshes[first].driver,
        out=mesh.driven,
    )


def input_torques(gear_set: GearSet) -> tuple[float, ...]:
    """Load cases of the gear set on the input gear [N m], or empty."""
    if gear_set.carrier is not None:
        return gear_set.carrier.torques
    return gear_set.meshes[power_path(gear_set).meshes[0]].torques


def mesh_torques_at(gear_set: GearSet, torque: float) -> tuple[float, ...]:
    """Torque on the driver of every mesh [N m] at a torque on the input gear."""
    _require_torque(gear_set, torque)
    return tuple(torque * factor for factor in power_path(gear_set).factors)


def external_torques(gear_set: GearSet, torque: float) -> tuple[float, ...]:
    """Torque on every gear from outside [N m], counter-clockwise.

    In a planetary set that on its carrier is the last.
    """
    _require_torque(gear_set, torque)
    if gear_set.carrier is not None:
        return _planetary_torques(gear_set, gear_set.carrier, torque)
    path, senses = power_path(gear_set), gear_set.senses
    torques = [0.0] * len(gear_set.gears)
    torques[path.into] = senses[path.into] * torque
    last = path.meshes[-1]
    ratio = _ratio(gear_set.meshes[last])
    torques[path.out] = -senses[path.out] * torque * path.factors[last] * ratio
    return tuple(torques)


def _planetary_path(gear_set: GearSet, carrier: PlanetCarrier) -> PowerPath:
    members, last = carrier.members, len(gear_set.gears)
    ends = map(carrier.gear_of, (members.input, members.output))
    into, out = (last if gear is None else gear for gear in ends)
    teeth = [mesh.pair.driver.teeth for mesh in gear_set.meshes]
    factors = tuple(members.torque_factor(number) for number in teeth)
    return PowerPath(tuple(range(len(factors))), factors, into, out)


def _planetary_torques(
    gear_set: GearSet, carrier: PlanetCarrier, torque: float
) -> tuple[float, ...]:
    """Torques of the members, in the sense in which the driver of the meshes turns."""
    members = carrier.members
    sense = gear_set.senses[carrier.sun] * (1 if members.sun_drives else -1)
    scale = sense * torque / abs(members.weights[members.input])
    torques = [0.0] * (len(gear_set.gears) + 1)
    torques[carrier.sun] = scale * members.weights["sun"]
    torques[carrier.ring] = scale * members.weights["ring"]
    torques[-1] = scale * members.weights["carrier"]
    return tuple(torques)


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
    meshes = [n for n, mesh in enumerate(gear_set.meshes) if mesh.driver in axis]
    if len(meshes) > 1:
        raise InputError(
            f'{gear_set.name}: gear "{gear_set.gears[gear].name}" or its shaft drives '
            f"{len(meshes)} meshes; the split of the torque is ambiguous, one mesh is "
            "allowed"
        )
    return meshes[0] if meshes else None


def _ratio(mesh: Mesh) -> float:
    return mesh.pair.driven.teeth / mesh.pair.driver.teeth


def _require_torque(gear_set: GearSet, torque: float) -> None:
    if not 0.0 <= torque < math.inf:
        raise InputError(
            f"{gear_set.name}: torque = {format_number(torque)} N m on the input "
            "gear; must be 0 "
            "or more and finite, in the sense of rotation"
        )
