"""The load of every tooth pair over its penetration, for gears in motion.

A pair is solved alone, finite elements and half-plane together, at a grid of
positions and penetrations; in motion its load is read from there. Pairs of a mesh act
on each other through the smooth compliance between their points of contact, which the
laws leave out: it is their `normal` and `tangential`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.problem import (
    ContactProblem,
    back_side_position,
    candidate_pairs,
    kernel_inputs,
    solve_drive_side,
)
from fegear.elasticity.flank_grid import flank_stencils

Array = NDArray[np.float64]
CELLS = 32  # penetrations of a law, denser toward zero
REACH = 3.0  # times the largest penetration of the law within which pairs are kept
TYPICAL = CELLS // 3  # penetration at which the load's centre is taken
FAR_GAP = 1e-2  # [m] beyond any deflection
NOMINAL, REVERSED = 0, 1  # friction


@dataclass(frozen=True)
class PairLoadCurves:
    """Laws of k tooth pairs on one side at n positions; loads are positive.

    teeth : (k,) base pitches by which each pair is ahead of the reference pair of
        the drive side
    gap : (n, k) penetration that is missing where unmodified flanks would touch [m],
        of the mate's normal; large where flanks do not face each other
    moment_arms : (n, k, 4) arms of normal and friction force about driver and driven
        centre [m]
    arc : (n, k, 2) of the load's centre from the tip corners [m]
    sliding : (n, k) +1 before the pitch point, -1 behind it
    penetration : (j,) from 0, increasing [m]
    load : (n, k, 2, j) with friction as nominally and reversed [N]
    pressure : (n, k, j) largest contact pressure [Pa]
    normal, tangential : (n, k, k) penetration of the first pair per normal, or
        rootward, load on the second [m/N]; zero on the diagonal
    """

    teeth: NDArray[np.int64]
    gap: Array
    moment_arms: Array
    arc: Array
    sliding: Array
    penetration: Array
    load: Array
    pressure: Array
    normal: Array
    tangential: Array


def pair_load_curves(
    problem: ContactProblem, position: Array, reach: float, back: bool = False
) -> PairLoadCurves:
    """Laws at positions (n,), for penetrations up to `reach` [m].

    back : of the back flanks, whose penetration counts from where those touch
    Pitch errors are left out. Raises ContactFailure where no solution was found.
    """
    place = back_side_position(problem.pair, position) if back else position
    candidates = candidate_pairs(problem.pair, place)
    none = np.zeros((place.size, candidates.size))
    _, cells = solve_drive_side(problem, candidates, none, place, np.zeros(place.size))
    penetration = reach * np.linspace(0.0, 1.0, CELLS + 1) ** 2
    closing = (
        cells.moment_arms[..., 0] / problem.pair.driver.base_radius
    )  # penetration / ste
    facing = cells.gap < FAR_GAP
    gap = np.where(facing, cells.gap * closing, FAR_GAP)
    selected = np.flatnonzero(gap.min(axis=0) < REACH * reach)
    teeth, arc = candidates[selected], cells.arc[:, selected]
    load = np.zeros((place.size, selected.size, 2, penetration.size))
    pressure = np.zeros((place.size, selected.size, penetration.size))
    for column, k in enumerate(selected):
        here = np.flatnonzero(facing[:, k])
        ste = cells.gap[here, k, None] + penetration[1:] / closing[here, k, None]
        solution = _solve_pair(problem, teeth[column], place[here], ste)
        load[here, column, :, 1:] = (solution.load * problem.face_width)[:, None]
        pressure[here, column, 1:] = solution.pressure
        arc[here, column] = solution.arc[:, TYPICAL]
        if problem.friction > 0.0:
            solution = _solve_pair(problem, teeth[column], place[here], ste, True)
            load[here, column, REVERSED, 1:] = solution.load * problem.face_width
    normal, tangential = pair_coupling(problem, teeth, arc)
    return PairLoadCurves(
        teeth=-teeth if back else teeth,
        gap=gap[:, selected],
        moment_arms=cells.moment_arms[:, selected],
        arc=arc,
        sliding=cells.sliding_sign[:, selected],
        penetration=penetration,
        load=load,
        pressure=pressure,
        normal=normal,
        tangential=tangential,
    )


def _solve_pair(
    problem: ContactProblem,
    tooth: np.int64,
    position: Array,
    ste: Array,
    friction_reversed: bool = False,
) -> np.recarray:
    """Cells (n, j) of one pair alone at positions (n,), transmission errors (n, j)."""
    place = np.repeat(position, ste.shape[1])
    none = np.zeros((place.size, 1))
    _, cells = solve_drive_side(
        problem, np.array([tooth]), none, place, ste.ravel(), friction_reversed
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
        flank_stencils(arc[..., g], flank.length, flank.grading, count)
        for g, flank in enumerate(flanks)
    ]
    normal, tangential = (np.zeros((positions, pairs, pairs)) for _ in range(2))
    reach = tables.shape[2] // 2
    for receiver, source in np.ndindex(pairs, pairs):
        apart = int(teeth[receiver] - teeth[source])
        if receiver == source or abs(apart) > reach:
            continue
        for g, (first, weight) in enumerate(stencils):
            # ahead is to the right on the driver, to the left on the driven gear
            offset = apart if g == 0 else -apart
            at = [(first[:, p], weight[:, p]) for p in (receiver, source)]
            here = slice(None), receiver, source
            normal[here] += _between(tables[g, 0, reach + offset], *at)
            # normal displacement under friction, by Maxwell's theorem
            tangential[here] += _between(tables[g, 1, reach - offset], *at[::-1])
    return normal / problem.face_width, tangential / problem.face_width


def _between(
    table: Array,
    row: tuple[NDArray[np.int64], Array],
    column: tuple[NDArray[np.int64], Array],
) -> Array:
    """(n,) entries of a table at stencils (n, 4) of rows and columns."""
    (i, u), (j, v) = row, column
    return np.einsum("na,nab,nb->n", u, table[i[:, :, None], j[:, None, :]], v)
