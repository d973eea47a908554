"""Steps of a train whose contacts deflect each other, compiled.

Between its contacts the train is linear, and a step of that is exact. The contacts'
forces on the coordinates, g = load - B'F, pass through a step as the cubic through its
two ends and the two nodes before: exponential time differencing (S. M. Cox and P. C.
Matthews, J. Comput. Phys. 176 (2002) 430) with the nodes of the implicit rule of Adams
and Moulton. The new forces follow from one contact problem at the end of the step,

    x_c + sum_d (Q + B W B')_cd F_d(x_d) = B_c q_free - gap_c,

with what the new forces move in the step, W. See `lumped.train.coupled` for B, Q and
q, and `lumped.train.propagator` for the step.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import allocating, compiled, compiled_part, inlined
from lumped.kernels.arrays import CoupledMotion
from lumped.kernels.contact import (
    CONVERGED,
    LOADS,
    X,
    may_touch,
    solve_penetrations,
)
from lumped.kernels.convergence import (
    FINISHED,
    NOT_FINITE,
    begin_period,
    bounded,
    close_section,
    set_error_bound,
    widen,
)
from lumped.kernels.coupled_changes import (
    advance_changes,
    begin_changes,
    get_changes,
    new_changes,
    normalise_perturbations,
    set_changes,
)
from lumped.kernels.coupled_variables import (
    SLOTS,
    add_columns,
    dot,
    get_variables,
    set_variables,
)

STARTS = 4  # rounds after which the forces before the start are known
BETWEEN_LOOKS = 4  # steps between looks at the range of deflection while it settles
RESCALED = 64  # steps after which small changes are brought back to length 1


@compiled_part
def set_state(steps, motion, q, v):
    """Take up displacements and velocities (n,)."""
    set_variables(steps.propagator.rates, q, v, motion.state, motion.waves)
    set_displacement(motion)


@compiled_part
def get_state(steps, motion, q, v):
    """Displacements and velocities (n,)."""
    get_variables(steps.propagator.rates, motion.state, motion.waves, q, v)


@inlined
def set_displacement(motion):
    a, w = motion.state.size // 2, motion.waves.shape[2]
    waves, q, state = motion.waves, motion.q, motion.state
    for i in range(a):
        q[i] = state[i]
    for p in range(w):
        q[a + p] = waves[0, 0, p] + waves[1, 0, p]
        q[a + w + p] = -waves[0, 1, p] - waves[1, 1, p]


@inlined
def carry_linear(steps, motion):
    """The linear part through a step, under the forces that are known."""
    propagator, head = steps.propagator, motion.head[0]
    size, a = motion.state.size, motion.state.size // 2
    inputs, state = motion.inputs, motion.state
    for i in range(size):
        inputs[i] = state[i]
        state[i] = 0.0
    for back in range(1, SLOTS):
        force, begin = motion.force[(head + SLOTS - back) % SLOTS], (back + 1) * a
        for j in range(a):
            inputs[begin + j] = force[j]
    add_columns(propagator.carry, inputs, state)
    for s in range(2):
        carry_waves(propagator.waves[s], motion, s)


@inlined
def carry_waves(factors, motion, s):
    """Forward or backward waves through a step, under the forces that are known.

    factors (10, w) : real and imaginary parts for the waves, then for forces at the end
    of the step, at its start and before
    """
    a, w, head = motion.state.size // 2, motion.waves.shape[2], motion.head[0]
    waves = motion.waves[s]
    one = motion.force[(head + 3) % SLOTS]
    two = motion.force[(head + 2) % SLOTS]
    three = motion.force[(head + 1) % SLOTS]
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
def push(steps, motion):
    """Add what the newest forces do in the step."""
    propagator, force = steps.propagator, motion.force[motion.head[0]]
    state, a, w = motion.state, motion.state.size // 2, motion.waves.shape[2]
    add_columns(propagator.push, force[:a], state)
    for s in range(2):
        waves, factors = motion.waves[s], propagator.waves[s]
        for p in range(w):
            i, j = a + p, a + w + p
            waves[0, p] += factors[2, p] * force[i] + factors[3, p] * force[j]
            waves[1, p] += factors[3, p] * force[i] - factors[2, p] * force[j]
    set_displacement(motion)


@inlined
def push_constant(system, steps, motion):
    """Displacement by the constant loads as forces at the end of the step."""
    a, pushed = motion.state.size // 2, steps.propagator.push
    for j in range(a):
        for i in range(a):
            motion.q[i] += pushed[j, i] * system.load[j]


@inlined
def find_free_penetrations(system, steps, node, motion):
    """Penetrations of the contacts that face each other, without new forces, and the
    number of those that are so near to contact that they are `chosen`.

    node : step, and whole rounds before it
    Also the first guess of each penetration: where it goes on, nearly in proportion.
    """
    i, passed = node
    grid, problem = steps.grid, steps.problem
    q, n = motion.q, motion.q.size
    for m in range(grid.place.shape[1]):
        problem.place[m], problem.part[m] = grid.place[i, m], grid.part[i, m]
    near = 0
    for at in range(grid.faces.shape[1]):
        c = grid.faces[i, at]
        if c < 0:
            break
        x = -grid.gap[i, c]
        if system.contacts.errors.shape[1] > 0:
            m = problem.mesh_of[c]
            cycle = grid.turn[i, m] + passed * grid.periods[m]
            x -= system.contacts.errors[c, cycle % system.contacts.errors.shape[1]]
        x += dot(grid.rows[i, c], q, n)
        before, last_free = steps.penetration[c], problem.free[c]
        problem.start[c] = x
        if before > 0.0 and last_free > 0.5 * before:
            ratio, last = before / last_free, steps.ratio[c]
            steps.ratio[c] = ratio
            if last > 0.0:
                ratio = max(2.0 * ratio - last, 0.5 * ratio)
            problem.start[c] = ratio * x
        else:
            steps.ratio[c] = 0.0
            if before > 0.0:
                problem.start[c] = before
        problem.free[c], steps.penetration[c] = x, x
        if may_touch(problem, c, x):
            problem.chosen[near] = c
            near += 1
    return near


@inlined
def find_loads(system, steps, node, motion, compliance):
    """Penetrations [m] and loads [N] of all contacts (c,), and the newest forces.

    compliance (s, c, c) of the contacts under the new loads
    Loads are NaN where they were not found, so that the motion ends as diverged.
    """
    i, problem, load, grid = node[0], steps.problem, steps.load, steps.grid
    near = find_free_penetrations(system, steps, node, motion)
    for c in range(load.size):
        load[c] = 0.0
    for p in range(near):
        for s in range(near):
            c, d = problem.chosen[p], problem.chosen[s]
            problem.Q[p, s] = compliance[i, c, d]
    if near > 0 and solve_penetrations(problem, near) != CONVERGED:
        problem.newton[LOADS, 0] = math.nan
    force = motion.force[motion.head[0]]
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
def advance(system, steps, node, motion):
    """A step to a node (step of the common period, whole rounds before it); how many
    contacts may touch there."""
    motion.head[0] = (motion.head[0] + 1) % SLOTS
    carry_linear(steps, motion)
    set_displacement(motion)
    push_constant(system, steps, motion)
    near = find_loads(system, steps, node, motion, steps.compliance)
    push(steps, motion)
    return near


@compiled_part
def start(system, steps, passed, motion, changes):
    """Forces before the first step: those of the parabola through the next nodes."""
    state, waves, number = motion.state, motion.waves, steps.grid.gap.shape[0]
    moved, compliance = changes.q.shape[1] > 0, steps.grid.compliance
    copy_variables(state, waves, motion.begin_state, motion.begin_waves)
    for again in range(STARTS + 1):
        copy_variables(motion.begin_state, motion.begin_waves, state, waves)
        set_displacement(motion)
        motion.head[0] = 0
        near = find_loads(system, steps, (0, passed), motion, compliance)
        if moved:
            begin_changes(steps, near, motion, changes)
        if again == STARTS:
            break
        if again == 0:
            extrapolate(motion.force, 0.0)
            extrapolate_changes(changes.force, 0.0)
        for i in range(1, 3):
            near = advance(system, steps, (i % number, passed + i // number), motion)
            if moved:
                advance_changes(steps, i % number, near, motion, changes)
        extrapolate(motion.force, 1.0)
        extrapolate_changes(changes.force, 1.0)


@inlined
def copy_variables(state, waves, to_state, to_waves):
    for i in range(state.size):
        to_state[i] = state[i]
    for s in range(2):
        for p in range(waves.shape[2]):
            to_waves[s, 0, p] = waves[s, 0, p]
            to_waves[s, 1, p] = waves[s, 1, p]


@inlined
def extrapolate(force, part):
    """Forces one and two steps before the start, from those at the next three nodes.

    part : 1.0 for the parabola through them, 0.0 for the first alone
    """
    for j in range(force.shape[1]):
        g0, g1, g2 = force[0, j], force[1, j], force[2, j]
        force[3, j] = g0 + part * (2.0 * g0 - 3.0 * g1 + g2)
        force[2, j] = g0 + part * (5.0 * g0 - 8.0 * g1 + 3.0 * g2)


@inlined
def extrapolate_changes(force, part):
    for j in range(force.shape[1]):
        extrapolate(force[:, j], part)


@inlined
def record_row(system, steps, i, motion, v, out):
    """The meshes (6 + 2 k, m) at node i, see `lumped.kernels.mesh_force.record`.

    Forces pass through every instant smoothly. The rate is that of the coordinates.
    After those rows come loads and penetrations of each mesh's contacts, k at most.
    """
    first, side = system.contacts.first, system.contacts.side
    set_deflection(system, steps, i, motion, out[0])
    for m in range(first.size - 1):
        force, drive, back = 0.0, -math.inf, -math.inf
        for c in range(first[m], first[m + 1]):
            row, facing = 6 + 2 * (c - first[m]), steps.grid.facing[i, c]
            x = steps.penetration[c] if facing else -steps.grid.gap[i, c]
            out[row, m], out[row + 1, m] = steps.load[c], x
            force += side[c] * steps.load[c]
            if side[c] > 0.0:
                drive = max(drive, x)
            else:
                back = max(back, x)
        out[1, m] = dot(system.shapes[m], v, v.size)
        out[2, m], out[5, m] = force, force
        out[3, m], out[4, m] = drive, back


@inlined
def set_deflection(system, steps, i, motion, s):
    """Deflections (m,) of the meshes by their hubs at node i."""
    q, ahead = motion.q, steps.grid.ahead
    for m in range(s.size):
        s[m] = system.offset[m] + dot(system.shapes[m], q, q.size)
    for c in range(steps.load.size):
        load = steps.load[c]
        if load != 0.0:
            for m in range(s.size):
                s[m] += ahead[i, c, m] * load


@allocating
def new_motion(system):
    n, w = system.load.size, system.whirl.size
    size = 2 * (n - 2 * w)
    return CoupledMotion(
        np.zeros(size),
        np.zeros((2, 2, w)),
        np.zeros((SLOTS, n)),
        np.zeros(1, np.int64),
        np.zeros(n),
        np.zeros(5 * (n - 2 * w)),
        np.zeros(size),
        np.zeros((2, 2, w)),
    )


@compiled
def settle_motion(system, steps, limit, state, check, most):
    """Advance the motion as `lumped.kernels.rk4.settle_motion` does."""
    q, v = state[0], state[1]
    motion, changes = new_motion(system), new_changes(system, steps, 0)
    count = steps.h.size
    whole, s = steps.grid.gap.shape[0], np.empty(system.offset.size)
    set_state(steps, motion, q, v)
    if steps.continues[0]:
        recall(steps, motion)
    else:
        start(system, steps, 0, motion, changes)
    for _ in range(most):
        begin_period(check)
        for k in range(count):
            if k % BETWEEN_LOOKS == 0:
                set_deflection(system, steps, k % whole, motion, s)
                widen(check.limits, s)
            advance(system, steps, node_after(k, whole), motion)
            if not math.isfinite(s[0]):
                return NOT_FINITE, (k + 1) / count, False
        get_state(steps, motion, q, v)
        if not bounded(q, v, limit):
            return NOT_FINITE, 1.0, False
        set_error_bound(check, count)
        if close_section(check, q, v):
            return FINISHED, 0.0, True
    remember(steps, motion)
    return FINISHED, 0.0, False


@inlined
def remember(steps, motion):
    """Save nodal forces, from which the next call continues."""
    for back in range(SLOTS):
        slot = (motion.head[0] + SLOTS - back) % SLOTS
        for j in range(steps.force.shape[1]):
            steps.force[back, j] = motion.force[slot, j]


@inlined
def recall(steps, motion):
    motion.head[0] = 0
    for back in range(SLOTS):
        for j in range(steps.force.shape[1]):
            motion.force[(SLOTS - back) % SLOTS, j] = steps.force[back, j]


@inlined
def node_after(k, whole):
    """Step of the grid, of so many, and whole rounds before it, after step k."""
    return (k + 1) % whole, (k + 1) // whole


@compiled
def record_motion(system, steps, periods, state, limit, out):
    """Record the motion as `lumped.kernels.rk4.record_motion` does."""
    q, v = state[0], state[1]
    motion, changes = new_motion(system), new_changes(system, steps, 0)
    count = steps.h.size
    whole = steps.grid.gap.shape[0]
    set_state(steps, motion, q, v)
    start(system, steps, 0, motion, changes)
    for row in range(periods * count):
        k = row % count
        get_state(steps, motion, q, v)
        if not bounded(q, v, limit):
            return NOT_FINITE, row + 1
        record_row(system, steps, k % whole, motion, v, out[row])
        advance(system, steps, node_after(k, whole), motion)
    get_state(steps, motion, q, v)
    if not bounded(q, v, limit):
        return NOT_FINITE, periods * count
    record_row(system, steps, 0, motion, v, out[-1])
    return FINISHED, periods * count


@compiled
def carry_motion(system, steps, limit, state, angular, sections, growth):
    """Carry perturbations as `lumped.kernels.rk4.carry_motion` does."""
    n, q, v = angular.size, state[0], state[1]
    number, count = state.shape[1] // n - 1, steps.h.size
    motion, changes = new_motion(system), new_changes(system, steps, number)
    whole, base = steps.grid.gap.shape[0], slice(0, n)
    set_state(steps, motion, q[base], v[base])
    set_changes(steps, changes, state)
    start(system, steps, 0, motion, changes)
    for period in range(growth.size):
        growth[period] = 0.0
        for k in range(count):
            if k == 0:
                get_state(steps, motion, q[base], v[base])
                record_row(system, steps, 0, motion, v[base], sections[period])
            node = node_after(k, whole)
            near = advance(system, steps, node, motion)
            if number > 0:
                advance_changes(steps, node[0], near, motion, changes)
            if (k % RESCALED == 0 or k == count - 1) and number > 0:
                get_state(steps, motion, q[base], v[base])
                get_changes(steps, changes, state)
                if not bounded(q[base], v[base], limit):
                    return NOT_FINITE, period
                growth[period] += normalise_perturbations(changes, state, angular)
    get_state(steps, motion, q[base], v[base])
    get_changes(steps, changes, state)
    return FINISHED, growth.size


@compiled
def add_moving(rows, facing, push, waves, compliance):
    """Add to a compliance (s, c, c) what moves in a step, B W B', of contacts that face
    each other (s, c).

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
                    compliance[k, c, d] += dot(rows[k, c], moved, n)
