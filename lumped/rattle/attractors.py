"""Attractors that departures lead to: detection, names and distinction.

A chaotic attractor is identified by its Lyapunov exponent; motions that depart from the
same region as it does belong to it.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Indices
from lumped.common.workers import run_in_threads
from lumped.rattle.arcs import arcs_of, linearise_arcs
from lumped.rattle.kernels import settle as kernel
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import (
    Settled,
    distance,
    follow,
    iterate_map_points,
    itinerary,
    settling_returns,
)
from lumped.rattle.sticking import sticking_from

QUIET, CHAOTIC = "quiet", "chaotic"
END_RTOL = 1e-5  # distance of departures on one orbit
FOOTPRINT_CELLS = 256  # cells a side of a chaotic attractor's footprint
MOTIONS_PER_TASK = 20  # motions that one worker follows at a time
GOLDEN_RATIO = 0.6180339887498949


@dataclass(frozen=True, kw_only=True)
class ClassifierSettings:
    """How long motions that still change are followed, and which count as chaotic.

    long_returns : returns over which motions are followed one at a time
    long_motions : largest number of motions that are followed one at a time
    last_returns : returns in which a motion may still settle after the long run
    lasting : multiple of the iterations after which a motion that settles in the end
        may count as chaotic
    late_returns : smallest number of further returns of the remaining motions
    late_motions : largest number of remaining motions that are followed so far
    checked_cells, checked_multiple, max_settled : number of cells of a footprint that
        are followed further, for which multiple of the iterations, and the largest part
        of them that may settle if the motions there are to count as lasting
    exponent_returns : returns over which a Lyapunov exponent is a mean
    neighbour_distance : distance of the neighbours that yield the exponent
    min_exponent : smallest exponent per return of a chaotic motion; neighbours on
        other motions part by log(n) / n in n returns
    common_part : part of the departures that equal chaotic motions have in common
    """

    long_returns: int = 200_000
    long_motions: int = 50
    last_returns: int = 2000
    lasting: int = 10
    late_returns: int = 15_000
    late_motions: int = 20_000
    checked_cells: int = 40
    checked_multiple: int = 4
    max_settled: float = 0.35
    exponent_returns: int = 20_000
    neighbour_distance: float = 1e-8
    min_exponent: float = 2e-3
    common_part: float = 0.5


DEFAULT_SETTINGS = ClassifierSettings()


@dataclass(frozen=True)
class RattleAttractor:
    """Motion that others converge to.

    name : quiet, P(m, n+, n-) for a motion of m turns with n+ departures from the upper
        and n- impacts on the lower flank, sticking(m) if flanks come to rest on each
        other in between (see `Sticking`), or chaotic
    period : period in turns, 0 if there is none
    point : (time, speed) of a departure
    exponent : largest Lyapunov exponent per turn
    transient_returns : after which a chaotic motion was found to end, 0 if it was not
    """

    name: str
    period: int
    point: tuple[float, float]
    exponent: float
    transient_returns: int = 0


def classify_attractors(
    machine: Machine,
    iterations: int,
    settled: Settled,
    only_settled: bool = True,
    settings: ClassifierSettings = DEFAULT_SETTINGS,
) -> tuple[tuple[RattleAttractor, ...], Indices, Settled]:
    """Attractors, quiet first, the index (c,) of the one each departure leads to, -1 if
    undecided, and the settled departures after further returns of changing motions.

    only_settled : whether a motion that still changes is decided only after transients
        have had time to end; otherwise it may count as chaotic before
    """
    if only_settled and iterations < settling_returns(machine):
        changing = settled.period == kernel.CHANGING
        period = np.where(changing, kernel.UNKNOWN, settled.period)
        settled = settled._replace(period=period)
    classifier = AttractorClassifier(machine, iterations, settings)
    attractor, settled = classifier.sort(settled)
    order = sorted(
        range(len(classifier.attractors)), key=lambda i: _rank(classifier.attractors[i])
    )
    rank = np.empty(len(order) + 1, np.int64)
    rank[order], rank[-1] = np.arange(len(order)), -1
    named = tuple(_numbered([classifier.attractors[i] for i in order]))
    return named, rank[attractor], settled


def _rank(
    attractor: RattleAttractor,
) -> tuple[bool, bool, int, str, tuple[float, float]]:
    quiet, chaotic = attractor.name == QUIET, attractor.name == CHAOTIC
    return not quiet, chaotic, attractor.period, attractor.name, attractor.point


def _numbered(attractors: list[RattleAttractor]) -> Iterator[RattleAttractor]:
    """Attractors with distinct names: chaotic ones numbered, equal names lettered."""
    counts: dict[str, int] = {}
    for attractor in attractors:
        counts[attractor.name] = number = counts.get(attractor.name, 0) + 1
        if attractor.name == CHAOTIC:
            yield replace(attractor, name=f"{CHAOTIC} {number}")
        elif number > 1:
            yield replace(
                attractor, name=f"{attractor.name} {chr(ord('a') + number - 1)}"
            )
        else:
            yield attractor


@dataclass(frozen=True, eq=False)
class Footprint:
    """Region in which a chaotic motion departs: the cells of a grid over a turn and its
    speeds (FOOTPRINT_CELLS, FOOTPRINT_CELLS) that it visits, and their neighbours."""

    low: float
    high: float
    near: NDArray[np.bool_]

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Mask of the departures (c, 2), or more columns, that are in the footprint."""
        row, column = _footprint_cells(points, self.low, self.high)
        inside = (points[:, 1] > self.low) & (points[:, 1] < self.high)
        return np.asarray(inside & self.near[row, column])


