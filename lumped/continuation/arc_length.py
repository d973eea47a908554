"""Branches of solutions of equations with a parameter, followed by arc length.

A predictor along the tangent, Newton's corrector on the plane across it, steps by how
many corrections were needed and how far the branch bends: R. Seydel, Practical
Bifurcation and Stability Analysis, 3rd ed., sections 4.3 to 4.6.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Generic, Protocol, TypeVar

import numpy as np

from lumped.common.array_types import Array

MAX_CORRECTIONS = 12
GROW_UP_TO, SHRINK_FROM = 2, 5  # corrections after which steps grow or shrink
GROWTH, SHRINKAGE = 1.5, 0.4
MIN_COSINE = 0.95  # least cosine between tangents one step apart
CLOSURE_STEPS = 0.6  # steps within which a branch has come back to where it began
NEWTON_TOL = 1e-6  # largest last correction, of the solution: the error is its square
LOCATION_TOL = 1e-8  # of the arc between two points, where something is located
MIN_GROWING_NORM = 5.0  # solution's size beyond which steps grow with it
MAX_NORM = 1000.0  # solution's size at which a branch is given up


class ParametricEquations(Protocol):
    """What a branch solves."""

    def equations(self, x: Array, parameter: float) -> tuple[Array, Array, Array]:
        """Errors (u,), by x (u, u) and by the parameter (u,); may raise
        ArithmeticError."""


@dataclass(frozen=True)
class StepControl:
    """Arc lengths, in units of the solution's size and the parameter's.

    size : of x; unit : of the parameter
    min_cosine : least cosine between tangents one step apart
    regular : whether no two branches cross, so that a step after which the determinant
        of the equations and the tangent has another sign has led to another branch
    """

    size: float
    unit: float
    first_length: float = 0.02
    max_length: float = 0.1
    min_length: float = 1e-6
    max_points: int = 5000
    min_cosine: float = MIN_COSINE
    regular: bool = False


@dataclass(frozen=True, eq=False)
class Point:
    """A solution and the unit tangent (u + 1,) of its branch there, scaled."""

    x: Array
    parameter: float
    tangent: Array

    @property
    def parameter_rate(self) -> float:
        """How fast the parameter grows along the branch."""
        return float(self.tangent[-1])


@dataclass(frozen=True, eq=False)
class BranchTrace:
    """Points in their order, and why no more came: a sentence."""

    points: tuple[Point, ...]
    reason: str
    closed: bool = False


def follow_both_ways(
    start: Point, one_way: Callable[[Point], BranchTrace]
) -> BranchTrace:
    """A branch followed from a point along its tangent and, unless it closes, against
    it.

    one_way : follows the branch from a point along its tangent
    """
    forward = one_way(start)
    if forward.closed:
        return forward
    return join_traces(one_way(replace(start, tangent=-start.tangent)), forward)


def join_traces(backward: BranchTrace, forward: BranchTrace) -> BranchTrace:
    """One branch of two that were followed from one point in opposite directions."""
    reversed_points = [
        replace(point, tangent=-point.tangent) for point in backward.points[1:]
    ]
    reason = forward.reason
    if backward.reason != reason:
        reason = f"{reason}; at its other end {backward.reason}"
    return BranchTrace((*reversed(reversed_points), *forward.points), reason)


class NoSolution(ArithmeticError):
    """Newton's method found no solution."""


class Solution(Protocol):
    """A point of a branch, in the words of its problem."""

    @property
    def x(self) -> Array: ...

    @property
    def parameter(self) -> float: ...


P = TypeVar("P", bound=ParametricEquations)


