"""Over a periodic motion, what torques and contacts give is what damping takes."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from lumped.steady.steady_state import steady_state

CUTOFF = 30e3  # Hz
CYCLE = 128
KINDS = {"quasistatic": None, "reduced": CUTOFF}
CASES = {
    "in contact": (1600.0, 0.04, 0.0),
    "losing contact": (2950.0, 0.01, 0.0),
    "friction": (1600.0, 0.04, 0.1),
}


def on_steps(table, fine):
    """A table (c, p + 1, ...) at `fine` points from every position on, (c, t, ...)."""
    part = np.tile(np.arange(fine) / fine, CYCLE)
    part = part.reshape(1, -1, *[1] * (table.ndim - 2))
    begin, step = table[:, :-1], np.diff(table, axis=1)
    return np.repeat(begin, fine, axis=1) + part * np.repeat(step, fine, axis=1)


def contact_force(model, touch, fine):
    """Generalised force (t, n) of contacts over a cycle, from rows and loads."""
    closing, rootward, sliding = (
        on_steps(table, fine)
        for table in (*model.jacobian[2:4], model.contacts.sliding)
    )
    load, is_reversed = touch[:, kernel.LOAD], touch[:, kernel.REVERSED]
    drag = model.jacobian.friction * sliding.T * (1.0 - 2.0 * is_reversed)
    count = model.jacobian.widths[0]
    force = np.zeros((len(load), model.size))
    normal_force = np.einsum("tc,ctw->tw", load, closing[..., :count])
    friction_force = np.einsum("tc,ctw->tw", load * drag, rootward[..., :count])
    force[:, model.jacobian.columns[0, :count]] = -normal_force - friction_force
    return force


def imbalance(stepper, track, frequency, steps):
    """Missing power over that of damping, and the fraction of time out of contact."""
    model = stepper.model
    settings = DynamicSettings(steps=steps, tolerance=1e-8, step_angle=10.0)
    response, _ = steady_state(stepper, frequency, settings)
    state = response.state
    assert response.multiple == 1
    run = track(
        stepper, state, TimeSteps(frequency, 1.0 / (frequency * steps), steps, steps)
    )
    # periodic: the trapezoid rule is the mean of all points but the last
    velocity, touch = run.motion[:-1, kernel.V], run.contact[:-1]
    damping = np.concatenate([model.modal.damping, model.modal.elastic_damping])
    load = np.concatenate([model.modal.load, np.zeros(model.modal.rigidity.size)])
    force = contact_force(model, touch, steps // CYCLE)
    input_power = ((force + load) * velocity).sum(axis=1).mean()
    dissipated_power = (damping * velocity**2).sum(axis=1).mean()
    return input_power / dissipated_power - 1.0, response.contact_loss[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", CASES)
def test_power_is_balanced(case_of, track, kind, name):
    frequency, damping, friction = CASES[name]
    case = case_of(damping=damping, friction=friction)
    stepper = case.stepper(KINDS[kind])
    imbalances = [
        imbalance(stepper, track, frequency, steps) for steps in (256, 512, 1024)
    ]
    errors, loss = np.abs(imbalances).T
    assert (loss > 0.05).all() == (name == "losing contact")
    assert errors[-1] < 0.3 * errors[0]
    assert errors[0] < 5e-5
