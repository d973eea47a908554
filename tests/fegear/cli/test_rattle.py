"""`fegear rattle`: machines, quiet motion and basins, and what is said on the way."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from fegear.cli import app, run

BASIN = "rattle", "basin", "roots-scaled"
SMALL = (*BASIN, "--grid", "30", "--delta", "0.575")


def told(*words: str) -> dict:
    result = CliRunner().invoke(app, [*words, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_critical_eccentricity_of_the_built_in_pump():
    values = told("rattle", "critical", "roots-a")
    assert values["critical_eccentricity_rad"] == pytest.approx(9.378e-5, rel=1e-4)
    assert not values["quiet_motion_exists"]
    helps = values["percent_of_critical_per_percent"]
    assert helps["damping"] == pytest.approx(1.0, abs=1e-3)
    assert 0.0 < helps["stiffness"] < 0.1
    quieter = told("rattle", "critical", "roots-a", "--epsilon", "9e-5")
    assert quieter["quiet_motion_exists"]
    impact = told("rattle", "critical", "roots-a", "--kappa", "inf")
    assert impact["stiffness"] is None
    assert impact["critical_eccentricity_rad"] == pytest.approx(3e-4 / math.pi)


def test_basins_on_screen_in_files_and_for_machines(tmp_path):
    """All say the same."""
    file, plot = tmp_path / "b.npz", tmp_path / "b.png"
    values = told(*SMALL, "-o", str(file), "--plot", str(plot))
    names = [each["name"] for each in values["attractors"]]
    assert names == ["quiet", "P(1,1,0)", "P(1,2,0)", "P(2,2,1)"]
    assert sum(each["fraction"] for each in values["attractors"]) == pytest.approx(1.0)
    with np.load(file) as found:
        assert bytes(found["names"]).decode().split("\n") == names
        parts = np.bincount(found["attractor"].ravel()) / found["attractor"].size
        np.testing.assert_allclose(parts, found["fraction"])
        assert found["attractor"].shape == (30, 30)
        assert float(found["damping"]) == 0.575
    assert plot.stat().st_size > 10_000
    shown = CliRunner().invoke(app, list(SMALL)).stdout
    for each in values["attractors"]:
        assert each["name"] in shown
        assert f"{100.0 * each['fraction']:.2f}" in shown


def test_motions_that_repeat_are_listed_with_their_stability():
    values = told("rattle", "periodic", "roots-scaled", "--departures", "1")
    seen = [(each["name"], each["stable"]) for each in values["orbits"]]
    assert seen == [
        *(("P(1,1,0)", True), ("P(1,1,0)", False)),
        *[("P(1,1,1)", False)] * 2,
    ]
    assert max(each["from_construction"] or 0.0 for each in values["orbits"]) < 1e-9
    assert values["least_eccentricity_of_P(1,1,0)_rad"] == pytest.approx(
        0.05964, abs=1e-5
    )
    words = "rattle", "periodic", "roots-scaled", "--departures", "1"
    shown = CliRunner().invoke(app, words).stdout
    assert shown.count("P(1,1,0)") == 3  # the last line has one
    assert "exists from an eccentricity of 0.05964 rad on" in shown
    words = "rattle", "periodic", "roots-scaled", "--departures", "3"
    assert "P(3,3,2)" in CliRunner().invoke(app, words).stdout  # fits a narrow screen


def test_a_machine_file_is_read(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\n[machine]\ndamping = 0.6\neccentricity_rad = 0.059\n'
        "half_backlash_rad = 0.6\n"
    )
    values = told("rattle", "basin", str(path), "--grid", "10")
    assert [each["name"] for each in values["attractors"]] == ["quiet"]


WRONG = [
    ("roots-b", "neither a file nor a built-in machine"),
    ("roots-a --delta 0", "--delta = 0"),
    ("roots-a --beta -1", "--beta = -1"),
    ("roots-a --epsilon nan", "--epsilon = nan"),
    ("roots-a --kappa 0", "--kappa = 0"),
    ("roots-a --restitution 0.9", "restitution = 0.9; belongs to impacts"),
    ("roots-scaled --restitution 1.2", "--restitution = 1.2"),
    (
        "roots-scaled --velocity 3:1",
        "--velocity = 3:1; must be A:B from 0 on, two values that rise",
    ),
    (
        "roots-scaled --velocity 1",
        "--velocity = 1; must be A:B from 0 on, two values that rise",
    ),
    ("roots-scaled --grid 1000000", "1e+12 cells, allowed are 4e+07"),
    ("roots-scaled --grid 2", "--grid = 2; allowed 5 to"),
    ("roots-scaled --iterations 3", "--iterations = 3; allowed 100 to"),
    ("roots-scaled --resume", "--resume needs the --output"),
]


@pytest.mark.parametrize(("words", "message"), WRONG)
def test_what_is_wrong_is_one_line(words, message, capsys):
    assert run(["rattle", "basin", *words.split()]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_killed_run_loses_the_tiles_under_way_only(tmp_path):
    """And gives the same file when it is taken up again."""
    words = [*BASIN, "--grid", "120", "-o"]
    program = [sys.executable, "-c", "from fegear.cli import main; main()"]
    whole, file = tmp_path / "whole.npz", tmp_path / "b.npz"
    assert run([*words, str(whole)]) == 0
    going = subprocess.Popen([*program, *words, str(file)])
    kept = tmp_path / "b.npz.partial"
    until = time.monotonic() + 60.0
    while time.monotonic() < until and going.poll() is None:
        if kept.exists() and kept.stat().st_size > 150_000:
            break
        time.sleep(0.05)
    os.kill(going.pid, signal.SIGKILL)
    going.wait()
    assert not file.exists()
    assert kept.exists()
    again = subprocess.run(
        [*program, *words, str(file), "--resume"], capture_output=True, text=True
    )
    assert again.returncode == 0
    assert "tiles that are finished: " in again.stderr
    assert "finished: 0" not in again.stderr
    with np.load(whole) as one, np.load(file) as two:
        for name in one.files:
            np.testing.assert_array_equal(one[name], two[name])
    assert not kept.exists()
