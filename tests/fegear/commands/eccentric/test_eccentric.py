"""`fegear eccentric`: curves, drawings, meshes, contact and films."""

from __future__ import annotations

import csv
import json
import math
from itertools import groupby

import ezdxf
import meshio
import numpy as np
import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures
from PIL import Image
from typer.testing import CliRunner

from fegear.cli import app

WHEELS = ("eccentric", "--radius", 20, "--eccentricity", 6)
TOOTHED = (*WHEELS, "--ratio", 2, "--pressure-angle", 20, "--teeth", 30)
CURVES = [
    *("driver_pitch", "driver_base", "driven_pitch", "driven_base"),
    *("driver_tooth", "driven_tooth"),
]


def invoked(*arguments: object) -> str:
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert result.exit_code == 0, result.output
    return result.stdout


def test_points_of_all_curves(tmp_path):
    values = json.loads(invoked(*TOOTHED, "-o", tmp_path / "w.csv", "--json"))
    lines = (tmp_path / "w.csv").read_text("utf-8").splitlines()
    header = dict(line[2:].split(": ", 1) for line in lines if line.startswith("#"))
    distance = float(header["center_distance_mm"])
    assert distance == pytest.approx(values["center_distance_mm"], rel=1e-11)
    burmester = float(header["burmester_center_distance_mm"])
    assert burmester == pytest.approx(60.0)  # ratio 2 has no correction
    assert header["feasible"] == "True"
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert list(rows[0]) == ["curve", "index", "x_mm", "y_mm"]
    curves = {
        k: list(group) for k, group in groupby(rows, key=lambda row: row["curve"])
    }
    assert list(curves) == CURVES
    for name, curve in curves.items():
        assert [int(row["index"]) for row in curve] == list(range(len(curve)))
        points = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in curve])
        np.testing.assert_allclose(points[0], points[-1], atol=1e-9)
        if name.endswith("pitch"):
            length = np.hypot(*np.diff(points, axis=0).T).sum()
            turns = 2 if name.startswith("driven") else 1
            assert length == pytest.approx(40.0 * math.pi * turns, rel=1e-4)
    farthest = [
        max(math.hypot(float(row["x_mm"]), float(row["y_mm"])) for row in curves[name])
        for name in ("driver_pitch", "driven_pitch")
    ]
    assert farthest == pytest.approx([26.0, distance - 14.0], rel=1e-9)


def test_without_teeth_curves_and_whether_they_are_feasible(tmp_path):
    arguments = ("eccentric", "--radius", 1, "--eccentricity", 0.627)
    for angle, feasible in ((22, True), (28, False)):
        values = json.loads(invoked(*arguments, "--pressure-angle", angle, "--json"))
        assert values["feasible"] is feasible
    assert values["reason"] == "the base curve has cusps and cuts itself"
    text = invoked(*arguments, "--pressure-angle", 28, "-o", tmp_path / "w.csv")
    assert "not feasible: the base curve has cusps" in text
    assert "driver_tooth" not in (tmp_path / "w.csv").read_text()


def test_drawings_to_scale(tmp_path):
    for name in ("w.svg", "w.dxf"):
        first = (
            invoked(*TOOTHED, "-o", tmp_path / name) and (tmp_path / name).read_bytes()
        )
        invoked(*TOOTHED, "-o", tmp_path / name)
        assert (tmp_path / name).read_bytes() == first
    drawing = ezdxf.readfile(tmp_path / "w.dxf")
    assert drawing.units == ezdxf.units.MM
    lines = {line.dxf.layer: line for line in drawing.modelspace()}
    assert list(lines) == CURVES
    assert all(line.closed for line in lines.values())
    pitch = np.array(list(lines["driver_pitch"].vertices()))
    assert np.ptp(pitch, axis=0) == pytest.approx([40.0, 40.0], rel=1e-4)
    svg = (tmp_path / "w.svg").read_text()
    width = float(svg.split('width="')[1].split("pt")[0])
    points = svg.split('d="M')[5].count("L")  # of the driver's teeth, none left out
    assert points > 1000
    reach = 26.0 + 60.0 + 46.0 + 2.0 * 4.0 / 3.0  # [mm], two lobes, teeth at all ends
    assert 25.4 / 72.0 * width == pytest.approx(1.1 * reach, rel=1e-3)


def test_meshes_of_both_wheels(tmp_path):
    invoked(*TOOTHED, "--bore", 3, "--resolution", "coarse", "-o", tmp_path / "w.msh")
    mesh = meshio.read(tmp_path / "w.msh")
    wheel = mesh.cell_data["wheel"][0]
    assert set(wheel) == {0, 1}
    points = mesh.points[np.unique(mesh.cells[0].data[wheel == 0])][:, :2]
    assert np.hypot(*points.T).min() == pytest.approx(3e-3, rel=1e-6)


@pytest.mark.slow
def test_contact_over_a_turn(tmp_path):
    table, plot = tmp_path / "c.csv", tmp_path / "c.png"
    arguments = (*WHEELS, "--teeth", 24, "--torque", 10, "--positions", 12)
    with saved_figures() as figures:
        printed = invoked(*arguments, "--contact", table, "--plot", plot, "--json")
    values = json.loads(printed)["contact"]
    rows = list(
        csv.DictReader(
            line for line in table.read_text().splitlines() if line[0] != "#"
        )
    )
    assert len(rows) == values["positions"] == 12
    errors = [float(row["transmission_error_um"]) for row in rows]
    assert values["mean_transmission_error_um"] == pytest.approx(np.mean(errors))
    assert values["largest_deviation_of_torque_ratio"] < 1e-3
    assert "transmission error\non the line of action [um]" in axis_labels(*figures)
    angles = [float(row["driver_angle_deg"]) for row in rows]
    assert are_drawn(*figures, list(zip(angles, errors, strict=True)))
    (warning,) = values["warnings"]
    assert warning.startswith("positions = 12 is less than 4 for each of the 24")
    doubled = (*arguments[:-3], 20, *arguments[-2:], "--json")
    double = json.loads(invoked(*doubled))["contact"]
    # Hertzian contact is stiffer under more load, the wheels are not
    growth = double["mean_transmission_error_um"] / values["mean_transmission_error_um"]
    assert 1.8 < growth < 2.0
    wide = json.loads(invoked(*arguments, "--face-width", 20, "--json"))["contact"]
    half = wide["mean_transmission_error_um"] / values["mean_transmission_error_um"]
    assert half == pytest.approx(1.0 / growth, rel=0.02)


def test_a_film_of_a_turn(tmp_path):
    invoked(*WHEELS, "--animate", tmp_path / "w.gif")
    film = Image.open(tmp_path / "w.gif")
    assert film.n_frames == 60
    film.seek(30)
    assert len(film.convert("RGB").getcolors(10_000)) > 10


@pytest.mark.slow
def test_a_deflection_that_is_not_small_is_told():
    arguments = (*WHEELS, "--teeth", 24, "--torque", 1e6, "--positions", 1)
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert result.exit_code == 0
    assert "exceeds a tenth of the module" in result.stderr
    assert "contact pressure" in result.stderr
