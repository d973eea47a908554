"""Attractors that departures lead to: recognised, named and told from each other.

Chaotic ones are known by their Lyapunov exponent, and shared by what departs where they
do.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lumped.common.workers import run_together
from lumped.rattle.arcs import arcs_of, linearised
from lumped.rattle.departures import (
    Settled,
    apart,
    follow,
    itinerary,
    settle_departures,
    settling_returns,
)
from lumped.rattle.kernels import settle as kernel
from lumped.rattle.machine import Machine
from lumped.rattle.sticking import sticking_from

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
SHARE = 20  # of those that are given more returns
ALIKE = 1e-5  # distance of departures on one orbit
LONG = 200_000  # returns for which one of the motions that change still is followed
LAST, LASTING = 2000, 10  # returns to settle at last; of the iterations, if chaotic
LATE = 15_000  # returns more of others that change still, at least
# of cells in a footprint, times the iterations in which fewer than this part may settle
CHECKED, AGAIN, LEAVE = 40, 4, 0.35
SEEN = 256  # cells a side of a chaotic attractor's footprint
EXPONENT = 20_000  # returns over which an exponent is a mean
LEAST_CHAOTIC = 2e-3  # exponent per return; neighbours of others part by log(n) / n
BESIDE = 1e-8  # distance of neighbours that tell a Lyapunov exponent
QUIET, CHAOTIC = "quiet", "chaotic"
MOST_CHAOTIC = 50  # motions that are followed for long, at most
MOST_LATE = 20_000  # of those others, with so many more
HALF = 0.5  # of a chaotic motion's departures in another's footprint: it is the same
GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class Attractor:
    """A motion that others settle to.

    name : quiet, P(m, n+, n-) for a motion of m turns with so many departures from the
        upper and impacts on the lower flank, sticking(m) where flanks come to rest on
        each other in between (see `Sticking`), or chaotic
    period : in turns, 0 where it has none; point : (time, speed) of a departure
    exponent : largest Lyapunov exponent per turn
    settles : returns after which a chaotic motion was seen to end; 0 if it was not
    """

    name: str
    period: int
    point: tuple[float, float]
    exponent: float
    settles: int = 0


def sort_departures(
    machine: Machine, iterations: int, settled: Settled, only_settled: bool = True
) -> tuple[tuple[Attractor, ...], Numbers, Settled]:
    """Attractors, quiet first, which one each departure leads to (c,), -1 where it is
    not clear, and where they lead once those that changed still are followed on.

    only_settled : what changes still is clear only if transients have had time to end;
        else it may count as chaotic beforehand
    """
    if only_settled and iterations < settling_returns(machine):
        changing = settled.period == kernel.CHANGING
        period = np.where(changing, kernel.UNKNOWN, settled.period)
        settled = settled._replace(period=period)
    naming = Naming(machine, iterations)
    attractor, settled = naming.sort(settled)
    order = sorted(range(len(naming.found)), key=lambda i: _rank(naming.found[i]))
    place = np.empty(len(order) + 1, np.int64)
    place[order], place[-1] = np.arange(len(order)), -1
    named = tuple(_numbered([naming.found[i] for i in order]))
    return named, place[attractor], settled


def _rank(attractor: Attractor) -> tuple[bool, bool, int, str, tuple[float, float]]:
    quiet, chaotic = attractor.name == QUIET, attractor.name == CHAOTIC
    return not quiet, chaotic, attractor.period, attractor.name, attractor.point


def _numbered(attractors: list[Attractor]) -> Iterator[Attractor]:
    """Names of their own: chaotic ones count from 1, equal ones get letters."""
    seen: dict[str, int] = {}
    for each in attractors:
        seen[each.name] = number = seen.get(each.name, 0) + 1
        if each.name == CHAOTIC:
            yield replace(each, name=f"{CHAOTIC} {number}")
        elif number > 1:
            yield replace(each, name=f"{each.name} {chr(ord('a') + number - 1)}")
        else:
            yield each


@dataclass(frozen=True, eq=False)
class Footprint:
    """Departures of a chaotic motion: cells of a grid over a turn and its speeds that
    the motion visits, and their neighbours (SEEN, SEEN).
    """

    low: float
    high: float
    near: NDArray[np.bool_]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether departures (c, 2) or more columns are in it."""
        row, column = _cells(points, self.low, self.high)
        inside = (points[:, 1] > self.low) & (points[:, 1] < self.high)
        return np.asarray(inside & self.near[row, column])


