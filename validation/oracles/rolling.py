"""Pitch curve that rolls on an eccentric circle: the source's equations, by shooting.

Radius 1, eccentricity e; in the frame of the driver's bearing with the driven one at
(c, 0). W. G. Eschmann, ICTP 1987, part I (i) and (ii): first-order equations in
Cartesian coordinates, y(0) = y(pi) = 0. Of their sign the upper branch is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lumped.common.array_types import Array

BRACKET = 0.9, 1.1  # of Burmester's distance, between which the exact one is


def rates(s: float, position: Array, c: float, e: float) -> Array:
    """Rates of (x, y) along the arc: the distance from (c, 0) falls as rho grows, and
    the rest of unit speed goes round it.
    """
    rho = math.sqrt(1.0 + e * e - 2.0 * e * math.cos(s))
    slope = e * math.sin(s) / rho
    radial = (position - [c, 0.0]) / math.hypot(position[0] - c, position[1])
    tangential = np.array([radial[1], -radial[0]])
    return -slope * radial + math.sqrt(1.0 - slope**2) * tangential


def closing_residual_rk4(e: float, steps: int) -> Callable[[float], float]:
    """Function of c: y at half a turn, by the classical Runge-Kutta method."""
    h = math.pi / steps

    def end(c: float) -> float:
        position = np.array([1.0 - e, 0.0])
        for i in range(steps):
            s = i * h
            k1 = rates(s, position, c, e)
            k2 = rates(s + 0.5 * h, position + 0.5 * h * k1, c, e)
            k3 = rates(s + 0.5 * h, position + 0.5 * h * k2, c, e)
            k4 = rates(s + h, position + h * k3, c, e)
            position = position + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return float(position[1])

    return end


def closing_residual_dop853(e: float, tolerance: float) -> Callable[[float], float]:
    """Function of c: y at half a turn, by a method of order eight, adaptive."""
    from scipy.integrate import solve_ivp

    def end(c: float) -> float:
        solution = solve_ivp(
            lambda s, position: rates(s, position, c, e),
            (0.0, math.pi),
            np.array([1.0 - e, 0.0]),
            method="DOP853",
            rtol=tolerance,
            atol=tolerance,
        )
        return float(solution.y[1, -1])

    return end


def shoot(closing_residual: Callable[[float], float], e: float) -> float:
    """The centre distance at which the curve closes."""
    from scipy.optimize import brentq

    low, high = (factor * 2.0 * (1.0 + 0.25 * e * e) for factor in BRACKET)
    return float(brentq(closing_residual, low, high, xtol=1e-15))
