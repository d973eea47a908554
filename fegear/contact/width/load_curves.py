"""The load of every tooth pair over its penetration, solved along the face width.

As in `fegear.contact.pair_load_curves`, a pair is solved alone; what it yields under
the loads of others is in its compliance between centres of load. Loads count along the
line of action, as what their torque is over the base radius, and penetration is that of
the transmission error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from fegear.contact.pairs import PairTeeth
from fegear.contact.problem import ContactProblem
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.damage import MomentaryLine, PairsAt
from fegear.contact.width.lines import (
    FaceSolver,
    LinesOfContact,
    pairs_over_width,
)
from fegear.contact.width.slices import Slices
from lumped.common.array_types import Array, Indices
from lumped.common.workers import require_running

OPEN_GAP = 1e-2  # [m] beyond any deflection
SOLVED = 16  # penetrations of each pair, denser toward zero
SIZE_TOL = 5e-3  # of contacts, whose logarithm counts
CENTER = 7  # at which the centre of load is taken: near that at rest, a sixth of all


@dataclass(frozen=True, eq=False)
class WidthLoadCurves:
    """Load over penetration of k tooth pairs at n positions.

    teeth : (k,) base pitches by which each pair is ahead
    gap : (n, k) transmission error that closes each pair [m], OPEN_GAP where its
        flanks do not face each other
    load : (n, k, j) along the line of action [N]
    pressure : (n, k, j) largest contact pressure on the path, in plane strain [Pa]
    arc : (n, k, 2) of the load's centre from the tip corners [m]
    coupling : (n, k, k) transmission error of the first pair per load on the second
        [m/N]; zero on the diagonal
    """

    teeth: Indices
    gap: Array
    load: Array
    pressure: Array
    arc: Array
    coupling: Array


def interpolated_curves(
    problem: ContactProblem, width: WidthContact, position: Array, penetration: Array
) -> WidthLoadCurves:
    """Load curves at positions (n,). Every second is solved, others lie between.

    Halves of double helical gears stand side by side: they have one transmission error.
    """
    if width.far is not None:
        near, far = (
            interpolated_curves(problem, half, position, penetration)
            for half in width.halves
        )
        return _together(near, far, penetration)
    if position.size < 3:
        return width_load_curves(problem, width, position, penetration)
    solved_at = np.unique(np.append(position[::2], position[-1]))
    curves = width_load_curves(problem, width, solved_at, penetration)

    def between(values: Array) -> Array:
        return np.asarray(PchipInterpolator(solved_at, values)(position))

    return replace(
        curves,
        gap=between(curves.gap),
        load=between(curves.load),
        pressure=between(curves.pressure),
        arc=between(curves.arc),
        coupling=between(curves.coupling),
    )


def width_load_curves(
    problem: ContactProblem,
    width: WidthContact,
    position: Array,
    penetration: Array,
    both: PairTeeth | None = None,
) -> WidthLoadCurves:
    """Solve each pair alone at positions (n,) and penetrations (j,) from 0 on [m].

    both : one tooth of either gear, of which all pairs are; all like others if None
    """
    teeth = pairs_over_width(problem, width, position)
    if both is not None:
        both = PairTeeth(*(np.full(teeth.size, tooth) for tooth in both))
    shape = position.size, teeth.size
    curves = WidthLoadCurves(
        teeth=teeth,
        gap=np.full(shape, OPEN_GAP),
        load=np.zeros((*shape, penetration.size)),
        pressure=np.zeros((*shape, penetration.size)),
        arc=np.zeros((*shape, 2)),
        coupling=np.zeros((*shape, teeth.size)),
    )
    solver = FaceSolver(problem, width)
    for n, place in enumerate(position):
        require_running()
        _solve_position(solver, curves, (n, float(place)), penetration, both)
    return curves


def _together(
    near: WidthLoadCurves, far: WidthLoadCurves, penetration: Array
) -> WidthLoadCurves:
    """Curves of pairs whose halves are pressed together, the first to touch first."""
    gap = np.minimum(near.gap, far.gap)
    load, pressure = np.zeros_like(near.load), np.zeros_like(near.pressure)
    for half in (near, far):
        for at in np.ndindex(gap.shape):
            pressed = penetration - (half.gap[at] - gap[at])
            load[at] += np.interp(pressed, penetration, half.load[at], left=0.0)
            of_half = np.interp(pressed, penetration, half.pressure[at], left=0.0)
            pressure[at] = np.maximum(pressure[at], of_half)
    return replace(
        near,
        gap=gap,
        load=load,
        pressure=pressure,
        arc=0.5 * (near.arc + far.arc),
        # the compliance to the sum of the forces, half of which is on each half
        coupling=0.25 * (near.coupling + far.coupling),
    )


def _solve_position(
    solver: FaceSolver,
    curves: WidthLoadCurves,
    at: tuple[int, float],
    penetration: Array,
    both: PairTeeth | None,
) -> None:
    """Fill in the curves at a position, by its index and value."""
    n, position = at
    teeth, most = curves.teeth, float(penetration[-1])
    line = MomentaryLine.of(solver.problem.pair)
    lines = solver.lines(PairsAt(teeth, position, np.zeros(teeth.size), line, both))
    np.minimum.at(curves.gap[n], lines.parts.pair, lines.gap)
    within = lines.gap < curves.gap[n][lines.parts.pair] + most
    index = np.flatnonzero(within)
    parts = lines.parts.chosen(index)
    smooth = solver.compliance.between(teeth, parts)
    weights = np.zeros((teeth.size, index.size))
    closing = np.ones(teeth.size)
    for k in np.unique(parts.pair):
        of_pair = np.flatnonzero(parts.pair == k)
        slices = Slices(
            solver.compliance,
            lines,
            smooth[np.ix_(of_pair, of_pair)],
            index[of_pair],
            parts.chosen(of_pair),
        )
        force, curves.load[n, k], curves.pressure[n, k] = _pressed(
            solver, lines, slices, float(curves.gap[n, k]), penetration
        )
        weights[k, of_pair] = force / force.sum()
        closing[k] = weights[k, of_pair] @ slices.closing
        curves.arc[n, k] = weights[k, of_pair] @ slices.parts.arcs
    others = 1.0 - np.eye(teeth.size)
    mutual = others * (weights @ smooth @ weights.T)
    curves.coupling[n] = mutual / np.outer(closing, closing)


def _pressed(
    solver: FaceSolver,
    lines: LinesOfContact,
    slices: Slices,
    gap: float,
    penetration: Array,
) -> tuple[Array, Array, Array]:
    """Forces (s,) at the representative penetration, loads and pressures (j,)."""
    base_radius = solver.problem.pair.driver_arm
    most = float(penetration[-1])
    solved_at = most * (np.arange(SOLVED + 1) / SOLVED) ** 2
    loads, pressures = np.zeros(SOLVED + 1), np.zeros(SOLVED + 1)
    force = slices.first_guess(gap + solved_at[1])
    center, exponent = force, 1.0
    on_path = lines.on_path[slices.index]
    for j, x in enumerate(solved_at[1:], 1):
        size, grown = 0.0, _size(solver, lines, slices, force)
        # contacts are as large as their torque makes them
        while abs(grown - size) > SIZE_TOL * grown:
            size = grown
            force = slices.press(gap + float(x), size, force)
            grown = _size(solver, lines, slices, force)
        loads[j] = slices.arm @ force / base_radius
        pressure = slices.compliance.pressure(force, slices.parts)
        pressures[j] = np.where(on_path, pressure, 0.0).max()
        if j == CENTER:
            center = force
        if 1 < j < SOLVED:
            ratio = solved_at[j] / solved_at[j - 1]
            exponent = math.log(loads[j] / loads[j - 1]) / math.log(ratio)
        if j < SOLVED:
            force = force * (solved_at[j + 1] / x) ** exponent
    root, at = np.sqrt(solved_at), np.sqrt(penetration)
    load, pressure = (PchipInterpolator(root, v)(at) for v in (loads, pressures))
    return center, load, pressure


def _size(
    solver: FaceSolver, lines: LinesOfContact, slices: Slices, force: Array
) -> float:
    return solver.contact_size(float(slices.arm @ force), lines)
