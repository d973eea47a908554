"""The load of every tooth pair over its penetration, for gears in motion.

A pair is solved alone, finite elements and half-plane together, at a grid of
positions and penetrations; in motion its load is read from there. Pairs of a mesh act
on each other through the smooth compliance between their points of contact, which the
curves leave out: it is their `normal_compliance` and `tangential_compliance`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.kernel_constants import kernel_inputs
from fegear.contact.problem import (
    ContactProblem,
    back_side_position,
    candidate_pairs,
    solve_drive_side,
)
from fegear.elasticity.flank_grid import flank_stencils

Array = NDArray[np.float64]
N_INTERVALS = 32  # of penetration in a load curve, denser toward zero
# pairs are kept that touch within so many times the largest penetration of a curve
PAIR_RANGE_FACTOR = 3.0
# penetration at which the load's centre is taken
REPRESENTATIVE_INDEX = N_INTERVALS // 3
OPEN_GAP = 1e-2  # [m] beyond any deflection
NOMINAL, REVERSED = 0, 1  # friction


@dataclass(frozen=True)
class PairLoadCurves:
    """Load over penetration of k tooth pairs on one side at n positions.

    pair_offsets : (k,) base pitches by which each pair is ahead of the reference pair
        of the drive side
    gap : (n, k) penetration that is missing where unmodified flanks would touch [m],
        of the mate's normal; large where flanks do not face each other
    moment_arms : (n, k, 4) arms of normal and friction force about driver and driven
        centre [m]
    arc : (n, k, 2) of the load's centre from the tip corners [m]
    sliding_sign : (n, k) +1 before the pitch point, -1 behind it
    penetration : (j,) from 0, increasing [m]
    load : (n, k, 2, j) positive, with friction as nominally and reversed [N]
    pressure : (n, k, j) largest contact pressure [Pa]
    normal_compliance, tangential_compliance : (n, k, k) penetration of the first pair
        per normal, or rootward, load on the second [m/N]; zero on the diagonal
    """

    pair_offsets: NDArray[np.int64]
    gap: Array
    moment_arms: Array
    arc: Array
    sliding_sign: Array
    penetration: Array
    load: Array
    pressure: Array
    normal_compliance: Array
    tangential_compliance: Array


def pair_load_curves(
    problem: ContactProblem, position: Array, max_penetration: float, back: bool = False
) -> PairLoadCurves:
    """Load curves at positions (n,), for penetrations up to `max_penetration` [m].

    back : of the back flanks, whose penetration counts from where those touch
    Pitch errors are left out. Raises ContactFailure where no solution was found.
    """
    side_position = back_side_position(problem.pair, position) if back else position
    candidates = candidate_pairs(problem.pair, side_position)
    no_pitch_errors = np.zeros((side_position.size, candidates.size))
    _, pair_solutions = solve_drive_side(
        problem,
        candidates,
        no_pitch_errors,
        side_position,
        np.zeros(side_position.size),
    )
    penetration = max_penetration * np.linspace(0.0, 1.0, N_INTERVALS + 1) ** 2
    closing_rate = (
        pair_solutions.moment_arms[..., 0] / problem.pair.driver.base_radius
    )  # penetration / ste
    facing = pair_solutions.gap < OPEN_GAP
    gap = np.where(facing, pair_solutions.gap * closing_rate, OPEN_GAP)
    selected = np.flatnonzero(gap.min(axis=0) < PAIR_RANGE_FACTOR * max_penetration)
    teeth, arc = candidates[selected], pair_solutions.arc[:, selected]
    load = np.zeros((side_position.size, selected.size, 2, penetration.size))
    pressure = np.zeros((side_position.size, selected.size, penetration.size))
    for column, k in enumerate(selected):
        facing_positions = np.flatnonzero(facing[:, k])
        ste = (
            pair_solutions.gap[facing_positions, k, None]
            + penetration[1:] / closing_rate[facing_positions, k, None]
        )
        solution = _solve_pair(
            problem, teeth[column], side_position[facing_positions], ste
        )
        load[facing_positions, column, :, 1:] = (solution.load * problem.face_width)[
            :, None
        ]
        pressure[facing_positions, column, 1:] = solution.pressure
        arc[facing_positions, column] = solution.arc[:, REPRESENTATIVE_INDEX]
        if problem.friction > 0.0:
            solution = _solve_pair(
                problem, teeth[column], side_position[facing_positions], ste, True
            )
            load[facing_positions, column, REVERSED, 1:] = (
                solution.load * problem.face_width
            )
    normal, tangential = pair_coupling(problem, teeth, arc)
    return PairLoadCurves(
        pair_offsets=-teeth if back else teeth,
        gap=gap[:, selected],
        moment_arms=pair_solutions.moment_arms[:, selected],
        arc=arc,
        sliding_sign=pair_solutions.sliding_sign[:, selected],
        penetration=penetration,
        load=load,
        pressure=pressure,
        normal_compliance=normal,
        tangential_compliance=tangential,
    )


def _solve_pair(
    problem: ContactProblem,
    tooth: np.int64,
    position: Array,
    ste: Array,
    friction_reversed: bool = False,
) -> np.recarray:
    """Cells (n, j) of one pair alone at positions (n,), transmission errors (n, j)."""
    side_position = np.repeat(position, ste.shape[1])
    no_pitch_errors = np.zeros((side_position.size, 1))
    _, cells = solve_drive_side(
        problem,
        np.array([tooth]),
        no_pitch_errors,
        side_position,
        ste.ravel(),
        friction_reversed,
    )
    return cells.reshape(ste.shape).view(np.recarray)


def pair_coupling(
    problem: ContactProblem, teeth: NDArray[np.int64], arc: Array
) -> tuple[Array, Array]:
    """Smooth compliance between the points of contact of different pairs.

    teeth : (k,) base pitches ahead; arc : (n, k, 2) of the points from the tip corners
    Normal and tangential (n, k, k) [m/N], see `PairLoadCurves`.
    """
    _, flanks, tables = kernel_inputs(problem)
    positions, pairs = arc.shape[:2]
    count = tables.shape[3]
    stencils = [
        flank_stencils(
            arc[..., g], flank.length, flank.grading, count, flank.undercut_roll > 0.0
        )
        for g, flank in enumerate(flanks)
    ]
    normal, tangential = (np.zeros((positions, pairs, pairs)) for _ in range(2))
    max_tooth_offset = tables.shape[2] // 2
    for receiver, source in np.ndindex(pairs, pairs):
        tooth_offset = int(teeth[receiver] - teeth[source])
        if receiver == source or abs(tooth_offset) > max_tooth_offset:
            continue
        for g, (first, weight) in enumerate(stencils):
            # ahead is to the right on the driver, to the left on the driven gear
            offset = tooth_offset if g == 0 else -tooth_offset
            pair_stencils = [(first[:, p], weight[:, p]) for p in (receiver, source)]
            entry = slice(None), receiver, source
            normal[entry] += _interpolate_table(
                tables[g, 0, max_tooth_offset + offset], *pair_stencils
            )
            # normal displacement under friction, by Maxwell's theorem
            tangential[entry] += _interpolate_table(
                tables[g, 1, max_tooth_offset - offset], *pair_stencils[::-1]
            )
    return normal / problem.face_width, tangential / problem.face_width


def _interpolate_table(
    table: Array,
    row: tuple[NDArray[np.int64], Array],
    column: tuple[NDArray[np.int64], Array],
) -> Array:
    """(n,) entries of a table at stencils (n, 4) of rows and columns."""
    (i, u), (j, v) = row, column
    return np.einsum("na,nab,nb->n", u, table[i[:, :, None], j[:, None, :]], v)
