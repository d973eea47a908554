"""Branches of orbits over a parameter of the machine: folds, doublings and grazes.

An orbit is a root of the errors by which its arcs fail to join (see `ArcSequence`). It
can therefore be followed through folds, until it would pass through a flank.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.continuation.arc_length import (
    BranchTrace,
    Continuation,
    NoSolution,
    Point,
    StepControl,
    follow_both_ways,
)
from lumped.continuation.bifurcations import DOUBLING, FOLD, HALVED, multiplier_test
from lumped.rattle.arcs import (
    ArcSequence,
    arcs_of,
    layout_of,
    linearise_arcs,
    margin_of,
)
from lumped.rattle.kernels.arcs import START_SPEED, START_TIME
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import MAP_POINT_TOL, Itinerary, distance, follow

GRAZING = "grazing"
KINDS = FOLD, DOUBLING, GRAZING
DIFFERENCE_STEP = 1e-6  # difference, in the parameter's unit, for its derivatives
# First and largest arc length, in turns and units
FIRST_LENGTH, MAX_LENGTH = 2e-3, 0.02
SWITCH_LENGTH = 2e-3  # arc length to the first point of a branch of twice the period
LIMIT_RTOL = 1e-9  # part of the range within which a point is on its limit
GRAZE_TOL = 1e-5  # distance of unknowns within which a fold is a graze
RANGE_END_RTOL = 1e-3  # part of the range from its end at which a branch has reached it
DOUBLING_TOL = 1e-3  # largest distance from -1 of a multiplier that has passed it


@dataclass(frozen=True, eq=False)
class Orbits:
    """Equations of orbits of one layout over a parameter of `Machine`.

    The unknowns x (2 a,) are times and scaled speeds at the start of arcs.

    speed : scale of the unknown speeds
    unit : unit of the parameter
    """

    machine: Machine
    parameter_name: str
    unit: float
    layout: ArcSequence
    speed: float

    def at(self, value: float) -> Machine:
        """Machine with a value of the parameter; raises NoSolution if impossible."""
        try:
            return machine_with(self.machine, self.parameter_name, value)
        except ValueError as error:
            raise NoSolution(str(error)) from None

    def starts(self, x: Array) -> Array:
        """Times and speeds (2, a)."""
        return x.reshape(2, -1) * [[1.0], [self.speed]]

    def unknowns(self, starts: Array) -> Array:
        return (starts / [[1.0], [self.speed]]).ravel()

    @property
    def _scales(self) -> Array:
        count = self.layout.sides.size
        return np.repeat([1.0, self.speed], count)

    def errors(
        self, x: Array, value: float, closing_sign: float = 1.0
    ) -> tuple[Array, Array]:
        """Errors (2 a,) over the scale of speeds and their derivatives (2 a, 2 a) by x,
        see `ArcSequence.join_residual`."""
        errors, jacobian = self.layout.join_residual(
            self.at(value), self.starts(x), closing_sign
        )
        return errors / self.speed, jacobian * self._scales / self.speed

    def equations(self, x: Array, parameter: float) -> tuple[Array, Array, Array]:
        errors, by_x = self.errors(x, parameter)
        low, high = self._beside(parameter)
        change = self.errors(x, high)[0] - self.errors(x, low)[0]
        return errors, by_x, change / (high - low)

    def _beside(self, value: float) -> tuple[float, float]:
        """Values below and above a value, of which one may be impossible."""
        values = [
            value - DIFFERENCE_STEP * self.unit,
            value + DIFFERENCE_STEP * self.unit,
        ]
        for i in range(2):
            try:
                self.at(values[i])
            except NoSolution:
                values[i] = value
        return values[0], values[1]

    def arcs(self, x: Array, value: float) -> Array:
        return self.layout.arcs(self.at(value), self.starts(x))

    def multipliers(self, x: Array, value: float) -> NDArray[np.complex128]:
        change = linearise_arcs(self.at(value), self.arcs(x, value))
        if not np.isfinite(change).all():
            raise NoSolution("the orbit grazes")
        return np.asarray(np.linalg.eigvals(change), complex)

    def margin(self, x: Array, value: float) -> float:
        return margin_of(self.at(value), self.arcs(x, value))

    def branch(self) -> Continuation[Orbits]:
        steps = StepControl(
            size=1.0,
            unit=self.unit,
            first_length=FIRST_LENGTH,
            max_length=MAX_LENGTH,
            regular=True,
        )
        return Continuation(self, steps)


@dataclass(frozen=True, eq=False)
class OrbitPoint:
    """Orbit of a branch.

    departures : (time in turns from 0 to 1, speed) of each departure
    margin : see `margin_of`
    kind : one of KINDS if the orbit is a bifurcation, otherwise empty
    """

    parameter: float
    x: Array
    departures: tuple[tuple[float, float], ...]
    multipliers: tuple[complex, complex]
    margin: float
    kind: str = ""

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return max(map(abs, self.multipliers))

    @property
    def stable(self) -> bool:
        return self.largest < 1.0


@dataclass(frozen=True, eq=False)
class OrbitBranch:
    """Orbits P(m, n+, n-) in the order in which they were followed.

    origin, reason : start of the branch and reason of its end, in words
    """

    orbits: Orbits
    points: tuple[OrbitPoint, ...]
    origin: str
    reason: str

    @property
    def itinerary(self) -> Itinerary:
        return self.orbits.layout.itinerary

    @property
    def bifurcations(self) -> tuple[OrbitPoint, ...]:
        return tuple(point for point in self.points if point.kind)


@lru_cache(maxsize=64)
def machine_with(machine: Machine, parameter: str, value: float) -> Machine:
    """Machine with another value of a parameter; raises ValueError if impossible."""
    changes: dict[str, Any] = {parameter: value}
    return replace(machine, **changes)


def orbit_point(orbits: Orbits, point: Point, kind: str = "") -> OrbitPoint:
    x, value = point.x, point.parameter
    times, speeds = orbits.starts(x)
    from_upper = (orbits.layout.sides > 0.0) & (orbits.layout.pressed == 0.0)
    departures = tuple(
        (float(t % 1.0), float(-w))
        for t, w in zip(times[from_upper], speeds[from_upper], strict=True)
    )
    try:
        one, two = sorted(map(complex, orbits.multipliers(x, value)), key=abs)
    except NoSolution:
        one = two = complex(np.inf)
    return OrbitPoint(value, x, departures, (one, two), orbits.margin(x, value), kind)


@dataclass(eq=False)
class OrbitFinder:
    """Finder of the branches of a machine's orbits over a parameter.

    doublings : number of period doublings over which further branches are followed
    """

    machine: Machine
    parameter_name: str
    limits: tuple[float, float]
    doublings: int = 1
    report: Callable[[int, float], None] = lambda number, value: None

    def __post_init__(self) -> None:
        self.branches: list[OrbitBranch] = []

    @cached_property
    def unit(self) -> float:
        return self.limits[1] - self.limits[0]

    def from_departure(
        self, itinerary: Itinerary, departure: tuple[float, float], value: float
    ) -> None:
        """Follow the branch of an orbit at a value, unless it is already found.

        departure : one of the departures of the orbit
        """
        machine = machine_with(self.machine, self.parameter_name, value)
        arcs = arcs_of(machine, follow(machine, departure, itinerary.upper + 1))
        layout = layout_of(arcs, itinerary.turns)
        if not len(arcs) or layout.itinerary != itinerary:
            return
        starts = np.stack([arcs[:, START_TIME], arcs[:, START_SPEED]])
        orbits = Orbits(
            self.machine,
            self.parameter_name,
            self.unit,
            layout,
            float(np.abs(starts[1]).max()),
        )
        try:
            point = orbits.branch().at(orbits.unknowns(starts), value)
        except NoSolution:
            return
        if not self._is_known(orbits, point):
            self._follow(orbits, point, f"found at {value:g}", self.doublings)

    def _is_known(self, orbits: Orbits, point: Point) -> bool:
        """Whether a branch already found passes through an orbit."""
        departures = orbit_point(orbits, point).departures
        return any(
            distance(departures[0], departure)
            < MAP_POINT_TOL * (1.0 + departures[0][1])
            for branch in self.branches
            if branch.itinerary == orbits.layout.itinerary
            for crossing in orbits_at(branch, point.parameter)
            for departure in crossing.departures
        )

    def _follow(
        self, orbits: Orbits, start: Point, origin: str, doublings: int
    ) -> None:
        trace = follow_both_ways(start, partial(self._one_way, orbits))
        self._add(orbits, trace, origin, doublings)

    def _one_way(self, orbits: Orbits, start: Point) -> BranchTrace:
        number, branch = len(self.branches) + 1, orbits.branch()
        trace = branch.follow(
            *(start, self.limits, partial(_end_reason, orbits)),
            lambda value: self.report(number, value),
        )
        last = trace.points[-1]
        for limit in self.limits:  # steps beyond the last possible value fail
            if trace.reason in (GRAZING, HALVED):
                break
            if LIMIT_RTOL < abs(limit - last.parameter) / self.unit < RANGE_END_RTOL:
                try:
                    end = branch.at(last.x, limit, limit > last.parameter)
                except NoSolution:
                    break
                points = (*trace.points, end)
                return BranchTrace(points, "the end of the range was reached")
        return trace

    def _add(
        self, orbits: Orbits, trace: BranchTrace, origin: str, doublings: int
    ) -> None:
        """Store a branch, and follow those that start at its period doublings."""
        points = tuple(_drop_duplicate_folds(_with_bifurcations(orbits, trace)))
        if not points:
            return
        branch = OrbitBranch(orbits, points, origin, trace.reason)
        self.branches.append(branch)
        number = len(self.branches)
        if doublings:
            for point in branch.bifurcations:
                if point.kind == DOUBLING:
                    self._double(orbits, point, number, doublings - 1)

    def _double(
        self, parent: Orbits, point: OrbitPoint, number: int, doublings: int
    ) -> None:
        """Follow the branch of twice the period that starts at a doubling."""
        layout, times = parent.layout.doubled, parent.starts(point.x)
        later = times + np.array([[parent.layout.turns], [0.0]])
        orbits = replace(parent, layout=layout)
        x, branch = orbits.unknowns(np.hstack([times, later])), orbits.branch()
        try:
            start = branch.branch_switch(x, point.parameter, SWITCH_LENGTH)
            leaves = orbits.margin(start.x, start.parameter) > 0.0
        except NoSolution:
            return
        if not leaves or self._is_known(orbits, start):
            return
        trace = self._one_way(orbits, start)
        birth = Point(x, point.parameter, np.append(start.tangent[:-1], 0.0))
        trace = replace(trace, points=(birth, *trace.points))
        origin = f"period doubling of branch {number} at {point.parameter:.6g}"
        self._add(orbits, trace, origin, doublings)


def _end_reason(orbits: Orbits, before: Point, after: Point) -> str:
    if orbits.margin(after.x, after.parameter) <= 0.0:
        return GRAZING
    halves = [half_period_difference(orbits, point.x) for point in (before, after)]
    return HALVED if halves[0] @ halves[1] < 0.0 else ""


def half_period_difference(orbits: Orbits, x: Array) -> Array:
    """Difference of the second half of an orbit's arcs and the first, flattened."""
    turns, starts = orbits.layout.turns, x.reshape(2, -1)
    if starts.shape[1] % 2:
        return np.ones(1)
    one, two = np.hsplit(starts, 2)
    return (two - one - [[0.5 * turns], [0.0]]).ravel()


