"""Which motion a machine settles to, from a grid of departures from the upper flank.

Cell-to-cell mapping with many uncorrected returns: the centre of each cell is followed
until it is clear where it leads. C. S. Hsu and R. S. Guttalu, J. Appl. Mech. 47 (1980)
940; section 3.3 of the source.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

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
from lumped.workers import Cluster, run_tasks

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
TILE = 2_000  # cells that a worker takes at a time
ALIKE = 1e-5  # distance of departures on one orbit
LONG = 200_000  # returns for which one of the motions that change still is followed
LAST, LASTING = 2000, 10  # returns to settle at last; of the iterations, if chaotic
LATE = 15_000  # returns more of others that change still
SEEN = 256  # cells a side of a chaotic attractor's footprint
EXPONENT = 20_000  # returns over which an exponent is a mean
LEAST_CHAOTIC = 2e-3  # exponent per return; neighbours of others part by log(n) / n
BESIDE = 1e-8  # distance of neighbours that tell a Lyapunov exponent
QUIET, CHAOTIC = "quiet", "chaotic"
MOST_CHAOTIC = 50  # motions that are followed for long, at most
MOST_LATE = 20_000  # of those others
HALF = 0.5  # of a chaotic motion's departures in another's footprint: it is the same
GOLDEN = 0.6180339887498949
BOX = 5  # cells a side of the boxes of basin entropy


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Departures at the centres of cells, `side` of them in time and in speed.

    velocity : lowest and highest [rad per turn]; times are those of a turn
    """

    side: int
    velocity: tuple[float, float]

    def __post_init__(self) -> None:
        low, high = self.velocity
        if not 0.0 <= low < high < math.inf:
            raise ValueError(f"velocity must rise from 0 or more, got {low:g}:{high:g}")
        if self.side < 1:
            raise ValueError(f"side must be at least 1, got {self.side}")

    @property
    def cells(self) -> int:
        return self.side**2

    def departures(self, first: int, last: int) -> Array:
        """Times and speeds of cells (c, 2) by number, row by row of equal speeds."""
        low, high = self.velocity
        row, column = np.divmod(np.arange(first, last), self.side)
        speed = low + (row + 0.5) / self.side * (high - low)
        return np.stack([(column + 0.5) / self.side, speed], axis=1)


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


@dataclass(frozen=True, eq=False)
class Basins:
    """Of every cell the attractor by its number (side, side), -1 where it is not
    clear, and the returns (side, side) until it was; speeds rise with the rows."""

    machine: Machine
    grid: Grid
    iterations: int
    attractors: tuple[Attractor, ...]
    attractor: Numbers
    returns: Numbers

    @property
    def fractions(self) -> Array:
        """Parts of the cells (attractors,)."""
        clear = self.attractor[self.attractor >= 0]
        return np.bincount(clear, minlength=len(self.attractors)) / self.grid.cells

    @property
    def entropy(self) -> float:
        """Basin entropy of boxes of five cells a side, 0 for one basin; NaN where it is
        not clear where any cell leads.

        A. Daza et al., Sci. Rep. 6 (2016) 31416, eq. 4.
        """
        count = self.grid.side // BOX
        if not count or not self.attractors:
            return math.nan
        inside = self.attractor[: count * BOX, : count * BOX]
        split = inside.reshape(count, BOX, count, BOX).swapaxes(1, 2)
        boxes = split.reshape(count**2, BOX**2)
        found = 0.0
        for number in range(-1, len(self.attractors)):
            part = (boxes == number).mean(axis=1)
            found -= float(np.sum(part * np.log(np.where(part > 0.0, part, 1.0))))
        return found / count**2


def settle_tile(
    machine: Machine, grid: Grid, first: int, last: int, iterations: int
) -> Settled:
    """Where cells lead, from the first to before the last."""
    return settle_departures(machine, grid.departures(first, last), iterations)


def tiles_of(grid: Grid) -> list[tuple[int, int]]:
    """First and last cell of the tiles."""
    return list(pairwise([*range(0, grid.cells, TILE), grid.cells]))


def settle_grid(
    machine: Machine,
    grid: Grid,
    iterations: int,
    known: Mapping[int, Settled],
    keep: Callable[[int, Settled], None] = lambda number, settled: None,
    report: Callable[[int, int], None] = lambda done, total: None,
    workers: int | Cluster | None = None,
) -> Settled:
    """Where all cells lead, in tiles on several cores or on a cluster.

    known : tiles by number that are not computed again
    keep : called with each other tile as it is finished
    Ctrl-C ends the work after the tiles that are under way and is raised again.
    """
    tiles, found = tiles_of(grid), dict(known)

    def take(number: int, settled: Settled) -> None:
        found[number] = settled
        keep(number, settled)
        report(len(found), len(tiles))

    tasks = (
        (number, partial(settle_tile, machine, grid, first, last, iterations))
        for number, (first, last) in enumerate(tiles)
        if number not in found
    )
    run_tasks(tasks, take, threading.Event(), workers)
    parts = zip(*(found[number] for number in range(len(tiles))), strict=True)
    return Settled(*(np.concatenate(part) for part in parts))


