"""`fegear stability`: chart, picture and interruption."""

from __future__ import annotations

import json

import pytest
from cli_commands import printed, rows_of
from drawn_figures import axis_labels, saved_figures
from matplotlib.collections import LineCollection

import fegear
from fegear.cli import run
from fegear.commands.stability import study as stability
from fegear.files.errors import InputError
from fegear.train import lumped_models
from lumped.steady.maps import Axis

COMMAND = [
    *(
        "stability",
        "liu-idler",
        "--excitation",
        "rectangular",
        "--damping-ratio",
        "0.002",
    ),
    *("--over", "friction=0:0.15:4", "--bending", "0.39", "--speeds", "1400:3600:50"),
]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stability")
    path, plot = folder / "s.csv", folder / "s.png"
    with saved_figures() as figures:
        values = printed(*COMMAND, "--json", "-o", path, "--plot", plot)
    return json.loads(values), rows_of(path), folder, *figures


def test_the_picture_has_the_intervals_over_the_parameter(outputs):
    values, rows, _, figure = outputs
    labels = {"friction", "mesh frequency of the first mesh [Hz]"}
    assert axis_labels(figure) == labels
    (axes,) = figure.axes
    frictions = {float(row["friction"]) for row in rows}
    assert any(set(line.get_xdata()) == frictions for line in axes.lines)
    drawn = {
        tuple(segment.ravel())
        for collection in axes.collections
        if isinstance(collection, LineCollection)
        for segment in collection.get_segments()
    }
    assert drawn == {
        (column["value"], interval["from_Hz"], column["value"], interval["to_Hz"])
        for column in values["columns"]
        for interval in column["intervals"]
    }
    assert drawn


def test_a_row_for_every_cell(outputs):
    _, rows, folder, _ = outputs
    assert list(rows[0]) == [
        *("mesh_frequency_Hz", "driver_speed_rpm", "friction"),
        *("floquet_max", "kind"),
    ]
    assert len(rows) == 4 * 45
    assert not list(folder.glob("*.partial"))
    for row in rows:
        assert bool(row["kind"]) == (float(row["floquet_max"]) > 1.0 + 1e-9)


def test_intervals_hold_the_unstable_cells(outputs):
    values, rows, _, _ = outputs
    for row in rows:
        (column,) = [
            c for c in values["columns"] if c["value"] == float(row["friction"])
        ]
        speed = float(row["mesh_frequency_Hz"])
        kinds = [
            interval["kind"]
            for interval in column["intervals"]
            if interval["from_Hz"] <= speed <= interval["to_Hz"]
        ]
        assert kinds == ([row["kind"]] if row["kind"] else [])


def test_methods_tell_the_same(outputs, tmp_path):
    _, rows, _, _ = outputs
    arguments = [*COMMAND[:-2], "--speeds", "1400:3600:200"]
    printed(*arguments, "--method", "exponential", "-o", tmp_path / "e.csv")
    multipliers = {
        (r["mesh_frequency_Hz"], r["friction"]): float(r["floquet_max"]) for r in rows
    }
    for row in rows_of(tmp_path / "e.csv"):
        exact = multipliers[row["mesh_frequency_Hz"], row["friction"]]
        assert float(row["floquet_max"]) == pytest.approx(exact, abs=1e-4)


def test_an_interrupted_chart_goes_on_to_the_same_bytes(outputs, tmp_path, monkeypatch):
    _, _, folder, _ = outputs
    path, scan = tmp_path / "s.csv", stability.scan_stability
    calls = []

    def stopped(*args):
        calls.append(args)
        if len(calls) > 2:
            raise KeyboardInterrupt
        return scan(*args)

    monkeypatch.setattr(stability, "scan_stability", stopped)
    printed(*COMMAND, "-o", path, code=130)
    assert "incomplete" in path.read_text("utf-8")
    monkeypatch.setattr(stability, "scan_stability", scan)
    printed(*COMMAND, "-o", path, "--resume")
    assert path.read_bytes() == (folder / "s.csv").read_bytes()


