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
    "assemble_rhs",
    "correct",
    "find_loads",
    "find_position",
    "find_reversed",
    "record",
]


@compiled
def find_position(rate, contacts, cycle, step_number):
    """Position of each mesh in its tables at a step; see `set_position`."""
    position = new_position(contacts)
    set_position(rate, contacts, cycle, step_number, position)
    return position


@compiled
def find_reversed(contacts, rotation, position):
    """Whether each contact (c,) slides against its nominal direction."""
    reversed_ = np.zeros(contacts.side.size, np.int64)
    set_reversed(contacts, rotation, position, reversed_)
    return reversed_


@compiled
def record(model, state, contact, out, n):
    """Record a step, see `record_step`."""
    record_step(model, state, contact, out, n)


@compiled
def assemble_rhs(newmark, damping, ratio, state, x, y):
    """Right-hand side of a field's step, M x + (M ratio + K) y.

    damping : of mass and stiffness, Rayleigh's
    x : sector array of `fegear.elasticity.cyclic_gear`; y : (unknowns, teeth)
    """
    alpha_f, weight_new = newmark.alpha_f, 1.0 - newmark.alpha_f
    unknowns, teeth = y.shape
    for i in range(unknowns):
        for k in range(teeth):
            u, v, a = state[0, i, k], state[1, i, k], state[2, i, k]
            u_pred, v_pred = newmark_predict(newmark, u, v, a)
            velocity = weight_new * v_pred + alpha_f * v
            elastic_force = -(weight_new * u_pred + alpha_f * u + damping[1] * velocity)
            y[i, k] = elastic_force
            x[i, k] = (
                -(newmark.alpha_m * a + damping[0] * velocity) - ratio * elastic_force
            )
    cut = x.shape[0] - unknowns
    for i in range(unknowns, x.shape[0]):  # right cuts are the next left ones
        for k in range(teeth):
            x[i, k] = x[i - cut, (k + 1) % teeth]


@compiled
def correct(newmark, acceleration, elastic, stiffness, turn, state):
    """Bring a field (4, n, k) to the end of the step.

    Its acceleration there is acceleration + elastic / stiffness + turn.

    acceleration : sector array; elastic : (n, k); turn : (n,)
    """
    for i in range(elastic.shape[0]):
        for k in range(elastic.shape[1]):
            new_acceleration = acceleration[i, k] + elastic[i, k] / stiffness + turn[i]
            u_pred, v_pred = newmark_predict(
                newmark, state[0, i, k], state[1, i, k], state[2, i, k]
            )
            state[0, i, k], state[1, i, k] = newmark_correct(
                newmark, u_pred, v_pred, new_acceleration
            )
            state[2, i, k] = new_acceleration


@compiled
def find_loads(contacts, mesh_of, Q, free, position, contact):
    """New penetrations and loads of the contact state (3, c); the status.

    Q : (c, c) penetration of the first contact per load on the second [m/N]
    free : (c,) penetrations without loads [m]
    """
    problem = contact_problem(contacts, mesh_of, position)
    for c in range(free.size):
        problem.guess[c] = (
            contact[PENETRATION, c] if contact[LOAD, c] > 0.0 else free[c]
        )
        contact[PENETRATION, c], contact[LOAD, c] = free[c], 0.0
        problem.free[c], problem.friction_reversed[c] = (
            free[c],
            int(contact[REVERSED, c]),
        )
    n_active = find_active(problem)
    if n_active == 0:
        return CONVERGED
    for p in range(n_active):
        for s in range(n_active):
            problem.Q[p, s] = Q[problem.active[p], problem.active[s]]
    status = solve_penetrations(problem, n_active)
    for p in range(n_active):
        c = problem.active[p]
        contact[PENETRATION, c] = problem.newton[PENETRATIONS_ROW, p]
        contact[LOAD, c] = problem.newton[LOADS_ROW, p]
    return status
