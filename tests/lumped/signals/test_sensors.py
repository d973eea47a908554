"""Signals of a train in motion, beside the motion that was integrated."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped import Settings
from lumped.signals.coordinate_motion import coordinate_motion
from lumped.signals.sensors import sensor_signals, with_noise
from lumped.steady.motion import bounded_response
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from tests.oracles.mode_motion import LinearModeMotion

FREQUENCY = 900.0


def idler_motion(
    steps, *, kind="rectangular", errors=True, direction=None, method="rk4"
):
    """The built-in train on bearings, one tooth of whose pinion is set back."""
    gears = load_gear_set("liu-idler")
    if errors:
        pitch = tuple(2e-6 * (tooth == 7) for tooth in range(38))
        first = replace(gears.gears[0], pitch_errors=pitch)
        gears = replace(gears, gears=(first, *gears.gears[1:]))
    model = LumpedModel(
        number=1, translations=True, excitation=ExcitationSettings(kind=kind)
    )
    system = lumped_system(gears, 100.0, model)
    if direction is not None:
        parts = tuple(
            replace(gear, bearing_stiffness=(1e8, 2e8), bearing_direction=direction)
            for gear in system.train.gears
        )
        system = replace(system, train=replace(system.train, gears=parts))
    steps = None if method == "dopri5" else steps
    settings = Settings(tolerance=1e-9, steps=steps, method=method)
    response, _, settings = bounded_response(system, FREQUENCY, settings)
    at = response.state, Speed(FREQUENCY, settings), response.multiple
    _, history = stepper_of(system, settings).record(*at, with_states=True)
    return coordinate_motion(system, history), history


def largest_errors(moved, expected):
    """Largest errors of displacement and velocity, relative to their ranges."""
    return [
        np.abs(x - y).max() / np.ptp(y, axis=0).max()
        for x, y in zip(moved, expected, strict=True)
    ]


@pytest.mark.parametrize("kind", ["rectangular", "trapezoid"])
def test_modes_move_as_their_mesh_forces_make_them(kind):
    """Beside each mode as an oscillator under the recorded forces, line by line."""
    errors = []
    for steps in (128, 512):
        motion, history = idler_motion(steps, kind=kind)
        moved = motion.at(history.time)
        expected = LinearModeMotion(motion.system, history).at(history.time)
        errors.append(largest_errors(moved, expected))
    assert errors[1][0] < 5e-5
    assert errors[1][1] < 1e-3
    assert errors[0][0] > 4.0 * errors[1][0]


@pytest.mark.parametrize("method", ["rk4", "dopri5"])
def test_displacements_have_the_deflections_of_the_history(method):
    motion, history = idler_motion(64, method=method)
    rows = motion.system.modes.coordinates.mesh_rows.T
    moved = [x @ rows for x in motion.at(history.time[:-1])]
    recorded = history.deflection[:-1], history.rate[:-1]
    assert max(largest_errors(moved, recorded)) < 1e-12


def test_what_is_left_of_a_transient_is_no_peak_where_the_period_ends():
    """A free decay of a thousandth of the motion, beside the motion without it."""
    motion, history = idler_motion(256, kind="trapezoid", errors=False)
    size = 1e-3 * np.ptp(history.states[:, 0], axis=0)
    decay, angular = 40.0, 2.0 * np.pi * 0.4 * FREQUENCY
    root = -decay + 1j * angular
    wave = np.exp(root * (history.time - history.time[0]))[:, None] * size
    left = np.stack([wave.real, (root * wave).real], axis=1)
    disturbed = coordinate_motion(
        motion.system, replace(history, states=history.states + left)
    )
    time = np.linspace(0.0, 1.0, 4001) * motion.period
    accelerations = motion.acceleration(time), disturbed.acceleration(time)
    differences = np.abs(accelerations[1] - accelerations[0]).max(axis=0)
    assert (differences < 0.02 * np.ptp(accelerations[0], axis=0)).all()
    turns = disturbed.acceleration(np.arange(100) * motion.period)
    assert turns == pytest.approx(turns[[0] * 100], rel=1e-6)


def test_between_steps_motions_are_as_of_finer_steps():
    """A velocity without jumps is of third order between the steps."""
    fine, history = idler_motion(2048, kind="trapezoid")
    expected = fine.at(history.time)
    errors = []
    for steps in (128, 256):
        motion, _ = idler_motion(steps, kind="trapezoid")
        errors.append(largest_errors(motion.at(history.time), expected))
    assert errors[1][0] < 5e-6
    assert errors[1][1] < 1e-4
    assert errors[0][0] > 8.0 * errors[1][0]
    assert errors[0][1] > 4.0 * errors[1][1]


def test_bearings_carry_the_mesh_forces_at_rest():
    """The mean of the bearing force balances those of the meshes of the gear."""
    motion, history = idler_motion(256, direction=0.3)
    time = np.arange(4096) * motion.period / 4096
    signals = sensor_signals(motion, time)
    coordinates = motion.system.modes.coordinates
    force = np.trapezoid(history.force, history.time, axis=0)
    load = -coordinates.mesh_rows.T @ (force / motion.period)
    for number, gear in enumerate(motion.system.train.gears):
        for axis in "xy":
            mean = signals[f"{gear.name}_bearing_{axis}_N"].mean()
            expected = load[coordinates.indices[number, axis]]
            assert mean == pytest.approx(expected, abs=0.5)
    assert np.abs(load).max() > 1000.0


def test_speeds_follow_from_their_torques():
    """Euler's equation with the mesh forces that the integration gives."""
    motion, history = idler_motion(512, kind="trapezoid")
    train = motion.system.train
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


def test_a_history_without_states_gives_no_signals():
    motion, history = idler_motion(64, errors=False)
    with pytest.raises(ValueError, match="states is missing"):
        coordinate_motion(motion.system, replace(history, states=None))
