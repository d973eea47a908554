"""Wheels on small hubs, whose bodies have nearly all inertia, and flywheels."""

from __future__ import annotations

import numpy as np
import pytest
from counter_shafts import counter_shaft
from loaded_frequencies import require_frequencies_of_finite_elements
from slow_tests import first_are_quick

import fegear
import lumped
from fegear.gearset import read_gear_set
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.train.coupled import MIN_LEFT_INERTIA

COARSE = fegear.ExcitationSettings(resolution="coarse", positions=32)
TORQUE = 60.0


@pytest.mark.parametrize("hub_mm", first_are_quick([16.0, 20.0, 26.0], 1))
def test_no_mesh_yields_energy_and_motions_repeat(hub_mm):
    """The inertia of modes that are left out is a small difference of large numbers,
    by whose error meshes would pull: motions grew beyond all bounds at the second step.
    """
    model = LumpedModel(number="coupled", excitation=COARSE)
    system = lumped_system(counter_shaft(hub_mm), TORQUE, model)
    assert system.contacts.body_modes.left_inertia < MIN_LEFT_INERTIA
    stiffness = np.linalg.eigvalsh(system.loaded.meshes)
    assert (stiffness[:, 0] > -1e-3 * stiffness[:, -1]).all()
    response = lumped.respond(system, 1000.0)
    assert response.status.name == "PERIODIC"
    assert (response.dte_rms < 10e-6).all()


def test_hubs_of_built_in_sets_keep_their_inertia():
    model = LumpedModel(number="coupled", excitation=COARSE)
    for name in ("liu-pair", "liu-idler", "liu-countershaft"):
        system = lumped_system(fegear.load_gear_set(name), 100.0, model)
        assert system.contacts.body_modes.left_inertia > 2.0 * MIN_LEFT_INERTIA


USUAL = """
name = "counter-shaft"
[defaults]
face_width_mm = 18
tooth_thinning_um = 40
[[gear]]
name = "in"
teeth = 21
module_mm = 2
profile_shift = 0.3
hub_diameter_mm = 16
[[gear]]
name = "c1"
teeth = 47
module_mm = 2
profile_shift = 0.1
hub_diameter_mm = 30
[[gear]]
name = "c2"
teeth = 18
module_mm = 2.5
profile_shift = 0.4
hub_diameter_mm = 18
[[gear]]
name = "out"
teeth = 51
module_mm = 2.5
hub_diameter_mm = 40
[[mesh]]
driver = "in"
driven = "c1"
[[mesh]]
driver = "c2"
driven = "out"
[[shaft]]
gears = ["c1", "c2"]
stiffness_Nm_per_rad = 8e4
"""


@pytest.mark.slow
def test_vibration_of_usual_hubs_is_that_of_finite_elements():
    """Only usual hubs show that the second mesh vibrated a third less."""
    gears, speed = read_gear_set(USUAL), (1300.0, 2200.0, 3000.0)
    model = LumpedModel(number="coupled", excitation=COARSE)
    shared = {"gear_set": gears, "torque": 40.0, "speeds": speed, "direction": "up"}
    ours = fegear.Sweep(model=model, **shared)
    theirs = fegear.Dynamics(
        excitation=COARSE, elements=fegear.FiniteElements(fidelity="reduced"), **shared
    )
    rms = [
        np.array(fegear.run(study).to_frame()["dte_rms_m"], float)
        for study in (ours, theirs)
    ]
    np.testing.assert_allclose(rms[0], rms[1], rtol=0.04)  # near a resonance


@pytest.mark.slow
def test_natural_frequencies_are_those_of_finite_elements():
    require_frequencies_of_finite_elements(counter_shaft(20.0), TORQUE, COARSE)


FLYWHEEL = """
[[gear]]
name = "flywheel"
teeth = 50
inertia_kg_m2 = 2e-3
"""


@pytest.mark.slow
def test_a_gear_without_mesh_on_a_shaft_is_a_flywheel():
    """Its inertia counts in the coupled model and in finite elements in motion."""
    shaft = """[[shaft]]
gears = ["output", "flywheel"]"""
    gears = counter_shaft(30.0, shaft, FLYWHEEL)
    plain = ("body", "modes")  # as finite elements without inertia of the bodies
    model = LumpedModel(number="coupled", excitation=COARSE, without=plain)
    speed = (1500.0,)
    ours = fegear.run(
        fegear.Sweep(
            gear_set=gears, torque=TORQUE, speeds=speed, model=model, direction="up"
        )
    )
    theirs = fegear.run(
        fegear.Dynamics(
            gear_set=gears,
            torque=TORQUE,
            speeds=speed,
            excitation=COARSE,
            direction="up",
            elements=fegear.FiniteElements(fidelity="quasistatic"),
        )
    )
    rms = [np.array(result.to_frame()["dte_rms_m"], float) for result in (ours, theirs)]
    np.testing.assert_allclose(rms[0], rms[1], rtol=0.03)
