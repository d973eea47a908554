"""The load of every tooth pair over its penetration, for gears in motion.

A pair is solved alone, finite elements and half-plane together, at a grid of
positions and penetrations; in motion its load is read from there. Pairs of a mesh act
on each other through the smooth compliance between their points of contact, which the
curves leave out: it is their `normal_compliance` and `tangential_compliance`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pairs import (
    PairTeeth,
    back_side_position,
    candidate_pairs,
    with_back_flanks,
)
from fegear.contact.plane.constants import Conditions, kernel_inputs
from fegear.contact.plane.runs import missing_pairs
from fegear.contact.plane.solve import solve_drive_side
from fegear.contact.problem import ContactProblem
from fegear.contact.width.contact import WidthContact
from fegear.elasticity.flank_grid import flank_stencils
from fegear.gearset.pitch_errors import OPEN_GAP
from lumped.common.array_types import Array, Indices

N_INTERVALS = 32  # of penetration in a load curve, denser toward zero
# pairs are kept that touch within so many times the largest penetration of a curve
PAIR_RANGE_FACTOR = 3.0
# penetration at which the load's centre is taken
REPRESENTATIVE_INDEX = N_INTERVALS // 3
MAX_CACHED = 32  # load curves of sides of meshes, of some 0.3 MB each
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
    turn : (n, k, 2) of corners, as in `ContactCycle`
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
    turn: Array
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

    Those that were solved last are kept: planets have equal teeth, and so have gear
    sets that differ in what does not touch.
    """
    teeth = _teeth_and_settings(problem)
    request = _Request(problem, teeth, position.tobytes(), max_penetration, back)
    return (_solve_load_curves if teeth is None else _solve_cached)(request)


@dataclass(frozen=True)
class _Request:
    """The load curves that are wanted. Two requests are equal if their teeth are."""

    problem: ContactProblem = field(compare=False)
    teeth: tuple[object, ...] | None
    position: bytes
    max_penetration: float
    back: bool


def _teeth_and_settings(problem: ContactProblem) -> tuple[object, ...] | None:
    """All of a problem that load curves depend on; None where it cannot be told."""
    flanks = problem.flanks
    if isinstance(problem.solver, WidthContact):
        return None
    if any(flank.compliance.origin is None or flank.faults for flank in flanks):
        return None
    values = [
        getattr(problem, f.name)
        for f in fields(problem)
        if f.name not in ("driver", "driven")
    ]
    for flank in flanks:
        values += [flank.compliance.origin, *flank.reliefs, flank.profile, flank.offset]
    return tuple(values)


@lru_cache(maxsize=MAX_CACHED)
def _solve_cached(request: _Request) -> PairLoadCurves:
    return _solve_load_curves(request)


def _solve_load_curves(request: _Request) -> PairLoadCurves:
    # numba would compile kernels once more for an array that cannot be written
    problem, position = request.problem, np.frombuffer(request.position).copy()
    max_penetration, back = request.max_penetration, request.back
    side_position = back_side_position(problem.pair, position) if back else position
    side = with_back_flanks(problem) if back else problem
    if isinstance(side.solver, WidthContact):
        reach = max_penetration, back
        return _solve_over_width(side, side.solver, side_position, reach)
    candidate_teeth = candidate_pairs(problem, side_position)
    unloaded_flanks = _solve_unloaded_flanks(problem, candidate_teeth, side_position)
    penetration = max_penetration * np.linspace(0.0, 1.0, N_INTERVALS + 1) ** 2
    gap = unloaded_flanks.gap
    selected_pairs = _within_reach(gap, max_penetration)
    teeth, arc = (
        candidate_teeth[selected_pairs],
        unloaded_flanks.cells.arc[:, selected_pairs],
    )
    load = np.zeros((side_position.size, selected_pairs.size, 2, penetration.size))
    pressure = np.zeros((side_position.size, selected_pairs.size, penetration.size))
    for column, k in enumerate(selected_pairs):
        facing_positions, solutions = _solve_penetrations(
            problem,
            teeth[column],
            side_position,
            unloaded_flanks.pair(int(k)),
            penetration,
        )
        load[:, column], pressure[:, column] = _loads_and_pressures(
            problem, facing_positions, solutions, side_position.size
        )
        arc[facing_positions, column] = solutions[0].arc[:, REPRESENTATIVE_INDEX]
    turn = unloaded_flanks.cells.turn[:, selected_pairs]
    normal, tangential = pair_coupling(problem, teeth, arc, turn)
    return PairLoadCurves(
        pair_offsets=-teeth if back else teeth,
        gap=gap[:, selected_pairs],
        moment_arms=unloaded_flanks.cells.moment_arms[:, selected_pairs],
        arc=arc,
        turn=turn,
        sliding_sign=unloaded_flanks.cells.sliding_sign[:, selected_pairs],
        penetration=penetration,
        load=load,
        pressure=pressure,
        normal_compliance=normal,
        tangential_compliance=tangential,
    )


