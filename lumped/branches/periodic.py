"""Branches of periodic motions over the mesh frequency, from one to the next.

They are followed from a start at rest, from motions that sweeps reach on no branch that
is found, and from where the period doubles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.branches.balance import HarmonicBalance
from lumped.branches.bifurcations import DOUBLING, BranchPoint, with_bifurcations
from lumped.branches.continuation import Branch, Followed, NoSolution, Point, Steps
from lumped.respond import respond
from lumped.response import Response, Status
from lumped.settings import Settings
from lumped.sweep import Direction, Observer, sweep
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
HALVED = "the period is half of it again"
ASIDE = 0.03  # arc length to the first point of a branch that sets out from another
SAME = 1e-5  # of the static deflection, for motions that are one


@dataclass(frozen=True, kw_only=True)
class BranchSettings:
    """Numerical choices.

    harmonics : of the first mesh's frequency
    step, most_step : first and largest arc length, in which the static deflection and
        the frequency unit count one
    unit_Hz : the frequency unit
    points : at most, of a branch
    speeds : of the sweeps in which further branches are looked for
    period_multiple : most common periods after which motions may repeat
    """

    harmonics: int = 20
    step: float = 0.02
    most_step: float = 0.1
    unit_Hz: float = 1000.0
    points: int = 5000
    speeds: int = 41
    period_multiple: int = 2


@dataclass(frozen=True, eq=False)
class PeriodicBranch:
    """Motions in the order in which they were followed.

    multiple : common periods after which they repeat
    origin, reason : where it begins and why it ends, in words
    """

    multiple: int
    points: tuple[BranchPoint, ...]
    origin: str
    reason: str
    closed: bool = False

    @property
    def bifurcations(self) -> tuple[BranchPoint, ...]:
        return tuple(point for point in self.points if point.kind)


@dataclass
class BranchFinder:
    """Follows a system's branches from one to the next.

    report : is told the number of the branch and the frequency on the way
    """

    system: LumpedSystem
    limits: tuple[float, float]
    settings: BranchSettings = field(default_factory=BranchSettings)
    report: Callable[[int, float], None] = lambda number, frequency: None
    found: list[PeriodicBranch] = field(default_factory=list)
    doubled: int = 0  # of those found, the doublings of which were followed

    def from_rest(self, frequency: float) -> None:
        """The branch of the motion that a start at rest leads to.

        Raises ArithmeticError where the motion diverges or does not repeat.
        """
        if self.system.train.damping_ratio == 0.0:
            raise ArithmeticError(
                "damping ratio = 0; motions do not settle, a positive one is needed"
            )
        response = respond(self.system, frequency)
        if response.status != Status.PERIODIC:
            raise ArithmeticError(
                f"the motion at {frequency:g} Hz is {response.status}: no branch can "
                "begin there; allowed is a range that begins at another speed"
            )
        self._from_motion(response, f"from rest at {frequency:g} Hz")

    def from_sweeps(self) -> None:
        """Branches of motions that sweeps up and down reach and none yet holds."""
        speeds = np.linspace(*self.limits, self.settings.speeds)
        directions: tuple[Direction, ...] = ("up", "down")
        for direction in directions:
            observer = Observer(watch=self._watch)
            branch = sweep(self.system, speeds, direction, observer=observer)
            for response in branch.responses:
                repeats = response.status == Status.PERIODIC
                if repeats and response.multiple <= self.settings.period_multiple:
                    origin = f"from a sweep {direction} at {response.frequency:g} Hz"
                    self._from_motion(response, origin)

    def _watch(self, frequency: float, period: int) -> None:
        self.report(len(self.found), frequency)

    def _from_motion(self, response: Response, origin: str) -> None:
        """Follow the branch of a settled motion, both ways if it is inside."""
        balance = self._balance(response.multiple)
        branch, frequency = self._branch(balance), response.frequency
        x = balance.of_response(response, Settings())
        try:
            start = branch.at(x, frequency, grows=frequency < self.limits[1])
        except NoSolution:
            return
        if repeats_sooner(branch, start) or self._is_known(balance, start):
            return
        self._follow(branch, start, origin)
        inside = self.limits[0] < frequency < self.limits[1]
        if inside and not self.found[-1].closed:
            back = Point(start.x, start.parameter, -start.tangent)
            self._follow(branch, back, origin)

    def _is_known(self, balance: HarmonicBalance, motion: Point) -> bool:
        """Whether a branch that is found passes through a motion.

        It may begin in any of its common periods, or repeat sooner than it seemed to.
        """
        frequency, size = motion.parameter, self._branch(balance).steps.size
        for found in self.found:
            if balance.multiple % found.multiple:
                continue
            own, times = self._balance(found.multiple), balance.multiple
            own_branch = self._branch(own)
            for one, two in pairwise(found.points):
                if (one.frequency - frequency) * (two.frequency - frequency) > 0.0:
                    continue
                apart = two.frequency - one.frequency
                part = (frequency - one.frequency) / apart if apart else 0.0
                try:
                    near = own_branch.at(one.x + part * (two.x - one.x), frequency)
                except NoSolution:
                    continue
                x = own.lengthened(near.x, times // found.multiple)
                for periods in range(times):
                    shifted = balance.delayed(x, periods)
                    if np.abs(shifted - motion.x).max() < SAME * size:
                        return True
        return False

    def doublings(self) -> None:
        """Branches of twice the period that set out from those that are found."""
        while self.doubled < len(self.found):
            branch = self.found[self.doubled]
            if 2 * branch.multiple <= self.settings.period_multiple:
                for point in branch.bifurcations:
                    if point.kind == DOUBLING and not self._ends_at(point, branch):
                        self._double(branch, point, self.doubled)
            self.doubled += 1

    def _ends_at(self, point: BranchPoint, parent: PeriodicBranch) -> bool:
        """Whether a branch of twice the period has come back to its parent there."""
        return any(
            branch.multiple == 2 * parent.multiple
            and abs(branch.points[-1].frequency / point.frequency - 1.0) < SAME
            for branch in self.found
        )

    def _double(self, parent: PeriodicBranch, point: BranchPoint, number: int) -> None:
        balance = self._balance(2 * parent.multiple)
        branch = self._branch(balance)
        x = self._balance(parent.multiple).lengthened(point.x, 2)
        aside = _softest(balance.equations(x, point.frequency)[1])
        row = np.append(aside, 0.0)
        try:
            start, _ = branch.solve(
                branch.scaled(x, point.frequency) + ASIDE * row, row, 10.0 * ASIDE
            )
        except NoSolution:
            return
        if repeats_sooner(branch, start) or self._is_known(balance, start):
            return
        if start.tangent @ row < 0.0:
            start = Point(start.x, start.parameter, -start.tangent)
        origin = f"period doubling of branch {number + 1} at {point.frequency:.6g} Hz"
        self._follow(branch, start, origin)

    def _balance(self, multiple: int) -> HarmonicBalance:
        return HarmonicBalance(self.system, self.settings.harmonics, multiple)

    def _branch(self, balance: HarmonicBalance) -> Branch[HarmonicBalance]:
        settings = self.settings
        steps = Steps(
            size=float(np.abs(balance.forces.static).max()),
            unit=settings.unit_Hz,
            first=settings.step,
            most=settings.most_step,
            count=settings.points,
        )
        return Branch(balance, steps)

    def _follow(
        self, branch: Branch[HarmonicBalance], start: Point, origin: str
    ) -> None:
        """Follow a branch and keep it with its bifurcations.

        It ends where its motions repeat after half of their period.
        """
        balance = branch.problem

        def ends(before: Point, after: Point) -> str:
            crosses = odd_part(balance, before) @ odd_part(balance, after) < 0.0
            return HALVED if crosses and balance.multiple % 2 == 0 else ""

        number = len(self.found)
        followed = branch.follow(
            start,
            self.limits,
            ends,
            lambda frequency: self.report(number, frequency),
        )
        if followed.reason == HALVED:
            followed = _cut_at_its_end(branch, followed)
        points = tuple(with_bifurcations(branch, followed))
        self.found.append(
            PeriodicBranch(
                balance.multiple, points, origin, followed.reason, followed.closed
            )
        )


def odd_part(balance: HarmonicBalance, point: Point) -> Array:
    """Harmonics of a series that motions of half the period do not have."""
    series, H = point.x.reshape(balance.shape), balance.series.order
    return np.concatenate([series[1 : H + 1 : 2], series[H + 1 :: 2]]).ravel()


def repeats_sooner(branch: Branch[HarmonicBalance], point: Point) -> bool:
    """Whether a motion of an even multiple repeats after half of its period."""
    balance = branch.problem
    even = balance.multiple % 2 == 0
    size = float(np.linalg.norm(odd_part(balance, point)))
    return even and size < 0.1 * ASIDE * branch.steps.size


def _cut_at_its_end(branch: Branch[HarmonicBalance], followed: Followed) -> Followed:
    """The last point where motions of half the period are reached."""
    balance, (*_, before, after) = branch.problem, followed.points
    towards = odd_part(balance, before)
    try:
        last = branch.between(
            before, after, lambda point: float(odd_part(balance, point) @ towards)
        )
    except ArithmeticError:
        return followed
    return replace(followed, points=(*followed.points[:-1], last))


def _softest(matrix: Array) -> Array:
    """Unit vector (u,) that a matrix (u, u) nearly takes to nothing."""
    return np.asarray(np.linalg.svd(matrix)[2][-1])
