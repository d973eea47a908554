"""Contact of all meshes at the end of a time step, compiled.

The penetration of contact c, what its law sees, follows from the motion of the gears
without the new contact forces and from those forces F:

    penetration_c + sum_d Q_cd F_d(penetration_d) = free_c

Q holds what moves in the step, the step's own compliance, and the static compliance
that the gears' freedoms do not have. It is the same for all fidelities.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.active_set import eliminate
from fegear.dynamics.kernels.arrays import ContactProblem
from lumped.compiled import allocating, compiled_part, inlined

MOST_ROUNDS = 60
CONVERGED, NOT_CONVERGED = 0, 1
X, LOADS, SLOPES, ERRORS, BEFORE = 0, 1, 2, 3, 4  # rows of Newton's method
EXACT = 1e-11  # of the law's reach, of penetrations
STICKING = 5e-3  # m/s: a slower reversal of sliding does not reverse the friction
NEAR = 0.05  # of the law's reach: contacts so little apart are solved for


@inlined
def law_at(knots, law, penetration):
    """(load [N], its slope [N/m]) of one position's law."""
    cells = law.shape[0]
    if not penetration > 0.0:
        return 0.0 * penetration, 0.0  # NaN stays NaN
    reach = knots[cells]
    cell = min(int(cells * math.sqrt(penetration / reach)), cells - 1)
    x = min(penetration, reach) - knots[cell]
    if x < 0.0:  # rounding of the root
        cell -= 1
        x = penetration - knots[cell]
    c = law[cell]
    load = c[0] + x * (c[1] + x * (c[2] + x * c[3]))
    slope = c[1] + x * (2.0 * c[2] + x * 3.0 * c[3])
    return load + slope * max(penetration - reach, 0.0), slope


@inlined
def load_at(problem, c, penetration):
    """(load [N], slope [N/m]) of contact c, linear between positions of its table."""
    m, side = problem.mesh_of[c], problem.reversed[c]
    place, part = problem.place[m], problem.part[m]
    knots, law = problem.knots[m], problem.law
    load, slope = law_at(knots, law[c, place, side], penetration)
    if part > 0.0:
        later, steeper = law_at(knots, law[c, place + 1, side], penetration)
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
def set_reversed(contacts, rotation, where, reversed_):
    """Whether each contact slides against its nominal direction.

    rotation : (m, 2) speeds of driver and driven, each in its nominal sense [rad/s]
    """
    first, driver_arms, driven_arms = contacts.first, contacts.arms[0], contacts.arms[1]
    for m in range(first.size - 1):
        place, part = where.place[m], where.part[m]
        for c in range(first[m], first[m + 1]):
            slip = rotation[m, 0] * between(driver_arms, c, place, part)
            slip -= rotation[m, 1] * between(driven_arms, c, place, part)
            nominal = between(contacts.sliding, c, place, part)
            reversed_[c] = 1 if contacts.side[c] * slip * nominal > STICKING else 0


@allocating
def contact_problem(contacts, mesh_of, where):
    """The equations for meshes at `where`; what changes in a step is not set yet."""
    count = mesh_of.size
    return ContactProblem(
        *(contacts.knots, contacts.law, where.place, where.part, mesh_of),
        *(np.zeros(count, np.int64), np.empty(count), np.empty(count, np.int64)),
        *(np.empty((count, count)), np.empty((5, count))),
        *(np.empty((count, count)), np.zeros((count, 2))),
    )


@inlined
def set_errors(problem, n):
    """Loads, slopes and errors of the equations at x; the largest error [m]."""
    worst, chosen, Q = 0.0, problem.chosen, problem.Q
    newton, free = problem.newton, problem.free
    for i in range(n):
        newton[LOADS, i], newton[SLOPES, i] = load_at(problem, chosen[i], newton[X, i])
    for i in range(n):
        error = newton[X, i] - free[chosen[i]]
        for j in range(n):
            error += Q[i, j] * newton[LOADS, j]
        newton[ERRORS, i] = error
        if not abs(error) <= worst:
            worst = abs(error)
    return worst


@compiled_part
def solve_penetrations(problem, n):
    """Newton's method with step halving for n penetrations; the status.

    They start from what they are without forces. Rows X and LOADS of `newton` hold
    penetrations and loads at the end.
    """
    newton, matrix, right = problem.newton, problem.matrix, problem.right
    Q, scale = problem.Q, problem.knots[0, -1]
    for i in range(n):
        newton[X, i] = problem.free[problem.chosen[i]]
    error = set_errors(problem, n)
    for _ in range(MOST_ROUNDS):
        if error <= EXACT * scale:
            return CONVERGED
        if not error < math.inf:
            return NOT_CONVERGED
        for i in range(n):
            right[i, 0], newton[BEFORE, i] = newton[ERRORS, i], newton[X, i]
            for j in range(n):
                matrix[i, j] = Q[i, j] * newton[SLOPES, j]
            matrix[i, i] += 1.0
        eliminate(matrix, right, n)
        before, length = error, 1.0
        for _ in range(8):
            for i in range(n):
                newton[X, i] = newton[BEFORE, i] - length * right[i, 0]
            error = set_errors(problem, n)
            if error < before:
                break
            length *= 0.5
    return CONVERGED if error <= 1e3 * EXACT * scale else NOT_CONVERGED
