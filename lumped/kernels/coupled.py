"""Accelerations of a train whose contacts deflect each other, compiled.

At an instant the coordinates q, mean rotations, give every contact c the penetration

    x_c + sum_d Q_cd F_d(x_d) = B_c q - gap_c,

and the loads F the accelerations

    a = load - K q - D q' - sum_c B_c F_c.

What the hubs deflect the meshes by follows from q and F. See `lumped.coupled`.
"""

from __future__ import annotations

import math

from lumped.compiled import inlined
from lumped.kernels.contact import (
    CONVERGED,
    LOADS,
    SLOPES,
    X,
    find_near,
    load_at,
    solve_penetrations,
)
from lumped.kernels.elimination import eliminate


@inlined
def set_coupled_acceleration(system, steps, instant, q, v, a, s):
    """Accelerations (n,) and deflections of the meshes by their hubs (m,).

    instant : step of the common period, and 0, 1 or 2 for its start, middle or end
    """
    stiffness, damping, shapes = system.stiffness, system.damping, system.shapes
    number = 2 * instant[0] + instant[1]
    i, n = number % steps.gap.shape[0], q.size
    set_free_penetrations(system, steps, i, number // steps.gap.shape[0], q)
    set_loads(steps, i)
    for j in range(n):
        a[j] = system.load[j]
        for k in range(n):
            a[j] -= stiffness[j, k] * q[k] + damping[j, k] * v[k]
    for m in range(s.size):
        s[m] = system.offset[m]
        for j in range(n):
            s[m] += shapes[m, j] * q[j]
    for c in range(steps.load.size):
        load = steps.load[c]
        if load != 0.0:
            for j in range(n):
                a[j] -= steps.rows[i, c, j] * load
            for m in range(s.size):
                s[m] += steps.ahead[i, c, m] * load


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
            x += steps.rows[i, c, j] * q[j]
        set_start(problem, c, steps.penetration[c], x)
        problem.free[c] = x


@inlined
def set_start(problem, c, before, free):
    """First guess of a penetration: where it goes on, nearly in proportion."""
    problem.start[c] = free
    if before > 0.0:
        known = problem.free[c]
        problem.start[c] = before * free / known if known > 0.5 * before else before


@inlined
def set_loads(steps, i):
    """Penetrations [m] and loads [N] of all contacts (c,).

    NaN where they were not found, so that the motion ends as one that diverged.
    """
    problem, load = steps.problem, steps.load
    for c in range(load.size):
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
def set_contact_stiffness(steps, i, matrix, stiffness):
    """Tangent stiffness (n, n) [1/s2] of the contacts whose loads `set_loads` found.

    x + Q F(x) = B q: (1 + Q F') dx/dq = B, K = B' F' dx/dq

    matrix : (c, c + n), a working array
    """
    problem, n = steps.problem, steps.rows.shape[2]
    near = find_near(problem)
    for a in range(near):
        c = problem.chosen[a]
        _, problem.newton[SLOPES, a] = load_at(problem, c, steps.penetration[c])
    for a in range(near):
        for b in range(near):
            matrix[a, b] = problem.Q[a, b] * problem.newton[SLOPES, b]
        matrix[a, a] += 1.0
        for j in range(n):
            matrix[a, near + j] = steps.rows[i, problem.chosen[a], j]
    eliminate(matrix, near, near + n)
    for j in range(n):
        for k in range(n):
            stiffness[j, k] = 0.0
            for a in range(near):
                row = steps.rows[i, problem.chosen[a], j]
                push = problem.newton[SLOPES, a] * matrix[a, near + k]
                stiffness[j, k] += row * push


@inlined
def record_coupled(system, steps, k, q, v, out):
    """The meshes (6 + 2 k, m) at the start of step k, see `lumped.kernels.law.record`.

    The rate is that of the mean rotations. Forces pass through every instant smoothly.
    After those rows come loads and penetrations of each mesh's contacts, k at most.
    """
    first, side = system.contacts.first, system.contacts.side
    start = (k, 0)
    set_coupled_acceleration(system, steps, start, q, v, steps.acceleration, out[0])
    for m in range(first.size - 1):
        rate, force, drive, back = 0.0, 0.0, -math.inf, -math.inf
        for i in range(q.size):
            rate += system.shapes[m, i] * v[i]
        for c in range(first[m], first[m + 1]):
            row = 6 + 2 * (c - first[m])
            out[row, m], out[row + 1, m] = steps.load[c], steps.penetration[c]
            force += side[c] * steps.load[c]
            if side[c] > 0.0:
                drive = max(drive, steps.penetration[c])
            else:
                back = max(back, steps.penetration[c])
        out[1, m], out[2, m], out[5, m] = rate, force, force
        out[3, m], out[4, m] = drive, back
