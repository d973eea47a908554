"""What the commands do with pitch errors: none of them leaves them out unsaid."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner
from written_tables import read_sweep

from fegear.cli import app
from fegear.files.errors import InputError
from lumped.steady.maps import QUANTITIES
from lumped.train.table import read_table

PINION, WHEEL = (0, 3), (1, -2, 0.5, 2, -1)  # um, repeated around
TEXT = f"""
name = "uneven"
[defaults]
module_mm = 2.54
face_width_mm = 25
[[gear]]
name = "pinion"
teeth = 28
hub_radius_mm = 12
pitch_errors_um = {list(PINION * 14)}
[[gear]]
name = "wheel"
teeth = 35
hub_radius_mm = 15
pitch_errors_um = {list(WHEEL * 7)}
[[mesh]]
driver = "pinion"
driven = "wheel"
operating_pressure_angle_deg = 21
[load]
gear = "pinion"
torques_Nm = [80]
"""
CYCLES = 10


@pytest.fixture(scope="module")
def uneven(tmp_path_factory):
    path = tmp_path_factory.mktemp("sets") / "uneven.toml"
    path.write_text(TEXT)
    return path


@pytest.fixture(scope="module")
def equal(tmp_path_factory):
    lines = [line for line in TEXT.splitlines() if "pitch_errors" not in line]
    path = tmp_path_factory.mktemp("sets") / "equal.toml"
    path.write_text("\n".join(lines))
    return path


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result.stdout


def swept(path, gear_set, *options):
    run("sweep", gear_set, "--speeds", 1500, "--direction", "up", "-o", path, *options)
    (row,) = read_sweep(str(path)).rows
    return row


@pytest.mark.parametrize("model", [1, 2, 3])
@pytest.mark.parametrize("excitation", ["fe", "rectangular", "trapezoid"])
def test_sweeps_run_over_all_pairs(uneven, equal, tmp_path, model, excitation):
    options = "--model", model, "--excitation", excitation
    row = swept(tmp_path / "s.csv", uneven, *options)
    plain = swept(tmp_path / "p.csv", equal, *options)
    assert (row.period_multiple, plain.period_multiple) == (CYCLES, 1)
    assert row.dte_rms_m > 1.1 * plain.dte_rms_m
    header = read_sweep(str(tmp_path / "s.csv")).header
    assert header["pitch errors"].endswith(f"{CYCLES} of mesh 1")
    assert "pitch errors" not in read_sweep(str(tmp_path / "p.csv")).header


def test_models_agree_about_them(uneven, tmp_path):
    rows = [swept(tmp_path / f"{m}.csv", uneven, "--model", m) for m in (1, 2, 3)]
    for row in rows[1:]:
        assert row.dte_rms_m == pytest.approx(rows[0].dte_rms_m, rel=0.25)


def test_a_wave_lasts_for_all_pairs(uneven, tmp_path):
    path = tmp_path / "w.csv"
    arguments = "motion", uneven, "--speed", 1500, "--json", "-o", path
    values = json.loads(run(*arguments, "--plot", tmp_path / "w.png"))
    assert values["section_points"] == values["meshes"][0]["period_multiple"] == CYCLES
    assert values["shown_time_s"] == pytest.approx(CYCLES / 1500.0)
    assert "tooth pairs repeat after base pitches: 10 of mesh 1" in path.read_text()


def test_harmonics_know_no_pairs(uneven):
    with pytest.raises(InputError, match="mesh 1 has pitch errors; excitation fourier"):
        run("sweep", uneven, "--speeds", 1500, "--excitation", "fourier")


def test_a_table_holds_all_pairs_and_serves_every_model(uneven, tmp_path):
    path = tmp_path / "t.csv"
    arguments = "stiffness", uneven, "--positions", 64, "-o", path
    values = json.loads(run(*arguments, "--plot", tmp_path / "t.png", "--json"))
    assert values["base_pitches"] == CYCLES
    assert read_table(str(path)).position.size == values["positions"] == 64 * CYCLES
    assert f"repeat after {CYCLES} base pitches" in run("stiffness", uneven)
    for model in (1, 2, 3):
        computed = swept(tmp_path / "o.csv", uneven, "--model", model)
        tabulated = swept(tmp_path / "r.csv", uneven, "--model", model, "--table", path)
        assert tabulated.period_multiple == CYCLES
        # whose stiffness is that of pairs that share the load unequally
        assert tabulated.dte_rms_m == pytest.approx(computed.dte_rms_m, rel=0.15)


def test_a_table_of_one_base_pitch_is_refused(uneven, equal, tmp_path):
    path = tmp_path / "t.csv"
    run("stiffness", equal, "--positions", 16, "-o", path)
    expected = f"base pitches = 1; tooth pairs of mesh 1 repeat after {CYCLES}"
    with pytest.raises(InputError, match=expected):
        run("sweep", uneven, "--speeds", 1500, "--table", path)


def test_a_map_runs_over_all_pairs(uneven, tmp_path):
    path = tmp_path / "m.csv"
    over = "--over", "torque_Nm=60,80"
    run("map", uneven, *over, "--at", 1500, "-o", path, "--steps", 64)
    rows = [line.split(",") for line in path.read_text().splitlines()[-2:]]
    assert [row[3 + len(QUANTITIES)] for row in rows] == [str(CYCLES)] * 2


def test_closed_forms_are_said_to_know_none(uneven, equal):
    """Finite elements beside them are those of equal teeth."""
    uneven_values, equal_values = (
        json.loads(run("compare", g, "--json")) for g in (uneven, equal)
    )
    for gear, line in zip(("pinion", "wheel"), uneven_values["warnings"], strict=True):
        assert gear in line
        assert "pitch_errors_um, which are left out" in line
    assert equal_values["warnings"] == []
    assert uneven_values["comparisons"] == equal_values["comparisons"]


def test_the_period_is_shown(uneven, equal):
    assert (
        json.loads(run("show", uneven, "--json"))["meshes"][0][
            "pitch_errors_repeat_pitches"
        ]
        == CYCLES
    )
    mesh = json.loads(run("show", equal, "--json"))["meshes"][0]
    assert mesh["pitch_errors_repeat_pitches"] is None


def test_gears_in_motion_run_over_all_pairs(uneven, tmp_path):
    path, history = tmp_path / "d.csv", tmp_path / "h"
    options = "--fidelity", "quasistatic", "--resolution", "coarse", "--speeds", 1500
    options = *options, "--direction", "up", "--history", history, "-o", path
    run("dynamics", uneven, *options)
    (row,) = read_sweep(str(path)).rows
    assert row.period_multiple == CYCLES
    model_1 = swept(tmp_path / "1.csv", uneven, "--model", 1)
    assert row.dte_rms_m == pytest.approx(model_1.dte_rms_m, rel=0.05)
    (file,) = history.iterdir()
    names = next(x for x in file.read_text().splitlines() if not x.startswith("#"))
    assert "mesh1_driver_tooth" in names


def test_every_base_pitch_can_be_drawn(uneven, equal, tmp_path):
    options = "--resolution", "coarse", "-o", tmp_path / "c.vtu"
    run("render", uneven, "--position", 7.4, *options)
    one = (tmp_path / "c.vtu").read_bytes()
    run("render", uneven, "--position", 0.4, *options)
    assert one != (tmp_path / "c.vtu").read_bytes()
    for gear_set, most in ((uneven, CYCLES), (equal, 1)):
        with pytest.raises(InputError, match=f"--position = 10.5; must be 0 to {most}"):
            run("render", gear_set, "--position", 10.5, *options)
