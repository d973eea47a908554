"""Wheels on small hubs, whose bodies have nearly all inertia, and flywheels."""

from __future__ import annotations

import numpy as np
import pytest

import fegear
import lumped
from fegear.gearset import GearSet, read_gear_set
from fegear.statics.excitation import Excitations
from fegear.train.lumped_models import LumpedModel, lumped_system
from validation.random_sets.measuring import (
    elastic_gears,
    highest_resonance,
    natural_frequencies,
    reduced_gears,
    speeds_of,
)

COARSE = fegear.StiffnessSource(resolution="coarse", positions=32)
TEETH = {"input": 23, "wheel": 67, "pinion": 21, "output": 55}
TORQUE = 60.0


def counter_shaft(hub_mm: float, shaft: str = "", lone: str = "") -> GearSet:
    gears = "".join(
        f'[[gear]]\nname = "{name}"\nteeth = {teeth}\n' for name, teeth in TEETH.items()
    )
    text = f"""
name = "counter-shaft"
[defaults]
module_mm = 2.0
face_width_mm = 20.0
hub_diameter_mm = {hub_mm}
tooth_thinning_um = 40.0
{gears}{lone}
[[mesh]]
driver = "input"
driven = "wheel"
[[mesh]]
driver = "pinion"
driven = "output"
[[shaft]]
gears = ["wheel", "pinion"]
{shaft}
"""
    return read_gear_set(text)


@pytest.mark.parametrize("hub_mm", [16.0, 20.0, 26.0])
def test_no_mesh_yields_energy_and_motions_repeat(hub_mm):
    """The inertia of modes that are left out is a small difference of large numbers,
    by whose error meshes would pull: motions grew beyond all bounds at the second step.
    """
    model = LumpedModel(number="coupled", stiffness=COARSE)
    system = lumped_system(counter_shaft(hub_mm), TORQUE, model)
    assert not system.contacts.rest_has_inertia
    assert not system.loaded.meshes_pull
    response = lumped.respond(system, 1000.0)
    assert response.status.name == "PERIODIC"
    assert (response.dte_rms < 10e-6).all()


def test_the_inertia_of_all_modes_stays_where_it_is_no_small_difference():
    model = LumpedModel(number="coupled", stiffness=COARSE)
    for name in ("liu-pair", "liu-idler"):
        system = lumped_system(fegear.load_gear_set(name), 100.0, model)
        assert system.contacts.rest_has_inertia


@pytest.mark.slow
def test_natural_frequencies_are_those_of_finite_elements():
    gear_set = counter_shaft(20.0)
    excitations = Excitations(COARSE)
    plain = lumped_system(gear_set, TORQUE, LumpedModel(stiffness=COARSE), excitations)
    resonance = highest_resonance(plain)
    coupled = lumped_system(
        gear_set, TORQUE, LumpedModel(number="coupled", stiffness=COARSE)
    )
    speeds = speeds_of(resonance, 3)
    elastic = elastic_gears(gear_set, speeds, excitations.source.statics, 1.0)
    model = reduced_gears(gear_set, TORQUE, plain, excitations, elastic)
    ours, theirs = natural_frequencies(coupled, model, elastic, resonance)
    strained = [row[0] for row in ours if row[1] > 0.25 and row[0] < 1.2 * resonance]
    assert strained
    for frequency in strained:
        apart = min(abs(row[0] - frequency) for row in theirs if row[1] > 0.1)
        assert apart < 0.03 * frequency


FLYWHEEL = """
[[gear]]
name = "flywheel"
teeth = 50
inertia_kg_m2 = 2e-3
"""


def test_a_gear_without_mesh_on_a_shaft_is_a_flywheel():
    """Its inertia counts in the coupled model and in finite elements in motion."""
    shaft = """[[shaft]]
gears = ["output", "flywheel"]"""
    gears = counter_shaft(30.0, shaft, FLYWHEEL)
    plain = ("body", "modes")  # as finite elements without inertia of the bodies
    model = LumpedModel(number="coupled", stiffness=COARSE, without=plain)
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
            source=COARSE,
            direction="up",
            elements=fegear.FiniteElements(fidelity="quasistatic"),
        )
    )
    rms = [np.array(result.to_frame()["dte_rms_m"], float) for result in (ours, theirs)]
    np.testing.assert_allclose(rms[0], rms[1], rtol=0.03)
