"""What faults a gear set can run with, and which of them a model refuses."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from fegear.files.errors import InputError
from fegear.gearset.faults.tooth_faults import (
    FAULT_KINDS,
    FaultKind,
    Faults,
    Wear,
)
from fegear.gearset.model import GearSet, Mesh
from meshes import GearPair, GeometryError
from meshes.gear import ceiled

KEYS: dict[FaultKind, str] = {
    "cracks": "cracks",
    "spalls": "spalls",
    "broken_tips": "broken_tips",
    "missing": "missing_teeth",
    "worn": "worn_teeth",
    "eccentricity": "eccentricity_um",
}


def require_no_faults(
    gear_set: GearSet, kinds: Collection[FaultKind], model: str
) -> None:
    """Raise InputError where a gear has a fault of a kind that a model leaves out.

    model : such as "statics", in words
    """
    for gear in gear_set.gears:
        for kind in gear.faults.kinds:
            if kind in kinds:
                raise InputError(
                    f'{gear_set.name}: gear "{gear.name}": {KEYS[kind]}; not modelled '
                    f"by {model}, which would leave it out"
                )


def require_nominal(gear_set: GearSet, model: str) -> None:
    """Raise InputError for faults, and for errors of pitches and planets' positions.

    model : that leaves them all out, in words
    """
    require_no_faults(gear_set, FAULT_KINDS, model)
    left_out = f"not modelled by {model}, which would leave it out"
    for gear in gear_set.gears:
        if any(gear.pitch_errors):
            raise InputError(
                f'{gear_set.name}: gear "{gear.name}": pitch_errors_um; {left_out}'
            )
    if gear_set.carrier is not None and any(gear_set.carrier.position_errors):
        raise InputError(f"{gear_set.name}: position_errors_um; {left_out}")


def without_faults(
    gear_set: GearSet, kinds: Collection[FaultKind] = FAULT_KINDS
) -> GearSet:
    """The gear set without faults of some kinds, or of any."""
    gears = (
        replace(gear, faults=gear.faults.without(kinds)) if gear.faults.any else gear
        for gear in gear_set.gears
    )
    return replace(gear_set, gears=tuple(gears))


def with_equal_teeth(gear_set: GearSet) -> GearSet:
    """The gear set without faults but wear that all teeth of a gear have alike."""
    gears = (
        replace(gear, faults=Faults(worn=_common_wear(gear.faults)))
        if gear.faults.any
        else gear
        for gear in gear_set.gears
    )
    return replace(gear_set, gears=tuple(gears))


def _common_wear(faults: Faults) -> tuple[Wear, ...]:
    return tuple(wear for wear in faults.worn if wear.tooth is None)


def require_running(gear_set: GearSet) -> None:
    """Raise InputError where faults leave no tooth or jam the teeth of a mesh."""
    if not any(gear.faults.any for gear in gear_set.gears):
        return
    for gear in gear_set.gears:
        if len(gear.faults.missing) == gear.geometry.teeth:
            raise InputError(
                f'gear "{gear.name}": missing_teeth has all {gear.geometry.teeth} '
                "teeth; some must be left"
            )
    for mesh in gear_set.meshes:
        _require_distances(gear_set, mesh)


def _require_distances(gear_set: GearSet, mesh: Mesh) -> None:
    """Require teeth that mesh at the least and the largest centre distance."""
    gears = [gear_set.gears[gear] for gear in mesh.gears]
    eccentricity = sum(gear.faults.eccentricity for gear in gears)
    if not eccentricity:
        return
    pair, distance = mesh.pair, mesh.pair.center_distance
    where = f'mesh "{gears[0].name}"-"{gears[1].name}"'
    stated = " and ".join(
        f'gear "{gear.name}": eccentricity_um = {1e6 * gear.faults.eccentricity:.9g}'
        for gear in gears
        if gear.faults.eccentricity
    )
    for extreme in (distance - eccentricity, distance + eccentricity):
        place = f"{stated}; at a centre distance of {1e3 * extreme:.9g} mm in {where}"
        try:
            other = GearPair(pair.driver, pair.driven, extreme)
        except GeometryError as error:
            quantity = "" if error.field == "center_distance" else error.field
            text = f"{quantity.replace('_', ' ')} {error.message}".strip()
            raise InputError(f"{place}: {text}") from None
        room = mesh.backlash + other.backlash - pair.backlash
        if room < -1e-9 * pair.base_pitch:
            raise InputError(
                f"{place}: backlash {1e6 * room:.6g} um, of which "
                f"{ceiled(1e6 * mesh.backlash)} um without eccentricity; it must not "
                "be negative"
            )
