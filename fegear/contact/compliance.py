"""Compliance between nodes of contact patches: half-plane part and remainder."""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.compiled import compiled

STENCIL = 4


@compiled
def stencil(arc, length, grading, count, weights):
    """First index and cubic Lagrange weights of a flank table at an arc."""
    ratio = min(max(arc / length, 0.0), 1.0)
    if grading > 0.0:
        ratio = math.asinh(ratio * math.sinh(grading)) / grading
    place = min(max(ratio * count - 1.0, 0.0), count - 1.0)
    first = min(max(int(place) - 1, 0), count - STENCIL)
    u = place - first
    weights[0] = -(u - 1.0) * (u - 2.0) * (u - 3.0) / 6.0
    weights[1] = u * (u - 2.0) * (u - 3.0) / 2.0
    weights[2] = -u * (u - 1.0) * (u - 3.0) / 2.0
    weights[3] = u * (u - 1.0) * (u - 2.0) / 6.0
    return first


@compiled
def interpolate(table, row, row_weights, column, column_weights):
    total = 0.0
    for i in range(STENCIL):
        line = 0.0
        for j in range(STENCIL):
            line += column_weights[j] * table[row + i, column + j]
        total += row_weights[i] * line
    return total


@compiled
def _phi(x):
    """Second antiderivative of ln|x|."""
    return 0.0 if x == 0.0 else 0.5 * x * x * math.log(abs(x)) - 0.75 * x * x


@compiled
def hat_logarithm(steps):
    """Integral of ln|x - steps| over the unit hat function on [-1, 1]."""
    return _phi(steps + 1.0) - 2.0 * _phi(steps) + _phi(steps - 1.0)


@compiled
def end_hat_logarithm(steps):
    """Twice that integral over the half hat on [-1, 0]; steps = row - column."""
    slope = 0.0 if steps == 0.0 else steps * math.log(abs(steps)) - steps
    return 2.0 * (_phi(steps + 1.0) - _phi(steps) - slope)


@compiled
def logarithm_table(nodes):
    """Mean of ln|distance| in grid steps, rows seen from columns, (nodes, nodes).

    The last column is the half hat at the end of the grid.
    """
    table = np.empty((nodes, nodes))
    for i in range(nodes):
        for j in range(nodes - 1):
            table[i, j] = hat_logarithm(abs(i - j))
        table[i, nodes - 1] = end_hat_logarithm(float(i - nodes + 1))
    return table


@compiled
def sign_table(nodes):
    """Mean of sgn(row - column) over the same hats, (nodes, nodes)."""
    table = np.empty((nodes, nodes))
    for i in range(nodes):
        for j in range(nodes):
            table[i, j] = np.sign(i - j)
    table[nodes - 1, nodes - 1] = 1.0
    return table


@compiled
def lagrange_table(nodes, points):
    """Weights (nodes, points.size) from values at `points` in [-1, 1]."""
    table = np.ones((nodes, points.size))
    for i in range(nodes):
        x = -1.0 + 2.0 * i / (nodes - 1.0)
        for a in range(points.size):
            for b in range(points.size):
                if a != b:
                    table[i, a] *= (x - points[b]) / (points[a] - points[b])
    return table
