"""`fegear bifurcations`: table, summary, picture, interruption and resuming."""

from __future__ import annotations

import json
import math

import pytest
from cli_commands import printed, rows_of
from drawn_figures import are_drawn, axis_labels, saved_figures

CHAPTER_3 = [
    *("liu-idler", "--torque", "100", "--excitation", "rectangular"),
    *("--set", "gear.2.inertia_kg_m2=3.27e-3", "--set", "mesh.2.phase=-0.125"),
    *("--set", "mesh.1.contact_ratio=1.5", "--set", "mesh.2.contact_ratio=1.5"),
]
SPEEDS = "mesh_frequency_Hz=1570,1620,1660"
COMMAND = ["bifurcations", *CHAPTER_3, "--sections", "30"]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bifurcations")
    path, plot = folder / "b.csv", folder / "b.png"
    files = "-o", path, "--plot", plot
    with saved_figures() as figures:
        values = printed(*COMMAND, "--over", SPEEDS, "--json", *files)
    return json.loads(values), rows_of(path), folder, *figures


def test_rows_are_points_of_the_sections_mesh_by_mesh(outputs):
    _, rows, folder, _ = outputs
    assert list(rows[0]) == [
        *("mesh_frequency_Hz", "driver_speed_rpm", "direction", "mesh"),
        *("section", "dte_m"),
        *("dte_rate_m_per_s", "motion", "period_multiple", "lyapunov_per_period"),
        "lyapunov_stderr_per_period",
    ]
    for direction in ("up", "down"):
        for speed in ("1570.0", "1620.0", "1660.0"):
            points = [
                row
                for row in rows
                if (row["direction"], row["mesh_frequency_Hz"]) == (direction, speed)
            ]
            multiple = int(points[0]["period_multiple"])
            assert len(points) == 2 * (multiple or 30)
            assert (points[0]["motion"] == "periodic") == (multiple > 0)
    assert not list(folder.glob("*.partial"))


def test_the_picture_has_the_sections_and_exponents_of_the_table(outputs):
    _, rows, _, figure = outputs
    assert axis_labels(figure) == {
        "mesh frequency of the first mesh [Hz]",
        "mesh 1: dynamic transmission\nerror at sections [um]",
        "mesh 2: dynamic transmission\nerror at sections [um]",
        "largest Lyapunov\nexponent [1/period]",
    }
    speeds = [float(row["mesh_frequency_Hz"]) for row in rows]
    for column, unit in [("dte_m", 1e6), ("lyapunov_per_period", 1.0)]:
        values = [unit * float(row[column]) for row in rows]
        assert are_drawn(figure, list(zip(speeds, values, strict=True)))


def test_the_summary_names_doublings_and_chaos(outputs):
    values, rows, _, _ = outputs
    down = values["branches"][1]
    assert down["direction"] == "down"
    transitions = [(s["first"], s["motion"], s["begins_by"]) for s in down["stretches"]]
    assert transitions == [
        (1660.0, "period 1", ""),
        (1620.0, "period 2", "period doubling"),
        (1570.0, "chaotic", "chaos begins"),
    ]
    largest = max(s["largest_lyapunov_per_period"] for s in down["stretches"])
    exponents = [
        float(r["lyapunov_per_period"]) for r in rows if r["direction"] == "down"
    ]
    assert largest == max(exponents)
    page = printed(
        *COMMAND, "--over", "mesh_frequency_Hz=1620,1660", "--direction", "down"
    )
    assert "period doubling" in page


def test_another_figure_stands_in_the_table_by_its_key(tmp_path):
    path, key = tmp_path / "b.csv", "mesh.2.backlash_um"
    over = ("--over", f"{key}=100,200", "--at", 1620, "--direction", "up")
    values = json.loads(printed(*COMMAND, *over, "--json", "-o", path))
    assert (values["over"], values["speed_Hz"]) == (key, 1620.0)
    rows = rows_of(path)
    assert [float(row[key]) for row in rows[::4]] == [100.0, 200.0]
    assert "# speed_Hz: 1620" in path.read_text("utf-8")


LONG_PERIOD = """name = "long-period"
defaults = {{module_mm = 2.0, face_width_mm = 10.0, hub_radius_mm = 5.0}}
load = {{gear = "a", torques_Nm = [100.0]}}
dynamics = {{damping_ratio = 0.2}}
gear = [{gears}]
[[mesh]]
driver = "a"
driven = "b"
operating_pressure_angle_deg = 21.0
backlash_um = 100.0
mean_stiffness_N_per_m = 2e8
stiffness_variation = 0.3
"""


def test_changes_that_decay_to_nothing_have_their_exponent(tmp_path):
    """Both multipliers of one damped mode have one size, exp(-zeta omega T)."""
    gears = ", ".join(
        f'{{name = "{name}", teeth = {teeth}, pitch_errors_um = '
        f"[2.0{', 0.0' * (teeth - 1)}]}}"
        for name, teeth in (("a", 23), ("b", 26))
    )
    path = tmp_path / "set.toml"
    path.write_text(LONG_PERIOD.format(gears=gears))
    options = ("--excitation", "rectangular", "--direction", "up", "--json")
    over = "mesh_frequency_Hz=1500,1600"
    values = json.loads(printed("bifurcations", path, *options, "--over", over))
    (stretch,) = values["branches"][0]["stretches"]
    decay = -2.0 * math.pi * 0.2 * 11086.07 / 1600.0
    exponent = stretch["largest_lyapunov_per_period"]
    assert exponent == pytest.approx(decay, rel=5e-3)
