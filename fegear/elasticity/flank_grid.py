"""Interpolation between the points of a flank.

Point i of n lies at the arc length l_i = length sinh(beta t) / sinh(beta) from the tip
corner, t = (i + 1) / n; beta = 0 spaces points evenly. Values are smooth in t, in which
they are interpolated by cubics over four points (Lagrange).
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled, compiled_part

STENCIL = 4  # points that an interpolated value is made of


@compiled_part
def place_stencil(arc, length, grading, count, weights):
    """First of the four points around an arc [m]; weights (4,) are overwritten.

    Arcs beyond the ends count as the ends.
    """
    ratio = min(max(arc / length, 0.0), 1.0)
    if grading > 0.0:
        ratio = math.asinh(ratio * math.sinh(grading)) / grading
    grid_position = min(max(ratio * count - 1.0, 0.0), count - 1.0)
    first = min(max(int(grid_position) - 1, 0), count - STENCIL)
    u = grid_position - first
    weights[0] = -(u - 1.0) * (u - 2.0) * (u - 3.0) / 6.0
    weights[1] = u * (u - 2.0) * (u - 3.0) / 2.0
    weights[2] = -u * (u - 1.0) * (u - 3.0) / 2.0
    weights[3] = u * (u - 1.0) * (u - 2.0) / 6.0
    return first


@compiled
def _place_stencils(arcs, length, grading, count):
    first = np.empty(arcs.size, np.int64)
    weights = np.empty((arcs.size, STENCIL))
    for i in range(arcs.size):
        first[i] = place_stencil(arcs[i], length, grading, count, weights[i])
    return first, weights


def flank_stencils(arcs, length, grading, count):
    """Indices and weights (..., 4) of flank points that interpolate at arcs (...).

    length : of the flank [m]; grading : beta; count : n
    """
    positions = np.asarray(arcs, float)
    flat = np.ascontiguousarray(positions.ravel())
    first, weights = _place_stencils(flat, float(length), float(grading), count)
    index = first.reshape(positions.shape)[..., None] + np.arange(STENCIL)
    return index, weights.reshape(*positions.shape, STENCIL)
