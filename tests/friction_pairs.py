"""The gear pair of chapter 5, its bearings found from its natural frequencies.

Printed are 1.55, 2.09 and 5.70 of the modes with rotation, 1.85 and 2.34 of the gears
across the line of action. With bearings that are equally stiff both ways, the inertia,
both masses and both bearings follow: in units of the mean mesh stiffness, eigenvalues
of diag(0, d_1, d_2) + v v' with v = (sqrt a, sqrt b, -sqrt c) are the squares of the
first three, d the squares of the others.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.bodies import Gear
from lumped.train.friction import with_bending
from lumped.train.system import LumpedSystem
from lumped.train.train import Mesh, Train

COUPLED, ACROSS = (1.55, 2.09, 5.70), (1.85, 2.34)
RADII = 0.04535, 0.06564


def update(eigenvalues, diagonal):
    """Squares of v in diag + v v', from its eigenvalues."""
    return [
        np.prod([v - d for v in eigenvalues])
        / np.prod([other - d for other in diagonal if other != d])
        for d in diagonal
    ]


def pair_system(variation, damping_ratio=0.0, friction=None, contact_ratio=1.5):
    """A unit of mass for u, natural frequencies as printed in Hz.

    friction : ToothFriction
    """
    load_share, gamma = 0.6, 0.28
    turn = (2.0 * math.pi) ** 2
    squares = [f**2 for f in COUPLED]
    a, b, c = update(squares, [0.0, *(f**2 for f in ACROSS)])
    stiffness = a * turn
    masses = stiffness / (b * turn), stiffness / (c * turn)
    part = masses[0] / (masses[0] + masses[1])
    rims = 1.0 / (1.0 - part), 1.0 / part  # inertias over squared radii
    gears = tuple(
        Gear(
            name=name,
            teeth=teeth,
            base_radius=radius,
            inertia=rim * radius**2,
            mass=mass,
            bearing_stiffness=(mass * turn * f**2,) * 2,
            torque=radius,
        )
        for name, teeth, radius, rim, mass, f in zip(
            ("pinion", "wheel"), (38, 55), RADII, rims, masses, ACROSS, strict=True
        )
    )
    mesh = Mesh(driver=0, driven=1, pressure_angle=math.radians(20.0))
    train = Train(gears=gears, meshes=(mesh,), damping_ratio=damping_ratio)
    figures = StiffnessParameters(
        mean=stiffness,
        variation=variation,
        contact_ratio=contact_ratio,
        approach=1.0 - gamma,
        load_share=load_share,
    )
    excitation = analytic_excitation(figures)
    if friction is None:
        return LumpedSystem(train, (excitation,))
    bent = with_bending(excitation, friction)
    return LumpedSystem(train, (bent,), friction=(friction,))
