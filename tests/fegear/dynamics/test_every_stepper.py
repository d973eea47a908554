"""What holds for every stepper, of lumped models and of finite elements alike."""

from __future__ import annotations

import math
import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fegear.dynamics.checkpoint import StoredBranch
from fegear.dynamics.stepper import DynamicSettings
from fegear.files.store import Records, open_checkpoint
from fegear.train.coupled import contacts_from_load_curves
from lumped.steady.integration_settings import Settings
from lumped.steady.response import RESPONSE_QUANTITIES, Status
from lumped.steady.steady_state import Diverged, steady_state
from lumped.steady.steppers import AdaptiveStepper, FixedStepper
from lumped.steady.sweep import Observer, sweep_branch

DAMPED = 0.4  # ratio, so that motions settle within few periods
COARSE = DynamicSettings(steps=32, hub_angle=10.0, step_angle=10.0, tolerance=1e-5)
SETTINGS = {
    "rk4": Settings(steps=32, step_angle=2.0, tolerance=1e-5),
    "dopri5": Settings(method="dopri5", accuracy=1e-4, tolerance=1e-5),
    # two steps for each of its tables' cells: kinks of these lie on steps
    "coupled": Settings(steps=128, step_angle=2.0, tolerance=1e-5),
    "quasistatic": COARSE,
    "reduced": COARSE,
    "full": replace(COARSE, steps=16, tolerance=1e-4),
}
SPEEDS = [1500.0, 1600.0]  # Hz


@pytest.fixture(scope="module", params=SETTINGS)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def settings(kind):
    return SETTINGS[kind]


@pytest.fixture(scope="module")
def stepper(kind, case_of, full_of):
    case = case_of(damping=DAMPED)
    make = {
        "rk4": lambda: FixedStepper(case.reference),
        "dopri5": lambda: AdaptiveStepper(case.reference),
        "coupled": lambda: FixedStepper(coupled(case)),
        "quasistatic": lambda: case.stepper(None),
        "reduced": lambda: case.stepper(30e3),
        "full": lambda: full_of(damping=DAMPED),
    }
    return make[kind]()


def coupled(case):
    args = case.gear_set, case.reference, case.laws, case.settings
    return replace(case.reference, contacts=contacts_from_load_curves(*args))


@pytest.fixture(scope="module")
def settled(stepper, settings):
    return steady_state(stepper, SPEEDS[0], settings)


def refined(settings, times):
    """With steps that are `times` shorter, or as much more accurate."""
    if isinstance(settings, Settings) and settings.accuracy is not None:
        return replace(settings, accuracy=settings.accuracy / times**5)
    return replace(settings, steps=settings.steps * times)


def test_motion_becomes_periodic(settled, stepper):
    response, motion = settled
    assert response.status is Status.PERIODIC
    assert response.multiple == 1
    assert motion.time[-1] == pytest.approx(1.0 / SPEEDS[0])
    assert motion.deflection.shape == (
        motion.time.size,
        len(stepper.system.excitations),
    )
    scale = np.ptp(motion.deflection)
    assert np.abs(motion.deflection[-1] - motion.deflection[0]).max() < 1e-3 * scale


def test_a_motion_repeats_itself(settled, stepper, settings):
    """States that were handed out are not touched by what comes later."""
    response = settled[0]
    first, motion = steady_state(stepper, SPEEDS[0], settings, response.state)
    second, again = steady_state(stepper, SPEEDS[0], settings, response.state)
    np.testing.assert_array_equal(motion.deflection, again.deflection)
    np.testing.assert_array_equal(first.dte_rms, second.dte_rms)
    np.testing.assert_allclose(first.dte_rms, response.dte_rms, rtol=1e-4)


