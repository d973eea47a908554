"""The command line as a user meets it: files, exit codes, one-line errors."""

from __future__ import annotations

import csv
import json
import logging
import os
import subprocess
import sys

import numpy as np
import pytest

from fegear.cli import Announcer
from fegear.statics.mesh_result import ERROR_FACTOR
from lumped import read_table


def fegear(*argv, cwd=None, **env):
    """Run the installed command in a process of its own."""
    code = "from fegear.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, argv)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=os.environ | env,
        timeout=300,
    )


@pytest.fixture(scope="module")
def summary():
    process = fegear("stiffness", "--json")
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def test_default_job_gives_the_printed_stiffness(summary):
    middle = summary["torques"][1]
    assert [row["torque_Nm"] for row in summary["torques"]] == [50.0, 100.0, 150.0]
    assert summary["positions"] == 64
    assert middle["mean_stiffness_N_per_m"] == pytest.approx(2.98e8, rel=0.015)
    assert 0.28 < middle["peak_to_peak_over_mean"] < 0.40
    assert summary["contact_ratio"] == pytest.approx(1.504, abs=1e-6)


def test_summary_carries_its_evidence(summary):
    evidence = summary["evidence"]
    assert evidence["discretisation_ste_mean"] < ERROR_FACTOR * 1e-3
    assert evidence["discretisation_ste_path"] < ERROR_FACTOR * 2e-3
    assert evidence["discretisation_ste_corner"] < ERROR_FACTOR * 1e-2
    assert evidence["complementarity_residual"] < 1e-12
    assert {"solving"} <= set(summary["seconds"])


@pytest.mark.slow
def test_second_mesh_of_the_idler_set(tmp_path):
    table, plot = tmp_path / "t.csv", tmp_path / "t.png"
    process = fegear("stiffness", "liu-idler", "--mesh", 2, "-o", table, "--plot", plot)
    assert process.returncode == 0, process.stderr
    mean = read_table(table)["stiffness_N_per_m"][1].mean()
    assert mean == pytest.approx(3.21e8, rel=0.015)
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.csv", "t.png"]


