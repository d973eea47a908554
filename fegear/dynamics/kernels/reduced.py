"""Implicit steps of hubs and elastic modes, compiled.

A state (4, n) holds displacement, velocity, acceleration and the generalised contact
force of the n coordinates; a contact state (3, c) penetration, load and whether
friction is reversed. The step is generalised-alpha, `fegear.dynamics.scheme`:

    M a(n+1-am) + C v(n+1-af) + K u(n+1-af) = f(n+1-af)
"""

from __future__ import annotations

import math

import numpy as np

from fegear.dynamics.kernels.newmark import newmark_correct, newmark_predict
from fegear.dynamics.kernels.step_arrays import Row, StepWorkspace
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
Q, V, A, CONTACT_FORCE = 0, 1, 2, 3  # rows of a state
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
    rotation, coupling, gear_of_mode = (
        modal.rotation,
        modal.coupling,
        modal.gear_of_mode,
    )
    hubs = rotation.shape[1]
    for i in range(x.size):
        out[i] = x[i]
    for i in range(coupling.size):
        if coupling[i] != 0.0:
            for a in range(hubs):
                both = coupling[i] * rotation[gear_of_mode[i], a]
                out[a] += both * x[hubs + i]
                out[hubs + i] += both * x[a]


@inlined
def solve_step(modal, step, rhs, out, reduced):
    """Solve with the step's matrix by elimination of the elastic modes.

    reduced : (h,) working array
    """
    rotation, coupling, gear_of_mode = (
        modal.rotation,
        modal.coupling,
        modal.gear_of_mode,
    )
    inverse, hubs = step.elastic_inverse, rotation.shape[1]
    for a in range(hubs):
        reduced[a] = rhs[a]
    for i in range(coupling.size):
        out[hubs + i] = inverse[i] * rhs[hubs + i]
        if coupling[i] != 0.0:
            inertial_moment = step.mass_weight * coupling[i] * out[hubs + i]
            for a in range(hubs):
                reduced[a] -= inertial_moment * rotation[gear_of_mode[i], a]
    for a in range(hubs):
        out[a] = 0.0
        for b in range(hubs):
            out[a] += step.hub_inverse[a, b] * reduced[b]
    for i in range(coupling.size):
        if coupling[i] != 0.0:
            hub_rotation = 0.0
            for a in range(hubs):
                hub_rotation += rotation[gear_of_mode[i], a] * out[a]
            out[hubs + i] -= inverse[i] * step.mass_weight * coupling[i] * hub_rotation


@inlined
def predict(newmark, state, predicted):
    """Displacement and velocity (2, n) at the end of a step without acceleration."""
    for i in range(state.shape[1]):
        predicted[0, i], predicted[1, i] = newmark_predict(
            newmark, state[Q, i], state[V, i], state[A, i]
        )


@inlined
def assemble_rhs(modal, newmark, state, predicted, rhs):
    """Right-hand side (n,) of the step without new contact forces."""
    alpha_f, weight_new = newmark.alpha_f, 1.0 - newmark.alpha_f
    hubs, stiffness, rigidity = modal.damping.size, modal.stiffness, modal.rigidity
    mass_times(modal, state[A], rhs)
    for i in range(rhs.size):
        rhs[i] = alpha_f * state[CONTACT_FORCE, i] - newmark.alpha_m * rhs[i]
        velocity = weight_new * predicted[1, i] + alpha_f * state[V, i]
        if i < hubs:
            rhs[i] += modal.load[i] - modal.damping[i] * velocity
            for j in range(hubs):
                displacement = weight_new * predicted[0, j] + alpha_f * state[Q, j]
                rhs[i] -= stiffness[i, j] * displacement
        else:
            displacement = weight_new * predicted[0, i] + alpha_f * state[Q, i]
            damping = modal.elastic_damping[i - hubs]
            rhs[i] -= damping * velocity + rigidity[i - hubs] * displacement


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
    hubs, gear_of_mode, partner = (
        modal.rotation.shape[1],
        modal.gear_of_mode,
        modal.partner,
    )
    for i in range(gear_of_mode.size):
        j = partner[i]
        if gear_of_mode[i] != gear or j < i:
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
            gear_speed = speed * nominal[g]
            for i in range(modal.rotation.shape[1]):
                gear_speed += modal.rotation[g, i] * predicted[1, i]
            rotation[m, k] = gear_speed * np.sign(nominal[g])


