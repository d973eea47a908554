"""`fegear sets` and `fegear show` on the screen, as JSON and as a picture."""

from __future__ import annotations

import json
import re

import ezdxf
import numpy as np
import pytest
from drawn_figures import axis_labels, saved_figures
from typer.testing import CliRunner

from fegear.cli import app
from fegear.commands.show.derived import gear_set_figures
from fegear.commands.show.study import flattened, header, shaft_line
from fegear.files.dxf import write_dxf
from fegear.gearset import builtin_names, load_gear_set, make_gear_set


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_sets_lists_every_builtin():
    printed = run("sets")
    assert all(name in printed for name in builtin_names())


@pytest.mark.parametrize("name", builtin_names())
def test_show_prints_names_units_and_inferences(name):
    printed = run("show", name)
    # of helical gears it is that in the section
    angle = r"HPSTC, roll angle(, transverse)? \[deg\]"
    assert re.search(angle, printed)
    for text in ("Base radius [mm]", "Contact ratio"):
        assert text in printed
    assert "Inferred:" in printed


def test_show_json_is_machine_readable():
    figures = json.loads(run("show", "liu-pair", "--json"))
    assert figures["meshes"][0]["driver_torques_Nm"] == [50.0, 100.0, 150.0]
    assert figures["gears"][0]["base_radius_mm"] == pytest.approx(45.35, abs=5e-3)


def test_show_prints_the_figures_of_lumped_models():
    printed = run("show", "liu-idler")
    for text in (
        "Bearing kx [N/m]",
        "Coupling stiffness [N m/rad]",
        "Backlash of lumped models [um]",
        "-0.0481866",
        "Damping ratio: 0.04",
    ):
        assert text in printed
    countershaft = run("show", "liu-countershaft")
    assert "Rigid shaft: middle-1, middle-2" in countershaft
    assert "derived" in countershaft


def test_show_json_holds_the_figures_of_lumped_models():
    figures = json.loads(run("show", "liu-countershaft", "--json"))
    assert figures["damping_ratio"] == 0.04
    assert figures["shafts"] == [
        {"gears": ["middle-1", "middle-2"], "stiffness_Nm_per_rad": None}
    ]
    assert figures["gears"][0]["mass_origin"] == "derived"
    assert figures["gears"][0]["bearing_kx_N_per_m"] is None
    assert figures["meshes"][1]["phase_origin"] == "given"


def test_show_prints_a_shaft_with_its_stiffness():
    line = shaft_line(("a", "b"), 5e5)
    assert line == "Shaft: a, b, 500000 N m/rad between successive gears"


def test_show_prints_which_bearings_of_a_shaft_float():
    line = shaft_line(("a",), None, 100.0, 2.0, 2, [1e8, 0.0])
    assert line == (
        "Shaft: a; 100 mm long, 2 kg, 2 bearings with 1e+08, 0 N/m along the axis"
    )


def test_show_prints_the_rolling_bearings_of_a_shaft():
    balls = {"ball_diameter_mm": 7.94, "pitch_diameter_mm": 38.5, "balls": 9}
    rollers = {
        "rollers": 12,
        "roller_diameter_mm": 7.5,
        "roller_length_mm": 8.0,
        "pitch_diameter_mm": 39.0,
    }
    gear_set = make_gear_set(
        {
            "name": "rolling",
            "defaults": {"module_mm": 2.0, "face_width_mm": 10.0, "hub_radius_mm": 9.0},
            "gear": [{"name": name, "teeth": 21} for name in "ab"],
            "mesh": [{"driver": "a", "driven": "b"}],
            "shaft": [
                {
                    "gears": ["a"],
                    "positions_mm": [40.0],
                    "lengths_mm": [100.0],
                    "diameters_mm": [18.0],
                    "bearing_positions_mm": [5.0, 95.0],
                    "rolling_bearings": [
                        {"ball_bearing": balls, "contact_angle_deg": -25.0},
                        {"roller_bearing": rollers},
                    ],
                }
            ],
        }
    )
    (shaft,) = gear_set_figures(gear_set)["shafts"]
    assert shaft_line(**shaft).endswith(", 2 bearings: 9 balls at -25 deg, 12 rollers")


def test_show_prints_markup_as_it_stands(tmp_path):
    path = tmp_path / "set.toml"
    path.write_text(
        'name = "[red]a[/red]"\ndescription = "[/b]"\n'
        "[defaults]\nmodule_mm = 2\nface_width_mm = 20\nhub_radius_mm = 12\n"
        '[[gear]]\nname = "[bold]"\nteeth = 30\n'
        '[[gear]]\nname = "[/bold]"\nteeth = 30\n'
        '[[mesh]]\ndriver = "[bold]"\ndriven = "[/bold]"\ncenter_distance_mm = 60\n'
        'tip_relief = { magnitude_um = 10, start = "HPSTC" }\n'
    )
    printed = run("show", str(path))
    assert "[red]a[/red]: [/b]" in printed
    assert "[bold] > [/bold]" in printed
    assert "Tip relief [um]" in printed
    assert "Root relief" not in printed


