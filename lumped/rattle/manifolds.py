"""Curves of the return map: grazing curves and the manifolds of saddles.

A curve is parametrised, and its parameter is refined until its points are close and its
direction changes little. Stable manifolds are boundaries of basins, see section 3.5 of
the source. Manifolds grow as images of a piece near the saddle that leads from one
image to the next; compare B. Krauskopf and H. Osinga, J. Comput. Phys. 146 (1998) 404.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.rattle.arcs import arcs_of, linearise_arcs
from lumped.rattle.kernels import inverse as kernel
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.orbits import Orbit
from lumped.rattle.return_map import follow

Evaluate = Callable[[Array], Array]
FIRST_DISTANCE = 1e-6  # distance of the first piece of a manifold from its saddle
MIN_JUMP_STEP = 1e-11  # change of a parameter at a jump of the curve
MIN_END_STEP = 1e-6  # change of a parameter at the end of the curve
MIN_POINTS = 5  # number of parameters at the start
PIECES_PER_GENERATION = 8  # pieces of a generation
MAX_POINTS = 400_000  # largest number of points of a curve
MAX_GENERATIONS = 200
MIN_GROWTH = 1e-6  # relative growth of a branch per generation below which it ends
MIN_TURNING_STEP = 0.02  # part of the spacing below which pieces may turn by any angle


@dataclass(frozen=True, kw_only=True)
class Fineness:
    """Limits of the distance between the points of a curve.

    spacing : largest distance
    turn : largest change of direction [rad]
    Distances are in turns; speeds are divided by that of a simple rattle, 2 pi delta.
    """

    spacing: float = 0.01
    turn: float = 0.3


@dataclass(frozen=True, eq=False)
class PlaneCurve:
    """Departures (n, 2), times from 0 to 1; NaN rows separate pieces between jumps.

    lengths : (n,) length of the curve up to each point, in the units of `Fineness`
    """

    points: Array
    lengths: Array

    @property
    def length(self) -> float:
        return float(self.lengths[-1]) if self.lengths.size else 0.0


@dataclass(frozen=True, eq=False)
class Manifold:
    """Branch of a stable or an unstable manifold.

    departure : (time, speed) of the departure of the saddle from which it starts
    side : side of the saddle, 1 or -1
    """

    orbit: Orbit
    departure: tuple[float, float]
    is_stable: bool
    side: int
    curve: PlaneCurve


def map_points(machine: Machine, starts: Array, count: int) -> Array:
    """Departures (n, 2) `count` returns later, or earlier if negative."""
    ends = np.empty_like(starts)
    arrays = machine.arrays if count >= 0 else machine.backward
    starts = np.ascontiguousarray(starts)
    kernel.map_points(arrays, starts, abs(count), count < 0, ends)
    return ends


def saddles(orbits: list[Orbit]) -> list[Orbit]:
    """Orbits with one multiplier of modulus above 1 and one below."""
    sizes = [sorted(map(abs, orbit.multipliers)) for orbit in orbits]
    return [
        orbit
        for orbit, (least, largest) in zip(orbits, sizes, strict=True)
        if least < 1.0 < largest
    ]


def grazing_curve(machine: Machine, returns: int, fineness: Fineness) -> PlaneCurve:
    """Departures `returns` returns ahead of those whose next contact grazes the lower
    flank."""

    def evaluate(times: Array) -> Array:
        departures = np.empty((times.size, 2))
        kernel.find_grazing_departures(machine.backward, times, departures)
        return map_points(machine, departures, -returns)

    points = _refine(evaluate, (0.0, 1.0), _scale(machine), fineness)
    return _curve(points, _scale(machine))


def grow_manifolds(
    machine: Machine, orbit: Orbit, is_stable: bool, length: float, fineness: Fineness
) -> list[Manifold]:
    """Grow both branches at every departure of a saddle, each up to a length.

    length : length in the units of `Fineness`; a branch that ends is shorter
    """
    manifolds = []
    for departure in orbit.departures:
        for side in (1, -1):
            seed = _seed(machine, orbit, departure, is_stable, side)
            curve = _grow(machine, seed, length, fineness)
            manifolds.append(Manifold(orbit, departure, is_stable, side, curve))
    return manifolds


@dataclass(frozen=True, eq=False)
class _Seed:
    """First piece of a manifold near a saddle: at + along leads to at + factor along in
    a number of returns, which is negative on a stable manifold."""

    at: Array
    along: Array
    factor: float
    returns: int

    def piece(self, fractions: Array) -> Array:
        """Departures (n, 2) from one end of the piece to the other."""
        return self.at + self.factor ** fractions[:, None] * self.along


def _seed(
    machine: Machine,
    orbit: Orbit,
    departure: tuple[float, float],
    is_stable: bool,
    side: int,
) -> _Seed:
    count, at = len(orbit.departures), np.array(departure)
    path = follow(machine, at, count + 1)
    values, vectors = np.linalg.eig(linearise_arcs(machine, arcs_of(machine, path)))
    sizes = np.abs(values)
    index = int(sizes.argmin() if is_stable else sizes.argmax())
    factor = float(1.0 / sizes[index] if is_stable else sizes[index])
    if values[index].real < 0.0:  # it changes sides
        count, factor = 2 * count, factor**2
    along = vectors[:, index].real
    along *= side * FIRST_DISTANCE / np.hypot(*(along / _scale(machine)))
    along *= 1.0 if along[1] * side > 0.0 else -1.0
    return _Seed(at, along, factor, -count if is_stable else count)


def _grow(
    machine: Machine, seed: _Seed, length: float, fineness: Fineness
) -> PlaneCurve:
    scale, pieces, length_so_far = (
        _scale(machine),
        [seed.at[None] % [1.0, math.inf]],
        0.0,
    )
    bounds = np.linspace(0.0, 1.0, PIECES_PER_GENERATION + 1)
    for generation in range(MAX_GENERATIONS):
        start = length_so_far

        def evaluate(fractions: Array, generation: int = generation) -> Array:
            returns = generation * seed.returns
            return map_points(machine, seed.piece(fractions), returns)

        for limits in pairwise(bounds.tolist()):
            points = _refine(evaluate, limits, scale, fineness)
            if not np.isfinite(points).any():
                return _curve(np.concatenate(pieces), scale)
            pieces.append(points)
            length_so_far += float(np.nansum(_distances(points, scale)))
            if length_so_far >= length:
                curve = _curve(np.concatenate(pieces), scale)
                inside = curve.lengths <= length
                return PlaneCurve(curve.points[inside], curve.lengths[inside])
        if length_so_far - start < MIN_GROWTH * length_so_far:
            break  # it ends in an attractor
    return _curve(np.concatenate(pieces), scale)


def _scale(machine: Machine) -> Array:
    """Scales of time and speed whose changes count equally."""
    return np.array([1.0, TURN * machine.damping * machine.drive])


def _steps(points: Array, scale: Array) -> Array:
    """Steps (n - 1, 2) from each point to the next, modulo whole turns."""
    steps = np.diff(points, axis=0) / scale
    steps[:, 0] -= np.round(steps[:, 0])
    return steps


def _distances(points: Array, scale: Array) -> Array:
    return np.asarray(np.hypot(*_steps(points, scale).T))


def _refine(
    evaluate: Evaluate, limits: tuple[float, float], scale: Array, fineness: Fineness
) -> Array:
    """Points of a curve (n, 2), times from 0 to 1, a NaN row at each jump."""
    s = np.linspace(*limits, MIN_POINTS)
    points = evaluate(s)
    while s.size < MAX_POINTS:
        needs_midpoint = _is_coarse(points, scale, fineness) & (
            np.diff(s) > MIN_JUMP_STEP
        )
        ends = np.diff(np.isnan(points[:, 0]).astype(int)) != 0
        needs_midpoint |= ends & (np.diff(s) > MIN_END_STEP)
        if not needs_midpoint.any():
            break
        middle = 0.5 * (s[:-1] + s[1:])[needs_midpoint]
        indices = np.flatnonzero(needs_midpoint) + 1
        s = np.insert(s, indices, middle)
        points = np.insert(points, indices, evaluate(middle), axis=0)
    points[:, 0] %= 1.0
    jumps = np.flatnonzero(_distances(points, scale) > fineness.spacing) + 1
    return np.insert(points, jumps, math.nan, axis=0)


def _is_coarse(points: Array, scale: Array, fineness: Fineness) -> NDArray[np.bool_]:
    """Mask (n - 1,) of the pieces that are too long or turn too much."""
    steps = _steps(points, scale)
    sizes = np.hypot(*steps.T)
    coarse = sizes > fineness.spacing
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs(np.remainder(np.diff(directions) + math.pi, TURN) - math.pi)
    bent = turns > fineness.turn
    long = sizes > MIN_TURNING_STEP * fineness.spacing
    coarse[:-1] |= bent & long[:-1]
    coarse[1:] |= bent & long[1:]
    return np.asarray(coarse)


def _curve(points: Array, scale: Array) -> PlaneCurve:
    """Curve without the points that are repeated where pieces join."""
    repeated = np.concatenate([[False], _distances(points, scale) == 0.0])
    points = points[~repeated]
    steps = np.nan_to_num(_distances(points, scale))
    return PlaneCurve(points, np.concatenate([[0.0], np.cumsum(steps)]))
