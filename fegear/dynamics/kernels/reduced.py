"""Implicit steps of hubs and elastic modes, compiled.

A state (4, n) holds displacement, velocity, acceleration and the generalised contact
force of the n coordinates; a contact state (3, c) penetration, load and whether
friction is reversed. The step is generalised-alpha, `fegear.dynamics.scheme`:

    M a(n+1-am) + C v(n+1-af) + K u(n+1-af) = f(n+1-af)
"""

from __future__ import annotations

import math

import numpy as np

from fegear.dynamics.kernels.arrays import Row, StepWorkspace
from fegear.dynamics.kernels.newmark import newmark_correct, newmark_predict
from lumped.common.compiled import allocating, compiled, compiled_part, inlined
from lumped.kernels.contact import (
    CONVERGED,
    LOADS_ROW,
    PENETRATIONS_ROW,
    contact_problem,
    find_active,
    interpolate,
    new_position,
    set_position,
    set_reversed,
    set_row,
    solve_penetrations,
)
from lumped.kernels.convergence import is_bounded

FINISHED, DIVERGED, UNSOLVED = 0, 1, 2
Q, V, A, PUSH = 0, 1, 2, 3  # rows of a state
PENETRATION, LOAD, REVERSED = 0, 1, 2  # rows of a contact state
DEFLECTION, RATE, FORCE, DRIVE_PENETRATION, BACK_PENETRATION = (
    0,
    1,
    2,
    3,
    4,
)  # recorded of every mesh


@inlined
def mass_times(modal, x, out):
    rotation, coupling, owner = modal.rotation, modal.coupling, modal.owner
    hubs = rotation.shape[1]
    for i in range(x.size):
        out[i] = x[i]
    for i in range(coupling.size):
        if coupling[i] != 0.0:
            for a in range(hubs):
                both = coupling[i] * rotation[owner[i], a]
                out[a] += both * x[hubs + i]
                out[hubs + i] += both * x[a]


@inlined
def solve_step(modal, step, right, out, reduced):
    """Solve with the step's matrix by elimination of the elastic modes.

    reduced : (h,) working array
    """
    rotation, coupling, owner = modal.rotation, modal.coupling, modal.owner
    inverse, hubs = step.elastic_inverse, rotation.shape[1]
    for a in range(hubs):
        reduced[a] = right[a]
    for i in range(coupling.size):
        out[hubs + i] = inverse[i] * right[hubs + i]
        if coupling[i] != 0.0:
            carried = step.mass_weight * coupling[i] * out[hubs + i]
            for a in range(hubs):
                reduced[a] -= carried * rotation[owner[i], a]
    for a in range(hubs):
        out[a] = 0.0
        for b in range(hubs):
            out[a] += step.hub_inverse[a, b] * reduced[b]
    for i in range(coupling.size):
        if coupling[i] != 0.0:
            turn = 0.0
            for a in range(hubs):
                turn += rotation[owner[i], a] * out[a]
            out[hubs + i] -= inverse[i] * step.mass_weight * coupling[i] * turn


@inlined
def predict(newmark, state, predicted):
    """Displacement and velocity (2, n) at the end of a step without acceleration."""
    for i in range(state.shape[1]):
        predicted[0, i], predicted[1, i] = newmark_predict(
            newmark, state[Q, i], state[V, i], state[A, i]
        )


@inlined
def set_balance(modal, newmark, state, predicted, right):
    """Forces (n,) that new accelerations balance, without new contact forces."""
    alpha_f, new = newmark.alpha_f, 1.0 - newmark.alpha_f
    hubs, stiffness, rigidity = modal.damping.size, modal.stiffness, modal.rigidity
    mass_times(modal, state[A], right)
    for i in range(right.size):
        right[i] = alpha_f * state[PUSH, i] - newmark.alpha_m * right[i]
        velocity = new * predicted[1, i] + alpha_f * state[V, i]
        if i < hubs:
            right[i] += modal.load[i] - modal.damping[i] * velocity
            for j in range(hubs):
                place = new * predicted[0, j] + alpha_f * state[Q, j]
                right[i] -= stiffness[i, j] * place
        else:
            place = new * predicted[0, i] + alpha_f * state[Q, i]
            damping = modal.elastic_damping[i - hubs]
            right[i] -= damping * velocity + rigidity[i - hubs] * place


