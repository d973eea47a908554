"""Hubs of the coupled model in motion, beside what is known of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rim_gears import FIRM, RimGears

from lumped import Settings
from lumped.signals.coordinate_motion import coordinate_motion
from lumped.signals.sensors import sensor_signals
from lumped.steady.motion import bounded_response
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of, steps_per_period

WAVES = ((0.0, 3e-7), (1e-6, 2e-7), (5e-7, 2e-7), (0.0, 3e-7))
CASES = {
    "firm": FIRM,
    "pairs": RimGears(spokes=1.5e-9, pairs=2, gap=WAVES, damping=0.02),
    "meshes": RimGears(gears=3, spokes=1.5e-9, gap=WAVES, damping=0.02),
    "body": RimGears(spokes=1.5e-9, in_rim=0.6, gap=WAVES, damping=0.02),
}


def recorded(system, frequency, steps=256):
    settings = Settings(steps=steps, step_angle=2.0, tolerance=1e-10)
    response, _, settings = bounded_response(system, frequency, settings)
    _, history = stepper_of(system, settings).record(
        response.state, Speed(frequency, settings), response.multiple, with_states=True
    )
    number = steps_per_period(system, frequency, settings)
    return coordinate_motion(system, history, number), history


@pytest.mark.parametrize("name", CASES)
def test_hubs_have_the_transmission_error_of_the_history(name):
    motion, history = recorded(CASES[name].coupled, 900.0)
    deflection = motion.deflection(motion.displacement)
    error = np.abs(deflection - history.deflection)[:-1]  # the last is the first
    assert error.max() < 1e-12 * np.ptp(history.deflection)
    rate = motion.deflection(motion.velocity)
    inner = slice(3, -3)  # where differences of the history are central
    error = np.abs(rate - history.rate)[inner].max()
    assert error < 1e-3 * np.ptp(history.rate)


@pytest.mark.parametrize("frequency", [900.0, 1500.0])
def test_speeds_of_rigid_bodies_are_those_of_model_1(frequency):
    case = replace(FIRM, damping=0.02)
    time = np.linspace(0.0, 3.0 / frequency, 500)
    both = []
    for system in (case.model_1, case.coupled):
        motion, _ = recorded(system, frequency, 1024)
        both.append(sensor_signals(motion, time))
    assert both[0].keys() == both[1].keys()
    for name, expected in both[0].items():
        bound = 2e-3 if "speed" in name else 1e-5
        error = np.abs(both[1][name] - expected).max()
        assert error < bound * np.ptp(expected), name


def test_hubs_carry_the_momentum_of_bodies_whose_inertia_is_theirs():
    """All inertia in the hubs: Euler's equation with the forces of the contacts."""
    case = RimGears(spokes=1.5e-9, in_rim=0.0, gap=WAVES, damping=0.0)
    system = replace(case, damping=0.02).coupled
    motion, history = recorded(system, 900.0, 1024)
    coordinates = system.modes.coordinates
    damping = system.modes.damping_matrix(system.train.damping_ratio)
    springs = coordinates.spring_rows.T * coordinates.spring_stiffness
    force = coordinates.load - motion.displacement @ (springs @ coordinates.spring_rows)
    force = force - history.force @ coordinates.mesh_rows
    force = force - motion.velocity @ damping.T
    momentum = motion.velocity * coordinates.mass
    impulse = 0.5 * (force[1:] + force[:-1]) * np.diff(motion.time)[:, None]
    change = np.diff(momentum, axis=0)
    scale = np.abs(np.cumsum(change, axis=0)).max()
    error = np.cumsum(change - impulse, axis=0)
    assert np.abs(error).max() < 0.01 * scale
