"""Order tracking of synthetic signals at changing speed, whose orders are known."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as checked
from hypothesis import strategies as st

from lumped.signals.averages import order_amplitudes, synchronous_average
from lumped.signals.orders import (
    order_map,
    pulse_times,
    resample_at,
    times_at_angles,
)
from lumped.steady.ramps import SpeedRamp

RAMP = SpeedRamp(start=10.0, end=30.0, duration=2.0)  # turns per second, 40 turns
POINTS = 256  # per turn
LINES = {0: (1.5, 0.0), 3: (2.0, 0.4), 19: (0.5, -1.0), 38: (1.0, 2.0)}


def of_angle(turns):
    """A signal of known orders (k, 1) at angles (k,) [turns]."""
    turns = np.asarray(turns)[:, None]
    parts = (
        amplitude * np.cos(2.0 * math.pi * order * turns + phase)
        for order, (amplitude, phase) in LINES.items()
    )
    return sum(parts)


def sampled(per_cycle):
    """Times and samples of the chirp, per_cycle in the shortest cycle of order 38."""
    rate = per_cycle * 38 * RAMP.end
    time = np.arange(int(RAMP.duration * rate) + 1) / rate
    return time, of_angle(RAMP.cycles_at(time))


def equal_angles(turns=40):
    return np.arange(turns * POINTS) / POINTS


def test_a_chirp_of_known_angle_has_its_orders():
    angle = equal_angles()
    at = RAMP.time_at(angle)
    errors = []
    for per_cycle in (32, 64):
        tracked = resample_at(*sampled(per_cycle), at)
        errors.append(np.abs(tracked - of_angle(angle)).max())
    assert errors[1] < 1e-6 * 5.0
    assert errors[0] > 12.0 * errors[1]  # of fourth order in the step
    result = order_map(tracked, POINTS, 4)
    for order in range(60):
        amplitude, _ = LINES.get(order, (0.0, 0.0))
        lines = result.amplitude[:, 4 * order, 0]
        np.testing.assert_allclose(lines, amplitude, atol=2e-6)
    average, turns = synchronous_average(tracked, POINTS, POINTS)
    assert turns == 40
    np.testing.assert_allclose(average, of_angle(equal_angles(1)), atol=2e-6)


def test_without_tracking_lines_are_lost():
    time, values = sampled(16)
    average, _ = synchronous_average(values, (len(time) - 1) / 40, POINTS)
    amplitude = order_amplitudes(average)[:, 0]
    assert amplitude[38] < 0.1 * LINES[38][0]


@pytest.mark.parametrize("pulses", [1, 2, 7])
def test_pulses_give_the_angle_of_a_ramp(pulses):
    """Exactly, as cubics pass through the square of the time."""
    angle = equal_angles(39)
    pulse = RAMP.time_at(np.arange(40 * pulses + 1) / pulses)
    at = times_at_angles(pulse, pulses, angle)
    assert np.abs(RAMP.cycles_at(at) - angle).max() < 1e-9


def tracked_angle(pulses, order):
    """Errors [turns] of the angle by pulses where the speed swings at an order."""
    time, _ = sampled(64)
    cycles = RAMP.cycles_at(time)
    turns = cycles + 1e-3 * np.sin(2.0 * math.pi * order * cycles)
    angle = np.arange(8 * POINTS, 30 * POINTS) / POINTS
    at = times_at_angles(pulse_times(time, turns, pulses), pulses, angle)
    return resample_at(time, turns[:, None], at)[:, 0] - angle


def test_pulses_find_slow_vibration_by_the_fourth_power_of_their_number():
    errors = [np.abs(tracked_angle(pulses, 0.25)).max() for pulses in (1, 2, 4)]
    assert errors[0] < 3e-5
    for coarse, fine in pairwise(errors):
        assert coarse > 12.0 * fine


def test_pulses_do_not_find_vibration_between_them():
    """Of the mesh: once per turn it has the same phase, and shifts no pulse."""
    assert np.abs(tracked_angle(1, 38)).max() == pytest.approx(1e-3, rel=1e-3)


def test_pulses_come_at_equal_angles():
    time, _ = sampled(8)
    turns = RAMP.cycles_at(time) + 1e-3 * np.sin(40.0 * time)
    for pulses in (1, 3):
        at = pulse_times(time, turns, pulses)
        exact = RAMP.cycles_at(at) + 1e-3 * np.sin(40.0 * at)
        np.testing.assert_allclose(exact, np.arange(at.size) / pulses, atol=1e-9)


@given(
    st.floats(0.1, 1e3),
    st.integers(1, 8),
    st.integers(4, 60),
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20),
)
@checked(max_examples=200, deadline=None)
def test_at_constant_speed_the_angle_is_exact(speed, pulses, count, parts):
    pulse = np.arange(count) / (pulses * speed)
    angle = np.sort(np.array(parts)) * (count - 1) / pulses
    at = times_at_angles(pulse, pulses, angle)
    np.testing.assert_allclose(at, angle / speed, rtol=1e-12, atol=1e-12 / speed)


@given(st.integers(1, 6), st.integers(0, 30), st.floats(0.0, 6.28))
@checked(max_examples=100, deadline=None)
def test_a_line_has_its_amplitude_in_every_window(window, order, phase):
    turns = np.arange(12 * 64) / 64
    values = 3.0 * np.cos(2.0 * math.pi * order * turns + phase)[:, None]
    result = order_map(values, 64, window)
    expected = 3.0 if order else 3.0 * abs(math.cos(phase))
    assert result.order[window * order] == pytest.approx(order)
    lines = result.amplitude[:, window * order, 0]
    np.testing.assert_allclose(lines, expected, rtol=1e-9, atol=1e-12)
    assert result.turns[0] == pytest.approx(0.5 * window)
    assert result.turns[-1] <= 12.0 - 0.5 * window + 1e-9


def test_a_line_between_those_of_a_window_keeps_most_of_its_amplitude():
    turns = np.arange(12 * 64) / 64
    values = np.cos(2.0 * math.pi * 10.125 * turns)[:, None]
    largest = order_map(values, 64, 4, max_order=20.0)
    assert largest.order[-1] == pytest.approx(20.0)
    assert 0.84 < largest.amplitude.max(axis=1).min() < 0.86


def test_what_cannot_be_tracked_is_refused():
    time = np.linspace(0.0, 1.0, 50)
    with pytest.raises(ValueError, match="turns must rise"):
        pulse_times(time, np.sin(4.0 * time))
    with pytest.raises(ValueError, match="3 pulses, 4 or more"):
        times_at_angles(time[:3], 1, [0.0])
    with pytest.raises(ValueError, match="from 0 to 3, between the pulses"):
        times_at_angles(time[:4], 1, [3.5])
    with pytest.raises(ValueError, match="within the samples, 0 to 1 s"):
        resample_at(time, time[:, None], [1.5])
    with pytest.raises(ValueError, match="50 samples do not fill a window of 2 turns"):
        order_map(time[:, None], 32, 2)