@inlined
def correct(newmark, predicted, acceleration, state):
    for i in range(acceleration.size):
        state[A, i] = acceleration[i]
        state[Q, i], state[V, i] = newmark_correct(
            newmark, predicted[0, i], predicted[1, i], acceleration[i]
        )


@compiled_part
def advance_teeth(modal, kinematics, clock, before, state):
    """Shift the tooth index of gears that pass a tooth."""
    rate, first_mesh = kinematics.rate, kinematics.first_mesh
    for g in range(first_mesh.size):
        m = first_mesh[g]
        cycles = math.floor(rate[m] * (before + 1) / clock.cycle + 1e-9)
        if cycles > math.floor(rate[m] * before / clock.cycle + 1e-9):
            shift_tooth_index(modal, g, state)


@compiled_part
def shift_tooth_index(modal, gear, state):
    """Shift the tooth index of a gear that passes a tooth."""
    hubs, owner, partner = modal.rotation.shape[1], modal.owner, modal.partner
    for i in range(owner.size):
        j = partner[i]
        if owner[i] != gear or j < i:
            continue
        for k in range(state.shape[0]):
            one, two = state[k, hubs + i], state[k, hubs + j]
            state[k, hubs + i] = modal.cosine[i] * one + modal.sine[i] * two
            if j != i:
                state[k, hubs + j] = modal.cosine[j] * two + modal.sine[j] * one


@compiled_part
def set_rotation(kinematics, modal, speed, predicted, rotation):
    """Speeds (m, 2) of the gears of each mesh in their nominal sense [rad/s]."""
    gears, nominal = kinematics.gears, kinematics.speed
    for m in range(gears.shape[0]):
        for k in range(2):
            g = gears[m, k]
            turn = speed * nominal[g]
            for i in range(modal.rotation.shape[1]):
                turn += modal.rotation[g, i] * predicted[1, i]
            rotation[m, k] = turn * np.sign(nominal[g])


@inlined
def eliminate_modes(modal, step, columns, rows, c):
    """Elastic solution of contact c's row, and what it leaves on the hubs."""
    hubs = modal.rotation.shape[1]
    for a in range(hubs):
        rows.onto_hubs[c, a] = rows.row[c, a]
    for k in range(hubs, columns.size):
        i = columns[k] - hubs
        rows.elastic[c, k] = step.elastic_inverse[i] * rows.row[c, k]
        if modal.coupling[i] != 0.0:
            carried = step.mass_weight * modal.coupling[i] * rows.elastic[c, k]
            for a in range(hubs):
                rows.onto_hubs[c, a] -= carried * modal.rotation[modal.owner[i], a]


@inlined
def step_compliance(jacobian, hubs, room, c, d):
    """Penetration of contact c under the step's inverse matrix times minus force d."""
    normal, pushing, moved, total = room.normal, room.pushing, room.moved, 0.0
    for a in range(hubs):
        total += normal.onto_hubs[c, a] * moved[d, a]
    one, two = jacobian.mesh_of[c], jacobian.mesh_of[d]
    widths, columns = jacobian.widths, jacobian.columns
    if one == two:
        for k in range(hubs, widths[one]):
            total += normal.row[c, k] * pushing.elastic[d, k]
        return total
    if not jacobian.linked[one, two]:
        return total
    i, j = hubs, hubs  # columns increase, a common gear's are in both
    while i < widths[one] and j < widths[two]:
        if columns[one, i] == columns[two, j]:
            total += normal.row[c, i] * pushing.elastic[d, j]
            i += 1
            j += 1
        elif columns[one, i] < columns[two, j]:
            i += 1
        else:
            j += 1
    return total


@inlined
def residual_compliance(contacts, jacobian, friction, where, c, d):
    """Static compliance between contacts that the coordinates do not have [m/N].

    friction : (c,) signed coefficient
    """
    m = jacobian.mesh_of[c]  # meshes of a common gear are in step
    if not jacobian.linked[m, jacobian.mesh_of[d]]:
        return 0.0
    place, part = where.grid_index[m], where.fraction[m]
    normal, tangential = contacts.normal_compliance, contacts.tangential_compliance
    value = normal[place, c, d]
    if part > 0.0:
        value += part * (normal[place + 1, c, d] - value)
    if friction[d] != 0.0:
        aside = tangential[place, c, d]
        if part > 0.0:
            aside += part * (tangential[place + 1, c, d] - aside)
        value += friction[d] * aside
    return value


