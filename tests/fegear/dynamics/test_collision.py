"""Two gears that meet on free flight: momentum, energy and rebound."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import MotionState, TimeSteps
from fegear.gearset.inertia import inertia_of

CUTOFF = 30e3  # Hz
CONTACT_TIME = 1.9e-4  # s, about, of both speeds used here
SPEED = 0.02  # m/s
STEPS = 2e-5 / 2.0 ** np.arange(5)  # s
KINDS = {"rigid": None, "elastic": CUTOFF}


def uncompiled(part: Any) -> Any:
    return part.py_func


@pytest.fixture(scope="session")
def colliding(case_of):
    """A pair on which nothing acts and that nothing damps, flanks on one side."""
    return case_of(torque=0.0, damping=0.0, backlash=1e-3)


def thrown(model, speed, gap):
    """Flanks `gap` [m] apart that approach with `speed` [m/s], gears otherwise still.

    Frozen at the pitch point, where the pair on the path touches first.
    """
    shape = model.kinematics.deflection[0]
    motion = np.zeros((4, model.size))
    motion[kernel.Q, : shape.size] = -gap * shape / (shape @ shape)
    motion[kernel.V, : shape.size] = speed * shape / (shape @ shape)
    return MotionState(motion, np.zeros((3, model.contact_count)))


def collide(stepper, step, speed=SPEED, gap=3e-6):
    """(state before, state after, recorded motion) of one meeting."""
    before = thrown(stepper.model, speed, gap)
    steps = math.ceil((2.0 * gap / speed + 2.0 * CONTACT_TIME) / step) + 80
    after, motion = stepper.integrate(before, TimeSteps(0.0, step, steps, 128))
    assert motion.pair_load.any()
    assert not motion.pair_load[-60:].any()
    return before, after, motion


def momentum(model, motion):
    out = np.empty(model.size)
    uncompiled(kernel.mass_times)(model.modal, motion[kernel.V], out)
    return out


def free_energy(model, motion):
    """Kinetic and elastic energy but for the contacts' [J]."""
    hubs = model.modal.damping.size
    kinetic = 0.5 * motion[kernel.V] @ momentum(model, motion)
    place = motion[kernel.Q]
    hub = 0.5 * place[:hubs] @ model.modal.stiffness @ place[:hubs]
    return kinetic + hub + 0.5 * (model.modal.rigidity * place[hubs:] ** 2).sum()


def contact_energy(model, touch):
    """Of the pairs' laws and of the compliance between pairs [J]."""
    knots, law = model.contacts.knots[0], model.contacts.load_curve
    squeeze, load = touch[kernel.PENETRATION], touch[kernel.LOAD]
    total = 0.5 * load @ model.contacts.normal_compliance[0] @ load
    for c, depth in enumerate(squeeze):
        for cell, begin in enumerate(knots[:-1]):
            x = min(depth, knots[cell + 1]) - begin
            if x > 0.0:
                powers = x ** np.arange(1, 5) / np.arange(1, 5)
                total += law[c, 0, 0, cell] @ powers
    return total


def change(stepper, step, speed=SPEED, gap=3e-6):
    """Energy after a meeting over that before, less 1."""
    before, after, _ = collide(stepper, step, speed, gap)
    model = stepper.model
    return free_energy(model, after.motion) / free_energy(model, before.motion) - 1.0


def rms_change(stepper, step):
    """Over places of the first touch within a step."""
    gaps = 3e-6 + SPEED * step * (np.arange(16) + 0.5) / 16
    return np.sqrt(np.mean([change(stepper, step, gap=g) ** 2 for g in gaps]))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("remaining", [1.0, 0.9])
def test_energy_is_kept_but_for_the_square_of_the_step(colliding, kind, remaining):
    stepper = colliding.stepper(KINDS[kind], 0.0, remaining)
    errors = [rms_change(stepper, step) for step in STEPS]
    rate = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert 1.7 < rate < 2.6
    assert errors[-1] < 1e-4


