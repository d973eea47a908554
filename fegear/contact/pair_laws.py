"""The load of every tooth pair over its squeeze, for gears in motion.

A pair is solved alone, finite elements and half-plane together, at a grid of
positions and squeezes; in motion its load is read from there. Pairs of a mesh act on
each other through the smooth compliance between their points of contact, which the
laws leave out and `coupling` holds.
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
CELLS = 32  # squeezes of a law, denser toward zero
REACH = 3.0  # times the largest squeeze of the law within which pairs are kept
TYPICAL = CELLS // 3  # squeeze at which the load's centre is taken
FAR_GAP = 1e-2  # [m] beyond any deflection
NOMINAL, TURNED = 0, 1


@dataclass(frozen=True)
class PairLaws:
    """Laws of k tooth pairs on one side at n positions; loads are positive.

    teeth : (k,) base pitches by which each pair is ahead of the reference pair of
        the drive side
    gap : (n, k) squeeze that is missing where unmodified flanks would touch [m],
        of the mate's normal; large where flanks do not face each other
    lever : (n, k, 4) arms of normal and friction force about driver and driven
        centre [m]
    arc : (n, k, 2) of the load's centre from the tip corners [m]
    sliding : (n, k) +1 before the pitch point, -1 behind it
    squeeze : (j,) from 0, increasing [m]
    load : (n, k, 2, j) with friction as nominally and turned [N]
    pressure : (n, k, j) largest contact pressure [Pa]
    normal, tangential : (n, k, k) squeeze of the first pair per normal, or rootward,
        load on the second [m/N]; zero on the diagonal
    """

    teeth: NDArray[np.int64]
    gap: Array
    lever: Array
    arc: Array
    sliding: Array
    squeeze: Array
    load: Array
    pressure: Array
    normal: Array
    tangential: Array


def pair_laws(
    problem: ContactProblem, position: Array, reach: float, back: bool = False
) -> PairLaws:
    """Laws at positions (n,), for squeezes up to `reach` [m].

    back : of the back flanks, whose squeeze counts from where those touch
    Pitch errors are left out. Raises ContactFailure where no solution was found.
    """
    place = back_side_position(problem.pair, position) if back else position
    candidates = candidate_pairs(problem.pair, place)
    none = np.zeros((place.size, candidates.size))
    _, cells = solve_drive_side(problem, candidates, none, place, np.zeros(place.size))
    squeeze = reach * np.linspace(0.0, 1.0, CELLS + 1) ** 2
    base_radius = problem.pair.driver.base_radius
    closing = cells.lever[..., 0] / base_radius  # squeeze per approach
    facing = cells.gap < FAR_GAP
    gap = np.where(facing, cells.gap * closing, FAR_GAP)
    kept = np.flatnonzero(gap.min(axis=0) < REACH * reach)
    sides = (False, True) if problem.friction > 0.0 else (False,)
    arc = cells.arc[:, kept]
    load = np.zeros((place.size, kept.size, 2, squeeze.size))
    pressure = np.zeros((place.size, kept.size, squeeze.size))
    for column, k in enumerate(kept):
        here = np.flatnonzero(facing[:, k])
        approach = cells.gap[here, k, None] + squeeze[1:] / closing[here, k, None]
        for turned in sides:
            _, found = solve_drive_side(
                problem,
                candidates[[k]],
                np.zeros((approach.size, 1)),
                np.repeat(place[here], CELLS),
                approach.ravel(),
                turned,
            )
            values = found.load.reshape(approach.shape) * problem.face_width
            load[here, column, int(turned), 1:] = values
            if not turned:
                peak = found.pressure.reshape(approach.shape)
                pressure[here, column, 1:] = peak
                arc[here, column] = found.arc.reshape(*approach.shape, 2)[:, TYPICAL]
    if len(sides) == 1:
        load[:, :, TURNED] = load[:, :, NOMINAL]
    teeth = candidates[kept]
    normal, tangential = _coupling(problem, teeth, arc)
    return PairLaws(
        teeth=-teeth if back else teeth,
        gap=gap[:, kept],
        lever=cells.lever[:, kept],
        arc=arc,
        sliding=cells.sliding_sign[:, kept],
        squeeze=squeeze,
        load=load,
        pressure=pressure,
        normal=normal,
        tangential=tangential,
    )


def _coupling(
    problem: ContactProblem, teeth: NDArray[np.int64], arc: Array
) -> tuple[Array, Array]:
    """Smooth compliance between the points of contact of different pairs."""
    _, flanks, tables = kernel_inputs(problem)
    positions, pairs = arc.shape[:2]
    count = tables.shape[3]
    stencils = [
        flank_stencils(arc[..., g], flank.length, flank.grading, count)
        for g, flank in enumerate(flanks)
    ]
    normal, tangential = (np.zeros((positions, pairs, pairs)) for _ in range(2))
    reach = tables.shape[2] // 2
    for seen in range(pairs):
        for loaded in range(pairs):
            apart = int(teeth[seen] - teeth[loaded])
            if seen == loaded or abs(apart) > reach:
                continue
            for g, (first, weight) in enumerate(stencils):
                # ahead is to the right on the driver, to the left on the driven gear
                offset = apart if g == 0 else -apart
                at = [(first[:, p], weight[:, p]) for p in (seen, loaded)]
                normal[:, seen, loaded] += _between(tables[g, 0, reach + offset], *at)
                # normal displacement under friction, by Maxwell's theorem
                tangential[:, seen, loaded] += _between(
                    tables[g, 1, reach - offset], *at[::-1]
                )
    return normal / problem.face_width, tangential / problem.face_width


def _between(
    table: Array,
    row: tuple[NDArray[np.int64], Array],
    column: tuple[NDArray[np.int64], Array],
) -> Array:
    """(n,) entries of a table at stencils (n, 4) of rows and columns."""
    (i, u), (j, v) = row, column
    return np.einsum("na,nab,nb->n", u, table[i[:, :, None], j[:, None, :]], v)
