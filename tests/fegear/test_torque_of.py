"""Which torque is given where friction takes a part of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fegear
from fegear.dynamics.build import FiniteElements
from fegear.dynamics.contact_history import contact_histories, interpolate
from fegear.dynamics.stepper import DynamicSettings, steps_per_cycle
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.steady.integration_settings import Settings
from lumped.steady.losses import shared_loads
from lumped.steady.respond import respond_with_history
from lumped.steady.steady_state import steady_state
from lumped.train.friction import torque_shares

TORQUE, FRICTION = 100.0, 0.1
SPEEDS = {"liu-pair": 200.0, "liu-idler": 150.0}  # Hz, at which vibration is small
FREE = {  # nothing holds these gears, so that all torque goes through the meshes
    "liu-pair": {},
    "liu-idler": {
        "gear.1.coupling_stiffness_Nm_per_rad": 0.0,
        "gear.3.coupling_stiffness_Nm_per_rad": 0.0,
    },
}
TRAINS = pytest.mark.parametrize("name", SPEEDS)


def lumped_input(name, torque_of, friction=FRICTION, changes=None):
    """Mean moment of the contacts on the input gear [N m] of a settled motion."""
    gears = fegear.load_gear_set(name, FREE[name] if changes is None else changes)
    model = LumpedModel(number=1, friction=friction, torque_of=torque_of)
    system = lumped_system(gears, TORQUE, model)
    frequency = SPEEDS[name]
    settings = Settings(steps=256)
    _, history = respond_with_history(system, frequency, settings)
    mesh, pairs = system.train.meshes[0], system.excitations[0].pairs
    x = (mesh.phase + frequency * history.time) % 1.0
    x[-1] = x[-1] or 1.0
    ahead = [pair.ahead for pair in pairs]
    shares = torque_shares(system.train, 0, friction, ahead, x)
    loads = history.friction[:, 0, : len(pairs)].T
    moment = system.train.gears[mesh.driver].base_radius * (loads * shares).sum(axis=0)
    span = history.time[-1] - history.time[0]
    return float(np.trapezoid(moment, history.time) / span)


@TRAINS
def test_the_input_gear_of_a_lumped_train_has_the_torque(name):
    assert lumped_input(name, "nominal") > 1.0005 * TORQUE
    assert lumped_input(name, "input") == pytest.approx(TORQUE, rel=1e-4)


def test_springs_to_ground_take_what_they_do_without_friction():
    """Of the built-in idler set, whose input and output gears have couplings."""
    plain = lumped_input("liu-idler", "nominal", friction=1e-9, changes={})
    assert plain < 0.997 * TORQUE
    input_torque = lumped_input("liu-idler", "input", changes={})
    assert input_torque == pytest.approx(plain, rel=1e-4)
    assert lumped_input("liu-idler", "nominal", changes={}) > 1.005 * plain


@pytest.mark.parametrize("relief", [0.0, 8.0])
def test_loads_at_rest_carry_the_force(relief):
    changes = {"mesh.1.tip_relief.magnitude_um": relief} if relief else {}
    gears = fegear.load_gear_set("liu-pair", changes)
    source = fegear.ExcitationSettings(kind="rectangular")
    system = lumped_system(gears, TORQUE, LumpedModel(number=1, excitation=source))
    x = np.linspace(0.0, 1.0, 50, endpoint=False)
    loads = shared_loads(system.excitations[0], 2000.0, x, 0)
    assert (loads >= 0.0).all()
    np.testing.assert_allclose(loads.sum(axis=0), 2000.0, rtol=1e-12)


@pytest.mark.slow
@TRAINS
def test_the_input_gear_of_finite_elements_has_the_torque(name):
    assert elements_input(name, "nominal") > 1.0005 * TORQUE
    assert elements_input(name, "input") == pytest.approx(TORQUE, rel=1e-4)


def elements_input(name, torque_of):
    """The same of finite elements, by the lever of every contact."""
    speed, steps = SPEEDS[name], DynamicSettings(steps=512)
    study = fegear.Dynamics(
        gear_set=fegear.load_gear_set(name, FREE[name]),
        torque=[TORQUE],
        speeds=[speed],
        elements=FiniteElements(fidelity="quasistatic", friction=FRICTION),
        integration=steps,
        torque_of=torque_of,
    )
    choice = study.prepare().prepared[TORQUE]
    _, motion = steady_state(choice.stepper, speed, steps)
    model = choice.stepper.model
    count = steps_per_cycle(model, speed, steps)
    moment = np.zeros(len(motion.pair_load))
    for history in contact_histories(model, motion, count):
        if history.side.mesh == 0:
            lever = history.side.load_curves.moment_arms[:, history.pair_index]
            normal_arm, friction_arm = (
                interpolate(lever[:, column], history.grid_indices, history.weights)
                for column in (0, 2)
            )
            moment += history.load * (normal_arm - history.friction * friction_arm)
    span = motion.time[-1] - motion.time[0]
    return float(np.trapezoid(moment, motion.time) / span)


def test_without_friction_nothing_changes():
    gears = fegear.load_gear_set("liu-pair")
    source = fegear.ExcitationSettings(kind="rectangular")
    plain = lumped_system(gears, TORQUE, LumpedModel(number=1, excitation=source))
    same = LumpedModel(number=1, excitation=source, torque_of="input")
    assert lumped_system(gears, TORQUE, same).train == plain.train
    with pytest.raises(ValueError, match="torque_of = input; needs friction above 0"):
        fegear.Dynamics(gear_set="liu-pair", torque_of="input")


def test_more_friction_lowers_the_output_torque():
    gears = fegear.load_gear_set("liu-pair")
    source = fegear.ExcitationSettings(kind="rectangular")
    model = LumpedModel(number=1, excitation=source, bending=0.0, torque_of="input")
    losses = [
        lumped_system(gears, TORQUE, replace(model, friction=friction)).losses
        for friction in (0.0, 0.05, 0.1)
    ]
    assert losses[0] == 0.0
    assert losses[2] == pytest.approx(2.0 * losses[1], rel=0.02)
    assert 0.003 < losses[1] < 0.006  # 0.44 % by Ohlendorf's loss factor