def footprint_of(path: Array) -> Footprint:
    low, high = float(path[:, 1].min()), float(path[:, 1].max())
    margin = (high - low) / SEEN
    low, high = low - margin, high + margin
    seen = np.zeros((SEEN, SEEN), bool)
    seen[_cells(path, low, high)] = True
    near = np.zeros_like(seen)
    for shift in np.ndindex(3, 3):
        near |= np.roll(seen, (shift[0] - 1, shift[1] - 1), axis=(0, 1))
    return Footprint(low, high, near)


def _cells(points: Array, low: float, high: float) -> tuple[Numbers, Numbers]:
    """Rows and columns of a footprint."""
    row = (points[:, 1] - low) / (high - low) * SEEN
    column = points[:, 0] % 1.0 * SEEN
    last = SEEN - 1
    return (
        np.clip(row, 0, last).astype(np.int64),
        np.clip(column, 0, last).astype(np.int64),
    )


def _put(settled: Settled, rows: Numbers, followed: Settled) -> None:
    """Put where departures were followed to in the place of what was known of them."""
    for known, found in zip(settled, followed, strict=True):
        known[rows] = found


def _spread(count: int, most: int) -> Numbers:
    """Numbers up to a count, at most so many, spread over all."""
    return np.linspace(0, count - 1, min(most, count)).astype(np.int64)


