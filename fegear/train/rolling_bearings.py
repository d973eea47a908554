"""Rolling bearings of spinning shafts, linearised where the machine is at rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.tooth_forces import loads_on_gears
from fegear.gearset.yielding import missing_thrust_path
from fegear.statics.axes import require_thrust_on_bearings, rolling_shafts
from lumped.common.array_types import Array
from lumped.rotors.description import Bearing, RotorError

# rotor and bearings of a shaft by its index
LinearisedBearings = Mapping[int, tuple[Bearing, ...]]
NO_BEARINGS: LinearisedBearings = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class LinearisedBearing:
    """Tangent stiffness of a rolling bearing at its load at rest."""

    shaft: str
    position_mm: float
    radial_x_N_per_m: float
    radial_y_N_per_m: float
    axial_N_per_m: float
    tilt_x_Nm_per_rad: float
    tilt_y_Nm_per_rad: float


def has_rolling_bearings(gear_set: GearSet) -> bool:
    """Whether a shaft is on rolling bearings."""
    bodies = (shaft.body for shaft in gear_set.shafts)
    return any(body is not None and body.mounted_bearings for body in bodies)


def bearings_at_rest(
    gear_set: GearSet, torque: float | None, on_gears: Array | None = None
) -> LinearisedBearings:
    """Rolling bearings of all shafts that have some, linearised at their loads.

    Where no bearing of a shaft takes thrust, that of helical gears is left out. Raises
    InputError where bearings do not hold a shaft, or take thrust in the other sense.

    torque : on the input gear [N m], None where there are no rolling bearings
    on_gears : loads (g, 5) on all gears, see `loads_on_gears`, by which they are
        computed where this is None
    """
    if torque is None or not has_rolling_bearings(gear_set):
        return NO_BEARINGS
    has_thrust = missing_thrust_path(gear_set) is None
    if has_thrust:
        require_thrust_on_bearings(gear_set, mesh_torques_at(gear_set, torque))
    if on_gears is None:
        on_gears = loads_on_gears(gear_set, torque, has_thrust)
    bearings = {}
    for index, shaft in rolling_shafts(gear_set).items():
        try:
            bearings[index] = shaft.statics_under(on_gears).rotor.bearings
        except RotorError as error:
            raise InputError(f"{gear_set.name}: {error}") from None
    return bearings


def linearised_entries(
    gear_set: GearSet, bearings: LinearisedBearings
) -> tuple[LinearisedBearing, ...]:
    """Stiffnesses of the bearings of all shafts, in order."""
    entries = []
    for index, of_shaft in bearings.items():
        gears = gear_set.shafts[index].gears
        for bearing in of_shaft:
            if bearing.linearised is None:
                continue
            x, y, z, *tilts = bearing.linearised.stiffness.diagonal().tolist()
            entries.append(
                LinearisedBearing(
                    shaft="+".join(gear_set.gears[gear].name for gear in gears),
                    position_mm=1e3 * bearing.position,
                    radial_x_N_per_m=x,
                    radial_y_N_per_m=y,
                    axial_N_per_m=z,
                    tilt_x_Nm_per_rad=tilts[0],
                    tilt_y_Nm_per_rad=tilts[1],
                )
            )
    return tuple(entries)
