"""Noise of a signal between its tones."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.signals.noise_floor import MIN_TURNS, noise_floor

RATE, POINTS, TURNS = 10_000.0, 200, 50
DURATION = TURNS * POINTS / RATE
ANGLE = 2.0 * np.pi * np.arange(TURNS * POINTS) / POINTS


def white(seed, deviation):
    return deviation * np.random.default_rng(seed).standard_normal(ANGLE.size)


@pytest.mark.parametrize("deviation", [1e-6, 0.1, 30.0])
def test_white_noise_has_its_standard_deviation(deviation):
    levels = [
        noise_floor(white(seed, deviation), POINTS, RATE, DURATION)
        for seed in range(20)
    ]
    assert np.mean(levels) == pytest.approx(deviation, rel=0.01)
    assert levels == pytest.approx([deviation] * 20, rel=0.1)


def test_tones_of_this_gear_and_of_others_are_no_noise():
    tones = 5.0 * np.cos(20.0 * ANGLE) + np.cos(3.0 * ANGLE) + 2.0
    tones += np.cos(20.0 * ANGLE * 31.0 / 47.0) + 0.5 * np.cos(ANGLE * 31.0 / 47.0)
    noise = white(7, 0.1)
    alone = noise_floor(noise, POINTS, RATE, DURATION)
    beside = noise_floor(noise + tones, POINTS, RATE, DURATION)
    assert beside == pytest.approx(alone, rel=0.02)
    assert noise_floor(tones, POINTS, RATE, DURATION) < 1e-5


def test_noise_below_the_rate_is_that_of_the_samples():
    """Signals over the angle may have more points than the recording had samples."""
    fine = np.repeat(white(3, 1.0), 4)  # power of lines below is that of the samples
    level = noise_floor(fine, 4 * POINTS, RATE, DURATION)
    assert level == pytest.approx(1.0, rel=0.05)


def test_few_turns_are_refused():
    signal = white(0, 1.0)[: (MIN_TURNS - 1) * POINTS]
    with pytest.raises(ValueError, match="3 turns; noise needs 4"):
        noise_floor(signal, POINTS, RATE, DURATION)
    with pytest.raises(ValueError, match="too short"):
        noise_floor(white(0, 1.0), POINTS, 1e-3, DURATION)
