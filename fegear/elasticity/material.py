"""Isotropic elastic material in a plane state."""

from __future__ import annotations

from dataclasses import dataclass
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
