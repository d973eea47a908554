"""Implicit steps of hubs and elastic modes, compiled.

body, rows, train and contacts are plain tuples of what `fegear.dynamics.arrays`
describes as Body, Rows, Turning and Contacts.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.dynamics.kernels.contact import (
    CONVERGED,
    NEAR,
    between,
    set_turned,
    solve_squeezes,
)
from lumped.compiled import compiled, compiled_part, inlined
from lumped.kernels.settling import bounded

FINISHED, DIVERGED, UNSOLVED = 0, 1, 2
Q, V, A, PUSH = 0, 1, 2, 3  # rows of a state: motion and generalised contact force
SQUEEZE, LOAD, TURNED = 0, 1, 2  # rows of a touch
DEFLECTION, RATE, FORCE, DRIVE, BACK = 0, 1, 2, 3, 4  # recorded of every mesh
ON_GRID = 1e-6  # of a cell within which a position is on the grid


def step_factors(body, weights):
    """(inverse elastic diagonal (e,), inverse hub matrix (h, h)) of the step's matrix.

    weights : of mass, damping and stiffness
    Not compiled: it is called once a speed.
    """
    stiffness, damping, _, rigidity, elastic_damping, turning, coupling, owner = body[
        :8
    ]
    wm, wc, wk = weights
    inverse = 1.0 / (wm + wc * elastic_damping + wk * rigidity)
    carried, turns = (wm * coupling) ** 2 * inverse, turning[owner]
    matrix = wk * stiffness + np.diag(wm + wc * damping)
    matrix -= turns.T @ (carried[:, None] * turns)
    return inverse, np.linalg.inv(matrix)


@inlined
def mass_times(body, x, out):
    turning, coupling, owner = body[5], body[6], body[7]
    hubs = turning.shape[1]
    for i in range(x.size):
        out[i] = x[i]
    for i in range(coupling.size):
        if coupling[i] != 0.0:
            for a in range(hubs):
                both = coupling[i] * turning[owner[i], a]
                out[a] += both * x[hubs + i]
                out[hubs + i] += both * x[a]


@inlined
def solve_step(body, mass_weight, factors, right, out):
    """Solve with the step's matrix by elimination of the elastic modes."""
    turning, coupling, owner = body[5], body[6], body[7]
    inverse, hub_inverse = factors
    hubs = turning.shape[1]
    reduced = right[:hubs].copy()
    for i in range(coupling.size):
        out[hubs + i] = inverse[i] * right[hubs + i]
        if coupling[i] != 0.0:
            carried = mass_weight * coupling[i] * out[hubs + i]
            for a in range(hubs):
                reduced[a] -= carried * turning[owner[i], a]
    for a in range(hubs):
        out[a] = 0.0
        for b in range(hubs):
            out[a] += hub_inverse[a, b] * reduced[b]
    for i in range(coupling.size):
        if coupling[i] != 0.0:
            turn = 0.0
            for a in range(hubs):
                turn += turning[owner[i], a] * out[a]
            out[hubs + i] -= inverse[i] * mass_weight * coupling[i] * turn


@inlined
def predict(newmark, state, ahead):
    """Displacement and velocity (2, n) at the end of a step without acceleration."""
    h, _, _, gamma, beta = newmark
    for i in range(state.shape[1]):
        ahead[0, i] = state[Q, i] + h * state[V, i]
        ahead[0, i] += h * h * (0.5 - beta) * state[A, i]
        ahead[1, i] = state[V, i] + h * (1.0 - gamma) * state[A, i]


@inlined
def set_balance(body, newmark, state, ahead, right):
    """What the new accelerations have to balance besides new contact forces (n,)."""
    stiffness, damping, load, rigidity, elastic_damping = body[:5]
    _, am, af, _, _ = newmark
    hubs = damping.size
    mass_times(body, state[A], right)
    for i in range(right.size):
        right[i] = af * state[PUSH, i] - am * right[i]
        speed = (1.0 - af) * ahead[1, i] + af * state[V, i]
        if i < hubs:
            right[i] += load[i] - damping[i] * speed
            for j in range(hubs):
                place = (1.0 - af) * ahead[0, j] + af * state[Q, j]
                right[i] -= stiffness[i, j] * place
        else:
            place = (1.0 - af) * ahead[0, i] + af * state[Q, i]
            right[i] -= elastic_damping[i - hubs] * speed + rigidity[i - hubs] * place


