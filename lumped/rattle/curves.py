"""Curves of bifurcations over two parameters of the machine, which bound its orbits.

A fold, a doubling or a graze of an orbit is followed as the root of the equations of
its orbit and of one condition, with a parameter of the machine as additional unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from lumped.common.array_types import Array
from lumped.continuation.arc_length import (
    Continuation,
    NoSolution,
    Point,
    StepControl,
    join_traces,
)
from lumped.continuation.bifurcations import FOLD, multiplier_test
from lumped.rattle.branches import (
    GRAZING,
    OrbitBranch,
    OrbitPoint,
    Orbits,
    half_period_difference,
    machine_with,
)
from lumped.rattle.machine import TURN
from lumped.rattle.return_map import Itinerary, distance

GRAZING_FOLD = "grazing fold"
LIMIT_RTOL = 1e-6  # part of the range within which a point is on its limit
MAX_MULTIPLIER = 1e6  # multiplier of an impact that vanishes
MAX_HALF_DIFFERENCE = 0.02  # distance between halves of a period that become equal
CURVE_TOL = 3e-3, 0.03  # distance from a curve: first parameter in its unit, and speed
DIFFERENCE_STEP = 1e-7  # difference of an unknown for derivatives
# Arc lengths, in turns and units of the parameters
FIRST_LENGTH, MAX_LENGTH = 2e-3, 0.02


@dataclass(frozen=True, eq=False)
class Condition:
    """Equations of orbits at a bifurcation of one kind, over a second parameter.

    The unknowns z are those of the orbits and, last, the first parameter over its unit.
    """

    orbits: Orbits
    kind: str
    second: str
    unit: float

    def at(self, value: float) -> Orbits:
        """Equations of the orbits at a value of the second parameter."""
        try:
            machine = machine_with(self.orbits.machine, self.second, value)
        except ValueError as error:
            raise NoSolution(str(error)) from None
        return replace(self.orbits, machine=machine)

    def first(self, z: Array) -> float:
        """Value of the first parameter."""
        return float(z[-1] * self.orbits.unit)

    def distance(self, z: Array, value: float) -> float:
        """Function that is zero at the bifurcation."""
        orbits, x, first = self.at(value), z[:-1], self.first(z)
        if self.kind == GRAZING:
            return orbits.margin(x, first) * TURN / orbits.speed
        # the multipliers themselves are unbounded where an impact vanishes
        closing_sign = 1.0 if self.kind == FOLD else -1.0
        return float(np.linalg.det(orbits.errors(x, first, closing_sign)[1]))

    def errors(self, z: Array, value: float) -> Array:
        errors, _ = self.at(value).errors(z[:-1], self.first(z))
        return np.append(errors, self.distance(z, value))

    def equations(self, x: Array, parameter: float) -> tuple[Array, Array, Array]:
        orbits, first = self.at(parameter), self.first(x)
        errors, by_x, by_first = orbits.equations(x[:-1], first)
        slopes = [
            self.distance(x + step, parameter) - self.distance(x - step, parameter)
            for step in DIFFERENCE_STEP * np.eye(x.size)
        ]
        jacobian = np.vstack(
            [
                np.column_stack([by_x, by_first * orbits.unit]),
                np.array(slopes) / (2.0 * DIFFERENCE_STEP),
            ]
        )
        step = DIFFERENCE_STEP * self.unit
        change = self.errors(x, parameter + step) - self.errors(x, parameter - step)
        errors = np.append(errors, self.distance(x, parameter))
        return errors, jacobian, change / (2.0 * step)

    def branch(self) -> Continuation[Condition]:
        return Continuation(
            self,
            StepControl(
                size=1.0,
                unit=self.unit,
                first_length=FIRST_LENGTH,
                max_length=MAX_LENGTH,
            ),
        )


@dataclass(frozen=True)
class CurvePoint:
    """Bifurcation at values of the first and the second parameter.

    departure : (time, speed) of the first departure
    kind : grazing fold, or empty
    """

    first: float
    second: float
    departure: tuple[float, float]
    kind: str = ""


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """Bifurcations of one kind in order, and the reason why the curve ends."""

    itinerary: Itinerary
    kind: str
    points: tuple[CurvePoint, ...]
    reason: str


def curve_of(
    branch: OrbitBranch,
    point: OrbitPoint,
    second: str,
    limits: tuple[tuple[float, float], tuple[float, float]],
) -> BifurcationCurve:
    """Follow the curve through a bifurcation of a branch.

    second : name of the parameter in addition to that of the branch
    limits : limits of both parameters

    Raises NoSolution if no curve can be followed.
    """
    orbits = branch.orbits
    unit = limits[1][1] - limits[1][0]
    condition = Condition(orbits, point.kind, second, unit)
    start = condition.branch().at(
        np.append(point.x, point.parameter / orbits.unit),
        float(getattr(orbits.machine, second)),
    )
    reversed_start = replace(start, tangent=-start.tangent)
    ends = partial(_end_reason, condition, limits[0])
    traces = [
        condition.branch().follow(p, limits[1], ends) for p in (reversed_start, start)
    ]
    trace = traces[0] if traces[0].closed else join_traces(*traces)
    points = tuple(_points(condition, trace.points, limits[0]))
    return BifurcationCurve(branch.itinerary, point.kind, points, trace.reason)


def is_on(
    curve: BifurcationCurve, branch: OrbitBranch, point: OrbitPoint, second: str
) -> bool:
    """Whether a curve passes through a bifurcation of a branch."""
    if (curve.itinerary, curve.kind) != (branch.itinerary, point.kind):
        return False
    value = getattr(branch.orbits.machine, second)
    time, speed = point.departures[0]
    for one, two in pairwise(curve.points):
        if (one.second - value) * (two.second - value) > 0.0:
            continue
        difference = two.second - one.second
        part = (value - one.second) / difference if difference else 0.0
        first = one.first + part * (two.first - one.first)
        is_near = distance((time, 0.0), (one.departure[0], 0.0)) < 0.25
        is_near &= abs(one.departure[1] - speed) < CURVE_TOL[1] * branch.orbits.speed
        if is_near and abs(first - point.parameter) < CURVE_TOL[0] * branch.orbits.unit:
            return True
    return False


def _end_reason(
    condition: Condition, limits: tuple[float, float], before: Point, after: Point
) -> str:
    if not limits[0] <= condition.first(after.x) <= limits[1]:
        return "the end of the first parameter's range was reached"
    if condition.kind != GRAZING and _margin(condition, after) <= 0.0:
        return GRAZING_FOLD if condition.kind == FOLD else GRAZING
    return ""


def _margin(condition: Condition, point: Point) -> float:
    return condition.at(point.parameter).margin(point.x[:-1], condition.first(point.x))


def _points(
    condition: Condition, points: tuple[Point, ...], limits: tuple[float, float]
) -> Iterator[CurvePoint]:
    """Points within limits, points on them, and intersections with another curve."""
    tests: list[tuple[str, Callable[[Point], float]]] = [
        ("", partial(_limit_excess, condition, limit)) for limit in limits
    ]
    intersection_kind = GRAZING_FOLD if condition.kind in (GRAZING, FOLD) else GRAZING
    tests.append((intersection_kind, partial(_intersection_test, condition)))
    for one, two in pairwise(points):
        yield from _if_inside(condition, one, limits)
        for kind, test in tests:
            if test(one) * test(two) < 0.0:
                try:
                    intersection = condition.branch().locate(one, two, test)
                except ArithmeticError:
                    continue
                yield from _if_inside(condition, intersection, limits, kind)
    yield from _if_inside(condition, points[-1], limits)


def _limit_excess(condition: Condition, limit: float, point: Point) -> float:
    """Excess of the first parameter over a limit, over its unit."""
    return (condition.first(point.x) - limit) / condition.orbits.unit


def _intersection_test(condition: Condition, point: Point) -> float:
    """Distance of a graze from a fold, or of another bifurcation from a graze."""
    if condition.kind != GRAZING:
        return _margin(condition, point)
    orbits = condition.at(point.parameter)
    try:
        multipliers = orbits.multipliers(point.x[:-1], condition.first(point.x))
    except NoSolution:
        return 1.0
    # a vanishing impact has no fold near it; halves become equal at a doubling
    halves = half_period_difference(orbits, point.x[:-1])
    if (
        np.abs(multipliers).max() > MAX_MULTIPLIER
        or np.abs(halves).max() < MAX_HALF_DIFFERENCE
    ):
        return 1.0
    return multiplier_test(multipliers, 1.0)


def _if_inside(
    condition: Condition, point: Point, limits: tuple[float, float], kind: str = ""
) -> Iterator[CurvePoint]:
    """Point, or None if it is out of the range or its orbit passes through a flank."""
    first, orbits = condition.first(point.x), condition.at(point.parameter)
    margin = LIMIT_RTOL * (limits[1] - limits[0])
    virtual = not kind and condition.kind != GRAZING and _margin(condition, point) <= 0
    if limits[0] - margin <= first <= limits[1] + margin and not virtual:
        times, speeds = orbits.starts(point.x[:-1])
        departure = float(times[0] % 1.0), float(-speeds[0])
        yield CurvePoint(first, point.parameter, departure, kind)
