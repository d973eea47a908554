"""The tooth that differs, by residuals whose tooth is known."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.signals.faulty_tooth import Engagement, faulty_tooth, integral_over_turn

SAMPLES = 32


def engagement(count=17, start=-0.8, end=0.7, first=0.0, drives=True, shift=0):
    teeth = 1 + (np.arange(count) + shift) % count
    return Engagement(first=first, start=start, end=end, drives=drives, teeth=teeth)


def bump(contact: Engagement, tooth: int, low: float, high: float) -> np.ndarray:
    """A residual of a tooth between two places, from the pitch point."""
    count = contact.teeth.size
    pitch = int(np.flatnonzero(contact.teeth == tooth)[0])
    place = contact.first + np.arange(SAMPLES * count) / SAMPLES
    within = (place - pitch - low) % count < high - low
    return within - within.mean()


@pytest.mark.parametrize("drives", [True, False])
@pytest.mark.parametrize("ratio", [1.2, 1.6, 2.4])
@pytest.mark.parametrize("first", [0.0, 0.37, -2.6])
def test_a_fault_of_a_whole_engagement_is_that_of_its_tooth(ratio, drives, first):
    contact = engagement(
        start=-0.55 * ratio, end=0.45 * ratio, first=first, drives=drives, shift=5
    )
    for tooth in (1, 8, 17):
        residual = bump(contact, tooth, contact.start, contact.end)[:, None]
        speed = np.gradient(residual[:, 0])
        both = np.stack([residual[:, 0], speed - speed.mean()], axis=1)
        named, rms = faulty_tooth(both, np.array([False, True]), contact)
        assert named.tolist() == [tooth, tooth]
        inside = contact.mean_squares(residual).max()
        assert rms[0] == pytest.approx(np.sqrt(inside))


@pytest.mark.parametrize("drives", [True, False])
def test_a_short_peak_at_the_end_of_the_path_is_a_broken_tip(drives):
    contact = engagement(drives=drives)
    low, high = (0.68, 0.78) if drives else (-0.88, -0.78)
    residual = bump(contact, 9, low, high)[:, None]
    named, _ = faulty_tooth(residual, np.array([False]), contact)
    assert named.tolist() == [9]


def test_mean_squares_are_those_of_the_places_in_contact():
    contact = engagement(count=7, start=-0.5, end=1.0, first=0.25)
    rng = np.random.default_rng(3)
    values = rng.normal(size=(7 * SAMPLES, 2))
    place = 0.25 + np.arange(7 * SAMPLES) / SAMPLES
    expected = [
        (values[(place - k + 0.5) % 7 < 1.5] ** 2).mean(axis=0) for k in range(7)
    ]
    assert contact.mean_squares(values) == pytest.approx(np.array(expected))


def test_the_integral_of_a_rate_is_over_turns():
    angle = np.arange(96) / 96
    wave = np.sin(2.0 * np.pi * 5 * angle)
    rate = 10.0 * np.pi * np.cos(2.0 * np.pi * 5 * angle)
    assert integral_over_turn(rate[:, None])[:, 0] == pytest.approx(wave)