def _within_reach(gap: Array, max_penetration: float) -> NDArray[np.intp]:
    """Pairs that may touch, by their gaps (n, k) [m]."""
    # a gap that all pairs have, as of a profile, keeps none of them out of reach
    least = gap.min(axis=0) - gap.min()
    return np.flatnonzero(least < PAIR_RANGE_FACTOR * max_penetration)


def _solve_over_width(
    problem: ContactProblem,
    width: WidthContact,
    position: Array,
    reach: tuple[float, bool],
) -> PairLoadCurves:
    """Load curves of pairs whose loads vary over the width, along the line of action.

    Penetration is that of the transmission error, and friction left out.

    reach : largest penetration [m], and whether flanks are back flanks
    """
    from fegear.contact.width.load_curves import interpolated_curves

    max_penetration, back = reach
    penetration = max_penetration * np.linspace(0.0, 1.0, N_INTERVALS + 1) ** 2
    curves = interpolated_curves(problem, width, position, penetration)
    chosen = _within_reach(curves.gap, max_penetration)
    teeth, pair = curves.teeth[chosen], problem.pair
    roll = pair.pitch_point + pair.base_pitch * (position[:, None] + teeth)
    roll = np.clip(roll, pair.path_start, pair.path_end)
    rolls = np.stack([roll, pair.line_of_action - roll], axis=2)
    radii = np.array([pair.driver.base_radius, pair.driven.base_radius])
    arms = np.concatenate([np.broadcast_to(radii, rolls.shape), rolls], axis=2)
    coupling = curves.coupling[:, chosen][..., chosen]
    return PairLoadCurves(
        pair_offsets=-teeth if back else teeth,
        gap=curves.gap[:, chosen],
        moment_arms=arms,
        arc=curves.arc[:, chosen],
        turn=np.zeros(rolls.shape),
        sliding_sign=np.sign(pair.pitch_point - roll),
        penetration=penetration,
        load=np.repeat(curves.load[:, chosen, None], 2, axis=2),
        pressure=problem.plane_strain_pressure * curves.pressure[:, chosen],
        normal_compliance=coupling,
        tangential_compliance=np.zeros_like(coupling),
    )


@dataclass(frozen=True)
class ToothLoadCurves:
    """Load curves of k pairs of the same two teeth, which differ from the others.

    gap (n, k), load (n, k, 2, j), pressure (n, k, j) as in `PairLoadCurves`
    """

    gap: Array
    load: Array
    pressure: Array


def tooth_load_curves(
    problem: ContactProblem,
    position: Array,
    alike_curves: PairLoadCurves,
    teeth: tuple[int, int],
    back: bool = False,
) -> ToothLoadCurves:
    """Load curves of the pairs that two teeth form while they pass the mesh.

    position : (n,) of the drive side, as of the curves of the other teeth
    teeth : of driver and driven gear, as in `PairTeeth`
    alike_curves : of the other teeth, whose pairs and penetrations are taken
    """
    load, pressure = (
        np.zeros_like(alike_curves.load),
        np.zeros_like(alike_curves.pressure),
    )
    pair_teeth = PairTeeth(*(np.array([tooth]) for tooth in teeth))
    if missing_pairs(problem, pair_teeth).any():
        return ToothLoadCurves(np.full_like(alike_curves.gap, OPEN_GAP), load, pressure)
    side_position = back_side_position(problem.pair, position) if back else position
    pairs = -alike_curves.pair_offsets if back else alike_curves.pair_offsets
    if isinstance(problem.solver, WidthContact):
        return _teeth_over_width(
            problem, problem.solver, side_position, alike_curves, (pairs, pair_teeth)
        )
    unloaded_flanks = _solve_unloaded_flanks(problem, pairs, side_position, teeth)
    for column, pair in enumerate(pairs):
        facing_positions, solutions = _solve_penetrations(
            *(
                problem,
                pair,
                side_position,
                unloaded_flanks.pair(column),
                alike_curves.penetration,
            ),
            teeth,
        )
        load[:, column], pressure[:, column] = _loads_and_pressures(
            problem, facing_positions, solutions, side_position.size
        )
    return ToothLoadCurves(unloaded_flanks.gap, load, pressure)


