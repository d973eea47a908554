"""Signals of recordings at equal angles beside those that are known there."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lumped.signals.rotation import (
    constant_rotation,
    rotation_of_pulses,
    rotation_of_speed,
    signals_over_angle,
)

RATE, START, RISE = 8000.0, 8.0, 4.0
TIME = np.arange(16_000) / RATE
TURNS = START * TIME + 0.5 * RISE * TIME**2


def pulses(per_turn: int) -> np.ndarray:
    count = int(TURNS[-1] * per_turn) + 1
    angle = np.arange(count) / per_turn
    return (-START + np.sqrt(START**2 + 2.0 * RISE * angle)) / RISE


ROTATIONS = {
    "pulses": rotation_of_pulses(pulses(3), 3),
    "speed": rotation_of_speed(TIME, START + RISE * TIME),
}


@pytest.mark.parametrize("rotation", ROTATIONS.values(), ids=ROTATIONS)
@pytest.mark.parametrize("ratio", [Fraction(1), Fraction(7, 5), Fraction(2, 3)])
def test_orders_of_a_ramp_are_lines(rotation, ratio):
    angle = 2.0 * np.pi * float(ratio) * TURNS
    values = np.stack([np.cos(12 * angle), np.sin(3 * angle)], axis=1)
    signals = signals_over_angle(TIME, values, rotation, ratio, 64)
    whole = signals.values.reshape(-1, signals.points, 2)
    assert len(whole) == int(rotation.total * float(ratio))
    expected = 2.0 * np.pi * np.arange(signals.points) / signals.points
    for turn in whole:
        np.testing.assert_allclose(turn[:, 0], np.cos(12 * expected), atol=2e-3)
        np.testing.assert_allclose(turn[:, 1], np.sin(3 * expected), atol=2e-3)


def test_samples_that_are_closer_than_the_points_are_taken():
    """Order 100 of 64 points would be at 28."""
    angle = 2.0 * np.pi * TURNS
    signals = signals_over_angle(
        TIME, np.cos(100 * angle)[:, None], ROTATIONS["speed"], Fraction(1), 64
    )
    assert signals.points == 64 * 16
    average = signals.values.reshape(-1, signals.points).mean(axis=0)
    amplitude = 2.0 * np.abs(np.fft.rfft(average)) / signals.points
    assert amplitude[100] > 0.9
    assert amplitude[:33].max() < 0.01


def test_speeds_are_those_of_the_rotation():
    for rotation in ROTATIONS.values():
        low, high = rotation.speed_range
        assert START - 1e-9 <= low < START + 0.6
        assert START + 2 * RISE - 0.6 < high <= START + 2 * RISE
        assert rotation.turn_frequency == pytest.approx(START + RISE, rel=0.01)
    constant = constant_rotation(0.5, 2.5, 10.0)
    assert constant.total == pytest.approx(20.0)
    np.testing.assert_allclose(constant.times_at([0.0, 5.0, 20.0]), [0.5, 1.0, 2.5])


def test_what_does_not_turn_is_refused():
    with pytest.raises(ValueError, match="above 0"):
        rotation_of_speed(TIME, START - 8.0 * TIME)
    short = constant_rotation(0.0, 0.05, 10.0)
    values = np.zeros((16_000, 1))
    with pytest.raises(ValueError, match=r"0\.5 turns, 1 is needed"):
        signals_over_angle(TIME, values, short, Fraction(1), 64)
