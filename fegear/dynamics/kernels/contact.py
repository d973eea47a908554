"""Contact of all meshes at the end of a time step, compiled.

The squeeze of contact c, what its law sees, follows from the motion of the gears
without the new contact forces and from those forces F:

    squeeze_c + sum_d Q_cd F_d(squeeze_d) = free_c

Q holds what moves in the step, the step's own compliance, and the static compliance
that the gears' freedoms do not have. It is the same for all fidelities.

contacts is a plain tuple of what `fegear.dynamics.arrays` describes as Contacts.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.active_set import eliminate
from lumped.compiled import compiled_part, inlined

MOST_ROUNDS = 60
CONVERGED, NOT_CONVERGED = 0, 1
EXACT = 1e-11  # of the law's reach, of squeezes
STICKING = 5e-3  # m/s: a slower reversal of sliding does not turn the friction
NEAR = 0.05  # of the law's reach: contacts so little apart are solved for


@inlined
def law_at(knots, law, squeeze):
    """(load [N], its slope [N/m]) of one position's law."""
    cells = law.shape[0]
    if not squeeze > 0.0:
        return 0.0 * squeeze, 0.0  # NaN stays NaN
    reach = knots[cells]
    cell = min(int(cells * math.sqrt(squeeze / reach)), cells - 1)
    x = min(squeeze, reach) - knots[cell]
    if x < 0.0:  # rounding of the root
        cell -= 1
        x = squeeze - knots[cell]
    c = law[cell]
    load = c[0] + x * (c[1] + x * (c[2] + x * c[3]))
    slope = c[1] + x * (2.0 * c[2] + x * 3.0 * c[3])
    return load + slope * max(squeeze - reach, 0.0), slope


@inlined
def load_at(contacts, mesh, c, place, part, turned, squeeze):
    """(load, slope) between position `place` and the next one, `part` of the way."""
    knots, law = contacts[5][mesh], contacts[6]
    load, slope = law_at(knots, law[c, place, turned], squeeze)
    if part > 0.0:
        later, steeper = law_at(knots, law[c, place + 1, turned], squeeze)
        load += part * (later - load)
        slope += part * (steeper - slope)
    return load, slope


@inlined
def between(values, c, place, part):
    """Of contact c (c, p + 1), without a view of its row: views cost more."""
    value = values[c, place]
    if part > 0.0:
        value += part * (values[c, place + 1] - value)
    return value


@compiled_part
def set_turned(contacts, rotation, place, part, turned):
    """Whether each contact slides against its nominal direction.

    rotation : (m, 2) speeds of driver and driven, each in its nominal sense [rad/s]
    """
    first, side, _, sliding, arms = contacts[:5]
    for m in range(first.size - 1):
        for c in range(first[m], first[m + 1]):
            one = between(arms[0], c, place[m], part[m])
            two = between(arms[1], c, place[m], part[m])
            slip = rotation[m, 0] * one - rotation[m, 1] * two
            nominal = between(sliding, c, place[m], part[m])
            turned[c] = 1 if side[c] * slip * nominal > STICKING else 0


@inlined
def residual(contacts, mesh_of, chosen, Q, free, place, part, turned, x, work):
    """Largest error of the equations [m]; work gets loads, slopes and errors."""
    worst = 0.0
    for i in range(chosen.size):
        c = chosen[i]
        m = mesh_of[c]
        load, slope = load_at(contacts, m, c, place[m], part[m], turned[c], x[i])
        work[0, i] = load
        work[1, i] = slope
    for i in range(chosen.size):
        error = x[i] - free[chosen[i]]
        for j in range(chosen.size):
            error += Q[i, j] * work[0, j]
        work[2, i] = error
        if not abs(error) <= worst:
            worst = abs(error)
    return worst


@compiled_part
def solve_squeezes(
    contacts, mesh_of, chosen, Q, free, place, part, turned, scale, x, work
):
    """Newton's method for the squeezes x of the chosen contacts; (status, rounds).

    x : start on entry; work : (3, n), row 0 holds the loads at the end
    """
    n = chosen.size
    matrix, right = np.empty((n, n)), np.zeros((n, 2))
    old = np.empty(n)
    error = residual(contacts, mesh_of, chosen, Q, free, place, part, turned, x, work)
    for rounds in range(MOST_ROUNDS):
        if error <= EXACT * scale:
            return CONVERGED, rounds
        if not error < math.inf:
            return NOT_CONVERGED, rounds
        for i in range(n):
            right[i, 0] = work[2, i]
            old[i] = x[i]
            for j in range(n):
                matrix[i, j] = Q[i, j] * work[1, j]
            matrix[i, i] += 1.0
        eliminate(matrix, right)
        before, length = error, 1.0
        for _ in range(8):
            for i in range(n):
                x[i] = old[i] - length * right[i, 0]
            error = residual(
                contacts, mesh_of, chosen, Q, free, place, part, turned, x, work
            )
            if error < before:
                break
            length *= 0.5
    if error <= 1e3 * EXACT * scale:
        return CONVERGED, MOST_ROUNDS
    return NOT_CONVERGED, MOST_ROUNDS
