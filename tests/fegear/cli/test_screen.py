"""What is seen: numbers, widths, titles, one word for a unit."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fegear.cli import run
from fegear.rendering.labels import BAR_LETTERS, legend
from fegear.rendering.look import COLOURS, RenderStyle
from fegear.studies.page import number
from fegear.studies.page_text import ruled_table, screen
from lumped.figures.drawing import draw_legend, draw_title, panels

ROOT = Path(__file__).parents[3]
RECTANGULAR = ["liu-pair", "--excitation", "rectangular"]
GEAR = '[[gear]]\nname = "gear number {i}"\nteeth = {teeth}\n'
MESH = (
    '[[mesh]]\ndriver = "gear number {i}"\ndriven = "gear number {next}"\n'
    "operating_pressure_angle_deg = 21\n"
)


@pytest.mark.parametrize(
    ("value", "figures", "shown"),
    [
        (-8.67e-13, 5, "0"),
        (0.0, 5, "0"),
        (3.14159265, 4, "3.142"),
        (0.05, 3, "0.0500"),
        (12345.678, 4, "12346"),
        (99999.0, 2, "99999"),
        (3.9678e9, 4, "3.968e+09"),
        (-4.2e-6, 3, "-4.2e-06"),
        (float("nan"), 4, "nan"),
        (float("inf"), 4, "inf"),
    ],
)
def test_numbers(value, figures, shown):
    assert number(value, figures) == shown


@pytest.mark.parametrize("width", [80, 120])
def test_no_number_of_ten_gears_is_split(monkeypatch, capsys, tmp_path, width):
    monkeypatch.setenv("COLUMNS", str(width))
    text = 'name = "ten"\n[defaults]\nmodule_mm = 2.54\nface_width_mm = 20.123\n'
    text += "hub_radius_mm = 8\n"
    text += "".join(GEAR.format(i=i, teeth=30 + i) for i in range(10))
    text += "".join(MESH.format(i=i, next=i + 1) for i in range(9))
    path = tmp_path / "ten.toml"
    path.write_text(text)
    assert run(["show", str(path), "--json"]) == 0
    gears = json.loads(capsys.readouterr().out)["gears"]
    assert run(["show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    tokens = " ".join(lines).split()
    for gear in gears:
        for name in ("base_radius_mm", "tip_thickness_mm", "inertia_kg_m2"):
            assert f"{gear[name]:.6g}" in tokens


def test_backlash_that_is_only_round_off_is_none(capsys, tmp_path):
    text = 'name = "tight"\n[defaults]\nmodule_mm = 2\nface_width_mm = 20\n'
    text += "hub_radius_mm = 8\nteeth = 30\n"
    text += "".join(GEAR.format(i=i, teeth=30) for i in range(2))
    text += MESH.format(i=0, next=1).replace("21", "20")
    path = tmp_path / "tight.toml"
    path.write_text(text)
    assert run(["show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    (row,) = [line for line in lines if "Normal backlash of the teeth" in line]
    assert row.split()[-1] == "0"


def test_one_speed_shows_amplitude_and_force(capsys):
    arguments = ["sweep", *RECTANGULAR, "--torque", "50", "--speeds", "2000"]
    assert run([*arguments, "--json"]) == 0
    branch = json.loads(capsys.readouterr().out)["branches"][0]
    (largest,) = branch["largest"]
    assert run(arguments) == 0
    printed = capsys.readouterr().out
    assert "1 speed, 2000 Hz of the first mesh" in printed
    row = next(line.split() for line in printed.splitlines() if " up " in line)
    assert float(row[4]) == pytest.approx(1e6 * largest["dte_rms_m"], rel=1e-3)
    assert float(row[5]) == pytest.approx(largest["force_peak_N"], rel=1e-3)
    assert "RMS of" in printed
    assert "force [N]" in printed


def test_one_of_a_thing_is_one(capsys):
    assert run(["motion", *RECTANGULAR, "--speed", "2000"]) == 0
    assert "1 point in the" in capsys.readouterr().out
    arguments = ["map", *RECTANGULAR, "--over", "torque_Nm=50", "--at", "2000"]
    assert run(arguments) == 0
    assert "1 point: 1 periodic" in capsys.readouterr().out


@pytest.mark.parametrize("width", [3.0, 5.4, 13.0])
def test_titles_fit_above_their_figure(width):
    figure = Figure(figsize=(width, 3.0), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.subplots()
    title = "mesh.1.tip_relief.magnitude_um = 12.5, WWW, finite elements at 1605 Hz, "
    draw_title(figure, f"{3 * title}\nsecond line")
    canvas.draw()
    box = figure._suptitle.get_window_extent()
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.width
    assert figure._suptitle.get_text().endswith("\nsecond line")


def test_what_is_an_axis_of_a_map_is_not_said_to_be_fixed(monkeypatch, tmp_path):
    import lumped.figures.map_plots

    titles = []
    draw = lumped.figures.map_plots.draw_title
    monkeypatch.setattr(
        lumped.figures.map_plots,
        "draw_title",
        lambda figure, title: titles.append(title) or draw(figure, title),
    )
    for name, over in (
        ("torque", "torque_Nm=50,60"),
        ("damping", "damping_ratio=0.1,0.2"),
        ("", "mesh.1.stiffness_variation=0.3,0.4"),
    ):
        path = tmp_path / "m.png"
        options = ["--over", over, "--at", "2000", "--plot", str(path)]
        assert run(["map", *RECTANGULAR, *options]) == 0
        in_title = {word for word in ("torque", "damping") if word in titles[-1]}
        assert in_title == {"torque", "damping"} - {name}


def test_lines_beside_a_picture_are_short():
    for shown in COLOURS:
        for exact in (True, False):
            look = RenderStyle.__new__(RenderStyle)
            values = {"shown": shown, "exact": exact, "largest": 123456.0}
            for name, value in (values | {"limits": (0.0, 1.0)}).items():
                object.__setattr__(look, name, value)
            title, notes = legend(look)
            lines = [*title.splitlines(), *notes]
            assert max(map(len, lines)) <= BAR_LETTERS
            assert len(lines) <= 7


def test_micrometres_have_one_name():
    for package in ("fegear", "lumped", "meshes", "validation"):
        for path in (ROOT / package).rglob("*"):
            if path.suffix in (".py", ".html", ".toml", ".md", ".css", ".js"):
                text = path.read_text(encoding="utf-8")
                assert "\u00b5" not in text, path  # micro sign
                assert "\u03bcm" not in text, path  # Greek letter


@pytest.mark.parametrize("width", [30, 40, 60, 200])
def test_numbers_are_whole_on_narrow_screens(monkeypatch, capsys, width):
    monkeypatch.setenv("COLUMNS", str(width))
    names = ["gear", "mean\nN/m", *(f"column {i}" for i in range(6))]
    table = ruled_table(*names, title="Title", text_columns=("gear",))
    rows = [
        ["a wheel with a long name", *(f"{k + i / 7:.5f}" for i in range(7))]
        for k in (1, 2)
    ]
    for row in rows:
        table.add_row(*row)
    screen().print(table)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    tokens = " ".join(lines).split()
    for value in rows[0][1:] + rows[1][1:]:
        assert tokens.count(value) == 1
    assert tokens.count("Title") == 1
    assert "\N{HORIZONTAL ELLIPSIS}" not in " ".join(lines)


@pytest.mark.parametrize("letters", [5, 30, 60])
@pytest.mark.parametrize("count", [2, 8])
def test_legends_are_not_cut(letters, count):
    figure, ((axes,),) = panels(1, size=(9.0, 5.0))
    handles = [axes.plot([0, 1], label="n" * letters)[0] for _ in range(count)]
    draw_legend(figure, handles, 6)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    box = figure.legends[0].get_window_extent(canvas.get_renderer())
    assert box.x0 >= 0.0
    assert box.x1 <= canvas.get_width_height()[0]


@pytest.mark.parametrize("arguments", [["sets"], ["sets", "--json"], ["--help"]])
def test_a_closed_output_is_no_error(arguments, tmp_path):
    """As by `>&-` of a shell; a file that is written takes no printed lines."""
    command = [sys.executable, "-c", "from fegear.cli import main; main()", *arguments]
    options = ["-o", "s.csv"] if arguments == ["sets"] else []
    script = 'exec "$@" >&-'
    run = partial(subprocess.run, cwd=tmp_path, capture_output=True, timeout=120)
    process = run(["sh", "-c", script, "sh", *command, *options])
    assert (process.returncode, process.stderr) == (0, b"")
    if options:
        assert (tmp_path / "s.csv").read_text().splitlines()[0].startswith("name,")
