"""Time histories: pairs, contact, section and spectrum."""

from __future__ import annotations

import csv
import math
import threading

import numpy as np
import pytest

from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped import History, Settings, respond
from lumped.common.csv_text import format_csv
from lumped.common.workers import Stopped
from lumped.steady import motion as module
from lumped.steady.motion import (
    DivergedError,
    resample,
    spectrum,
    sweep_to_speed,
    time_history,
    wave_columns,
)
from lumped.steady.pair_motions import contact_conditions
from lumped.steady.sweep import Observer, sweep


def idler_system(torque=100.0):
    """The built-in train with rectangular waves of the printed figures."""
    excitations = Excitations(ExcitationSettings(kind="rectangular"))
    gear_set = load_gear_set("liu-idler")
    return lumped_system(
        gear_set, torque, LumpedModel(number=1), excitations=excitations
    )


@pytest.fixture(scope="module")
def system():
    return idler_system()


@pytest.fixture(scope="module")
def lost(system):
    """The upper branch below the second resonance, second mesh mostly apart."""
    return time_history(system, 2400.0, state=sweep_to_speed(system, 3200.0, 2400.0))


@pytest.mark.parametrize("method", ["rk4", "dopri5"])
def test_forces_of_the_pairs_add_up_to_that_of_the_mesh(system, method):
    motion = time_history(system, 1440.0, Settings(method=method))
    for m, pairs in enumerate(motion.pairs):
        total = motion.history.force[:, m]
        np.testing.assert_allclose(pairs.force.sum(axis=1), total, atol=1e-6)
        assert set(pairs.count) == {1, 2}
        assert not pairs.state[~pairs.engaged].any()


def test_states_last_as_long_as_the_response_says(lost):
    step = np.diff(lost.history.time) / lost.history.time[-1]
    for m, pairs in enumerate(lost.pairs):
        is_separated = (pairs.state == 0).all(axis=1)[:-1]
        loss = lost.response.contact_loss[m]
        assert (is_separated * step).sum() == pytest.approx(loss, abs=0.02)
    assert lost.response.contact_loss[1] > 0.4


def test_conditions_last_as_long_as_two_pairs_are_engaged(lost):
    for pairs, part in zip(lost.pairs, (0.504, 0.510), strict=True):
        assert sum(pairs.conditions.values()) == pytest.approx(part, rel=1e-9)
    assert set(lost.pairs[1].conditions) == {"I", "III"}


def test_amplitudes_carry_the_rms(system, lost):
    for motion in (lost, time_history(system, 2000.0)):
        rms = np.sqrt(0.5 * (motion.spectrum[1:] ** 2).sum(axis=0))
        np.testing.assert_allclose(rms, motion.response.dte_rms, rtol=1e-4)
        np.testing.assert_allclose(
            motion.spectrum[0], np.abs(motion.response.dte_mean), rtol=1e-4
        )


def harmonic_history(points=65):
    x = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, points - 2))
    time = 1e-3 * np.concatenate([[0.0], x, [1.0]])
    omega = 2.0 * math.pi * 3e3
    value = 2e-6 + 5e-6 * np.cos(omega * time)[:, None]
    rate = -5e-6 * omega * np.sin(omega * time)[:, None]
    return History(time, value, rate, *[value] * 4)


def test_a_cosine_is_one_line_of_its_amplitude():
    frequency, amplitude = spectrum(harmonic_history(401))
    assert frequency[3] == pytest.approx(3e3)
    assert amplitude[3, 0] == pytest.approx(5e-6, rel=1e-4)
    assert amplitude[0, 0] == pytest.approx(2e-6, rel=1e-4)
    others = np.delete(amplitude[:, 0], [0, 3])
    assert others.max() < 1e-3 * amplitude[3, 0]


def test_resampling_is_exact_for_cubics():
    time = np.array([0.0, 0.3, 1.0])
    cubic, slope = np.poly1d([2.0, -1.0, 3.0, 1.0]), np.poly1d([6.0, -2.0, 3.0])
    columns = [f(time)[:, None] for f in (cubic, slope)]
    fine = np.linspace(0.0, 1.0, 11)
    value, rate = resample(History(time, *columns, *[columns[0]] * 4), fine)
    np.testing.assert_allclose(value[:, 0], cubic(fine), atol=1e-14)
    np.testing.assert_allclose(rate[:, 0], slope(fine), atol=1e-13)


def test_the_section_has_a_point_for_each_period_of_the_first_mesh(system):
    motion = time_history(system, 2000.0)
    assert motion.section_rate.shape == (1, 2)
    np.testing.assert_allclose(
        motion.section_deflection[0], motion.history.deflection[0]
    )
    double = time_history(system, 3100.0)
    assert double.response.multiple == 2
    assert double.section_rate.shape == (2, 2)