def _teeth_over_width(
    problem: ContactProblem,
    width: WidthContact,
    position: Array,
    alike_curves: PairLoadCurves,
    pairs_and_teeth: tuple[Indices, PairTeeth],
) -> ToothLoadCurves:
    """Load curves of pairs of the same two teeth whose loads vary over the width.

    pairs_and_teeth : base pitches (k,) by which pairs are ahead, and their two teeth
    """
    from fegear.contact.width.load_curves import width_load_curves

    pairs, teeth = pairs_and_teeth
    solved = width_load_curves(
        problem, width, position, alike_curves.penetration, teeth
    )
    columns = [int(np.flatnonzero(solved.teeth == pair)[0]) for pair in pairs]
    return ToothLoadCurves(
        solved.gap[:, columns],
        np.repeat(solved.load[:, columns, None], 2, axis=2),
        problem.plane_strain_pressure * solved.pressure[:, columns],
    )


def _conditions_of_pairs(
    pairs: int, teeth: tuple[int, int] | None, friction_reversed: bool = False
) -> Conditions:
    """Conditions of some number of pairs of the same teeth."""
    if teeth is None:
        return Conditions(friction_reversed=friction_reversed)
    pair_teeth = PairTeeth(*(np.full(pairs, tooth, np.int64) for tooth in teeth))
    return Conditions(pair_teeth, friction_reversed=friction_reversed)


@dataclass(frozen=True)
class _UnloadedFlanks:
    """Flanks of k pairs that do not touch, at n positions.

    cells : (n, k) of the kernel
    closing_rate : (n, k) penetration per transmission error
    """

    cells: np.recarray
    closing_rate: Array

    @property
    def facing(self) -> NDArray[np.bool_]:
        """Whether flanks face each other (n, k)."""
        return np.asarray(self.cells.gap < OPEN_GAP)

    @property
    def gap(self) -> Array:
        """Gap as in `PairLoadCurves`."""
        return np.where(self.facing, self.cells.gap * self.closing_rate, OPEN_GAP)

    def pair(self, k: int) -> _UnloadedFlanks:
        """One of the pairs."""
        cells = self.cells[:, k].view(np.recarray)
        return _UnloadedFlanks(cells, self.closing_rate[:, k])


def _solve_unloaded_flanks(
    problem: ContactProblem,
    pairs: NDArray[np.int64],
    side_position: Array,
    teeth: tuple[int, int] | None = None,
) -> _UnloadedFlanks:
    no_pitch_errors = np.zeros((side_position.size, pairs.size))
    _, cells = solve_drive_side(
        *(problem, pairs, no_pitch_errors, side_position),
        np.zeros(side_position.size),
        _conditions_of_pairs(pairs.size, teeth),
    )
    rate = cells.moment_arms[..., 0] / problem.pair.driver.base_radius
    return _UnloadedFlanks(cells, rate)


def _solve_penetrations(
    problem: ContactProblem,
    pair: np.int64,
    side_position: Array,
    unloaded_flanks: _UnloadedFlanks,
    penetration: Array,
    teeth: tuple[int, int] | None = None,
) -> tuple[NDArray[np.intp], tuple[np.recarray, ...]]:
    """Positions where a pair's flanks face each other, and cells (n, j) there.

    With friction as is nominal and, where there is any, reversed.
    """
    facing_positions = np.flatnonzero(unloaded_flanks.facing)
    ste = unloaded_flanks.cells.gap[facing_positions, None]
    ste = ste + penetration[1:] / unloaded_flanks.closing_rate[facing_positions, None]
    directions = (False, True) if problem.friction > 0.0 else (False,)
    solutions = (
        _solve_pair(
            problem,
            pair,
            side_position[facing_positions],
            ste,
            _conditions_of_pairs(1, teeth, friction_reversed),
        )
        for friction_reversed in directions
    )
    return facing_positions, tuple(solutions)


