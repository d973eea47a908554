"""Averages over turns of signals whose lines are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped.signals.averages import (
    TurnAverage,
    kurtosis,
    order_amplitudes,
    residual_of,
    synchronous_average,
)

TEETH, POINTS = 23, 23 * 32


def modulated(turns: np.ndarray, depth: float = 0.3, order: int = 2) -> np.ndarray:
    """Two mesh harmonics, whose amplitudes are modulated by a rotation (t, 1)."""
    modulation = 1.0 + depth * np.cos(2.0 * np.pi * order * turns + 0.4)
    mesh = 2.0 * np.cos(2.0 * np.pi * TEETH * turns)
    mesh += 0.5 * np.sin(2.0 * np.pi * 2 * TEETH * turns)
    return (5.0 + modulation * mesh)[:, None]


def averaged(signal: np.ndarray, per_turn: float = POINTS) -> TurnAverage:
    values, turns = synchronous_average(signal, per_turn, POINTS)
    return TurnAverage(values, turns, (TEETH,))


@given(depth=st.floats(0.0, 2.0), order=st.integers(1, 9))
def test_sidebands_of_a_modulation_have_half_its_depth(depth, order):
    turns = np.arange(3 * POINTS) / POINTS
    average = averaged(modulated(turns, depth, order))
    expected = np.zeros(POINTS // 2 + 1)
    expected[0] = 5.0
    for harmonic, amplitude in ((1, 2.0), (2, 0.5)):
        expected[harmonic * TEETH] += amplitude
        for side in (-order, order):
            expected[harmonic * TEETH + side] += 0.5 * depth * amplitude
    assert average.turns == 3
    np.testing.assert_allclose(average.amplitude[:, 0], expected, rtol=0, atol=1e-12)


def test_the_residual_is_what_is_not_of_the_mesh():
    turns = np.arange(POINTS) / POINTS
    residual = averaged(modulated(turns)).residual
    plain = modulated(turns, depth=0.0)
    np.testing.assert_allclose(residual, modulated(turns) - plain, atol=1e-12)
    assert not averaged(plain).has_residual.any()
    assert np.isnan(averaged(plain).kurtosis).all()
    assert np.isnan(averaged(plain).peak_turn).all()


@pytest.mark.parametrize("points", [24, 25])
def test_amplitudes_have_the_power_of_the_signal(points):
    """Parseval, with and without a line at half the sampling rate."""
    average = np.random.default_rng(3).standard_normal((points, 2))
    squares = order_amplitudes(average) ** 2
    squares[1 : (points + 1) // 2] *= 0.5
    np.testing.assert_allclose(squares.sum(axis=0), (average**2).mean(axis=0))


def test_multiples_of_several_meshes_are_removed():
    turns = np.arange(POINTS)[:, None] / POINTS
    orders = 7, 23, 31
    average = sum(np.cos(2.0 * np.pi * order * turns) for order in orders)
    residual = residual_of(average, (7, 23))
    np.testing.assert_allclose(
        residual, np.cos(2.0 * np.pi * 31 * turns), rtol=0, atol=1e-12
    )


def test_kurtosis_of_known_distributions():
    turn = np.arange(1000) / 1000
    impulse = np.zeros(1000)
    impulse[3] = 1.0
    noise = np.random.default_rng(1).standard_normal(1_000_000)
    assert kurtosis(np.sin(2.0 * np.pi * turn)[:, None])[0] == pytest.approx(1.5)
    # four standard errors, the root of 24 / n each
    assert abs(kurtosis(noise[:, None])[0] - 3.0) < 4.0 * math.sqrt(24e-6)
    mean, count = 1e-3, 1000.0
    expected = (1 - 4 * mean + 6 * mean**2 - 3 * mean**3) / (mean * (1 - mean) ** 2)
    assert kurtosis(impulse[:, None])[0] == pytest.approx(expected)
    assert expected == pytest.approx(count, rel=0.01)
    assert np.isnan(kurtosis(np.ones((4, 1)))).all()


def test_noise_of_the_average_falls_with_the_root_of_the_turns():
    random = np.random.default_rng(2)
    deviations = []
    for turns in (1, 16, 256):
        noise = random.standard_normal((turns * POINTS, 1))
        deviations.append(averaged(noise).values.std() * math.sqrt(turns))
    # six standard errors
    np.testing.assert_allclose(deviations, 1.0, atol=6.0 / math.sqrt(2 * POINTS))


def test_what_repeats_with_another_gear_is_averaged_away():
    """A line at 23 / 31 cycles per turn, over 31 turns."""
    turns = np.arange(31 * POINTS)[:, None] / POINTS
    other = np.cos(2.0 * np.pi * 23 / 31 * turns + 0.2)
    assert np.abs(averaged(other).values).max() < 1e-12
    assert np.abs(averaged(other[: 8 * POINTS]).values).max() > 1e-2


@given(tooth=st.integers(0, TEETH - 1))
def test_another_tooth_rotates_the_average(tooth):
    turns = np.arange(2 * POINTS)[:, None] / POINTS

    def with_impulse_at(shift: float) -> np.ndarray:
        distance = (turns - shift + 0.5) % 1.0 - 0.5
        return modulated(turns[:, 0], 0.0) + np.exp(-((TEETH * distance) ** 2))

    first = averaged(with_impulse_at(0.25 / TEETH))
    other = averaged(with_impulse_at((tooth + 0.25) / TEETH))
    rotated = np.roll(first.residual, tooth * POINTS // TEETH, axis=0)
    np.testing.assert_allclose(other.residual, rotated, rtol=0, atol=1e-12)
    assert int(TEETH * other.peak_turn[0]) == tooth


def test_samples_beside_the_points_are_interpolated_with_fourth_order():
    errors = []
    for refinement in (2, 4, 8):
        per_turn = 0.61803 * refinement * POINTS
        turns = np.arange(math.ceil(per_turn) + 2) / per_turn
        average = averaged(modulated(turns), per_turn)
        exact = modulated(np.arange(POINTS) / POINTS)
        # away from the ends of the samples, where splines are of lower order
        inside = slice(POINTS // 8, -POINTS // 8)
        errors.append(np.abs(average.values - exact)[inside].max())
        assert average.turns == 1
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 4.0, atol=0.3)


def test_samples_that_do_not_cover_a_turn_are_refused():
    values = np.zeros((POINTS - 1, 1))
    assert synchronous_average(np.zeros((POINTS, 1)), POINTS, POINTS)[1] == 1
    with pytest.raises(ValueError, match="735 samples do not cover a turn of 736"):
        synchronous_average(values, POINTS, POINTS)
