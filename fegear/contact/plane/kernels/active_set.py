"""Contact as a linear complementarity problem with a torque balance.

Find nodal forces q >= 0 and the transmission error d with

    gap + C q - d closing >= 0,   q (gap + C q - d closing) = 0,   arm . q = torque,

where either the torque or the transmission error is given. C is unsymmetric with
friction.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled_part
from lumped.kernels.elimination import eliminate

MAX_JOINT_EXCHANGES = 40  # sweeps that exchange every violated node together
CONVERGED, NOT_CONVERGED, NOT_FINITE = 0, 1, 2
# which of the two is given; numba would compile everything once for each plain int
TORQUE, STE = np.int64(0), np.int64(1)
# Node of a patch as an unknown.
#   gap : without load at zero transmission error [m]
#   closing : contact approach per transmission error
#   arm : of the nodal force about the driver's centre, friction included [m]
#   force : q [N/m];  rate : its slope over the transmission error [Pa]
#   moment_rate : slope of the driver's moment over the gap, over minus its base radius
#       [Pa]; without friction that is `rate`
#   in_contact, was_in_contact : now and before an exchange
#   touching : in element i of an array, the index of the i-th node in contact
UNKNOWN = np.dtype(
    [
        ("gap", "f8"),
        ("closing", "f8"),
        ("arm", "f8"),
        ("force", "f8"),
        ("rate", "f8"),
        ("moment_rate", "f8"),
        ("touching", "i8"),
        ("in_contact", "?"),
        ("was_in_contact", "?"),
    ],
    align=True,
)


@compiled_part
def solve_active(C, nodes, kind, target, matrix):
    """(transmission error, slope d torque / d ste) with the active nodes in contact.

    nodes : (n,) records UNKNOWN; their forces and rates are overwritten
    kind, target : TORQUE or STE, and its value
    matrix : space for (n, n + 2) numbers
    """
    n = list_touching(nodes)
    for i in range(n):
        row = nodes[nodes[i].touching]
        matrix[i, n] = row.gap  # preload and closing on the right
        matrix[i, n + 1] = row.closing
        for j in range(n):
            matrix[i, j] = C[nodes[i].touching, nodes[j].touching]
    eliminate(matrix, n, n + 2)
    slope, preload = 0.0, 0.0
    for i in range(n):
        arm = nodes[nodes[i].touching].arm
        preload += arm * matrix[i, n]
        slope += arm * matrix[i, n + 1]
    d = target if kind == STE else (target + preload) / slope
    for i in range(n):
        node = nodes[nodes[i].touching]
        node.rate = matrix[i, n + 1]
        node.force = d * matrix[i, n + 1] - matrix[i, n]
    return d, slope


@compiled_part
def list_touching(nodes):
    """Number of nodes in contact; lists them and clears all forces and rates."""
    n = 0
    for i in range(nodes.size):
        nodes[i].force, nodes[i].rate = 0.0, 0.0
        if nodes[i].in_contact:
            nodes[n].touching = i
            n += 1
    return n


@compiled_part
def require_contact(nodes):
    """Put the node that closes first in contact where none is."""
    best = 0
    for i in range(nodes.size):
        if nodes[i].in_contact:
            return
        if nodes[i].gap / nodes[i].closing < nodes[best].gap / nodes[best].closing:
            best = i
    nodes[best].in_contact = True


@compiled_part
def exchange(C, nodes, d, one_only):
    """Move violated nodes in or out of contact; (whether any was, residual)."""
    changed, residual, max_force = False, 0.0, 0.0
    for i in range(nodes.size):
        nodes[i].was_in_contact = nodes[i].in_contact
        max_force = max(max_force, nodes[i].force)
    roundoff = 1e-13 * abs(d)
    for i in range(nodes.size):
        node = nodes[i]
        if node.was_in_contact:
            is_violated = node.force < 0.0
            if is_violated and max_force > 0.0:
                residual = max(residual, -node.force / max_force)
        else:
            opening = node.gap - d * node.closing
            for j in range(nodes.size):
                if nodes[j].was_in_contact:
                    opening += C[i, j] * nodes[j].force
            is_violated = opening < -roundoff
            residual = max(residual, -opening / abs(d))
        if is_violated and not (one_only and changed):
            node.in_contact = not node.was_in_contact
            changed = True
    return changed, residual


@compiled_part
def solve_contact(C, nodes, kind, target, matrix):
    """(ste, slope, residual, status, sweeps); nodes as in `solve_active`.

    kind, target : TORQUE or STE, and its value

    Primal-dual active set: all violated nodes are exchanged together. Should that
    cycle, the violated node of least index alone is exchanged (Murty 1974), which
    ends for the P-matrices that these are; the number of sweeps is bounded anyway.
    residual is the largest violation: of gaps relative to the transmission error, of
    pressures relative to the largest one.
    """
    max_sweeps = MAX_JOINT_EXCHANGES + 20 * nodes.size
    d, slope, residual = math.nan, math.nan, math.nan
    for sweep in range(max_sweeps):
        if kind == TORQUE:
            require_contact(nodes)
        d, slope = solve_active(C, nodes, kind, target, matrix)
        if not math.isfinite(d):
            return d, slope, math.nan, NOT_FINITE, sweep + 1
        changed, residual = exchange(C, nodes, d, sweep >= MAX_JOINT_EXCHANGES)
        if not changed:
            return d, slope, residual, CONVERGED, sweep + 1
    return d, slope, residual, NOT_CONVERGED, max_sweeps