def footprint_of(path: Array) -> Footprint:
    low, high = float(path[:, 1].min()), float(path[:, 1].max())
    margin = (high - low) / FOOTPRINT_CELLS
    low, high = low - margin, high + margin
    is_visited = np.zeros((FOOTPRINT_CELLS, FOOTPRINT_CELLS), bool)
    is_visited[_footprint_cells(path, low, high)] = True
    is_near = np.zeros_like(is_visited)
    for shift in np.ndindex(3, 3):
        is_near |= np.roll(is_visited, (shift[0] - 1, shift[1] - 1), axis=(0, 1))
    return Footprint(low, high, is_near)


def _footprint_cells(points: Array, low: float, high: float) -> tuple[Indices, Indices]:
    """Rows and columns of points in a footprint."""
    row = (points[:, 1] - low) / (high - low) * FOOTPRINT_CELLS
    column = points[:, 0] % 1.0 * FOOTPRINT_CELLS
    last = FOOTPRINT_CELLS - 1
    return (
        np.clip(row, 0, last).astype(np.int64),
        np.clip(column, 0, last).astype(np.int64),
    )


def _update_rows(settled: Settled, rows: Indices, followed: Settled) -> None:
    """Replace the results of departures by those of following them further."""
    for column, new_rows in zip(settled, followed, strict=True):
        column[rows] = new_rows


def _even_indices(count: int, most: int) -> Indices:
    """Indices below a count, at most `most`, spread evenly."""
    return np.linspace(0, count - 1, min(most, count)).astype(np.int64)


