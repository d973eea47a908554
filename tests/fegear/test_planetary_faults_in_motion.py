"""Faults of sun, planets and ring in motion: at slow speed, at rest, by elements."""

from __future__ import annotations

import numpy as np
import pytest
from slow_tests import first_are_quick

import fegear
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.gearset.pitch_errors import pair_periods
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.steady.respond import respond_with_history
from lumped.train.equilibrium import POINTS, mesh_forces_at_rest

SET = "planetary-24-36-96"
TORQUE = 60.0
SOURCE = ExcitationSettings(positions=16, resolution="coarse")
SPALL = {"start_roll_angle_deg": 20.0, "end_roll_angle_deg": 23.0, "width_share": 0.6}
FAULTS = {
    "sun crack": {"gear.sun.cracks": [{"tooth": 5, "depth_mm": 1.0}]},
    "planet tip": {"gear.planet-2.broken_tips": [{"tooth": 5, "height_mm": 0.4}]},
    "ring eccentricity": {"gear.ring.eccentricity_um": 2.0},
    "planets' spalls": {"gear.planet.spalls": [{"tooth": 5, **SPALL}]},
    "sun eccentricity": {"gear.sun.eccentricity_um": 2.0},
    "ring tip": {"gear.ring.broken_tips": [{"tooth": 5, "height_mm": 0.4}]},
}


@pytest.fixture(scope="module")
def elements(compliance_cache):
    return Excitations(SOURCE)


def system_of(edits, number, elements, **more):
    without = ("body", "modes") if number == "coupled" else ()
    model = LumpedModel(number=number, excitation=SOURCE, without=without, **more)
    return lumped_system(load_gear_set(SET, edits), TORQUE, model, elements)


def history_of(system, speed: float):
    """Times in base pitches, and the motion."""
    response, history = respond_with_history(system, speed)
    assert response.status == "periodic"
    return history.time * speed, history


@pytest.mark.parametrize("translations", first_are_quick([True, False], 1))
@pytest.mark.parametrize("fault", first_are_quick(FAULTS, 1))
@pytest.mark.parametrize("model", first_are_quick([2, 1], 1))
def test_slow_motion_tends_to_the_mesh_forces_at_rest(
    elements, fault, model, translations
):
    """Corners of the tables change the velocity by an amount in proportion to it."""
    speed = 40.0 if fault.startswith("ring") else 10.0  # 96 periods take the memory
    system = system_of(FAULTS[fault], model, elements, translations=translations)
    at_rest = mesh_forces_at_rest(system)
    pitches, history = history_of(system, speed)
    places = (np.arange(len(at_rest)) + 0.5) / POINTS
    slow = [np.interp(places, pitches, force) for force in history.force.T]
    bound = (1e-4 if model == 2 else 1.5e-4) * speed * at_rest.mean()
    assert np.abs(np.transpose(slow) - at_rest).max() < bound


@pytest.mark.parametrize(
    ("model", "error"),
    [
        (1, 1e-3),
        (2, 1e-3),
        pytest.param("coupled", 3e-3, marks=pytest.mark.slow),
    ],
)
def test_a_sun_whose_faulty_teeth_meet_all_planets_at_once_has_its_tables_error(
    elements, model, error
):
    """Teeth 5, 13 and 21 of 24, with planets a third of a turn apart.

    But for the mean, which model 2 has from the mean stiffness.
    """
    tips = [{"tooth": tooth, "height_mm": 0.4} for tooth in (5, 13, 21)]
    edits = {"gear.sun.broken_tips": tips}
    gear_set = load_gear_set(SET, edits)
    table = elements.table(gear_set, 0, TORQUE / 3)
    system = system_of(edits, model, elements)
    pitches, history = history_of(system, 20.0)
    assert system.common_period[0] == 24
    peak_to_peak = np.ptp(table["ste_m"])
    healthy = elements.table(load_gear_set(SET, {}), 0, TORQUE / 3)
    assert peak_to_peak > 1.05 * np.ptp(healthy["ste_m"])
    slow = np.interp(table.position, pitches, history.deflection[:, 0])
    assert np.std(slow - table["ste_m"][0]) < error * peak_to_peak


@pytest.mark.parametrize(
    ("edits", "periods"),
    [
        (FAULTS["sun crack"], (24, 1, 24, 1, 24, 1)),
        (FAULTS["planet tip"], (1, 1, 36, 36, 1, 1)),
        (FAULTS["planets' spalls"], (36, 1, 36, 1, 36, 1)),
        (FAULTS["ring tip"], (1, 96, 1, 96, 1, 96)),
        (FAULTS["sun crack"] | FAULTS["planet tip"], (24, 1, 72, 36, 24, 1)),
    ],
)
def test_only_meshes_whose_flanks_differ_repeat_later(edits, periods):
    assert pair_periods(load_gear_set(SET, edits)) == periods


def test_load_shares_at_rest_are_those_of_model_1_where_teeth_differ(compliance_cache):
    model = LumpedModel(excitation=SOURCE)
    edits = ("gear.sun.eccentricity_um=3",)
    gear_set = GearSetRef(name=SET, edits=edits)
    sharing = fegear.PlanetLoadSharing(gear_set=gear_set, torque=(TORQUE,), model=model)
    result = fegear.run(sharing)
    assert result.model.number == 1
    coupled = LumpedModel(number="coupled", excitation=SOURCE)
    with pytest.raises(InputError, match="at rest has equal teeth"):
        fegear.run(
            fegear.PlanetLoadSharing(gear_set=gear_set, torque=(60.0,), model=coupled)
        )


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["sun crack", "planet tip"])
def test_the_coupled_model_has_the_motion_of_finite_elements(compliance_cache, fault):
    """RMS of the transmission error of every mesh at 1000 Hz."""
    gear_set = load_gear_set(SET, FAULTS[fault])
    model = LumpedModel(number="coupled", excitation=SOURCE)
    motion = fegear.Motion(gear_set=gear_set, model=model, torque=TORQUE, speed=1000.0)
    meshes = fegear.run(motion).summary["meshes"]
    elements = fegear.Dynamics(
        gear_set=gear_set, torque=(TORQUE,), speeds=(1000.0,), excitation=SOURCE
    )
    table = fegear.run(elements).table
    expected = np.asarray(table["dte_rms_m"])[:6]
    assert [mesh["dte_rms_m"] for mesh in meshes] == pytest.approx(expected, rel=0.01)
