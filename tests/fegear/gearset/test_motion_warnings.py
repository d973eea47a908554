"""What models in motion leave out of helical gears is said wherever they move."""

from __future__ import annotations

import json

import pytest

from fegear.cli import run
from fegear.files.toml import toml_text

KEYS = {"module_mm": 3.0, "hub_radius_mm": 14.0, "face_width_mm": 20.0}
GIVEN = {"mean_stiffness_N_per_m": 3e8, "stiffness_variation": 0.1, "load_share": 0.4}
ANALYTIC = ["--model", "1", "--excitation", "rectangular"]


def tables(helix: float) -> dict:
    """A pair with given stiffness, on shafts that bend or on ball bearings."""
    return {
        "name": "moving",
        "defaults": {**KEYS, "helix_angle_deg": helix},
        "gear": [{"name": "one", "teeth": 18}, {"name": "two", "teeth": 25}],
        "mesh": [{"driver": "one", "driven": "two", "backlash_um": 60.0, **GIVEN}],
        "load": {"gear": "one", "torques_Nm": [60.0]},
        "dynamics": {"damping_ratio": 0.05},
    }


def warnings_of(capsys, tmp_path, gear_set: dict, *arguments: str) -> list[str]:
    path = tmp_path / "moving.toml"
    path.write_text(toml_text(gear_set))
    command, *options = arguments
    assert run([command, str(path), *options, "--json"]) == 0
    return json.loads(capsys.readouterr().out)["warnings"]


COMMANDS = [
    ["modes", "--stiffness", "given"],
    ["theory", *ANALYTIC],
    ["sweep", *ANALYTIC, "--speeds", "1000:1010:10"],
    ["motion", *ANALYTIC, "--speed", "1000"],
    ["signals", *ANALYTIC, "--speed", "1000"],
    ["export", "--stiffness", "given", "-o", "model.json"],
]


@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda arguments: arguments[0])
def test_commands_in_motion_say_what_helical_gears_lack(
    arguments, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    lines = warnings_of(capsys, tmp_path, tables(20.0), *arguments)
    (line,) = [line for line in lines if line.endswith("[W59]")]
    assert line.startswith("helix angle 20 deg: motions leave out axial motion")
    assert "+7 to +29 %" in line
    lines = warnings_of(capsys, tmp_path, tables(0.0), *arguments)
    assert not [line for line in lines if line.endswith("[W59]")]


def test_spinning_shafts_lack_axial_motion(tmp_path, capsys):
    shaft = {
        "lengths_mm": [100.0],
        "diameters_mm": [20.0],
        "positions_mm": [50.0],
        "bearing_positions_mm": [10.0, 90.0],
        "bearing_ky_N_per_m": [1e8, 1e8],
        "bearing_kx_N_per_m": [1e8, 1e8],
    }
    shafts = {"shaft": [{"gears": [name], **shaft} for name in ("one", "two")]}
    arguments = "campbell", "--points", "3"
    lines = warnings_of(capsys, tmp_path, tables(20.0) | shafts, *arguments)
    assert [line for line in lines if line.endswith("[W59]")]


def test_a_bearing_names_the_axial_force_that_it_lacks(tmp_path, capsys):
    gear_set, spur = tables(20.0), tables(0.0)
    balls = {"balls": 9, "ball_diameter_mm": 9.0, "pitch_diameter_mm": 40.0}
    for pair in (gear_set, spur):
        pair["gear"][0]["ball_bearing"] = balls
    (line,) = warnings_of(capsys, tmp_path, gear_set, "bearing")
    # T tan(beta) over the reference radius
    assert line.startswith(
        "axial force on the shaft of one: -760.04 N, toward the near end;"
    )
    assert line.endswith("[W60]")
    (line,) = warnings_of(capsys, tmp_path, gear_set, "bearing", "--load", "500")
    assert line.endswith("[W60]")
    assert warnings_of(capsys, tmp_path, spur, "bearing") == []
