"""Damping from run-downs that are made, with noise of known size."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.rattle.run_down import fit_run_down

TIME = np.linspace(3.0, 63.0, 121)
RATE, START = 0.02, 50.0


def test_an_exponential_is_found():
    found = fit_run_down(TIME, START * np.exp(-RATE * (TIME - TIME[0])))
    assert found.rate == pytest.approx(RATE, rel=1e-9)
    assert found.start == pytest.approx(START, rel=1e-9)
    assert found.rate_error < 1e-9
    assert found.residual < 1e-7


def test_standard_error_is_the_scatter_of_many_tests():
    rng = np.random.default_rng(1)
    clean = START * np.exp(-RATE * (TIME - TIME[0]))
    found = [
        fit_run_down(TIME, clean + rng.normal(0.0, 0.2, TIME.size)) for _ in range(300)
    ]
    scatter = np.std([each.rate for each in found])
    assert np.mean([each.rate_error for each in found]) == pytest.approx(
        scatter, rel=0.1
    )
    assert np.mean([each.residual for each in found]) == pytest.approx(0.2, rel=0.05)


@pytest.mark.parametrize(
    ("time", "speed", "message"),
    [
        ([0.0, 1.0], [3.0, 2.0], "3 rows"),
        ([0.0, 1.0, 1.0], [3.0, 2.0, 1.0], "rise"),
        ([0.0, 1.0, 2.0], [3.0, 2.0, 0.0], "above 0"),
        ([0.0, 1.0, np.nan], [3.0, 2.0, 1.0], "finite"),
    ],
)
def test_what_cannot_be_fitted_is_refused(time, speed, message):
    with pytest.raises(ValueError, match=message):
        fit_run_down(np.array(time), np.array(speed))
