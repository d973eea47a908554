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

from lumped.common.compiled import allocating, compiled_part, inlined
from lumped.kernels.arrays import PenetrationProblem, Position
from lumped.kernels.elimination import eliminate

MAX_ITERATIONS = 60
CONVERGED, NOT_CONVERGED = 0, 1
X, LOADS, SLOPES, ERRORS, BEFORE, STEP = range(6)  # rows of Newton's method
ON_GRID = 1e-6  # of a cell within which a position is on the grid
LAST = 1e-7  # of the law's reach: a step after which no other is needed,
SMALL = 2e-6  # or of the penetration: what is left is of the order of its square
PENETRATION_RTOL = 1e-11  # of the law's reach, of penetrations
STICKING = 5e-3  # m/s: a slower reversal of sliding does not reverse the friction
PROXIMITY = 0.05  # of the law's reach: contacts so little apart are solved for


@inlined
def load_at(problem, c, penetration):
    """(load [N], slope [N/m]) of contact c, linear between positions of its table."""
    if not penetration > 0.0:
        return 0.0 * penetration, 0.0  # NaN stays NaN
    m, side, cell = problem.mesh_of[c], problem.reversed[c], problem.cell[c]
    knots, law, cells = problem.knots, problem.load_curve, problem.knots.shape[1] - 1
    reach, place, part = knots[m, cells], problem.place[m], problem.part[m]
    while cell < cells - 1 and penetration >= knots[m, cell + 1]:
        cell += 1
    while penetration < knots[m, cell]:
        cell -= 1
    problem.cell[c] = cell
    x = min(penetration, reach) - knots[m, cell]
    load, slope = 0.0, 0.0
    for power in range(3, -1, -1):
        coefficient = law[c, place, side, cell, power]
        if part > 0.0:
            later = law[c, place + 1, side, cell, power]
            coefficient += part * (later - coefficient)
        slope = slope * x + load
        load = load * x + coefficient
    return load + slope * max(penetration - reach, 0.0), slope


@inlined
def between(values, c, place, part):
    """Interpolated values of contact c (c, p + 1), without a view of its row: views
    cost more.
    """
    value = values[c, place]
    if part > 0.0:
        value += part * (values[c, place + 1] - value)
    return value


@inlined
def set_position(rate, contacts, cycle, number, where):
    """Bring the meshes to step `number`, with `cycle` steps of the first mesh's."""
    positions, errors = contacts.gap.shape[1] - 1, contacts.errors
    for m in range(rate.size):
        cycles = rate[m] * number / cycle
        now = math.floor(cycles + 1e-9)
        at = max(cycles - now, 0.0) * positions
        where.place[m] = min(int(at + ON_GRID), positions - 1)
        where.part[m] = at - where.place[m]
        if abs(where.part[m]) < ON_GRID:
            where.part[m] = 0.0
        if errors.shape[1] == 0 or now == where.cycle[m]:
            continue
        where.cycle[m] = now
        for c in range(contacts.first[m], contacts.first[m + 1]):
            error = errors[c, now % errors.shape[1]]
            for p in range(positions + 1):
                where.gap[c, p] = contacts.gap[c, p] + error


@allocating
def start_position(contacts):
    """Room for the position of the meshes; gaps change with pitch errors only."""
    meshes = contacts.first.size - 1
    gap = contacts.gap.copy() if contacts.errors.shape[1] > 0 else contacts.gap
    return Position(
        np.zeros(meshes, np.int64), np.zeros(meshes), np.full(meshes, -1), gap
    )


@inlined
def set_row(values, width, c, place, part, out):
    """Entries (width,) of contact c's row at a position."""
    for k in range(width):
        out[k] = values[c, place, k]
        if part > 0.0:
            out[k] += part * (values[c, place + 1, k] - out[k])


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
    return PenetrationProblem(
        *(contacts.knots, contacts.load_curve, where.place, where.part, mesh_of),
        *(np.zeros(count, np.int64), np.empty(count), np.zeros(count)),
        *(np.zeros(count, np.int64), np.empty(count, np.int64)),
        *(np.empty((count, count)), np.empty((6, count)), np.empty(count, np.int64)),
        np.empty((count, count + 1)),
    )


@inlined
def may_touch(problem, c, penetration):
    """Whether a contact touches or is so little apart that it may; so does NaN."""
    return not penetration < -PROXIMITY * problem.knots[problem.mesh_of[c], -1]


@inlined
def find_near(problem):
    """Number of contacts that may touch: `chosen`."""
    near = 0
    for c in range(problem.free.size):
        if may_touch(problem, c, problem.free[c]):
            problem.chosen[near] = c
            near += 1
    return near


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


@inlined
def set_newton_step(problem, n):
    """Newton's step of n penetrations by those that are loaded; whether it is small."""
    newton, matrix, Q = problem.newton, problem.matrix, problem.Q
    loaded, count = problem.loaded, 0
    for i in range(n):
        if newton[SLOPES, i] > 0.0:
            loaded[count] = i
            count += 1
    for a in range(count):
        i = loaded[a]
        matrix[a, count] = newton[ERRORS, i]
        for b in range(count):
            matrix[a, b] = Q[i, loaded[b]] * newton[SLOPES, loaded[b]]
        matrix[a, a] += 1.0
    eliminate(matrix, count, count + 1)
    small, least = True, LAST * problem.knots[0, -1]
    curved = SMALL * problem.knots[0, -1]
    for a in range(count):
        newton[STEP, loaded[a]] = matrix[a, count]
    for i in range(n):
        step = newton[STEP, i]
        if not newton[SLOPES, i] > 0.0:
            step = newton[ERRORS, i]
            for b in range(count):
                slope = newton[SLOPES, loaded[b]]
                step -= Q[i, loaded[b]] * slope * matrix[b, count]
        newton[STEP, i] = step
        depth = abs(newton[X, i])
        small &= abs(step) <= least or step * step <= depth * min(curved, 0.25 * depth)
    return small


@compiled_part
def solve_penetrations(problem, n):
    """Newton's method with step halving for n penetrations; the status.

    It goes out from `start`. Rows X and LOADS of `newton` hold penetrations and loads
    at the end.
    """
    newton, scale = problem.newton, problem.knots[0, -1]
    for i in range(n):
        newton[X, i] = problem.start[problem.chosen[i]]
    error = set_errors(problem, n)
    for _ in range(MAX_ITERATIONS):
        if error <= PENETRATION_RTOL * scale:
            return CONVERGED
        if not error < math.inf:
            return NOT_CONVERGED
        if set_newton_step(problem, n):
            for i in range(n):
                newton[X, i] -= newton[STEP, i]
                newton[LOADS, i] -= newton[SLOPES, i] * newton[STEP, i]
            return CONVERGED
        before, length = error, 1.0
        for i in range(n):
            newton[BEFORE, i] = newton[X, i]
        for _ in range(8):
            for i in range(n):
                newton[X, i] = newton[BEFORE, i] - length * newton[STEP, i]
            error = set_errors(problem, n)
            if error < before:
                break
            length *= 0.5
    return CONVERGED if error <= 1e3 * PENETRATION_RTOL * scale else NOT_CONVERGED