@inlined
def accelerate(newmark, ahead, acceleration, state):
    h, _, _, gamma, beta = newmark
    for i in range(acceleration.size):
        state[A, i] = acceleration[i]
        state[Q, i] = ahead[0, i] + beta * h * h * acceleration[i]
        state[V, i] = ahead[1, i] + gamma * h * acceleration[i]


@compiled_part
def pass_teeth(body, train, steps, before, state):
    """Count the teeth of those gears anew that pass one in the coming step."""
    rate, first_mesh = train[0], train[2]
    for g in range(first_mesh.size):
        m = first_mesh[g]
        cycles = math.floor(rate[m] * (before + 1) / steps + 1e-9)
        if cycles > math.floor(rate[m] * before / steps + 1e-9):
            count_anew(body, g, state)


@compiled_part
def count_anew(body, gear, state):
    """The elastic coordinates of a gear when its next tooth becomes the first."""
    hubs = body[5].shape[1]
    owner, partner, cosine, sine = body[7], body[8], body[9], body[10]
    for i in range(owner.size):
        j = partner[i]
        if owner[i] != gear or j < i:
            continue
        for k in range(state.shape[0]):
            one, two = state[k, hubs + i], state[k, hubs + j]
            state[k, hubs + i] = cosine[i] * one + sine[i] * two
            if j != i:
                state[k, hubs + j] = cosine[j] * two + sine[j] * one


@compiled_part
def set_places(rate, steps, number, positions, place, part):
    """Where each mesh stands in its tables: a grid point and the part beyond it."""
    for m in range(rate.size):
        cycles = rate[m] * number / steps
        at = max(cycles - math.floor(cycles + 1e-9), 0.0) * positions
        place[m] = min(int(at + ON_GRID), positions - 1)
        part[m] = at - place[m]
        if abs(part[m]) < ON_GRID:
            part[m] = 0.0


@compiled_part
def set_gaps(contacts, rate, steps, number, cycle, gap):
    """Gaps (c, p + 1) with the pitch errors of the cycle in which each mesh is.

    cycle : (m,) of which the gaps are, and will be
    """
    first, errors = contacts[0], contacts[9]
    for m in range(rate.size):
        now = math.floor(rate[m] * number / steps + 1e-9)
        if now == cycle[m]:
            continue
        cycle[m] = now
        for c in range(first[m], first[m + 1]):
            error = errors[c, now % errors.shape[1]]
            for p in range(gap.shape[1]):
                gap[c, p] = contacts[2][c, p] + error


@compiled_part
def set_rotation(train, body, speed, ahead, rotation):
    """Speeds (m, 2) of the gears of each mesh in their nominal sense [rad/s]."""
    gears, nominal, turning = train[1], train[3], body[5]
    for m in range(gears.shape[0]):
        for k in range(2):
            g = gears[m, k]
            turn = speed * nominal[g]
            for i in range(turning.shape[1]):
                turn += turning[g, i] * ahead[1, i]
            rotation[m, k] = turn * np.sign(nominal[g])


@inlined
def set_row(values, width, c, place, part, out):
    """Entries (width,) of a contact's closing or rootward row at a position."""
    for k in range(width):
        out[k] = values[c, place, k]
        if part > 0.0:
            out[k] += part * (values[c, place + 1, k] - out[k])


@inlined
def lift(body, mass_weight, inverse, columns, row, onto_hubs, elastic):
    """A row's elastic entries times their inverse, and what is left on the hubs."""
    turning, coupling, owner = body[5], body[6], body[7]
    hubs = turning.shape[1]
    for a in range(hubs):
        onto_hubs[a] = row[a]
    for k in range(hubs, columns.size):
        i = columns[k] - hubs
        elastic[k] = inverse[i] * row[k]
        if coupling[i] != 0.0:
            carried = mass_weight * coupling[i] * elastic[k]
            for a in range(hubs):
                onto_hubs[a] -= carried * turning[owner[i], a]


@inlined
def step_compliance(rows, mesh_of, hubs, closing, onto, moved, elastic, c, d):
    """Closing of contact c under minus the inverse step's matrix times force on d.

    onto : what row c leaves on the hubs; moved : what force d moves of them
    """
    total = 0.0
    for a in range(hubs):
        total += onto[c, a] * moved[d, a]
    one, two = mesh_of[c], mesh_of[d]
    if one == two:
        for k in range(hubs, rows[0][one]):
            total += closing[c, k] * elastic[d, k]
        return total
    if not rows[6][one, two]:
        return total
    i, j = hubs, hubs  # columns increase, those of a common gear stand in both
    while i < rows[0][one] and j < rows[0][two]:
        if rows[1][one, i] == rows[1][two, j]:
            total += closing[c, i] * elastic[d, j]
            i += 1
            j += 1
        elif rows[1][one, i] < rows[1][two, j]:
            i += 1
        else:
            j += 1
    return total


