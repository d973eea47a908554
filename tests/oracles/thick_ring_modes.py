"""Free vibration of a thick ring held at its hub: the body of a gear without teeth.

Plane waves in polar coordinates by the potentials of Lame,

    u_r     = (phi' + n psi / r) cos(n theta)
    u_theta = -(n phi / r + psi') sin(n theta)

with phi and psi Bessel functions of order n of omega r / c_p and omega r / c_s. The
hub radius is held, the outer one free of stress; the 4 x 4 determinant of these
conditions vanishes at the natural frequencies.
Graff, Wave Motion in Elastic Solids (1975), sections 5.1 and A.2; in plane stress
c_p is that of a thin plate.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import jvp, yvp

from lumped.common.array_types import Array
from validation.oracles.ring import Annulus, shear_modulus


@dataclass(frozen=True, kw_only=True)
class ThickRing(Annulus):
    """Isotropic ring, held at the hub radius and free at the outer one."""

    young_modulus: float  # Pa
    poisson_ratio: float
    density: float  # kg/m3
    plane: Literal["stress", "strain"] = "stress"

    @property
    def shear_speed(self) -> float:
        """c_s = sqrt(G / rho) [m/s]."""
        shear = shear_modulus(self.young_modulus, self.poisson_ratio)
        return math.sqrt(shear / self.density)

    @property
    def speed_ratio(self) -> float:
        """(c_p / c_s)^2: 2 / (1 - nu) in plane stress, (2 - 2 nu) / (1 - 2 nu) in
        plane strain."""
        nu = self.poisson_ratio
        if self.plane == "stress":
            return 2.0 / (1.0 - nu)
        return 2.0 * (1.0 - nu) / (1.0 - 2.0 * nu)


def displacement_and_stress(
    ring: ThickRing, n: int, omega: float, radius: ArrayLike
) -> Array:
    """Amplitudes (4, 4, ...) of u_r, u_theta, sigma_rr / G, sigma_rtheta / G (rows)
    of the potentials phi = J, phi = Y, psi = J, psi = Y (columns).

    omega : [rad/s]
    radius : (...) [m]
    """
    r = np.asarray(radius, dtype=float)
    slow = omega / ring.shear_speed
    fast = slow / math.sqrt(ring.speed_ratio)
    phi = [_dilatation(n, fast, r, bessel) for bessel in (jvp, yvp)]
    psi = [_dilatation(n, slow, r, bessel) for bessel in (jvp, yvp)]
    columns = phi + [(-v, -u, -dv, -du) for u, v, du, dv in psi]
    lame = ring.speed_ratio - 2.0  # lambda / G
    rows = []
    for u, v, du, dv in columns:  # u_r, u_theta and their slopes
        dilatation = du + (u + n * v) / r
        rows.append([u, v, lame * dilatation + 2.0 * du, dv - (v + n * u) / r])
    return np.moveaxis(np.array(rows), 0, 1)


def _dilatation(n, wavenumber, r, bessel):
    """u_r, u_theta and their slopes of the potential phi alone.

    psi alone gives the negative of both, one for the other.
    """
    x = wavenumber * r
    value, slope, curve = (wavenumber**k * bessel(n, x, k) for k in range(3))
    return slope, -n * value / r, curve, -n * (slope / r - value / r**2)


def boundary_matrix(ring: ThickRing, n: int, omega: float) -> Array:
    """u = 0 at the hub, sigma = 0 at the rim, (4, 4), columns of unit length."""
    hub = displacement_and_stress(ring, n, omega, ring.hub_radius)[:2]
    rim = displacement_and_stress(ring, n, omega, ring.outer_radius)[2:]
    matrix = np.vstack([hub, rim * ring.outer_radius])
    return np.asarray(matrix / np.linalg.norm(matrix, axis=0))


def frequencies(ring: ThickRing, n: int, highest: float, samples: int = 500) -> Array:
    """Natural frequencies with n nodal diameters up to `highest`, all in Hz.

    samples : points between which the determinant's changes of sign are sought
    """
    return roots(
        lambda f: float(np.linalg.det(boundary_matrix(ring, n, 2.0 * math.pi * f))),
        highest,
        samples,
    )


def roots(
    function: Callable[[float], float], highest: float, samples: int = 500
) -> Array:
    """Between 0 and `highest`, where the function changes sign between samples."""
    grid = np.linspace(0.0, highest, samples + 1)[1:]
    values = np.array([function(f) for f in grid])
    changes = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    return np.array([brentq(function, grid[i], grid[i + 1]) for i in changes])