def test_show_draws(tmp_path):
    with saved_figures() as figures:
        run("show", "liu-pair", "--plot", str(tmp_path / "gears.png"))
    (figure,) = figures
    assert axis_labels(figure) == {"x [mm]", "y [mm]"}
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert texts[:2] == ["pinion, 38 teeth", "idler, 55 teeth"]


def test_outlines_are_drawn_to_scale_for_cad(tmp_path):
    """Vertices are between the root and the tip circle; gears are in mesh."""
    run("show", "liu-pair", "--plot", str(tmp_path / "pair.dxf"))
    drawing = ezdxf.readfile(tmp_path / "pair.dxf")
    assert drawing.units == ezdxf.units.MM
    gear_set = load_gear_set("liu-pair")
    curves = {c.dxf.layer: c for c in drawing.modelspace().query("LWPOLYLINE")}
    assert list(curves) == [
        name for gear in gear_set.gears for name in (gear.name, f"{gear.name} bore")
    ]
    centers = []
    for gear in gear_set.gears:
        teeth, bore = gear.geometry, points_of(curves[f"{gear.name} bore"])
        center = bore.mean(axis=0)
        radii = np.hypot(*(points_of(curves[gear.name]) - center).T)
        limits = 1e3 * np.array([teeth.root_radius, teeth.tip_radius])
        assert [radii.min(), radii.max()] == pytest.approx(limits)
        assert np.hypot(*(bore - center).T) == pytest.approx(1e3 * teeth.hub_radius)
        centers.append(center)
    distance = np.hypot(*(centers[1] - centers[0]))
    assert distance == pytest.approx(1e3 * gear_set.meshes[0].pair.center_distance)
    first = (tmp_path / "pair.dxf").read_bytes()
    run("show", "liu-pair", "--plot", str(tmp_path / "pair.dxf"))
    assert (tmp_path / "pair.dxf").read_bytes() == first


def points_of(curve):
    assert curve.closed
    return np.array([point[:2] for point in curve.get_points()])


def test_layers_have_names_that_cad_takes(tmp_path):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    curves = {'a/b "c"': square, "wheel": square, "lost": np.nan * square}
    write_dxf(tmp_path / "t.dxf", curves)
    held = ezdxf.readfile(tmp_path / "t.dxf").modelspace()
    assert [curve.dxf.layer for curve in held] == ["a_b _c_", "wheel"]


# radii are of cylinders; these lie along the axis, between axes or about them
NEITHER_SECTION = re.compile(
    r"_radius_mm|^face_width|common_face|center_distance|offset_mm|center_line_deg"
    r"|helix_angle_deg|clearance|pitch_error|end_relief_length|positions_deg|phase|^pin_"
)
LENGTH_OR_ANGLE = re.compile(r"_(mm|um|deg|pitches)$")


def test_lengths_and_angles_of_helical_gears_name_their_section():
    lead = {"crowning_um": 4, "end_relief_um": 3, "end_relief_length_mm": 2}
    relief = {"magnitude_um": 8, "start": "HPSTC"}
    points = {"roll_angle_deg": [20, 25], "deviation_um": [0, 2], "crowning_um": 3}
    gears = make_gear_set(
        {
            "name": "helical",
            "defaults": {"module_mm": 2, "helix_angle_deg": 18, "face_width_mm": 20},
            "gear": [
                {"name": "a", "teeth": 23, "hub_radius_mm": 12},
                {"name": "b", "teeth": 41, "hub_radius_mm": 20, "profile_shift": 0.1},
            ],
            "mesh": [
                {
                    "driver": "a",
                    "driven": "b",
                    "backlash_um": 40,
                    "misalignment_um": 5,
                    "offset_mm": 1,
                    "lead": lead,
                    "tip_relief": relief,
                    "driver_profile": points,
                }
            ],
        }
    )
    figures = gear_set_figures(gears)
    mesh = figures["meshes"][0]
    unnamed = []
    for item in (*figures["gears"], mesh, *mesh["flanks"]):
        for key in flattened(item):
            name = key.rpartition(".")[2]
            if not LENGTH_OR_ANGLE.search(name) or NEITHER_SECTION.search(name):
                continue
            if not re.search("normal|transverse", header(key, helical=True).lower()):
                unnamed.append(key)
    assert not unnamed
    assert header("tip_thickness_mm") == "Tip thickness [mm]"
    assert header("tip_thickness_mm", True) == "Tip thickness, transverse [mm]"
