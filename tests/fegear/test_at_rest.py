"""Lumped models at rest beside the finite elements that they are made from."""

from __future__ import annotations

import json

import numpy as np
import pytest
from relieved_sets import relieved_set
from slow_tests import first_are_quick
from typer.testing import CliRunner

import fegear
from fegear.cli import app
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.trains.model_texts import static_warnings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.steady.respond import respond_with_history

EACH = first_are_quick(range(15), 1)
# a recess of nearly a base pitch: without relief a third pair touches at its end
LONG_RECESS = {
    "name": "long-recess",
    "defaults": {"module_mm": 3.0},
    "gear": [
        {"name": "a", "teeth": 21, "profile_shift": 0.35, "face_width_mm": 25.0}
        | {"hub_radius_mm": 15.0},
        {"name": "b", "teeth": 53, "profile_shift": -0.1, "face_width_mm": 22.0}
        | {"hub_radius_mm": 40.0},
    ],
    "mesh": [
        {"driver": "a", "driven": "b", "center_distance_mm": 112.0}
        | {"tip_relief": {"magnitude_um": 15.0, "length_pitches": 0.3}}
    ],
    "load": {"gear": "a", "torques_Nm": [300.0]},
}


@pytest.mark.parametrize("number", EACH)
def test_relieved_sets_have_the_static_errors_of_their_elements(number):
    gear_set, excitations = relieved_set(number), Excitations()
    (torque,) = gear_set.meshes[0].torques
    for model, allowed in (("coupled", 0.02), (1, 0.1)):
        chosen = LumpedModel(number=model)
        system = lumped_system(gear_set, torque, chosen, excitations)
        checks = system.static_checks
        assert [check.mesh for check in checks] == list(range(len(gear_set.meshes)))
        assert all(abs(check.error) < allowed for check in checks)
        assert all(abs(check.mean_error) < 0.01 for check in checks)
        assert not list(static_warnings({torque: system}))
    # independent of what the system keeps: the table itself
    table = excitations.table(gear_set, 0, mesh_torques_at(gear_set, torque)[0])
    reference = system.static_checks[0].reference_peak_to_peak
    assert np.ptp(table["ste_m"]) == pytest.approx(reference)


@pytest.mark.parametrize("model", [1, "coupled"])
def test_slow_motion_transmits_a_constant_force(model):
    gear_set = make_gear_set(LONG_RECESS)
    system = lumped_system(gear_set, 300.0, LumpedModel(number=model))
    _, history = respond_with_history(system, 20.0)
    force = 300.0 / gear_set.meshes[0].pair.driver.base_radius
    np.testing.assert_allclose(history.force, force, rtol=0.01)


def test_the_way_of_the_source_is_far_off_at_rest_and_warns():
    """Stiffnesses of teeth that share the load without relief."""
    gear_set = make_gear_set(LONG_RECESS)
    source = LumpedModel(
        number=1, excitation=ExcitationSettings(relief_stiffness="unmodified")
    )
    system = lumped_system(gear_set, 50.0, source)
    (check,) = system.static_checks
    assert check.error > 0.5
    (warning,) = static_warnings({50.0: system})
    assert "static" in warning
    # yet all pairs have their own gap: forces stay near those transmitted
    _, history = respond_with_history(system, 20.0)
    force = 50.0 / gear_set.meshes[0].pair.driver.base_radius
    np.testing.assert_allclose(history.force, force, rtol=0.1)


def test_rectangular_stiffness_has_no_reference():
    model = LumpedModel(number=1, excitation=ExcitationSettings(kind="rectangular"))
    system = lumped_system(load_gear_set("liu-idler"), 100.0, model)
    assert system.static_checks == ()


@pytest.mark.parametrize("number", [2, 3])
def test_models_2_and_3_have_the_peak_to_peak_of_their_table(number):
    system = lumped_system(load_gear_set("liu-pair"), 100.0, LumpedModel(number=number))
    (check,) = system.static_checks
    assert abs(check.error) < 1e-3


@pytest.mark.parametrize("command", ["sweep --speeds 2000", "motion --speed 2000"])
def test_commands_choose_a_model_and_say_why(command):
    name, *argv = command.split()
    argv = [name, "liu-pair", *argv, "--torque", "100"]

    def run(*more: str) -> tuple[str, dict]:
        text = CliRunner().invoke(app, [*argv, *more])
        json_output = CliRunner().invoke(app, [*argv, *more, "--json"])
        assert (text.exit_code, json_output.exit_code) == (0, 0), text.output
        return text.stdout.splitlines()[0], json.loads(json_output.stdout)

    line, values = run()
    assert line.startswith("coupled model: ")
    assert values["model"] == "coupled"
    assert [abs(error) < 0.02 for error in values["static_error"]] == [True]
    assert values["body_modes_error"] < 0.02
    line, values = run("--friction", "0.05")
    assert line == "model 1: the coupled model has no friction"
    assert values["model"] == "1"
    line, values = run("--model", "1")
    assert values["model_reason"] is None


def test_a_table_of_one_torque_leaves_model_1(tmp_path):
    path = tmp_path / "t.csv"
    fegear.solve_mesh(load_gear_set("liu-pair"), 1, [100.0]).to_csv(path)
    study = fegear.Motion(gear_set="liu-pair", speed=2000.0, torque=100.0, table=[path])
    values = fegear.run(study).summary
    assert values["model"] == "1"
    assert "torques = 1" in values["model_reason"]
    assert abs(values["static_error"][0]) < 0.02