def test_a_motion_that_does_not_repeat_is_marched_on(system):
    few = Settings(multiples=1, max_periods=1, windows=1)
    state = respond(system, 3100.0).state
    motion = time_history(system, 3100.0, few, state, section_periods=6)
    assert motion.response.multiple == 0
    assert motion.spans == 1
    assert len(motion.section_rate) in (2, 6)


CASES = {
    "I": [-1.0, -1.0],
    "II": [-1.0, 1.0],
    "III": [1.0, 1.0],
    "IV": [1.0, -1.0],
    "back": [-9.0, -1.0],
}


def conditions(rows, engaged=None, backlash=5.0):
    elastic = np.array(rows)
    there = np.ones(elastic.shape, bool) if engaged is None else np.array(engaged)
    h = np.full(len(rows), 0.1)
    inside = np.where(there, 1.0, -1.0)
    return contact_conditions((elastic, elastic), (inside, inside), h, backlash)


def test_every_condition_is_told_apart():
    fractions = conditions(list(CASES.values()))
    assert fractions == pytest.approx(dict.fromkeys(CASES, 0.2))


def test_conditions_look_at_engaged_pairs_only():
    rows, engaged = [[9.0, -1.0, 1.0], [1.0, -1.0, -9.0]], [[0, 1, 1], [1, 1, 0]]
    fractions = conditions(rows, np.array(engaged, bool), 99.0)
    assert fractions == pytest.approx({"II": 0.5, "IV": 0.5})
    assert conditions([[1.0, 1.0]], [[True, False]]) == {}


def test_a_change_within_a_step_counts_in_parts():
    start, end = np.array([[1.0, 1.0]]), np.array([[-1.0, 1.0]])
    ones = np.ones((1, 2))
    fractions = contact_conditions(
        (start, end), (ones, ones), np.array([1.0]), math.inf
    )
    assert fractions == pytest.approx({"II": 0.5, "III": 0.5})
    leaves = ones, np.array([[1.0, -3.0]])
    fractions = contact_conditions((start, end), leaves, np.array([1.0]), math.inf)
    assert fractions == pytest.approx({"III": 0.25})


def test_csv_has_a_row_for_each_time_and_empty_states_out_of_mesh(lost):
    columns = wave_columns(lost)
    text = format_csv(columns, zip(*columns.values(), strict=True), {})
    rows = list(csv.DictReader(text.splitlines()))
    assert len(rows) == lost.history.time.size
    assert list(rows[0])[:6] == [
        "time_s",
        "mesh1_dte_m",
        "mesh1_force_N",
        "mesh1_pair1_force_N",
        "mesh1_pair1_state",
        "mesh1_pair2_force_N",
    ]
    assert {row["mesh2_pair1_state"] for row in rows} == {"", "0", "1"}
    forces = [float(row["mesh2_force_N"]) for row in rows]
    np.testing.assert_array_equal(forces, lost.history.force[:, 1])


def test_the_branch_depends_on_where_it_comes_from(system):
    low, high = (
        respond(system, 2400.0, state=sweep_to_speed(system, start, 2400.0))
        for start in (2000.0, 3200.0)
    )
    assert high.dte_rms[1] > 5.0 * low.dte_rms[1]
    assert sweep_to_speed(system, 2400.0, 2400.0) is None


def test_a_divergence_names_speed_and_time(system, monkeypatch):
    from types import SimpleNamespace

    gone = SimpleNamespace(status="diverged", frequency=1234.0, settling_time=0.5)
    monkeypatch.setattr(
        module, "respond_confirmed", lambda *_, **__: (gone, None, None)
    )
    with pytest.raises(DivergedError, match=r"1234 Hz within 0\.5 s"):
        time_history(system, 1234.0)


def test_a_sweep_that_is_stopped_is_short_only_where_it_was_asked_to_stop(system):
    """Else a caller would take it for one that diverged."""
    stop, speeds, seen = threading.Event(), [1000.0, 1100.0, 1200.0], []

    def passed() -> None:
        seen.append(1)
        if len(seen) == 2:
            raise Stopped

    for event in (None, stop):
        seen.clear()
        with pytest.raises(Stopped):
            sweep(system, speeds, observer=Observer(passed), stop=event)
    with pytest.raises(Stopped):  # not IndexError
        sweep_to_speed(system, 1000.0, 1200.0, observer=Observer(callback=stopped))
    stop.set()
    begun = sweep(system, speeds, stop=stop)
    assert not begun.responses
    assert begun.interrupted
    assert not sweep(system, speeds).interrupted


def stopped(frequency: float, period: int) -> None:
    raise Stopped