@inlined
def set_friction(model, speed, where, room):
    """The signed coefficient of friction toward the roots of each contact (c,)."""
    jacobian, contacts, signed = model.jacobian, model.contacts, room.friction
    reversed_, friction = room.problem.friction_reversed, jacobian.friction[()]
    for c in range(signed.size):
        reversed_[c], signed[c] = 0, 0.0
    if not friction > 0.0:
        return
    set_rotation(model.kinematics, model.modal, speed, room.predicted, room.rotation)
    set_reversed(contacts, room.rotation, where, reversed_)
    for c in range(signed.size):
        m = jacobian.mesh_of[c]
        sliding = interpolate(
            contacts.sliding, c, where.grid_index[m], where.fraction[m]
        )
        signed[c] = friction * sliding
        if reversed_[c] == 1:
            signed[c] = -signed[c]


@inlined
def set_free(model, newmark, where, room):
    """Penetrations (c,) without new contact forces, and the rows that give them."""
    jacobian, late = model.jacobian, newmark.beta * newmark.h**2
    columns, rows, free = jacobian.columns, room.normal.row, room.problem.free
    predicted, acceleration = room.predicted, room.acceleration
    for c in range(free.size):
        m = jacobian.mesh_of[c]
        width, place, part = jacobian.widths[m], where.grid_index[m], where.fraction[m]
        free[c] = -interpolate(where.gap, c, place, part)
        set_row(jacobian.normal, width, c, place, part, rows[c])
        for k in range(width):
            i = columns[m, k]
            free[c] += rows[c, k] * (predicted[0, i] + late * acceleration[i])


@inlined
def set_forces(model, step, where, near, room):
    """Rows of penetration and of contact force, and how a unit force moves the hubs.

    A force acts along its normal and, times the signed coefficient of friction, toward
    the root.
    """
    modal, jacobian, friction = model.modal, model.jacobian, room.friction
    normal, pushing, moved = room.normal, room.pushing, room.moved
    hubs = modal.rotation.shape[1]
    for p in range(near):
        c = room.problem.active[p]
        m = jacobian.mesh_of[c]
        width, place, part = jacobian.widths[m], where.grid_index[m], where.fraction[m]
        columns = jacobian.columns[m, :width]
        eliminate_modes(modal, step, columns, normal, c)
        if friction[c] != 0.0:
            set_row(jacobian.tangential, width, c, place, part, pushing.row[c])
        for k in range(width):
            along = friction[c] * pushing.row[c, k] if friction[c] != 0.0 else 0.0
            pushing.row[c, k] = normal.row[c, k] + along
        eliminate_modes(modal, step, columns, pushing, c)
        for a in range(hubs):
            moved[c, a] = 0.0
            for b in range(hubs):
                moved[c, a] += step.hub_inverse[a, b] * pushing.onto_hubs[c, b]


@inlined
def set_compliance(model, step, where, near, room):
    """What the penetrations of the chosen contacts owe to the forces on them."""
    problem, newmark, hubs = room.problem, step.newmark, room.moved.shape[1]
    soft = newmark.beta * newmark.h**2 * (1.0 - newmark.alpha_f)
    for p in range(near):
        for s in range(near):
            c, d = problem.active[p], problem.active[s]
            moving = step_compliance(model.jacobian, hubs, room, c, d)
            problem.Q[p, s] = soft * moving + residual_compliance(
                model.contacts, model.jacobian, room.friction, where, c, d
            )


@inlined
def find_contact(model, step, speed, where, state, contact, room):
    """New contact state (3, c) and generalised contact force of the state; the status.

    room.acceleration : (n,) at the end of the step without them
    """
    jacobian, problem = model.jacobian, room.problem
    set_friction(model, speed, where, room)
    set_free(model, step.newmark, where, room)
    for c in range(contact.shape[1]):
        loaded = contact[LOAD, c] > 0.0
        problem.guess[c] = contact[PENETRATION, c] if loaded else problem.free[c]
        contact[PENETRATION, c], contact[LOAD, c] = problem.free[c], 0.0
        contact[REVERSED, c] = problem.friction_reversed[c]
    for i in range(state.shape[1]):
        state[PUSH, i] = 0.0
    near = find_active(problem)
    if near == 0:
        return CONVERGED
    set_forces(model, step, where, near, room)
    set_compliance(model, step, where, near, room)
    status = solve_penetrations(problem, near)
    for p in range(near):
        c, load = problem.active[p], problem.newton[LOADS_ROW, p]
        m = jacobian.mesh_of[c]
        contact[PENETRATION, c], contact[LOAD, c] = (
            problem.newton[PENETRATIONS_ROW, p],
            load,
        )
        for k in range(jacobian.widths[m]):
            state[PUSH, jacobian.columns[m, k]] -= room.pushing.row[c, k] * load
    return status