def test_the_bending_ratio_is_told_and_kept_runs_of_another_are_refused(
    outputs, tmp_path, monkeypatch, capsys
):
    values, _, folder, _ = outputs
    assert values["friction_bending_ratio"] == "0.39"
    header = (folder / "s.csv").read_text("utf-8")
    assert "# friction-bending ratio: 0.39\n" in header
    assert "# friction coefficient" not in header
    scan, calls = stability.scan_stability, []

    def stopped(*args):
        calls.append(args)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return scan(*args)

    monkeypatch.setattr(stability, "scan_stability", stopped)
    path = tmp_path / "s.csv"
    printed(*COMMAND, "-o", path, code=130)
    capsys.readouterr()
    other = [word if word != "0.39" else "0.4" for word in COMMAND]
    assert run([*other, "-o", str(path), "--resume"]) == 2
    assert "was begun with model.bending = '0.39', now '0.4'" in capsys.readouterr().err


def test_what_changes_nothing_is_told():
    arguments = ["stability", "liu-pair", "--excitation", "rectangular", "--json"]
    over = ["--over", "mesh.1.backlash_um=10,20", "--speeds", "1000:2000:500"]
    values = json.loads(printed(*arguments, *over))
    warning = "mesh.1.backlash_um does not change the multipliers [W16]"
    assert values["warnings"] == [warning]


def test_friction_bending_comes_from_the_finite_elements(monkeypatch):
    frictions = []
    with_bending = lumped_models.with_bending

    def record(excitation, friction):
        frictions.append(friction)
        return with_bending(excitation, friction)

    monkeypatch.setattr(lumped_models, "with_bending", record)
    arguments = ["stability", "liu-pair", "--over", "friction=0.1"]
    printed(*arguments, "--resolution", "coarse", "--speeds", "5000:6000:500")
    assert frictions[-1].coefficient == 0.1
    assert frictions[-1].bending == pytest.approx(0.39, abs=0.03)


def test_too_many_cells_are_refused():
    axis = Axis("friction", tuple(i / 1e5 for i in range(10_000)))
    with pytest.raises(InputError, match="4000000 cells"):
        fegear.Stability(gear_set="liu-pair", over=axis, speeds=range(1, 1001))


def test_bending_varies_without_finite_elements():
    arguments = ["stability", "liu-pair", "--over", "friction_bending=0,0.4"]
    arguments += ["--friction", "0.1", "--excitation", "rectangular", "--json"]
    arguments += ["--damping-ratio", "0.01", "--speeds", "5500:6500:100"]
    values = json.loads(printed(*arguments))
    first, second = values["columns"]
    assert first["largest_multiplier"] != second["largest_multiplier"]


def test_sweeps_and_waves_take_friction(tmp_path):
    arguments = [*("liu-pair", "--resolution", "coarse", "--torque", "100")]
    sweep = ["sweep", *arguments, "--speeds", "2000:2200:100", "--json"]
    summaries = {
        friction: json.loads(printed(*sweep, *friction.split()))
        for friction in ("", "--friction 0.1", "--friction 0.1 --bending 0")
    }
    levels = [
        summary["branches"][0]["largest"][0]["dte_rms_m"]
        for summary in summaries.values()
    ]
    assert len({round(1e9 * level, 3) for level in levels}) == 3
    coefficients = [s["friction_coefficient"] for s in summaries.values()]
    assert coefficients == [0.0, 0.1, 0.1]
    page = printed("motion", *arguments, "--speed", 2100, "--friction", 0.1)
    assert "friction 0.1, torque of gears without" in page
    options = ["--friction", "0.1", "--sliding", "instantaneous"]
    assert "friction 0.1 turned by vib" in printed(
        "motion", *arguments, "--speed", 2100, *options
    )
    values = json.loads(printed(*sweep, *options))
    assert values["sliding"] == "instantaneous"
    sliding = [summary["sliding"] for summary in summaries.values()]
    assert sliding == [None, "nominal", "nominal"]
