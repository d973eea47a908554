"""Accelerations of a train whose contacts deflect each other, compiled.

At an instant the coordinates q, mean rotations, give every contact c the penetration

    x_c + sum_d Q_cd F_d(x_d) = R_c q - P_c b - gap_c,   b = load - K q,

and the coordinates, with w = sum_c P_c F_c, the accelerations

    a = b - K w - D q' - sum_c R_c F_c.

The hubs are at q + w + W (b - K w). See `lumped.coupled`.
"""

from __future__ import annotations

import math

from lumped.compiled import inlined
from lumped.kernels.contact import (
    CONVERGED,
    LOADS,
    X,
    find_near,
    solve_penetrations,
)


@inlined
def set_coupled_acceleration(system, steps, instant, q, v, a, s):
    """Accelerations (n,) and deflections of the meshes by their hubs (m,).

    instant : step of the common period, and 0, 1 or 2 for its start, middle or end
    """
    stiffness, free, turned = system.stiffness, steps.free, steps.turned
    number = 2 * instant[0] + instant[1]
    i, n = number % steps.gap.shape[0], q.size
    for j in range(n):
        free[j], turned[j] = system.load[j], 0.0
        for k in range(n):
            free[j] -= stiffness[j, k] * q[k]
        a[j] = -system.damping[j] * v[j]
    set_free_penetrations(system, steps, i, number // steps.gap.shape[0], q)
    set_loads(steps, i)
    for c in range(steps.load.size):
        load = steps.load[c]
        if load != 0.0:
            for j in range(n):
                a[j] -= steps.rows[i, c, j] * load
                turned[j] += steps.inertial[i, c, j] * load
    for j in range(n):
        for k in range(n):
            free[j] -= stiffness[j, k] * turned[k]
        a[j] += free[j]
    for m in range(s.size):
        s[m] = 0.0
        for j in range(n):
            hub = q[j] + turned[j]
            for k in range(n):
                hub += system.work[j, k] * free[k]
            s[m] += system.shapes[m, j] * hub


@inlined
def set_free_penetrations(system, steps, i, passed, q):
    """Of all contacts (c,) without forces; passed : whole rounds of half steps."""
    problem, errors = steps.problem, system.contacts.errors
    for m in range(steps.place.shape[1]):
        problem.place[m], problem.part[m] = steps.place[i, m], steps.part[i, m]
    for c in range(steps.load.size):
        x = -steps.gap[i, c]
        if errors.shape[1] > 0:
            m = problem.mesh_of[c]
            cycle = steps.turn[i, m] + passed * steps.periods[m]
            x -= errors[c, cycle % errors.shape[1]]
        for j in range(q.size):
            x += steps.rows[i, c, j] * q[j] - steps.inertial[i, c, j] * steps.free[j]
        problem.free[c] = x


@inlined
def set_loads(steps, i):
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
            problem.Q[p, s] = steps.compliance[i, problem.chosen[p], problem.chosen[s]]
    if near > 0 and solve_penetrations(problem, near) != CONVERGED:
        problem.newton[LOADS, 0] = math.nan
    for p in range(near):
        c = problem.chosen[p]
        load[c], steps.penetration[c] = problem.newton[LOADS, p], problem.newton[X, p]


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
