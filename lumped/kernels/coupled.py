"""Steps of a train whose contacts deflect each other, compiled.

Between its contacts the train is linear, and a step of that is exact. The contacts'
forces on the coordinates, g = load - B'F, pass through a step as the cubic through its
two ends and the two nodes before: exponential time differencing (S. M. Cox and P. C.
Matthews, J. Comput. Phys. 176 (2002) 430) with the nodes of the implicit rule of Adams
and Moulton. The new forces follow from one contact problem at the end of the step,

    x_c + sum_d (Q + B W B')_cd F_d(x_d) = B_c q_free - gap_c,

with what the new forces move in the step, W. See `lumped.coupled` for B, Q and q, and
`lumped.propagator` for the step.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.compiled import allocating, compiled, compiled_part, inlined
from lumped.kernels.arrays import CoupledMotion
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
from lumped.kernels.settling import (
    FINISHED,
    NOT_FINITE,
    begin_period,
    bounded,
    close_section,
    set_round_off,
    widen,
)

SLOTS = 4  # forces that a step knows
STARTS = 4  # rounds after which the forces before the start are known
RESCALED = 64  # steps after which small changes are brought back to length 1


@inlined
def dot(a, b, count):
    """Sum of products in four parts, which do not wait for each other."""
    one, two, three, four = 0.0, 0.0, 0.0, 0.0
    fours = count - count % 4
    for j in range(0, fours, 4):
        one += a[j] * b[j]
        two += a[j + 1] * b[j + 1]
        three += a[j + 2] * b[j + 2]
        four += a[j + 3] * b[j + 3]
    for j in range(fours, count):
        one += a[j] * b[j]
    return (one + two) + (three + four)


@inlined
def add_columns(columns, x, out):
    """out + columns^T x, columns (count, size) four at a time."""
    fours = x.size - x.size % 4
    for j in range(0, fours, 4):
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        one, two = columns[j], columns[j + 1]
        three, four = columns[j + 2], columns[j + 3]
        for i in range(out.size):
            out[i] += (one[i] * a + two[i] * b) + (three[i] * c + four[i] * d)
    for j in range(fours, x.size):
        for i in range(out.size):
            out[i] += columns[j, i] * x[j]


@compiled_part
def set_state(steps, motion, k, q, v):
    """Take up displacements and velocities (n,)."""
    rates, a = steps.propagator.rates, motion.state.shape[1] // 2
    w = rates.shape[2]
    for i in range(a):
        motion.state[k, i], motion.state[k, a + i] = q[i], v[i]
    for p in range(w):
        z, dz = complex(q[a + p], -q[a + w + p]), complex(v[a + p], -v[a + w + p])
        forward = complex(rates[0, 0, p], rates[0, 1, p])
        backward = complex(rates[1, 0, p], rates[1, 1, p])
        wave = (dz - backward * z) / (forward - backward)
        motion.waves[k, 0, 0, p], motion.waves[k, 0, 1, p] = wave.real, wave.imag
        wave = z - wave
        motion.waves[k, 1, 0, p], motion.waves[k, 1, 1, p] = wave.real, wave.imag
    set_displacement(motion, k)


@compiled_part
def get_state(steps, motion, k, q, v):
    """Displacements and velocities (n,)."""
    rates, a = steps.propagator.rates, motion.state.shape[1] // 2
    waves, w = motion.waves[k], rates.shape[2]
    for i in range(q.size):
        q[i] = motion.q[k, i]
    for i in range(a):
        v[i] = motion.state[k, a + i]
    for p in range(w):
        v[a + p], v[a + w + p] = 0.0, 0.0
        for s in range(2):
            real, imaginary = waves[s, 0, p], waves[s, 1, p]
            v[a + p] += rates[s, 0, p] * real - rates[s, 1, p] * imaginary
            v[a + w + p] -= rates[s, 0, p] * imaginary + rates[s, 1, p] * real


@inlined
def set_displacement(motion, k):
    a, w = motion.state.shape[1] // 2, motion.waves.shape[3]
    waves, q, state = motion.waves[k], motion.q[k], motion.state[k]
    for i in range(a):
        q[i] = state[i]
    for p in range(w):
        q[a + p] = waves[0, 0, p] + waves[1, 0, p]
        q[a + w + p] = -waves[0, 1, p] - waves[1, 1, p]


@inlined
def carry_linear(steps, motion, k):
    """The linear part through a step, under the forces that are known."""
    propagator, head = steps.propagator, motion.head[0]
    size, a = motion.state.shape[1], motion.state.shape[1] // 2
    known, state = motion.known[k], motion.state[k]
    for i in range(size):
        known[i] = state[i]
        state[i] = 0.0
    for back in range(1, SLOTS):
        force, begin = motion.force[k, (head + SLOTS - back) % SLOTS], (back + 1) * a
        for j in range(a):
            known[begin + j] = force[j]
    add_columns(propagator.carry, known, state)
    for s in range(2):
        carry_waves(propagator.waves[s], motion, k, s)


@inlined
def carry_waves(factors, motion, k, s):
    """Forward or backward waves through a step, under the forces that are known.

    factors (10, w) : real and imaginary parts for the waves, then for forces at the end
    of the step, at its start and before
    """
    a, w, head = motion.state.shape[1] // 2, motion.waves.shape[3], motion.head[0]
    waves = motion.waves[k, s]
    one = motion.force[k, (head + 3) % SLOTS]
    two = motion.force[k, (head + 2) % SLOTS]
    three = motion.force[k, (head + 1) % SLOTS]
    for p in range(w):
        x, y = waves[0, p], waves[1, p]
        i, j = a + p, a + w + p
        waves[0, p] = (
            (factors[0, p] * x - factors[1, p] * y)
            + (factors[4, p] * one[i] + factors[5, p] * one[j])
            + (factors[6, p] * two[i] + factors[7, p] * two[j])
            + (factors[8, p] * three[i] + factors[9, p] * three[j])
        )
        waves[1, p] = (
            (factors[0, p] * y + factors[1, p] * x)
            + (factors[5, p] * one[i] - factors[4, p] * one[j])
            + (factors[7, p] * two[i] - factors[6, p] * two[j])
            + (factors[9, p] * three[i] - factors[8, p] * three[j])
        )


@inlined
def push(steps, motion, k):
    """Add what the newest forces do in the step."""
    propagator, head = steps.propagator, motion.head[0]
    state, a, w = motion.state[k], motion.state.shape[1] // 2, motion.waves.shape[3]
    force = motion.force[k, head]
    add_columns(propagator.push, force[:a], state)
    for s in range(2):
        waves, factors = motion.waves[k, s], propagator.waves[s]
        for p in range(w):
            i, j = a + p, a + w + p
            waves[0, p] += factors[2, p] * force[i] + factors[3, p] * force[j]
            waves[1, p] += factors[3, p] * force[i] - factors[2, p] * force[j]
    set_displacement(motion, k)


@inlined
def push_constant(system, steps, motion):
    """Displacement by the constant loads as forces at the end of the step."""
    a, known = motion.state.shape[1] // 2, steps.propagator.push
    for j in range(a):
        for i in range(a):
            motion.q[0, i] += known[j, i] * system.load[j]


@inlined
def set_free_penetrations(system, steps, node, motion):
    """Of all contacts (c,) without new forces; node : step, and whole rounds before.

    Also the first guess of each penetration: where it goes on, nearly in proportion.
    """
    i, passed = node
    grid, problem = steps.grid, steps.problem
    q, n = motion.q[0], motion.q.shape[1]
    for m in range(grid.place.shape[1]):
        problem.place[m], problem.part[m] = grid.place[i, m], grid.part[i, m]
    for c in range(steps.load.size):
        x = -grid.gap[i, c]
        if system.contacts.errors.shape[1] > 0:
            m = problem.mesh_of[c]
            cycle = grid.turn[i, m] + passed * grid.periods[m]
            x -= system.contacts.errors[c, cycle % system.contacts.errors.shape[1]]
        if grid.facing[i, c]:
            x += dot(grid.rows[i, c], q, n)
        before, known = steps.penetration[c], problem.free[c]
        problem.start[c] = x
        if before > 0.0:
            problem.start[c] = before * x / known if known > 0.5 * before else before
        problem.free[c] = x


@inlined
def find_loads(system, steps, node, motion, moves):
    """Penetrations [m] and loads [N] of all contacts (c,), and the newest forces.

    moves : 1.0 where the new forces move the train within the step, else 0.0
    Loads are NaN where they were not found, so that the motion ends as diverged.
    """
    i, problem, load, grid = node[0], steps.problem, steps.load, steps.grid
    set_free_penetrations(system, steps, node, motion)
    for c in range(load.size):
        load[c], steps.penetration[c] = 0.0, problem.free[c]
    near = find_near(problem)
    for p in range(near):
        for s in range(near):
            c, d = problem.chosen[p], problem.chosen[s]
            problem.Q[p, s] = grid.compliance[i, c, d] + moves * steps.moving[i, c, d]
    if near > 0 and solve_penetrations(problem, near) != CONVERGED:
        problem.newton[LOADS, 0] = math.nan
    force = motion.force[0, motion.head[0]]
    for j in range(force.size):
        force[j] = system.load[j]
    for p in range(near):
        c, pressed = problem.chosen[p], problem.newton[LOADS, p]
        load[c], steps.penetration[c] = pressed, problem.newton[X, p]
        if pressed != 0.0:
            row = grid.rows[i, c]
            for j in range(force.size):
                force[j] -= row[j] * pressed
    return near


@inlined
def change_loads(steps, i, near, motion):
    """Forces of the changes, about the loads that were found.

    x + Q F' x = B q for every change: Q as `find_loads` left it.
    """
    problem, matrix, rows = steps.problem, motion.matrix, steps.grid.rows
    changes, n = motion.q.shape[0] - 1, motion.q.shape[1]
    for a in range(near):
        c = problem.chosen[a]
        _, problem.newton[SLOPES, a] = load_at(problem, c, steps.penetration[c])
    for a in range(near):
        for b in range(near):
            matrix[a, b] = problem.Q[a, b] * problem.newton[SLOPES, b]
        matrix[a, a] += 1.0
        row = rows[i, problem.chosen[a]]
        for k in range(changes):
            matrix[a, near + k] = dot(row, motion.q[k + 1], n)
    eliminate(matrix, near, near + changes)
    for k in range(changes):
        force = motion.force[k + 1, motion.head[0]]
        for j in range(n):
            force[j] = 0.0
        for a in range(near):
            load = problem.newton[SLOPES, a] * matrix[a, near + k]
            row = rows[i, problem.chosen[a]]
            for j in range(n):
                force[j] -= row[j] * load


@inlined
def advance(system, steps, node, motion):
    """A step to a node (step of the common period, whole rounds before it)."""
    motion.head[0] = (motion.head[0] + 1) % SLOTS
    for k in range(motion.q.shape[0]):
        carry_linear(steps, motion, k)
        set_displacement(motion, k)
    push_constant(system, steps, motion)
    near = find_loads(system, steps, node, motion, 1.0)
    if motion.q.shape[0] > 1:
        change_loads(steps, node[0], near, motion)
    for k in range(motion.q.shape[0]):
        push(steps, motion, k)


@inlined
def copy_variables(state, waves, to_state, to_waves):
    for k in range(state.shape[0]):
        for i in range(state.shape[1]):
            to_state[k, i] = state[k, i]
    for k in range(waves.shape[0]):
        for s in range(2):
            for p in range(waves.shape[3]):
                to_waves[k, s, 0, p] = waves[k, s, 0, p]
                to_waves[k, s, 1, p] = waves[k, s, 1, p]


@compiled_part
def start(system, steps, passed, motion):
    """Forces before the first step: those of the parabola through the next nodes."""
    force, number = motion.force, steps.grid.gap.shape[0]
    state, waves = motion.state, motion.waves
    copy_variables(state, waves, motion.begin_state, motion.begin_waves)
    for again in range(STARTS + 1):
        copy_variables(motion.begin_state, motion.begin_waves, state, waves)
        for k in range(state.shape[0]):
            set_displacement(motion, k)
        motion.head[0] = 0
        near = find_loads(system, steps, (0, passed), motion, 0.0)
        if motion.q.shape[0] > 1:
            change_loads(steps, 0, near, motion)
        if again == STARTS:
            break
        if again == 0:
            extrapolate(force, 0.0)
        for i in range(1, 3):
            advance(system, steps, (i % number, passed + i // number), motion)
        extrapolate(force, 1.0)


@inlined
def extrapolate(force, part):
    """Forces one and two steps before the start, from those at the next three nodes.

    part : 1.0 for the parabola through them, 0.0 for the first alone
    """
    for k in range(force.shape[0]):
        for j in range(force.shape[2]):
            g0, g1, g2 = force[k, 0, j], force[k, 1, j], force[k, 2, j]
            force[k, 3, j] = g0 + part * (2.0 * g0 - 3.0 * g1 + g2)
            force[k, 2, j] = g0 + part * (5.0 * g0 - 8.0 * g1 + 3.0 * g2)


@inlined
def record_row(system, steps, i, motion, v, out):
    """The meshes (6 + 2 k, m) at node i, see `lumped.kernels.law.record`.

    Forces pass through every instant smoothly. The rate is that of the coordinates.
    After those rows come loads and penetrations of each mesh's contacts, k at most.
    """
    first, side = system.contacts.first, system.contacts.side
    set_deflection(system, steps, i, motion, out[0])
    for m in range(first.size - 1):
        force, drive, back = 0.0, -math.inf, -math.inf
        for c in range(first[m], first[m + 1]):
            row = 6 + 2 * (c - first[m])
            out[row, m], out[row + 1, m] = steps.load[c], steps.penetration[c]
            force += side[c] * steps.load[c]
            if side[c] > 0.0:
                drive = max(drive, steps.penetration[c])
            else:
                back = max(back, steps.penetration[c])
        out[1, m] = dot(system.shapes[m], v, v.size)
        out[2, m], out[5, m] = force, force
        out[3, m], out[4, m] = drive, back


@inlined
def set_deflection(system, steps, i, motion, s):
    """Deflections (m,) of the meshes by their hubs at node i."""
    q, ahead = motion.q[0], steps.grid.ahead
    for m in range(s.size):
        s[m] = system.offset[m] + dot(system.shapes[m], q, q.size)
    for c in range(steps.load.size):
        load = steps.load[c]
        if load != 0.0:
            for m in range(s.size):
                s[m] += ahead[i, c, m] * load


@allocating
def new_motion(system, steps, count):
    """Room for a motion and its changes, `count` in all."""
    n, w, c = system.load.size, system.whirl.size, steps.load.size
    size = 2 * (n - 2 * w)
    return CoupledMotion(
        np.zeros((count, size)),
        np.zeros((count, 2, 2, w)),
        np.zeros((count, SLOTS, n)),
        np.zeros(1, np.int64),
        np.zeros((count, n)),
        np.zeros((count, 5 * (n - 2 * w))),
        np.zeros((count, size)),
        np.zeros((count, 2, 2, w)),
        np.zeros((c, c + count)),
    )


@compiled
def settle_motion(system, steps, limit, state, check, most):
    """As `lumped.kernels.rk4.settle_motion`."""
    q, v = state[0], state[1]
    motion, count = new_motion(system, steps, 1), steps.h.size
    whole, s = steps.grid.gap.shape[0], np.empty(system.offset.size)
    set_state(steps, motion, 0, q, v)
    if steps.goes_on[0]:
        recall(steps, motion)
    else:
        start(system, steps, 0, motion)
    for _ in range(most):
        begin_period(check)
        for k in range(count):
            set_deflection(system, steps, k % whole, motion, s)
            widen(check.limits, s)
            advance(system, steps, node_after(k, whole), motion)
            if not math.isfinite(s[0]):
                return NOT_FINITE, (k + 1) / count, False
        get_state(steps, motion, 0, q, v)
        if not bounded(q, v, limit):
            return NOT_FINITE, 1.0, False
        set_round_off(check, count)
        if close_section(check, q, v):
            return FINISHED, 0.0, True
    remember(steps, motion)
    return FINISHED, 0.0, False


@inlined
def remember(steps, motion):
    """Keep the forces of the last nodes, so that the motion goes on as it came."""
    for back in range(SLOTS):
        slot = (motion.head[0] + SLOTS - back) % SLOTS
        for j in range(steps.force.shape[1]):
            steps.force[back, j] = motion.force[0, slot, j]


@inlined
def recall(steps, motion):
    motion.head[0] = 0
    for back in range(SLOTS):
        for j in range(steps.force.shape[1]):
            motion.force[0, (SLOTS - back) % SLOTS, j] = steps.force[back, j]


@inlined
def node_after(k, whole):
    """Step of the grid, of so many, and whole rounds before it, after step k."""
    return (k + 1) % whole, (k + 1) // whole


@compiled
def record_motion(system, steps, periods, state, limit, out):
    """As `lumped.kernels.rk4.record_motion`."""
    q, v = state[0], state[1]
    motion, count = new_motion(system, steps, 1), steps.h.size
    whole = steps.grid.gap.shape[0]
    set_state(steps, motion, 0, q, v)
    start(system, steps, 0, motion)
    for row in range(periods * count):
        k = row % count
        get_state(steps, motion, 0, q, v)
        if not bounded(q, v, limit):
            return NOT_FINITE, row + 1
        record_row(system, steps, k % whole, motion, v, out[row])
        advance(system, steps, node_after(k, whole), motion)
    get_state(steps, motion, 0, q, v)
    if not bounded(q, v, limit):
        return NOT_FINITE, periods * count
    record_row(system, steps, 0, motion, v, out[-1])
    return FINISHED, periods * count


@compiled
def carry_motion(system, steps, limit, state, angular, sections, growth):
    """As `lumped.kernels.rk4.carry_motion`."""
    n = angular.size
    changes, count = state.shape[1] // n - 1, steps.h.size
    motion, whole = new_motion(system, steps, changes + 1), steps.grid.gap.shape[0]
    for k in range(changes + 1):
        own = slice(k * n, (k + 1) * n)
        set_state(steps, motion, k, state[0, own], state[1, own])
    start(system, steps, 0, motion)
    for period in range(growth.size):
        growth[period] = 0.0
        for k in range(count):
            if k == 0:
                get_all(steps, motion, state)
                record_row(system, steps, 0, motion, state[1, :n], sections[period])
            advance(system, steps, node_after(k, whole), motion)
            if (k % RESCALED == 0 or k == count - 1) and changes > 0:
                get_all(steps, motion, state)
                if not bounded(state[0, :n], state[1, :n], limit):
                    return NOT_FINITE, period
                growth[period] += shrink(motion, state, angular)
    get_all(steps, motion, state)
    return FINISHED, growth.size


@inlined
def get_all(steps, motion, state):
    n = motion.q.shape[1]
    for k in range(motion.q.shape[0]):
        own = slice(k * n, (k + 1) * n)
        get_state(steps, motion, k, state[0, own], state[1, own])


@inlined
def shrink(motion, state, angular):
    """Bring changes back to length 1 together; logarithm of their length before."""
    n, square = angular.size, 0.0
    for i in range(n, state.shape[1]):
        square += state[0, i] ** 2 + (state[1, i] / angular[i % n]) ** 2
    length = math.sqrt(square)
    for k in range(1, motion.q.shape[0]):
        for part in (motion.state[k], motion.q[k]):
            for i in range(part.size):
                part[i] /= length
        for s in range(2):
            for p in range(motion.waves.shape[3]):
                motion.waves[k, s, 0, p] /= length
                motion.waves[k, s, 1, p] /= length
        for slot in range(SLOTS):
            for i in range(n):
                motion.force[k, slot, i] /= length
    return math.log(length)


@compiled
def set_moving(rows, facing, push, waves, moving):
    """Penetration per load (s, c, c) by what moves in a step, B W B', of contacts that
    face each other (s, c).

    push (a, a) displacement per force at the end of the step; waves (2, w) the same of
    travelling modes, both senses together, real and imaginary
    """
    steps, count, n = rows.shape
    a = push.shape[0]
    moved = np.empty(n)
    for k in range(steps):
        for d in range(count):
            if not facing[k, d]:
                continue
            row = rows[k, d]
            for j in range(a):
                moved[j] = 0.0
            for j in range(a):
                for i in range(a):
                    moved[i] += push[j, i] * row[j]
            w = waves.shape[1]
            for p in range(w):
                one, two = row[a + p], row[a + w + p]
                # of Z = E1 - i E2 under the force one - i two
                moved[a + p] = waves[0, p] * one + waves[1, p] * two
                moved[a + w + p] = waves[0, p] * two - waves[1, p] * one
            for c in range(count):
                if facing[k, c]:
                    moving[k, c, d] = dot(rows[k, c], moved, n)
