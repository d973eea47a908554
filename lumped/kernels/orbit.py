"""Contact forces along a motion that is known as a Fourier series, compiled.

A common period is cut into pieces, on all corners of the excitation and fine enough
for the series. Where a pair changes its contact within a piece, the piece is cut there,
so that Gauss points see smooth functions only. Time counts periods of the first mesh.

With pieces that contact changes bound, the linearised motion along the orbit is smooth
on each of them; forces have no jumps in the deflection, so that nothing is to be added
at the cuts.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled, inlined
from lumped.kernels.arrays import OFFSET
from lumped.kernels.elimination import eliminate
from lumped.kernels.excitation_at import position, set_excitation, set_pitch, value_at
from lumped.kernels.mesh_force import pair_force, pair_slope
from lumped.kernels.rk4 import rk4_step

# Gauss's points and weights of order 6 on (0, 1); collocation there, Hairer, Norsett
# and Wanner, Solving Ordinary Differential Equations II, table IV.5.2
SQRT_15 = math.sqrt(15.0)
GAUSS_POINTS = np.array([0.5 - SQRT_15 / 10.0, 0.5, 0.5 + SQRT_15 / 10.0])
GAUSS_WEIGHTS = np.array([5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0])
GAUSS_MATRIX = np.array(
    [
        [5 / 36, 2 / 9 - SQRT_15 / 15, 5 / 36 - SQRT_15 / 30],
        [5 / 36 + SQRT_15 / 24, 2 / 9, 5 / 36 - SQRT_15 / 24],
        [5 / 36 + SQRT_15 / 30, 2 / 9 + SQRT_15 / 15, 5 / 36],
    ]
)
PIECE_CHECKS = np.array([0.0, GAUSS_POINTS[0], 0.5, GAUSS_POINTS[2], 1.0])  # of a piece
MAX_CUTS = 32  # of a piece
EVENT_TOL_PERIODS = 1e-13  # periods within which a contact change is located
MAX_HALVINGS = 100


@inlined
def deflection_at(series, length, m, time):
    """Deflection of mesh m [m] at a time; series (2 H + 1, m) mean, cosines, sines."""
    order = (series.shape[0] - 1) // 2
    angle = 2.0 * math.pi * time / length
    c, s = math.cos(angle), math.sin(angle)
    cosine, sine, total = 1.0, 0.0, series[0, m]
    for h in range(1, order + 1):
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
        total += series[h, m] * cosine + series[order + h, m] * sine
    return total


@inlined
def overlap(orbit, p, m, shift, time):
    """Deflection minus gap of pair p plus a shift [m]."""
    waves = orbit.waves
    x = position(waves, p, time)
    gap = value_at(waves, 2 * p + 1, x, 1) + waves.pair_positions[p, OFFSET]
    return deflection_at(orbit.series, orbit.length, m, time) - gap + shift


@inlined
def find_cut(orbit, p, shift, low, high, a, b):
    """Time between two at which an overlap changes its sign, by the Illinois rule.

    a, b : overlaps there [m], of other signs. At the end of a piece, where a pair may
        take the place of the next, that is the limit from below.
    """
    m, side = orbit.waves.mesh_of[p], 0
    for _ in range(MAX_HALVINGS):
        if high - low <= EVENT_TOL_PERIODS or a == b:
            break
        time = (low * b - high * a) / (b - a)
        value = overlap(orbit, p, m, shift, time)
        if value == 0.0:
            return time
        if (value > 0.0) == (b > 0.0):
            high, b = time, value
            a = 0.5 * a if side == 1 else a
            side = 1
        else:
            low, a = time, value
            b = 0.5 * b if side == -1 else b
            side = -1
    return 0.5 * (low + high)


@inlined
def insert_sorted(cuts, count, cut):
    """Keep `count` sorted times sorted with one more."""
    k = count
    while k > 0 and cuts[k - 1] > cut:
        cuts[k] = cuts[k - 1]
        k -= 1
    cuts[k] = cut


@inlined
def add_cuts(orbit, grid, i, p, shift, cuts, count):
    """Insert the times at which an overlap of pair p changes sign in piece i."""
    m, start = orbit.waves.mesh_of[p], grid.edges[i]
    size = grid.edges[i + 1] - start
    before = orbit.deflection[i, 0, m] - grid.gap[i, 0, p] + shift
    for c in range(1, PIECE_CHECKS.size):
        now = orbit.deflection[i, c, m] - grid.gap[i, c, p] + shift
        if (before > 0.0) != (now > 0.0) and count < cuts.size:
            low, high = (
                start + PIECE_CHECKS[c - 1] * size,
                start + PIECE_CHECKS[c] * size,
            )
            cut = find_cut(orbit, p, shift, low, high, before, now)
            insert_sorted(cuts, count, cut)
            count += 1
        before = now
    return count


@inlined
def set_cuts(system, orbit, grid, i, cuts):
    """Times at which contacts change in piece i, sorted; how many."""
    count = 0
    for p in range(grid.gap.shape[2]):
        backlash, max_stiffness = system.backlash[orbit.waves.mesh_of[p]], 0.0
        for c in range(PIECE_CHECKS.size):
            max_stiffness = max(max_stiffness, grid.stiffness[i, c, p])
        if max_stiffness > 0.0:
            count = add_cuts(orbit, grid, i, p, 0.0, cuts, count)
            if 0.0 < backlash < math.inf:
                count = add_cuts(orbit, grid, i, p, backlash, cuts, count)
    return count


@inlined
def set_force(system, excitation, s, force, slope):
    """Forces [N] and tangent stiffnesses [N/m] of the meshes (m,) at deflections s.

    excitation : stiffness and gap (p,) of the pairs
    """
    stiffness, gap = excitation
    for m in range(s.size):
        force[m], slope[m] = 0.0, 0.0
        for p in range(system.first_pair[m], system.first_pair[m + 1]):
            elastic, backlash = s[m] - gap[p], system.backlash[m]
            force[m] += pair_force(stiffness[p], elastic, backlash)
            slope[m] += pair_slope(stiffness[p], elastic, backlash)


@inlined
def set_cut_piece(system, orbit, pieces, number, workspace):
    """Forces and slopes of a piece that begins or ends at a contact change.

    workspace : stiffness and gap (p,) of the pairs, deflections (m,)
    """
    stiffness, gap, s = workspace
    for g in range(3):
        time = pieces.start[number] + GAUSS_POINTS[g] * pieces.length[number]
        set_excitation(orbit.waves, time, 1, stiffness, gap)
        for m in range(s.size):
            s[m] = deflection_at(orbit.series, orbit.length, m, time)
        force, slope = pieces.force[number, g], pieces.slope[number, g]
        set_force(system, (stiffness, gap), s, force, slope)


@compiled
def set_pieces(system, orbit, grid, pieces):
    """Cut the grid at contact changes and set what each piece has; how many.

    0 where there are more of them than room.
    """
    count, pairs = 0, grid.gap.shape[2]
    cuts, s = np.empty(MAX_CUTS + 1), np.empty(system.backlash.size)
    workspace = np.empty(pairs), np.empty(pairs), s
    for i in range(grid.edges.size - 1):
        start, end = grid.edges[i], grid.edges[i + 1]
        set_pitch(orbit.waves, 0.5 * (start + end), 1)
        cut_count = set_cuts(system, orbit, grid, i, cuts[:MAX_CUTS])
        if count + cut_count >= pieces.start.size:
            return 0
        cuts[cut_count] = end
        for part in range(cut_count + 1):
            pieces.start[count], pieces.length[count] = start, cuts[part] - start
            pieces.grid_piece[count] = -1 if cut_count > 0 else i
            if cut_count > 0:
                set_cut_piece(system, orbit, pieces, count, workspace)
            start = cuts[part]
            count += 1
        for g in range(3 if cut_count == 0 else 0):
            force, slope = pieces.force[count - 1, g], pieces.slope[count - 1, g]
            springs = grid.stiffness[i, g + 1], grid.gap[i, g + 1]
            set_force(system, springs, orbit.deflection[i, g + 1], force, slope)
    return count


@compiled
def integrate_steps(system, steps, state, out):
    """Coordinates and velocities (t + 1, 2, n) through t steps of Runge-Kutta's rule.

    state : (2, n), left where it is
    """
    q, v = state[0].copy(), state[1].copy()
    work, meshes = np.empty((5, q.size)), system.shapes.shape[0]
    s, scratch, n_steps = np.empty(meshes), np.empty(meshes), steps.h.size
    for row in range(out.shape[0]):
        out[row, 0], out[row, 1] = q, v
        rk4_step(system, steps, row % n_steps, q, v, work, s, scratch)


@compiled
def integrate_changes(tangent, damping, h, state):
    """Carry small changes of state, columns of (2 n, k), over p pieces in place.

    A state is displacement and velocity. Gauss collocation of order 6.

    tangent : (p, 3, n, n) stiffness at the points [1/s2]; damping : (n, n) [1/s]
    h : (p,) [s]
    """
    n, changes = damping.shape[0], state.shape[1]
    matrix = np.empty((3 * n, 3 * n + changes))
    for piece in range(h.size):
        if h[piece] > 0.0:
            set_collocation(tangent[piece], damping, h[piece], state, matrix)
            eliminate(matrix, 3 * n, 3 * n + changes)
            update_changes(matrix, h[piece], state)


@inlined
def update_changes(matrix, h, state):
    """Changes of state over a piece [s], from their accelerations at its points."""
    n = matrix.shape[0] // 3
    for column in range(state.shape[1]):
        for i in range(n):
            displacement, velocity = 0.0, 0.0
            for g in range(3):
                a = matrix[g * n + i, 3 * n + column]
                velocity += GAUSS_WEIGHTS[g] * a
                displacement += GAUSS_WEIGHTS[g] * (1.0 - GAUSS_POINTS[g]) * a
            state[i, column] += h * state[n + i, column] + h * h * displacement
            state[n + i, column] += h * velocity


@inlined
def set_collocation(tangent, damping, h, state, matrix):
    """Equations for the accelerations at the three points, for each column of state.

    a_g = -D v_g - K_g q_g, v_g = v + h sum_f A_gf a_f,
    q_g = q + c_g h v + h^2 sum_f (A^2)_gf a_f
    """
    n = tangent.shape[1]
    for g in range(3):
        for i in range(n):
            row = g * n + i
            for f in range(3):
                squared = 0.0
                for e in range(3):
                    squared += GAUSS_MATRIX[g, e] * GAUSS_MATRIX[e, f]
                for j in range(n):
                    matrix[row, f * n + j] = h * h * squared * tangent[g, i, j]
                    matrix[row, f * n + j] += h * GAUSS_MATRIX[g, f] * damping[i, j]
            matrix[row, row] += 1.0
            for column in range(state.shape[1]):
                total = 0.0
                for j in range(n):
                    q = state[j, column] + GAUSS_POINTS[g] * h * state[n + j, column]
                    total -= tangent[g, i, j] * q + damping[i, j] * state[n + j, column]
                matrix[row, 3 * n + column] = total