@inlined
def remaining(contacts, linked, mesh_of, drag, place, part, c, d):
    """Static compliance between contacts that the coordinates do not have [m/N]."""
    m = mesh_of[c]  # meshes of a common gear are in step
    if not linked[m, mesh_of[d]]:
        return 0.0
    at, share, normal, tangential = place[m], part[m], contacts[7], contacts[8]
    value = normal[at, c, d]
    if share > 0.0:
        value += share * (normal[at + 1, c, d] - value)
    if drag[d] != 0.0:
        aside = tangential[at, c, d]
        if share > 0.0:
            aside += share * (tangential[at + 1, c, d] - aside)
        value += drag[d] * aside
    return value


@compiled_part
def touch_anew(
    body, rows, train, contacts, newmark, mass_weight, factors, speed,
    place, part, ahead, acceleration, state, touch,
):  # fmt: skip
    """New contact forces: touch (3, c) and the generalised force of the state.

    acceleration : (n,) at the end of the step without them
    """
    count, columns, mesh_of, friction = rows[0], rows[1], rows[4], rows[5][()]
    side, gap, sliding, knots = contacts[1], contacts[2], contacts[3], contacts[5]
    contacts_all, wide, hubs = side.size, columns.shape[1], body[5].shape[1]
    beta, late = newmark[4] * newmark[0] ** 2, 1.0 - newmark[2]
    turned, drag = np.zeros(contacts_all, np.int64), np.zeros(contacts_all)
    if friction > 0.0:
        rotation = np.empty((count.size, 2))
        set_rotation(train, body, speed, ahead, rotation)
        set_turned(contacts, rotation, place, part, turned)
    chosen = np.empty(contacts_all, np.int64)
    closing = np.empty((contacts_all, wide))
    free = np.empty(contacts_all)
    near = 0
    for c in range(contacts_all):
        m = mesh_of[c]
        free[c] = -between(gap, c, place[m], part[m])
        set_row(rows[2], count[m], c, place[m], part[m], closing[c])
        for k in range(count[m]):
            i = columns[m, k]
            free[c] += closing[c, k] * (ahead[0, i] + beta * acceleration[i])
        touch[SQUEEZE, c], touch[LOAD, c], touch[TURNED, c] = free[c], 0.0, turned[c]
        if not free[c] < -NEAR * knots[m, -1]:
            chosen[near] = c
            near += 1
    for i in range(state.shape[1]):
        state[PUSH, i] = 0.0
    if near == 0:
        return CONVERGED
    chosen = chosen[:near]
    pushing = np.empty((contacts_all, wide))
    onto, moved = np.empty((2, contacts_all, hubs)), np.empty((contacts_all, hubs))
    elastic = np.empty((contacts_all, wide))
    for c in chosen:
        m = mesh_of[c]
        width = columns[m, : count[m]]
        lift(body, mass_weight, factors[0], width, closing[c], onto[0, c], elastic[c])
        if friction > 0.0:
            drag[c] = friction * between(sliding, c, place[m], part[m])
            if turned[c] == 1:
                drag[c] = -drag[c]
            set_row(rows[3], count[m], c, place[m], part[m], pushing[c])
        for k in range(count[m]):
            if drag[c] != 0.0:
                pushing[c, k] = closing[c, k] + drag[c] * pushing[c, k]
            else:
                pushing[c, k] = closing[c, k]
        lift(body, mass_weight, factors[0], width, pushing[c], onto[1, c], elastic[c])
        for a in range(hubs):
            moved[c, a] = 0.0
            for b in range(hubs):
                moved[c, a] += factors[1][a, b] * onto[1, c, b]
    Q = np.empty((near, near))
    x, newton = np.empty(near), np.empty((3, near))
    for p in range(near):
        x[p] = free[chosen[p]]
        for s in range(near):
            c, d = chosen[p], chosen[s]
            Q[p, s] = beta * late * step_compliance(
                rows, mesh_of, hubs, closing, onto[0], moved, elastic, c, d
            ) + remaining(contacts, rows[6], mesh_of, drag, place, part, c, d)
    status, _ = solve_squeezes(
        contacts, mesh_of, chosen, Q, free, place, part, turned, knots[0, -1],
        x, newton,
    )  # fmt: skip
    for p in range(near):
        c = chosen[p]
        touch[SQUEEZE, c], touch[LOAD, c] = x[p], newton[0, p]
        for k in range(count[mesh_of[c]]):
            i = columns[mesh_of[c], k]
            state[PUSH, i] -= pushing[c, k] * newton[0, p]
    return status


