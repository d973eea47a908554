"""What changes along a branch of periodic motions, and where.

A motion is stable where no Floquet multiplier is beyond the unit circle and its branch
is not upright. `lumped.continuation.bifurcations` has the tests of multipliers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from lumped.branches.motions import PeriodicProblem
from lumped.common.array_types import Array, Complex
from lumped.continuation.arc_length import BranchTrace, Continuation, Point
from lumped.continuation.bifurcations import (
    CROSSING,
    DOUBLING,
    FOLD,
    TORUS,
    multiplier_test,
    pair_modulus,
)

Test = Callable[[Point], float]
KINDS = FOLD, DOUBLING, CROSSING, TORUS
FOLD_TOL = 2e-5  # of the parameter's unit: a fold and what its multiplier does
MAX_SPACING = 8e-3  # of the unit, between points while a multiplier is near to -1
MAX_MULTIPLIER_RATE = 15.0  # of a multiplier, at most, per unit of the parameter
VERTICAL_TOL = 1e-8  # of the tangent along the parameter: the branch is vertical


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A periodic motion.

    parameter : of its branch; frequency : of the first mesh [Hz]
    multipliers : Floquet's (2 n,); figures (m,) each as of a sweep's response
    vertical : whether the tangent is vertical and one multiplier is 1, as of a train
        that loses no contact and has every amplitude at one parameter; such motions are
        not counted as stable
    kind : of KINDS where it is a bifurcation, else empty
    refined_parameter : of a bifurcation by shooting, NaN where that did not find it
    """

    parameter: float
    frequency: float
    x: Array
    multipliers: Complex
    figures: dict[str, Array]
    vertical: bool = False
    kind: str = ""
    refined_parameter: float = math.nan

    @property
    def best_parameter(self) -> float:
        """Parameter as near as it is known."""
        return (
            self.parameter
            if math.isnan(self.refined_parameter)
            else self.refined_parameter
        )

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(np.abs(self.multipliers).max())

    @property
    def stable(self) -> bool:
        return self.largest < 1.0 and not self.vertical


@dataclass(frozen=True, eq=False)
class PeriodicBranch:
    """Motions in the order in which they were followed.

    multiple : common periods after which they repeat
    origin, reason : where it begins and why it ends, in words
    error : of the largest RMS, relative, beside that of shooting; NaN where it fails
    """

    multiple: int
    points: tuple[BranchPoint, ...]
    origin: str
    reason: str
    closed: bool = False
    error: float = math.nan

    @property
    def bifurcations(self) -> tuple[BranchPoint, ...]:
        return tuple(point for point in self.points if point.kind)


def with_bifurcations(
    branch: Continuation[PeriodicProblem], trace: BranchTrace
) -> Iterator[BranchPoint]:
    """The points of a branch, and between them those where something changes."""
    motions, unit = branch.problem, branch.steps.unit
    folds: list[float] = []
    computed = list(_with_points_between(branch, trace.points))
    for (a, here), (b, there) in pairwise(computed):
        yield here
        for kind, test in _tests(motions, (a, here), (b, there)):
            try:
                bifurcation = branch.locate(a, b, test)
            except ArithmeticError:
                continue
            parameter = bifurcation.parameter
            if kind == FOLD:
                folds.append(parameter)
            elif kind == CROSSING and any(
                abs(f - parameter) < FOLD_TOL * unit for f in folds
            ):
                continue  # the multiplier of the fold, a hair beside it
            yield replace(branch_point(motions, bifurcation), kind=kind)
    yield computed[-1][1]


def _with_points_between(
    branch: Continuation[PeriodicProblem], points: Sequence[Point]
) -> Iterator[tuple[Point, BranchPoint]]:
    """Points, and more of them where two period doublings could be between."""
    motions = branch.problem
    previous: tuple[Point, BranchPoint] | None = None
    stack = list(reversed(points))
    while stack:
        here = stack[-1]
        current = here, branch_point(motions, here)
        if previous is not None and _may_double(
            previous[1], current[1], branch.steps.unit
        ):
            try:
                stack.append(branch.midpoint(previous[0], here))
                continue
            except ArithmeticError:
                pass
        yield current
        previous = current
        stack.pop()


def _may_double(one: BranchPoint, two: BranchPoint, unit: float) -> bool:
    """Whether points are far apart while a multiplier is near to -1."""
    spacing = abs(one.parameter - two.parameter) / unit
    nearest = min(np.abs(point.multipliers + 1.0).min() for point in (one, two))
    return bool(spacing > MAX_SPACING and nearest < spacing * MAX_MULTIPLIER_RATE)


def branch_point(motions: PeriodicProblem, point: Point) -> BranchPoint:
    figures = motions.figures(point.x, point.parameter)
    multipliers = _multipliers(motions, point)
    _, frequency = motions.at(point.parameter)
    vertical = bool(abs(point.parameter_rate) < VERTICAL_TOL)
    return BranchPoint(
        point.parameter, frequency, point.x, multipliers, figures, vertical
    )


def _multipliers(motions: PeriodicProblem, point: Point) -> Complex:
    transfer = motions.monodromy(point.x, point.parameter)
    return np.asarray(np.linalg.eigvals(transfer), complex)


def _tests(
    motions: PeriodicProblem,
    before: tuple[Point, BranchPoint],
    after: tuple[Point, BranchPoint],
) -> Iterator[tuple[str, Test]]:
    """Bifurcations between two points, with test functions."""
    (a, one), (b, two) = before, after
    vertical = one.vertical or two.vertical
    turns = a.parameter_rate * b.parameter_rate < 0.0
    if turns and not vertical:
        yield FOLD, lambda point: point.parameter_rate
    for kind, at in ((DOUBLING, -1.0), (CROSSING, 1.0)):
        crosses = (
            multiplier_test(one.multipliers, at) * multiplier_test(two.multipliers, at)
            < 0.0
        )
        if crosses and not (kind == CROSSING and (turns or vertical)):
            yield kind, partial(_multiplier_test_at, motions, at)
    pairs = pair_modulus(one.multipliers), pair_modulus(two.multipliers)
    if (pairs[0] - 1.0) * (pairs[1] - 1.0) < 0.0:
        yield TORUS, lambda point: pair_modulus(_multipliers(motions, point)) - 1.0


def _multiplier_test_at(motions: PeriodicProblem, at: float, point: Point) -> float:
    return multiplier_test(_multipliers(motions, point), at)
