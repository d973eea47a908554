"""The implicit march against a general solver of the same equations."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import reduced_motion

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import TimeSteps

CUTOFF = 30e3  # Hz
FREQUENCY = 1600.0  # Hz
PERIODS = 2
POSITIONS = 128
KICK = 0.15  # m/s, enough to lose contact


@pytest.fixture(scope="module", params=[0.0, 0.1], ids=["smooth", "friction"])
def run(request, case_of):
    """(stepper, start, exact deflection at every position, equations)."""
    stepper = case_of(friction=request.param).stepper(CUTOFF)
    shape = stepper.model.kinematics.deflection[0]
    state = stepper.start()
    state.motion[kernel.V, : shape.size] += KICK * shape / (shape @ shape)
    equations = reduced_motion.equations(stepper.model)
    _, states = reduced_motion.march(
        equations, state.motion[:2], FREQUENCY, PERIODS, tolerance=1e-8
    )
    return stepper, state, states[:, 0, : shape.size] @ shape, equations


def marched(stepper, state, fine):
    steps = POSITIONS * fine
    _, motion = stepper.integrate(
        state, TimeSteps(FREQUENCY, 1.0 / (FREQUENCY * steps), PERIODS * steps, steps)
    )
    return motion


def test_march_tends_to_the_exact_motion(run):
    stepper, state, exact, _ = run
    errors = []
    for fine in (2, 4, 8, 16):
        motion = marched(stepper, state, fine)
        deflection = motion.deflection[::fine, 0]
        errors.append(np.sqrt(np.mean((deflection - exact) ** 2)) / exact.std())
    force = motion.force
    assert 0.05 < (force == 0.0).mean() < 0.5
    rate = -np.polyfit(np.log([2, 4, 8]), np.log(errors[:3]), 1)[0]
    assert rate > 1.7
    assert errors[-1] < 2e-4  # the oracle's friction reverses at the pitch point


def test_loads_at_rest_are_those_of_the_equations(run):
    stepper, _, _, equations = run
    at_rest = stepper.start()
    loads = reduced_motion.contact_loads(equations, 0, 0.0, at_rest.motion[kernel.Q])
    np.testing.assert_allclose(
        loads, at_rest.contact[kernel.LOAD], atol=1e-7 * loads.max()
    )
    balance = equations.load - equations.stiffness @ at_rest.motion[kernel.Q]
    np.testing.assert_allclose(
        loads @ equations.force_rows[0], balance, atol=1e-7 * np.abs(balance).max()
    )


def test_oracle_is_exact_without_contact():
    """Free vibration of a damped mode, in closed form."""
    omega, zeta, n = 2e4, 0.05, 3
    free = reduced_motion.DenseModel(
        inverse_mass=np.eye(n),
        damping=2.0 * zeta * omega * np.eye(n),
        stiffness=omega**2 * np.eye(n),
        load=np.zeros(n),
        turnover=np.eye(n),
        penetration_rate=np.zeros((POSITIONS + 1, 2, n)),
        force_rows=np.zeros((POSITIONS + 1, 2, n)),
        gap=np.full((POSITIONS + 1, 2), 1.0),
        compliance=np.zeros((POSITIONS + 1, 2, 2)),
        knots=np.linspace(0.0, 1.0, 4),
        load_curve=np.zeros((2, POSITIONS + 1, 3, 4)),
        errors=np.zeros((1, 2)),
    )
    start = np.stack([np.ones(n), np.zeros(n)])
    time, states = reduced_motion.march(free, start, FREQUENCY, 1)
    damped = omega * np.sqrt(1.0 - zeta**2)
    shape = np.cos(damped * time) + zeta * omega / damped * np.sin(damped * time)
    expected = np.exp(-zeta * omega * time) * shape
    np.testing.assert_allclose(states[:, 0, 1], expected, atol=1e-8)
