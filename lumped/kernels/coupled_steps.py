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

from lumped.common.compiled import (
    allocating,
    compiled,
    compiled_part,
    inlined,
    shared_part,
)
from lumped.kernels.arrays import CoupledMotion
from lumped.kernels.contact import (
    CONVERGED,
    LOADS_ROW,
    PENETRATIONS_ROW,
    interpolate,
    may_touch,
    solve_penetrations,
)
from lumped.kernels.convergence import (
    FINISHED,
    NOT_FINITE,
    begin_period,
    close_section,
    is_bounded,
    set_error_bound,
    update_limits,
)
from lumped.kernels.coupled_changes import (
    advance_changes,
    get_changes,
    new_changes,
    normalise_perturbations,
    set_changes,
    start_changes,
)
from lumped.kernels.coupled_variables import (
    FORCE_NODES,
    add_columns,
    add_row,
    dot,
    dot_at,
    get_variables,
    multiply_row,
    set_variables,
)
from lumped.kernels.mesh_force import record_state

START_ITERATIONS = 4  # rounds after which the forces before the start are known
# Steps between looks at the range of deflection while it settles
STEPS_PER_LIMIT_UPDATE = 4
STEPS_PER_RESCALING = 64  # steps after which small changes are brought back to length 1


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
def advance_linear_part(steps, motion):
    """The linear part through a step, under the forces that are known."""
    propagator, head = steps.propagator, motion.head[0]
    size, a = motion.state.size, motion.state.size // 2
    inputs, state = motion.inputs, motion.state
    for i in range(size):
        inputs[i] = state[i]
        state[i] = 0.0
    for back in range(1, FORCE_NODES):
        force, begin = (
            motion.force[(head + FORCE_NODES - back) % FORCE_NODES],
            (back + 1) * a,
        )
        for j in range(a):
            inputs[begin + j] = force[j]
    add_columns(propagator.transition, inputs, state)
    for s in range(2):
        advance_waves(propagator.waves[s], motion, s)


@inlined
def advance_waves(factors, motion, s):
    """Forward or backward waves through a step, under the forces that are known.

    factors (10, w) : real and imaginary parts for the waves, then for forces at the end
    of the step, at its start and before
    """
    a, w, head = motion.state.size // 2, motion.waves.shape[2], motion.head[0]
    waves = motion.waves[s]
    one = motion.force[(head + 3) % FORCE_NODES]
    two = motion.force[(head + 2) % FORCE_NODES]
    three = motion.force[(head + 1) % FORCE_NODES]
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
def add_end_forces(steps, motion):
    """Add what the newest forces do in the step."""
    propagator, force = steps.propagator, motion.force[motion.head[0]]
    state, a, w = motion.state, motion.state.size // 2, motion.waves.shape[2]
    add_columns(propagator.force_response, force[:a], state)
    for s in range(2):
        waves, factors = motion.waves[s], propagator.waves[s]
        for p in range(w):
            i, j = a + p, a + w + p
            waves[0, p] += factors[2, p] * force[i] + factors[3, p] * force[j]
            waves[1, p] += factors[3, p] * force[i] - factors[2, p] * force[j]
    set_displacement(motion)


@inlined
def add_constant_loads(system, steps, motion):
    """Displacement by the constant loads as forces at the end of the step."""
    a, response = motion.state.size // 2, steps.propagator.force_response
    for j in range(a):
        for i in range(a):
            motion.q[i] += response[j, i] * system.load[j]


