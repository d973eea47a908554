"""Contact of all meshes at the end of a time step, compiled.

The penetration of contact c follows from the motion of the gears without the new
contact forces and from those forces F:

    penetration_c + sum_d Q_cd F_d(penetration_d) = free_c

Q holds what moves in the step, the step's own compliance, and the static compliance
that the gears' coordinates do not have. It is the same for all fidelities.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import allocating, compiled_part, inlined
from lumped.kernels.arrays import PenetrationProblem, Position
from lumped.kernels.elimination import eliminate

MAX_NEWTON_ITERATIONS = 60
CONVERGED, NOT_CONVERGED = 0, 1
PENETRATIONS_ROW, LOADS_ROW, SLOPES_ROW, ERRORS_ROW, PREVIOUS_ROW, STEP_ROW = range(
    6
)  # rows of Newton's method
GRID_TOL = 1e-6  # of a cell within which a position is on the grid
# A step below this part of the largest penetration is the last
LAST_STEP_RTOL = 1e-7
# So is one below this part of the penetration: the error is of order its square
QUADRATIC_STEP_RTOL = 2e-6
PENETRATION_RTOL = 1e-11  # of the largest penetration
# A reversal of sliding slower than this [m/s] does not reverse the friction
MIN_REVERSING_SPEED = 5e-3
PROXIMITY_RTOL = 0.05  # of the largest penetration: gap below which contacts are active


@inlined
def load_at(problem, c, penetration):
    """(load [N], slope [N/m]) of contact c, linear between positions of its table."""
    if not penetration > 0.0:
        return 0.0 * penetration, 0.0  # NaN stays NaN
    m, side, cell = problem.mesh_of[c], problem.friction_reversed[c], problem.cell[c]
    knots, load_curve, cells = (
        problem.knots,
        problem.load_curve,
        problem.knots.shape[1] - 1,
    )
    max_penetration, index, fraction = (
        knots[m, cells],
        problem.grid_index[m],
        problem.fraction[m],
    )
    row = problem.curve[c]
    while cell < cells - 1 and penetration >= knots[m, cell + 1]:
        cell += 1
    while penetration < knots[m, cell]:
        cell -= 1
    problem.cell[c] = cell
    x = min(penetration, max_penetration) - knots[m, cell]
    load, slope = 0.0, 0.0
    for power in range(3, -1, -1):
        coefficient = load_curve[row, index, side, cell, power]
        if fraction > 0.0:
            next_coefficient = load_curve[row, index + 1, side, cell, power]
            coefficient += fraction * (next_coefficient - coefficient)
        slope = slope * x + load
        load = load * x + coefficient
    return load + slope * max(penetration - max_penetration, 0.0), slope


@inlined
def interpolate(values, c, index, fraction):
    """Interpolated values of contact c (c, p + 1), without a view of its row: views
    cost more.
    """
    value = values[c, index]
    if fraction > 0.0:
        value += fraction * (values[c, index + 1] - value)
    return value


@inlined
def set_position(rate, contacts, cycle, number, position):
    """Set the meshes to step `number`, `cycle` steps per cycle of the first mesh."""
    positions, cycles_differ = contacts.gap.shape[1] - 1, has_different_cycles(contacts)
    for m in range(rate.size):
        cycles = rate[m] * number / cycle
        mesh_cycle = math.floor(cycles + 1e-9)
        table_position = max(cycles - mesh_cycle, 0.0) * positions
        position.grid_index[m] = min(int(table_position + GRID_TOL), positions - 1)
        position.fraction[m] = table_position - position.grid_index[m]
        if abs(position.fraction[m]) < GRID_TOL:
            position.fraction[m] = 0.0
        if cycles_differ and mesh_cycle != position.cycle[m]:
            position.cycle[m] = mesh_cycle
            for c in range(contacts.first[m], contacts.first[m + 1]):
                set_teeth(contacts, c, mesh_cycle, position)


@inlined
def has_different_cycles(contacts):
    """Whether the teeth that meet differ from cycle to cycle, or centres move."""
    return contacts.errors.shape[1] > 0 or contacts.curve_rows.shape[1] > 0


@compiled_part
def set_teeth(contacts, c, mesh_cycle, position):
    """Gap and load curve of contact c by the teeth that it has in a cycle."""
    errors, rows, positions = (
        contacts.errors,
        contacts.curve_rows,
        contacts.gap.shape[1],
    )
    error = errors[c, mesh_cycle % errors.shape[1]] if errors.shape[1] > 0 else 0.0
    for p in range(positions):
        position.gap[c, p] = contacts.gap[c, p] + error
    if rows.shape[1] == 0:
        return
    cycle = mesh_cycle % rows.shape[1]
    position.curve[c] = rows[c, cycle]
    change = contacts.gap_rows[c, cycle]
    for p in range(positions):
        position.gap[c, p] += contacts.gap_changes[change, p]


@allocating
def new_position(contacts):
    """Allocate the position of the meshes; gaps change where teeth differ only."""
    meshes = contacts.first.size - 1
    gap = contacts.gap.copy() if has_different_cycles(contacts) else contacts.gap
    return Position(
        np.zeros(meshes, np.int64),
        np.zeros(meshes),
        np.full(meshes, -1),
        gap,
        np.arange(contacts.side.size),
    )


@inlined
def set_row(values, width, c, index, fraction, out):
    """Entries (width,) of contact c's row at a position."""
    for k in range(width):
        out[k] = values[c, index, k]
        if fraction > 0.0:
            out[k] += fraction * (values[c, index + 1, k] - out[k])


