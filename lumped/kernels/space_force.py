"""Mesh forces of gears that move in space, compiled.

The samples are `lumped.kernels.arrays.SpaceSamples`. A mesh is a row of springs over
the face width, at places that vary with the position of its teeth. The deflection of a
spring at a place x is s + x t, with the deflection s of the mesh and the difference t
of slopes of both gears; its force has a moment x F against t.
"""

from __future__ import annotations

import math

from lumped.common.compiled import inlined
from lumped.kernels.mesh_force import pair_force


@inlined
def row_product(row, q):
    """Scalar product of a row (n,) and coordinates (n,)."""
    total = 0.0
    for i in range(q.size):
        total += row[i] * q[i]
    return total


@inlined
def load(springs, s, t, first, last, backlash):
    """Force [N] and moment [N m] of the springs first to last of one mesh.

    springs : stiffness, gap and place (p,) of all
    """
    stiffness, gap, place = springs
    force, moment = 0.0, 0.0
    for p in range(first, last):
        elastic = s + place[p] * t - gap[p]
        one = pair_force(stiffness[p], elastic, backlash)
        force += one
        moment += place[p] * one
    return force, moment


@inlined
def set_space_acceleration(system, samples, instant, q, v, a, s):
    """Modal accelerations (n,) and mesh deflections (m,) at one instant.

    instant : step, and 0, 1 or 2 for its start, middle or end
    """
    k, stage = instant
    springs = (
        samples.stiffness[k, stage],
        samples.gap[k, stage],
        samples.place[k, stage],
    )
    for i in range(q.size):
        a[i] = system.load[i] - system.damping[i] * v[i] - system.rigidity[i] * q[i]
        a[i] -= row_product(samples.velocity_forces[i], v)
        if samples.cross_stiffness.shape[0] > 0:
            a[i] -= row_product(samples.cross_stiffness[i], q)
    for m in range(system.shapes.shape[0]):
        s[m] = row_product(system.shapes[m], q)
        t = row_product(samples.tilts[m], q)
        first, last = system.first_pair[m], system.first_pair[m + 1]
        force, moment = load(springs, s[m], t, first, last, system.backlash[m])
        # the means are in the rigidity
        force -= system.mean_stiffness[m] * s[m]
        moment -= samples.tilt_stiffness[m] * t
        for i in range(q.size):
            a[i] -= system.shapes[m, i] * force + samples.tilts[m, i] * moment


@inlined
def record_space(system, samples, k, q, v, out):
    """The meshes (6, m) at the start of step k, see `mesh_force.record`.

    Behind them moment about the middle of the mesh [N m] and slope (m,).
    """
    before = k - 1 if k > 0 else samples.h.size - 1
    stiffness, gap, place = samples.stiffness[k, 0], samples.gap[k, 0], samples.place
    earlier = samples.stiffness[before, 2], samples.gap[before, 2], place[before, 2]
    for m in range(system.shapes.shape[0]):
        s, t = row_product(system.shapes[m], q), row_product(samples.tilts[m], q)
        first, last = system.first_pair[m], system.first_pair[m + 1]
        backlash = system.backlash[m]
        springs = stiffness, gap, place[k, 0]
        force, moment = load(springs, s, t, first, last, backlash)
        out[0, m] = s
        out[1, m] = row_product(system.shapes[m], v)
        out[2, m] = force
        out[3, m] = -math.inf
        out[4, m] = -math.inf
        for p in range(first, last):
            if stiffness[p] > 0.0:
                overlap = s + place[k, 0, p] * t - gap[p]
                out[3, m] = max(out[3, m], overlap)
                out[4, m] = max(out[4, m], -overlap - backlash)
        out[5, m], _ = load(earlier, s, t, first, last, backlash)
        out[6, m], out[7, m] = moment, t
