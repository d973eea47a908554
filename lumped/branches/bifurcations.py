"""What changes along a branch of periodic motions, and where.

A motion is stable where no Floquet multiplier is beyond the unit circle. Along a
branch a multiplier leaves it at +1 in a fold or where branches cross, at -1 where the
period doubles, and as a pair elsewhere, where motions of two frequencies begin.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.branches.balance import HarmonicBalance
from lumped.branches.continuation import Branch, Followed, Point

Array = NDArray[np.float64]
Multipliers = NDArray[np.complex128]
Test = Callable[[Point], float]
FOLD, DOUBLING = "fold", "period doubling"
CROSSING, TORUS = "branch point", "torus"
KINDS = FOLD, DOUBLING, CROSSING, TORUS
REAL = 1e-9  # imaginary part of a multiplier that is real
ONE = 1e-5  # of a frequency: a fold and what its multiplier does
FINE = 4e-3  # of a frequency, between points while a multiplier is near to -1
TURN = 30.0  # of a multiplier, at most, per relative change of frequency
UPRIGHT = 1e-8  # of the tangent along the frequency: the branch stands upright


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A periodic motion.

    multipliers : Floquet's (2 n,); figures (m,) each as of a sweep's response
    kind : of KINDS where it is a bifurcation, else empty
    """

    frequency: float
    x: Array
    multipliers: Multipliers
    figures: dict[str, Array]
    kind: str = ""

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(np.abs(self.multipliers).max())

    @property
    def stable(self) -> bool:
        return self.largest < 1.0


def with_bifurcations(
    branch: Branch[HarmonicBalance], followed: Followed
) -> Iterator[BranchPoint]:
    """The points of a branch, and between them those where something changes."""
    balance = branch.problem
    folds: list[float] = []
    known = list(_with_points_between(branch, followed.points))
    for (a, here), (b, there) in pairwise(known):
        yield here
        for kind, test in _tests(balance, (a, here), (b, there)):
            try:
                between = branch.between(a, b, test)
            except ArithmeticError:
                continue
            at = between.parameter
            if kind == FOLD:
                folds.append(at)
            elif kind == CROSSING and any(abs(f - at) < ONE * at for f in folds):
                continue  # the multiplier of the fold, a hair beside it
            yield replace(branch_point(balance, between), kind=kind)
    yield known[-1][1]


def _with_points_between(
    branch: Branch[HarmonicBalance], points: Sequence[Point]
) -> Iterator[tuple[Point, BranchPoint]]:
    """Points, and more of them where two period doublings could be between."""
    balance = branch.problem
    before: tuple[Point, BranchPoint] | None = None
    waiting = list(reversed(points))
    while waiting:
        here = waiting[-1]
        now = here, branch_point(balance, here)
        if before is not None and _may_double(before[1], now[1]):
            try:
                waiting.append(branch.middle(before[0], here))
                continue
            except ArithmeticError:
                pass
        yield now
        before = now
        waiting.pop()


def _may_double(one: BranchPoint, two: BranchPoint) -> bool:
    """Whether points are far apart while a multiplier is near to -1."""
    apart = abs(one.frequency - two.frequency)
    nearest = min(np.abs(point.multipliers + 1.0).min() for point in (one, two))
    return bool(apart > FINE * one.frequency and nearest < apart / one.frequency * TURN)


def branch_point(balance: HarmonicBalance, point: Point) -> BranchPoint:
    figures = balance.figures(point.x, point.parameter)
    multipliers = _multipliers(balance, point)
    return BranchPoint(point.parameter, point.x, multipliers, figures)


def _multipliers(balance: HarmonicBalance, point: Point) -> Multipliers:
    transfer = balance.monodromy(point.x, point.parameter)
    return np.asarray(np.linalg.eigvals(transfer), complex)


def _tests(
    balance: HarmonicBalance,
    before: tuple[Point, BranchPoint],
    after: tuple[Point, BranchPoint],
) -> Iterator[tuple[str, Test]]:
    """What changes between two points, and the function whose sign tells."""
    (a, one), (b, two) = before, after
    # a train that loses no contact has every amplitude at one frequency
    upright = min(abs(a.along), abs(b.along)) < UPRIGHT
    turns = a.along * b.along < 0.0
    if turns and not upright:
        yield FOLD, lambda point: point.along
    for kind, at in ((DOUBLING, -1.0), (CROSSING, 1.0)):
        crosses = beyond(one.multipliers, at) * beyond(two.multipliers, at) < 0.0
        if crosses and not (kind == CROSSING and (turns or upright)):
            yield kind, partial(_beyond_at, balance, at)
    pairs = pair_modulus(one.multipliers), pair_modulus(two.multipliers)
    if (pairs[0] - 1.0) * (pairs[1] - 1.0) < 0.0:
        yield TORUS, lambda point: pair_modulus(_multipliers(balance, point)) - 1.0


def _beyond_at(balance: HarmonicBalance, at: float, point: Point) -> float:
    return beyond(_multipliers(balance, point), at)


def beyond(multipliers: Multipliers, at: float) -> float:
    """Changes its sign where a real multiplier passes through 1 or -1."""
    return float(np.prod(multipliers * at - 1.0).real)


def pair_modulus(multipliers: Multipliers) -> float:
    """Largest modulus of complex multipliers, NaN where all are real."""
    pairs = np.abs(multipliers[np.abs(multipliers.imag) > REAL])
    return float(pairs.max()) if pairs.size else float("nan")
