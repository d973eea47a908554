"""The SciPy opponent, the growth studies and the stress trials."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from validation.commands.bench.bench_lumped import StepCost, growth, races, with_disks
from validation.commands.bench.stress.stress_coupled import TRIALS as COUPLED
from validation.commands.bench.stress.stress_lumped import TRIALS, Idler
from validation.commands.bench.stress.trials import Trial
from validation.oracles.scipy_train import ScipyTrain, scipy_rms


@pytest.mark.slow
@pytest.mark.parametrize("method", ["DOP853", "LSODA"])
def test_scipy_finds_the_same_response(method):
    system = Idler(damping=0.1, backlash=2e-5).system()
    ours = respond(system, 1700.0, Settings(steps=128, tolerance=1e-6))
    periods = ours.settling_time * 1700.0
    theirs = scipy_rms(ScipyTrain(system), 1700.0, periods, 1, method, 1e-6)
    np.testing.assert_allclose(theirs, ours.dte_rms, rtol=2e-4)


NAMED = {f"{f.__module__}.{f.__name__}": f for f in (*TRIALS, *COUPLED)}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMED)
def test_every_promise_is_kept(name):
    trials = list(NAMED[name]())
    assert trials
    assert not [trial for trial in trials if not trial.passed]


def test_nan_keeps_no_promise():
    assert not Trial("a", "b", float("nan"), 1.0).passed


def test_disks_add_moving_modes():
    larger = with_disks(Idler().system(), 20)
    assert larger.moving.size == 20


@pytest.mark.slow
def test_growth_is_about_linear():
    points = [point for point in growth(Idler().system()) if point.study != "speeds"]
    few, many = points[0], points[-1]
    assert many.seconds / few.seconds < 2.0 * many.size / few.size


def test_race_is_run_at_equal_error():
    def point(study: str, setting: float, ms: float, error: float) -> StepCost:
        return StepCost(study, setting, ms, 1.0, error, error)

    points = [
        point("rk4", 32, 0.5, 2e-3),
        point("rk4", 64, 1.0, 1e-3),
        point("rk4", 128, 2.0, 1e-4),
        point("SciPy DOP853", 1e-2, 100.0, 1e-1),
        point("SciPy DOP853", 1e-3, 300.0, 9e-4),
        point("SciPy LSODA", 1e-2, 50.0, 2e-3),
        point("SciPy LSODA", 1e-3, 80.0, 1e-5),
    ]
    dop853, lsoda = races(points)
    assert (dop853.ratio, dop853.rtol, dop853.setting) == (150.0, 1e-3, 128)
    assert (lsoda.ratio, lsoda.setting) == (100.0, 32)
