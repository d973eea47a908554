"""Every command has the same natural frequencies: those about the loaded state."""

from __future__ import annotations

import numpy as np
import pytest
from loaded_frequencies import require_frequencies_of_finite_elements

import fegear
from fegear.train.loaded_modes import linear_model, modes_under_load, system_of_modes
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from validation.commands.validate.random_sets.generator import random_gear_set
from validation.commands.validate.random_sets.measuring import highest_resonance

COARSE = fegear.ExcitationSettings(resolution="coarse", positions=32)
SPRINGS = LumpedModel(number=1, excitation=COARSE)
KINDS = [0, *(pytest.param(number, marks=pytest.mark.slow) for number in (1, 2))]


def studies_of(gear_set, torque: float):
    """Studies that print natural frequencies, at one torque and few speeds."""
    speed = 0.3 * highest_resonance(lumped_system(gear_set, torque, SPRINGS))
    auto = LumpedModel(number="auto", excitation=COARSE)
    shared = {"gear_set": gear_set}
    return {
        "modes": fegear.NaturalModes(torque=torque, excitation=COARSE, **shared),
        "export": fegear.ModelExport(torque=torque, excitation=COARSE, **shared),
        "theory": fegear.Theory(
            torque=torque, model=LumpedModel(number=1, excitation=COARSE), **shared
        ),
        "sweep": fegear.Sweep(torque=(torque,), speeds=(speed,), model=auto, **shared),
        "branches": fegear.Branches(
            torque=torque, speeds=(speed, 1.001 * speed), model=auto, **shared
        ),
        "dynamics": fegear.Dynamics(
            torque=(torque,),
            speeds=(speed,),
            direction="up",
            excitation=COARSE,
            elements=fegear.FiniteElements(fidelity="quasistatic"),
            **shared,
        ),
    }


@pytest.mark.parametrize("number", KINDS)
def test_every_command_has_the_same(number):
    """Only this compares the states about which commands linearise."""
    gear_set = random_gear_set(number)
    (torque,) = gear_set.meshes[0].torques
    summaries = {
        name: fegear.run(study).summary
        for name, study in studies_of(gear_set, torque).items()
    }
    model = summaries.pop("export")
    expected = summaries["modes"]["natural_frequencies_Hz"]
    assert expected
    for name, summary in summaries.items():
        assert summary["natural_frequencies_Hz"] == pytest.approx(expected), name
        if name != "modes":
            text = f"about the loaded state at {torque:g} N m"
            assert summary["natural_frequencies"] == text
    exported = np.array(model["natural_frequency_Hz"])
    for frequency in expected:
        assert np.abs(exported - frequency).min() < 1e-9 * frequency
    averages = [mode["average_frequency_Hz"] for mode in summaries["modes"]["modes"]]
    system = lumped_system(gear_set, torque, SPRINGS)
    assert sorted(f for f in averages if f is not None) == pytest.approx(
        sorted(system.modes.frequency_Hz), abs=1e-6
    )


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_they_are_those_of_finite_elements_without_loss_of_contact(number):
    gear_set = random_gear_set(number)
    (torque,) = gear_set.meshes[0].torques
    require_frequencies_of_finite_elements(gear_set, torque, COARSE)


def test_mean_stiffness_is_the_slope_of_the_static_transmission_error():
    """Finite differences of the mesh table at two torques on the driver."""
    gear_set = fegear.load_gear_set("liu-pair")
    system, _ = system_of_modes(gear_set, 100.0, LumpedModel(number=1))
    (tangent,) = modes_under_load(system).mean_stiffness
    table = fegear.solve_mesh(gear_set, 1, [99.0, 101.0]).table
    low, high = table["ste_m"].copy()
    slope = 2.0 / gear_set.meshes[0].pair.driver.base_radius / (high - low)
    assert tangent == pytest.approx(slope.mean(), rel=0.005)


def test_matrices_have_the_natural_frequencies_and_masses_of_rigid_gears():
    gear_set = fegear.load_gear_set("liu-idler")
    model = LumpedModel(number=1, excitation=COARSE, translations=True)
    system, _ = system_of_modes(gear_set, 100.0, model)
    linear, modes = linear_model(system), modes_under_load(system)
    squares = np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real
    expected = (2.0 * np.pi * modes.frequency_Hz) ** 2
    np.testing.assert_allclose(np.sort(squares), np.sort(expected), rtol=1e-6)
    hubs = system.modes.coordinates.mass
    np.testing.assert_allclose(np.diag(linear.mass)[: hubs.size], hubs, rtol=1e-9)


def test_averages_of_model_1_are_said_to_be_those_where_bodies_have_no_inertia():
    gear_set = fegear.load_gear_set("liu-pair", {"gear.pinion.inertia_kg_m2": 1e-5})
    study = fegear.NaturalModes(gear_set=gear_set, torque=100.0, excitation=COARSE)
    result = fegear.run(study)
    summary = result.summary
    assert summary["model_reason"].startswith("model 1: ")
    assert {mode["average_frequency_Hz"] for mode in summary["modes"]} == {None}
    first, second = [line for line in result.page() if isinstance(line, str)][:2]
    assert first == summary["model_reason"]
    assert second.endswith("average of model 1 at 100 N m on the input gear")