def basins_of(
    machine: Machine, grid: Grid, iterations: int, settled: Settled
) -> Basins:
    """The attractors that cells settle to, quiet first, and which cell leads where."""
    attractors, attractor = sort_departures(machine, iterations, settled)
    shape = grid.side, grid.side
    return Basins(
        machine=machine,
        grid=grid,
        iterations=iterations,
        attractors=attractors,
        attractor=attractor.reshape(shape),
        returns=settled.returns.reshape(shape),
    )


def sort_departures(
    machine: Machine, iterations: int, settled: Settled, only_settled: bool = True
) -> tuple[tuple[Attractor, ...], Numbers]:
    """Attractors, quiet first, and which one each departure leads to (c,), -1 where it
    is not clear.

    only_settled : what changes still is clear only if transients have had time to end;
        else it may count as chaotic beforehand
    """
    if only_settled and iterations < settling_returns(machine):
        changing = settled.period == kernel.CHANGING
        period = np.where(changing, kernel.UNKNOWN, settled.period)
        settled = settled._replace(period=period)
    naming = Naming(machine, iterations)
    attractor = naming.sort(settled)
    order = sorted(range(len(naming.found)), key=lambda i: _rank(naming.found[i]))
    place = np.empty(len(order) + 1, np.int64)
    place[order], place[-1] = np.arange(len(order)), -1
    return tuple(_numbered([naming.found[i] for i in order])), place[attractor]


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
    """Where a chaotic motion departs: cells of a grid over a turn and its speeds that
    it comes to, and those beside them (SEEN, SEEN)."""

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


@dataclass
class Naming:
    """Finds the attractors of cells one after another."""

    machine: Machine
    iterations: int
    found: list[Attractor] = field(default_factory=list)
    footprints: dict[int, Footprint] = field(default_factory=dict)  # of chaotic ones

    def sort(self, settled: Settled) -> Numbers:
        """Number of the attractor of each cell (c,), -1 where it is not clear."""
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
        changing = np.flatnonzero(settled.period == kernel.CHANGING)
        for attempt in range(1, MOST_CHAOTIC + 1):
            if not changing.size:
                break
            chosen = int(changing.size * (GOLDEN * attempt % 1.0))  # from everywhere
            found, inside = self._long(settled.end[changing], chosen)
            number[changing[inside]] = found
            changing = changing[~inside]
        if changing.size:
            # of more than can be followed those that are spread over all
            spread = np.linspace(0, changing.size - 1, min(MOST_LATE, changing.size))
            late = changing[spread.astype(np.int64)]
            later = settle_departures(self.machine, settled.end[late], LATE)
            later.period[later.period == kernel.CHANGING] = kernel.UNKNOWN
            number[late] = self.sort(later)
        return number

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
        exponent = self._exponent(point, 100 * period) * period / way.turns
        return self._add(Attractor(way.name, way.turns, at, exponent))

    def _long(self, ends: Array, chosen: int) -> tuple[int, NDArray[np.bool_]]:
        """The attractor of one of departures (c, 2), and which share it; -1 where it
        has not settled, for all that can be told, and is not chaotic."""
        start = ends[chosen]
        settled = settle_departures(self.machine, start[None], LONG)
        alone = np.zeros(len(ends), bool)
        alone[chosen] = True
        if settled.period[0] == kernel.CHANGING:  # unless it has settled at last
            last = settle_departures(self.machine, settled.end, LAST)
            settled = settled._replace(period=last.period)
        lasts = int(settled.returns[0])
        if settled.period[0] != kernel.CHANGING and lasts < LASTING * self.iterations:
            return int(self.sort(settled)[0]), alone
        stretches = self._exponent(start, min(EXPONENT, lasts))
        if not stretches > LEAST_CHAOTIC:
            return -1, alone
        path = follow(self.machine, start, lasts)
        footprint = footprint_of(path)
        inside = footprint.holds(ends) | alone
        for number, known in self.footprints.items():
            if known.holds(path).mean() > HALF:
                return number, inside
        turns = path[-1, 0] - path[0, 0]
        exponent = stretches * lasts / turns
        fastest = int(path[:, 1].argmax())
        point = float(path[fastest, 0] % 1.0), float(path[fastest, 1])
        settles = 0 if settled.period[0] == kernel.CHANGING else lasts
        number = self._add(Attractor(CHAOTIC, 0, point, exponent, settles))
        self.footprints[number] = footprint
        return number, inside

    def _exponent(self, point: Array, count: int) -> float:
        """Per return."""
        arrays = self.machine.arrays
        return float(kernel.stretch(arrays, point[0], point[1], count, BESIDE))