@pytest.mark.parametrize("kind", KINDS)
def test_energy_is_kept_throughout(colliding, track, kind):
    """Contact stores what hubs and modes give, compliance between pairs included."""
    stepper = colliding.stepper(KINDS[kind], 0.0, 1.0)
    model, step = stepper.model, 5e-7
    run = track(stepper, thrown(model, 0.1, 1e-6), TimeSteps(0.0, step, 500, 128))
    parts = np.array(
        [
            (free_energy(model, motion), contact_energy(model, touch))
            for motion, touch in zip(run.motion, run.contact, strict=True)
        ]
    )
    total = parts.sum(axis=1)
    assert parts[:, 1].max() > 0.8 * total[0]
    np.testing.assert_allclose(total, total[0], rtol=1e-4)


def test_rigid_gears_rebound_with_the_speed_of_approach(colliding):
    stepper = colliding.stepper(None, 0.0, 0.9)
    before, after, _ = collide(stepper, STEPS[-1])
    shape = stepper.model.kinematics.deflection[0]
    speeds = [shape @ state.motion[kernel.V, : shape.size] for state in (before, after)]
    assert -speeds[1] / speeds[0] == pytest.approx(1.0, abs=1e-4)


def test_vibration_takes_speed_from_the_rebound(colliding):
    """What the turning gears lose as a whole is found in their modes."""
    stepper = colliding.stepper(CUTOFF, 0.0, 1.0)
    model = stepper.model
    before, after, _ = collide(stepper, STEPS[-1], speed=0.2)
    shape = model.kinematics.deflection[0]
    hub = [momentum(model, s.motion)[: shape.size] for s in (before, after)]
    restitution = -(shape @ hub[1]) / (shape @ hub[0])
    assert 0.98 < restitution < 0.998
    vibration = free_energy(model, after.motion) - 0.5 * hub[1] @ hub[1]
    lost = 0.5 * hub[0] @ hub[0] - 0.5 * hub[1] @ hub[1]
    assert vibration == pytest.approx(lost, rel=0.02)


@pytest.mark.parametrize("remaining", [1.0, 0.9, 0.0])
@pytest.mark.parametrize("step", [5e-5, 5e-6])
@pytest.mark.parametrize("kind", KINDS)
def test_impulse_changes_momentum_exactly(colliding, kind, step, remaining):
    stepper = colliding.stepper(KINDS[kind], 0.0, remaining)
    model = stepper.model
    before, after, motion = collide(stepper, step)
    hubs = model.modal.damping.size
    impulse = step * motion.pair_load.sum(axis=0)  # of each contact [N s]
    given = -impulse @ model.jacobian.normal[:, 0, :hubs]
    found = momentum(model, after.motion)[:hubs] - momentum(model, before.motion)[:hubs]
    np.testing.assert_allclose(found, given, atol=1e-9 * np.abs(given).max())


def test_both_gears_get_the_same_impulse(colliding):
    """In newton seconds along the line of action, from their inertias."""
    case, stepper = colliding, colliding.stepper(None, 0.0, 0.9)
    before, after, motion = collide(stepper, 5e-6)
    turning = stepper.model.modal.rotation
    gained = turning @ (after.motion - before.motion)[kernel.V, : turning.shape[1]]
    impulse = 5e-6 * motion.pair_load.sum()
    for gear, turn in zip(case.gear_set.gears, gained, strict=True):
        # in the driver's sense, the mesh pushes both gears back
        angular = inertia_of(gear) * turn
        moment = -impulse * gear.geometry.base_radius
        assert angular == pytest.approx(moment, rel=1e-9)


@given(
    speed=st.floats(5e-3, 0.3),
    within=st.floats(0.0, 1.0),
    step=st.floats(1e-6, 1e-4),
    remaining=st.sampled_from([1.0, 0.9, 0.5, 0.0]),
    kind=st.sampled_from(sorted(KINDS)),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_no_impact_gains_more_than_the_step_leaves_open(
    colliding, speed, within, step, remaining, kind
):
    """Coarse steps do give energy, whatever the scheme damps."""
    stepper = colliding.stepper(KINDS[kind], 0.0, remaining)
    gained = change(stepper, step, speed, 1e-6 + within * speed * step)
    assert gained < 4.0 * (step / CONTACT_TIME) ** 2
