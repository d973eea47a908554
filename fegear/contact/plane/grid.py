"""Constants of an equally spaced contact patch: hat integrals, interpolation."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lumped.common.array_types import Array

SUPPORT = 5  # points per patch at which the smooth remainder is evaluated


class PatchTables(NamedTuple):
    """Tables for patches of equally many nodes, whose ends carry half hats.

    logarithm : (nodes, nodes) mean of ln|row - column| over the column's hat
    sign : (nodes, nodes) mean of sgn(row - column) over it
    lagrange : (nodes, SUPPORT) weights of values at the support points
    points : (SUPPORT,) Chebyshev points in [-1, 1]
    """

    logarithm: Array
    sign: Array
    lagrange: Array
    points: Array


@lru_cache(maxsize=16)
def contact_grid(nodes: int) -> PatchTables:
    """Hats of unit half-length, but half a hat at the first and the last node.

    A patch ends in contact only where a flank ends, at its tip or an undercut: beyond
    its ends there is no body to carry the other half.
    """
    steps = np.arange(nodes)[:, None] - np.arange(nodes)[None, :]
    logarithm = hat_logarithm(np.abs(steps).astype(float))
    logarithm[:, 0] = end_hat_logarithm(-steps[:, 0].astype(float))
    logarithm[:, -1] = end_hat_logarithm(steps[:, -1].astype(float))
    sign = np.sign(steps).astype(float)
    sign[0, 0], sign[-1, -1] = -1.0, 1.0
    angles = np.pi * (np.arange(SUPPORT) + 0.5) / SUPPORT
    points = np.cos(angles)[::-1].copy()
    x = np.linspace(-1.0, 1.0, nodes)
    lagrange = np.ones((nodes, SUPPORT))
    for a in range(SUPPORT):
        for b in set(range(SUPPORT)) - {a}:
            lagrange[:, a] *= (x - points[b]) / (points[a] - points[b])
    return PatchTables(logarithm, sign, lagrange, points)


def _x_log_x(x: Array) -> Array:
    return x * np.log(np.where(x == 0.0, 1.0, np.abs(x)))


def _second_antiderivative(x: Array) -> Array:
    """The second antiderivative of ln|x|."""
    return 0.5 * x * _x_log_x(x) - 0.75 * x * x


def hat_logarithm(steps: Array) -> Array:
    """Integral of ln|steps - t| over the hat 1 - |t| on [-1, 1]."""
    phi = _second_antiderivative
    return phi(steps + 1.0) - 2.0 * phi(steps) + phi(steps - 1.0)


def end_hat_logarithm(steps: Array) -> Array:
    """Twice the integral of ln|steps - t| over the half hat 1 + t on [-1, 0]."""
    phi = _second_antiderivative
    return 2.0 * (phi(steps + 1.0) - phi(steps) - (_x_log_x(steps) - steps))
