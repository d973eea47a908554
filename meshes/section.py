"""Area and polar moment of a gear's section, from its bore to its tooth outline.

They are computed from the true curves by Green's theorem: with n = 2 and 4 the integral
of r^(n - 2) over a region is that of r^n / n dtheta around it. Radial lines do not
contribute.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from meshes.gear import SpurGear
from meshes.profile import fillet_points

POINTS = 64  # points of Gauss quadrature, exact on the involute


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
    bottom = fillet_points(gear, 0.0)
    land = half_pitch - math.atan2(bottom[0], bottom[1])
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
    """Integral of r^n dtheta from form to root circle.

    In the frame of `meshes.profile.fillet_points` before it rotates with the gear, the
    point at normal angle beta is q = (-d tan beta, r - d) - rho (sin beta, cos beta).
    """
    d, rho, r = gear.rack_tip_center[1], gear.rack_tip_radius, gear.reference_radius
    end = gear.form_normal_angle
    x, weight = np.polynomial.legendre.leggauss(POINTS)
    beta = 0.5 * end * (1.0 + x)
    sin, cos = np.sin(beta), np.cos(beta)
    qx, qy = -d * sin / cos - rho * sin, r - d - rho * cos
    turned = d / (r * cos**2)  # rotation of that frame, clockwise, per beta
    squared = qx**2 + qy**2
    swept = qx * rho * sin + qy * (d / cos**2 + rho * cos)  # q x dq, counter-clockwise
    values = squared ** (n // 2 - 1) * (swept - turned * squared)
    return 0.5 * end * float(weight @ values)
