"""Intervals of speed in which vibration grows, traced to their edges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.stability.combinations import Combination, combinations, mean_modes
from lumped.stability.multipliers import Method, largest_multiplier, transition
from lumped.stability.periodic import PeriodicSystem

Array = NDArray[np.float64]
GROWS = 1e-6  # of a multiplier beyond 1: two that meet are known to half of the digits
BISECTIONS = 26  # of an edge, to 1e-8 of a step of speed
INSIDE = 9  # speeds of an expected interval that are looked at
SHARE = 1e-3  # of a motion's energy in a mode that takes part


@dataclass(frozen=True)
class Interval:
    """Mesh frequencies [Hz] in which vibration grows.

    largest : Floquet multiplier inside, at `worst` [Hz]
    kind : the combination of modes that grows there, empty where it is none
    """

    low: float
    high: float
    worst: float
    largest: float
    kind: str


@dataclass(frozen=True, eq=False)
class Column:
    """Of one system: the largest multiplier at speeds (f,), and where vibration grows.

    expected : combinations of modes by perturbation
    """

    largest: Array
    intervals: tuple[Interval, ...]
    expected: tuple[Combination, ...]

    def kinds(self, speeds: ArrayLike) -> list[str]:
        """What grows at speeds [Hz], empty where nothing does."""
        return [
            next((i.kind for i in self.intervals if i.low <= speed <= i.high), "")
            for speed in np.asarray(speeds, float).tolist()
        ]


def examined(
    system: PeriodicSystem, speeds: ArrayLike, method: Method = "peano-baker"
) -> Column:
    """Stability at speeds [Hz], rising, and between them.

    Where perturbation expects an interval, more speeds are looked at, so that none is
    missed that is narrower than the grid. Ends of the grid end an interval.
    """
    grid = np.asarray(speeds, float)
    if grid.size < 2 or not (np.diff(grid) > 0.0).all():
        raise ValueError("speeds must be two or more that rise")
    limits = float(grid[0]), float(grid[-1])
    known = combinations(system, limits)
    extra = [np.linspace(*_ends(c, limits), INSIDE) for c in known if c.unstable]
    extra.append(np.array([c.at for c in known]))
    at = np.unique(np.concatenate([grid, *extra]))
    largest = largest_multiplier(system, at, method)
    grows = largest > 1.0 + GROWS
    ends = np.flatnonzero(np.diff(grows))
    edges = _edges(system, at[ends], at[ends + 1], method)
    marks = np.concatenate([at[:1], edges, at[-1:]]).tolist()
    kinds = np.full(at.size, "", object)
    kinds[grows] = kinds_at(system, at[grows], known, method)
    found: list[Interval] = []
    for number, (low, high) in enumerate(pairwise(marks)):
        if bool(grows[0]) != bool(number % 2):
            own = np.flatnonzero((at >= low) & (at <= high) & grows)
            found += _parted(low, high, at[own], largest[own], kinds[own].tolist())
    on_grid = largest[np.searchsorted(at, grid)]
    return Column(on_grid, tuple(found), tuple(known))


def _parted(
    low: float, high: float, at: Array, largest: Array, kinds: Sequence[str]
) -> Iterator[Interval]:
    """An interval, parted half way between speeds at which other modes grow."""
    groups = [list(g) for _, g in groupby(range(at.size), key=lambda i: kinds[i])]
    inner = [0.5 * float(at[own[-1]] + at[own[-1] + 1]) for own in groups[:-1]]
    for own, (start, end) in zip(groups, pairwise([low, *inner, high]), strict=True):
        worst = own[int(np.argmax(largest[own]))]
        yield Interval(
            start, end, float(at[worst]), float(largest[worst]), kinds[own[0]]
        )


def _ends(combination: Combination, limits: tuple[float, float]) -> tuple[float, float]:
    """Of the expected interval, inside of limits."""
    low, high = np.clip([combination.low, combination.high], *limits)
    return float(low), float(high)


def _edges(system: PeriodicSystem, below: Array, above: Array, method: Method) -> Array:
    """Where stability changes between pairs of speeds (e,)."""
    if not below.size:
        return below
    low, high = below.copy(), above.copy()
    first = largest_multiplier(system, low, method) > 1.0 + GROWS
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        same = (largest_multiplier(system, middle, method) > 1.0 + GROWS) == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def kinds_at(
    system: PeriodicSystem,
    speeds: Array,
    known: Sequence[Combination],
    method: Method = "peano-baker",
) -> list[str]:
    """What grows at speeds (f,) [Hz]: a combination of modes that move.

    known : combinations that may be
    """
    if not (known and speeds.size):
        return [""] * speeds.size
    values, vectors = np.linalg.eig(transition(system, speeds, method))
    worst = np.abs(values).argmax(axis=1)
    growing = np.take_along_axis(vectors, worst[:, None, None], axis=2)[..., 0]
    angular, right = mean_modes(system)
    into, n = np.linalg.inv(right), system.modes
    rates = growing[:, n:] * speeds[:, None]
    energy = (
        np.abs(growing[:, :n] @ into.T * angular) ** 2 + np.abs(rates @ into.T) ** 2
    )
    taking = energy > SHARE * energy.sum(axis=1, keepdims=True)
    return [
        _nearest(known, set(np.flatnonzero(parts).tolist()), speed)
        for parts, speed in zip(taking, speeds.tolist(), strict=True)
    ]


def _nearest(known: Sequence[Combination], modes: set[int], speed: float) -> str:
    own = [c for c in known if {c.first, c.second} <= modes] or known
    return min(own, key=lambda c: _far(c, speed)).name


def _far(combination: Combination, speed: float) -> tuple[float, float]:
    """How far a speed is from where a combination is expected [Hz], and from the
    middle of that over its half."""
    low, high = combination.low, combination.high
    if not (combination.unstable and math.isfinite(high)):
        low = high = combination.at
    off = abs(speed - 0.5 * (low + high))
    half = 0.5 * (high - low)
    return max(off - half, 0.0), off / max(half, 1e-12 * speed)