@inlined
def find_free_penetrations(system, steps, node, motion):
    """Penetrations of the contacts that face each other, without new forces, and the
    number of those that are so near to contact that they are `chosen`.

    node : step, and whole rounds before it
    Also the first guess of each penetration: where it goes on, nearly in proportion.
    """
    i, repetition = node
    grid, problem = steps.grid, steps.problem
    q, a, w = motion.q, motion.state.size // 2, motion.waves.shape[2]
    for m in range(grid.grid_index.shape[1]):
        problem.grid_index[m], problem.fraction[m] = (
            grid.grid_index[i, m],
            grid.fraction[i, m],
        )
    n_active = 0
    for k in range(grid.facing_contacts.shape[1]):
        c = grid.facing_contacts[i, k]
        if c < 0:
            break
        x = -grid.gap[i, c]
        if system.contacts.errors.shape[1] > 0:
            m = problem.mesh_of[c]
            cycle = grid.mesh_cycle[i, m] + repetition * grid.periods[m]
            x -= system.contacts.errors[c, cycle % system.contacts.errors.shape[1]]
        if system.contacts.curve_rows.shape[1] > 0:
            m = problem.mesh_of[c]
            cycle = grid.mesh_cycle[i, m] + repetition * grid.periods[m]
            x -= set_teeth(system.contacts, c, cycle, problem)
        x += multiply_row(grid.rows[i, c], grid.first_wave[c], q, a, w)
        before, last_free = steps.penetration[c], problem.free[c]
        problem.guess[c] = x
        if before > 0.0 and last_free > 0.5 * before:
            ratio, last = before / last_free, steps.ratio[c]
            steps.ratio[c] = ratio
            if last > 0.0:
                ratio = max(2.0 * ratio - last, 0.5 * ratio)
            problem.guess[c] = ratio * x
        else:
            steps.ratio[c] = 0.0
            if before > 0.0:
                problem.guess[c] = before
        problem.free[c], steps.penetration[c] = x, x
        if may_touch(problem, c, x):
            problem.active[n_active] = c
            n_active += 1
    return n_active


@compiled_part
def set_teeth(contacts, c, mesh_cycle, problem):
    """Set the load curve of contact c in a cycle; by how much its gap is larger."""
    m, cycle = problem.mesh_of[c], mesh_cycle % contacts.curve_rows.shape[1]
    problem.curve[c] = contacts.curve_rows[c, cycle]
    index, fraction = problem.grid_index[m], problem.fraction[m]
    row = contacts.gap_rows[c, cycle]
    return interpolate(contacts.gap_changes, row, index, fraction)


@inlined
def find_loads(system, steps, node, motion, compliance):
    """Penetrations [m] and loads [N] of all contacts (c,), and the newest forces.

    compliance (s, c, c) of the contacts under the new loads
    Loads are NaN where they were not found, so that the motion ends as diverged.
    """
    i, problem, load, grid = node[0], steps.problem, steps.load, steps.grid
    n_active = find_free_penetrations(system, steps, node, motion)
    for c in range(load.size):
        load[c] = 0.0
    for p in range(n_active):
        for s in range(n_active):
            c, d = problem.active[p], problem.active[s]
            problem.Q[p, s] = compliance[i, c, d]
    if n_active > 0 and solve_penetrations(problem, n_active) != CONVERGED:
        problem.newton[LOADS_ROW, 0] = math.nan
    force = motion.force[motion.head[0]]
    a, w = motion.state.size // 2, motion.waves.shape[2]
    for j in range(force.size):
        force[j] = system.load[j]
    for p in range(n_active):
        c, contact_load = problem.active[p], problem.newton[LOADS_ROW, p]
        load[c], steps.penetration[c] = (
            contact_load,
            problem.newton[PENETRATIONS_ROW, p],
        )
        if contact_load != 0.0:
            row = grid.rows[i, c]
            add_row(row, grid.first_wave[c], -contact_load, force, a, w)
    return n_active


@shared_part
def advance(system, steps, k, count, motion):
    """Steps k to k + count; how many contacts may touch at the end of the last."""
    grid_steps, n_active = steps.grid.gap.shape[0], 0
    for step in range(k, k + count):
        motion.head[0] = (motion.head[0] + 1) % FORCE_NODES
        advance_linear_part(steps, motion)
        set_displacement(motion)
        add_constant_loads(system, steps, motion)
        node = next_node(step, grid_steps)
        n_active = find_loads(system, steps, node, motion, steps.compliance)
        add_end_forces(steps, motion)
    return n_active


@inlined
def next_node(k, grid_steps):
    """Step of the grid, of so many, and whole rounds before it, after step k."""
    return (k + 1) % grid_steps, (k + 1) // grid_steps


