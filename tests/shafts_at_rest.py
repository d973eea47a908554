"""Shafts at rest that tests share, and their shear coefficient once more."""

from __future__ import annotations

import math

from lumped.rotors.description import Bearing, Rotor, Section
from lumped.rotors.statics import ShaftLoad

YOUNG, SHEAR = 2.1e11, 8e10
POISSON = 0.5 * YOUNG / SHEAR - 1.0
LENGTH, DIAMETER, BORE = 0.8, 0.06, 0.024
SECOND = math.pi * (DIAMETER**4 - BORE**4) / 64.0
AREA = math.pi * (DIAMETER**2 - BORE**2) / 4.0
BENDING = YOUNG * SECOND


def bearing(position, kx, ky=None, **changes):
    stiffness = (kx, 0.0, 0.0, kx if ky is None else ky)
    return Bearing(position=position, stiffness=stiffness, **changes)


def shaft(bearings, sections=None):
    usual = (Section(length=LENGTH, diameter=DIAMETER, bore=BORE),)
    return Rotor(
        name="counter",
        sections=sections or usual,
        bearings=tuple(bearings),
        young_modulus=YOUNG,
        shear_modulus=SHEAR,
        density=7800.0,
    )


def cowper(m, nu=POISSON):
    """Shear coefficient of a tube whose bore is m times its diameter."""
    bracket = (1.0 + m**2) ** 2
    below = (7.0 + 6.0 * nu) * bracket + (20.0 + 12.0 * nu) * m**2
    return 6.0 * (1.0 + nu) * bracket / below


SLIDING = cowper(BORE / DIAMETER) * SHEAR * AREA  # N


def random_loads(rng, places):
    return [
        ShaftLoad(
            position=place,
            force=tuple(rng.uniform(-1e3, 1e3, 3)),
            moment=tuple(rng.uniform(-1e2, 1e2, 3)),
        )
        for place in places
    ]
