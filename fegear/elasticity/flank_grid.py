"""Interpolation between the points of a flank.

Point i of n lies at the arc length l_i = length sinh(beta t) / sinh(beta) from the tip
corner, t = (i + 1) / n; beta = 0 spaces points evenly. An undercut flank has corners at
both ends, toward which points are graded: l_i = length / 2 (1 + tanh(beta (t - 1/2)) /
tanh(beta / 2)), t = (i + 1) / (n + 1). Values are smooth in t, in which they are
interpolated by cubics over four points (Lagrange).
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled_part, not_allocating

STENCIL = 4  # points that an interpolated value is made of
MIN_ARC_RATIO = 1e-2  # of an arc over that of the first point


@compiled_part
def place_stencil(arc, length, grading, both_ends, count, weights):
    """First of the four points around an arc [m]; weights (4,) are overwritten.

    Arcs beyond the outermost points count as these.
    """
    ratio = min(max(arc / length, 0.0), 1.0)
    intervals = count + 1 if both_ends else count
    if grading > 0.0 and both_ends:
        # twice the inverse hyperbolic tangent of (2 ratio - 1) tanh(beta / 2)
        part = (2.0 * ratio - 1.0) * math.tanh(0.5 * grading)
        ratio = 0.5 + 0.5 * math.log((1.0 + part) / (1.0 - part)) / grading
    elif grading > 0.0:
        ratio = math.asinh(ratio * math.sinh(grading)) / grading
    grid_position = min(max(ratio * intervals - 1.0, 0.0), count - 1.0)
    first = min(max(int(grid_position) - 1, 0), count - STENCIL)
    u = grid_position - first
    weights[0] = -(u - 1.0) * (u - 2.0) * (u - 3.0) / 6.0
    weights[1] = u * (u - 2.0) * (u - 3.0) / 2.0
    weights[2] = -u * (u - 1.0) * (u - 3.0) / 2.0
    weights[3] = u * (u - 1.0) * (u - 2.0) / 6.0
    return first


@compiled_part
def beyond_first(arc, length, grading, both_ends, count):
    """How far an arc [m] is before the first point, over that of the second behind it.

    Both distances are logarithmic, ln(l_0 / arc) / ln(l_1 / l_0); 0 of arcs behind the
    first point. Nothing is told apart at a MIN_ARC_RATIO of its arc.
    """
    first = point_arc(0, length, grading, both_ends, count)
    if arc >= first:
        return 0.0
    second = point_arc(1, length, grading, both_ends, count)
    return math.log(first / max(arc, MIN_ARC_RATIO * first)) / math.log(second / first)


@compiled_part
def point_arc(i, length, grading, both_ends, count):
    """Arc length l_i of a point from the tip corner [m]."""
    t = (i + 1.0) / (count + 1.0 if both_ends else count)
    if grading == 0.0:
        return length * t
    if both_ends:
        part = math.tanh(grading * (t - 0.5)) / math.tanh(0.5 * grading)
        return 0.5 * length * (1.0 + part)
    return length * math.sinh(grading * t) / math.sinh(grading)


@not_allocating
def _place_stencils(arcs, length, grading, both_ends, count, first, weights):
    """Fill indices (n,) and weights (n, 4) of arcs (n,)."""
    for i in range(arcs.size):
        first[i] = place_stencil(arcs[i], length, grading, both_ends, count, weights[i])


def flank_stencils(arcs, length, grading, count, both_ends=False):
    """Indices and weights (..., 4) of flank points that interpolate at arcs (...).

    length : of the flank [m]; grading : beta; count : n
    both_ends : whether points are graded toward both ends, as on undercut flanks
    """
    positions = np.asarray(arcs, float)
    flat = np.ascontiguousarray(positions.ravel())
    first, weights = np.empty(flat.size, np.int64), np.empty((flat.size, STENCIL))
    _place_stencils(
        flat, float(length), float(grading), both_ends, count, first, weights
    )
    index = first.reshape(positions.shape)[..., None] + np.arange(STENCIL)
    return index, weights.reshape(*positions.shape, STENCIL)
