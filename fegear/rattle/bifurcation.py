"""Branches of a machine's orbits over one of its figures: found, kept and written."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.errors import InputError
from fegear.output import write_text
from fegear.rattle.machines import NamedMachine, figures_of, header_of, unit_name
from fegear.result import Result
from fegear.store import Checkpoint, Keeping
from fegear.version import package_version
from lumped.csv_text import format_csv
from lumped.progress import Progress, silent
from lumped.rattle.branch_figure import draw_orbit_branches
from lumped.rattle.branches import (
    BranchFinder,
    OrbitBranch,
    OrbitPoint,
    machine_with,
)
from lumped.rattle.departures import Itinerary
from lumped.rattle.figure import words_of
from lumped.rattle.long_runs import settled_departures
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import find_orbits
from lumped.workers import run_tasks

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Array = NDArray[np.float64]
END = 1e-6  # of a range, from its ends, where orbits are looked for
HALVINGS = 8  # at most, of parts of a range at whose ends there are different orbits
MORE = 3  # times as many values as at first, with which no more are looked for
LEGEND = {
    "branch, index": "from 1, points in the order of the branch; branch 0: long runs",
    "departure": "from the upper flank, counted from 1",
    "stable": "1 or 0; empty of long runs",
    "largest_multiplier": "modulus, of a small change over a period",
    "kind": "fold, period doubling or grazing; else empty",
}


@dataclass(frozen=True, kw_only=True)
class Search:
    """How branches are found.

    figure : of `Machine`; limits : from where to where
    departures : of a period, at most, of the orbits that are looked for
    velocity : lowest and highest speed at which they are looked for [rad per turn]
    starts : values of the figure at which they are looked for, beside both ends
    runs : values of the figure at which long runs settle
    doublings : how often the period may double on the way from branch to branch
    """

    figure: str
    limits: tuple[float, float]
    departures: int = 2
    velocity: tuple[float, float] = (0.0, 7.0)
    starts: int = 5
    runs: int = 200
    doublings: int = 1

    def values(self, count: int) -> list[float]:
        """Of the figure, in the middle of equal parts."""
        low, high = self.limits
        return [low + (i + 0.5) / count * (high - low) for i in range(count)]

    @property
    def seeds(self) -> list[float]:
        """Values at which orbits are looked for first."""
        low, high = self.limits
        hair = END * (high - low)
        return [low + hair, *self.values(self.starts), high - hair]


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationResult(Result):
    """Branches of a named machine; settled (d, 3): value of the figure, time and speed
    of departures that long runs settle to; unsettled (u,): values, one for each long
    run that has not settled."""

    named: NamedMachine
    search: Search
    branches: tuple[OrbitBranch, ...]
    settled: Array
    unsettled: Array

    @property
    def column(self) -> str:
        """The figure with its unit."""
        return unit_name(self.search.figure)

    def csv(self) -> str:
        """A row for each departure of each point of each branch, then of long runs."""
        names = [
            *("branch", "name", "index", self.column, "departure", "time_turns"),
            *("speed_rad_per_turn", "stable", "largest_multiplier", "kind"),
        ]
        header = {"machine": self.named.name, **header_of(self._fixed), **LEGEND}
        return format_csv(names, self._rows(), header)

    def to_csv(self, path: str | PathLike[str]) -> None:
        write_text(path, self.csv())

    def _rows(self) -> Iterator[list[object]]:
        for number, branch in enumerate(self.branches, start=1):
            name = branch.itinerary.name
            for index, point in enumerate(branch.points, start=1):
                for place, (time, speed) in enumerate(point.departures, start=1):
                    yield [
                        *(number, name, index, point.value, place, time, speed),
                        *(int(point.stable), point.largest, point.kind),
                    ]
        for index, (value, time, speed) in enumerate(self.settled.tolist(), start=1):
            yield [0, "long run", index, value, 1, time, speed, "", float("nan"), ""]

    @property
    def _fixed(self) -> dict[str, Any]:
        """Figures but for the one that varies."""
        figures = figures_of(self.named.machine)
        figures.pop(self.column)
        return figures

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        low, high = self.search.limits
        return {
            **self.named.heading,
            **self._fixed,
            "over": self.column,
            "from": low,
            "to": high,
            "branches": [self._plain(branch) for branch in self.branches],
            "long_runs": self.search.runs,
            "departures_of_long_runs": len(self.settled),
            "unsettled_long_runs": len(self.unsettled),
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        if self.unsettled.size:
            low, high = self.unsettled.min(), self.unsettled.max()
            yield (
                f"left out are long runs that have not settled: {self.unsettled.size}, "
                f"at {self.column} from {low:.6g} to {high:.6g}"
            )

    def _plain(self, branch: OrbitBranch) -> dict[str, Any]:
        values = [point.value for point in branch.points]
        return {
            "name": branch.itinerary.name,
            "points": len(values),
            "stable_points": sum(point.stable for point in branch.points),
            "from": min(values),
            "to": max(values),
            "origin": branch.origin,
            "end": branch.reason,
            "bifurcations": [_bifurcation(each) for each in branch.bifurcations],
        }

    def draw(self) -> Figure:
        words = words_of(self.named.machine, self.search.figure)
        label = self.search.figure.replace("_", " ")
        label += " [rad]" if self.column.endswith("_rad") else ""
        runs, title = self.settled[:, [0, 2]], f"{self.named.name}: {words}"
        limits = self.search.limits
        return draw_orbit_branches(self.branches, runs, limits, label, title)


def _bifurcation(point: OrbitPoint) -> dict[str, Any]:
    return {
        "kind": point.kind,
        "value": point.value,
        "departures": [list(each) for each in point.departures],
    }


def find_bifurcations(
    named: NamedMachine,
    search: Search,
    keeping: Keeping,
    report: Progress = silent,
) -> BifurcationResult:
    """Branches of all orbits that are found at some values, and long runs at others.

    keeping : where orbits and runs are kept as they are finished
    Raises InputError where the figure cannot have the values.
    """
    machine = named.machine
    require_possible(machine, search.figure, search.limits)
    inputs = {"search": repr(search)}
    values = search.values(search.runs)
    with kept_tasks(machine, inputs, keeping, report) as compute:
        found = compute(_orbit_tasks(machine, search, search.seeds))
        found = compute(
            {
                f"run {value!r}": partial(settled_departures, at, search.velocity)
                for value, at in _machines(machine, search, values)
            }
        )
        seeds = search.seeds
        for _ in range(HALVINGS):
            if len(seeds) >= MORE * len(search.seeds):
                break
            seeds = sorted(seeds + list(_between_differing(seeds, found)))
            found = compute(_orbit_tasks(machine, search, seeds))
        branches = _followed(machine, search, _rows_at(found, "orbits", seeds), report)
    settled = np.vstack(
        [np.empty((0, 3))]
        + [
            np.column_stack([np.full(len(rows), value), rows])
            for value, rows in _rows_at(found, "run", values)
        ]
    )
    clear = np.isfinite(settled).all(axis=1)
    return BifurcationResult(
        named, search, branches, settled[clear], settled[~clear, 0]
    )


def _orbit_tasks(
    machine: Machine, search: Search, values: Sequence[float]
) -> dict[str, partial[Array]]:
    """By name; each gives an array that can be kept."""
    return {
        f"orbits {value!r}": partial(orbit_rows, at, search.departures, search.velocity)
        for value, at in _machines(machine, search, values)
    }


def _machines(
    machine: Machine, search: Search, values: Sequence[float]
) -> Iterator[tuple[float, Machine]]:
    for value in values:
        yield value, machine_with(machine, search.figure, value)


def _between_differing(
    seeds: Sequence[float], found: Mapping[str, Array]
) -> Iterator[float]:
    """Half way between values at which not the same motions are found."""
    rows = _rows_at(found, "orbits", seeds)
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


def require_possible(
    machine: Machine, figure: str, limits: tuple[float, float]
) -> None:
    """Raises InputError where a figure cannot have the values of its range."""
    for limit in limits:
        try:
            machine_with(machine, figure, limit)
        except ValueError as error:
            raise InputError(f"--over: {error}") from None


@contextmanager
def kept_tasks(
    machine: Machine,
    inputs: Mapping[str, str],
    keeping: Keeping,
    report: Progress,
) -> Iterator[Callable[[Mapping[str, Callable[[], Array]]], Mapping[str, Array]]]:
    """Computes tasks, kept until what is made of them is made; gives all by name.

    inputs : what determines them beside the machine
    """
    figures = {name: repr(value) for name, value in figures_of(machine).items()}
    checkpoint = keeping.open({**figures, **inputs, "version": package_version()})
    found: dict[str, Array] = {}
    finished = False

    if checkpoint is not None:
        found |= dict(_kept(checkpoint))
        if found:
            keeping.tell(f"{checkpoint.path}: values that are finished: {len(found)}")

    def compute(tasks: Mapping[str, Callable[[], Array]]) -> Mapping[str, Array]:
        left = {name: task for name, task in tasks.items() if name not in found}
        total = len(found) + len(left)

        def take(name: str, rows: Array) -> None:
            found[name] = rows
            if checkpoint is not None:
                checkpoint.add(name, {}, {"rows": rows})
            report("orbits and long runs", len(found), total)

        run_tasks(left.items(), take, threading.Event())
        return found

    try:
        yield compute
        finished = True
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=bool(found) and not finished)


def _kept(checkpoint: Checkpoint) -> Iterator[tuple[str, Array]]:
    for name in checkpoint.branches():
        state = checkpoint.state(name)
        if state is not None:
            yield name, state["rows"]


def _rows_at(
    found: Mapping[str, Array], kind: str, values: Sequence[float]
) -> Iterator[tuple[float, Array]]:
    for value in values:
        yield value, found[f"{kind} {value!r}"]


def _followed(
    machine: Machine,
    search: Search,
    rows: Iterable[tuple[float, Array]],
    report: Progress,
) -> tuple[OrbitBranch, ...]:
    low, high = search.limits

    def watch(number: int, value: float) -> None:
        done = round(100.0 * (value - low) / (high - low))
        report(f"branch {number}", done, 100)

    return followed(machine, search, rows, watch)


def followed(
    machine: Machine,
    search: Search,
    rows: Iterable[tuple[float, Array]],
    watch: Callable[[int, float], None] = lambda number, value: None,
) -> tuple[OrbitBranch, ...]:
    """Branches over a figure from orbits at some values, rows of `orbit_rows`."""
    finder = BranchFinder(
        machine, search.figure, search.limits, search.doublings, watch
    )
    for value, orbits in rows:
        for turns, upper, lower, time, speed in orbits.tolist():
            itinerary = Itinerary(int(turns), int(upper), int(lower))
            finder.from_departure(itinerary, (time, speed), value)
    return tuple(finder.found)
