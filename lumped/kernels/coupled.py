"""Accelerations of a train whose contacts deflect each other, compiled.

At an instant the coordinates q, mean rotations, give every contact c the penetration

    x_c + sum_d Q_cd F_d(x_d) = R_c q - P_c b - gap_c,   b = load - K q,

and the coordinates, with w = sum_c P_c F_c, the accelerations

    a = b - K w - D q' - sum_c R_c F_c.

The hubs are at q + w + W (b - K w). See `lumped.coupled`.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.compiled import compiled, inlined
from lumped.kernels.arrays import CoupledSteps
from lumped.kernels.contact import (
    CONVERGED,
    LOADS,
    X,
    between,
    contact_problem,
    find_near,
    set_position,
    set_row,
    solve_penetrations,
    start_position,
)


@compiled
def coupled_steps(system, h, cycle):
    """Steps h (s,) [s] of a common period, `cycle` of them in a first mesh's."""
    count, n = system.rows.shape[0], system.rows.shape[2]
    where = start_position(system.contacts)
    problem = contact_problem(system.contacts, system.mesh_of, where)
    return CoupledSteps(
        *(h, 2 * cycle, where, problem),
        *(np.empty((count, n)), np.empty((count, n)), np.empty(count), np.zeros(count)),
        *(np.empty(n), np.empty(n), np.empty(n)),
    )


@inlined
def set_coupled_acceleration(system, steps, instant, q, v, a, s):
    """Accelerations (n,) and deflections of the meshes by their hubs (m,).

    instant : step of the common period, and 0, 1 or 2 for its start, middle or end
    """
    stiffness, free, turned = system.stiffness, steps.free, steps.turned
    number = 2 * instant[0] + instant[1]
    set_position(system.rate, system.contacts, steps.cycle, number, steps.where)
    n = q.size
    for i in range(n):
        free[i], turned[i] = system.load[i], 0.0
        for j in range(n):
            free[i] -= stiffness[i, j] * q[j]
        a[i] = -system.damping[i] * v[i]
    set_free_penetrations(system, steps, q)
    set_loads(system, steps)
    for c in range(steps.load.size):
        for i in range(n):
            a[i] -= steps.row[c, i] * steps.load[c]
            turned[i] += steps.inertial[c, i] * steps.load[c]
    for i in range(n):
        for j in range(n):
            free[i] -= stiffness[i, j] * turned[j]
        a[i] += free[i]
    for m in range(s.size):
        s[m] = 0.0
        for i in range(n):
            hub = q[i] + turned[i]
            for j in range(n):
                hub += system.work[i, j] * free[j]
            s[m] += system.shapes[m, i] * hub


@inlined
def set_free_penetrations(system, steps, q):
    """Of all contacts (c,) without their forces, and the rows of this instant."""
    problem, where = steps.problem, steps.where
    mesh_of, row, inertial = problem.mesh_of, steps.row, steps.inertial
    for c in range(mesh_of.size):
        place, part = where.place[mesh_of[c]], where.part[mesh_of[c]]
        set_row(system.rows, q.size, c, place, part, row[c])
        set_row(system.inertial, q.size, c, place, part, inertial[c])
        x = -between(where.gap, c, place, part)
        for i in range(q.size):
            x += row[c, i] * q[i] - inertial[c, i] * steps.free[i]
        problem.free[c] = x


@inlined
def set_loads(system, steps):
    """Penetrations [m] and loads [N] of all contacts (c,).

    NaN where they were not found, so that the motion ends as one that diverged.
    """
    problem, load = steps.problem, steps.load
    for c in range(load.size):
        problem.start[c] = steps.penetration[c] if load[c] > 0.0 else problem.free[c]
        load[c], steps.penetration[c] = 0.0, problem.free[c]
    near = find_near(problem)
    for p in range(near):
        for s in range(near):
            problem.Q[p, s] = compliance_between(
                system.contacts, steps, problem.chosen[p], problem.chosen[s]
            )
    if near > 0 and solve_penetrations(problem, near) != CONVERGED:
        problem.newton[LOADS, 0] = math.nan
    for p in range(near):
        c = problem.chosen[p]
        load[c], steps.penetration[c] = problem.newton[LOADS, p], problem.newton[X, p]


@inlined
def compliance_between(contacts, steps, c, d):
    """Penetration of contact c per load on contact d, of meshes in step [m/N]."""
    m, values = steps.problem.mesh_of[c], contacts.normal_compliance
    place, part = steps.where.place[m], steps.where.part[m]
    value = values[place, c, d]
    if part > 0.0:
        value += part * (values[place + 1, c, d] - value)
    return value


@inlined
def record_coupled(system, steps, k, q, v, out):
    """The meshes (6, m) at the start of step k, see `lumped.kernels.law.record`.

    The rate is that of the mean rotations. Forces pass through every instant smoothly.
    """
    first, side = system.contacts.first, system.contacts.side
    start = (k, 0)
    set_coupled_acceleration(system, steps, start, q, v, steps.acceleration, out[0])
    for m in range(first.size - 1):
        rate, force, drive, back = 0.0, 0.0, -math.inf, -math.inf
        for i in range(q.size):
            rate += system.shapes[m, i] * v[i]
        for c in range(first[m], first[m + 1]):
            force += side[c] * steps.load[c]
            if side[c] > 0.0:
                drive = max(drive, steps.penetration[c])
            else:
                back = max(back, steps.penetration[c])
        out[1, m], out[2, m], out[5, m] = rate, force, force
        out[3, m], out[4, m] = drive, back
