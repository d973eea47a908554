"""Signals of a train in motion, beside the motion that was integrated."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.gearset import load_gear_set
from fegear.statics.excitation import StiffnessSource
from fegear.train.lumped_models import LumpedModel, lumped_system
from lumped import Settings
from lumped.signals.sensors import CoordinateMotion, sensor_signals, with_noise
from lumped.steady.motion import time_history

FREQUENCY = 900.0


def idler_motion(steps, *, kind="rectangular", errors=True, direction=None):
    """The built-in train on bearings, one tooth of whose pinion is set back."""
    gears = load_gear_set("liu-idler")
    if errors:
        pitch = tuple(2e-6 * (tooth == 7) for tooth in range(38))
        first = replace(gears.gears[0], pitch_errors=pitch)
        gears = replace(gears, gears=(first, *gears.gears[1:]))
    model = LumpedModel(translations=True, stiffness=StiffnessSource(kind=kind))
    system = lumped_system(gears, 100.0, model)
    if direction is not None:
        parts = tuple(
            replace(gear, bearing_stiffness=(1e8, 2e8), bearing_direction=direction)
            for gear in system.train.gears
        )
        system = replace(system, train=replace(system.train, gears=parts))
    settings = Settings(tolerance=1e-9, steps=steps)
    return CoordinateMotion(system, time_history(system, FREQUENCY, settings).history)


def errors_of(motion):
    """Largest errors of deflection and rate of all meshes, relative to their range."""
    rows = motion.system.modes.coordinates.mesh_rows
    history, moved = motion.history, motion.at(motion.history.time)
    pairs = zip(moved, (history.deflection, history.rate), strict=True)
    return [np.abs(x @ rows.T - y).max() / np.ptp(y) for x, y in pairs]


@pytest.mark.parametrize("kind", ["rectangular", "trapezoid"])
def test_modes_move_as_the_integration_says(kind):
    errors = [errors_of(idler_motion(steps, kind=kind)) for steps in (128, 512)]
    assert errors[1][0] < 5e-5
    assert errors[1][1] < 1e-3
    # twice of half the steps, with kinks of second order, jumps of the rate of first
    assert errors[0][0] > 8.0 * errors[1][0]
    assert errors[0][1] > 2.5 * errors[1][1]


def test_bearings_carry_the_mesh_forces_at_rest():
    """The mean of the bearing force balances those of the meshes of the gear."""
    motion = idler_motion(256, direction=0.3)
    time = np.arange(4096) * motion.period / 4096
    signals = sensor_signals(motion, time)
    coordinates = motion.system.modes.coordinates
    force = np.trapezoid(motion.history.force, motion.history.time, axis=0)
    load = -coordinates.mesh_rows.T @ (force / motion.period)
    for number, gear in enumerate(motion.system.train.gears):
        for axis in "xy":
            mean = signals[f"{gear.name}_bearing_{axis}_N"].mean()
            expected = load[coordinates.indices[number, axis]]
            assert mean == pytest.approx(expected, abs=0.5)
    assert np.abs(load).max() > 1000.0


def test_speeds_follow_from_their_torques():
    """Euler's equation with the mesh forces that the integration gives."""
    motion = idler_motion(512, kind="trapezoid")
    train, history = motion.system.train, motion.history
    modes, coordinates = motion.system.modes, motion.system.modes.coordinates
    time = history.time
    displacement, velocity = motion.at(time)
    springs = coordinates.spring_rows.T * coordinates.spring_stiffness
    damping = modes.damping_matrix(train.damping_ratio)
    force = coordinates.load - displacement @ (springs @ coordinates.spring_rows)
    force = force - velocity @ damping.T - history.force @ coordinates.mesh_rows
    momentum = velocity * coordinates.mass
    impulse = 0.5 * (force[1:] + force[:-1]) * np.diff(time)[:, None]
    change = np.diff(momentum, axis=0)
    assert np.abs(change - impulse).max() < 2e-3 * np.abs(change).max()
    for number, gear in enumerate(train.gears):
        signal = sensor_signals(motion, time)[f"{gear.name}_speed_deviation_rad_per_s"]
        rate = (
            train.sense(number) * velocity[:, coordinates.indices[number, "rotation"]]
        )
        np.testing.assert_array_equal(signal, rate)
        assert abs(signal.mean()) < 1e-2 * np.ptp(signal)


def test_noise_has_its_part_and_its_seed():
    time = np.arange(200_000) / 1000.0
    signals = {"a_m": 1e-6 * np.sin(time), "b_N": 3.0 + np.cos(time)}
    noisy = with_noise(signals, 0.2, 5)
    for name, values in signals.items():
        part = (noisy[name] - values).std() / values.std()
        assert part == pytest.approx(0.2, abs=0.2 * 4.0 / math.sqrt(2 * time.size))
    again, other = with_noise(signals, 0.2, 5), with_noise(signals, 0.2, 6)
    assert (again["a_m"] == noisy["a_m"]).all()
    assert (other["a_m"] != noisy["a_m"]).any()
    assert with_noise(signals, 0.0, 5) == signals


def test_only_models_of_springs_have_signals():
    motion = idler_motion(64, errors=False)
    with pytest.raises(ValueError, match="models 1 to 3"):
        CoordinateMotion(
            type("Coupled", (), {"contacts": 1, "has_friction": False})(),  # type: ignore[arg-type]
            motion.history,
        )