@dataclass(frozen=True, eq=False)
class Continuation(Generic[P]):
    """Solutions of equations in scaled unknowns z = (x / size, parameter / unit)."""

    problem: P
    steps: StepControl

    def scaled(self, x: Array, parameter: float) -> Array:
        return np.append(x / self.steps.size, parameter / self.steps.unit)

    def _linear(self, z: Array) -> tuple[Array, Array]:
        """Errors (u,) and their matrix (u, u + 1) in scaled unknowns."""
        size, unit = self.steps.size, self.steps.unit
        errors, by_x, by_parameter = self.problem.equations(z[:-1] * size, z[-1] * unit)
        matrix = np.column_stack([by_x, by_parameter * (unit / size)])
        return errors / size, matrix

    def solve(
        self, z: Array, row: Array, max_distance: float = math.inf
    ) -> tuple[Point, int]:
        """The solution on the plane through z across `row`, and its corrections.

        max_distance : largest sum of corrections
        Raises NoSolution.
        """
        start, z = z, z.copy()
        for number in range(1, MAX_CORRECTIONS + 1):
            errors, matrix = self._linear(z)
            extended = np.vstack([matrix, row])
            rhs = np.append(errors, row @ (z - start))
            try:
                step = np.linalg.solve(extended, rhs)
            except np.linalg.LinAlgError:
                break
            z = z - step
            if not np.isfinite(z).all() or np.linalg.norm(z - start) > max_distance:
                break
            if np.abs(step).max() <= NEWTON_TOL:
                return self._point(z, self._tangent(matrix, row)), number
        raise NoSolution("Newton's method found no solution")

    def _tangent(self, matrix: Array, along: Array) -> Array:
        rhs = np.zeros(along.size)
        rhs[-1] = 1.0
        tangent = np.linalg.solve(np.vstack([matrix, along]), rhs)
        return np.asarray(tangent / np.linalg.norm(tangent))

    def _point(self, z: Array, tangent: Array) -> Point:
        return Point(z[:-1] * self.steps.size, float(z[-1] * self.steps.unit), tangent)

    def at(self, x: Array, parameter: float, grows: bool = True) -> Point:
        """The solution near x at a value of the parameter; Raises NoSolution."""
        row = np.zeros(x.size + 1)
        row[-1] = 1.0
        point, _ = self.solve(self.scaled(x, parameter), row)
        tangent = (
            point.tangent if (point.parameter_rate > 0.0) == grows else -point.tangent
        )
        return Point(point.x, point.parameter, tangent)

    def crossings(
        self, points: Sequence[Solution], parameter: float
    ) -> Iterator[Point]:
        """Solutions at a value of the parameter, between points on both sides of it."""
        for one, two in pairwise(points):
            if (one.parameter - parameter) * (two.parameter - parameter) > 0.0:
                continue
            apart = two.parameter - one.parameter
            part = (parameter - one.parameter) / apart if apart else 0.0
            with suppress(NoSolution):
                yield self.at(one.x + part * (two.x - one.x), parameter)

    def branch_switch(self, x: Array, parameter: float, length: float) -> Point:
        """The first point of a branch that crosses this one, at a distance from x along
        the null vector of the equations, its tangent leading away.

        Raises NoSolution.
        """
        _, by_x, _ = self.problem.equations(x, parameter)
        row = np.append(np.linalg.svd(by_x)[2][-1], 0.0)
        start, _ = self.solve(
            self.scaled(x, parameter) + length * row, row, 10.0 * length
        )
        away = start.tangent @ row >= 0.0
        return start if away else replace(start, tangent=-start.tangent)

    def follow(
        self,
        start: Point,
        limits: tuple[float, float],
        end_reason: Callable[[Point, Point], str] = lambda before, after: "",
        callback: Callable[[float], None] = lambda parameter: None,
    ) -> BranchTrace:
        """From a point along its tangent until the parameter leaves its limits.

        The last point is on the limit. A branch that comes back to its start is closed.

        end_reason : why the branch ends between two points, empty where it goes on
        """
        steps, points = self.steps, [start]
        length, reason = (
            steps.first_length,
            f"{steps.max_points} points, as many as were allowed",
        )
        low, high = limits
        while len(points) < steps.max_points:
            last = points[-1]
            z = self.scaled(last.x, last.parameter)
            try:
                point, corrections = self.solve(
                    z + length * last.tangent, last.tangent, 2.0 * length
                )
                ends_here = not low <= point.parameter <= high
                if ends_here:
                    point = self._on_limit(last, point, limits)
                cosine = float(point.tangent @ last.tangent)
                if steps.regular and self._side(point) != self._side(last):
                    cosine = min(cosine, 0.0)
            except ArithmeticError:
                corrections, cosine, ends_here = SHRINK_FROM + 1, -1.0, False
            if cosine < steps.min_cosine and length > steps.min_length:
                length = max(SHRINKAGE * length, steps.min_length)
                continue
            if cosine < 0.0:
                reason = (
                    f"no solution was found beyond {last.parameter:g}, however small "
                    "the step"
                )
                break
            if self._size(point) > MAX_NORM:
                reason = (
                    f"solutions beyond {last.parameter:g} are more than {MAX_NORM:g} "
                    "times the static one"
                )
                break
            if ends_here:
                points.append(point)
                reason = "the end of the range was reached"
                break
            points.append(point)
            callback(point.parameter)
            if reason_now := end_reason(last, point):
                return BranchTrace(tuple(points), reason_now)
            if self._is_closed(points, length):
                return BranchTrace(
                    (*points[:-1], start), "the branch closed", closed=True
                )
            factor = GROWTH if corrections <= GROW_UP_TO else 1.0
            factor = SHRINKAGE if corrections >= SHRINK_FROM else factor
            max_length = steps.max_length * max(
                1.0, self._size(point) / MIN_GROWING_NORM
            )
            length = min(factor * length, max_length)
        return BranchTrace(tuple(points), reason)

    def _side(self, point: Point) -> float:
        """Sign of the determinant of the equations and the tangent, which changes
        where branches cross only."""
        _, matrix = self._linear(self.scaled(point.x, point.parameter))
        return float(np.linalg.slogdet(np.vstack([matrix, point.tangent]))[0])

    def _size(self, point: Point) -> float:
        """Norm of a solution, in units of the static one."""
        return float(np.linalg.norm(point.x)) / self.steps.size

    def _on_limit(
        self, before: Point, after: Point, limits: tuple[float, float]
    ) -> Point:
        limit = min(max(after.parameter, limits[0]), limits[1])
        part = (limit - before.parameter) / (after.parameter - before.parameter)
        x = before.x + part * (after.x - before.x)
        return self.at(x, limit, after.parameter > before.parameter)

    def _is_closed(self, points: list[Point], length: float) -> bool:
        if len(points) < 8:
            return False
        first, last = points[0], points[-1]
        apart = self.scaled(last.x - first.x, last.parameter - first.parameter)
        near = np.linalg.norm(apart) < CLOSURE_STEPS * length
        return bool(near and first.tangent @ last.tangent > MIN_COSINE)

    def midpoint(self, before: Point, after: Point) -> Point:
        """The point of the arc between two, half way; raises NoSolution."""
        a, b = (self.scaled(point.x, point.parameter) for point in (before, after))
        chord = float(np.linalg.norm(b - a))
        midpoint, _ = self.solve(0.5 * (a + b), (b - a) / chord, chord)
        return midpoint

    def locate(
        self, before: Point, after: Point, test: Callable[[Point], float]
    ) -> Point:
        """The point of the arc between two where a test function passes through zero.

        Raises NoSolution where the arc is lost or the function with it.
        """
        from scipy.optimize import brentq

        a, b = (self.scaled(point.x, point.parameter) for point in (before, after))
        row = (b - a) / np.linalg.norm(b - a)
        points = {0.0: before, 1.0: after}

        def start(part: float) -> Array:
            """On the plane of this part, between the nearest points that are known."""
            low = max(place for place in points if place < part)
            high = min(place for place in points if place > part)
            one, two = (
                self.scaled(points[end].x, points[end].parameter) for end in (low, high)
            )
            z = one + (part - low) / (high - low) * (two - one)
            return np.asarray(z + row * (row @ (a + part * (b - a) - z)))

        def value(part: float) -> float:
            if part not in points:
                points[part], _ = self.solve(start(part), row)
            return test(points[part])

        try:
            return points[brentq(value, 0.0, 1.0, xtol=LOCATION_TOL)]
        except ValueError as error:  # no change of sign, or not a number
            raise NoSolution(str(error)) from None
