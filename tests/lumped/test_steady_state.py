"""Responses whose classification hangs on the step are found again on finer steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rim_gears import FIRM

import lumped.steady.steady_state as module
from lumped import Settings, Status, respond, sweep
from lumped.steady.motion import time_history
from lumped.steady.respond import respond_confirmed
from lumped.steady.steady_state import needs_refinement, same_response
from lumped.steady.steppers import MAX_STEPS_PER_PERIOD

# m: here fixed steps of 64 and 256 a period find no period, or find it by the round-off
# of the processor
RELIEF = 25e-6
FREQUENCY = 1280.0  # Hz


@pytest.fixture(scope="module")
def relieved(system):
    return system(relief=RELIEF)


@pytest.fixture(scope="module")
def regular(system):
    return respond(system(), 2000.0)


def test_the_period_is_found_on_finer_steps(relieved):
    response, history, settings = respond_confirmed(relieved, FREQUENCY)
    adaptive = respond(relieved, FREQUENCY, Settings(method="dopri5"))
    assert response.multiple == adaptive.multiple == 8
    np.testing.assert_allclose(response.dte_rms, adaptive.dte_rms, rtol=0.02)
    assert settings.steps == MAX_STEPS_PER_PERIOD
    assert history.time.size > 8 * MAX_STEPS_PER_PERIOD


def test_sweeps_and_histories_are_confirmed(relieved):
    assert sweep(relieved, [FREQUENCY]).responses[0].multiple == 8
    motion = time_history(relieved, FREQUENCY)
    assert motion.response.multiple == 8
    assert motion.pairs[0].force.shape[0] == motion.history.time.size


def test_a_plain_response_is_not_computed_twice(system, monkeypatch):
    calls = []
    real = module.steady_state
    monkeypatch.setattr(
        module, "steady_state", lambda *args: calls.append(1) or real(*args)
    )
    response, _, settings = respond_confirmed(system(), 2000.0)
    assert response.multiple == 1
    assert (len(calls), settings) == (1, Settings())
    respond_confirmed(system(), 2000.0, None, response.state, response)
    assert len(calls) == 2


def test_a_leap_is_in_doubt(regular):
    far = replace(regular, dte_rms=2.0 * regular.dte_rms)
    near = replace(regular, dte_rms=1.1 * regular.dte_rms)
    assert needs_refinement(far, regular)
    assert not needs_refinement(near, regular)
    assert not needs_refinement(far, None)
    # resonances do as much between speeds that are further apart
    assert not needs_refinement(
        far, replace(regular, frequency=0.97 * regular.frequency)
    )
    assert needs_refinement(replace(regular, multiple=2), None)
    assert not needs_refinement(
        replace(regular, status=Status.DIVERGED, multiple=0), far
    )


@pytest.mark.parametrize("jumps", [False, True])
@pytest.mark.parametrize("coupled", [False, True])
def test_finer_steps_of_the_coupled_model_go_on_from_its_end(
    coupled, jumps, system, monkeypatch
):
    """But for jumps, which may reach another motion."""
    train = FIRM.coupled if coupled else system()
    start, calls = respond(train, 2000.0), []
    real = module.steady_state

    def logged(*args):
        outcome = real(*args)
        calls.append((args[3], args[4], outcome[0]))
        return outcome

    monkeypatch.setattr(module, "steady_state", logged)
    far = (3.0 if jumps else 1.0) * start.dte_rms
    other = replace(start, dte_rms=far, frequency=2001.0)
    if not jumps:  # another period multiple is in doubt as well
        monkeypatch.setattr(module, "needs_refinement", lambda *_: True)
    respond_confirmed(train, 2000.0, None, start.state, other)
    (_, _, coarse), (state, before, finer) = calls
    goes_on = coupled and not jumps
    assert (state is coarse.state, state is start.state) == (goes_on, not goes_on)
    assert before == (2000.0 if goes_on else 2001.0)
    assert same_response(coarse, finer)


def test_what_is_alike(regular):
    assert same_response(regular, replace(regular, dte_rms=1.01 * regular.dte_rms))
    assert not same_response(regular, replace(regular, dte_rms=1.2 * regular.dte_rms))
    assert not same_response(regular, replace(regular, multiple=2))
    gone = replace(regular, dte_rms=np.full(2, np.nan))
    assert not same_response(regular, gone)


def test_adaptive_steps_need_no_confirmation(relieved):
    adaptive = Settings(method="dopri5")
    assert respond_confirmed(relieved, FREQUENCY, adaptive)[2] == adaptive
