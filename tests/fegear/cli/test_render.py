"""`fegear render`: pictures, films and VTK files of gears in contact."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import pairwise
from time import perf_counter

import meshio
import numpy as np
import pytest
import typer
from matplotlib.image import imread
from PIL import Image
from typer.testing import CliRunner

from fegear.cli.render import render_command
from fegear.errors import InputError
from fegear.fields import contact_field, mesh_scene
from fegear.gearset import load_gear_set
from fegear.headless import drawing_window
from fegear.scene import (
    HEADER,
    MARGIN,
    SIZE,
    draw,
    look_of,
    picture_aspect,
    ribbon_base,
)
from fegear.statics import StaticsSettings

app = typer.Typer()
app.command()(render_command)
ARRAYS = {
    "displacement_m",
    "motion_m",
    "von_mises_Pa",
    "principal_1_Pa",
    "stress_xx_Pa",
    "stress_yy_Pa",
    "stress_xy_Pa",
    "stress_zz_Pa",
}


@pytest.fixture(scope="module", autouse=True)
def window():
    """Nothing is drawn where VTK can open no window at all."""
    try:
        with drawing_window():
            pass
    except InputError as error:
        pytest.skip(str(error))


def run(*arguments: str) -> None:
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0


@pytest.fixture(scope="module")
def scene(private_cache):
    return mesh_scene(load_gear_set("liu-pair"), 0, StaticsSettings())


@pytest.mark.parametrize("shown", ["von-mises", "principal", "displacement"])
def test_picture_is_drawn_from_a_cached_compliance_in_seconds(tmp_path, shown, scene):
    path = tmp_path / "contact.png"
    start = perf_counter()
    run("--position", "0.5", "--field", shown, "-o", str(path))
    seconds = perf_counter() - start
    sys.stdout.write(f"{shown}: {seconds:.2f} s\n")
    assert seconds < 15.0  # 1.5 to 4 s on an idle core
    image = imread(path)[..., :3]
    assert image.shape == (SIZE[1], SIZE[0], 3)
    inside = image[int(HEADER * SIZE[1]) :, : int((1.0 - MARGIN) * SIZE[0])]
    assert 0.02 < (inside.min(axis=2) > 0.99).mean() < 0.6  # tooth spaces
    assert inside.reshape(-1, 3).std(axis=0).max() > 0.1


@pytest.mark.parametrize("zoom", ["contact", "tooth"])
@pytest.mark.parametrize("position", [0.0, 0.5])
def test_strongest_colour_of_the_ribbon_is_at_the_contact(scene, zoom, position):
    view = scene.view(zoom, picture_aspect())
    field = contact_field(scene, 100.0, position, view)
    look = look_of([field], "pressure", view, scene.mesh.pair.driver.module)
    with drawing_window():
        image = draw(field, look, "test") / 255.0
    top, right = round(HEADER * SIZE[1]), round((1.0 - MARGIN) * SIZE[0])
    strongest = np.array([0.940, 0.975, 0.131])  # the end of the colour map plasma
    close = np.abs(image[top:, :right] - strongest).max(axis=2) < 0.03
    rows, columns = np.nonzero(close)
    assert len(rows) > 0
    pixel = 2.0 * view.half_height / (SIZE[1] - top)
    pair = max(field.pairs, key=lambda pair: pair.pressure.max())
    base = ribbon_base(pair, look)[pair.pressure.argmax()]
    column = 0.5 * right + (base[0] - view.x) / pixel
    row = 0.5 * (SIZE[1] - top) - (base[1] - view.y) / pixel
    nearest = np.hypot(columns - column, rows - row).min()
    assert nearest < 4.0
    # and all of it is on the normal through the contact
    normal = pair.normals[pair.pressure.argmax()]
    across = (columns - column) * normal[1] + (rows - row) * normal[0]
    assert np.abs(across).max() < 12.0


def test_camera_and_colours_hold_for_the_whole_cycle(scene):
    view = scene.view("contact", picture_aspect())
    assert view == scene.view("contact", picture_aspect())
    pair = scene.mesh.pair
    for roll in (pair.path_start, pair.path_end):
        assert view.contains(np.repeat(scene._on_path(roll)[None], 2, axis=0))
    fields = [contact_field(scene, 100.0, p, view) for p in (0.0, 0.5)]
    looks = [look_of([f], "von-mises", view, pair.driver.module) for f in fields]
    both = look_of(fields, "von-mises", view, pair.driver.module)
    assert both.limits[1] == max(look.limits[1] for look in looks)
    assert both.motion_scale == min(look.motion_scale for look in looks)
    assert both.limits[1] < both.largest  # fillets are seen beside the contact


def test_vtu_holds_all_fields_with_their_units(tmp_path):
    path = tmp_path / "contact.vtu"
    run("liu-idler", "--mesh", "2", "--torque", "80", "-o", str(path))
    mesh = meshio.read(path)
    assert set(mesh.point_data) == ARRAYS
    assert set(mesh.cells_dict) == {"triangle6"}
    for values in mesh.point_data.values():
        assert np.isfinite(values).all()
    assert mesh.point_data["displacement_m"].shape == (len(mesh.points), 3)
    assert set(np.unique(mesh.cell_data["gear"][0])) == {0, 1}
    x, y, xy = (mesh.point_data[f"stress_{c}_Pa"] for c in ("xx", "yy", "xy"))
    expected = np.sqrt(x**2 + y**2 - x * y + 3.0 * xy**2)
    np.testing.assert_allclose(mesh.point_data["von_mises_Pa"], expected, rtol=1e-9)


def test_film_has_all_frames_and_ends_where_it_began(tmp_path, monkeypatch):
    monkeypatch.setattr("fegear.cli.render.FRAMES", 6)
    monkeypatch.setattr("fegear.cli.render.FILM_SIZE", (480, 270))
    path = tmp_path / "cycle.gif"
    run("--resolution", "coarse", "-o", str(path))
    with Image.open(path) as film:
        assert film.n_frames == 6
        assert film.size == (480, 270)
        frames = []
        for i in range(film.n_frames):
            film.seek(i)
            frames.append(np.asarray(film.convert("RGB"), float)[30:, :400])
    steps = [np.abs(a - b).mean() for a, b in pairwise(frames)]
    assert min(steps) > 0.5  # the gears turn
    assert np.abs(frames[-1] - frames[0]).mean() < 2.0 * max(steps)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-o", "a.xyz"), "allowed endings .png, .vtu, .gif, .mp4"),
        (("-o", "none/a.png"), "cannot be written"),
        (("--mesh", "2", "-o", "a.png"), "--mesh = 2; liu-pair has 1"),
        (("--position", "1.5", "-o", "a.png"), "--position = 1.5; allowed 0 to 1"),
        (("--position", "nan", "-o", "a.png"), "--position = nan"),
        (("--position", "0.5", "-o", "a.gif"), "a film shows all positions"),
        (("--torque", "0", "-o", "a.png"), "--torque = 0; must be positive"),
        (("--friction", "0.5", "-o", "a.png"), "--friction = 0.5; allowed"),
        (("--scale", "big", "-o", "a.png"), "--scale = big; allowed auto"),
        (("--scale", "-1", "-o", "a.png"), "--scale = -1; allowed auto"),
        (("--scale", "nan", "-o", "a.png"), "--scale = nan; allowed auto"),
        (("no-such-set", "-o", "a.png"), "no-such-set"),
    ],
)
def test_wrong_options_end_in_one_line(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        run(*arguments)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_without_an_encoder_a_film_is_refused(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match="imageio-ffmpeg is not installed"):
        run("-o", str(tmp_path / "a.mp4"))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="windows of Linux")
def test_without_any_window_one_line_says_what_to_install(tmp_path):
    """VTK itself would end the program with a segmentation fault."""
    hidden = {"__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path), "PATH": str(tmp_path)}
    drop = ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")
    environment = {k: v for k, v in os.environ.items() if k not in drop} | hidden
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "import fegear.headless as h; h._has_osmesa = lambda: False\n"
            "with h.drawing_window(): pass",
        ],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert "InputError: cannot draw" in done.stderr
    assert "libegl1" in done.stderr
