"""Leaps to the periodic motion that a motion approaches."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rim_gears import FIRM

from lumped.steady import newton_shooting
from lumped.steady.integration_settings import Settings
from lumped.steady.newton_shooting import is_stable, stable_fixed_point
from lumped.steady.respond import respond
from lumped.steady.sweep import sweep

PLACE = np.array([0.3, -0.2, 0.5, 0.1])
TOLERANCE = 1e-6


class Curved:
    """A map about a fixed point that contracts as given, but for a curvature."""

    def __init__(self, multipliers, curvature=0.02):
        rotation = np.linalg.qr(np.arange(16.0).reshape(4, 4) + 5.0 * np.eye(4))[0]
        self.linear = rotation @ np.diag(multipliers) @ rotation.T
        self.curvature = curvature

    def two_iterates(self, x, continues=True):
        first = self.mapped(x)
        return first, self.mapped(first)

    def mapped(self, x):
        moved = x - PLACE
        return PLACE + self.linear @ moved + self.curvature * moved**2

    def derivative(self, x):
        curved = 2.0 * self.curvature * np.diag(x - PLACE)
        return self.linear + curved


def fixed_point(mapping, away):
    start = PLACE + away * np.array([1.0, -1.0, 0.5, 0.2])
    return stable_fixed_point(mapping, start, np.linalg.norm, TOLERANCE)


@pytest.mark.parametrize("slowest", [0.5, 0.99, -0.99])
def test_a_stable_fixed_point_is_found(slowest):
    place = fixed_point(Curved([slowest, 0.3, -0.4, 0.9]), 0.05)
    assert np.abs(place - PLACE).max() < 0.1 * TOLERANCE


@pytest.mark.parametrize("growing", [1.01, -1.01, 1.5])
def test_an_unstable_one_is_none(growing):
    assert fixed_point(Curved([growing, 0.3, -0.4, 0.9]), 0.05) is None


def test_one_that_is_unstable_only_in_its_place_is_none():
    """Beside it the derivative contracts."""
    mapping = Curved([1.001, 0.3, -0.4, 0.9], curvature=-0.1)
    start = PLACE + 0.1 * np.ones(4)
    assert is_stable(mapping.derivative(start))
    assert stable_fixed_point(mapping, start, np.linalg.norm, TOLERANCE) is None


def test_one_that_is_far_away_is_none():
    assert fixed_point(Curved([0.9, 0.3, -0.4, 0.9], curvature=0.0), 0.1) is not None
    assert fixed_point(Curved([0.9, 0.3, -0.4, 0.9], curvature=0.0), 1.0) is None


def test_one_beyond_a_bend_is_none():
    assert fixed_point(Curved([0.9, 0.3, -0.4, 0.9], curvature=2.0), 0.1) is None


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.2, 2.0))
def test_matrices_contract_as_their_eigenvalues_say(seed, size):
    matrix = np.random.default_rng(seed).normal(size=(7, 7))
    largest = np.abs(np.linalg.eigvals(matrix)).max()
    near = abs(size - 1.0) < 1e-3
    assert near or is_stable(size * matrix / largest) == (size < 1.0)


def test_no_number_is_no_contraction():
    assert not is_stable(np.full((2, 2), math.nan))


SLACK = replace(FIRM, backlash=2e-5, spokes=2e-9, in_rim=0.6)
SPEEDS = np.linspace(900.0, 4200.0, 12)


@pytest.fixture(scope="module", params=[0.01, 0.002])
def system(request):
    return replace(SLACK, damping=request.param).coupled


@pytest.mark.slow
def test_leaps_end_where_the_motion_settles(system, monkeypatch):
    """At every speed of a sweep, and in much less time."""
    patient = Settings(max_periods=20_000)
    leaping = sweep(system, SPEEDS, "up", patient)
    monkeypatch.setattr(newton_shooting, "jacobian_cost", lambda stepper: 10**6)
    settling = sweep(system, SPEEDS, "up", patient)
    one, two = (
        [r.multiple for r in branch.responses] for branch in (leaping, settling)
    )
    assert one == two
    repeats = np.array(one) > 0
    assert repeats.mean() > 0.9
    left, right = (branch.column("dte_rms") for branch in (leaping, settling))
    np.testing.assert_allclose(left[repeats], right[repeats], rtol=5e-4)
    times = [
        sum(r.settling_time * r.frequency for r in branch.responses if r.multiple)
        for branch in (leaping, settling)
    ]
    assert times[0] < 0.4 * times[1]


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
def test_a_leap_ends_as_near_as_the_tolerance_says(system, tolerance, monkeypatch):
    leapt = respond(system, SPEEDS[5], Settings(tolerance=tolerance))
    monkeypatch.setattr(newton_shooting, "jacobian_cost", lambda stepper: 10**6)
    settled = respond(system, SPEEDS[5], Settings(tolerance=1e-9, max_periods=20_000))
    assert settled.settling_time > 2.0 * leapt.settling_time
    difference = system.arrays.shapes @ (leapt.state[0] - settled.state[0])
    assert np.abs(difference).max() < 2.0 * tolerance * settled.dte_rms.max()