@inlined
def record_meshes(kinematics, contacts, state, contact, out):
    """What is recorded of every mesh (5, m)."""
    deflection, first, side = kinematics.deflection, contacts.first, contacts.side
    for m in range(first.size - 1):
        out[DEFLECTION, m], out[RATE, m], out[FORCE, m] = 0.0, 0.0, 0.0
        out[DRIVE_PENETRATION, m], out[BACK_PENETRATION, m] = -math.inf, -math.inf
        for i in range(deflection.shape[1]):
            out[DEFLECTION, m] += deflection[m, i] * state[Q, i]
            out[RATE, m] += deflection[m, i] * state[V, i]
        for c in range(first[m], first[m + 1]):
            out[FORCE, m] += side[c] * contact[LOAD, c]
            kind = DRIVE_PENETRATION if side[c] > 0.0 else BACK_PENETRATION
            out[kind, m] = max(out[kind, m], contact[PENETRATION, c])


@inlined
def record_step(model, state, contact, record, n):
    record_meshes(model.kinematics, model.contacts, state, contact, record.mesh[n])
    for c in range(contact.shape[1]):
        record.load[n, c] = contact[LOAD, c]
    for k in range(2):
        for a in range(record.hub.shape[2]):
            record.hub[n, k, a] = state[k, a]


@allocating
def make_room(model, where):
    """Working arrays of the steps."""
    modal, jacobian = model.modal, model.jacobian
    count, wide = jacobian.mesh_of.size, jacobian.columns.shape[1]
    hubs = modal.damping.size
    size = hubs + modal.rigidity.size
    return StepWorkspace(
        np.empty((2, size)),
        np.empty(size),
        np.empty(size),
        np.empty(hubs),
        np.empty((jacobian.widths.size, 2)),
        np.empty(count),
        Row(np.empty((count, wide)), np.empty((count, hubs)), np.empty((count, wide))),
        Row(np.empty((count, wide)), np.empty((count, hubs)), np.empty((count, wide))),
        np.empty((count, hubs)),
        contact_problem(model.contacts, jacobian.mesh_of, where),
    )


@compiled
def integrate(model, step, clock, state, contact, record):
    """Advance by as many steps as there is room to record; (status, steps done).

    model : ModelArrays; state (4, n) and contact (3, c) are advanced in place
    """
    where = new_position(model.contacts)
    room = make_room(model, where)
    return march(model, step, clock, state, contact, record, where, room)


@inlined
def march(model, step, clock, state, contact, record, where, room):
    """Integrate as `integrate` does, with given working arrays."""
    rate = model.kinematics.rate
    set_position(rate, model.contacts, clock.cycle, clock.start, where)
    steps = record.mesh.shape[0] - 1
    for n in range(steps):
        record_step(model, state, contact, record, n)
        now = clock.start + n
        if clock.speed != 0.0:
            advance_teeth(model.modal, model.kinematics, clock, now, state)
            set_position(rate, model.contacts, clock.cycle, now + 1, where)
        status = advance(model, step, clock.speed, where, state, contact, room)
        if status != CONVERGED:
            return UNSOLVED, n
        if not is_bounded(state[Q], state[V], clock.limit):
            return DIVERGED, n
    record_step(model, state, contact, record, steps)
    return FINISHED, steps


@inlined
def advance(model, step, speed, where, state, contact, room):
    """Take one step, which ends with the meshes at `where`; return the status."""
    modal, newmark, right = model.modal, step.newmark, room.right
    predict(newmark, state, room.predicted)
    set_balance(modal, newmark, state, room.predicted, right)
    solve_step(modal, step, right, room.acceleration, room.reduced)
    status = find_contact(model, step, speed, where, state, contact, room)
    if status != CONVERGED:
        return status
    for i in range(right.size):
        right[i] = (1.0 - newmark.alpha_f) * state[PUSH, i]
    solve_step(modal, step, right, state[A], room.reduced)
    for i in range(right.size):
        room.acceleration[i] += state[A, i]
    correct(newmark, room.predicted, room.acceleration, state)
    return status