@pytest.mark.slow
def test_table_columns_and_rows(tmp_path):
    path = tmp_path / "t.csv"
    process = fegear(
        "stiffness", "--torque", 80, "--torque", 40, "--positions", 8, "-o", path
    )
    assert process.returncode == 0, process.stderr
    lines = [x for x in path.read_text().splitlines() if not x.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert [float(r["torque_Nm"]) for r in rows] == [80.0] * 8 + [40.0] * 8
    assert [float(r["position"]) for r in rows[:8]] == [i / 8 for i in range(8)]
    names = (
        "n_pairs stiffness_N_per_m local_stiffness_N_per_m ste_m nlte_m "
        "max_pressure_Pa friction_bending_ratio pair1_stiffness_N_per_m "
        "pair1_load_share pair1_gap_m pair2_stiffness_N_per_m"
    )
    assert set(names.split()) <= set(rows[0])
    shares = [float(r["pair1_load_share"]) + float(r["pair2_load_share"]) for r in rows]
    np.testing.assert_allclose(shares, 1.0, rtol=1e-12)


@pytest.mark.slow
def test_output_is_deterministic(tmp_path):
    files = [tmp_path / name for name in ("a.csv", "b.csv", "a.png", "b.png")]
    for table, plot in (files[::2], files[1::2]):
        process = fegear("stiffness", "--positions", 16, "-o", table, "--plot", plot)
        assert process.returncode == 0, process.stderr
    assert files[0].read_bytes() == files[1].read_bytes()
    assert files[2].read_bytes() == files[3].read_bytes()


@pytest.mark.slow
def test_two_runs_share_an_empty_cache(tmp_path):
    env = os.environ | {"FEGEAR_CACHE_DIR": str(tmp_path / "cache")}
    code = "from fegear.cli import main; main()"
    command = [sys.executable, "-c", code, "stiffness", "--positions", "8", "-o"]
    running = [
        subprocess.Popen(
            [*command, str(tmp_path / f"{i}.csv")], env=env, stdout=subprocess.DEVNULL
        )
        for i in range(2)
    ]
    assert [process.wait(timeout=300) for process in running] == [0, 0]
    one, two = (read_table(tmp_path / f"{i}.csv") for i in range(2))
    assert one == two


@pytest.mark.slow
def test_a_full_disk_is_one_line(tmp_path):
    process = fegear("stiffness", "--positions", "2", "-o", "/dev/full", cwd=tmp_path)
    assert process.returncode == 2
    assert process.stderr.startswith("fegear: /dev/full: cannot be written, no space")


def test_debug_shows_the_traceback(tmp_path):
    process = fegear("stiffness", "--torque", "-5", "--debug", cwd=tmp_path)
    assert process.returncode != 0
    assert "Traceback" in process.stderr


@pytest.mark.parametrize(
    "command", ["stiffness", "show", "sets", "compare", "mesh", "bench"]
)
def test_every_command_has_help(command):
    process = fegear(command, "--help")
    assert process.returncode == 0
    assert "Usage" in process.stdout


def test_compare_prints_both_slopes():
    process = fegear("compare", "--json")
    assert process.returncode == 0, process.stderr
    rows = json.loads(process.stdout)["comparisons"]
    assert {"average", "local"} <= {row["slope"] for row in rows}
    hertz = [row for row in rows if row["oracle"].startswith("Hertz")]
    assert [row["plane"] for row in hertz] == ["stress", "strain"]
    assert all(abs(row["per_cent"]) < 0.5 for row in hertz)
    single = next(row for row in rows if row["quantity"].startswith("one pair"))
    assert abs(single["per_cent"]) < 10.0


@pytest.mark.slow
def test_mesh_command_writes_a_whole_gear(tmp_path):
    import meshio

    path = tmp_path / "gear.vtu"
    process = fegear("mesh", "--whole", "--resolution", "coarse", "-o", path)
    assert process.returncode == 0, process.stderr
    assert meshio.read(path).cells_dict["triangle6"].shape[0] % 38 == 0


def test_missing_system_library_is_a_message(tmp_path):
    (tmp_path / "gmsh.py").write_text("raise OSError('libGLU.so.1: cannot open')\n")
    env = {"PYTHONPATH": str(tmp_path), "FEGEAR_CACHE_DIR": str(tmp_path / "cache")}
    process = fegear("stiffness", **env)
    assert process.returncode == 1
    assert "libGLU.so.1" in process.stderr
    assert "apt-get install" in process.stderr
    assert "Traceback" not in process.stderr


@pytest.mark.slow
def test_compiling_for_the_first_use_is_said(tmp_path):
    """Once, and not when the kernels are found in the cache."""
    argv = ("modes", "liu-pair", "--stiffness", "fe")
    environment = {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    stderr = [fegear(*argv, **environment).stderr for _ in range(2)]
    assert stderr[0].count("compiling numerical kernels for the first use") == 1
    assert "compiling" not in stderr[1]


def test_what_kernels_log_is_a_line_on_the_error_stream(capsys):
    record = logging.makeLogRecord({"msg": "set NUMBA_CACHE_DIR", "args": ()})
    Announcer().emit(record)
    assert capsys.readouterr().err == "fegear: set NUMBA_CACHE_DIR\n"


def test_a_contact_that_is_not_solved_ends_with_one_line(monkeypatch, capsys):
    import fegear.cli as cli
    from fegear.contact.problem import ContactFailure

    def fail(*_, **__):
        raise ContactFailure("contact not solved at torque 1e9 N m")

    monkeypatch.setattr(cli, "app", fail)
    assert cli.run(["stiffness"]) == 1
    assert capsys.readouterr().err == "fegear: contact not solved at torque 1e9 N m\n"
