"""Area and polar moment of a gear's section, between its bore and its tooth outline.

They are computed from the true curves by Green's theorem: with n = 2 and 4 the integral
of r^(n - 2) over a region is that of r^n / n dtheta around it. Radial lines do not
contribute. The section of an internal gear is between its teeth and its outer radius.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from meshes.gear import SpurGear
from meshes.profile import angle_of, fillet_points

POINTS = 64  # points of Gauss quadrature, exact on the involute
FILLET_DEGREE = 60  # of the polynomials that the fillet's coordinates are taken for


@lru_cache(maxsize=256)
def section_area(gear: SpurGear) -> float:
    """Area of the section [m2]."""
    return _around(gear, 2)


@lru_cache(maxsize=256)
def section_polar_moment(gear: SpurGear) -> float:
    """Polar moment of the section about the centre [m4]."""
    return _around(gear, 4)


def _around(gear: SpurGear, n: int) -> float:
    """Integral over half a sector, from the tooth axis to the cut, times all halves."""
    half_pitch = 0.5 * gear.pitch_angle
    land = half_pitch - angle_of(gear, fillet_points(gear, 0.0))
    half = (
        gear.tip_radius**n * gear.half_angle(gear.tip_radius)
        + _along_flank(gear, n)
        + _along_fillet(gear, n)
        + gear.root_radius**n * land
        - gear.hub_radius**n * half_pitch
    )
    return 2.0 * gear.teeth * half / n


def _along_flank(gear: SpurGear, n: int) -> float:
    """Integral of r^n dtheta from tip to form circle, dtheta = s^2 / (rb r^2) ds."""
    low, high, rb = gear.form_roll_length, gear.tip_roll_length, gear.base_radius
    x, weight = np.polynomial.legendre.leggauss(POINTS)
    s = 0.5 * (low + high) + 0.5 * (high - low) * x
    values = (rb**2 + s**2) ** (n // 2 - 1) * s**2 / rb
    return 0.5 * (high - low) * float(weight @ values)


def _along_fillet(gear: SpurGear, n: int) -> float:
    """Integral of r^n dtheta from form to root circle, r^2 dtheta = y dx - x dy."""
    from numpy.polynomial import Chebyshev

    def coordinate(i: int) -> Chebyshev:
        return Chebyshev.interpolate(
            lambda beta: fillet_points(gear, beta)[..., i], FILLET_DEGREE, (0, end)
        )

    end = gear.form_normal_angle
    x, y = coordinate(0), coordinate(1)
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    beta = 0.5 * end * (1.0 + node)
    squared = x(beta) ** 2 + y(beta) ** 2
    swept = y(beta) * x.deriv()(beta) - x(beta) * y.deriv()(beta)
    return -0.5 * end * float(weight @ (squared ** (n // 2 - 1) * swept))