@inlined
def eliminate_modes(modal, step, columns, rows, c):
    """Condense the row of contact c onto the hubs."""
    hubs = modal.rotation.shape[1]
    for a in range(hubs):
        rows.condensed_row[c, a] = rows.row[c, a]
    for k in range(hubs, columns.size):
        i = columns[k] - hubs
        rows.elastic[c, k] = step.elastic_inverse[i] * rows.row[c, k]
        if modal.coupling[i] != 0.0:
            inertial_moment = step.mass_weight * modal.coupling[i] * rows.elastic[c, k]
            for a in range(hubs):
                rows.condensed_row[c, a] -= (
                    inertial_moment * modal.rotation[modal.gear_of_mode[i], a]
                )


@inlined
def step_compliance(jacobian, hubs, workspace, c, d):
    """Compliance of the step between contacts c and d, without its factor."""
    normal, force_rows, hub_response, total = (
        workspace.normal,
        workspace.force_rows,
        workspace.hub_response,
        0.0,
    )
    for a in range(hubs):
        total += normal.condensed_row[c, a] * hub_response[d, a]
    one, two = jacobian.mesh_of[c], jacobian.mesh_of[d]
    widths, columns = jacobian.widths, jacobian.columns
    if one == two:
        for k in range(hubs, widths[one]):
            total += normal.row[c, k] * force_rows.elastic[d, k]
        return total
    if not jacobian.share_gear[one, two]:
        return total
    i, j = hubs, hubs  # columns increase, a common gear's are in both
    while i < widths[one] and j < widths[two]:
        if columns[one, i] == columns[two, j]:
            total += normal.row[c, i] * force_rows.elastic[d, j]
            i += 1
            j += 1
        elif columns[one, i] < columns[two, j]:
            i += 1
        else:
            j += 1
    return total


@inlined
def residual_compliance(contacts, jacobian, friction, position, c, d):
    """Residual flexibility between contacts, of modes that are left out [m/N].

    friction : (c,) signed coefficient
    """
    m = jacobian.mesh_of[c]  # meshes of a common gear are in step
    if not jacobian.share_gear[m, jacobian.mesh_of[d]]:
        return 0.0
    grid_index, fraction = position.grid_index[m], position.fraction[m]
    normal, tangential = contacts.normal_compliance, contacts.tangential_compliance
    value = normal[grid_index, c, d]
    if fraction > 0.0:
        value += fraction * (normal[grid_index + 1, c, d] - value)
    if friction[d] != 0.0:
        tangential_value = tangential[grid_index, c, d]
        if fraction > 0.0:
            tangential_value += fraction * (
                tangential[grid_index + 1, c, d] - tangential_value
            )
        value += friction[d] * tangential_value
    return value


@inlined
def set_friction(model, speed, position, workspace):
    """The signed coefficient of friction toward the roots of each contact (c,)."""
    jacobian, contacts, signed = model.jacobian, model.contacts, workspace.friction
    reversed_, friction = workspace.problem.friction_reversed, jacobian.friction[()]
    for c in range(signed.size):
        reversed_[c], signed[c] = 0, 0.0
    if not friction > 0.0:
        return
    set_rotation(
        model.kinematics, model.modal, speed, workspace.predicted, workspace.rotation
    )
    set_reversed(contacts, workspace.rotation, position, reversed_)
    for c in range(signed.size):
        m = jacobian.mesh_of[c]
        sliding = interpolate(
            contacts.sliding, c, position.grid_index[m], position.fraction[m]
        )
        signed[c] = friction * sliding
        if reversed_[c] == 1:
            signed[c] = -signed[c]


