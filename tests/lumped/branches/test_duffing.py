"""Branches of the Duffing oscillator beside their closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.continuation.arc_length import Continuation, StepControl

DAMPING, CUBIC, FORCE = 0.05, 1.0, 0.1


class Duffing:
    """x'' + 2 DAMPING x' + x + CUBIC x^3 = FORCE cos(w t) by one harmonic.

    Unknowns are the cosine a and the sine b; the parameter is w.
    """

    def equations(self, x, parameter):
        (a, b), w = x, parameter
        square, c = a * a + b * b, 2.0 * DAMPING * w
        k = 1.0 - w * w + 0.75 * CUBIC * square
        errors = np.array([k * a + c * b - FORCE, k * b - c * a])
        bend = 1.5 * CUBIC
        by_x = np.array(
            [[k + bend * a * a, bend * a * b + c], [bend * a * b - c, k + bend * b * b]]
        )
        by_w = np.array(
            [-2.0 * w * a + 2.0 * DAMPING * b, -2.0 * w * b - 2.0 * DAMPING * a]
        )
        return errors, by_x, by_w


def speeds(amplitude):
    """Both w (2,) at an amplitude A: [(1 - w^2 + 3/4 c A^2)^2 + (2 d w)^2] A^2 = F^2.

    A quadratic in w^2: Nayfeh and Mook, Nonlinear Oscillations (1979), section 4.1,
    without their expansion about w = 1.
    """
    stiff = 1.0 + 0.75 * CUBIC * amplitude**2
    half = stiff - 2.0 * DAMPING**2
    root = np.sqrt(half**2 - stiff**2 + (FORCE / amplitude) ** 2 + 0j)
    return np.sqrt(half + root * np.array([-1.0, 1.0]))


@pytest.fixture(scope="module")
def followed():
    branch = Continuation(Duffing(), StepControl(size=0.5, unit=1.0))
    start = branch.at(np.array([FORCE, 0.0]), 0.3)
    return branch, branch.follow(start, (0.3, 3.0))


def test_response_is_that_of_the_closed_form(followed):
    _, trace = followed
    assert trace.reason == "the end of the range was reached"
    for point in trace.points:
        error = np.abs(speeds(math.hypot(*point.x)) - point.parameter).min()
        assert error < 1e-6, point.parameter


def test_folds_are_where_the_speed_turns(followed):
    branch, trace = followed
    folds = [
        branch.locate(a, b, lambda point: point.parameter_rate).parameter
        for a, b in zip(trace.points, trace.points[1:], strict=False)
        if a.parameter_rate * b.parameter_rate < 0.0
    ]
    # the higher speed falls with the amplitude, rises again, and falls to the peak's
    peak = math.hypot(*max(trace.points, key=lambda point: math.hypot(*point.x)).x)
    higher = [speeds(a)[1].real for a in np.linspace(0.15, peak, 20_001)]
    lowest = int(np.argmin(higher))
    exact = higher[lowest], max(higher[lowest:])
    assert sorted(folds) == pytest.approx(exact, rel=1e-6)
