"""Isotropic elastic material in a plane state, or in teeth of their width."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.planes import Plane, SectionPlane, section_plane


@dataclass(frozen=True)
class PlaneMaterial:
    """Young's modulus [Pa], Poisson's ratio, and the plane hypothesis.

    width : of teeth whose plane is `width` [m], None for a plane state
    """

    young_modulus: float
    poisson_ratio: float
    plane: Plane = "stress"
    width: float | None = None

    @property
    def section(self) -> PlaneMaterial:
        """The material in the state of a section."""
        return replace(self, plane=section_plane(self.plane), width=None)

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
        nu = 0.0 if self.plane == "stress" else self.poisson_ratio
        return nu * stress[:, :2].sum(axis=1)

    @property
    def lame(self) -> tuple[float, float]:
        """(lambda, mu) of the plane constitutive law [Pa]."""
        E, nu = self.modulus, self.poisson
        return E * nu / (1.0 - nu**2), 0.5 * E / (1.0 + nu)


def pressure_in_plane(
    first: PlaneMaterial, second: PlaneMaterial, plane: SectionPlane
) -> float:
    """Contact pressure in a plane state over that in the plane of two materials.

    Under the same load: it goes with the root of E* = 1 / (1 / E'_1 + 1 / E'_2), and
    the width of the contact with its inverse (Johnson, 1985, eqs 4.43 and 4.45).
    """
    both = first, second
    softness = sum(1.0 / material.modulus for material in both)
    in_plane = sum(1.0 / replace(material, plane=plane).modulus for material in both)
    return math.sqrt(softness / in_plane)
