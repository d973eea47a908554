"""Intervals of speed in which vibration grows, traced to their edges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.stability.combinations import ORDERS, Combination, combinations
from lumped.stability.multipliers import Method
from lumped.stability.naming import Names, candidates, growth
from lumped.stability.periodic import PeriodicSystem

Array = NDArray[np.float64]
Places = NDArray[np.intp]
EDGE = 2e-8  # of a speed, to which an edge is traced
BISECTIONS = 40  # of an edge at most
HALVINGS = 6  # of the distance of speeds beside an extreme of the multiplier
MOST_ORDERS = 60  # harmonics that are looked at where speeds are low
ROUND_OFF = 1e-9  # of a multiplier
APART = 0.004  # logarithm of speeds that are looked at in any case
INSIDE, BESIDE = 11, 0.5  # speeds of an expected interval, and its widths beside it


@dataclass(frozen=True)
class Interval:
    """Mesh frequencies [Hz] in which vibration grows.

    largest : Floquet multiplier inside, at `worst` [Hz]
    kind : the combination of modes that grows there
    """

    low: float
    high: float
    worst: float
    largest: float
    kind: str


@dataclass(frozen=True, eq=False)
class Column:
    """Stability of one system: the largest multiplier at speeds (f,), and the intervals
    in which vibration grows.

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


@dataclass(frozen=True, eq=False)
class Samples:
    """Speeds (f,) [Hz], rising, their largest multipliers, and what grows there."""

    at: Array
    largest: Array
    kinds: Names

    def inserted(
        self, places: Places, at: Array, largest: Array, kinds: Names
    ) -> Samples:
        """Samples with more speeds, inserted before some places."""
        return Samples(
            np.insert(self.at, places, at),
            np.insert(self.largest, places, largest),
            np.insert(self.kinds, places, kinds),
        )


def examined(
    system: PeriodicSystem, speeds: ArrayLike, method: Method = "peano-baker"
) -> Column:
    """Stability at speeds [Hz], rising, and between them.

    Edges do not depend on the grid: speeds of their own are looked at, close together
    where perturbation expects an interval. Ends of the grid end an interval.
    """
    grid = np.asarray(speeds, float)
    if grid.size < 2 or not (np.diff(grid) > 0.0).all():
        raise ValueError("speeds must be two or more that rise")
    limits = float(grid[0]), float(grid[-1])
    highest = 2.0 * float(system.frequency_Hz.max())
    orders = min(max(ORDERS, math.ceil(highest / limits[0])), MOST_ORDERS)
    every = combinations(system, orders=orders)
    known = candidates(system, every)
    own = _own_speeds(system, every, limits)
    at = np.unique(np.concatenate([grid, own]))
    found = Samples(at, *growth(system, at, known, method))
    on_grid = found.largest[np.searchsorted(at, grid)]
    for places, rounds in ((_extremes, HALVINGS), (_changes, BISECTIONS)):
        for _ in range(rounds):
            left = places(found)
            if not left.size:
                break
            between = 0.5 * (found.at[left] + found.at[left + 1])
            found = found.inserted(
                left + 1, between, *growth(system, between, known, method)
            )
    near = tuple(each for each in every if each.comes_near(limits))
    return Column(on_grid, tuple(_intervals(found)), near)


def _own_speeds(
    system: PeriodicSystem, known: Sequence[Combination], limits: tuple[float, float]
) -> Array:
    """Between limits [Hz], the same in every window but for its ends.

    They are close together where an interval is expected to be narrow.
    """
    top = 2.0 * float(system.frequency_Hz.max())
    first, last = (math.log(speed / top) / APART for speed in limits)
    even = top * np.exp(APART * np.arange(math.ceil(first), math.floor(last) + 1))
    found = [even, np.array([c.at for c in known])]
    for each in known:
        width = each.high - each.low
        if width < INSIDE * APART * each.at:
            share = np.linspace(-BESIDE, 1.0 + BESIDE, INSIDE)
            found.append(each.low + width * share)
    at = np.concatenate(found)
    return at[(at > limits[0]) & (at < limits[1])]


def _changes(found: Samples) -> Places:
    """Speeds before a change of what grows, if the next is not near enough."""
    at = found.at
    changes = np.flatnonzero(found.kinds[1:] != found.kinds[:-1])
    return changes[at[changes + 1] - at[changes] > EDGE * at[changes]]


def _extremes(found: Samples) -> Places:
    """Speeds beside which growth may begin or end between its neighbours: where the
    largest multiplier is a maximum of stable ones or a minimum of others."""
    stable = found.kinds == ""
    sign = np.where(stable, 1.0, -1.0)
    before, own, after = found.largest[:-2], found.largest[1:-1], found.largest[2:]
    inner = sign[1:-1]
    with np.errstate(invalid="ignore"):  # of infinite ones, none of which is extreme
        rises, falls = inner * (own - before), inner * (own - after)
    top = (rises > ROUND_OFF) & (falls > ROUND_OFF)
    top &= (stable[:-2] == stable[1:-1]) & (stable[2:] == stable[1:-1])
    place = np.flatnonzero(top)
    return np.unique(np.concatenate([place, place + 1]))


def _intervals(found: Samples) -> Iterator[Interval]:
    """Intervals of consecutive speeds at which the same modes grow, to half way to the
    next speeds.
    """
    at, largest, kinds = found.at, found.largest, found.kinds
    ends = np.flatnonzero(kinds[1:] != kinds[:-1])
    cuts = np.concatenate([[0], ends + 1, [at.size]]).tolist()
    marks = np.concatenate([at[:1], 0.5 * (at[ends] + at[ends + 1]), at[-1:]]).tolist()
    for (first, past), (low, high) in zip(pairwise(cuts), pairwise(marks), strict=True):
        if kind := str(kinds[first]):
            worst = first + int(largest[first:past].argmax())
            yield Interval(low, high, float(at[worst]), float(largest[worst]), kind)