@dataclass
class AttractorClassifier:
    """Finder of the attractors of cells, one after another."""

    machine: Machine
    iterations: int
    settings: ClassifierSettings = DEFAULT_SETTINGS
    attractors: list[RattleAttractor] = field(default_factory=list)
    footprints: dict[int, Footprint] = field(default_factory=dict)  # by attractor
    lasting: bool | None = None  # whether changing motions keep changing, once known

    def sort(self, settled: Settled) -> tuple[Indices, Settled]:
        """Index (c,) of the attractor of each cell, -1 if undecided, and the settled
        departures after further returns of changing motions; chaotic ones keep theirs.
        """
        number = self._index_of_settled(settled)
        period, returns, end = settled
        settled = Settled(period.copy(), returns.copy(), end.copy())
        changing = np.flatnonzero(settled.period == kernel.CHANGING)
        for attempt in range(1, self.settings.long_motions + 1):
            if not changing.size:
                break
            selected = int(
                changing.size * (GOLDEN_RATIO * attempt % 1.0)
            )  # from everywhere
            index, shares_attractor, settled_departure = self._follow_long(
                settled.end[changing], selected
            )
            number[changing[shares_attractor]] = index
            _update_rows(settled, changing[selected : selected + 1], settled_departure)
            changing = changing[~shares_attractor]
        if changing.size:
            # if there are more than can be followed, an evenly spread selection
            late_returns, late_motions = (
                self.settings.late_returns,
                self.settings.late_motions,
            )
            iterations = max(late_returns, self.iterations)
            selection = changing[
                _even_indices(changing.size, late_motions * late_returns // iterations)
            ]
            settled_later = self._follow_departures(settled.end[selection], iterations)
            settled_later.period[settled_later.period == kernel.CHANGING] = (
                kernel.UNKNOWN
            )
            number[selection] = self._index_of_settled(settled_later)
            _update_rows(settled, selection, settled_later)
        return number, settled

    def _index_of_settled(self, settled: Settled) -> Indices:
        """Index (c,) of the attractor of each cell whose motion no longer changes."""
        number = np.full(settled.period.size, -1)
        if (is_quiet := settled.period == kernel.PERMANENT_CONTACT).any():
            number[is_quiet] = self._index_of_quiet()
        for period in np.unique(settled.period[settled.period > 0]):
            is_of_period = settled.period == period
            number[is_of_period] = self._indices_of_equal_cells(
                partial(self._index_of_orbit, int(period)),
                settled.end[is_of_period],
                np.round(settled.end[is_of_period] / END_RTOL),
            )
        if (is_sticking := settled.period == kernel.STICKING).any():
            ends = settled.end[is_sticking]
            signs = np.sign(ends[:, 1])  # the flank of the departure
            cells = np.stack([np.round(ends[:, 0] / END_RTOL), signs], axis=1)
            number[is_sticking] = self._indices_of_equal_cells(
                self._index_of_sticking, ends, cells
            )
        return number

    def _follow_departures(self, ends: Array, iterations: int) -> Settled:
        """Follow departures on all processors, see `Settled`."""
        departure_shares = np.array_split(ends, max(1, len(ends) // MOTIONS_PER_TASK))
        tasks = [
            partial(iterate_map_points, self.machine, share, iterations)
            for share in departure_shares
        ]
        columns = zip(*run_in_threads(tasks, threading.Event()), strict=True)
        return Settled(*map(np.concatenate, columns))

    def _index_of_quiet(self) -> int:
        for number, attractor in enumerate(self.attractors):
            if attractor.name == QUIET:
                return number
        return self._add(RattleAttractor(QUIET, 1, (math.nan, 0.0), -math.inf))

    def _indices_of_equal_cells(
        self, find: Callable[[Array], int], ends: Array, cells: Array
    ) -> Indices:
        """Attractor indices (c,) of departures, computed once for equal cells."""
        _, first_indices, cell_indices = np.unique(
            cells, axis=0, return_index=True, return_inverse=True
        )
        return np.array([find(ends[i]) for i in first_indices])[cell_indices.ravel()]

    def _find_known(self, name: str, point: tuple[float, float]) -> int | None:
        for number, attractor in enumerate(self.attractors):
            if (
                attractor.name == name
                and distance(attractor.point, point) < 10.0 * END_RTOL
            ):
                return number
        return None

    def _add(self, attractor: RattleAttractor) -> int:
        self.attractors.append(attractor)
        return len(self.attractors) - 1

    def _index_of_sticking(self, release: Array) -> int:
        motion = sticking_from(self.machine, (float(release[0]), float(release[1])))
        if motion is None:
            return -1
        if (number := self._find_known(motion.name, motion.point)) is not None:
            return number
        return self._add(
            RattleAttractor(motion.name, motion.turns, motion.point, -math.inf)
        )

    def _index_of_orbit(self, period: int, point: Array) -> int:
        """Index of the orbit through a departure, found by its fastest departure."""
        path = follow(self.machine, point, period + 1)
        # departures may coincide only after a multiple of the period, and within a
        # turn before flanks come to rest on each other
        repeated_periods = (
            n
            for n in range(1, period)
            if distance(path[0], path[n]) < END_RTOL and path[n, 0] - path[0, 0] > 0.5
        )
        period = next(repeated_periods, period)
        path = path[: period + 1]
        itinerary_of_path = itinerary(path)
        fastest = int(path[:-1, 1].argmax())
        departure = float(path[fastest, 0] % 1.0), float(path[fastest, 1])
        if (number := self._find_known(itinerary_of_path.name, departure)) is not None:
            return number
        linear_map = linearise_arcs(self.machine, arcs_of(self.machine, path))
        largest_multiplier = float(np.abs(np.linalg.eigvals(linear_map)).max())
        exponent = (
            math.log(largest_multiplier) / itinerary_of_path.turns
            if largest_multiplier
            else -math.inf
        )
        return self._add(
            RattleAttractor(
                itinerary_of_path.name, itinerary_of_path.turns, departure, exponent
            )
        )

    def _follow_long(
        self, ends: Array, selected: int
    ) -> tuple[int, NDArray[np.bool_], Settled]:
        """Index of the attractor of one of the departures (c, 2), a mask of those that
        share it, and the settled departure; -1 if the motion has, as far as known,
        neither settled nor become chaotic."""
        settings, start = self.settings, ends[selected]
        settled = iterate_map_points(self.machine, start[None], settings.long_returns)
        is_selected = np.zeros(len(ends), bool)
        is_selected[selected] = True
        if settled.period[0] == kernel.CHANGING:  # unless it has settled in the end
            settled_last = iterate_map_points(
                self.machine, settled.end, settings.last_returns
            )
            settled = settled._replace(period=settled_last.period, end=settled_last.end)
        n_returns = int(settled.returns[0])
        exponent_per_return = math.nan
        is_changing = settled.period[0] == kernel.CHANGING
        if is_changing or n_returns >= settings.lasting * self.iterations:
            exponent_per_return = self._exponent(
                start, min(settings.exponent_returns, n_returns)
            )
        if not exponent_per_return > settings.min_exponent:
            return int(self._index_of_settled(settled)[0]), is_selected, settled
        chaotic = settled._replace(period=np.array([kernel.CHANGING]), end=start[None])
        path = follow(self.machine, start, n_returns)
        footprint = footprint_of(path)
        shares_attractor = footprint.contains(ends) | is_selected
        if not self._keeps_changing(ends[shares_attractor]):
            shares_attractor = is_selected
        for number, existing in self.footprints.items():
            if existing.contains(path).mean() > settings.common_part:
                return number, shares_attractor, chaotic
        turns = path[-1, 0] - path[0, 0]
        exponent = exponent_per_return * n_returns / turns
        fastest = int(path[:, 1].argmax())
        point = float(path[fastest, 0] % 1.0), float(path[fastest, 1])
        settles = 0 if is_changing else n_returns
        number = self._add(RattleAttractor(CHAOTIC, 0, point, exponent, settles))
        self.footprints[number] = footprint
        return number, shares_attractor, chaotic

    def _keeps_changing(self, ends: Array) -> bool:
        """Whether changing motions keep changing. Others are transients, whose
        departures do not show where they lead."""
        if self.lasting is None:
            settings = self.settings
            sample = ends[_even_indices(len(ends), settings.checked_cells)]
            later = self._follow_departures(
                sample, settings.checked_multiple * self.iterations
            )
            part = np.mean(later.period != kernel.CHANGING)
            self.lasting = bool(part < settings.max_settled)
        return self.lasting

    def _exponent(self, point: Array, count: int) -> float:
        """Lyapunov exponent per return."""
        arrays, separation = self.machine.arrays, self.settings.neighbour_distance
        return float(
            kernel.lyapunov_exponent(arrays, point[0], point[1], count, separation)
        )