@shared_part
def set_start_forces(system, steps, motion, changes):
    """Set the forces before the first step: the parabola through the next nodes.

    changes : CoupledChanges that are carried along, or None
    """
    state, waves = motion.state, motion.waves
    copy_variables(state, waves, motion.start_state, motion.start_waves)
    for iteration in range(START_ITERATIONS + 1):
        n_active = find_start_loads(system, steps, motion)
        if changes is not None:
            start_changes(steps, n_active, motion, changes)
        if iteration == START_ITERATIONS:
            break
        if iteration == 0:
            extrapolate(motion.force, 0.0)
            if changes is not None:
                extrapolate_changes(changes.force, 0.0)
        for k in range(2):
            n_active = advance(system, steps, k, 1, motion)
            if changes is not None:
                node, _ = next_node(k, steps.grid.gap.shape[0])
                advance_changes(steps, node, n_active, motion, changes)
        extrapolate(motion.force, 1.0)
        if changes is not None:
            extrapolate_changes(changes.force, 1.0)


@shared_part
def find_start_loads(system, steps, motion):
    """Put the motion back to its start, with the loads there; as `find_loads`."""
    copy_variables(motion.start_state, motion.start_waves, motion.state, motion.waves)
    set_displacement(motion)
    motion.head[0] = 0
    return find_loads(system, steps, (0, 0), motion, steps.grid.compliance)


@inlined
def copy_variables(state, waves, to_state, to_waves):
    for i in range(state.size):
        to_state[i] = state[i]
    for s in range(2):
        for p in range(waves.shape[2]):
            to_waves[s, 0, p] = waves[s, 0, p]
            to_waves[s, 1, p] = waves[s, 1, p]


@inlined
def extrapolate(force, weight):
    """Forces one and two steps before the start, from those at the next three nodes.

    weight : 1.0 for the parabola through them, 0.0 for the first alone
    """
    for j in range(force.shape[1]):
        g0, g1, g2 = force[0, j], force[1, j], force[2, j]
        force[3, j] = g0 + weight * (2.0 * g0 - 3.0 * g1 + g2)
        force[2, j] = g0 + weight * (5.0 * g0 - 8.0 * g1 + 3.0 * g2)


@inlined
def extrapolate_changes(force, weight):
    for j in range(force.shape[1]):
        extrapolate(force[:, j], weight)


@inlined
def record_row(system, steps, i, motion, v, out):
    """The meshes (6 + 2 k, m) at node i, see `lumped.kernels.mesh_force.record`.

    Forces pass through every instant smoothly. The rate is that of the coordinates.
    After those rows come loads and penetrations of each mesh's contacts, k at most.
    """
    first, side = system.contacts.first, system.contacts.side
    a = motion.state.size // 2  # pairs of modes do not turn the hubs
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
        out[1, m] = dot(system.shapes[m], v, a)
        out[2, m], out[5, m] = force, force
        out[3, m], out[4, m] = drive, back


@inlined
def set_deflection(system, steps, i, motion, s):
    """Deflections (m,) of the meshes by their hubs at node i."""
    q, ahead, a = motion.q, steps.grid.ahead, motion.state.size // 2
    for m in range(s.size):
        s[m] = system.offset[m] + dot(system.shapes[m], q, a)
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
        np.zeros((FORCE_NODES, n)),
        np.zeros(1, np.int64),
        np.zeros(n),
        np.zeros(5 * (n - 2 * w)),
        np.zeros(size),
        np.zeros((2, 2, w)),
    )


@compiled
def settle_motion(system, steps, limit, state, convergence, max_periods):
    """Advance the motion as `lumped.kernels.rk4.settle_motion` does."""
    q, v = state[0], state[1]
    motion, count = new_motion(system), steps.h.size
    grid_steps, s = steps.grid.gap.shape[0], np.empty(system.offset.size)
    set_state(steps, motion, q, v)
    if steps.continues[0]:
        restore_forces(steps, motion)
    else:
        set_start_forces(system, steps, motion, None)
    for _ in range(max_periods):
        begin_period(convergence)
        for k in range(0, count, STEPS_PER_LIMIT_UPDATE):
            set_deflection(system, steps, k % grid_steps, motion, s)
            update_limits(convergence.limits, s)
            if not math.isfinite(s[0]):
                return NOT_FINITE, (k + 1) / count, False
            advance(system, steps, k, min(STEPS_PER_LIMIT_UPDATE, count - k), motion)
        get_state(steps, motion, q, v)
        if not is_bounded(q, v, limit):
            return NOT_FINITE, 1.0, False
        set_error_bound(convergence, count)
        if close_section(convergence, q, v):
            return FINISHED, 0.0, True
    save_forces(steps, motion)
    return FINISHED, 0.0, False


