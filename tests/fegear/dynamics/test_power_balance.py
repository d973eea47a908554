"""Over a periodic motion, what torques and contacts give is what damping takes."""

from __future__ import annotations

import numpy as np
import pytest
from slow_tests import first_are_quick

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from lumped.steady.steady_state import steady_state
from tests.fegear.dynamics.test_full import PLANET_AND_RING

CYCLE = 128
CUTOFF = {"liu-pair": 30e3, "planet-ring": 60e3}  # Hz
RELIEF = {"relief": 15.0}  # a ring's mesh without relief hardly vibrates
CASES = {  # frequency [Hz], damping ratio, friction, and what differs in the gear set
    ("liu-pair", "in contact"): (1600.0, 0.04, 0.0, {}),
    ("liu-pair", "losing contact"): (2950.0, 0.01, 0.0, {}),
    ("liu-pair", "friction"): (1600.0, 0.04, 0.1, {}),
    ("planet-ring", "in contact"): (4500.0, 0.04, 0.0, RELIEF),
    ("planet-ring", "losing contact"): (4800.0, 0.03, 0.0, {"torque": 50.0} | RELIEF),
    ("planet-ring", "friction"): (4500.0, 0.04, 0.1, RELIEF),
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


def require_balance(imbalances, *, losing, floor=0.0):
    """floor : below it the tolerance of the steady state, not the step, counts."""
    errors, loss = np.abs(imbalances).T
    assert (loss > 0.05).all() == losing
    assert errors[-1] < max(0.3 * errors[0], floor)
    assert errors[0] < 5e-5


@pytest.mark.parametrize("kind", first_are_quick(["reduced", "quasistatic"], 1))
@pytest.mark.parametrize(("gears", "name"), CASES)
def test_power_is_balanced(case_of, track, tmp_path, kind, gears, name):
    frequency, damping, friction, changes = CASES[gears, name]
    path = tmp_path / "planet-ring.toml"
    path.write_text(PLANET_AND_RING)
    source = gears if gears == "liu-pair" else str(path)
    case = case_of(source, damping=damping, friction=friction, **changes)
    stepper = case.stepper(CUTOFF[gears] if kind == "reduced" else None)
    imbalances = [
        imbalance(stepper, track, frequency, steps) for steps in (256, 512, 1024)
    ]
    floor = {"liu-pair": 0.0, "planet-ring": 1e-7}[gears]
    require_balance(imbalances, losing=name == "losing contact", floor=floor)


@pytest.mark.slow
def test_power_of_a_planetary_set_is_balanced(case_of, track):
    """Six meshes and a carrier, with friction, losing contact."""
    case = case_of("planetary-24-36-96", damping=0.04, friction=0.1)
    stepper = case.stepper(40e3)
    imbalances = [imbalance(stepper, track, 7400.0, steps) for steps in (256, 512)]
    errors, loss = np.abs(imbalances).T
    assert (loss > 0.05).all()
    assert errors[1] < 0.3 * errors[0] < 1.5e-5
