"""Intervals of speed in which vibration grows, traced to their edges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array
from lumped.stability.combinations import N_ORDERS, Combination, combinations
from lumped.stability.mode_labels import Names, candidates, growth
from lumped.stability.multipliers import Method
from lumped.stability.periodic_system import PeriodicSystem

Indices = NDArray[np.intp]
EDGE_RTOL = 2e-8  # relative error of the speed at an edge
MAX_BISECTIONS = 40  # largest number of bisections for an edge
# Halvings of the distance of speeds near an extremum of the multiplier
MAX_HALVINGS = 6
MAX_ORDERS = 60  # harmonics that are considered at low speeds
ROUND_OFF = 1e-9  # round-off of a multiplier
LOG_SPEED_STEP = 0.004  # logarithmic distance of speeds that are always examined
# Speeds in an expected interval, and margin in widths
SPEEDS_PER_INTERVAL, INTERVAL_MARGIN = 11, 0.5


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
        self, indices: Indices, at: Array, largest: Array, kinds: Names
    ) -> SpeedSamples:
        """Return samples with more speeds before those at given indices."""
        return SpeedSamples(
            np.insert(self.at, indices, at),
            np.insert(self.largest, indices, largest),
            np.insert(self.kinds, indices, kinds),
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
    orders = min(max(N_ORDERS, math.ceil(highest / limits[0])), MAX_ORDERS)
    all_combinations = combinations(system, orders=orders)
    labels = candidates(system, all_combinations)
    extra_speeds = _additional_speeds(system, all_combinations, limits)
    at = np.unique(np.concatenate([grid, extra_speeds]))
    samples = SpeedSamples(at, *growth(system, at, labels, method))
    on_grid = samples.largest[np.searchsorted(at, grid)]
    for find_indices, rounds in (
        (_find_extrema, MAX_HALVINGS),
        (_find_changes, MAX_BISECTIONS),
    ):
        for _ in range(rounds):
            indices = find_indices(samples)
            if not indices.size:
                break
            midpoints = 0.5 * (samples.at[indices] + samples.at[indices + 1])
            samples = samples.inserted(
                indices + 1, midpoints, *growth(system, midpoints, labels, method)
            )
    in_range = tuple(
        combination
        for combination in all_combinations
        if combination.comes_near(limits)
    )
    return StabilityScan(on_grid, tuple(_intervals(samples)), in_range)


def _additional_speeds(
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
        if width < SPEEDS_PER_INTERVAL * LOG_SPEED_STEP * combination.at:
            share = np.linspace(
                -INTERVAL_MARGIN, 1.0 + INTERVAL_MARGIN, SPEEDS_PER_INTERVAL
            )
            parts.append(combination.low + width * share)
    at = np.concatenate(parts)
    return at[(at > limits[0]) & (at < limits[1])]


def _find_changes(samples: SpeedSamples) -> Indices:
    """Indices before a change of the growing modes, if the next speed is too far."""
    at = samples.at
    changes = np.flatnonzero(samples.kinds[1:] != samples.kinds[:-1])
    return changes[at[changes + 1] - at[changes] > EDGE_RTOL * at[changes]]


def _find_extrema(samples: SpeedSamples) -> Indices:
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
    is_extremum = (rises > ROUND_OFF) & (falls > ROUND_OFF)
    is_extremum &= (stable[:-2] == stable[1:-1]) & (stable[2:] == stable[1:-1])
    index = np.flatnonzero(is_extremum)
    return np.unique(np.concatenate([index, index + 1]))


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