@compiled_part
def set_reversed(contacts, rotation, position, reversed_):
    """Whether each contact slides against its nominal direction.

    rotation : (m, 2) speeds of driver and driven, each in its nominal sense [rad/s]
    """
    first, driver_arms, driven_arms = contacts.first, contacts.arms[0], contacts.arms[1]
    for m in range(first.size - 1):
        index, fraction = position.grid_index[m], position.fraction[m]
        for c in range(first[m], first[m + 1]):
            slip = rotation[m, 0] * interpolate(driver_arms, c, index, fraction)
            slip -= rotation[m, 1] * interpolate(driven_arms, c, index, fraction)
            nominal = interpolate(contacts.sliding, c, index, fraction)
            reversed_[c] = (
                1 if contacts.side[c] * slip * nominal > MIN_REVERSING_SPEED else 0
            )


@allocating
def contact_problem(contacts, mesh_of, position):
    """The equations for meshes at `position`; what changes in a step is not set yet."""
    count = mesh_of.size
    return PenetrationProblem(
        *(
            contacts.knots,
            contacts.load_curve,
            position.grid_index,
            position.fraction,
            position.curve,
            mesh_of,
        ),
        *(np.zeros(count, np.int64), np.empty(count), np.zeros(count)),
        *(np.zeros(count, np.int64), np.empty(count, np.int64)),
        *(np.empty((count, count)), np.empty((6, count)), np.empty(count, np.int64)),
        np.empty((count, count + 1)),
    )


@inlined
def may_touch(problem, c, penetration):
    """Whether a contact touches or is so little apart that it may; so does NaN."""
    return not penetration < -PROXIMITY_RTOL * problem.knots[problem.mesh_of[c], -1]


@inlined
def find_active(problem):
    """Set the contacts that may touch as `active`; return their number."""
    n_active = 0
    for c in range(problem.free.size):
        if may_touch(problem, c, problem.free[c]):
            problem.active[n_active] = c
            n_active += 1
    return n_active


@inlined
def set_errors(problem, n):
    """Loads, slopes and errors of the equations at x; the largest error [m]."""
    worst, chosen, Q = 0.0, problem.active, problem.Q
    newton, free = problem.newton, problem.free
    for i in range(n):
        newton[LOADS_ROW, i], newton[SLOPES_ROW, i] = load_at(
            problem, chosen[i], newton[PENETRATIONS_ROW, i]
        )
    for i in range(n):
        error = newton[PENETRATIONS_ROW, i] - free[chosen[i]]
        for j in range(n):
            error += Q[i, j] * newton[LOADS_ROW, j]
        newton[ERRORS_ROW, i] = error
        if not abs(error) <= worst:
            worst = abs(error)
    return worst


@inlined
def set_newton_step(problem, n):
    """Newton's step of n penetrations by those that are loaded; whether it is small."""
    newton, matrix, Q = problem.newton, problem.matrix, problem.Q
    loaded, count = problem.loaded, 0
    for i in range(n):
        if newton[SLOPES_ROW, i] > 0.0:
            loaded[count] = i
            count += 1
    for a in range(count):
        i = loaded[a]
        matrix[a, count] = newton[ERRORS_ROW, i]
        for b in range(count):
            matrix[a, b] = Q[i, loaded[b]] * newton[SLOPES_ROW, loaded[b]]
        matrix[a, a] += 1.0
    eliminate(matrix, count, count + 1)
    small, last_step = True, LAST_STEP_RTOL * problem.knots[0, -1]
    quadratic_step = QUADRATIC_STEP_RTOL * problem.knots[0, -1]
    for a in range(count):
        newton[STEP_ROW, loaded[a]] = matrix[a, count]
    for i in range(n):
        step = newton[STEP_ROW, i]
        if not newton[SLOPES_ROW, i] > 0.0:
            step = newton[ERRORS_ROW, i]
            for b in range(count):
                slope = newton[SLOPES_ROW, loaded[b]]
                step -= Q[i, loaded[b]] * slope * matrix[b, count]
        newton[STEP_ROW, i] = step
        depth = abs(newton[PENETRATIONS_ROW, i])
        small &= abs(step) <= last_step or step * step <= depth * min(
            quadratic_step, 0.25 * depth
        )
    return small


@compiled_part
def solve_penetrations(problem, n):
    """Newton's method with step halving for n penetrations; the status.

    It starts from `guess`. Rows PENETRATIONS_ROW and LOADS_ROW of `newton` hold the
    solution.
    """
    newton, scale = problem.newton, problem.knots[0, -1]
    for i in range(n):
        newton[PENETRATIONS_ROW, i] = problem.guess[problem.active[i]]
    error = set_errors(problem, n)
    for _ in range(MAX_NEWTON_ITERATIONS):
        if error <= PENETRATION_RTOL * scale:
            return CONVERGED
        if not error < math.inf:
            return NOT_CONVERGED
        if set_newton_step(problem, n):
            for i in range(n):
                newton[PENETRATIONS_ROW, i] -= newton[STEP_ROW, i]
                newton[LOADS_ROW, i] -= newton[SLOPES_ROW, i] * newton[STEP_ROW, i]
            return CONVERGED
        previous_error, length = error, 1.0
        for i in range(n):
            newton[PREVIOUS_ROW, i] = newton[PENETRATIONS_ROW, i]
        for _ in range(8):
            for i in range(n):
                newton[PENETRATIONS_ROW, i] = (
                    newton[PREVIOUS_ROW, i] - length * newton[STEP_ROW, i]
                )
            error = set_errors(problem, n)
            if error < previous_error:
                break
            length *= 0.5
    return CONVERGED if error <= 1e3 * PENETRATION_RTOL * scale else NOT_CONVERGED
