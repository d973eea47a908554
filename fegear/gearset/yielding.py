"""Gear sets whose shafts and bearings yield under the forces of their teeth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from fegear.files.errors import InputError
from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.leads import require_one_helix
from fegear.gearset.model import GearSet, Shaft
from fegear.gearset.problems import shown
from fegear.gearset.shaft_bodies import ShaftBody
from lumped.common.units import MM
from meshes.gear import apart_from, ceiled

# entry of a table's header
SHAFTS, YIELD = "shafts and bearings", "yield under the forces of teeth"
LEAVE_OUT = "or shafts left out, shafts = off"
MAX_AXIAL_SHARE = 0.1  # of a face width, by which a shaft yields along its axis


def on_shafts(gear_set: GearSet) -> GearSet:
    """The gear set on its shafts that yield, the same where none is described.

    Loads of meshes with a gear on such a shaft vary over the face width. Raises
    InputError for double helical gears, and for thrust that no bearing takes.
    """
    gears = {gear for _, shaft in yielding_shafts(gear_set) for gear in shaft.gears}
    if not gears:
        return gear_set
    require_one_helix(gear_set, "shafts that yield, left out by shafts = off,")
    meshes = tuple(
        replace(mesh, on_shafts=bool(gears.intersection(mesh.gears)))
        for mesh in gear_set.meshes
    )
    if refusal := missing_thrust_path(gear_set):
        raise InputError(f"{refusal}, {LEAVE_OUT}")
    return replace(gear_set, meshes=meshes)


def yielding_shafts(gear_set: GearSet) -> Iterator[tuple[int, Shaft]]:
    """Shafts with sections and bearings, and their indices."""
    for index, shaft in enumerate(gear_set.shafts):
        if shaft.body is not None and shaft.body.bearings:
            yield index, shaft


def missing_thrust_path(gear_set: GearSet) -> str | None:
    """Which shaft has a helical gear and no bearing that holds it along its axis."""
    for index, shaft in yielding_shafts(gear_set):
        if shaft.body is None or _takes_thrust(shaft.body):
            continue
        for number, mesh in enumerate(gear_set.meshes):
            gears = set(shaft.gears).intersection(mesh.gears)
            if gears and axial_force_on_driver(gear_set, number, 1.0):
                name = gear_set.gears[min(gears)].name
                stiffnesses = [b.axial_stiffness for b in shaft.body.bearings]
                state = "is missing" if None in stiffnesses else "is 0 at all of them"
                state = f"bearing_kz_N_per_m {state}"
                if shaft.body.mounted_bearings:
                    state = "rolling_bearings has roller bearings only"
                return (
                    f"{gear_set.name}: shaft {index + 1}: {state}, "
                    f'and gear "{name}" pushes along the axis; a bearing must take '
                    "the thrust"
                )
    return None


def too_soft_along_axis(gear_set: GearSet, index: int, thrust: float) -> str | None:
    """Why linear bearings of a shaft are too soft along its axis, None if they are not.

    Contact is that of gears that stay beside each other: a shaft may yield by a small
    part of its least face width.

    thrust : of all gears on the shaft [N]
    """
    shaft = gear_set.shafts[index]
    bearings = shaft.body.bearings if shaft.body is not None else ()
    stiffnesses = [bearing.axial_stiffness or 0.0 for bearing in bearings]
    total = math.fsum(stiffnesses)
    most = MAX_AXIAL_SHARE * min(gear_set.gears[g].face_width for g in shaft.gears)
    if not total or abs(thrust) <= most * total:
        return None
    names = "+".join(gear_set.gears[gear].name for gear in shaft.gears)
    most_mm = f"{most / MM:.6g}"
    moved_mm = apart_from(abs(thrust) / total / MM, most_mm)
    return (
        f"{gear_set.name}: shaft {index + 1}, {names}: bearing_kz_N_per_m = "
        f"{', '.join(map(shown, stiffnesses))}; the thrust of {abs(thrust):.4g} N "
        f"moves the shaft by {moved_mm} mm along its axis, at most {most_mm} mm is "
        "allowed, a tenth of the face width, which needs "
        f"{ceiled(abs(thrust) / most)} N/m or more in all"
    )


def _takes_thrust(body: ShaftBody) -> bool:
    """Whether a bearing holds a shaft along its axis, in one sense at least."""
    return any(bearing.axial_stiffness for bearing in body.bearings) or any(
        mounted.thrust_senses for _, mounted in body.mounted_bearings
    )