@inlined
def save_forces(steps, motion):
    """Save nodal forces, from which the next call continues."""
    for back in range(FORCE_NODES):
        slot = (motion.head[0] + FORCE_NODES - back) % FORCE_NODES
        for j in range(steps.force.shape[1]):
            steps.force[back, j] = motion.force[slot, j]


@inlined
def restore_forces(steps, motion):
    motion.head[0] = 0
    for back in range(FORCE_NODES):
        for j in range(steps.force.shape[1]):
            motion.force[(FORCE_NODES - back) % FORCE_NODES, j] = steps.force[back, j]


@compiled
def record_motion(system, steps, periods, state, limit, out, states):
    """Record the motion as `lumped.kernels.rk4.record_motion` does.

    The forces at its end are saved for another call.
    """
    q, v = state[0], state[1]
    motion, count = new_motion(system), steps.h.size
    grid_steps = steps.grid.gap.shape[0]
    set_state(steps, motion, q, v)
    if steps.continues[0]:
        restore_forces(steps, motion)
    else:
        set_start_forces(system, steps, motion, None)
    for row in range(periods * count):
        k = row % count
        get_state(steps, motion, q, v)
        if not is_bounded(q, v, limit):
            return NOT_FINITE, row + 1
        record_row(system, steps, k % grid_steps, motion, v, out[row])
        record_state(states, row, q, v)
        advance(system, steps, k, 1, motion)
    get_state(steps, motion, q, v)
    if not is_bounded(q, v, limit):
        return NOT_FINITE, periods * count
    record_row(system, steps, 0, motion, v, out[-1])
    record_state(states, periods * count, q, v)
    save_forces(steps, motion)
    return FINISHED, periods * count


@compiled
def integrate_variations(system, steps, limit, state, angular, sections, growth):
    """Carry perturbations as `lumped.kernels.rk4.integrate_variations` does."""
    n, q, v = angular.size, state[0], state[1]
    number, count = state.shape[1] // n - 1, steps.h.size
    motion, changes = new_motion(system), new_changes(system, steps, number)
    grid_steps, base = steps.grid.gap.shape[0], slice(0, n)
    set_state(steps, motion, q[base], v[base])
    set_changes(steps, changes, state)
    set_start_forces(system, steps, motion, changes)
    for period in range(growth.size):
        growth[period] = 0.0
        for k in range(count):
            if k == 0:
                get_state(steps, motion, q[base], v[base])
                record_row(system, steps, 0, motion, v[base], sections[period])
            n_active = advance(system, steps, k, 1, motion)
            if number > 0:
                node, _ = next_node(k, grid_steps)
                advance_changes(steps, node, n_active, motion, changes)
            if (k % STEPS_PER_RESCALING == 0 or k == count - 1) and number > 0:
                get_state(steps, motion, q[base], v[base])
                get_changes(steps, changes, state)
                if not is_bounded(q[base], v[base], limit):
                    return NOT_FINITE, period
                growth[period] += normalise_perturbations(changes, state, angular)
    get_state(steps, motion, q[base], v[base])
    get_changes(steps, changes, state)
    return FINISHED, growth.size


@compiled
def add_wave_compliance(grid, waves, compliance):
    """Add to a compliance (s, c, c) what travelling modes move in a step, of contacts
    that face each other and that a gear has in common.

    waves (2, w) displacement per force at the end of the step, both senses together,
    real and imaginary
    """
    rows, first, facing = grid.rows, grid.first_wave, grid.facing_contacts
    k = grid.wave_count[0]
    a = rows.shape[2] - 2 * k
    displacement = np.empty(2 * k)
    for i in range(rows.shape[0]):
        for d in facing[i]:
            if d < 0:
                break
            start = first[d]
            for p in range(k):
                one, two = rows[i, d, a + p], rows[i, d, a + k + p]
                real, imaginary = waves[0, start + p], waves[1, start + p]
                # of Z = E1 - i E2 under the force one - i two
                displacement[p] = real * one + imaginary * two
                displacement[k + p] = real * two - imaginary * one
            for c in facing[i]:
                if c < 0:
                    break
                begin = max(start, first[c])
                count = min(start, first[c]) + k - begin
                if count > 0:
                    row, at, source = rows[i, c], a + begin - first[c], begin - start
                    moved = dot_at(row, at, displacement, source, count)
                    moved += dot_at(row, at + k, displacement, source + k, count)
                    compliance[i, c, d] += moved
