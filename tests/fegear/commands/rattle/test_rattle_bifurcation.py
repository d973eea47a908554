"""`fegear rattle bifurcation`: what it writes, and what it counts."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli_commands import printed, rows_of
from drawn_figures import are_drawn, axis_labels, saved_figures

from lumped.rattle.machine import Machine
from lumped.rattle.periodic_orbits import min_eccentricity

COMMAND = (
    *("rattle", "bifurcation", "roots-scaled", "--over", "delta=0.57:0.62"),
    *("--starts", "1", "--runs", "6"),
)


@pytest.mark.slow
def test_branches_on_screen_in_files_and_for_machines(tmp_path):
    """All say the same."""
    file, plot = tmp_path / "b.csv", tmp_path / "b.png"
    with saved_figures() as figures:
        values = json.loads(printed(*COMMAND, "-o", file, "--plot", plot, "--json"))
    assert values["over"] == "damping"
    assert "damping" not in values
    bifurcations = {
        (branch["name"], bifurcation["kind"]): bifurcation["value"]
        for branch in values["branches"]
        for bifurcation in branch["bifurcations"]
    }
    assert bifurcations["P(2,2,1)", "period doubling"] == pytest.approx(
        0.5818, abs=1e-4
    )
    assert bifurcations["P(4,4,2)", "grazing"] == pytest.approx(0.5922, abs=1e-4)
    assert "# stiffness: impacts" in file.read_text()
    rows = rows_of(file)
    for number, branch in enumerate(values["branches"], start=1):
        points = [row for row in rows if row["branch"] == str(number)]
        assert {row["name"] for row in points} == {branch["name"]}
        assert len({row["index"] for row in points}) == branch["points"]
        departures = int(branch["name"][2:-1].split(",")[1])
        assert len(points) == departures * branch["points"]
        in_table = {
            (row["kind"], float(row["damping"])) for row in points if row["kind"]
        }
        assert in_table == {(e["kind"], e["value"]) for e in branch["bifurcations"]}
    runs = [row for row in rows if row["branch"] == "0"]
    assert len(runs) == values["liftoffs_of_long_runs"] > 0
    assert {row["stable"] for row in runs} == {""}
    assert values["undecided_long_runs"] == 0
    assert not values["warnings"]
    stable = {
        round(float(row["speed_rad_per_turn"]), 1)
        for row in rows
        if row["stable"] == "1" and row["branch"] != "0"
    }
    assert {round(float(r["speed_rad_per_turn"]), 1) for r in runs} & stable
    assert "speed of lift-off [rad per turn]" in axis_labels(*figures)
    points = [(float(r["damping"]), float(r["speed_rad_per_turn"])) for r in rows]
    assert are_drawn(*figures, points)
    page = printed(*COMMAND)
    for branch in values["branches"]:
        assert branch["name"] in page
        for bifurcation in branch["bifurcations"]:
            assert f"{bifurcation['value']:.7g}  {bifurcation['kind']}" in page


def test_long_runs_that_have_not_settled_are_counted(monkeypatch, tmp_path):
    from fegear.commands.rattle import orbit_search as bifurcation

    rows = np.array([[0.25, 4.0], [np.nan, np.nan], [np.nan, np.nan]])
    monkeypatch.setattr(bifurcation, "settled_departures", lambda *args: rows)
    file = tmp_path / "b.csv"
    options = "--max-liftoffs", "1", "--doublings", "0"
    values = json.loads(printed(*COMMAND, *options, "-o", file, "--json"))
    assert values["liftoffs_of_long_runs"] == 6
    assert values["undecided_long_runs"] == 12
    (warning,) = values["warnings"]
    assert warning.startswith("12 long runs that reached no attractor are left out")
    assert warning.endswith("at damping from 0.574167 to 0.615833 [W24]")
    runs = [row for row in rows_of(file) if row["branch"] == "0"]
    assert [row["speed_rad_per_turn"] for row in runs] == 6 * ["4.0"]


@pytest.mark.slow
def test_branches_do_not_depend_on_how_wide_the_range_is():
    fixed = "roots-scaled --max-liftoffs 1 --doublings 0 --runs 0 --starts 3 --json"
    bifurcations = []
    for limits in ("0:1", "0.85:1"):
        over = f"rattle bifurcation {fixed} --over restitution={limits}"
        values = json.loads(printed(*over.split()))
        bifurcations.append(
            sorted(
                (branch["name"], bifurcation["kind"], round(bifurcation["value"], 6))
                for branch in values["branches"]
                for bifurcation in branch["bifurcations"]
            )
        )
    assert bifurcations[0] == bifurcations[1]
    assert ("P(1,1,1)", "fold", 0.903158) in bifurcations[0]


@pytest.mark.slow
def test_curves_over_two_figures(tmp_path):
    arguments = [
        *("rattle", "bifurcation", "roots-scaled", "--over", "delta=0.55:0.8"),
        *("--over", "epsilon=0.05:0.15", "--starts", "2", "--max-liftoffs", "1"),
        *("--doublings", "0"),
    ]
    file, plot = tmp_path / "c.csv", tmp_path / "c.png"
    with saved_figures() as figures:
        values = json.loads(printed(*arguments, "-o", file, "--plot", plot, "--json"))
    assert values["over"] == ["damping", "eccentricity_rad"]
    curves = {
        (curve["name"], curve["bifurcation"]): curve for curve in values["curves"]
    }
    assert {("P(1,1,0)", "grazing"), ("P(1,1,0)", "fold")} <= curves.keys()
    (meeting,) = curves["P(1,1,0)", "fold"]["meetings"]
    assert meeting["kind"] == "grazing fold"
    assert meeting["at"] == pytest.approx([0.77015, 0.09789], abs=1e-5)
    rows = rows_of(file)
    assert len(rows) == sum(curve["points"] for curve in values["curves"])
    folds = [
        (float(row["damping"]), float(row["eccentricity_rad"]))
        for row in rows
        if (row["name"], row["bifurcation"]) == ("P(1,1,0)", "fold")
    ]
    for damping, eccentricity in folds:
        machine = Machine(damping=damping, eccentricity=0.1, half_backlash=0.6)
        assert eccentricity == pytest.approx(min_eccentricity(machine), rel=1e-8)
    points = [(float(r["damping"]), float(r["eccentricity_rad"])) for r in rows]
    assert are_drawn(*figures, points)
