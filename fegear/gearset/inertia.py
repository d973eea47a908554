"""Mass and polar inertia of a gear: as given, else of the body that is meshed.

The body reaches from the bore to the true outline of the teeth, and to their roots in
the groove of a double helical gear.
"""

from __future__ import annotations

import math

from fegear.files.errors import InputError
from fegear.gearset.model import Gear, GearSet
from meshes.gear import ceiled
from meshes.internal import InternalGear
from meshes.section import section_area, section_polar_moment

INERTIA_RTOL = 1e-5  # of a given inertia, as `fegear show` prints it
MIN_CARRIER_SHARE = 0.01  # of a ring's inertia, in what carries its springs


def body_mass(gear: Gear) -> float:
    """rho b A [kg]."""
    teeth = gear.geometry
    in_groove = math.pi * abs(teeth.root_radius**2 - teeth.hub_radius**2)
    return gear.density * _over_width(gear, section_area(teeth), in_groove)


def body_inertia(gear: Gear) -> float:
    """About the axis [kg m2]."""
    teeth = gear.geometry
    in_groove = 0.5 * math.pi * abs(teeth.root_radius**4 - teeth.hub_radius**4)
    return gear.density * _over_width(gear, section_polar_moment(teeth), in_groove)


def _over_width(gear: Gear, of_section: float, in_groove: float) -> float:
    """A quantity per width over the face width, of which the groove is part."""
    return gear.toothed_width * of_section + gear.groove * in_groove


def mass_of(gear: Gear) -> float:
    """The given mass, else the body's [kg]."""
    return body_mass(gear) if gear.mass is None else gear.mass


def inertia_of(gear: Gear) -> float:
    """The given polar inertia, else the body's [kg m2]."""
    return body_inertia(gear) if gear.inertia is None else gear.inertia


def require_inertia_of_bodies(
    gear_set: GearSet, otherwise: str = "fidelity quasistatic has no elastic body"
) -> None:
    """Raise InputError for a gear whose body alone exceeds the given inertia.

    An elastic body has its own inertia, and what it leaves of the given one is the
    hub's: without anything left the motion has no solution.

    otherwise : what has no elastic body
    """
    for gear in gear_set.gears:
        inertia, body = inertia_of(gear), body_inertia(gear)
        if not inertia >= (1.0 - INERTIA_RTOL) * body:
            raise InputError(
                f'{gear_set.name}: gear "{gear.name}": inertia_kg_m2 = {inertia:.6g} '
                f"is less than the {body:.6g} kg m2 of the body between bore and tooth "
                "outline; where the body is elastic, give its inertia or more, a "
                "smaller face_width_mm, a larger hub_radius_mm, or a smaller "
                f"density_kg_per_m3 for a body with holes; {otherwise}"
            )


def require_inertia_beyond_springs(gear_set: GearSet, otherwise: str) -> None:
    """Raise InputError for a rotating ring on springs whose carrier has no inertia.

    The torque on the ring acts on what carries its springs, which without inertia would
    follow every vibration at once.

    otherwise : what has no elastic body
    """
    for index, gear in enumerate(gear_set.gears):
        teeth, carrier = gear.geometry, gear_set.carrier
        if not (isinstance(teeth, InternalGear) and teeth.foundation):
            continue
        least = (1.0 + MIN_CARRIER_SHARE) * body_inertia(gear)
        is_held = carrier is not None and carrier.is_held(index)
        if not is_held and inertia_of(gear) < least * (1.0 - INERTIA_RTOL):
            raise InputError(
                f'{gear_set.name}: gear "{gear.name}": inertia_kg_m2 = '
                f"{inertia_of(gear):.6g}; at least {ceiled(least)} kg m2, that of the "
                "ring and of what carries it by rim_tangential_stiffness_N_per_mm3; "
                f"{otherwise}"
            )