@inlined
def set_free_penetrations(model, newmark, position, workspace):
    """Penetrations (c,) without new contact forces, and the rows that give them."""
    jacobian, beta_h2 = model.jacobian, newmark.beta * newmark.h**2
    columns, rows, free = jacobian.columns, workspace.normal.row, workspace.problem.free
    predicted, acceleration = workspace.predicted, workspace.acceleration
    for c in range(free.size):
        m = jacobian.mesh_of[c]
        width, grid_index, fraction = (
            jacobian.widths[m],
            position.grid_index[m],
            position.fraction[m],
        )
        free[c] = -interpolate(position.gap, c, grid_index, fraction)
        set_row(jacobian.normal, width, c, grid_index, fraction, rows[c])
        for k in range(width):
            i = columns[m, k]
            free[c] += rows[c, k] * (predicted[0, i] + beta_h2 * acceleration[i])


@inlined
def set_contact_rows(model, step, position, n_active, workspace):
    """Rows of penetration and of contact force, and how a unit force moves the hubs.

    A force acts along its normal and, times the signed coefficient of friction, toward
    the root.
    """
    modal, jacobian, friction = model.modal, model.jacobian, workspace.friction
    normal, force_rows, hub_response = (
        workspace.normal,
        workspace.force_rows,
        workspace.hub_response,
    )
    hubs = modal.rotation.shape[1]
    for p in range(n_active):
        c = workspace.problem.active[p]
        m = jacobian.mesh_of[c]
        width, grid_index, fraction = (
            jacobian.widths[m],
            position.grid_index[m],
            position.fraction[m],
        )
        columns = jacobian.columns[m, :width]
        eliminate_modes(modal, step, columns, normal, c)
        if friction[c] != 0.0:
            set_row(
                jacobian.tangential, width, c, grid_index, fraction, force_rows.row[c]
            )
        for k in range(width):
            friction_part = (
                friction[c] * force_rows.row[c, k] if friction[c] != 0.0 else 0.0
            )
            force_rows.row[c, k] = normal.row[c, k] + friction_part
        eliminate_modes(modal, step, columns, force_rows, c)
        for a in range(hubs):
            hub_response[c, a] = 0.0
            for b in range(hubs):
                hub_response[c, a] += (
                    step.hub_inverse[a, b] * force_rows.condensed_row[c, b]
                )


@inlined
def set_compliance(model, step, position, n_active, workspace):
    """Compliance matrix of the active contacts."""
    problem, newmark, hubs = (
        workspace.problem,
        step.newmark,
        workspace.hub_response.shape[1],
    )
    compliance_factor = newmark.beta * newmark.h**2 * (1.0 - newmark.alpha_f)
    for p in range(n_active):
        for s in range(n_active):
            c, d = problem.active[p], problem.active[s]
            dynamic_compliance = step_compliance(model.jacobian, hubs, workspace, c, d)
            problem.Q[p, s] = (
                compliance_factor * dynamic_compliance
                + residual_compliance(
                    model.contacts, model.jacobian, workspace.friction, position, c, d
                )
            )


