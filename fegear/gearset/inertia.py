"""Mass and polar inertia of a gear as a plain ring, where none are given.

The ring reaches from the hub to the reference circle: what the teeth have above it
is about what their spaces lack below.
"""

from __future__ import annotations

import math

from fegear.gearset.model import Gear


def ring_mass(gear: Gear) -> float:
    """rho pi b (R^2 - r^2) [kg]."""
    outer, inner = gear.geometry.reference_radius, gear.geometry.hub_radius
    return gear.density * gear.face_width * math.pi * (outer**2 - inner**2)


def ring_inertia(gear: Gear) -> float:
    """m (R^2 + r^2) / 2 about the axis [kg m2]."""
    outer, inner = gear.geometry.reference_radius, gear.geometry.hub_radius
    return 0.5 * ring_mass(gear) * (outer**2 + inner**2)


def mass_of(gear: Gear) -> float:
    """The given mass, else the ring's [kg]."""
    return ring_mass(gear) if gear.mass is None else gear.mass


def inertia_of(gear: Gear) -> float:
    """The given polar inertia, else the ring's [kg m2]."""
    return ring_inertia(gear) if gear.inertia is None else gear.inertia
