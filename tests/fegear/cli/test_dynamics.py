"""`fegear dynamics`: rows beside those of the lumped models."""

from __future__ import annotations

import json

import pytest
import typer
from typer.testing import CliRunner

from fegear.cli.dynamics import dynamics_command
from lumped.sweep_table import read_sweep

app = typer.Typer()
app.command("dynamics")(dynamics_command)


def test_rows_and_summary(tmp_path):
    path = tmp_path / "d.csv"
    words = ["liu-pair", "--torque", "100", "--speeds", "1000:1100:50", "-o", str(path)]
    result = CliRunner().invoke(app, [*words, "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    rows = read_sweep(str(path)).rows
    assert {row.model for row in rows} == {"quasistatic"}
    assert len(rows) == 6
    found = json.loads(result.stdout)
    assert found["speeds"] == 3
    assert [branch["direction"] for branch in found["branches"]] == ["up", "down"]


def test_up_and_down_agree_off_the_resonances(tmp_path):
    path = tmp_path / "d.csv"
    words = ["liu-pair", "--torque", "100", "--speeds", "4000", "-o", str(path)]
    CliRunner().invoke(app, words, catch_exceptions=False)
    up, down = (row.dte_rms_m for row in read_sweep(str(path)).rows)
    assert up == pytest.approx(down, rel=1e-3)
