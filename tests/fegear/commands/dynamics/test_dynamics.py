"""`fegear dynamics`: rows beside those of the lumped models, kept through kills."""

from __future__ import annotations

import csv
import json
import sqlite3
import subprocess
import sys
from contextlib import closing
from importlib import resources

import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures
from ended_runs import killed_after
from typer.testing import CliRunner
from written_tables import read_sweep

import fegear
from fegear.cli import app

MAIN = [sys.executable, "-c", "from fegear.cli import main; main()"]
PAIR = ["dynamics", "liu-pair", "--torque", "100", "--fidelity", "quasistatic"]


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments), catch_exceptions=False)


def test_rows_and_summary(tmp_path):
    path = tmp_path / "d.csv"
    result = run(*PAIR, "--speeds", "1000:1100:50", "-o", str(path), "--json")
    assert result.exit_code == 0
    table = read_sweep(str(path))
    assert {row.model for row in table.rows} == {"quasistatic"}
    assert len(table.rows) == 6
    assert table.header["fidelity"] == "quasistatic"
    summary = json.loads(result.stdout)
    assert summary["speeds"] == 3
    assert summary["natural_frequencies"] == "about the loaded state at 100 N m"
    assert [branch["direction"] for branch in summary["branches"]] == ["up", "down"]
    assert not (tmp_path / "d.csv.partial").exists()


def test_up_and_down_agree_off_the_resonances(tmp_path):
    path = tmp_path / "d.csv"
    run(*PAIR, "--speeds", "4000", "-o", str(path))
    up, down = (row.dte_rms_m for row in read_sweep(str(path)).rows)
    assert up == pytest.approx(down, rel=1e-3)


def test_auto_tells_what_it_chose_and_why():
    arguments = ["dynamics", "liu-pair", "--torque", "100", "--direction", "up"]
    slow, fast = (
        " ".join(run(*arguments, "--speeds", speed).stdout.split())
        for speed in ("100", "2500")
    )
    assert fast.startswith("100 N m, reduced: elastic inertia changes")
    assert "allowed are 2 %" in fast
    assert "kHz are kept" in fast
    sentence = fast[: fast.index("kHz are kept")]
    assert slow.startswith(sentence), "it does not depend on the speeds asked for"


def test_history_and_root_stress(tmp_path):
    folder = tmp_path / "h"
    options = ["--speeds", "2500", "--direction", "up", "--history", str(folder)]
    result = run(*PAIR, *options, "--root-stress", "pinion")
    assert result.exit_code == 0
    (path,) = folder.iterdir()
    assert path.name == "100Nm_up_2500Hz.csv"
    lines = path.read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert len(rows) == 129
    largest = max(float(row["pinion_mesh1_tooth0_root_stress_Pa"]) for row in rows)
    assert 1e7 < largest < 2e8
    for row in rows:
        pairs = [v for k, v in row.items() if "_pair" in k and k.endswith("load_N")]
        assert sum(map(float, pairs)) == pytest.approx(float(row["mesh1_force_N"]))


def test_model_1_beside(tmp_path):
    table, picture = str(tmp_path / "d.csv"), str(tmp_path / "d.png")
    options = ["--speeds", "2400:2600:100", "--model-1", "-o", table]
    with saved_figures() as figures:
        result = run(*PAIR, *options, "--plot", picture, "--json")
    summary = json.loads(result.stdout)
    assert len(summary["model_1_branches"]) == 2
    assert axis_labels(*figures) == {
        "mesh frequency [Hz]",
        "mesh 1: RMS of dynamic\ntransmission error [um]",
    }
    rows = read_sweep(table).rows
    points = [(row.mesh_frequency_Hz, 1e6 * row.dte_rms_m) for row in rows]
    for branch in summary["model_1_branches"]:
        (largest,) = branch["largest"]
        points.append((largest["frequency_Hz"], 1e6 * largest["dte_rms_m"]))
    assert are_drawn(*figures, points)


def test_unknown_gear_for_root_stress(tmp_path):
    options = ["--speeds", "1000", "--history", str(tmp_path), "--root-stress", "moon"]
    process = subprocess.run([*MAIN, *PAIR, *options], capture_output=True, text=True)
    assert process.returncode == 2
    assert "--root-stress = moon; allowed are pinion, idler" in process.stderr


def finished_in(partial):
    """Speeds in a checkpoint that no process holds."""
    with closing(sqlite3.connect(partial)) as connection:
        return connection.execute("select count(*) from speeds").fetchone()[0]