@compiled_part
def note(train, contacts, state, touch, out):
    """What is recorded of every mesh (5, m)."""
    deflection, first, side = train[4], contacts[0], contacts[1]
    for m in range(first.size - 1):
        out[DEFLECTION, m], out[RATE, m], out[FORCE, m] = 0.0, 0.0, 0.0
        out[DRIVE, m], out[BACK, m] = -math.inf, -math.inf
        for i in range(deflection.shape[1]):
            out[DEFLECTION, m] += deflection[m, i] * state[Q, i]
            out[RATE, m] += deflection[m, i] * state[V, i]
        for c in range(first[m], first[m + 1]):
            out[FORCE, m] += side[c] * touch[LOAD, c]
            kind = DRIVE if side[c] > 0.0 else BACK
            out[kind, m] = max(out[kind, m], touch[SQUEEZE, c])


@compiled_part
def record(train, contacts, state, touch, out, loads, hub):
    """What is kept of a step: meshes (5, m), loads (c,), hub coordinates (2, h)."""
    note(train, contacts, state, touch, out)
    for c in range(loads.size):
        loads[c] = touch[LOAD, c]
    for k in range(2):
        for a in range(hub.shape[1]):
            hub[k, a] = state[k, a]


@compiled
def march(
    body, rows, train, contacts, newmark, weights, factors, speed, limit, steps, start,
    state, touch, out, loads, hub,
):  # fmt: skip
    """Advance by as many steps as there is room to record; (status, steps done).

    newmark : (step [s], am, af, gamma, beta); weights : of mass, damping, stiffness
    factors : from `step_factors`
    speed : 2 pi times the first mesh's frequency, or 0 for gears that stand still
    limit : sum of velocities beyond which a run has diverged
    steps : of a cycle of the first mesh; start : of them since the clock began
    state, touch : advanced in place
    out : (k + 1, 5, m), loads : (k + 1, c), hub : (k + 1, 2, h)
    """
    rate, meshes = train[0], train[0].size
    positions = contacts[2].shape[1] - 1
    place, part = np.zeros(meshes, np.int64), np.zeros(meshes)
    set_places(rate, steps, start, positions, place, part)
    differ, cycle = contacts[9].shape[1] > 0, np.full(meshes, -1)
    gap = contacts[2].copy() if differ else contacts[2]
    present = (contacts[0], contacts[1], gap, *contacts[3:9])
    if differ:
        set_gaps(contacts, rate, steps, start, cycle, gap)
    ahead = np.empty((2, state.shape[1]))
    right, acceleration = np.empty(state.shape[1]), np.empty(state.shape[1])
    moving = speed != 0.0
    record(train, present, state, touch, out[0], loads[0], hub[0])
    for n in range(out.shape[0] - 1):
        if moving:
            pass_teeth(body, train, steps, start + n, state)
            set_places(rate, steps, start + n + 1, positions, place, part)
            if differ:
                set_gaps(contacts, rate, steps, start + n + 1, cycle, gap)
        predict(newmark, state, ahead)
        set_balance(body, newmark, state, ahead, right)
        solve_step(body, weights[0], factors, right, acceleration)
        status = touch_anew(
            body, rows, train, present, newmark, weights[0], factors, speed,
            place, part, ahead, acceleration, state, touch,
        )  # fmt: skip
        if status != CONVERGED:
            return UNSOLVED, n
        for i in range(right.size):
            right[i] = (1.0 - newmark[2]) * state[PUSH, i]
        solve_step(body, weights[0], factors, right, state[A])
        for i in range(right.size):
            acceleration[i] += state[A, i]
        accelerate(newmark, ahead, acceleration, state)
        if not bounded(state[Q], state[V], limit):
            return DIVERGED, n
        record(train, present, state, touch, out[n + 1], loads[n + 1], hub[n + 1])
    return FINISHED, out.shape[0] - 1
