"""Harmonic balance of gears that move in space, beside integration."""

from __future__ import annotations

import numpy as np
import pytest
from trains_in_space import train_in_space

from lumped.branches.balance import HarmonicBalance
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from lumped.train.bodies import TrainError

FINE = Settings(tolerance=1e-9, steps=2048, max_periods=20000)
CASES = {  # load [N], frequency [Hz], damping ratio, variation of the stiffness
    "pressed": (3000.0, 1000.0, 0.03, 0.1),
    "lifting": (300.0, 2700.0, 0.002, 0.5),
}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """Equations, unknowns that solve them, frequency and the settled motion."""
    force, frequency, damping, variation = CASES[request.param]
    system = train_in_space(
        np.random.default_rng(7300),
        force=force,
        damping=damping,
        variation=variation,
        backlash=1e-4,
    )
    response = respond(system, frequency, FINE)
    balance = HarmonicBalance(system, 40, response.multiple)
    x = balance.of_response(response, FINE)
    for _ in range(3):
        errors, jacobian, _ = balance.equations(x, frequency)
        x = x - np.linalg.solve(jacobian, errors)
    assert np.abs(balance.errors(x, frequency)).max() < 1e-15
    assert (response.contact_loss > 0.0).all() == (request.param == "lifting")
    return balance, x, frequency, response


def test_figures_are_those_of_the_integration(case):
    balance, x, frequency, response = case
    figures = balance.figures(x, frequency)
    for name, expected in (
        ("dte_rms", response.dte_rms),
        ("dte_mean", response.dte_mean),
    ):
        assert figures[name] == pytest.approx(expected, rel=1e-5, abs=1e-12), name
    # a share of the steps, of which there are 2048
    assert figures["contact_loss"] == pytest.approx(response.contact_loss, rel=5e-4)
    assert figures["force_peak"] == pytest.approx(response.force_peak, rel=1e-4)


def test_derivatives_are_differences(case):
    balance, x, frequency, _ = case
    _, jacobian, by_frequency = balance.equations(x, frequency)
    change = 1e-10 * np.random.default_rng(0).standard_normal(x.size)
    sides = [balance.errors(x + sign * change, frequency) for sign in (1.0, -1.0)]
    difference = 0.5 * (sides[0] - sides[1])
    assert jacobian @ change == pytest.approx(
        difference, abs=1e-5 * np.abs(difference).max()
    )
    step = 1e-6 * frequency
    ends = [balance.errors(x, frequency + sign * step) for sign in (1.0, -1.0)]
    difference = (ends[0] - ends[1]) / (2.0 * step)
    assert by_frequency == pytest.approx(
        difference, abs=1e-6 * np.abs(difference).max()
    )


def test_the_state_comes_back_and_changes_of_it_by_the_multipliers(case):
    balance, x, frequency, _ = case
    state, speed = balance.state(x, frequency), Speed(frequency, FINE)
    stepper = stepper_of(balance.system, FINE)
    end, _ = stepper.record(state, speed, balance.multiple)
    size = np.abs(state).max(axis=1, keepdims=True)
    assert np.abs((end - state) / size).max() < 1e-4
    monodromy = balance.monodromy(x, frequency)
    change = 1e-5 * size * np.random.default_rng(1).standard_normal(state.shape)
    ends = [
        stepper.record(state + sign * change, speed, balance.multiple)[0]
        for sign in (1.0, -1.0)
    ]
    difference = 0.5 * (ends[0] - ends[1]) / size
    expected = (monodromy @ change.ravel()).reshape(state.shape) / size
    assert expected == pytest.approx(difference, abs=3e-3 * np.abs(difference).max())
    assert np.abs(np.linalg.eigvals(monodromy)).max() < 1.0


def test_contact_that_closes_by_tanh_is_of_the_plane():
    system = train_in_space(np.random.default_rng(7300))
    with pytest.raises(TrainError, match="steepness"):
        HarmonicBalance(system, steepness=1e6)
