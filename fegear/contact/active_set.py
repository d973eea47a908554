"""Frictional contact as a linear complementarity problem with a torque balance.

Find pressures q >= 0 and the approach d with

    gap + C q - d h >= 0,   q (gap + C q - d h) = 0,   arms . q = torque.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.compiled import compiled

ALL_AT_ONCE = 40  # sweeps that exchange every violated node together
CONVERGED, NOT_CONVERGED, NOT_FINITE = 0, 1, 2


@compiled
def solve_active(C, gap, h, arms, torque, nodes):
    """(q on nodes, d, slope d torque / d d) with exactly `nodes` in contact."""
    n = nodes.size
    matrix = np.empty((n, n))
    right = np.empty((n, 2))
    for i in range(n):
        right[i, 0] = h[nodes[i]]
        right[i, 1] = gap[nodes[i]]
        for j in range(n):
            matrix[i, j] = C[nodes[i], nodes[j]]
    solution = np.linalg.solve(matrix, right)
    slope, preload = 0.0, 0.0
    for i in range(n):
        slope += arms[nodes[i]] * solution[i, 0]
        preload += arms[nodes[i]] * solution[i, 1]
    d = (torque + preload) / slope
    return d * solution[:, 0] - solution[:, 1], d, slope


@compiled
def least_gap_node(gap, h):
    best = 0
    for i in range(gap.size):
        if gap[i] / h[i] < gap[best] / h[best]:
            best = i
    return best


@compiled
def solve_contact(C, gap, h, arms, torque, active):
    """(q, d, slope, residual, status, sweeps); `active` is updated in place.

    Primal-dual active set: all violated nodes are exchanged together. Should that
    cycle, the violated node of least index alone is exchanged (Murty 1974), which
    ends for the P-matrices that these are; the number of sweeps is bounded anyway.
    residual is the largest violation over the approach, of gaps and, scaled by the
    largest pressure, of pressures.
    """
    n = gap.size
    q = np.zeros(n)
    d, slope, residual = math.nan, math.nan, math.nan
    for sweep in range(ALL_AT_ONCE + 20 * n):
        if not active.any():
            active[least_gap_node(gap, h)] = True
        nodes = np.flatnonzero(active)
        part, d, slope = solve_active(C, gap, h, arms, torque, nodes)
        if not math.isfinite(d):
            return q, d, slope, math.nan, NOT_FINITE, sweep + 1
        q[:] = 0.0
        q[nodes] = part
        changed, residual = exchange(C, gap, h, q, d, active, sweep >= ALL_AT_ONCE)
        if not changed:
            return q, d, slope, residual, CONVERGED, sweep + 1
    return q, d, slope, residual, NOT_CONVERGED, ALL_AT_ONCE + 20 * n


@compiled
def exchange(C, gap, h, q, d, active, one_only):
    """Move violated nodes in or out of contact; (whether any was, residual)."""
    changed, residual = False, 0.0
    top = q.max()
    nodes = np.flatnonzero(active)
    roundoff = 1e-13 * abs(d)
    for i in range(q.size):
        if active[i]:
            wrong = q[i] < 0.0
            if wrong:
                residual = max(residual, -q[i] / top)
        else:
            opening = gap[i] - d * h[i]
            for j in nodes:
                opening += C[i, j] * q[j]
            wrong = opening < -roundoff
            residual = max(residual, -opening / abs(d))
        if wrong and not (one_only and changed):
            active[i] = not active[i]
            changed = True
    return changed, residual
