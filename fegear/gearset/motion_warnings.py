"""Warnings of gear sets in motion: of their values, and of what no model has."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fegear.files.codes import with_code
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings


def motion_warnings(
    gear_set: GearSet, in_space: bool = False, joins_housing: bool = False
) -> Iterator[str]:
    """A line for each warning of a gear set whose motion or modes are computed.

    in_space : whether gears move along their axes and tilt
    joins_housing : whether shafts are in the housing, as in space
    """
    yield from gear_set_warnings(gear_set, in_space or joins_housing)
    if in_space:
        return
    teeth = [gear.geometry for gear in gear_set.gears]
    slope = max(abs(gear.twist * gear.reference_radius) for gear in teeth)
    if slope > 0.0 and all(g.groove for g in gear_set.gears if g.geometry.twist):
        yield with_code(
            "W59",
            f"helix angle {math.degrees(math.atan(slope)):.4g} deg, double helical: "
            "motions leave out axial motion, in which the halves share the load anew",
        )
    elif slope > 0.0:
        yield with_code(
            "W59",
            f"helix angle {math.degrees(math.atan(slope)):.4g} deg: motions leave out "
            "axial motion, and tilt by the axial force; by an estimate for free bodies "
            "natural frequencies change by +2 to +9 %, with tilt by +7 to +29 %, at 15 "
            "to 30 deg",
        )