@inlined
def find_contact(model, step, speed, position, state, contact, workspace):
    """New contact state (3, c) and generalised contact force of the state; the status.

    workspace.acceleration : (n,) at the end of the step without them
    """
    jacobian, problem = model.jacobian, workspace.problem
    set_friction(model, speed, position, workspace)
    set_free_penetrations(model, step.newmark, position, workspace)
    for c in range(contact.shape[1]):
        loaded = contact[LOAD, c] > 0.0
        problem.guess[c] = contact[PENETRATION, c] if loaded else problem.free[c]
        contact[PENETRATION, c], contact[LOAD, c] = problem.free[c], 0.0
        contact[REVERSED, c] = problem.friction_reversed[c]
    for i in range(state.shape[1]):
        state[CONTACT_FORCE, i] = 0.0
    n_active = find_active(problem)
    if n_active == 0:
        return CONVERGED
    set_contact_rows(model, step, position, n_active, workspace)
    set_compliance(model, step, position, n_active, workspace)
    status = solve_penetrations(problem, n_active)
    for p in range(n_active):
        c, load = problem.active[p], problem.newton[LOADS_ROW, p]
        m = jacobian.mesh_of[c]
        contact[PENETRATION, c], contact[LOAD, c] = (
            problem.newton[PENETRATIONS_ROW, p],
            load,
        )
        for k in range(jacobian.widths[m]):
            state[CONTACT_FORCE, jacobian.columns[m, k]] -= (
                workspace.force_rows.row[c, k] * load
            )
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
def allocate_workspace(model, position):
    """Working arrays of the steps."""
    modal, jacobian = model.modal, model.jacobian
    count, max_width = jacobian.mesh_of.size, jacobian.columns.shape[1]
    hubs = modal.damping.size
    size = hubs + modal.rigidity.size
    return StepWorkspace(
        np.empty((2, size)),
        np.empty(size),
        np.empty(size),
        np.empty(hubs),
        np.empty((jacobian.widths.size, 2)),
        np.empty(count),
        Row(
            np.empty((count, max_width)),
            np.empty((count, hubs)),
            np.empty((count, max_width)),
        ),
        Row(
            np.empty((count, max_width)),
            np.empty((count, hubs)),
            np.empty((count, max_width)),
        ),
        np.empty((count, hubs)),
        contact_problem(model.contacts, jacobian.mesh_of, position),
    )


@compiled
def integrate(model, step, clock, state, contact, record):
    """Advance by as many steps as there is room to record; (status, steps done).

    model : ModelArrays; state (4, n) and contact (3, c) are advanced in place
    """
    position = new_position(model.contacts)
    workspace = allocate_workspace(model, position)
    return run_steps(model, step, clock, state, contact, record, position, workspace)


@inlined
def run_steps(model, step, clock, state, contact, record, position, workspace):
    """Integrate as `integrate` does, with given working arrays."""
    rate = model.kinematics.rate
    set_position(rate, model.contacts, clock.cycle, clock.start, position)
    steps = record.mesh.shape[0] - 1
    for n in range(steps):
        record_step(model, state, contact, record, n)
        step_number = clock.start + n
        if clock.speed != 0.0:
            advance_teeth(model.modal, model.kinematics, clock, step_number, state)
            set_position(rate, model.contacts, clock.cycle, step_number + 1, position)
        status = advance(model, step, clock.speed, position, state, contact, workspace)
        if status != CONVERGED:
            return UNSOLVED, n
        if not is_bounded(state[Q], state[V], clock.limit):
            return DIVERGED, n
    record_step(model, state, contact, record, steps)
    return FINISHED, steps


@inlined
def advance(model, step, speed, position, state, contact, workspace):
    """Take one step, which ends with the meshes at `position`; return the status."""
    modal, newmark, rhs = model.modal, step.newmark, workspace.rhs
    predict(newmark, state, workspace.predicted)
    assemble_rhs(modal, newmark, state, workspace.predicted, rhs)
    solve_step(modal, step, rhs, workspace.acceleration, workspace.reduced)
    status = find_contact(model, step, speed, position, state, contact, workspace)
    if status != CONVERGED:
        return status
    for i in range(rhs.size):
        rhs[i] = (1.0 - newmark.alpha_f) * state[CONTACT_FORCE, i]
    solve_step(modal, step, rhs, state[A], workspace.reduced)
    for i in range(rhs.size):
        workspace.acceleration[i] += state[A, i]
    correct(newmark, workspace.predicted, workspace.acceleration, state)
    return status