@dataclass
class Naming:
    """Finds the attractors of cells one after another."""

    machine: Machine
    iterations: int
    found: list[Attractor] = field(default_factory=list)
    footprints: dict[int, Footprint] = field(default_factory=dict)  # of chaotic ones
    lasting: bool | None = None  # whether what changes keeps changing, once it is known

    def sort(self, settled: Settled) -> tuple[Numbers, Settled]:
        """Number of the attractor of each cell (c,), -1 where it is not clear, and
        where they lead once those that change still are followed on; chaotic ones stay
        where they are."""
        number = self._clear(settled)
        period, returns, end = settled
        settled = Settled(period.copy(), returns.copy(), end.copy())
        changing = np.flatnonzero(settled.period == kernel.CHANGING)
        for attempt in range(1, MOST_CHAOTIC + 1):
            if not changing.size:
                break
            chosen = int(changing.size * (GOLDEN * attempt % 1.0))  # from everywhere
            found, inside, alone = self._long(settled.end[changing], chosen)
            number[changing[inside]] = found
            _put(settled, changing[chosen : chosen + 1], alone)
            changing = changing[~inside]
        if changing.size:
            # of more than can be followed those that are spread over all
            again = max(LATE, self.iterations)
            late = changing[_spread(changing.size, MOST_LATE * LATE // again)]
            later = self._settle(settled.end[late], again)
            later.period[later.period == kernel.CHANGING] = kernel.UNKNOWN
            number[late] = self._clear(later)
            _put(settled, late, later)
        return number, settled

    def _clear(self, settled: Settled) -> Numbers:
        """Number of the attractor of each cell (c,) that does not change still."""
        number = np.full(settled.period.size, -1)
        if (quiet := settled.period == kernel.QUIET).any():
            number[quiet] = self._quiet()
        for period in np.unique(settled.period[settled.period > 0]):
            own = settled.period == period
            number[own] = self._alike(
                partial(self._orbit, int(period)),
                settled.end[own],
                np.round(settled.end[own] / ALIKE),
            )
        if (sticking := settled.period == kernel.STICKING).any():
            ends = settled.end[sticking]
            signs = np.sign(ends[:, 1])  # which flank is left
            cells = np.stack([np.round(ends[:, 0] / ALIKE), signs], axis=1)
            number[sticking] = self._alike(self._sticking, ends, cells)
        return number

    def _settle(self, ends: Array, iterations: int) -> Settled:
        """Follow departures to their ends, on all processors."""
        shares = np.array_split(ends, max(1, len(ends) // SHARE))
        tasks = [
            partial(settle_departures, self.machine, share, iterations)
            for share in shares
        ]
        parts = zip(*run_together(tasks, threading.Event()), strict=True)
        return Settled(*map(np.concatenate, parts))

    def _quiet(self) -> int:
        for number, known in enumerate(self.found):
            if known.name == QUIET:
                return number
        return self._add(Attractor(QUIET, 1, (math.nan, 0.0), -math.inf))

    def _alike(
        self, find: Callable[[Array], int], ends: Array, cells: Array
    ) -> Numbers:
        """Numbers that departures lead to (c,), found once where cells are equal."""
        _, first, which = np.unique(
            cells, axis=0, return_index=True, return_inverse=True
        )
        return np.array([find(ends[i]) for i in first])[which.ravel()]

    def _known(self, name: str, point: tuple[float, float]) -> int | None:
        for number, known in enumerate(self.found):
            if known.name == name and apart(known.point, point) < 10.0 * ALIKE:
                return number
        return None

    def _add(self, attractor: Attractor) -> int:
        self.found.append(attractor)
        return len(self.found) - 1

    def _sticking(self, release: Array) -> int:
        motion = sticking_from(self.machine, (float(release[0]), float(release[1])))
        if motion is None:
            return -1
        if (number := self._known(motion.name, motion.point)) is not None:
            return number
        return self._add(Attractor(motion.name, motion.turns, motion.point, -math.inf))

    def _orbit(self, period: int, point: Array) -> int:
        """The number of the orbit through a departure, by its fastest one."""
        path = follow(self.machine, point, period + 1)
        # departures may have come close a multiple of the period apart only, and within
        # a turn before flanks come to rest on each other
        again = (
            n
            for n in range(1, period)
            if apart(path[0], path[n]) < ALIKE and path[n, 0] - path[0, 0] > 0.5
        )
        period = next(again, period)
        path = path[: period + 1]
        way = itinerary(path)
        fastest = int(path[:-1, 1].argmax())
        at = float(path[fastest, 0] % 1.0), float(path[fastest, 1])
        if (number := self._known(way.name, at)) is not None:
            return number
        change = linearised(self.machine, arcs_of(self.machine, path))
        largest = float(np.abs(np.linalg.eigvals(change)).max())
        exponent = math.log(largest) / way.turns if largest else -math.inf
        return self._add(Attractor(way.name, way.turns, at, exponent))

    def _long(self, ends: Array, chosen: int) -> tuple[int, NDArray[np.bool_], Settled]:
        """The attractor of one of departures (c, 2), which share it, and where the one
        leads; -1 where it has not settled, for all that can be told, and is not
        chaotic."""
        start = ends[chosen]
        settled = settle_departures(self.machine, start[None], LONG)
        alone = np.zeros(len(ends), bool)
        alone[chosen] = True
        if settled.period[0] == kernel.CHANGING:  # unless it has settled at last
            last = settle_departures(self.machine, settled.end, LAST)
            settled = settled._replace(period=last.period, end=last.end)
        lasts = int(settled.returns[0])
        stretches = math.nan
        if settled.period[0] == kernel.CHANGING or lasts >= LASTING * self.iterations:
            stretches = self._exponent(start, min(EXPONENT, lasts))
        if not stretches > LEAST_CHAOTIC:
            return int(self._clear(settled)[0]), alone, settled
        here = settled._replace(period=np.array([kernel.CHANGING]), end=start[None])
        path = follow(self.machine, start, lasts)
        footprint = footprint_of(path)
        inside = footprint.holds(ends) | alone
        if not self._lasts(ends[inside]):
            inside = alone
        for number, known in self.footprints.items():
            if known.holds(path).mean() > HALF:
                return number, inside, here
        turns = path[-1, 0] - path[0, 0]
        exponent = stretches * lasts / turns
        fastest = int(path[:, 1].argmax())
        point = float(path[fastest, 0] % 1.0), float(path[fastest, 1])
        settles = 0 if settled.period[0] == kernel.CHANGING else lasts
        number = self._add(Attractor(CHAOTIC, 0, point, exponent, settles))
        self.footprints[number] = footprint
        return number, inside, here

    def _lasts(self, ends: Array) -> bool:
        """Whether motions that change keep changing; others are on their way only, and
        where they depart tells nothing of where they lead."""
        if self.lasting is None:
            some = ends[_spread(len(ends), CHECKED)]
            later = self._settle(some, AGAIN * self.iterations)
            self.lasting = bool(np.mean(later.period != kernel.CHANGING) < LEAVE)
        return self.lasting

    def _exponent(self, point: Array, count: int) -> float:
        """Per return."""
        arrays = self.machine.arrays
        return float(kernel.stretch(arrays, point[0], point[1], count, BESIDE))
