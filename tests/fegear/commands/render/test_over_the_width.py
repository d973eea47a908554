"""`fegear render` of gears whose loads vary over the face width."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace

import meshio
import numpy as np
import pytest
from cli_commands import printed, refused
from matplotlib.image import imread
from PIL import Image
from wide_sets import HELICAL

import fegear
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.rendering.flank_surfaces import tooth_surface
from fegear.rendering.headless import drawing_window
from fegear.rendering.pictures import PictureSettings
from fegear.rendering.width_contact import width_contact_at_rest
from fegear.rendering.width_look import EDGE_COLOUR, style_of
from fegear.rendering.width_page import width_page
from fegear.rendering.width_pictures import WidthDrawing
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings

COARSE = StaticsSettings(resolution="coarse", root_stress=False)
TORQUE, POSITION = 120.0, 0.3
SET = """\
name = "helical"
[defaults]
module_mm = 3.0
helix_angle_deg = 18.0
face_width_mm = 20.0
[[gear]]
name = "one"
teeth = 18
hub_radius_mm = 14.0
tooth_thinning_um = 60.0
[[gear]]
name = "two"
teeth = 25
hub_radius_mm = 18.0
[[mesh]]
driver = "one"
driven = "two"
backlash_um = 60.0
[load]
gear = "one"
torques_Nm = [60.0, 120.0]
[dynamics]
damping_ratio = 0.05
"""


@pytest.fixture(scope="module")
def window():
    """Nothing is drawn where VTK can open no window at all."""
    try:
        with drawing_window():
            pass
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def sequence(compliance_cache):
    gears = fegear.make_gear_set(HELICAL)
    return width_contact_at_rest(gears, 0, TORQUE, POSITION, COARSE)


@pytest.fixture(scope="module")
def moments(sequence):
    return sequence.solved([POSITION])


@pytest.fixture
def set_file(tmp_path):
    path = tmp_path / "set.toml"
    path.write_text(SET, "utf-8")
    return str(path)


def test_the_file_is_the_set_that_tests_share():
    assert tomllib.loads(SET) == HELICAL


def test_the_contact_is_that_of_the_tables(moments):
    problem = contact_problem(fegear.make_gear_set(HELICAL), 0, COARSE)
    cycle = solve_cycle(problem, [TORQUE], [POSITION])
    np.testing.assert_array_equal(moments.cycle.face.pressure, cycle.face.pressure)
    assert moments[0].ste == cycle.ste[0, 0]
    assert moments[0].position == POSITION


def drawn(sequence, path, **settings) -> None:
    picture = PictureSettings(width=480, **settings)
    WidthDrawing(sequence, picture).write(path)


def test_picture_has_contacts_in_the_colours_of_their_pressure(
    sequence, tmp_path, window
):
    path = tmp_path / "flank.png"
    with drawing_window():
        WidthDrawing(sequence, PictureSettings(width=960)).write(path)
    image = imread(path)[..., :3]
    assert image.shape == (540, 960, 3)
    bar = int(960 * 0.87)
    for half in (image[54:, : bar // 2], image[54:, bar // 2 : bar]):
        is_grey = np.ptp(half, axis=2) < 0.1
        assert 0.1 < (is_grey & (half.max(axis=2) < 0.9)).mean() < 0.8  # teeth
        red, green, blue = np.moveaxis(half, 2, 0)
        hot = (red > 0.8) & (green > 0.3) & (blue < 0.5)
        assert 30 < hot.sum() < 0.05 * hot.size


def test_lines_of_contact_are_where_the_view_has_them(sequence, moments, window):
    """Colours of the map are nowhere but at points of the bands."""
    from fegear.rendering.flank_surfaces import band_surface
    from fegear.rendering.width_look import view_aspect
    from fegear.rendering.width_scene import draw_over_width

    size = 1920, 1080
    style = style_of(moments, view_aspect(size))
    with drawing_window():
        image = draw_over_width(moments[0], style, "test", size) / 255.0
    top, wide = round(0.1 * size[1]), 0.435 * size[0]
    for index in (0, 1):
        gear, eye = moments.gears[index], style.eyes[index]
        band = moments[0].band(index)
        surface = band_surface(gear, band, POSITION, style.widening)
        offset = surface.points.reshape(-1, 3) - eye.middle
        pixel = 2.0 * eye.half_height / (size[1] - top)
        columns = wide * (index + 0.5) + offset @ eye.right / pixel
        rows = top + 0.5 * (size[1] - top) - offset @ eye.up / pixel
        left, right = round(wide * index), round(wide * (index + 1))
        part = image[:, left:right]
        hot = (part[..., 0] > 0.75) & (part[..., 2] < 0.45)
        y, x = np.nonzero(hot)
        assert len(y) > 50
        near = np.hypot(x[:, None] + left - columns[None], y[:, None] - rows[None]).min(
            axis=1
        )
        assert near.max() < 30.0  # a slice is some 30 pixels long
        assert np.median(near) < 12.0


def test_film_has_its_frames_and_one_scale_of_colours(sequence, tmp_path, window):
    path = tmp_path / "cycle.gif"
    with drawing_window():
        moments = WidthDrawing(sequence, PictureSettings(width=480, frames=3)).write(
            path
        )
    with Image.open(path) as film:
        assert (film.n_frames, film.size) == (3, (480, 270))
    assert moments.positions == pytest.approx([0.0, 1.0 / 3.0, 2.0 / 3.0])
    face = moments.cycle.face
    on_path = np.where(face.on_path, face.pressure[0], 0.0)
    assert style_of(moments, 1.0).limit == on_path.max()


def test_film_for_browsers_is_written(sequence, tmp_path, window):
    path = tmp_path / "cycle.mp4"
    with drawing_window():
        drawn(sequence, path, frames=2)
    assert b"moov" in path.read_bytes()[:200]


def test_data_file_has_the_pressure_at_its_places(sequence, moments, tmp_path):
    path = tmp_path / "flank.vtu"
    WidthDrawing(sequence, PictureSettings()).write(path)
    mesh = meshio.read(path)
    assert set(mesh.point_data) == {"pressure_Pa", "arc_m", "place_m"}
    assert set(mesh.cells_dict) == {"quad"}
    data = {name: values[0] for name, values in mesh.cell_data.items()}
    assert set(data) == {"gear", "pair", "contact", "on_path"}
    quads = mesh.cells_dict["quad"]
    pressure, arc = mesh.point_data["pressure_Pa"], mesh.point_data["arc_m"]
    assert (pressure[quads[data["contact"] == 0]] == 0.0).all()
    assert np.isfinite(arc[quads[data["contact"] == 1]]).all()
    face = moments.cycle.face
    for gear in (0, 1):
        nodes = quads[(data["contact"] == 1) & (data["gear"] == gear)]
        for k, m in np.argwhere(face.load[0, 0] > 0.0):
            of_pair = data["pair"][(data["contact"] == 1) & (data["gear"] == gear)]
            points = np.unique(nodes[of_pair == face.teeth[k]])
            at = np.abs(mesh.point_data["place_m"][points] - face.place[m])
            in_slice = points[at < 0.51 * face.width / face.place.size]
            close = np.abs(pressure[in_slice] - face.pressure[0, 0, k, m])
            best = in_slice[close.argmin()]
            assert close.min() < 1e-6 * face.pressure[0, 0, k, m]
            assert arc[best] == pytest.approx(face.arc[0, 0, k, m, gear], abs=1e-4)


def test_page_has_the_pressures_and_no_text_that_ends_its_data(moments):
    text = width_page(moments, "</script><b>title")
    assert "<b>" not in text
    script = re.search(r'type="application/json">(.*?)</script>', text, re.DOTALL)
    data = json.loads(script[1])
    peak = moments.peak
    assert data["limit"] == pytest.approx(1e-6 * peak.value)
    slices = [one["text"] for one in data["gears"][0]["slices"]]
    assert any(f"{1e-6 * peak.value:.0f} MPa" in text for text in slices)
    assert len(slices) == (moments.cycle.face.load[0] > 0.0).sum()
    assert "one, driver, right-handed, 20 mm wide" in text
    rows = re.findall(r"<tr><td>([+-]?\d)</td><td>(\d+)</td>", text)
    assert len(rows) == len(moments[0].pair_loads(0))


def test_command_prints_the_largest_pressure_and_where(set_file, moments, tmp_path):
    output = str(tmp_path / "flank.vtu")
    options = ("--position", str(POSITION), "--torque", "120", "--resolution", "coarse")
    result = json.loads(printed("render", set_file, *options, "-o", output, "--json"))
    peak = moments.peak
    assert result["largest_contact_pressure_MPa"] == pytest.approx(1e-6 * peak.value)
    assert result["largest_contact_pressure_at"] == {
        "position": POSITION,
        "pair": peak.pair,
        "place_over_width_mm": pytest.approx(1e3 * peak.place),
    }
    text = printed("render", set_file, *options, "-o", output)
    assert f"largest contact pressure: {1e-6 * peak.value:.0f} MPa" in text
    assert f"tooth pair {peak.pair}" in text.replace("+", "")
    end = "far" if peak.place > 0.0 else "near"
    assert f"the width toward the {end} end" in text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--field von-mises", "--field = von-mises; loads that vary over the face"),
        ("--field displacement", "--field = displacement; loads that vary over"),
        ("--field root-stress --zoom set", "--field = root-stress; needs one mesh"),
        ("--zoom tooth", "--zoom = tooth; loads that vary over the face width"),
        ("--zoom set", 'gears "one" and "two" are helical; allowed for pictures of a'),
        ("--scale 10", "--scale = 10; loads that vary over the face width"),
        ("--time-history h.csv", "--time-history = h.csv; loads that vary over"),
        ("--position 1.5", "position = 1.5; must be 0 to 1"),
        ("--torque -5", "torque = -5"),
        ("--plane strain", "plane = strain; must be width"),
        ("--frames 10", "--frames = 10; only films have frames"),
    ],
)
def test_what_does_not_apply_is_refused_in_one_line(
    capsys, monkeypatch, set_file, tmp_path, options, message
):
    def fail(*_arguments, **_options):
        raise AssertionError("something was computed")

    monkeypatch.setattr("fegear.elasticity.cache.cached_arrays", fail)
    (tmp_path / "h.csv").write_text("", "utf-8")
    monkeypatch.chdir(tmp_path)
    error = refused(capsys, "render", set_file, *options.split(), "-o", "a.png")
    assert message in error
    assert not (tmp_path / "a.png").exists()


def test_pressure_may_be_named(set_file, tmp_path):
    output = tmp_path / "flank.vtu"
    options = ("--field", "pressure", "--resolution", "coarse", "-o", str(output))
    with pytest.raises(InputError, match="holds all fields"):
        fegear_render(set_file, *options)
    page = str(output.with_suffix(".html"))
    fegear_render(set_file, *options[:-1], page)
    assert EDGE_COLOUR in (tmp_path / "flank.html").read_text("utf-8")


@pytest.fixture(scope="module")
def with_roots(compliance_cache):
    gears = fegear.make_gear_set(HELICAL)
    sequence = width_contact_at_rest(gears, 0, TORQUE, POSITION, COARSE, with_root=True)
    return sequence, sequence.solved([POSITION, POSITION + 0.25])


def test_root_stress_is_that_of_the_tables(with_roots):
    """The largest over the fillet, at all places over the width."""
    _, moments = with_roots
    gears = fegear.make_gear_set(HELICAL)
    settings = replace(COARSE, root_stress=True, positions=20, estimate_error=False)
    table = fegear.solve_mesh(gears, torques_on_driver=[TORQUE], settings=settings)
    n = round(20 * POSITION)
    for gear, tension in enumerate(moments.tensions):
        over_width = table.roots.over_width[gear]
        module = moments.gears[gear].teeth.module
        root = tension.along > 0.25 * module
        for k, tooth in enumerate(tension.teeth):
            (at,) = np.flatnonzero(table.cycle.face.teeth == tooth)
            expected = over_width.stress[0, n, at]
            ours = np.maximum(tension.stress[0, k][root].max(axis=0), 0.0)
            np.testing.assert_allclose(ours, expected, rtol=1e-9, atol=1.0)
    assert max(moments.root_peaks) == moments.limit


def test_teeth_have_their_root_stress_in_the_fillet(with_roots):
    """Between the flank and the root, below the flank that carries."""
    _, moments = with_roots
    for gear in (0, 1):
        teeth, tension = moments.gears[gear], moments.tensions[gear]
        tooth = tooth_surface(teeth, moments[0].place, 0)
        values = moments[0].root_stress(gear, 0, tooth)
        np.testing.assert_array_equal(np.isfinite(values), np.isfinite(tooth.along))
        (k,) = np.flatnonzero(tension.teeth == 0)
        assert np.nanmax(values) <= tension.stress[0, k].max() * (1.0 + 1e-12)
        assert np.nanmax(values) > 0.95 * tension.stress[0, k].max()
        center = teeth.placed.centers[teeth.index]
        r = np.hypot(*(tooth.points[np.isfinite(values), :2] - center).T)
        assert r.max() <= abs(teeth.teeth.form_radius) * (1.0 + 1e-9)
        neighbour = moments[0].root_stress(gear, 99, tooth)
        assert np.isnan(neighbour).all()


def test_picture_and_data_file_have_the_root_stress(with_roots, tmp_path, window):
    sequence, moments = with_roots
    path = tmp_path / "roots.png"
    with drawing_window():
        WidthDrawing(sequence, PictureSettings(width=960)).write(path)
    image = imread(path)[:, : int(0.87 * 960), :3]
    red, green, blue = np.moveaxis(image, 2, 0)
    assert ((red > 0.6) & (green < 0.4) & (blue < 0.3)).sum() > 30  # most stress
    file = tmp_path / "roots.vtu"
    WidthDrawing(sequence, PictureSettings()).write(file)
    stress = meshio.read(file).point_data["root_stress_Pa"]
    peak = max(np.nanmax(one.stress[0]) for one in moments.tensions)
    assert 0.9 * peak < np.nanmax(stress) <= peak * (1.0 + 1e-9)


def test_stress_in_the_plane_is_refused_in_python():
    gears = fegear.make_gear_set(HELICAL)
    with pytest.raises(InputError, match="allowed for stress in the plane of the"):
        fegear.solve_stress(gears, TORQUE)


def fegear_render(*arguments: str) -> None:
    from typer.testing import CliRunner

    from fegear.cli import app

    CliRunner().invoke(app, ["render", *arguments], catch_exceptions=False)


def test_browser_shows_the_flanks_and_values_of_both_gears(browser, moments, tmp_path):
    path = tmp_path / "flank.html"
    path.write_text(width_page(moments, "title"), encoding="utf-8")
    shown = browser.new_page(viewport={"width": 1200, "height": 700})
    messages: list[str] = []
    shown.on("pageerror", lambda error: messages.append(str(error)))
    shown.on(
        "console", lambda m: messages.append(m.text) if m.type == "error" else None
    )
    shown.goto(path.as_uri())
    shown.wait_for_timeout(500)
    for index, name in enumerate(("one, driver", "two, driven")):
        shown.select_option("#gear", str(index))
        shown.wait_for_timeout(300)
        picture = tmp_path / f"{index}.png"
        shown.screenshot(path=str(picture))
        view = imread(picture)[80:, :900, :3]
        red, green, blue = np.moveaxis(view, 2, 0)
        hot = (red > 0.8) & (green > 0.3) & (blue < 0.45)
        assert 50 < hot.sum() < 0.05 * hot.size
        y, x = np.argwhere(hot)[len(np.argwhere(hot)) // 2]
        shown.mouse.move(float(x), float(y + 80))
        shown.wait_for_timeout(100)
        text = shown.inner_text("#probe")
        assert re.match(r"pair [+-]?\d, (\d+ MPa|edge), [+-][\d.]+ mm from the", text)
        assert name in shown.inner_text(f"#gear option:nth-child({index + 1})")
    assert messages == []
    before = shown.screenshot()
    shown.mouse.move(400, 300)
    shown.mouse.down()
    shown.mouse.move(480, 340, steps=4)
    shown.mouse.up()
    shown.wait_for_timeout(200)
    assert shown.screenshot() != before
    shown.close()
