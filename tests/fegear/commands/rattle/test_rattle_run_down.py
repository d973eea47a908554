"""`fegear rattle run-down`: units of the columns, and files that cannot be used."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from fegear.cli import app, run

TIME = np.linspace(0.0, 100.0, 50)
UNITS = {"speed_rpm": 3000.0, "speed_Hz": 50.0, "speed_rad_per_s": 100.0 * math.pi}


def written(tmp_path, name: str, speed, time=TIME) -> str:
    rows = [f"{t},{w}" for t, w in zip(time, speed, strict=True)]
    path = tmp_path / "test.csv"
    path.write_text("\n".join([f"time_s,{name}", *rows, ""]))
    return str(path)


def json_output(*arguments: str) -> dict:
    result = CliRunner().invoke(app, ["rattle", "run-down", *arguments, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.mark.parametrize("unit", UNITS)
def test_damping_is_the_rate_over_turns_per_second(tmp_path, unit):
    """3e-4 at 50 turns per second is a rate of 0.015 per second."""
    path = written(tmp_path, unit, UNITS[unit] * np.exp(-0.015 * TIME))
    values = json_output(path)
    assert values["damping"] == pytest.approx(3e-4)
    assert values["speed_at_start_rpm"] == pytest.approx(3000.0)
    assert values["drag_is_linear"]
    other = json_output(path, "--speed-rpm", "1500", "--inertia-kgm2", "0.04")
    assert other["damping"] == pytest.approx(6e-4)
    assert other["damping_coefficient_Nms_per_rad"] == pytest.approx(6e-4)
    page = CliRunner().invoke(app, ["rattle", "run-down", path]).stdout
    assert "damping 0.0003 +- " in page


def test_drag_that_does_not_go_with_the_speed_is_told(tmp_path):
    path = written(tmp_path, "speed_rpm", 3000.0 - 25.0 * TIME)
    assert not json_output(path)["drag_is_linear"]
    page = CliRunner().invoke(app, ["rattle", "run-down", path]).stdout
    assert "the drag does not go with the speed alone" in page


@pytest.mark.parametrize(
    ("name", "speed", "message"),
    [
        ("speed", [3.0, 2.0, 1.0] * 2, "columns time_s, speed; needed are time_s and"),
        ("speed_rpm", [3.0, 2.0, "x", 1.0, 1.0, 1.0], "line 4: 'x' is not a number"),
        ("speed_rpm", [3.0, 2.0, "nan", 1.0, 1.0, 1.0], "line 4: 'nan'; must be a"),
        ("speed_rpm", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "the speed does not fall"),
        ("speed_rpm", [3.0, 2.0, 1.0, 0.5, 0.2, -1.0], "speeds must be above 0"),
        ("speed_rpm", [3.0, 2.0, 1.0], "6 rows at least are needed, half"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(tmp_path, capsys, name, speed, message):
    path = written(tmp_path, name, speed, range(len(speed)))
    assert run(["rattle", "run-down", path]) == 2
    error = capsys.readouterr().err
    assert "test.csv" in error
    assert message in error
    assert error.count("\n") == 1


def test_a_speed_with_a_separator_of_thousands_is_refused(tmp_path, capsys):
    path = tmp_path / "r.csv"
    speeds = ["2,990", "2,880", "2,775", "2,674", "2,577", "2,483"]
    rows = [f"{10 * i};{speed}" for i, speed in enumerate(speeds)]
    path.write_text("\n".join(["time_s;speed_rpm", *rows, ""]))
    assert run(["rattle", "run-down", str(path)]) == 2
    assert "'2,990' may be 2.990 or 2990; write" in capsys.readouterr().err
    path.write_text(path.read_text().replace(",", ""))
    assert json_output(str(path))["speed_at_start_rpm"] == pytest.approx(
        2990.0, rel=0.01
    )
