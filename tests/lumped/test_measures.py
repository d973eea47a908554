"""Figures of motions: contact on either side, and motions that do not repeat."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped import History, Settings, Status, respond, respond_with_history
from lumped.steady.measures import combine_windows, measure_motion
from lumped.steady.steady_state import count_windows

STEPS = 64


def motion(amplitude=1.0, mean=0.2, backlash=1.0, gap=0.0, steps=STEPS, periods=1):
    """s = mean + amplitude cos(t) between a drive and a back flank."""
    t = 2.0 * math.pi * periods * np.arange(periods * steps + 1) / (periods * steps)
    t = t[:, None]
    s, rate = mean + amplitude * np.cos(t), -amplitude * np.sin(t)
    drive, back = s - gap, gap - s - backlash
    return History(t[:, 0], s, rate, s, drive, back, s)


def part_above(level):
    """Part of a period in which cos(t) exceeds a level."""
    return math.acos(min(1.0, max(-1.0, level))) / math.pi


@pytest.mark.parametrize("backlash", [0.1, 0.3, 0.9, 1.5])
def test_contact_is_lost_where_neither_flank_touches(backlash):
    quantities = measure_motion(motion(backlash=backlash))
    drive, back = part_above(-0.2), part_above(backlash + 0.2)
    assert quantities["back_side"][0] == pytest.approx(back, abs=2e-6)
    assert quantities["contact_loss"][0] == pytest.approx(1.0 - drive - back, abs=2e-6)


@pytest.mark.parametrize("overlap", [0.1, 0.3])
def test_both_flanks_at_once_are_contact_once(overlap):
    """Of several pairs some touch in front and others behind; the union counts."""
    s = motion(backlash=0.0)
    # drive where cos t > 0.5; back where cos t > 0.5 - overlap: one within the other
    t = s.time[:, None]
    drive, back = np.cos(t) - 0.5, np.cos(t) - 0.5 + overlap
    both = History(s.time, 0 * t, 0 * t, 0 * t, drive, back, 0 * t)
    quantities = measure_motion(both)
    assert quantities["back_side"][0] == pytest.approx(
        part_above(0.5 - overlap), abs=1e-3
    )
    assert quantities["contact_loss"][0] == pytest.approx(
        1.0 - part_above(0.5 - overlap), abs=1e-3
    )
    separate = History(s.time, 0 * t, 0 * t, 0 * t, drive, -np.cos(t) - 0.8, 0 * t)
    union = part_above(0.5) + part_above(0.8)
    assert measure_motion(separate)["contact_loss"][0] == pytest.approx(
        1.0 - union, abs=1e-3
    )


def test_overlaps_are_cubic_where_rates_are_known():
    """The error of contact loss falls with the fourth power of the step."""
    exact = 1.0 - part_above(0.3)
    coarse = [8, 16, 32]
    errors = [
        abs(
            measure_motion(motion(mean=-0.3, backlash=9.0, steps=n))["contact_loss"][0]
            - exact
        )
        for n in coarse
    ]
    assert errors[0] < 2e-4
    assert errors[-1] < 5e-6


def test_a_touch_within_one_step_is_seen():
    """The top of the motion lies between two samples that are both apart."""
    step = 2.0 * math.pi / 9
    s = motion(mean=-math.cos(0.5 * step) - 1e-3, backlash=9.0, steps=9)
    shifted = s.time[:, None] + 0.5 * step
    top = -math.cos(0.5 * step) - 1e-3
    value, rate = top + np.cos(shifted), -np.sin(shifted)
    seen = History(s.time, value, rate, value, value, -value - 9.0, value)
    exact = part_above(-top)
    assert (value < 0.0).all()
    assert 1.0 - measure_motion(seen)["contact_loss"][0] == pytest.approx(
        exact, rel=0.02
    )


def test_a_pair_that_leaves_keeps_its_contact_until_then():
    s = motion(mean=2.0, backlash=9.0)
    drive = s.drive_overlap.copy()
    drive[32:] = -math.inf  # disengages at half time
    half = History(
        s.time, s.deflection, s.rate, s.force, drive, s.back_overlap, s.force
    )
    assert measure_motion(half)["contact_loss"][0] == pytest.approx(
        0.5, abs=1.0 / STEPS
    )


def test_windows_together_are_the_whole():
    rng = np.random.default_rng(3)
    parts = []
    for _ in range(6):
        parts.append(motion(amplitude=rng.uniform(0.5, 1.5), mean=rng.normal()))
    together = combine_windows([measure_motion(part) for part in parts])
    time = np.concatenate([p.time[:-1] + 2 * math.pi * i for i, p in enumerate(parts)])

    def join(name):
        values = [getattr(p, name)[:-1] for p in parts]
        return np.concatenate(values)

    mean = join("deflection").mean(axis=0)
    rms = join("deflection").std(axis=0)
    assert time.size == 6 * STEPS
    assert together["dte_mean"] == pytest.approx(mean)
    assert together["dte_rms"] == pytest.approx(rms)
    window_rms = [measure_motion(part)["dte_rms"][0] for part in parts]
    expected = np.std(window_rms, ddof=1) / math.sqrt(6)
    assert together["dte_rms_stderr"] == pytest.approx([expected])
    assert together["force_peak"] == pytest.approx(np.abs(join("force")).max())


def test_one_window_has_no_spread():
    one = measure_motion(motion())
    statistics = combine_windows([one])
    for name, value in one.items():
        assert statistics[name] == pytest.approx(value), name
    assert statistics["dte_rms_stderr"] == 0.0


def test_long_periods_take_fewer_windows():
    assert count_windows(16, 8) == 16
    assert count_windows(16, 8 * 72) == 4
    assert count_windows(1, 8 * 72) == 1
    assert count_windows(1000, 8) == 250


@pytest.fixture(scope="module")
def chaotic(system, idler):
    """The relieved idler with half the damping of the tests."""
    return system(idler(damping=0.02), relief=25e-6)


CHAOS = 1300.0  # Hz


def test_chaos_is_measured_with_its_spread(chaotic):
    first = respond(chaotic, CHAOS)
    assert first.status == Status.APERIODIC
    assert (first.dte_rms_stderr > 0.0).all()
    rms = []
    state = first.state
    for _ in range(6):
        response = respond(chaotic, CHAOS, Settings(max_periods=32), state)
        rms.append(response.dte_rms)
        state = response.state
    # estimates from windows one after another scatter as the spread says
    ratio = np.std(rms, axis=0, ddof=1) / first.dte_rms_stderr
    assert (ratio < 4.0).all()


def test_the_history_is_that_of_the_last_window(chaotic):
    settings = Settings(max_periods=32)
    _, history = respond_with_history(chaotic, CHAOS, settings)
    periods = (history.time[-1] - history.time[0]) * CHAOS
    assert periods == pytest.approx(settings.multiples)