@pytest.mark.slow
def test_finer_steps_agree_the_better(settled, stepper, settings):
    dte_rms = [settled[0].dte_rms] + [
        steady_state(stepper, SPEEDS[0], refined(settings, times))[0].dte_rms
        for times in (2, 4)
    ]
    coarse, fine = (np.abs(b / a - 1.0).max() for a, b in pairwise(dte_rms))
    assert fine < max(0.5 * coarse, 2e-4)


def test_mean_force_is_that_of_the_torque(settled, stepper):
    """Nothing else loads the mesh in the mean over a period: statics."""
    motion = settled[1]
    mean = np.trapezoid(motion.force[:, 0], motion.time) / motion.time[-1]
    pinion = stepper.system.train.gears[0]
    assert mean == pytest.approx(abs(pinion.torque) / pinion.base_radius, rel=5e-3)


def test_mesh_gives_what_damping_takes(settled, stepper):
    """Over a period the varying stiffness gives the train what damping takes."""
    motion = settled[1]
    drift = np.trapezoid(motion.rate[:, 0], motion.time)
    assert abs(drift) < 1e-3 * np.ptp(motion.deflection)
    work = np.trapezoid(motion.force[:, 0] * motion.rate[:, 0], motion.time)
    assert work < 0.0  # of the train on the mesh


class MemoryStore:
    """Keeps finished speeds of a branch."""

    def __init__(self):
        self.responses = []

    def finished(self):
        return list(self.responses)

    def add(self, response):
        self.responses.append(response)


@pytest.mark.slow
def test_a_stopped_sweep_goes_on_as_if_it_had_not_stopped(
    kind, stepper, settings, tmp_path
):
    quick = replace(settings, tolerance=1e-3)
    branch = sweep_branch(stepper, SPEEDS, "down", quick)
    checkpoint = open_checkpoint(tmp_path / "kept", {"of": kind}, resume=True)
    lumped = isinstance(settings, Settings)
    store = MemoryStore() if lumped else StoredBranch(Records(checkpoint, "down"))
    stop = threading.Event()
    begun = sweep_branch(
        *(stepper, SPEEDS, "down", quick),
        store=store,
        observer=Observer(stop.set),
        stop=stop,
    )
    assert len(begun.responses) == 1
    assert not begun.complete
    resumed = sweep_branch(stepper, SPEEDS, "down", quick, store=store)
    checkpoint.close(keep=False)
    assert resumed.complete
    np.testing.assert_array_equal(resumed.frequency_Hz, SPEEDS[::-1])
    for name in RESPONSE_QUANTITIES:
        np.testing.assert_array_equal(resumed.column(name), branch.column(name))


def test_a_divergence_is_a_response(stepper, settings, monkeypatch):
    def diverge(*_):
        raise Diverged(0.5)

    monkeypatch.setattr(type(stepper), "advance", diverge)
    start = stepper.start()
    response, motion = steady_state(stepper, SPEEDS[0], settings, start)
    assert response.status is Status.DIVERGED
    assert response.settling_time == 0.5 / SPEEDS[0]
    assert response.state is start
    assert np.isnan(response.dte_rms).all()
    assert motion.time.size == 0
    branch = sweep_branch(stepper, SPEEDS, "up", settings)
    assert (len(branch.responses), branch.complete) == (1, False)


@pytest.mark.parametrize("frequency", [0.0, -1.0, math.nan, math.inf])
def test_bad_speeds_are_refused(stepper, settings, frequency):
    with pytest.raises(ValueError, match="frequency"):
        steady_state(stepper, frequency, settings)


def test_bad_directions_are_refused(stepper, settings):
    with pytest.raises(ValueError, match="direction"):
        sweep_branch(stepper, SPEEDS, "sideways", settings)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("tolerance", 0.0),
        ("tolerance", math.nan),
        ("max_periods", 0),
        ("multiples", 65),
        ("windows", 0),
        ("steps", 1),
        ("step_angle", 0.0),
    ],
)
def test_bad_settings_are_refused(settings, name, value):
    with pytest.raises(ValueError, match=name):
        replace(settings, **{name: value})
