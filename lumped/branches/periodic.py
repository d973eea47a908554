"""Branches of periodic motions over a parameter, from one to the next.

They are followed from a start at rest, from motions that sweeps reach on no branch that
is found, and from where the period doubles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

import numpy as np

from lumped.branches.branch_settings import BranchSettings
from lumped.branches.location import locate_bifurcation
from lumped.branches.motions import Family, PeriodicMotion, PeriodicProblem
from lumped.branches.period_map import PeriodMap
from lumped.branches.points import (
    BranchPoint,
    PeriodicBranch,
    branch_point,
    with_bifurcations,
)
from lumped.branches.shooting import shoot
from lumped.common.array_types import Array
from lumped.continuation.arc_length import (
    MIN_COSINE,
    BranchTrace,
    Continuation,
    NoSolution,
    Point,
    StepControl,
    follow_both_ways,
)
from lumped.continuation.bifurcations import (
    CROSSING,
    DOUBLING,
    FOLD,
    HALVED,
    bifurcation_test,
)
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from lumped.steady.response import Response, Status
from lumped.steady.steppers import stepper_of
from lumped.steady.sweep import Direction, SweepPoint, continue_sweep
from lumped.train.bodies import TrainError

# Arc length to the first point of a branch that sets out from motions of one period;
# of more periods it is less, see `switch_length`
SWITCH_LENGTH = 0.01
RANDOM_SPREAD = 3.0  # spread of random states, over the static one
# Part of the parameter's unit by which branches miss each other at doublings
MAX_DOUBLING_GAP = 3e-4
# Part of the parameter's unit, for a branch that ends at its parent's doubling
DOUBLING_TOL = 1e-3
PROBE_FRACTIONS = 0.25, 0.5, 0.75  # of a branch, where it is asked whether it is known
CIRCLE_MARGIN = 0.002  # distance of multipliers from the unit circle
MAX_SHOTS = 4  # points that are tried
# Cosine between tangents where a step meets a contact that opens or closes
MIN_CONTACT_COSINE = 0.8
MOTION_RTOL = 1e-5  # of the static deflection, for motions that are one


@dataclass(eq=False)
class BranchFinder:
    """Follows the branches of a family of systems from one to the next.

    limits : of the parameter
    report : is told the number of the branch and the parameter on the way
    finished : branches in the order in which they were found before, which are not
        followed again
    store_branch : is told each other branch as it is found
    """

    family: Family
    limits: tuple[float, float]
    settings: BranchSettings = field(default_factory=BranchSettings)
    report: Callable[[int, float], None] = lambda number, value: None
    finished: list[PeriodicBranch] = field(default_factory=list)
    store_branch: Callable[[PeriodicBranch], None] = lambda branch: None
    branches: list[PeriodicBranch] = field(default_factory=list)
    doubled: int = 0  # of those found, the doublings of which were followed

    def find(self, value: float) -> None:
        """All branches, the first from rest at a value of the parameter.

        Raises ArithmeticError where the motion diverges or does not repeat there.
        """
        self.from_rest(value)
        self.doublings()
        self.from_sweeps()
        self.doublings()
        self.from_states()
        self.doublings()

    def from_rest(self, value: float) -> None:
        """The branch of the motion that a start at rest leads to.

        Raises ArithmeticError where the motion diverges or does not repeat, TrainError
        for a train without damping.
        """
        system, frequency = self.family.at(value)
        if system.train.damping_ratio == 0.0:
            raise TrainError(
                "damping ratio = 0; motions do not settle, a positive one is needed"
            )
        if not system.static_deflection.any():
            raise TrainError(
                "torque = 0; branches are followed in units of the deflection under "
                "the load, another one is needed"
            )
        self.report(len(self.branches), value)
        response, label = respond(system, frequency), self.family.label_of(value)
        if response.status != Status.PERIODIC:
            raise ArithmeticError(
                f"the motion at {label} is {response.status}, it was not seen to "
                "repeat: "
                "no branch can begin there; allowed is a range that begins elsewhere"
            )
        self._follow_branch_of_motion(value, response, f"from rest at {label}")

    def from_sweeps(self) -> None:
        """Branches of motions that sweeps up and down reach and none yet holds."""
        directions: tuple[Direction, ...] = ("up", "down")
        for direction in directions:
            for value, response in self._sweep_responses(direction):
                label = self.family.label_of(value)
                origin = f"from a sweep {direction} at {label}"
                self._follow_if_periodic(value, response, origin)

    def from_states(self) -> None:
        """Branches of motions that random states lead to and none yet holds.

        They need not hang together with the others: isolated branches are among them.
        """
        random = np.random.default_rng(0)
        for _ in range(self.settings.starts):
            value = float(random.uniform(*self.limits))
            self.report(len(self.branches), value)
            system, frequency = self.family.at(value)
            static_displacement, angular_speed = (
                system.static_state[0],
                2.0 * math.pi * frequency,
            )
            spread = (
                RANDOM_SPREAD
                * np.abs(static_displacement).max()
                * random.standard_normal((2, static_displacement.size))
            )
            state = np.stack(
                [static_displacement + spread[0], angular_speed * spread[1]]
            )
            response = respond(system, frequency, state=state)
            label = self.family.label_of(value)
            self._follow_if_periodic(value, response, f"from a random state at {label}")

    def _follow_if_periodic(
        self, value: float, response: Response, origin: str
    ) -> None:
        """Follow the branch of a motion that repeats soon enough."""
        repeats = response.status == Status.PERIODIC
        if repeats and response.multiple <= self.settings.period_multiple:
            self._follow_branch_of_motion(value, response, origin)

    def _sweep_responses(
        self, direction: Direction
    ) -> Iterator[tuple[float, Response]]:
        """Values of the parameter, and what the motion of the one before becomes."""
        values = np.linspace(*self.limits, self.settings.sweep_points).tolist()
        settings = Settings()

        def station(value: float) -> SweepPoint:
            system, frequency = self.family.at(value)
            self.report(len(self.branches), value)
            return stepper_of(system, settings), frequency

        ordered_values = values if direction == "up" else values[::-1]
        responses, _ = continue_sweep(ordered_values, station, settings)
        yield from zip(ordered_values, responses, strict=False)

    def _follow_branch_of_motion(
        self, value: float, response: Response, origin: str
    ) -> None:
        """Follow the branch of a settled motion, both ways if it is inside."""
        branch = self._continuation_of_multiple(response.multiple)
        balance, _ = branch.problem.at(value)
        x = balance.of_response(response, Settings())
        try:
            start = branch.at(x, value, grows=value < self.limits[1])
        except NoSolution:
            return
        if has_half_period(branch, start) or self._is_known(branch, start):
            return
        bidirectional = self.limits[0] < value < self.limits[1]
        self._follow(branch, start, origin, bidirectional)

    def _is_known(self, branch: Continuation[PeriodicProblem], motion: Point) -> bool:
        """Whether a branch that is found passes through a motion.

        It may begin in any of its common periods, or repeat sooner than it seemed to.
        """
        value, multiple = motion.parameter, branch.problem.multiple
        balance, frequency = branch.problem.at(value)
        for existing in self.branches:
            if multiple % existing.multiple:
                continue
            for crossing in self._motions_of_branch(existing, value):
                existing_balance, _ = self.balance(existing.multiple, value)
                x = existing_balance.lengthened(
                    crossing.x, multiple // existing.multiple
                )
                for periods in range(multiple):
                    shifted = balance.delayed(x, periods, frequency)
                    if (
                        np.abs(shifted - motion.x).max()
                        < MOTION_RTOL * branch.steps.size
                    ):
                        return True
        return False

    def balance(self, multiple: int, value: float) -> tuple[PeriodicMotion, float]:
        """The equations at a value of the parameter, and the mesh frequency [Hz]."""
        return self._continuation_of_multiple(multiple).problem.at(value)

    def solved(self, multiple: int, x: Array, value: float) -> Array:
        """The unknowns near x that solve the equations there; raises NoSolution."""
        return self._continuation_of_multiple(multiple).at(x, value).x

    def motions_at(self, branch: PeriodicBranch, value: float) -> Iterator[BranchPoint]:
        """The motions of a branch at a value of the parameter."""
        motions = self._continuation_of_multiple(branch.multiple).problem
        for point in self._motions_of_branch(branch, value):
            yield branch_point(motions, point)

    def _motions_of_branch(
        self, branch: PeriodicBranch, value: float
    ) -> Iterator[Point]:
        return self._continuation_of_multiple(branch.multiple).crossings(
            branch.points, value
        )

    def doublings(self) -> None:
        """Branches of twice the period that set out from those that are found."""
        while self.doubled < len(self.branches):
            branch = self.branches[self.doubled]
            if 2 * branch.multiple <= self.settings.period_multiple:
                for point in branch.bifurcations:
                    if point.kind == DOUBLING and not self._has_branch_end_at(
                        point, branch
                    ):
                        self._follow_doubling(branch, point, self.doubled)
            self.doubled += 1

    def _has_branch_end_at(self, point: BranchPoint, parent: PeriodicBranch) -> bool:
        """Whether a branch of twice the period has come back to its parent there."""
        return any(
            abs(end.parameter - point.parameter) < DOUBLING_TOL * self.family.unit
            for branch in self.branches
            if branch.multiple == 2 * parent.multiple
            for end in (branch.points[0], branch.points[-1])
        )

    def _follow_doubling(
        self, parent: PeriodicBranch, point: BranchPoint, parent_index: int
    ) -> None:
        branch, single_period = (
            self._continuation_of_multiple(n * parent.multiple) for n in (2, 1)
        )
        x = single_period.problem.at(point.parameter)[0].lengthened(point.x, 2)
        try:
            length = switch_length(parent.multiple)
            start = branch.branch_switch(x, point.parameter, length)
        except NoSolution:
            return
        if has_half_period(branch, start) or self._is_known(branch, start):
            return
        doubling_label = self.family.label_of(point.best_parameter)
        self._follow(
            branch,
            start,
            f"period doubling of branch {parent_index + 1} at {doubling_label}",
        )

    @cached_property
    def _continuation_of_multiple(
        self,
    ) -> Callable[[int], Continuation[PeriodicProblem]]:
        """Branches of motions that repeat after so many common periods."""
        return cache(self._new_continuation)

    def _new_continuation(self, multiple: int) -> Continuation[PeriodicProblem]:
        settings = self.settings
        motions = PeriodicProblem(
            self.family,
            settings.harmonics,
            multiple,
            settings.steepness,
            settings.solver,
        )
        balance, _ = motions.at(self.limits[1])
        steps = StepControl(
            size=balance.size,
            unit=self.family.unit,
            # longer ones lead back to motions of half the period, from which it begins
            first_length=settings.step * min(1.0, 2.0 / multiple),
            max_length=settings.max_step,
            max_points=settings.points,
            min_cosine=MIN_CONTACT_COSINE
            if isinstance(balance, PeriodMap)
            else MIN_COSINE,
        )
        return Continuation(motions, steps)

    def _follow(
        self,
        branch: Continuation[PeriodicProblem],
        start: Point,
        origin: str,
        bidirectional: bool = False,
    ) -> None:
        """Follow a branch from a point and keep it with its bifurcations.

        bidirectional : whether the branch goes on to both sides of the point
        """
        if self.finished and self.finished[0].origin == origin:
            self.branches.append(self.finished.pop(0))
            return
        motions = branch.problem
        one_way = partial(self._follow_one_way, branch)
        trace = follow_both_ways(start, one_way) if bidirectional else one_way(start)
        points = tuple(
            located_point(motions, point) for point in with_bifurcations(branch, trace)
        )
        new_branch = PeriodicBranch(
            motions.multiple, points, origin, trace.reason, trace.closed
        )
        if self._is_duplicate(branch, points):
            return
        points = tuple(self._drop_doubling_artefacts(motions.multiple, points))
        new_branch = replace(new_branch, points=points, error=_error(motions, points))
        self.store_branch(new_branch)
        self.branches.append(new_branch)

    def _drop_doubling_artefacts(
        self, multiple: int, points: tuple[BranchPoint, ...]
    ) -> Iterator[BranchPoint]:
        """Points without folds and crossings where half their period doubles.

        Truncated harmonics leave a gap between branches.
        """
        doubling_values = [
            point.parameter
            for branch in self.branches
            if multiple == 2 * branch.multiple
            for point in branch.bifurcations
            if point.kind == DOUBLING
        ]
        for point in points:
            is_near_doubling = any(
                abs(point.parameter - doubling_value)
                < MAX_DOUBLING_GAP * self.family.unit
                for doubling_value in doubling_values
            )
            is_artefact = is_near_doubling and point.kind in (FOLD, CROSSING)
            yield replace(point, kind="") if is_artefact else point

    def _is_duplicate(
        self, branch: Continuation[PeriodicProblem], points: tuple[BranchPoint, ...]
    ) -> bool:
        """Whether a branch that is found passes through most of some points."""
        probe_points = [
            points[round(fraction * (len(points) - 1))] for fraction in PROBE_FRACTIONS
        ]
        n_known = 0
        for point in probe_points:
            motion = Point(point.x, point.parameter, np.zeros(point.x.size + 1))
            n_known += self._is_known(branch, motion)
        return 2 * n_known > len(probe_points)

    def _follow_one_way(
        self, branch: Continuation[PeriodicProblem], start: Point
    ) -> BranchTrace:
        motions, number = branch.problem, len(self.branches)
        trace = branch.follow(
            start,
            self.limits,
            lambda before, after: _halving_reason(motions, before, after),
            lambda value: self.report(number, value),
        )
        if trace.reason != HALVED:
            return trace
        return _cut_at_halving(branch, trace)


def located_point(motions: PeriodicProblem, point: BranchPoint) -> BranchPoint:
    """A bifurcation with its place by shooting, where that finds it."""
    test = bifurcation_test(point.kind)
    balance, _ = motions.at(point.parameter)
    integrable = motions.steepness is None and balance.system.contacts is None
    if test is None or not integrable:
        return point
    if isinstance(balance, PeriodMap):  # shooting already
        return replace(point, refined_parameter=point.parameter)
    try:
        return replace(
            point,
            refined_parameter=locate_bifurcation(
                motions, point.x, point.parameter, test
            ),
        )
    except ArithmeticError:
        return point


def _error(motions: PeriodicProblem, points: tuple[BranchPoint, ...]) -> float:
    """Relative error of the RMS of the largest motion that shooting finds; NaN if none.

    Next to a bifurcation there is a motion beside it, which shooting may find instead.
    """
    regular_points = [
        p for p in points if np.abs(np.abs(p.multipliers) - 1.0).min() > CIRCLE_MARGIN
    ]
    for point in sorted(regular_points, key=lambda p: -p.figures["dte_rms"].max())[
        :MAX_SHOTS
    ]:
        balance, frequency = motions.at(point.parameter)
        try:
            exact_motion = shoot(balance, point.x, frequency)
        except NoSolution:
            continue
        return exact_motion.error_of(point.figures["dte_rms"])
    return math.nan


def _halving_reason(motions: PeriodicProblem, before: Point, after: Point) -> str:
    """Why a branch ends between points: its motions repeat in half their period."""
    if motions.multiple % 2:
        return ""
    changes_sign = odd_part(motions, before) @ odd_part(motions, after) < 0.0
    return HALVED if changes_sign else ""


def odd_part(motions: PeriodicProblem, point: Point) -> Array:
    """What motions of half the period do not have."""
    balance, frequency = motions.at(point.parameter)
    return balance.odd_part(point.x, frequency)


def switch_length(multiple: int) -> float:
    """Arc length to the first point of the branch of twice the period of motions.

    In a cascade of doublings the part that motions of half the period do not have
    shrinks by 2.5 from branch to branch, where the next one doubles (Feigenbaum).

    multiple : common periods after which the motions repeat
    """
    return SWITCH_LENGTH / multiple


def has_half_period(branch: Continuation[PeriodicProblem], point: Point) -> bool:
    """Whether a motion of an even multiple repeats after half of its period."""
    motions = branch.problem
    if motions.multiple % 2:
        return False
    size = float(np.linalg.norm(odd_part(motions, point)))
    return size < 0.3 * switch_length(motions.multiple // 2) * branch.steps.size


def _cut_at_halving(
    branch: Continuation[PeriodicProblem], trace: BranchTrace
) -> BranchTrace:
    """The last point where motions of half the period are reached."""
    motions, (*_, before, after) = branch.problem, trace.points
    odd_part_before = odd_part(motions, before)
    try:
        halving_point = branch.locate(
            before,
            after,
            lambda point: float(odd_part(motions, point) @ odd_part_before),
        )
    except ArithmeticError:
        return trace
    return replace(trace, points=(*trace.points[:-1], halving_point))
