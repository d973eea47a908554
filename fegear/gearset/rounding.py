"""Backlash that the rounding of printed values explains.

Drawings and tables round each value, so that teeth which just fit overlap by a fraction
of a micrometre once they are typed in. A value is known to half a unit of its last
digit, or of the last one that drawings print where fewer are given.
"""

from __future__ import annotations

import math
from decimal import Decimal

from fegear.files.errors import InputError
from fegear.gearset.rack_keys import MODULE_KEYS, PRESSURE_ANGLE_KEYS
from fegear.gearset.schema import GearEntry, MeshEntry
from fegear.gearset.teeth import Blank, blank_of
from fegear.gearset.tips import spacing
from meshes.involute import involute

# decimals that drawings print at least, in the units of the keys
PRINTED_DECIMALS = {
    "profile_shift": 4,
    "tooth_thinning_um": 0,
    "span_mm": 3,
    "pin_dimension_mm": 3,
    "center_distance_mm": 3,
    "operating_pressure_angle_deg": 4,
}
# values of standards are exact with fewer decimals; more show that they are rounded
MIN_ROUNDED_DECIMALS = 3


def rounding_of_backlash(mesh: MeshEntry, one: Blank, two: Blank) -> float:
    """Backlash along the line of action [m] that rounding of all values may take away.

    The sum of what each value changes that is given, within half a unit of its last
    digit. Module and angles are those of both gears at once.
    """
    backlash = _backlash(mesh, one, two)
    lost = 0.0
    for key, values in _standard_values(one.entry, two.entry).items():
        half = max(map(_half_unit_of_standard, values))
        moved = (_moved(blank, key, half) for blank in (one, two))
        lost += abs(_backlash(mesh, *moved) - backlash)
    for key, decimals in PRINTED_DECIMALS.items():
        if (value := getattr(mesh, key, None)) is not None:
            changed = {key: value + _half_unit(value, decimals)}
            moved_mesh = mesh.model_copy(update=changed)
            lost += abs(_backlash(moved_mesh, one, two) - backlash)
        for blank, other, is_first in ((one, two, True), (two, one, False)):
            if (value := getattr(blank.entry, key, None)) is None:
                continue
            changed_blank = _moved(blank, key, _half_unit(value, decimals))
            pair = (changed_blank, other) if is_first else (other, changed_blank)
            lost += abs(_backlash(mesh, *pair) - backlash)
    return lost


def _standard_values(*entries: GearEntry) -> dict[str, set[float]]:
    """Stated values of module, pressure angle and helix angle, by key."""
    values: dict[str, set[float]] = {}
    for entry in entries:
        for key in (entry.module_key, entry.pressure_angle_key):
            values.setdefault(key, set()).add(entry.rack_value(key))
        values.setdefault("helix_angle_deg", set()).add(entry.helix_angle_deg)
    return values


def _half_unit(value: float, decimals: int) -> float:
    """Half a unit of the last digit; nothing is no rounded value."""
    if not value:
        return 0.0
    return 0.5 * 10.0 ** -max(decimals, _decimals(value))


def _half_unit_of_standard(value: float) -> float:
    """Half a unit of a value that standards name, 0 where it is one of those."""
    decimals = _decimals(value)
    return 0.5 * 10.0**-decimals if decimals >= MIN_ROUNDED_DECIMALS else 0.0


def _decimals(value: float) -> int:
    """Digits after the point of the shortest text that is read as this value."""
    exponent = Decimal(repr(value)).normalize().as_tuple().exponent
    return max(0, -int(exponent))


def _moved(blank: Blank, key: str, step: float) -> Blank:
    """The gear with another value of a key."""
    if not step:
        return blank
    entry: GearEntry = blank.entry
    if key in (*MODULE_KEYS, *PRESSURE_ANGLE_KEYS):
        entry = entry.with_rack_value(key, entry.rack_value(key) + step)
    else:
        entry = entry.model_copy(update={key: getattr(entry, key) + step})
    return blank_of(entry, -1 if blank.twist < 0.0 else 1)


def _backlash(mesh: MeshEntry, one: Blank, two: Blank) -> float:
    """Backlash along the line of action of two gears without tips [m]."""
    try:
        distance = spacing(mesh, one, two).center_distance
    except InputError:  # what is refused for another reason
        return math.nan
    bases = one.base_radius + two.base_radius
    angle = math.acos(min(1.0, abs(bases) / distance))
    halves = (
        0.5 * blank.base_radius * _arc_thickness(blank) / blank.reference_radius
        + blank.base_radius * involute(blank.pressure_angle)
        for blank in (one, two)
    )
    gap = bases * involute(angle) - sum(halves)
    return 2.0 * gap + one.base_radius * one.pitch_angle


def _arc_thickness(blank: Blank) -> float:
    """Thickness of the tooth on the reference circle, across the axis [m]."""
    thickness = blank.thickness
    shift = 2.0 * thickness.profile_shift * math.tan(blank.pressure_angle)
    return blank.module * (0.5 * math.pi + shift) - thickness.thinning
