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

MAX_JOINT_EXCHANGES = 40  # sweeps that exchange every violated node together
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
def solve_active(C, nodes, kind, target, active, q, rate):
    """(transmission error, slope d torque / d ste) with the active nodes in contact.

    nodes : NodeConditions; q and rate, its slope d q / d ste, are overwritten
    kind, target : TORQUE or STE, and its value
    """
    active_nodes = np.empty(q.size, np.int64)
    n = 0
    for i in range(q.size):
        q[i], rate[i] = 0.0, 0.0
        if active[i]:
            active_nodes[n] = i
            n += 1
    matrix = np.empty((n, n + 2))  # preload and closing on the right
    for i in range(n):
        matrix[i, n] = nodes.gap[active_nodes[i]]
        matrix[i, n + 1] = nodes.penetration_rate[active_nodes[i]]
        for j in range(n):
            matrix[i, j] = C[active_nodes[i], active_nodes[j]]
    eliminate(matrix, n, n + 2)
    slope, preload = 0.0, 0.0
    for i in range(n):
        preload += nodes.effective_arm[active_nodes[i]] * matrix[i, n]
        slope += nodes.effective_arm[active_nodes[i]] * matrix[i, n + 1]
    d = target if kind == STE else (target + preload) / slope
    for i in range(n):
        rate[active_nodes[i]] = matrix[i, n + 1]
        q[active_nodes[i]] = d * matrix[i, n + 1] - matrix[i, n]
    return d, slope


@allocating
def moment_rates(C, arm, active, rates):
    """Fill rates (n,) with minus the slope of arm . q over each gap, C' rates = arm.

    It is zero for nodes out of contact.
    """
    active_nodes = np.flatnonzero(active)
    n = active_nodes.size
    matrix = np.empty((n, n + 1))
    for i in range(n):
        matrix[i, n] = arm[active_nodes[i]]
        for j in range(n):
            matrix[i, j] = C[active_nodes[j], active_nodes[i]]
    eliminate(matrix, n, n + 1)
    rates[:] = 0.0
    for i in range(n):
        rates[active_nodes[i]] = matrix[i, n]


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
    changed, residual, max_force = False, 0.0, 0.0
    was_active = np.empty(n, np.bool_)
    for i in range(n):
        was_active[i] = active[i]
        max_force = max(max_force, q[i])
    roundoff = 1e-13 * abs(d)
    for i in range(n):
        if was_active[i]:
            is_violated = q[i] < 0.0
            if is_violated and max_force > 0.0:
                residual = max(residual, -q[i] / max_force)
        else:
            opening = nodes.gap[i] - d * nodes.penetration_rate[i]
            for j in range(n):
                if was_active[j]:
                    opening += C[i, j] * q[j]
            is_violated = opening < -roundoff
            residual = max(residual, -opening / abs(d))
        if is_violated and not (one_only and changed):
            active[i] = not was_active[i]
            changed = True
    return changed, residual


@allocating
def solve_contact(C, nodes, kind, target, active, q, rate):
    """(ste, slope, residual, status, sweeps); active, q and rate are overwritten.

    kind, target : TORQUE or STE, and its value

    Primal-dual active set: all violated nodes are exchanged together. Should that
    cycle, the violated node of least index alone is exchanged (Murty 1974), which
    ends for the P-matrices that these are; the number of sweeps is bounded anyway.
    residual is the largest violation: of gaps relative to the transmission error, of
    pressures relative to the largest one.
    """
    max_sweeps = MAX_JOINT_EXCHANGES + 20 * q.size
    d, slope, residual = math.nan, math.nan, math.nan
    for sweep in range(max_sweeps):
        if kind == TORQUE:
            require_contact(nodes, active)
        d, slope = solve_active(C, nodes, kind, target, active, q, rate)
        if not math.isfinite(d):
            return d, slope, math.nan, NOT_FINITE, sweep + 1
        changed, residual = exchange(
            C, nodes, q, d, active, sweep >= MAX_JOINT_EXCHANGES
        )
        if not changed:
            return d, slope, residual, CONVERGED, sweep + 1
    return d, slope, residual, NOT_CONVERGED, max_sweeps
