"""Intervals of speed in which vibration grows, traced to their edges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.stability.combinations import ORDERS, Combination, combinations
from lumped.stability.mode_labels import Names, candidates, growth
from lumped.stability.multipliers import Method
from lumped.stability.periodic import PeriodicSystem

Array = NDArray[np.float64]
Places = NDArray[np.intp]
EDGE = 2e-8  # relative error of the speed at an edge
BISECTIONS = 40  # largest number of bisections for an edge
HALVINGS = 6  # halvings of the distance of speeds near an extremum of the multiplier
MAX_ORDERS = 60  # harmonics that are considered at low speeds
ROUND_OFF = 1e-9  # round-off of a multiplier
LOG_SPEED_STEP = 0.004  # logarithmic distance of speeds that are always examined
INSIDE, BESIDE = 11, 0.5  # speeds in an expected interval, and margin in widths


@dataclass(frozen=True)
class Interval:
    """Mesh frequencies [Hz] in which vibration grows.

    largest : Floquet multiplier inside, at `worst` [Hz]
    kind : combination of modes that grows there
    """

    low: float
    high: float
    worst: float
    largest: float
    kind: str


@dataclass(frozen=True, eq=False)
class StabilityScan:
    """Largest multiplier of one system at speeds (f,), and intervals of growth.

    expected : combinations of modes by perturbation
    """

    largest: Array
    intervals: tuple[Interval, ...]
    expected: tuple[Combination, ...]

    def kinds(self, speeds: ArrayLike) -> list[str]:
        """Combinations that grow at speeds [Hz], empty where none does."""
        return [
            next((i.kind for i in self.intervals if i.low <= speed <= i.high), "")
            for speed in np.asarray(speeds, float).tolist()
        ]


@dataclass(frozen=True, eq=False)
class SpeedSamples:
    """Speeds (f,) [Hz], rising, with largest multipliers and growing combinations."""

    at: Array
    largest: Array
    kinds: Names

    def inserted(
        self, places: Places, at: Array, largest: Array, kinds: Names
    ) -> SpeedSamples:
        """Return samples with more speeds before those at given indices."""
        return SpeedSamples(
            np.insert(self.at, places, at),
            np.insert(self.largest, places, largest),
            np.insert(self.kinds, places, kinds),
        )


def scan_stability(
    system: PeriodicSystem, speeds: ArrayLike, method: Method = "peano-baker"
) -> StabilityScan:
    """Stability at speeds [Hz], rising, and between them.

    Edges do not depend on the grid, since additional speeds are examined, close
    together where perturbation predicts an interval. Ends of the grid end an interval.
    """
    grid = np.asarray(speeds, float)
    if grid.size < 2 or not (np.diff(grid) > 0.0).all():
        raise ValueError("speeds must be two or more that rise")
    limits = float(grid[0]), float(grid[-1])
    highest = 2.0 * float(system.frequency_Hz.max())
    orders = min(max(ORDERS, math.ceil(highest / limits[0])), MAX_ORDERS)
    every = combinations(system, orders=orders)
    labels = candidates(system, every)
    extra_speeds = _own_speeds(system, every, limits)
    at = np.unique(np.concatenate([grid, extra_speeds]))
    samples = SpeedSamples(at, *growth(system, at, labels, method))
    on_grid = samples.largest[np.searchsorted(at, grid)]
    for find_places, rounds in ((_extremes, HALVINGS), (_changes, BISECTIONS)):
        for _ in range(rounds):
            indices = find_places(samples)
            if not indices.size:
                break
            between = 0.5 * (samples.at[indices] + samples.at[indices + 1])
            samples = samples.inserted(
                indices + 1, between, *growth(system, between, labels, method)
            )
    near = tuple(combination for combination in every if combination.comes_near(limits))
    return StabilityScan(on_grid, tuple(_intervals(samples)), near)


def _own_speeds(
    system: PeriodicSystem, expected: Sequence[Combination], limits: tuple[float, float]
) -> Array:
    """Speeds between limits [Hz], equal in every window except for its ends.

    They are close together where an interval is expected to be narrow.
    """
    top = 2.0 * float(system.frequency_Hz.max())
    first, last = (math.log(speed / top) / LOG_SPEED_STEP for speed in limits)
    even = top * np.exp(
        LOG_SPEED_STEP * np.arange(math.ceil(first), math.floor(last) + 1)
    )
    parts = [even, np.array([c.at for c in expected])]
    for combination in expected:
        width = combination.high - combination.low
        if width < INSIDE * LOG_SPEED_STEP * combination.at:
            share = np.linspace(-BESIDE, 1.0 + BESIDE, INSIDE)
            parts.append(combination.low + width * share)
    at = np.concatenate(parts)
    return at[(at > limits[0]) & (at < limits[1])]


def _changes(samples: SpeedSamples) -> Places:
    """Indices before a change of the growing modes, if the next speed is too far."""
    at = samples.at
    changes = np.flatnonzero(samples.kinds[1:] != samples.kinds[:-1])
    return changes[at[changes + 1] - at[changes] > EDGE * at[changes]]


def _extremes(samples: SpeedSamples) -> Places:
    """Indices near which growth may begin or end between samples: maxima of stable
    multipliers and minima of unstable ones."""
    stable = samples.kinds == ""
    sign = np.where(stable, 1.0, -1.0)
    before, here, after = (
        samples.largest[:-2],
        samples.largest[1:-1],
        samples.largest[2:],
    )
    inner = sign[1:-1]
    with np.errstate(invalid="ignore"):  # infinite values are no extrema
        rises, falls = inner * (here - before), inner * (here - after)
    top = (rises > ROUND_OFF) & (falls > ROUND_OFF)
    top &= (stable[:-2] == stable[1:-1]) & (stable[2:] == stable[1:-1])
    place = np.flatnonzero(top)
    return np.unique(np.concatenate([place, place + 1]))


def _intervals(samples: SpeedSamples) -> Iterator[Interval]:
    """Intervals of successive speeds at which the same modes grow, up to midpoints."""
    at, largest, kinds = samples.at, samples.largest, samples.kinds
    ends = np.flatnonzero(kinds[1:] != kinds[:-1])
    cuts = np.concatenate([[0], ends + 1, [at.size]]).tolist()
    marks = np.concatenate([at[:1], 0.5 * (at[ends] + at[ends + 1]), at[-1:]]).tolist()
    for (first, past), (low, high) in zip(pairwise(cuts), pairwise(marks), strict=True):
        if kind := str(kinds[first]):
            worst = first + int(largest[first:past].argmax())
            yield Interval(low, high, float(at[worst]), float(largest[worst]), kind)