def _loads_and_pressures(
    problem: ContactProblem,
    facing_positions: NDArray[np.intp],
    solutions: tuple[np.recarray, ...],
    positions: int,
) -> tuple[Array, Array]:
    """Loads (n, 2, j) [N] and pressures (n, j) [Pa] of a pair, from 0 on.

    Pressures are those of plane strain.
    """
    n_penetrations = solutions[0].shape[1] + 1
    load, pressure = (
        np.zeros((positions, 2, n_penetrations)),
        np.zeros((positions, n_penetrations)),
    )
    load[facing_positions, :, 1:] = (solutions[NOMINAL].load * problem.face_width)[
        :, None
    ]
    load[facing_positions, REVERSED, 1:] = solutions[-1].load * problem.face_width
    pressure[facing_positions, 1:] = solutions[NOMINAL].pressure
    pressure *= problem.plane_strain_pressure
    return load, pressure


def _solve_pair(
    problem: ContactProblem,
    pair: np.int64,
    position: Array,
    ste: Array,
    conditions: Conditions,
) -> np.recarray:
    """Cells (n, j) of one pair alone at positions (n,), transmission errors (n, j)."""
    side_position = np.repeat(position, ste.shape[1])
    no_pitch_errors = np.zeros((side_position.size, 1))
    _, cells = solve_drive_side(
        problem,
        np.array([pair]),
        no_pitch_errors,
        side_position,
        ste.ravel(),
        conditions,
    )
    return cells.reshape(ste.shape).view(np.recarray)


def pair_coupling(
    problem: ContactProblem, teeth: NDArray[np.int64], arc: Array, turn: Array
) -> tuple[Array, Array]:
    """Smooth compliance between the points of contact of different pairs.

    teeth : (k,) base pitches ahead; arc : (n, k, 2) of the points from the tip corners
    turn : (n, k, 2) of corners, as in `ContactCycle`
    Normal and tangential (n, k, k) [m/N], see `PairLoadCurves`. What teeth yield toward
    the root under the small part of a corner's load toward it is left out.
    """
    _, flanks, tables = kernel_inputs(problem)
    positions, pairs = arc.shape[:2]
    n_flank_points = tables.shape[3]
    stencils = [
        flank_stencils(
            arc[..., g],
            flank.length,
            flank.grading,
            n_flank_points,
            flank.undercut_roll > 0.0,
        )
        for g, flank in enumerate(flanks)
    ]
    normal, tangential = (np.zeros((positions, pairs, pairs)) for _ in range(2))
    max_tooth_offset = tables.shape[2] // 2
    cosine = np.sqrt(1.0 - turn**2)
    for receiver, source in np.ndindex(pairs, pairs):
        tooth_offset = int(teeth[receiver] - teeth[source])
        if receiver == source or abs(tooth_offset) > max_tooth_offset:
            continue
        for g, (first, weight) in enumerate(stencils):
            # ahead is to the right on the driver, to the left on the driven gear
            offset = tooth_offset if g == 0 else -tooth_offset
            receiver_stencil, source_stencil = (
                (first[:, p], weight[:, p]) for p in (receiver, source)
            )
            ahead_index, behind_index = (
                max_tooth_offset + offset,
                max_tooth_offset - offset,
            )
            normal_by_normal = _interpolate_table(
                tables[g, 0, ahead_index], receiver_stencil, source_stencil
            )
            rootward_by_normal = _interpolate_table(
                tables[g, 1, ahead_index], receiver_stencil, source_stencil
            )
            # normal displacement under loads toward the root, by Maxwell's theorem
            normal_by_rootward = _interpolate_table(
                tables[g, 1, behind_index], source_stencil, receiver_stencil
            )
            c, s = cosine[:, receiver, g], turn[:, receiver, g]
            receiver_by_normal, receiver_by_rootward = (
                c * normal_by_normal + s * rootward_by_normal,
                c * normal_by_rootward,
            )
            c, s = cosine[:, source, g], turn[:, source, g]
            entry = slice(None), receiver, source
            normal[entry] += c * receiver_by_normal + s * receiver_by_rootward
            tangential[entry] += c * receiver_by_rootward - s * receiver_by_normal
    return normal / problem.face_width, tangential / problem.face_width


def _interpolate_table(
    table: Array,
    row: tuple[NDArray[np.int64], Array],
    column: tuple[NDArray[np.int64], Array],
) -> Array:
    """(n,) entries of a table at stencils (n, 4) of rows and columns."""
    (i, u), (j, v) = row, column
    return np.einsum("na,nab,nb->n", u, table[i[:, :, None], j[:, None, :]], v)
