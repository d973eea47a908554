"""Branches of equations whose solutions are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.continuation.arc_length import Continuation, NoSolution, StepControl


class Circle:
    """x^2 + p^2 = 1."""

    def equations(self, x, parameter):
        return x**2 + parameter**2 - 1.0, np.diag(2.0 * x), np.array([2.0 * parameter])


class Cubic:
    """p = x^3 - x: folds at x = -1/sqrt(3) and 1/sqrt(3)."""

    def equations(self, x, parameter):
        return x**3 - x - parameter, np.diag(3.0 * x**2 - 1.0), np.array([-1.0])


class Wall:
    """A straight branch that cannot be evaluated beyond p = 0.5."""

    def equations(self, x, parameter):
        if parameter > 0.5:
            raise ArithmeticError("beyond")
        return x - parameter, np.eye(1), np.array([-1.0])


def branch_of(problem, **steps):
    return Continuation(problem, StepControl(size=1.0, unit=1.0, **steps))


def test_a_circle_closes():
    branch = branch_of(Circle())
    trace = branch.follow(branch.at(np.array([1.0]), 0.0), (-2.0, 2.0))
    assert trace.closed
    radii = [math.hypot(point.x[0], point.parameter) for point in trace.points]
    np.testing.assert_allclose(radii, 1.0, rtol=1e-12)
    assert len(trace.points) > 50


def test_folds_are_passed_and_located():
    branch = branch_of(Cubic())
    trace = branch.follow(branch.at(np.array([-1.5]), -1.875), (-1.875, 1.875))
    assert trace.reason == "the end of the range was reached"
    assert trace.points[-1].parameter == pytest.approx(1.875, abs=1e-12)
    folds = [
        branch.locate(a, b, lambda point: point.parameter_rate)
        for a, b in zip(trace.points, trace.points[1:], strict=False)
        if a.parameter_rate * b.parameter_rate < 0.0
    ]
    at = sorted(point.x[0] for point in folds)
    np.testing.assert_allclose(at, [-1.0 / math.sqrt(3.0), 1.0 / math.sqrt(3.0)], 1e-7)
    values = sorted(point.parameter for point in folds)
    np.testing.assert_allclose(values, [-2.0 / 27.0**0.5, 2.0 / 27.0**0.5], 1e-12)


@pytest.mark.parametrize("grows", [True, False])
def test_direction_of_the_start_is_that_of_the_parameter(grows):
    branch = branch_of(Cubic())
    start = branch.at(np.array([-1.5]), -1.8, grows)
    assert (start.parameter_rate > 0.0) == grows
    end = branch.follow(start, (-2.0, -1.5)).points[-1]
    assert end.parameter == (-1.5 if grows else -2.0)


def test_a_branch_that_cannot_go_on_says_why_and_keeps_its_points():
    branch = branch_of(Wall())
    trace = branch.follow(branch.at(np.array([0.0]), 0.0), (-1.0, 1.0))
    assert trace.reason.startswith("no solution was found beyond 0.5")
    assert 0.4 < trace.points[-1].parameter <= 0.5


class Fork:
    """A pitchfork that is imperfect by a hair: x^3 - p x + 1e-9 = 0."""

    def equations(self, x, parameter):
        return (
            x**3 - parameter * x + 1e-9,
            np.array([3.0 * x**2 - parameter]),
            -x,
        )


@pytest.mark.parametrize(("regular", "mixed"), [(True, False), (False, True)])
def test_a_step_onto_a_branch_close_by_is_taken_back(regular, mixed):
    """The upper prong turns round before it meets the lower one."""
    branch = branch_of(Fork(), regular=regular)
    followed = branch.follow(branch.at(np.ones(1), 1.0, False), (-1.0, 1.5))
    values = [float(point.x[0]) for point in followed.points]
    assert (min(values) < 0.0) == mixed
    if not mixed:
        assert followed.points[-1].parameter == 1.5


class Pole:
    """x = 1 / (1 - p), which grows beyond every bound."""

    def equations(self, x, parameter):
        return x * (1.0 - parameter) - 1.0, np.diag([1.0 - parameter]), -x


def test_a_branch_that_grows_without_bound_is_given_up():
    branch = branch_of(Pole())
    trace = branch.follow(branch.at(np.array([1.0]), 0.0), (-1.0, 2.0))
    assert "more than 1000 times" in trace.reason
    assert len(trace.points) < 1000
    exact = [1.0 / (1.0 - point.parameter) for point in trace.points]
    np.testing.assert_allclose([p.x[0] for p in trace.points], exact, rtol=1e-6)


def test_points_are_limited():
    branch = branch_of(Cubic(), max_points=5)
    trace = branch.follow(branch.at(np.array([-1.5]), -1.875), (-2.0, 2.0))
    assert len(trace.points) == 5
    assert "5 points" in trace.reason


def test_no_solution_is_said():
    with pytest.raises(NoSolution):
        branch_of(Circle()).at(np.array([0.5]), 3.0)
