"""`fegear branches`: table, summary, picture, and what is said on the way."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures
from typer.testing import CliRunner

import fegear
from fegear import ExcitationSettings, LumpedModel
from fegear.cli import app
from lumped.branches.branch_settings import BranchSettings
from lumped.common.csv_text import parse_csv

FAST = ("liu-idler", "--excitation", "fourier", "--excitation-harmonics", "3")
SHORT = (*FAST, "--speeds", "1300:3600", "--harmonics", "8")


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["branches", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result.stdout


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """(values of the summary, rows of the file, folder, figure)."""
    folder = tmp_path_factory.mktemp("branches")
    files = "-o", folder / "b.csv", "--plot", folder / "b.png"
    with saved_figures() as figures:
        values = run(*SHORT, "--json", *files)
    text = (folder / "b.csv").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return json.loads(values), list(csv.DictReader(lines)), folder, *figures


def test_rows_are_the_points_mesh_by_mesh(outputs):
    values, rows, _, _ = outputs
    assert list(rows[0]) == [
        *("branch", "index", "mesh_frequency_Hz", "driver_speed_rpm", "mesh"),
        *("dte_rms_m", "dte_peak_m"),
        *("stable", "floquet_max", "kind", "period_multiple"),
    ]
    assert len(rows) == 2 * sum(branch["points"] for branch in values["branches"])
    for row in rows:
        largest = float(row["floquet_max"])
        if row["kind"] == "fold":
            assert row["stable"] == "0"
        elif abs(largest - 1.0) > 1e-9:  # where the branch is vertical it is 1
            assert row["stable"] == str(int(largest < 1.0))
        assert float(row["dte_peak_m"]) > float(row["dte_rms_m"])


def test_bifurcations_stand_in_the_table_and_in_the_summary(outputs):
    values, rows, _, _ = outputs
    in_summary = {
        (number, bifurcation["kind"], bifurcation["frequency_Hz"])
        for number, branch in enumerate(values["branches"], start=1)
        for bifurcation in branch["bifurcations"]
    }
    in_table = {
        (int(r["branch"]), r["kind"], float(r["mesh_frequency_Hz"]))
        for r in rows
        if r["kind"]
    }
    assert in_summary == in_table
    assert {"fold", "period doubling"} <= {kind for _, kind, _ in in_summary}


def test_the_picture_has_the_points_of_the_table(outputs):
    _, rows, _, figure = outputs
    assert axis_labels(figure) == {
        "mesh frequency of the first mesh [Hz]",
        "mesh 1: RMS of dynamic\ntransmission error [um]",
        "mesh 2: RMS of dynamic\ntransmission error [um]",
    }
    points = [
        (float(row["mesh_frequency_Hz"]), 1e6 * float(row["dte_rms_m"]))
        for row in rows
        if not row["kind"]  # the table has a bifurcation where it is located
    ]
    assert are_drawn(figure, points)


def test_branches_are_inside_the_range_and_say_why_they_end(outputs):
    values, _, folder, _ = outputs
    for branch in values["branches"]:
        assert 1300.0 <= branch["from_Hz"] <= branch["to_Hz"] <= 3600.0
        assert branch["end"]
    text = (folder / "b.csv").read_text("utf-8")
    assert parse_csv(text, "b.csv").header["harmonics"] == "8"


@pytest.mark.slow
def test_the_screen_names_every_bifurcation(outputs):
    values, _, _, _ = outputs
    page = run(*SHORT)
    for number, branch in enumerate(values["branches"], start=1):
        assert f"branch {number}: {branch['points']} points" in page
        for bifurcation in branch["bifurcations"]:
            assert f"{bifurcation['frequency_Hz']:.2f} Hz" in page


@pytest.mark.slow
def test_harmonics_converge():
    """The fold at 1438 Hz moves less and less."""
    folds = []
    for harmonics in (6, 12, 24):
        arguments = (*FAST, "--speeds", "1300:1600", "--harmonics", harmonics, "--json")
        values = json.loads(run(*arguments, "--period-multiple", 1))
        folds.append(
            max(
                bifurcation["frequency_Hz"]
                for branch in values["branches"]
                for bifurcation in branch["bifurcations"]
                if bifurcation["kind"] == "fold"
            )
        )
    steps = np.abs(np.diff(folds))
    assert steps[1] < 0.2 * steps[0]
    assert steps[1] < 1e-4 * folds[-1]


def test_ctrl_c_keeps_the_finished_branches(tmp_path, monkeypatch):
    from lumped.branches.periodic import BranchFinder

    def interrupt(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(BranchFinder, "from_sweeps", interrupt)
    file = tmp_path / "b.csv"
    run(*FAST, "--speeds", "2000:2200", "--harmonics", 4, "-o", file, code=130)
    text = file.read_text("utf-8")
    assert "# incomplete: 1 branches before it was interrupted" in text
    assert len(text.splitlines()) > 20


def test_two_doublings_between_two_steps_are_found():
    """At little damping a multiplier passes -1 and comes back within a step."""
    arguments = ("liu-pair", "--torque", 100, "--speeds", "1000:1430")
    arguments += (
        "--model",
        1,
        "--damping-ratio",
        0.005,
        "--period-multiple",
        1,
        "--json",
    )
    values = json.loads(run(*arguments))
    doublings = [
        bifurcation["frequency_Hz"]
        for bifurcation in values["branches"][0]["bifurcations"]
        if bifurcation["kind"] == "period doubling"
    ]
    assert doublings == pytest.approx([1186.16, 1202.99], abs=0.1)


@pytest.mark.slow
def test_an_isolated_branch_is_found_from_random_states_and_closes():
    """Of a third of the speed, which no sweep meets."""
    arguments = (
        "liu-pair",
        "--excitation",
        "rectangular",
        "--damping-ratio",
        0.03,
        "--json",
    )
    arguments += ("--harmonics", 6, "--period-multiple", 3, "--speeds", "4600:7200")
    branches = {
        n: json.loads(run(*arguments, "--starts", n))["branches"] for n in (0, 40)
    }
    assert all(branch["period_multiple"] < 3 for branch in branches[0])
    (isolated,) = [b for b in branches[40] if b["period_multiple"] == 3]
    assert isolated["closed"]
    assert isolated["end"] == "the branch closed"
    assert "from a random state" in isolated["origin"]
    assert 4600.0 < isolated["from_Hz"] < isolated["to_Hz"] < 7200.0
    kinds = [bifurcation["kind"] for bifurcation in isolated["bifurcations"]]
    assert kinds == ["fold", "fold"]


OVER = (*FAST, "--over", "dynamics.damping_ratio=0.07:0.08", "--at", 1450)


@pytest.mark.slow
def test_another_figure_is_followed_at_one_speed(tmp_path, capsys):
    """Its column stands beside that of the speed, and the header says what is fixed."""
    file, plot = tmp_path / "b.csv", tmp_path / "b.png"
    arguments = (*OVER, "--harmonics", 6, "--period-multiple", 1)
    with saved_figures() as figures:
        values = json.loads(run(*arguments, "--json", "-o", file, "--plot", plot))
    assert "1450 Hz" in (page := run(*arguments))
    assert "0.07 to 0.08" in page
    assert values["over"] == "dynamics.damping_ratio"
    assert values["damping_ratio"] is None
    assert values["speed_Hz"] == 1450.0
    assert values["torque_Nm"] > 0.0
    table = parse_csv(file.read_text("utf-8"), "b.csv")
    assert table.header["speed_Hz"] == "1450"
    assert "damping ratio" not in table.header
    at = table.names.index("dynamics.damping_ratio")
    ratios = [float(cells[at]) for cells in table.rows.values()]
    assert (min(ratios), max(ratios)) == (0.07, 0.08)
    assert values["branches"][0]["from"] == 0.07
    error, kind = table.names.index("dte_rms_m"), table.names.index("kind")
    points = [
        (float(cells[at]), 1e6 * float(cells[error]))
        for cells in table.rows.values()
        if not cells[kind]
    ]
    assert are_drawn(*figures, points)


def test_the_first_lines_say_which_model_it_is_and_what_model_1_leaves_out():
    page = run("liu-idler", *FAST[1:], "--speeds", "2400:2500", "--harmonics", 8)
    study = fegear.Branches(
        gear_set="liu-idler",
        speeds=(2400.0, 2500.0),
        finding=BranchSettings(harmonics=8),
    )
    reason, line = study.prepare().notes
    assert reason == "model 1: the coupled model has no harmonic balance"
    assert line.startswith("model 1 leaves out")
    source = "model 1: the coupled model has no fourier stiffness"
    assert " ".join(page.split()).startswith(" ".join(f"{reason} {line}".split()))
    by_source = fegear.Branches(
        gear_set="liu-idler",
        speeds=(2400.0, 2500.0),
        model=LumpedModel(number="auto", excitation=ExcitationSettings(kind="fourier")),
    )
    assert by_source.prepare().notes[0] == source
    plain = fegear.Branches(gear_set="liu-idler", speeds=(2400.0, 2500.0))
    assert plain.prepare().notes == ("coupled model: nothing here needs model 1",)


def test_shooting_refuses_what_belongs_to_harmonic_balance():
    arguments = ("branches", *SHORT[:-2], "--solver", "shooting")
    for option in (("--harmonics", "8"), ("--steepness", "1")):
        result = CliRunner().invoke(app, [*arguments, *option])
        assert result.exit_code != 0
        message = f"{result.output}{result.exception}"
        assert f"{option[0]} = {option[1]}" in message
        assert "shooting integrates motions with true contact" in message
