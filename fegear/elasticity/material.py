"""Isotropic elastic material in a plane state."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Plane = Literal["stress", "strain"]


@dataclass(frozen=True)
class PlaneMaterial:
    """Young's modulus [Pa], Poisson's ratio, and the plane hypothesis."""

    young_modulus: float
    poisson_ratio: float
    plane: Plane = "stress"

    @property
    def modulus(self) -> float:
        """E': E in plane stress, E / (1 - nu^2) in plane strain."""
        E, nu = self.young_modulus, self.poisson_ratio
        return E if self.plane == "stress" else E / (1.0 - nu**2)

    @property
    def poisson(self) -> float:
        """nu': nu in plane stress, nu / (1 - nu) in plane strain."""
        nu = self.poisson_ratio
        return nu if self.plane == "stress" else nu / (1.0 - nu)

    def out_of_plane(self, stress: NDArray[np.float64]) -> NDArray[np.float64]:
        """zz (n,) that belongs to xx, yy, xy (n, 3) [Pa]; zero in plane stress."""
        nu = self.poisson_ratio if self.plane == "strain" else 0.0
        return nu * stress[:, :2].sum(axis=1)

    @property
    def lame(self) -> tuple[float, float]:
        """(lambda, mu) of the plane constitutive law [Pa]."""
        E, nu = self.modulus, self.poisson
        return E * nu / (1.0 - nu**2), 0.5 * E / (1.0 + nu)


def pressure_in_plane(
    first: PlaneMaterial, second: PlaneMaterial, plane: Plane
) -> float:
    """Contact pressure in a plane state over that in the plane of two materials.

    Under the same load: it goes with the root of E* = 1 / (1 / E'_1 + 1 / E'_2), and
    the width of the contact with its inverse (Johnson, 1985, eqs 4.43 and 4.45).
    """
    both = first, second
    softness = sum(1.0 / material.modulus for material in both)
    in_plane = sum(1.0 / replace(material, plane=plane).modulus for material in both)
    return math.sqrt(softness / in_plane)
