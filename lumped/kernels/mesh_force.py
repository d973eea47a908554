"""Mesh forces and the acceleration of the modal coordinates, compiled.

The system is a `lumped.kernels.arrays.ModalSystem`.
"""

from __future__ import annotations

import math

from lumped.common.compiled import inlined


@inlined
def pair_force(stiffness, elastic, backlash):
    """Force [N] of a pair at deflection minus gap: drive side, lost or back side."""
    if elastic > 0.0:
        return stiffness * elastic
    if elastic < -backlash:
        return stiffness * (elastic + backlash)
    return 0.0 * (stiffness * elastic)  # 0, but NaN stays NaN


@inlined
def pair_slope(stiffness, elastic, backlash):
    """Tangent stiffness [N/m] of a pair at deflection minus gap."""
    return stiffness if elastic > 0.0 or elastic < -backlash else 0.0


@inlined
def mesh_force(deflection, stiffness, gap, first, last, backlash):
    """Force [N] of the pairs first to last of one mesh, positive in compression."""
    force = 0.0
    for p in range(first, last):
        force += pair_force(stiffness[p], deflection - gap[p], backlash)
    return force


@inlined
def set_spring_acceleration(system, samples, instant, q, v, a, s):
    """Modal accelerations (n,) and mesh deflections (m,) at one instant.

    samples : Samples; instant : step, and 0, 1 or 2 for its start, middle or end
    """
    k, stage = instant
    stiffness, gap = samples.stiffness[k, stage], samples.gap[k, stage]
    shapes, first_pair = system.shapes, system.first_pair
    for i in range(q.size):
        a[i] = system.load[i] - system.damping[i] * v[i] - system.rigidity[i] * q[i]
    for m in range(shapes.shape[0]):
        s[m] = 0.0
        for i in range(q.size):
            s[m] += shapes[m, i] * q[i]
        first, last = first_pair[m], first_pair[m + 1]
        force = mesh_force(s[m], stiffness, gap, first, last, system.backlash[m])
        excess = force - system.mean_stiffness[m] * s[m]  # the mean is in the rigidity
        for i in range(q.size):
            a[i] -= shapes[m, i] * excess


@inlined
def record(system, stiffness, gap, q, v, out):
    """What is recorded of every mesh (6, m), the last row left to `record_before`.

    Deflection [m], its rate [m/s], force [N], overlap of the nearest drive flanks
    and of the nearest back flanks [m], negative where they are apart, and the force
    just before, which differs where a stiffness jumps.
    """
    shapes, backlash = system.shapes, system.backlash
    first_pair = system.first_pair
    for m in range(shapes.shape[0]):
        s, rate = 0.0, 0.0
        for i in range(q.size):
            s += shapes[m, i] * q[i]
            rate += shapes[m, i] * v[i]
        first, last = first_pair[m], first_pair[m + 1]
        out[0, m] = s
        out[1, m] = rate
        out[2, m] = mesh_force(s, stiffness, gap, first, last, backlash[m])
        out[3, m] = -math.inf
        out[4, m] = -math.inf
        for p in range(first, last):
            if stiffness[p] > 0.0:
                out[3, m] = max(out[3, m], s - gap[p])
                out[4, m] = max(out[4, m], gap[p] - s - backlash[m])


@inlined
def record_state(states, row, q, v):
    """Record displacements and velocities (n,) in a row of states (t, 2, n), if any."""
    if row < states.shape[0]:
        for i in range(q.size):
            states[row, 0, i] = q[i]
            states[row, 1, i] = v[i]


@inlined
def record_before(system, stiffness, gap, q, out):
    """The last row of a record: forces [N] with limits of the excitation from below."""
    shapes, backlash = system.shapes, system.backlash
    first_pair = system.first_pair
    for m in range(shapes.shape[0]):
        s = 0.0
        for i in range(q.size):
            s += shapes[m, i] * q[i]
        first, last = first_pair[m], first_pair[m + 1]
        out[5, m] = mesh_force(s, stiffness, gap, first, last, backlash[m])
