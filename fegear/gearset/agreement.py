"""Values that gears in mesh have in common, typed in with the digits of a drawing.

Module, pressure angle and helix angle of two gears in mesh may differ by the rounding
of their digits, or of a conversion from radians. The geometry then has one value.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from fegear.gearset.problems import shown
from fegear.gearset.rack_keys import MODULE_KEYS, PRESSURE_ANGLE_KEYS, RESTATED_RTOL
from fegear.gearset.schema import Document, GearEntry
from fegear.gearset.teeth import Blank, blank_of
from meshes.pairing import COMMON_ATOL, COMMON_RTOL

LENGTH_RTOL = 1e-6  # of modules and base pitches that are meant to be equal
ANGLE_ATOL_DEG = math.degrees(1e-6)


def with_common_values(document: Document) -> Document:
    """The document in which gears in mesh agree exactly where their digits do.

    Of gears that are linked by meshes the first has its own values; each other one
    takes those of the mate through which it is reached. A sentence says which changed.
    """
    gears = {gear.name: gear for gear in document.gear}
    inferences = []
    for mate, name in _from_mate_to_gear(document):
        update = _taken_values(gears[mate], gears[name])
        if update:
            values = ", ".join(
                f"{key} = {shown(value)} instead of {_value(gears[name], key):.16g}"
                for key, value in update.items()
            )
            inferences.append(
                f'gear "{name}": {values}, to fit its mate "{mate}" exactly'
            )
            gears[name] = gears[name].model_copy(update=update)
    if not inferences:
        return document
    entries = tuple(gears[gear.name] for gear in document.gear)
    every = (*document.inferences, *inferences)
    return document.model_copy(update={"gear": entries, "inferences": every})


def _from_mate_to_gear(document: Document) -> Iterator[tuple[str, str]]:
    """Each gear once with the mate through which meshes reach it, in order."""
    names = set(document.gear_names)
    pairs = [
        pair
        for mesh in document.mesh
        if {mesh.driver, mesh.driven} <= names  # others are refused with their names
        for pair in ((mesh.driver, mesh.driven), (mesh.driven, mesh.driver))
    ]
    reached = set[str]()
    for start in document.gear_names:
        waiting = [start] if start not in reached else []
        reached.add(start)
        while waiting:
            mate = waiting.pop(0)
            for one, two in pairs:
                if one == mate and two not in reached:
                    reached.add(two)
                    waiting.append(two)
                    yield mate, two


def _taken_values(mate: GearEntry, gear: GearEntry) -> dict[str, float]:
    """Values that a gear takes from its mate, by the keys of the gear."""
    taken: dict[str, float] = {}
    turn = abs(mate.helix_angle_deg - gear.helix_angle_deg)
    if 0.0 < turn <= ANGLE_ATOL_DEG:
        taken["helix_angle_deg"] = mate.helix_angle_deg
    two = gear.model_copy(update=taken)
    key = gear.pressure_angle_key
    if _differ_by_digits(mate, two, key, ANGLE_ATOL_DEG):
        taken[key] = mate.rack_value(key)
    key = gear.module_key
    if _differ_by_digits(mate, two, key, LENGTH_RTOL * mate.rack_value(key)):
        taken[key] = mate.rack_value(key)
    ratio = _pitch_ratio(mate, gear.model_copy(update=taken))
    if COMMON_RTOL < abs(ratio - 1.0) <= LENGTH_RTOL:
        # of another module and pressure angle; a diametral pitch is over a length
        module = taken.get(key, gear.rack_value(key))
        taken[key] = module * ratio if key.endswith("_mm") else module / ratio
    return taken


def _differ_by_digits(
    mate: GearEntry, gear: GearEntry, key: str, tolerance: float
) -> bool:
    """Whether a key of the gear would be that of its mate but for rounding.

    Round-off is no difference where the mate states the value by another key.
    """
    value = mate.rack_value(key)
    has_same_key = key in (mate.module_key, mate.pressure_angle_key)
    least = 0.0 if has_same_key else RESTATED_RTOL * value
    return least < abs(value - gear.rack_value(key)) <= tolerance


def _pitch_ratio(mate: GearEntry, gear: GearEntry) -> float:
    """Base pitch of the mate over that of the gear."""
    return blank_of(mate).base_pitch / blank_of(gear).base_pitch


def _value(gear: GearEntry, key: str) -> float:
    if key in (*MODULE_KEYS, *PRESSURE_ANGLE_KEYS):
        return gear.rack_value(key)
    return float(getattr(gear, key))


def has_equal_pitches(one: Blank, two: Blank) -> bool:
    """Whether two gears have the same base pitch."""
    return abs(one.base_pitch - two.base_pitch) <= COMMON_RTOL * one.base_pitch


def has_equal_base_helices(one: Blank, two: Blank) -> bool:
    """Whether the helix angles on the base cylinders have the same size."""
    angles = abs(one.base_helix_angle), abs(two.base_helix_angle)
    return abs(angles[0] - angles[1]) <= COMMON_ATOL
