"""What the steps of whole fields take from the compiled steps."""

from __future__ import annotations

import numpy as np

from fegear.dynamics.kernels.newmark import newmark_correct, newmark_predict
from fegear.dynamics.kernels.reduced import (
    LOAD,
    PENETRATION,
    REVERSED,
    record_step,
)
from lumped.common.compiled import compiled
from lumped.kernels.contact import (
    CONVERGED,
    LOADS_ROW,
    PENETRATIONS_ROW,
    contact_problem,
    find_active,
    new_position,
    set_position,
    set_reversed,
    solve_penetrations,
)

__all__ = [
    "CONVERGED",
    "correct",
    "find_loads",
    "find_position",
    "find_reversed",
    "record",
    "set_balance",
]


@compiled
def find_position(rate, contacts, cycle, number):
    """Find the place of each mesh in its tables at step `number`; see
    `set_position`.
    """
    where = new_position(contacts)
    set_position(rate, contacts, cycle, number, where)
    return where


@compiled
def find_reversed(contacts, rotation, where):
    """Whether each contact (c,) slides against its nominal direction."""
    reversed_ = np.zeros(contacts.side.size, np.int64)
    set_reversed(contacts, rotation, where, reversed_)
    return reversed_


@compiled
def record(model, state, contact, out, n):
    """Record a step, see `record_step`."""
    record_step(model, state, contact, out, n)


@compiled
def set_balance(newmark, damping, ratio, state, x, y):
    """What the new accelerations of a field balance: M x + (M ratio + K) y, (n, k).

    damping : of mass and stiffness, Rayleigh's
    """
    alpha_f, new = newmark.alpha_f, 1.0 - newmark.alpha_f
    for i in range(x.shape[0]):
        for k in range(x.shape[1]):
            u, v, a = state[0, i, k], state[1, i, k], state[2, i, k]
            u_pred, v_pred = newmark_predict(newmark, u, v, a)
            velocity = new * v_pred + alpha_f * v
            push = -(new * u_pred + alpha_f * u + damping[1] * velocity)
            y[i, k] = push
            x[i, k] = -(newmark.alpha_m * a + damping[0] * velocity) - ratio * push


@compiled
def correct(newmark, acceleration, state):
    """Bring a field (4, n, k) to the end of the step with that acceleration."""
    for i in range(acceleration.shape[0]):
        for k in range(acceleration.shape[1]):
            u_pred, v_pred = newmark_predict(
                newmark, state[0, i, k], state[1, i, k], state[2, i, k]
            )
            new = acceleration[i, k]
            state[0, i, k], state[1, i, k] = newmark_correct(
                newmark, u_pred, v_pred, new
            )
            state[2, i, k] = new


@compiled
def find_loads(contacts, mesh_of, Q, free, where, contact):
    """New penetrations and loads of the contact state (3, c); the status.

    Q : (c, c) penetration of the first contact per load on the second [m/N]
    free : (c,) penetrations without loads [m]
    """
    problem = contact_problem(contacts, mesh_of, where)
    for c in range(free.size):
        problem.guess[c] = (
            contact[PENETRATION, c] if contact[LOAD, c] > 0.0 else free[c]
        )
        contact[PENETRATION, c], contact[LOAD, c] = free[c], 0.0
        problem.free[c], problem.friction_reversed[c] = (
            free[c],
            int(contact[REVERSED, c]),
        )
    near = find_active(problem)
    if near == 0:
        return CONVERGED
    for p in range(near):
        for s in range(near):
            problem.Q[p, s] = Q[problem.active[p], problem.active[s]]
    status = solve_penetrations(problem, near)
    for p in range(near):
        c = problem.active[p]
        contact[PENETRATION, c] = problem.newton[PENETRATIONS_ROW, p]
        contact[LOAD, c] = problem.newton[LOADS_ROW, p]
    return status
