"""Branches of a machine's orbits over one of its figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from lumped.common.array_types import Array
from lumped.common.progress import Progress, silent
from lumped.common.workers import Arrays, Compute, compute_in_threads
from lumped.rattle.branches import OrbitBranch, OrbitFinder, machine_with
from lumped.rattle.long_runs import settled_departures
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import find_orbits
from lumped.rattle.return_map import Itinerary

RANGE_END_RTOL = 1e-6  # of a range, from its ends, where orbits are looked for
# at most, of parts of a range at whose ends there are different orbits
MAX_HALVINGS = 8
REFINEMENT = 3  # times as many values as at first, with which no more are looked for


@dataclass(frozen=True, kw_only=True)
class OrbitSearch:
    """How branches are found.

    figure : of `Machine`; limits : from where to where
    max_liftoffs : of a period, of the orbits that are looked for
    velocity : lowest and highest speed at which they are looked for [rad per turn]
    starts : parameter values at which they are searched, in addition to both ends
    runs : values of the figure at which long runs settle
    doublings : how often the period may double on the way from branch to branch
    """

    figure: str
    limits: tuple[float, float]
    max_liftoffs: int = 2
    velocity: tuple[float, float] = (0.0, 7.0)
    starts: int = 5
    runs: int = 200
    doublings: int = 1

    def values(self, count: int) -> list[float]:
        """Values of the parameter, in the middle of equal intervals."""
        low, high = self.limits
        return [low + (i + 0.5) / count * (high - low) for i in range(count)]

    @property
    def seeds(self) -> list[float]:
        """Values at which orbits are looked for first."""
        low, high = self.limits
        hair = RANGE_END_RTOL * (high - low)
        return [low + hair, *self.values(self.starts), high - hair]


@dataclass(frozen=True, eq=False)
class BifurcationDiagram:
    """Branches over a figure; settled (d, 3): value of the figure, time and speed of
    lift-offs that long runs settle to; not_converged (u,): values, one for each long
    run that has not settled."""

    branches: tuple[OrbitBranch, ...]
    settled: Array
    not_converged: Array


def find_bifurcations(
    machine: Machine,
    search: OrbitSearch,
    compute: Compute = compute_in_threads,
    report: Progress = silent,
) -> BifurcationDiagram:
    """Branches of all orbits that are found at some values, and long runs at others."""
    seeds, values = search.seeds, search.values(search.runs)
    arrays = {**compute(_find_orbits_at_values(machine, search, seeds))}
    arrays |= compute(
        {
            f"run {value!r}": partial(
                _find_rows, settled_departures, at, search.velocity
            )
            for value, at in _machines_of_values(machine, search, values)
        }
    )
    for _ in range(MAX_HALVINGS):
        if len(seeds) >= REFINEMENT * len(search.seeds):
            break
        more = list(_values_between_differing(seeds, arrays))
        arrays |= compute(_find_orbits_at_values(machine, search, more))
        seeds = sorted(seeds + more)
    low, high = search.limits

    def watch(number: int, value: float) -> None:
        done = round(100.0 * (value - low) / (high - low))
        report(f"branch {number}", done, 100)

    branches = follow_branches(
        machine, search, _rows_at(arrays, "orbits", seeds), watch
    )
    settled = np.vstack(
        [np.empty((0, 3))]
        + [
            np.column_stack([np.full(len(rows), value), rows])
            for value, rows in _rows_at(arrays, "run", values)
        ]
    )
    clear = np.isfinite(settled).all(axis=1)
    return BifurcationDiagram(branches, settled[clear], settled[~clear, 0])


def _find_rows(find: Callable[..., Array], *args: object) -> Arrays:
    """What a function finds, as arrays that can be kept."""
    return {"rows": find(*args)}


def orbits_of(machine: Machine, search: OrbitSearch) -> Callable[[], Arrays]:
    """Finds the rows of `orbit_rows` of a machine."""
    return partial(
        _find_rows, orbit_rows, machine, search.max_liftoffs, search.velocity
    )


def _find_orbits_at_values(
    machine: Machine, search: OrbitSearch, values: Sequence[float]
) -> dict[str, Callable[[], Arrays]]:
    every = _machines_of_values(machine, search, values)
    return {f"orbits {value!r}": orbits_of(at, search) for value, at in every}


def _machines_of_values(
    machine: Machine, search: OrbitSearch, values: Sequence[float]
) -> Iterator[tuple[float, Machine]]:
    for value in values:
        yield value, machine_with(machine, search.figure, value)


def _values_between_differing(
    seeds: Sequence[float], arrays: Mapping[str, Arrays]
) -> Iterator[float]:
    """Half way between values at which not the same motions are found."""
    rows = _rows_at(arrays, "orbits", seeds)
    for (low, one), (high, two) in pairwise(rows):
        if not np.array_equal(one[:, :3], two[:, :3]):
            yield 0.5 * (low + high)


def orbit_rows(
    machine: Machine, departures: int, velocity: tuple[float, float]
) -> Array:
    """Itinerary and a departure of orbits (o, 5)."""
    orbits = find_orbits(machine, departures, velocity)
    rows = [(*orbit.itinerary, *orbit.departures[0]) for orbit in orbits]
    return np.array(rows, float).reshape(-1, 5)


def _rows_at(
    arrays: Mapping[str, Arrays], kind: str, values: Sequence[float]
) -> Iterator[tuple[float, Array]]:
    for value in values:
        yield value, arrays[f"{kind} {value!r}"]["rows"]


def follow_branches(
    machine: Machine,
    search: OrbitSearch,
    rows: Iterable[tuple[float, Array]],
    watch: Callable[[int, float], None] = lambda number, value: None,
) -> tuple[OrbitBranch, ...]:
    """Branches over a figure from orbits at some values, rows of `orbit_rows`."""
    finder = OrbitFinder(machine, search.figure, search.limits, search.doublings, watch)
    for value, orbits in rows:
        for turns, upper, lower, time, speed in orbits.tolist():
            itinerary = Itinerary(int(turns), int(upper), int(lower))
            finder.from_departure(itinerary, (time, speed), value)
    return tuple(finder.branches)
