"""Averages over teeth of planets and sun, of signals made of these teeth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.signals.planet_separation import (
    PassingGear,
    planet_gear,
    separated_average,
    sun_gear,
    with_equal_loads,
)
from lumped.signals.ring_sensor import PlanetPasses, RingSensor

SAMPLES = 32  # per mesh cycle
# teeth of sun, planet and ring, and planets; 36 and 96 have teeth in common, 31 and 89
# have none
SETS = {"common": (24, 36, 96, 4), "hunting": (27, 31, 89, 4)}


def sensor_of(ring, planets, sense=1, direction=0.4):
    angles = 2.0 * math.pi * np.arange(planets) / planets
    passes = PlanetPasses(ring=0, teeth=ring, meshes=(0,), angles=angles, sense=sense)
    return RingSensor(passes=passes, direction=direction, width=2.0 * math.pi / planets)


def tooth_waves(teeth, seed):
    """Smooth function of the teeth of a gear that have turned, with its period."""
    random = np.random.default_rng(seed)
    order = np.arange(1, 2 * teeth)
    lines = random.standard_normal((2, order.size)) @ np.diag(1.0 / order)

    def wave(turned):
        angle = 2.0 * math.pi * np.outer(turned, order) / teeth
        return np.cos(angle) @ lines[0] + np.sin(angle) @ lines[1]

    return wave


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("name", SETS)
def test_teeth_of_each_planet_come_back(name, sense):
    _, teeth, ring, planets = SETS[name]
    sensor = sensor_of(ring, planets, sense)
    turns = planet_gear(0, teeth).turns_needed(ring)
    cycles = np.arange(turns * ring * SAMPLES) / SAMPLES
    waves = [tooth_waves(teeth, seed) for seed in range(planets)]
    felt = sensor.weights(cycles)
    signal = sum(felt[:, n] * wave(cycles) for n, wave in enumerate(waves))
    for number, wave in enumerate(waves):
        average = separated_average(signal, SAMPLES, sensor, planet_gear(number, teeth))
        expected = wave(np.arange(teeth * SAMPLES) / SAMPLES)
        assert average.windows == turns
        error = np.abs(average.values - expected).max()
        assert error < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("name", SETS)
def test_teeth_of_the_sun_come_back(name, sense):
    teeth, _, ring, planets = SETS[name]
    sensor = sensor_of(ring, planets, -sense)
    gear = sun_gear(sensor, teeth, sense)
    cycles = np.arange(gear.turns_needed(ring) * ring * SAMPLES) / SAMPLES
    wave = tooth_waves(teeth, 5)
    # the sun brings each tooth from planet 1 to planet n by turning through the angle
    turned = [
        cycles - sense * teeth * angle / (2.0 * math.pi)
        for angle in sensor.passes.angles
    ]
    felt = sensor.weights(cycles)
    signal = sum(felt[:, n] * wave(one) for n, one in enumerate(turned))
    average = separated_average(signal, SAMPLES, sensor, gear)
    expected = wave(np.arange(teeth * SAMPLES) / SAMPLES)
    # splines between the samples, where a planet is no whole number of them further
    tolerance = 1e-9 if teeth % planets == 0 else 1e-4
    assert np.abs(average.values - expected).max() < tolerance * np.abs(expected).max()


def test_turns_that_are_needed():
    """36 planet teeth pass a ring of 96 with every twelfth, in three turns."""
    assert planet_gear(0, 36).turns_needed(96) == 3
    assert planet_gear(0, 24).turns_needed(96) == 1
    assert planet_gear(0, 31).turns_needed(89) == 31


def test_windows_overlap_by_half_and_are_two_teeth_wide_at_least():
    for name, width in (("common", 24.0), ("hunting", 2.0)):
        _, teeth, ring, planets = SETS[name]
        gear = planet_gear(1, teeth)
        signal = np.ones(gear.turns_needed(ring) * ring * SAMPLES)
        average = separated_average(signal, SAMPLES, sensor_of(ring, planets), gear)
        assert average.window_teeth == pytest.approx(width)


def test_too_few_turns_are_not_separated():
    """After 2 of 3 turns, 12 of 36 teeth have not come to the sensor."""
    sensor, gear = sensor_of(96, 4), planet_gear(0, 36)
    for turns, is_covered in ((2, False), (3, True), (7, True)):
        signal = np.ones(turns * 96 * SAMPLES)
        average = separated_average(signal, SAMPLES, sensor, gear)
        assert (average is not None) == is_covered


def test_teeth_that_never_come_to_the_sensor_are_not_separated():
    """One planet always passes with the same of 24 teeth of the sun, if the ring has
    96: only a sensor that feels 48 teeth would have all."""
    gear = PassingGear(teeth=24, planets=(0,), leads=(0.0,))
    signal = np.ones(5 * 96 * SAMPLES)
    assert separated_average(signal, SAMPLES, sensor_of(96, 4), gear) is None
    assert separated_average(signal, SAMPLES, sensor_of(96, 2), gear) is not None


def test_noise_falls_with_the_root_of_the_windows():
    _, teeth, ring, planets = SETS["hunting"]
    sensor, gear = sensor_of(ring, planets), planet_gear(2, teeth)
    random = np.random.default_rng(3)
    rms = []
    for sequences in (1, 16):
        size = sequences * gear.turns_needed(ring) * ring * SAMPLES
        noise = random.standard_normal(size)
        rms.append(separated_average(noise, SAMPLES, sensor, gear).values.std())
    assert rms[0] / rms[1] == pytest.approx(4.0, rel=0.1)


def test_loads_that_differ_leave_no_steps_between_planets():
    """Constant forces of all planets are those of their mean."""
    sensor = sensor_of(96, 4)
    loads = np.array([700.0, 1000.0, 900.0, 800.0])
    signal = sensor.weights(np.arange(4 * 96 * SAMPLES) / SAMPLES) @ loads
    level = with_equal_loads(signal, SAMPLES, sensor)
    average = separated_average(level, SAMPLES, sensor, sun_gear(sensor, 24, -1))
    np.testing.assert_allclose(average.values, 850.0, rtol=1e-10)
    equal = sensor.weights(np.arange(96 * SAMPLES) / SAMPLES).sum(axis=1)
    np.testing.assert_allclose(
        with_equal_loads(equal, SAMPLES, sensor), equal, atol=1e-12
    )
