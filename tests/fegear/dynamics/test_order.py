"""Convergence of the march with its step."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from lumped.steady.steady_state import steady_state

CUTOFF = 30e3  # Hz
CYCLE = 128
KINDS = {"quasistatic": None, "reduced": CUTOFF}
RESONANCES = {"quasistatic": 2750.0, "reduced": 2950.0}  # Hz
FINE = np.array([4, 8, 16, 32])


def kicked(stepper, speed):
    """At rest but for a closing speed of the mesh [m/s].

    Without damping the acceleration of rest stays right; a wrong one at the start
    costs an order.
    """
    state = stepper.start()
    shape = stepper.model.kinematics.deflection[0]
    state.motion[kernel.V, : shape.size] += speed * shape / (shape @ shape)
    return state


def deflections(stepper, state, frequency, cells, fine):
    """At the ends of position cells, `fine` steps in each."""
    step = 1.0 / (1600.0 * CYCLE * fine)
    _, motion = stepper.integrate(
        state, TimeSteps(frequency, step, cells * fine, CYCLE * fine)
    )
    return motion.deflection[::fine, 0], motion.force[::fine, 0]


def errors_of(stepper, state, frequency, cells):
    exact, force = deflections(stepper, state, frequency, cells, 4 * int(FINE[-1]))
    motions = [deflections(stepper, state, frequency, cells, int(f))[0] for f in FINE]
    return [np.sqrt(np.mean((x - exact) ** 2)) / np.ptp(exact) for x in motions], force


def rate(errors):
    return -np.polyfit(np.log(FINE), np.log(errors), 1)[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("remaining", [0.9, 0.5, 0.0])
@pytest.mark.parametrize("frequency", [0.0, 1600.0], ids=["frozen", "moving"])
def test_order_is_two_while_the_same_pair_is_in_contact(
    case_of, kind, remaining, frequency
):
    """About the pitch point, where one pair carries all."""
    stepper = case_of(damping=0.0).stepper(KINDS[kind], 0.0, remaining)
    state = kicked(stepper, 0.02)
    errors, force = errors_of(stepper, state, frequency, 20)
    assert (force > 0.0).all()
    assert np.ptp(force) > 0.1 * force.max()
    assert rate(errors) > 1.9


@pytest.mark.parametrize("kind", KINDS)
def test_order_through_loss_of_contact(case_of, kind):
    stepper = case_of(damping=0.0).stepper(KINDS[kind], 0.0)
    errors, force = errors_of(stepper, kicked(stepper, 0.15), 1600.0, 2 * CYCLE)
    assert (force == 0.0).any()
    assert rate(errors) > 1.6


@pytest.mark.parametrize("kind", KINDS)
def test_periodic_response_with_loss_of_contact(case_of, kind):
    """Settled at a resonance of a weakly damped pair."""
    stepper = case_of(damping=0.01).stepper(KINDS[kind])
    counts, responses = np.array([128, 256, 512, 2048]), []
    for steps in counts:
        settings = DynamicSettings(steps=int(steps), tolerance=1e-6)
        response, _ = steady_state(stepper, RESONANCES[kind], settings)
        assert response.multiple == 1
        responses.append((response.dte_rms[0], response.contact_loss[0]))
    rms, loss = np.array(responses).T
    assert loss.min() > 0.05
    errors = np.abs(rms[:-1] / rms[-1] - 1.0)
    order = -np.polyfit(np.log(counts[:-1]), np.log(errors), 1)[0]
    assert order > 1.7
    assert errors[0] < 2e-3
