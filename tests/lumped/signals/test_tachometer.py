"""Pulses of a tachometer: where they are, and which are missing or too many."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.signals.tachometer import repaired_pulses, rising_edges

RATE = 5000.0


def ramp_pulses(count: int = 60) -> np.ndarray:
    """Times at which 8 t + 2 t^2 is a third of a whole number."""
    angle = np.arange(count) / 3.0
    return (-8.0 + np.sqrt(64.0 + 8.0 * angle)) / 4.0


def test_edges_are_between_samples():
    """A line between two samples, which is exact where edges are straight."""
    time = np.arange(5000) / RATE
    edges = np.array([0.1003, 0.25017, 0.7001, 0.9])
    width = 5.0 / RATE
    signal = sum(
        np.interp(time, [e - width, e + width, e + 0.02, e + 0.021], [0, 1, 1, 0])
        for e in edges
    )
    np.testing.assert_allclose(rising_edges(time, 7.0 * signal - 3.0), edges, atol=1e-9)


def test_noise_on_an_edge_is_no_pulse():
    time = np.arange(20_000) / RATE
    signal = np.sin(2.0 * np.pi * 5.0 * time - 0.5)
    noisy = signal + 0.05 * np.random.default_rng(1).standard_normal(time.size)
    edges = rising_edges(time, noisy)
    assert edges.size == 20
    np.testing.assert_allclose(np.diff(edges), 0.2, atol=0.01)


def test_pulses_that_are_right_stay():
    pulses = ramp_pulses()
    train = repaired_pulses(pulses)
    np.testing.assert_array_equal(train.time, pulses)
    assert (train.dropped, train.doubled) == (0, 0)


def test_the_scatter_of_intervals():
    """0 of a speed that rises slowly, and that of pulses with a known jitter."""
    assert repaired_pulses(ramp_pulses()).scatter < 1e-3
    jitter = 1e-3 * np.random.default_rng(2).standard_normal(100_000)
    pulses = np.arange(100_000) + jitter
    # pulses are at the ends of an interval (1.5 of each) and of both (0.5)
    expected = 1e-3 * np.sqrt(2 * 1.5**2 + 2 * 0.5**2)
    assert repaired_pulses(pulses).scatter == pytest.approx(expected, rel=0.01)
    assert repaired_pulses(pulses).error == pytest.approx(1e-3, rel=0.01)


@pytest.mark.parametrize("lost", [[20], [7, 31], [11, 12], [1, 58]])
def test_missing_pulses_are_interpolated(lost):
    pulses = ramp_pulses()
    train = repaired_pulses(np.delete(pulses, lost))
    assert (train.dropped, train.doubled) == (len(lost), 0)
    np.testing.assert_allclose(train.time, pulses, atol=2e-5)


@pytest.mark.parametrize("part", [0.05, 0.3, 0.5])
@pytest.mark.parametrize("after", [0, 20, 57])
def test_doubled_pulses_are_left_out(part, after):
    pulses = ramp_pulses()
    extra = pulses[after] + part * (pulses[after + 1] - pulses[after])
    train = repaired_pulses(np.sort(np.append(pulses, extra)))
    assert (train.dropped, train.doubled) == (0, 1)
    np.testing.assert_array_equal(train.time, pulses)


def test_a_pulse_that_is_lost_and_one_that_is_doubled():
    pulses = ramp_pulses()
    wrong = np.sort(np.append(np.delete(pulses, 40), pulses[10] + 0.004))
    train = repaired_pulses(wrong)
    assert (train.dropped, train.doubled) == (1, 1)
    np.testing.assert_allclose(train.time, pulses, atol=2e-5)


def test_too_many_wrong_pulses_are_refused():
    pulses = ramp_pulses()
    lost = np.arange(4, 56, 7)
    with pytest.raises(ValueError, match="8 missing and 0 doubled of 60 pulses; at"):
        repaired_pulses(np.delete(pulses, lost))
    extra = pulses[3:57:5] + 0.004
    with pytest.raises(ValueError, match="0 missing and 11 doubled of 71 pulses; at"):
        repaired_pulses(np.sort(np.append(pulses, extra)))
    with pytest.raises(ValueError, match="3 pulses, 4 or more"):
        repaired_pulses(pulses[:3])
