"""Where a result cannot be physical, it says so; elsewhere it is silent."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from fegear.cli import run
from fegear.gearset import builtin_names, load_gear_set
from fegear.statics.mesh_result import ERROR_FACTOR
from fegear.statics.plausibility import (
    MAX_PRESSURE,
    kinematic_error,
    motion_warnings,
    plausibility_warnings,
    unit_warnings,
)
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.statics.table_warnings import table_warnings

USUAL = {
    "deflection": 2e-5,
    "pressure": 1.2e9,
    "backlash": 1e-4,
    "back_side": 0.3,
}
COARSE = ["--resolution", "coarse"]
TIGHT = ["--set", "mesh.1.backlash_um=0"]
RECTANGULAR = ["liu-pair", "--excitation", "rectangular", "--torque", "50"]


def reasons(**changes) -> list[str]:
    return list(plausibility_warnings("mesh 1", 2e-3, **(USUAL | changes)))


def test_a_usual_result_is_not_doubted():
    assert reasons() == []
    assert reasons(backlash=0.0, back_side=0.0) == []
    assert reasons(deflection=-2e-4, pressure=MAX_PRESSURE) == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"deflection": 2.1e-4}, "210 um exceeds a tenth of the module, 200"),
        ({"deflection": -2.1e-4}, "210 um exceeds a tenth of the module"),
        ({"pressure": 1.6e10}, "1.6e+04 MPa exceeds 1.5e+04 MPa"),
        ({"backlash": 0.0, "back_side": 0.51}, "back flanks touch for 51 % of the"),
    ],
)
def test_each_reason_is_one_line_with_both_numbers(changes, message):
    (line,) = reasons(**changes)
    assert line.startswith("mesh 1: ")
    assert message in line
    assert "\n" not in line


def command_output(capsys, *argv: str) -> tuple[dict, list[str]]:
    """What a command prints as JSON, and its lines on the error stream."""
    assert run([*argv, "--json"]) == 0
    printed = capsys.readouterr()
    return json.loads(printed.out), printed.err.splitlines()


@pytest.mark.parametrize(
    ("argv", "part"),
    [
        (["stiffness", *COARSE, "--torque", "1e8"], "1e+08 N m: deflection"),
        (["compare", "--torque", "1e7"], "exceeds a tenth of the module"),
        (["sweep", *RECTANGULAR[:-1], "1e8", "--speeds", "900"], "a tenth of the mod"),
        (["motion", *RECTANGULAR[:-1], "1e8", "--speed", "900"], "a tenth of the mod"),
        (
            ["map", *RECTANGULAR[:-2], "--over", "torque_Nm=50,1e8", "--at", "900"],
            "at its worst point: deflection",
        ),
        (
            ["sweep", *RECTANGULAR, *TIGHT, "--speeds", "3100"],
            "without backlash the back flanks touch",
        ),
        (
            ["motion", *RECTANGULAR, *TIGHT, "--speed", "3100"],
            "without backlash the back flanks touch",
        ),
    ],
    ids=lambda argv: argv[0] if isinstance(argv, list) else "",
)
def test_commands_warn_in_one_line_and_in_json(capsys, argv, part):
    values, lines = command_output(capsys, *argv)
    assert [f"warning: {warning}" for warning in values["warnings"]] == lines
    *before, line = lines
    assert part in line
    assert line.endswith(" [W03]" if "back flanks" in part else " [W01]")
    if "back flanks" in part:  # what was to come is said before
        assert before[0].endswith(" [W55]")
    assert len(before) == ("back flanks" in part)


def test_usual_results_are_without_warnings(capsys):
    for argv in (
        ["stiffness", *COARSE],
        ["sweep", *RECTANGULAR, "--speeds", "900:1500:100"],
        ["motion", *RECTANGULAR, "--speed", "1500"],
    ):
        values, lines = command_output(capsys, *argv)
        assert values["warnings"] == []
        assert lines == []


def test_contact_of_the_back_flanks_is_on_the_screen(capsys):
    speeds = ["--speeds", "3100"]
    assert run(["sweep", *RECTANGULAR, *speeds]) == 0
    assert "side [%]" not in capsys.readouterr().out
    assert run(["sweep", *RECTANGULAR, *speeds, *TIGHT]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert any(line.endswith("side [%] ") for line in printed)
    rows = [line.split() for line in printed if " up " in line]
    assert float(rows[0][-1]) > 1.0


def test_what_closed_forms_leave_out_is_said(capsys, tmp_path):
    from importlib import resources

    text = (resources.files("fegear.gearset") / "sets" / "liu-pair.toml").read_text()
    relief = "driver_tip_relief = { magnitude_um = 10, start = 'HPSTC' }\n[load]"
    errors = ", ".join(["3"] + ["0"] * 37)
    text = text.replace("[load]", relief)
    text = text.replace("teeth = 38", f"teeth = 38\npitch_errors_um = [{errors}]")
    (tmp_path / "own.toml").write_text(text)
    _, lines = command_output(capsys, "compare", str(tmp_path / "own.toml"))
    start = 'warning: gear "pinion" has '
    assert lines == [
        f"{start}tip relief, which the closed forms leave out [W25]",
        f"{start}pitch_errors_um, which are left out: the closed forms know none [W26]",
    ]
    assert command_output(capsys, "compare")[1] == []


def test_pressure_at_sharp_tips_is_no_reason():
    """It follows the contact grid: an ordinary load would count as impossible."""
    settings = StaticsSettings(resolution="fine", estimate_error=False)
    result = solve_mesh(load_gear_set("liu-pair"), 1, [400.0], settings)
    assert result.table["max_pressure_Pa"].max() > MAX_PRESSURE
    assert table_warnings(result) == []


@pytest.fixture(scope="module")
def coarse():
    settings = StaticsSettings(positions=16, resolution="coarse")
    return solve_mesh(load_gear_set("liu-pair"), 1, [50.0, 400.0], settings)


def test_evidence_that_holds_is_no_warning(coarse):
    assert coarse.work_balance < 2e-4
    assert table_warnings(coarse) == []


@pytest.mark.parametrize(
    ("change", "message", "code"),
    [
        (
            {"residual": 0.002},
            "gaps and pressures of the contact are off by 0.002",
            "W04",
        ),
        (
            {"residual": math.nan},
            "gaps and pressures of the contact are off by nan",
            "W04",
        ),
        (
            {"driven_torque": 1.01},
            "works of both torques over the cycle are off by",
            "W07",
        ),
    ],
)
def test_a_self_check_that_fails_is_a_warning(coarse, change, message, code):
    ((name, factor),) = change.items()
    value = getattr(coarse.cycle, name)
    wrong = value * factor if value.any() else value + factor
    cycle = replace(coarse.cycle, **{name: wrong})
    (line,) = table_warnings(replace(coarse, cycle=cycle))
    assert message in line
    assert line.endswith(f" [{code}]")


def test_a_mesh_that_is_too_coarse_is_a_warning(coarse):
    error = replace(coarse.error, mean=0.02 * ERROR_FACTOR)
    (line,) = table_warnings(replace(coarse, errors=(coarse.error, error)))
    assert "mean transmission errors of two meshes are off by 0.02" in line
    assert line.endswith(" [W06]")


def test_eccentricity_and_pitch_errors_are_no_deflection():
    errors = [0.0, 120.0, *[0.0] * 36]
    edits = {"gear.2.eccentricity_um": 200.0, "gear.1.pitch_errors_um": errors}
    gears = load_gear_set("liu-pair", edits | {"mesh.1.backlash_um": 900.0})
    assert kinematic_error(gears, 0) == pytest.approx(320e-6)
    limit = 0.1 * gears.meshes[0].pair.driver.module
    peaks = [320e-6 + 0.9 * limit], [320e-6 + 1.1 * limit]
    assert not list(motion_warnings(gears, "", peaks[0], [0.0]))
    (line,) = motion_warnings(gears, "", peaks[1], [0.0])
    assert line.endswith("[W01]")
    assert "deflection 279.4 um exceeds a tenth of the module, 254 um" in line


@pytest.mark.parametrize(
    ("magnitude_um", "torque", "codes"),
    [
        (15.0, 100.0, []),
        (15.0, 1.0, []),
        (1500.0, 100.0, ["W52"]),
        (0.015, 100.0, ["W53"]),
        (15.0, 0.1, ["W54"]),
    ],
)
def test_slips_of_a_unit_are_named_by_what_they_lead_to(magnitude_um, torque, codes):
    relief = {"magnitude_um": magnitude_um, "length_pitches": 0.3}
    gears = load_gear_set("liu-pair", {"mesh.1.driver_tip_relief": relief})
    settings = StaticsSettings(resolution="coarse", positions=8, estimate_error=False)
    lines = list(unit_warnings(solve_mesh(gears, 1, [torque], settings)))
    assert [line[-4:-1] for line in lines] == codes


def test_a_deflection_below_all_roughness_is_printed():
    gears = load_gear_set("liu-pair")
    settings = StaticsSettings(resolution="coarse", positions=8, estimate_error=False)
    solved = solve_mesh(gears, 1, [0.1], settings)
    (line,) = unit_warnings(solved)
    mean = float((solved.cycle.ste - solved.cycle.no_load).mean())
    assert f"mean deflection {1e6 * mean:.2g} um at 0.1 N m" in line


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_sets_have_no_slips_of_a_unit(name):
    gears = load_gear_set(name)
    settings = StaticsSettings(
        resolution="coarse", positions=4, estimate_error=False, root_stress=False
    )
    solved = solve_mesh(gears, 1, gears.meshes[0].torques or [100.0], settings)
    assert list(unit_warnings(solved)) == []
