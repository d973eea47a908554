"""Branches of speeds: what a checkpoint keeps, what a stop leaves."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from fegear.dynamics.checkpoint import StoredBranch
from fegear.dynamics.stepper import DynamicSettings, ReducedStepper
from fegear.files.store import Records, open_checkpoint
from lumped.steady.response import RESPONSE_QUANTITIES
from lumped.steady.steady_state import Diverged
from lumped.steady.sweep import Observer, sweep_branch

SPEEDS = [1000.0, 1010.0, 1020.0]
SETTINGS = DynamicSettings(tolerance=1e-3)


@pytest.fixture(scope="module")
def stepper(case_of):
    return case_of().stepper()


def test_speeds_are_passed_in_the_direction(stepper):
    down = sweep_branch(stepper, SPEEDS, "down", SETTINGS)
    assert list(down.frequency_Hz) == SPEEDS[::-1]
    assert down.complete


def test_a_stop_keeps_what_was_finished(stepper):
    stop, calls = threading.Event(), []

    def count():
        calls.append(1)
        if len(calls) == 2:
            stop.set()

    branch = sweep_branch(
        stepper, SPEEDS, "up", SETTINGS, observer=Observer(count), stop=stop
    )
    assert len(branch.responses) == 2
    assert not branch.complete


def test_a_checkpoint_gives_back_what_was_found(stepper, tmp_path):
    branch = sweep_branch(stepper, SPEEDS, "up", SETTINGS)
    checkpoint = open_checkpoint(tmp_path / "j", {"of": "this"}, resume=True)
    stop = threading.Event()
    sweep_branch(
        *(stepper, SPEEDS, "up", SETTINGS),
        store=StoredBranch(Records(checkpoint, "up")),
        observer=Observer(stop.set),
        stop=stop,
    )
    marched = []
    resumed = sweep_branch(
        *(stepper, SPEEDS, "up", SETTINGS),
        store=StoredBranch(Records(checkpoint, "up")),
        observer=Observer(callback=lambda frequency, period: marched.append(frequency)),
    )
    assert set(marched) == set(SPEEDS[1:])
    for name in RESPONSE_QUANTITIES:
        np.testing.assert_array_equal(resumed.column(name), branch.column(name))
    assert [r.status for r in resumed.responses] == [r.status for r in branch.responses]
    checkpoint.close(keep=False)


def test_histories_are_kept_before_a_speed_counts(stepper, tmp_path):
    checkpoint = open_checkpoint(tmp_path / "j", {"of": "this"}, resume=True)

    def keep(frequency, motion):
        assert len(checkpoint.finished("up")) == SPEEDS.index(frequency)
        if frequency == SPEEDS[1]:
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        sweep_branch(
            *(stepper, SPEEDS, "up", SETTINGS),
            store=StoredBranch(Records(checkpoint, "up")),
            store_motion=keep,
        )
    assert len(checkpoint.finished("up")) == 1
    checkpoint.close(keep=False)


def test_a_diverged_speed_ends_a_branch(stepper, monkeypatch):
    def diverge(*_):
        raise Diverged(0.5)

    start = stepper.start()
    monkeypatch.setattr(ReducedStepper, "start", lambda self: start)
    monkeypatch.setattr(ReducedStepper, "integrate", diverge)
    branch = sweep_branch(stepper, SPEEDS, "up", SETTINGS)
    assert [str(r.status) for r in branch.responses] == ["diverged"]
    assert np.isnan(branch.column("dte_rms")).all()
    assert branch.responses[0].settling_time == 0.5 / SPEEDS[0]
    assert not branch.complete
