"""`fegear motion`: summary, history and picture."""

from __future__ import annotations

import csv
import json
import sys

import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures
from typer.testing import CliRunner

from fegear.cli import app

FAST = ("liu-idler", "--excitation", "rectangular")


def run(*arguments: object) -> str:
    result = CliRunner().invoke(
        app, ["motion", *map(str, arguments)], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    return result.stdout


def test_the_branch_is_chosen_by_where_it_comes_from():
    arguments = (*FAST, "--speed", "2400", "--json")
    low = json.loads(run(*arguments, "--from-speed", "2000"))["meshes"][1]
    high = json.loads(run(*arguments, "--from-speed", "3200"))["meshes"][1]
    assert low["contact_loss_fraction"] == 0.0
    assert high["contact_loss_fraction"] > 0.4
    assert list(low["contact_conditions"]) == ["III"]
    assert set(high["contact_conditions"]) == {"I", "III"}


def test_json_is_strict_and_carries_units():
    values = json.loads(run(*FAST, "--speed", "2000", "--json"))
    assert values["status"] == "periodic"
    assert values["torque_Nm"] == 100.0
    mesh = values["meshes"][0]
    assert mesh["period_multiple"] == 1
    assert mesh["engaged_pairs"] == [1, 2]
    line = mesh["largest_lines"][0]
    assert line["frequency_Hz"] % 2000.0 == pytest.approx(0.0, abs=1e-6)
    assert {"dte_rms_m", "force_peak_N"} <= set(mesh)


def test_the_screen_names_conditions_and_lines():
    printed = run(*FAST, "--speed", "1440")
    for text in (
        "RMS of dynamic transmission error [um]",
        "all pairs touch",
        "periodic",
    ):
        assert text in printed


@pytest.mark.slow
@pytest.mark.parametrize("name", ["liu-idler", "liu-countershaft"])
def test_history_and_picture(tmp_path, name):
    table, plot = tmp_path / "w.csv", tmp_path / "w.png"
    arguments = (name, "--excitation", "rectangular", "--speed", 1300)
    with saved_figures() as figures:
        run(*arguments, "-o", table, "--plot", plot)
    labels = {"dynamic transmission\nerror [um]", "force [kN]", "rate [mm/s]"}
    assert labels < axis_labels(*figures)
    lines = [line for line in table.read_text().splitlines() if line[0] != "#"]
    rows = list(csv.DictReader(lines))
    assert len(rows) > 64
    assert float(rows[0]["time_s"]) == 0.0
    periods = [1300 * float(row["time_s"]) for row in rows]
    for column, unit in [("mesh1_dte_m", 1e6), ("mesh1_force_N", 1e-3)]:
        values = [unit * float(row[column]) for row in rows]
        drawn = zip(periods, values, strict=True)
        assert are_drawn(*figures, [point for point in drawn if point[0] <= 1.0])
    for mesh in (1, 2):
        pairs = [float(rows[5][f"mesh{mesh}_pair{p}_force_N"]) for p in (1, 2)]
        assert sum(pairs) == pytest.approx(float(rows[5][f"mesh{mesh}_force_N"]))


def test_finite_elements():
    values = json.loads(run("liu-pair", "--speed", "2000", "--json"))
    assert values["excitation"] == "finite elements"
    assert values["meshes"][0]["dte_rms_m"] > 0.0


def test_the_coupled_model_repeats_the_sweep():
    """The same motion at the same speed, and a pair's force in every column."""
    settings = ("liu-pair", "--torque", 100, "--model", "coupled", "--json")
    motion = json.loads(run(*settings, "--speed", 2500))
    arguments = list(map(str, (*settings, "--speeds", 2500, "--direction", "up")))
    values = json.loads(CliRunner().invoke(app, ["sweep", *arguments]).stdout)
    branch = values["branches"][0]
    assert values["natural_frequencies"] == "about the loaded state at 100 N m"
    (mesh,) = motion["meshes"]
    assert motion["model"] == "coupled"
    assert mesh["dte_rms_m"] == branch["largest"][0]["dte_rms_m"]
    assert mesh["engaged_pairs"] == [1, 2]
    assert motion["warnings"] == []


def test_the_coupled_model_warns_of_body_modes_that_it_leaves_out():
    arguments = "liu-pair", "--model", "coupled", "--speed", 9000, "--json"
    assert json.loads(run(*arguments))["warnings"] == []
    (warning,) = json.loads(run(*arguments, "--without", "modes"))["warnings"]
    assert warning.startswith("body modes that the coupled model leaves out matter")


def test_progress_tells_the_speed_on_the_way(monkeypatch):
    import fegear

    monkeypatch.setattr(sys.modules["lumped.steady.sweep"], "REPORT_INTERVAL", -1.0)
    model = fegear.LumpedModel(
        number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
    )
    gears, reports = fegear.load_gear_set("liu-pair"), []
    study = fegear.Motion(
        gear_set=gears, torque=100.0, speed=2030.0, from_speed=2000.0, model=model
    )
    fegear.run(study, progress=lambda *report: reports.append(report))
    assert reports.pop(0) == ("preparation", 0, 1)
    assert reports[0] == ("stiffness", 0, 1)
    assert [report for report in reports if report[0] == "sweep"] == [
        ("sweep", 1, 3),
        ("sweep", 2, 3),
    ]
    assert reports[1][0].startswith("2000 Hz, period ")
    assert reports[-1][0].startswith("2030 Hz, period ")
