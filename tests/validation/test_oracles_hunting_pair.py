"""The hunting pair against what is known without it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from validation.oracles.hunting_pair import HuntingPair, motion

NONE = ((0.0,) * 3, (0.0,) * 4)


def make_pair(errors=NONE, **changes) -> HuntingPair:
    values = {
        "mean": 3e8,
        "variation": 0.35,
        "contact_ratio": 1.6,
        "mass": 0.8,
        "damping": 800.0,
        "force": 2000.0,
        "backlash": 1e-4,
    }
    return HuntingPair(errors=errors, **(values | changes))


def test_stiffness_has_its_mean_and_variation():
    pair = make_pair()
    x = (np.arange(2000) + 0.5) / 2000
    total = [pair.force_of(1e-6, pair.engaged(each)) / 1e-6 for each in x]
    assert np.mean(total) == pytest.approx(pair.mean, rel=1e-3)
    assert np.ptp(total) == pytest.approx(pair.variation * pair.mean)


def test_without_variation_it_rests():
    found = motion(make_pair(variation=0.0), 900.0, settle=1, points=9)
    np.testing.assert_allclose(found.s, 2000.0 / 3e8, rtol=1e-7)
    np.testing.assert_allclose(found.force, 2000.0, rtol=1e-7)
    assert found.contact_loss == 0.0


def test_teeth_meet_again_after_all_others():
    errors = tuple(1e-6 * n for n in range(3)), tuple(1e-5 * n for n in range(4))
    pair = make_pair(errors)
    assert pair.period == 12
    assert len({round(pair.gap(n) * 1e6) for n in range(12)}) == 12
    assert pair.gap(13) == pair.gap(1)


def test_one_mesh_cycle_a_turn_is_a_linear_oscillator():
    """Single teeth of constant stiffness under an error that rises and falls."""
    errors = ((0.0, 1e-7), (0.0,))
    pair = make_pair(errors, variation=0.0, contact_ratio=1.0 + 1e-9)
    found = motion(pair, 1000.0, settle=12, points=41, rtol=1e-11)
    # a square wave of half the mesh frequency drives k (s - g) + c s' + m s''
    time = found.x / 1000.0
    expected = np.full(time.shape, pair.force / pair.mean + 0.5e-7)
    for harmonic in range(1, 801, 2):
        angular = harmonic * math.pi * 1000.0
        drive = -2e-7 / (math.pi * harmonic) * (-1) ** ((harmonic - 1) // 2)
        stiff = pair.mean - pair.mass * angular**2 + 1j * pair.damping * angular
        expected += (drive * pair.mean / stiff * np.exp(1j * angular * time)).real
    np.testing.assert_allclose(found.s, expected, atol=2e-11)
