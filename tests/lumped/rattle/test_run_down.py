"""Damping from run-downs that are made, with noise of known size."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.rattle.run_down import fit_run_down

TIME = np.linspace(3.0, 63.0, 121)
RATE, START = 0.02, 50.0


def test_an_exponential_is_found():
    fit = fit_run_down(TIME, START * np.exp(-RATE * (TIME - TIME[0])))
    assert fit.rate == pytest.approx(RATE, rel=1e-9)
    assert fit.start == pytest.approx(START, rel=1e-9)
    assert fit.rate_error < 1e-9
    assert fit.residual < 1e-7


def test_standard_error_is_the_scatter_of_many_tests():
    rng = np.random.default_rng(1)
    clean = START * np.exp(-RATE * (TIME - TIME[0]))
    fits = [
        fit_run_down(TIME, clean + rng.normal(0.0, 0.2, TIME.size)) for _ in range(300)
    ]
    scatter = np.std([fit.rate for fit in fits])
    assert np.mean([fit.rate_error for fit in fits]) == pytest.approx(scatter, rel=0.1)
    assert np.mean([fit.residual for fit in fits]) == pytest.approx(0.2, rel=0.05)


@pytest.mark.parametrize(
    ("time", "speed", "message"),
    [
        ([0.0, 1.0], [3.0, 2.0], "must be 3 or more"),
        ([0.0, 1.0, 1.0], [3.0, 2.0, 1.0], "rise"),
        ([0.0, 1.0, 2.0], [3.0, 2.0, 0.0], "above 0"),
        ([0.0, 1.0, np.nan], [3.0, 2.0, 1.0], "finite"),
    ],
)
def test_what_cannot_be_fitted_is_refused(time, speed, message):
    with pytest.raises(ValueError, match=message):
        fit_run_down(np.array(time), np.array(speed))