def _with_bifurcations(orbits: Orbits, trace: BranchTrace) -> Iterator[OrbitPoint]:
    """Physical points of a branch, and its bifurcations."""
    branch = orbits.branch()
    for one, two in pairwise(trace.points):
        here, there = orbit_point(orbits, one), orbit_point(orbits, two)
        if here.margin > 0.0:
            yield here
        for kind, test in _tests(orbits, (one, here), (two, there)):
            try:
                bifurcation = orbit_point(orbits, branch.locate(one, two, test), kind)
            except ArithmeticError:
                continue
            if _is_physical(bifurcation):
                yield bifurcation
        last = there
    if last.margin > 0.0:
        yield last


def _drop_duplicate_folds(points: Iterable[OrbitPoint]) -> Iterator[OrbitPoint]:
    """Points without folds that are grazes. Where flanks stop parting, the duration of
    a flight passes through zero, and the branch of the equations turns back."""
    orbit_points = list(points)
    grazes = [point.x for point in orbit_points if point.kind == GRAZING]
    for point in orbit_points:
        at_graze = any(np.abs(point.x - x).max() < GRAZE_TOL for x in grazes)
        if not (point.kind == FOLD and at_graze):
            yield point


def _is_physical(point: OrbitPoint) -> bool:
    """Whether a point is neither a pole of a multiplier near a graze nor beyond it."""
    if point.kind == GRAZING:
        return True
    distance = min(abs(multiplier + 1.0) for multiplier in point.multipliers)
    return point.margin > 0.0 and (point.kind != DOUBLING or distance < DOUBLING_TOL)


def _tests(
    orbits: Orbits, before: tuple[Point, OrbitPoint], after: tuple[Point, OrbitPoint]
) -> Iterator[tuple[str, Callable[[Point], float]]]:
    """Bifurcations between two points, with the functions whose signs show them."""
    (one, here), (two, there) = before, after
    if one.parameter_rate * two.parameter_rate < 0.0:
        yield FOLD, lambda point: point.parameter_rate
    signs = [multiplier_test(np.array(end.multipliers), -1.0) for end in (here, there)]
    if signs[0] * signs[1] < 0.0:
        yield (
            DOUBLING,
            lambda point: multiplier_test(
                orbits.multipliers(point.x, point.parameter), -1.0
            ),
        )
    if here.margin * there.margin <= 0.0:
        yield GRAZING, lambda point: orbits.margin(point.x, point.parameter)


def orbits_at(branch: OrbitBranch, value: float) -> Iterator[OrbitPoint]:
    """Orbits of a branch at a value of the parameter."""
    for crossing in branch.orbits.branch().crossings(branch.points, value):
        with suppress(NoSolution):  # the machine is impossible
            yield orbit_point(branch.orbits, crossing)
