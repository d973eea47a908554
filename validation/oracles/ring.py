"""Thick elastic ring twisted against a held hub: the body of a gear under torque.

The displacement is purely tangential and depends on the radius only, so there is
no dilatation: the stress is pure shear and plane stress and plane strain have the
same solution, with the shear modulus alone.
Timoshenko & Goodier, Theory of Elasticity (1970), ch. 4, stress function C theta.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array

POSITIVE = ("shear_modulus", "young_modulus", "density", "face_width")


@dataclass(frozen=True, kw_only=True)
class Annulus:
    """Between a held hub and an outer circle."""

    hub_radius: float  # m
    outer_radius: float  # m

    def __post_init__(self) -> None:
        if not 0.0 < self.hub_radius < self.outer_radius:
            raise ValueError(
                "hub_radius must lie between 0 and outer_radius, "
                f"got {self.hub_radius} and {self.outer_radius}"
            )
        for name, value in vars(self).items():
            if name in POSITIVE and not value > 0.0:
                raise ValueError(f"{name} = {value}; must be positive")


@dataclass(frozen=True, kw_only=True)
class Ring(Annulus):
    """Ring held at the hub radius, uniform tangential traction at the outer radius."""

    shear_modulus: float  # Pa
    face_width: float  # m


def tangential_displacement(ring: Ring, torque: float, radius: ArrayLike) -> Array:
    """u_theta at each radius, counter-clockwise positive, shape of radius [m].

    u = T r / (4 pi G b) (1/ri^2 - 1/r^2), from tau = G r d(u/r)/dr and u(ri) = 0.
    """
    r, ri = np.asarray(radius, dtype=float), ring.hub_radius
    scale = torque / (4.0 * np.pi * ring.shear_modulus * ring.face_width)
    return np.asarray(scale * r * (1.0 / ri**2 - 1.0 / r**2))


def rotation(ring: Ring, torque: float) -> float:
    """Angle u/r of the outer radius, T / (4 pi G b) (1/ri^2 - 1/ro^2) [rad]."""
    ro = ring.outer_radius
    return float(tangential_displacement(ring, torque, ro)) / ro


def line_of_action_stiffness(ring: Ring, base_radius: float) -> float:
    """Force along the line of action per displacement along it [N/m].

    F = T / rb moves the point by rotation * rb, so k = T / (rotation rb^2).
    base_radius : rb [m]
    """
    if not base_radius > 0.0:
        raise ValueError(f"base_radius = {base_radius}; must be positive")
    return 1.0 / (rotation(ring, 1.0) * base_radius**2)


def shear_modulus(young_modulus: float, poisson_ratio: float) -> float:
    """G = E / (2 (1 + nu)) [Pa]."""
    return young_modulus / (2.0 * (1.0 + poisson_ratio))
