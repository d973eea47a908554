"""What the steps of whole fields take from the compiled steps."""

from __future__ import annotations

import numpy as np

from fegear.dynamics.kernels.contact import (
    CONVERGED,
    NEAR,
    set_turned,
    solve_squeezes,
)
from fegear.dynamics.kernels.reduced import LOAD, SQUEEZE, note, set_places
from lumped.compiled import compiled

__all__ = [
    "CONVERGED",
    "correct",
    "find_loads",
    "find_places",
    "record",
    "set_balance",
    "turn_friction",
]


@compiled
def find_places(rate, steps, number, positions, place, part):
    """Where each mesh stands in its tables: a grid point and the part beyond it."""
    set_places(rate, steps, number, positions, place, part)


@compiled
def turn_friction(contacts, rotation, place, part, turned):
    """Whether each contact slides against its nominal direction."""
    set_turned(contacts, rotation, place, part, turned)


@compiled
def record(train, contacts, state, touch, out):
    """What is recorded of every mesh (5, m)."""
    note(train, contacts, state, touch, out)


@compiled
def set_balance(newmark, damping, ratio, state, x, y):
    """What the new accelerations of a field balance: M x + (M ratio + K) y, (n, k).

    newmark : (step [s], am, af, gamma, beta)
    damping : of mass and stiffness, Rayleigh's
    """
    h, am, af, gamma, beta = newmark
    for i in range(x.shape[0]):
        for k in range(x.shape[1]):
            q, v, a = state[0, i, k], state[1, i, k], state[2, i, k]
            ahead = q + h * v + h * h * (0.5 - beta) * a
            rate = v + (1.0 - af) * h * (1.0 - gamma) * a
            push = -((1.0 - af) * ahead + af * q + damping[1] * rate)
            y[i, k] = push
            x[i, k] = -(am * a + damping[0] * rate) - ratio * push


@compiled
def correct(newmark, acceleration, state):
    """Bring a field (4, n, k) to the end of the step with that acceleration."""
    h, _, _, gamma, beta = newmark
    for i in range(acceleration.shape[0]):
        for k in range(acceleration.shape[1]):
            old, new = state[2, i, k], acceleration[i, k]
            v = state[1, i, k]
            state[0, i, k] += h * v + h * h * ((0.5 - beta) * old + beta * new)
            state[1, i, k] = v + h * ((1.0 - gamma) * old + gamma * new)
            state[2, i, k] = new


@compiled
def find_loads(contacts, mesh_of, Q, free, place, part, touch):
    """New squeezes and loads of the touch (3, c); the status.

    Q : (c, c) squeeze of the first contact per load on the second [m/N]
    free : (c,) squeezes without loads [m]
    """
    reach = contacts[5][0, -1]
    touch[SQUEEZE] = free
    touch[LOAD] = 0.0
    chosen = np.flatnonzero(~(free < -NEAR * reach))
    if chosen.size == 0:
        return CONVERGED
    x, work = free[chosen].copy(), np.empty((3, chosen.size))
    matrix = np.empty((chosen.size, chosen.size))
    for p in range(chosen.size):
        for s in range(chosen.size):
            matrix[p, s] = Q[chosen[p], chosen[s]]
    turned = touch[2].astype(np.int64)
    status, _ = solve_squeezes(
        contacts,
        mesh_of,
        chosen,
        matrix,
        free,
        place,
        part,
        turned,
        reach,
        x,
        work,
    )
    for p in range(chosen.size):
        touch[SQUEEZE, chosen[p]], touch[LOAD, chosen[p]] = x[p], work[0, p]
    return status
