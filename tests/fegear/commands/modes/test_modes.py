"""`fegear modes` on the screen and as JSON."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from fegear.cli import app

GIVEN = "--stiffness", "given"
COMPLIANT = (68.8, 446.1, 498.7, 641.1, 889.2, 1076.2, 1200.4, 2528.8, 3851.1)


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["modes", *arguments], catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def modes(*arguments: str) -> list[dict]:
    return json.loads(run(*arguments, "--json"))["modes"]


def test_idler_on_rigid_bearings():
    frequencies = [mode["frequency_Hz"] for mode in modes("liu-idler", *GIVEN)]
    assert frequencies == pytest.approx([69.54, 1605.0, 3230.6], rel=1e-3)
    printed = run("liu-idler", *GIVEN)
    for text in ("69.5", "1605.0", "given by the gear set", "energy in"):
        assert text in printed


def test_idler_on_compliant_bearings():
    train_modes = modes("liu-idler", "--translations", *GIVEN)
    assert [m["frequency_Hz"] for m in train_modes] == pytest.approx(
        COMPLIANT, rel=1e-3
    )
    free = [
        m["frequency_Hz"] for m in train_modes if m["kind"].startswith("strains no")
    ]
    assert free == pytest.approx([498.7, 1200.4], rel=1e-3)


def test_a_free_train_turns_at_no_frequency():
    rigid, vibrating = modes("liu-pair", *GIVEN)
    assert rigid["frequency_Hz"] == 0.0
    assert rigid["kind"] == "rigid rotation"
    assert vibrating["mesh_energy"] == pytest.approx([1.0])


def test_stiffness_by_finite_elements():
    figures = json.loads(run("liu-pair", "--stiffness", "fe", "--json"))
    entry = figures["mean_stiffness"][0]
    assert entry["origin"] == "finite elements at 100 N m on the driver, without relief"
    assert entry["stiffness_N_per_m"] == pytest.approx(2.98e8, rel=0.015)


def test_the_loaded_state_of_the_coupled_model():
    figures = json.loads(run("liu-pair", "--stiffness", "coupled", "--json"))
    rigid, mode, *bodies = figures["modes"]
    assert rigid["kind"] == "rigid rotation"
    assert bodies
    assert all("body" in body["kind"] for body in bodies)
    assert all(body["frequency_Hz"] > 1e4 for body in bodies)
    (held,) = (m for m in modes("liu-pair", "--stiffness", "fe") if m["frequency_Hz"])
    assert 1.03 < mode["frequency_Hz"] / held["frequency_Hz"] < 1.12
    assert 0.7 < mode["mesh_energy"][0] < 1.0
    assert mode["kind"] == held["kind"]
    (entry,) = figures["mean_stiffness"]
    assert (
        entry["origin"] == "tangent of the coupled model at 100 N m on the input gear"
    )
    assert 1.03 < entry["stiffness_N_per_m"] / 2.98e8 < 1.1
    shown = run("liu-pair", "--stiffness", "coupled")
    assert "averages" in shown
    assert f"{len(bodies)} more modes" in shown


def test_the_default_is_the_loaded_state_of_the_coupled_model():
    coupled = json.loads(run("liu-pair", "--stiffness", "coupled", "--json"))
    figures = json.loads(run("liu-pair", "--json"))
    assert figures["modes"] == coupled["modes"]
    assert figures["model_reason"] == "coupled model: nothing here needs model 1"
    assert figures["natural_frequencies_Hz"][0] == figures["modes"][1]["frequency_Hz"]


def test_energies_of_a_counter_shaft_are_in_its_shaft_too():
    """They add up to 100 %, and the shaft twists most in the first mode."""
    soft = ("--set", "shaft.1.stiffness_Nm_per_rad=5e3")
    first = modes("liu-countershaft", *soft, *GIVEN)[1]
    assert first["shaft_energy"] > 0.5
    assert first["bearing_energy"] == 0.0
    assert first["shaft_energy"] + sum(first["mesh_energy"]) == pytest.approx(1.0)
    assert "shafts" in run("liu-countershaft", *soft, *GIVEN)


def test_a_change_of_a_mean_stiffness_that_is_not_read_is_refused():
    argv = ["modes", "liu-pair", "--set", "mesh.1.mean_stiffness_N_per_m=3e8"]
    result = CliRunner().invoke(app, argv)
    assert result.exit_code != 0
    assert "finite elements take its place, choose --stiffness given" in str(
        result.exception
    )
