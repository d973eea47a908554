"""Shafts at rest that tests share, and their shear coefficient once more."""

from __future__ import annotations

import math

import numpy as np

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


def free_stiffness(rotor, nodes):
    """Stiffness (5 n, 5 n) of a shaft of one section without bearings, by elements.

    x, y, z, tilt x and tilt y of all nodes in order; displacement method.
    """
    (section,) = rotor.sections
    E, G = rotor.young_modulus, rotor.shear_modulus
    area = math.pi * (section.diameter**2 - section.bore**2) / 4.0
    bending = E * math.pi * (section.diameter**4 - section.bore**4) / 64.0
    sliding = cowper(section.bore / section.diameter, 0.5 * E / G - 1.0) * G * area
    stiffness = np.zeros((5 * len(nodes), 5 * len(nodes)))
    for number, node in enumerate(nodes[:-1]):
        L = nodes[number + 1] - node
        phi = 12.0 * bending / (sliding * L**2)
        near, far = (4.0 + phi) * L**2, (2.0 - phi) * L**2
        plane = np.array(
            [
                [12.0, 6.0 * L, -12.0, 6.0 * L],
                [6.0 * L, near, -6.0 * L, far],
                [-12.0, -6.0 * L, 12.0, -6.0 * L],
                [6.0 * L, far, -6.0 * L, near],
            ]
        )
        plane *= bending / ((1.0 + phi) * L**3)
        first = 5 * number
        in_x, in_y, along = (
            first + np.array(of_element)
            for of_element in ([0, 4, 5, 9], [1, 3, 6, 8], [2, 7])
        )
        stiffness[np.ix_(in_x, in_x)] += plane
        # a positive tilt about x moves the far end down
        signs = np.array([1.0, -1.0, 1.0, -1.0])
        stiffness[np.ix_(in_y, in_y)] += plane * np.outer(signs, signs)
        rod = E * area / L * np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness[np.ix_(along, along)] += rod
    return stiffness
