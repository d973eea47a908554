"""Indicators of damage beside values that are known, and what must not change them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lumped.signals.averages import TurnAverage, kurtosis, residual_of
from lumped.signals.indicators import (
    band_limited,
    difference_indicators,
    difference_of,
    na4,
    sixth_moment,
    window_averages,
)

TEETH, POINTS = 20, 1280


def mesh_and(values: np.ndarray, teeth: int = TEETH) -> np.ndarray:
    """A signal (p, 1) of a mesh with values (p,) added."""
    angle = 2.0 * np.pi * np.arange(values.size) / values.size
    return (np.cos(teeth * angle) + values)[:, None]


def indicators(values: np.ndarray, teeth: int = TEETH) -> dict[str, float]:
    average = TurnAverage(mesh_and(values, teeth), 1, (teeth,))
    return {name: float(v[0]) for name, v in difference_indicators(average).items()}


def noise(count: int = POINTS, seed: int = 5) -> np.ndarray:
    return 0.1 * np.random.default_rng(seed).standard_normal(count)


def test_gaussian_noise_has_the_moments_of_a_normal_distribution():
    """Standard errors are sqrt(24 / n) and sqrt(10170 / n)."""
    count = 2_000_000
    values = indicators(noise(count), 100_000)
    assert values["fm4"] == pytest.approx(3.0, abs=5.0 * np.sqrt(24.0 / count))
    assert values["m6a"] == pytest.approx(15.0, abs=5.0 * np.sqrt(10170.0 / count))


def test_moments_of_a_sine_and_of_two_values():
    angle = 2.0 * np.pi * np.arange(1000) / 1000
    square = np.where(angle < np.pi, 1.0, -1.0)
    signals = np.stack([np.sin(angle), square, np.ones(1000)], axis=1)
    np.testing.assert_allclose(kurtosis(signals)[:2], [1.5, 1.0])
    np.testing.assert_allclose(sixth_moment(signals)[:2], [2.5, 1.0])
    assert np.isnan(sixth_moment(signals)[2])


@pytest.mark.parametrize("name", ["fm4", "m6a", "energy_ratio"])
def test_one_impulse_raises_them(name):
    impulse = np.where(np.arange(POINTS) == 300, 5.0, 0.0)
    assert indicators(noise() + impulse)[name] > 1.2 * indicators(noise())[name]


@settings(deadline=None, max_examples=20)
@given(
    scale=st.floats(1e-9, 1e9),
    offset=st.floats(-3.0, 3.0),
    shift=st.integers(0, POINTS - 1),
)
def test_scale_mean_and_start_change_nothing(scale, offset, shift):
    values = mesh_and(noise())
    changed = scale * (np.roll(values, shift, axis=0) + offset)
    first, second = (
        difference_indicators(TurnAverage(v, 1, (TEETH,))) for v in (values, changed)
    )
    for name in first:
        np.testing.assert_allclose(second[name], first[name], rtol=1e-6)
    windows = np.stack([values, np.roll(values, 7, axis=0)])
    np.testing.assert_allclose(
        na4(scale * (windows + offset), (TEETH,)), na4(windows, (TEETH,)), rtol=1e-6
    )


@pytest.mark.parametrize("order", [0, 1, 19, 20, 21, 39, 40, 41, 60, 61])
def test_regular_orders_are_no_part_of_the_difference(order):
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    line = np.cos(order * angle + 0.3)[:, None]
    assert np.abs(difference_of(line, (TEETH,))).max() < 1e-12


@pytest.mark.parametrize("order", [2, 18, 22, 38, 42])
def test_other_orders_are_all_in_the_difference(order):
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    line = np.cos(order * angle + 0.3)[:, None]
    np.testing.assert_allclose(difference_of(line, (TEETH,)), line, atol=1e-12)


def test_first_sidebands_are_in_the_residual_only():
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    line = np.cos((TEETH + 1) * angle)[:, None]
    np.testing.assert_allclose(residual_of(line, (TEETH,)), line, atol=1e-12)


def test_the_energy_ratio_is_that_of_amplitudes():
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    assert indicators(0.3 * np.cos(5 * angle))["energy_ratio"] == pytest.approx(0.3)


def test_equal_teeth_have_no_difference():
    assert all(np.isnan(value) for value in indicators(np.zeros(POINTS)).values())
    windows = np.stack([mesh_and(np.zeros(POINTS))] * 2)
    assert np.isnan(na4(windows, (TEETH,))).all()


def test_na4_is_the_kurtosis_of_a_residual_that_repeats():
    values = mesh_and(noise())
    expected = kurtosis(residual_of(values, (TEETH,)))
    np.testing.assert_allclose(na4(np.stack([values] * 3), (TEETH,)), expected)


def test_na4_rises_with_the_size_of_a_fault_that_grows():
    """k times the residual in the last of n windows: k^4 / ((n - 1 + k^2) / n)^2."""
    sound, worn = mesh_and(noise()), mesh_and(3.0 * noise())
    windows = np.stack([sound] * 7 + [worn])
    expected = kurtosis(residual_of(sound, (TEETH,))) * 81.0 / 4.0
    np.testing.assert_allclose(na4(windows, (TEETH,)), expected)


def test_windows_are_averages_of_successive_turns():
    values = np.repeat(np.arange(7.0), 10)[:, None]
    averages = window_averages(values, 10, 2)
    assert averages.shape == (3, 10, 1)
    np.testing.assert_array_equal(averages[:, 0, 0], [0.5, 2.5, 4.5])
    with pytest.raises(ValueError, match="70 samples do not fill a window of 8 turns"):
        window_averages(values, 10, 8)


def test_fewer_points_have_the_lower_orders_alone():
    fine = np.arange(240) / 240 * 2.0 * np.pi
    coarse = fine[::3]
    signal = 1.0 + np.cos(5 * fine + 0.2) + np.cos(70 * fine)
    limited = band_limited(signal[:, None], 80)
    np.testing.assert_allclose(
        limited[:, 0], 1.0 + np.cos(5 * coarse + 0.2), atol=1e-12
    )
    np.testing.assert_array_equal(band_limited(limited, 80), limited)