@pytest.mark.slow
def test_killed_and_resumed_gives_the_same_file(tmp_path):
    arguments = [*PAIR, "--speeds", "1000:1400:10", "-o"]
    whole, killed = tmp_path / "whole.csv", tmp_path / "killed.csv"
    assert run(*arguments, str(whole)).exit_code == 0
    command = [*MAIN, *arguments, str(killed), "--resume"]
    partial = tmp_path / "killed.csv.partial"
    for records in (4, 27):
        killed_after(records, command[len(MAIN) :])
        assert not killed.exists(), "killed before the end"
    assert finished_in(partial) > 30
    for _ in range(2):  # resuming is safe to repeat
        assert subprocess.run(command, stdout=subprocess.DEVNULL).returncode == 0
        assert killed.read_bytes() == whole.read_bytes()
        assert not partial.exists()


@pytest.mark.slow
def test_resuming_tells_what_is_left_and_what_is_computed_again(tmp_path):
    path = tmp_path / "d.csv"
    partial = tmp_path / "d.csv.partial"
    arguments = [*PAIR, "--speeds", "1000:1400:10", "--direction", "up"]
    arguments += ["-o", str(path)]
    killed_after(4, arguments)
    with closing(sqlite3.connect(partial)) as connection, connection:
        connection.execute("update speeds set content = x'00' where number = 1")
    command = [*MAIN, *arguments, "--resume"]
    resumed = subprocess.run(command, capture_output=True, text=True)
    assert "d.csv.partial: 0 of 41 speeds are finished" in resumed.stderr
    assert "damaged and computed again" in resumed.stderr
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.returncode == 0
    assert f"there is no {partial}, {path} is finished and is computed" in again.stderr


@pytest.mark.slow
def test_a_cut_off_below_all_modes_is_refused():
    options = ["--fidelity", "reduced", "--speeds", "2000", "--cutoff", "10"]
    process = subprocess.run(
        [*MAIN, *PAIR[:2], *options], capture_output=True, text=True
    )
    assert process.returncode == 2
    assert "--cutoff = 10; no elastic mode" in process.stderr


@pytest.mark.slow
def test_a_checkpoint_of_other_gears_or_histories_is_refused(tmp_path):
    text = (resources.files("fegear.gearset") / "sets" / "liu-pair.toml").read_text()
    gear_set, path = tmp_path / "own.toml", tmp_path / "d.csv"
    gear_set.write_text(text)
    arguments = ["dynamics", str(gear_set), *PAIR[2:], "--speeds", "1000:1400:10"]
    arguments += ["--direction", "up", "-o", str(path)]
    killed_after(2, arguments)
    history = ["--history", str(tmp_path / "h")]
    process = subprocess.run(
        [*MAIN, *arguments, *history, "--resume"], capture_output=True, text=True
    )
    assert process.returncode == 2
    assert "history" in process.stderr
    assert "teeth = 55" in text
    gear_set.write_text(text.replace("hub_radius_mm = 42", "hub_radius_mm = 43"))
    process = subprocess.run(
        [*MAIN, *arguments, "--resume"], capture_output=True, text=True
    )
    assert process.returncode == 2
    assert "was begun with gear_set" in process.stderr


def test_torques_that_differ_little_are_branches_of_their_own(tmp_path):
    path = tmp_path / "d.csv"
    options = ["--torque", "100.00001", "--speeds", "2500", "-o", str(path)]
    assert run(*PAIR, *options).exit_code == 0
    assert {row.torque_Nm for row in read_sweep(str(path)).rows} == {100.0, 100.00001}


def test_a_second_curve_that_is_interrupted_is_not_complete():
    """Those of --model-1, which are computed last."""
    labels = []

    def progress(label: str, done: int, total: int) -> None:
        labels.append(label)
        if labels.count("sweep") == 3:
            raise KeyboardInterrupt

    study = fegear.Dynamics(
        gear_set="liu-pair",
        torque=[100.0],
        speeds=[1000.0, 1050.0],
        direction="up",
        elements=fegear.FiniteElements(fidelity="quasistatic"),
        model_1=True,
    )
    result = fegear.run(study, progress=progress, workers=1)
    ((_, branch),), ((_, second),) = result.branches, result.beside
    assert branch.complete
    assert not second.responses
    assert second.interrupted
    assert not result.complete
    assert not result.failure
