"""Exponents and dimensions whose values are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from loose_wheels import SINE, spur

from lumped.clatter.chaos import correlation_dimension, lyapunov_exponent
from lumped.clatter.gearbox import Harmonics, SpeedSignal
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import centred_state, join_impacts, noise_of, simulate


@pytest.mark.parametrize(("kind", "wanted"), [("curve", 1.0), ("area", 2.0)])
def test_dimension_of_curves_and_areas(kind, wanted):
    random = np.random.default_rng(2)
    phase, speed = random.uniform(size=(2, 4000))
    if kind == "curve":
        speed = 0.2 + 0.1 * np.sin(2.0 * math.pi * phase)
    dimension, error = correlation_dimension(phase, speed)
    assert dimension == pytest.approx(wanted, abs=0.12)
    assert error < 0.3


def test_a_motion_that_repeats_has_no_dimension():
    random = np.random.default_rng(2)
    assert math.isnan(correlation_dimension(np.zeros(50), np.ones(50))[0])
    clusters = random.integers(0, 40, 4000) / 40.0
    near = clusters + 1e-9 * random.normal(size=4000)
    assert correlation_dimension(near, 1.0 + near)[0] == pytest.approx(0.0, abs=0.1)


def test_a_wheel_without_impacts_loses_neighbours_at_its_damping():
    """It flies in a play that is never used up: one exponent is 0, the other less."""
    wheel = spur(0.8, 0.0, 0.1, ratio=1e-3)
    group = WheelGroup((wheel,), SINE)
    exponent = lyapunov_exponent(group, centred_state(group), 40)
    assert exponent == pytest.approx(0.0, abs=0.5)


def test_strong_clatter_is_chaotic():
    group = WheelGroup((spur(),), SINE)
    state = centred_state(group)
    list(simulate(group, state, 4.0))
    assert lyapunov_exponent(group, state, 300) > 5.0


def test_impacts_lose_the_energy_that_is_missing():
    """Against walls at rest, without drag: kinetic energy before less that after."""
    still = Harmonics(0.04, (0.0,), (0.0,))
    group = WheelGroup((spur(0.8, 0.0, 0.0),), still)
    state = centred_state(group)
    state.v[0] = 1e-3
    inertia = group.wheels[0].inertia
    before = 0.5 * inertia * (state.v[0] / 0.04) ** 2
    impacts = join_impacts(list(simulate(group, state, 3.0)))
    after = 0.5 * inertia * (state.v[0] / 0.04) ** 2
    (noise,) = noise_of(group, impacts, 3.0)
    assert noise.impacts == len(impacts) > 3
    assert 3.0 * noise.power == pytest.approx(before - after, rel=1e-9)
    assert 3.0 * noise.level == pytest.approx(np.sum(impacts.speed**2))


def test_a_recorded_speed_moves_teeth_like_the_sine_that_it_samples():
    """Speed a w cos(w t) / R over whole periods integrates to a sin(w t)."""
    turn, size, radius = 2.0 * math.pi / 0.04, 0.15e-3, 0.05
    times = np.linspace(0.0, 0.4, 4001)
    speeds = 80.0 + size * turn * np.cos(turn * times) / radius
    signal = SpeedSignal(times, speeds, radius)
    sine = Harmonics(0.04, (size,), (0.0,))
    np.testing.assert_allclose(signal.at(times), sine.at(times), atol=1e-12)
    ends = []
    for excitation in (signal, sine):
        group = WheelGroup((spur(),), excitation)
        ends.append(join_impacts(list(simulate(group, centred_state(group), 0.1))))
    loud = ends[0].speed > 1e-5
    few = min(12, loud.sum())
    np.testing.assert_allclose(ends[0].time[:few], ends[1].time[:few], atol=1e-7)


def test_wheels_that_mesh_stay_in_their_plays():
    """Both plays of two spur wheels in a row."""
    first = spur(name="first", ratio=1.0)
    second = spur(0.8, 0.0, 0.0, name="second", driver="first", ratio=1.0)
    group = WheelGroup((first, second), SINE)
    state = centred_state(group)
    impacts = join_impacts(list(simulate(group, state, 1.0)))
    assert set(impacts.play) == {0, 1}
    box = group.box
    for time in np.arange(1.0, 2.0, 0.003):
        list(simulate(group, state, time))
        s = box.ratios * SINE.at(np.array([time]))[0] + box.rows @ state.q
        assert np.all((s <= 1e-15) & (s >= -1e-4 - 1e-15))


def test_a_wheel_that_rests_in_contact_has_no_exponent():
    """After each rest against the teeth it moves as after the one before."""
    excitation = Harmonics(0.04, (0.15e-3, 0.04e-3), (0.0, math.radians(30.0)))
    wheel = spur(0.8, -0.05, 1e-3, ratio=0.9)
    group = WheelGroup((wheel,), excitation)
    state = centred_state(group)
    list(simulate(group, state, 4.0))
    assert lyapunov_exponent(group, state, 200) == -math.inf
