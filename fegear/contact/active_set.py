"""Contact as a linear complementarity problem with a torque balance.

Find nodal forces q >= 0 and the transmission error d with

    gap + C q - d closing >= 0,   q (gap + C q - d closing) = 0,   arm . q = torque,

where either the torque or the transmission error is given. C is unsymmetric with
friction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.common.compiled import allocating, compiled_part
from lumped.kernels.elimination import eliminate

ALL_AT_ONCE = 40  # sweeps that exchange every violated node together
CONVERGED, NOT_CONVERGED, NOT_FINITE = 0, 1, 2
# which of the two is given; numba would compile everything once for each plain int
TORQUE, STE = np.int64(0), np.int64(1)


class NodeConditions(NamedTuple):
    """What the nodes of all patches obey, arrays (n,).

    gap : without load at zero transmission error [m]
    penetration_rate : contact approach per transmission error
    effective_arm : of the nodal force about the driver's centre, friction included [m]
    """

    gap: NDArray[np.float64]
    penetration_rate: NDArray[np.float64]
    effective_arm: NDArray[np.float64]


@allocating
def solve_active(C, nodes, kind, given, active, q):
    """(transmission error, slope d torque / d ste) with the active nodes in contact.

    nodes : NodeConditions; q is overwritten
    kind, given : TORQUE or STE, and its value
    """
    chosen = np.empty(q.size, np.int64)
    n = 0
    for i in range(q.size):
        q[i] = 0.0
        if active[i]:
            chosen[n] = i
            n += 1
    matrix = np.empty((n, n + 2))  # preload and closing on the right
    for i in range(n):
        matrix[i, n] = nodes.gap[chosen[i]]
        matrix[i, n + 1] = nodes.penetration_rate[chosen[i]]
        for j in range(n):
            matrix[i, j] = C[chosen[i], chosen[j]]
    eliminate(matrix, n, n + 2)
    slope, preload = 0.0, 0.0
    for i in range(n):
        preload += nodes.effective_arm[chosen[i]] * matrix[i, n]
        slope += nodes.effective_arm[chosen[i]] * matrix[i, n + 1]
    d = given if kind == STE else (given + preload) / slope
    for i in range(n):
        q[chosen[i]] = d * matrix[i, n + 1] - matrix[i, n]
    return d, slope


@compiled_part
def require_contact(nodes, active):
    """Put the node that closes first in contact where none is."""
    best = 0
    for i in range(active.size):
        if active[i]:
            return
        if (
            nodes.gap[i] / nodes.penetration_rate[i]
            < nodes.gap[best] / nodes.penetration_rate[best]
        ):
            best = i
    active[best] = True


@allocating
def exchange(C, nodes, q, d, active, one_only):
    """Move violated nodes in or out of contact; (whether any was, residual)."""
    n = q.size
    changed, residual, top = False, 0.0, 0.0
    was = np.empty(n, np.bool_)
    for i in range(n):
        was[i] = active[i]
        top = max(top, q[i])
    roundoff = 1e-13 * abs(d)
    for i in range(n):
        if was[i]:
            wrong = q[i] < 0.0
            if wrong and top > 0.0:
                residual = max(residual, -q[i] / top)
        else:
            opening = nodes.gap[i] - d * nodes.penetration_rate[i]
            for j in range(n):
                if was[j]:
                    opening += C[i, j] * q[j]
            wrong = opening < -roundoff
            residual = max(residual, -opening / abs(d))
        if wrong and not (one_only and changed):
            active[i] = not was[i]
            changed = True
    return changed, residual


@allocating
def solve_contact(C, nodes, kind, given, active, q):
    """(ste, slope, residual, status, sweeps); active and q are overwritten.

    kind, given : TORQUE or STE, and its value

    Primal-dual active set: all violated nodes are exchanged together. Should that
    cycle, the violated node of least index alone is exchanged (Murty 1974), which
    ends for the P-matrices that these are; the number of sweeps is bounded anyway.
    residual is the largest violation: of gaps relative to the transmission error, of
    pressures relative to the largest one.
    """
    most = ALL_AT_ONCE + 20 * q.size
    d, slope, residual = math.nan, math.nan, math.nan
    for sweep in range(most):
        if kind == TORQUE:
            require_contact(nodes, active)
        d, slope = solve_active(C, nodes, kind, given, active, q)
        if not math.isfinite(d):
            return d, slope, math.nan, NOT_FINITE, sweep + 1
        changed, residual = exchange(C, nodes, q, d, active, sweep >= ALL_AT_ONCE)
        if not changed:
            return d, slope, residual, CONVERGED, sweep + 1
    return d, slope, residual, NOT_CONVERGED, most
