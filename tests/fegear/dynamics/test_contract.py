"""What all fidelities have in common, and where they become the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from lumped.steady.response import RESPONSE_QUANTITIES, Status
from lumped.steady.steady_state import steady_state

FREQUENCY = 1600.0  # Hz
CUTOFFS = {"quasistatic": None, "reduced": 30e3}
SETTINGS = DynamicSettings(steps=256)


@pytest.fixture(params=CUTOFFS)
def stepper(request, case_of):
    return case_of("liu-idler-small-hubs").stepper(CUTOFFS[request.param])


def test_start_is_at_rest(stepper):
    state = stepper.start()
    assert state.motion.shape == (4, stepper.model.size)
    assert state.contact.shape == (3, stepper.model.contact_count)
    assert (state.motion[1:3] == 0.0).all()
    _, motion = stepper.integrate(state, TimeSteps(0.0, 1e-5, 64, 256))
    scale = np.abs(motion.deflection[0])
    assert (np.ptp(motion.deflection, axis=0) < 1e-6 * scale).all()


def test_statics_do_not_depend_on_the_fidelity(case_of):
    case = case_of("liu-idler-small-hubs")
    one, other = (case.stepper(cutoff).start() for cutoff in CUTOFFS.values())
    # squeezes count where contacts are near
    near = one.contact[kernel.PENETRATION] > -1e-6
    for row in (kernel.PENETRATION, kernel.LOAD):
        np.testing.assert_allclose(
            other.contact[row, near], one.contact[row, near], 1e-8
        )
    hubs = one.motion.shape[1]
    np.testing.assert_allclose(
        other.motion[0, :hubs], one.motion[0], rtol=1e-8, atol=1e-15
    )


def test_response_is_complete_and_finite(stepper):
    response, motion = steady_state(stepper, FREQUENCY, SETTINGS)
    state = response.state
    meshes, contacts = 2, stepper.model.contact_count
    points = motion.time.size
    assert response.status is Status.PERIODIC
    for name in RESPONSE_QUANTITIES:
        assert getattr(response, name).shape == (meshes,)
        assert np.isfinite(getattr(response, name)).all()
    for name in ("deflection", "rate", "force"):
        values = getattr(motion, name)
        assert values.shape == (points, meshes)
        assert np.isfinite(values).all()
    assert motion.pair_load.shape == (points, contacts)
    assert (motion.pair_load >= 0.0).all()
    assert motion.hub.shape == (points, 2, stepper.model.modal.damping.size)
    assert state.motion.shape == (4, stepper.model.size)
    assert motion.time[-1] == pytest.approx(response.multiple / FREQUENCY)


def test_rate_is_the_slope_of_the_deflection(stepper):
    _, motion = steady_state(stepper, FREQUENCY, DynamicSettings(steps=1024))
    history = motion
    slope = np.gradient(history.deflection, history.time, axis=0)[1:-1]
    scale = np.abs(history.rate).max()
    np.testing.assert_allclose(history.rate[1:-1], slope, atol=5e-3 * scale)


def test_marching_on_is_marching_at_once(stepper):
    start = stepper.start()
    step = 1.0 / (FREQUENCY * 256)
    half, first = stepper.integrate(start, TimeSteps(FREQUENCY, step, 256, 256))
    end, second = stepper.integrate(half, TimeSteps(FREQUENCY, step, 256, 256))
    final, motion = stepper.integrate(start, TimeSteps(FREQUENCY, step, 512, 256))
    np.testing.assert_allclose(end.motion, final.motion, rtol=1e-9, atol=1e-12)
    joined = np.concatenate([first.pair_load, second.pair_load[1:]])
    np.testing.assert_allclose(joined, motion.pair_load, rtol=1e-9, atol=1e-6)


def test_without_modes_reduced_is_quasistatic(case_of):
    case = case_of()
    none, rigid = case.stepper(1.0), case.stepper(None)
    assert none.model.size == rigid.model.size
    runs = [steady_state(s, FREQUENCY, SETTINGS)[1] for s in (none, rigid)]
    np.testing.assert_array_equal(runs[0].deflection, runs[1].deflection)


@pytest.mark.parametrize("frequency", [FREQUENCY, 2500.0])
def test_stiff_gears_are_quasistatic(case_of, frequency):
    """Gears that weigh a ten-thousandth, on the inertias that are given."""
    case = case_of()
    gears = tuple(replace(g, density=1e-4 * g.density) for g in case.gear_set.gears)
    light = replace(case, gear_set=replace(case.gear_set, gears=gears))
    settings = DynamicSettings(steps=1024, step_angle=10.0)
    steppers = (case.stepper(None), light.stepper(3e6), case.stepper(30e3))
    assert steppers[1].model.size == steppers[2].model.size
    assert (
        steppers[1].model.modal.rigidity.min()
        > 0.999e4 * steppers[2].model.modal.rigidity.min()
    )
    rigid, stiff, elastic = (steady_state(s, frequency, settings)[0] for s in steppers)
    assert stiff.dte_rms[0] == pytest.approx(rigid.dte_rms[0], rel=1e-3)
    assert elastic.dte_rms[0] != pytest.approx(rigid.dte_rms[0], rel=1e-2)


def test_a_watch_ends_a_run(stepper):
    calls = []

    def callback(frequency, period):
        calls.append((frequency, period))
        if period == 3:
            raise TimeoutError

    with pytest.raises(TimeoutError):
        steady_state(stepper, FREQUENCY, SETTINGS, callback=callback)
    assert calls == [(FREQUENCY, n) for n in (1, 2, 3)]


def test_slow_sliding_does_not_chatter(case_of):
    """Vibration of nanometres must not turn the friction back and forth."""
    case, deflections = case_of(friction=0.1), []
    for cutoff in CUTOFFS.values():
        _, motion = steady_state(case.stepper(cutoff), 2.0, DynamicSettings())
        history = motion
        cycle = history.time / history.time[-1]
        places = np.linspace(0.0, 1.0, 128)
        deflections.append(np.interp(places, cycle, history.deflection[:, 0]))
    np.testing.assert_allclose(deflections[1], deflections[0], rtol=1e-3)
