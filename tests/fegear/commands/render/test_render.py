"""`fegear render`: pictures, films and VTK files of gears in contact."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from itertools import pairwise
from time import process_time

import imageio_ffmpeg
import meshio
import numpy as np
import pytest
import pyvista
from cli_commands import printed
from history_files import HEADER, columns, written
from matplotlib import colormaps
from matplotlib.image import imread
from PIL import Image
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from fegear.cli import app
from fegear.figures.film import write_film
from fegear.files.errors import InputError
from fegear.files.output import write_whole
from fegear.gearset import load_gear_set
from fegear.rendering.fields import contact_field, mesh_scene
from fegear.rendering.headless import drawing_window
from fegear.rendering.look import HEADER as HEAD
from fegear.rendering.look import MARGIN, SIZE, look_of, picture_aspect, ribbon_base
from fegear.rendering.scene import draw
from fegear.statics.settings import StaticsSettings

NO_PALETTE = np.zeros((256, 3), np.uint8)  # films .mp4 need none
SMALL = ("--frames", "6", "--width", "480")
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
    result = CliRunner().invoke(app, ["render", *arguments], catch_exceptions=False)
    assert result.exit_code == 0


@pytest.fixture(scope="module")
def scene(compliance_cache):
    return mesh_scene(load_gear_set("liu-pair"), 0, StaticsSettings())


@pytest.mark.slow
@pytest.mark.parametrize("field", ["von-mises", "principal", "displacement"])
def test_picture_is_drawn_from_a_cached_compliance_in_seconds(tmp_path, field, scene):
    path = tmp_path / "contact.png"
    start = process_time()  # which other processes do not prolong
    run("--position", "0.5", "--field", field, "-o", str(path))
    seconds = process_time() - start
    sys.stdout.write(f"{field}: {seconds:.2f} s\n")
    assert seconds < 15.0  # 1.5 to 4 s on an idle core
    image = imread(path)[..., :3]
    assert image.shape == (SIZE[1], SIZE[0], 3)
    inside = image[int(HEAD * SIZE[1]) :, : int((1.0 - MARGIN) * SIZE[0])]
    assert 0.02 < (inside.min(axis=2) > 0.99).mean() < 0.6  # tooth spaces
    assert inside.reshape(-1, 3).std(axis=0).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("zoom", ["contact", "tooth"])
@pytest.mark.parametrize("position", [0.0, 0.5])
def test_strongest_colour_of_the_ribbon_is_at_the_contact(scene, zoom, position):
    view = scene.view(zoom, picture_aspect())
    field = contact_field(scene, 100.0, position, view)
    look = look_of([field], "pressure", view, scene.mesh.pair.driver.module)
    with drawing_window():
        image = draw(field, look, "test") / 255.0
    top, right = round(HEAD * SIZE[1]), round((1.0 - MARGIN) * SIZE[0])
    strongest = np.array([0.940, 0.975, 0.131])  # the end of the colour map plasma
    matches = np.abs(image[top:, :right] - strongest).max(axis=2) < 0.03
    rows, columns = np.nonzero(matches)
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
        assert view.contains(np.repeat(scene.on_path(roll)[None], 2, axis=0))
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
    z = mesh.point_data["stress_zz_Pa"]
    squares = (x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2
    expected = np.sqrt(0.5 * squares + 3.0 * xy**2)
    strain = np.abs(z - 0.3 * (x + y)) < 1e-3 * np.abs(x + y)
    assert strain.any()  # beside the contact
    assert (z == 0.0).any()  # far from it
    np.testing.assert_allclose(mesh.point_data["von_mises_Pa"], expected, rtol=1e-9)


@pytest.mark.slow
def test_film_has_all_frames_and_ends_where_it_began(tmp_path):
    path = tmp_path / "cycle.gif"
    run("--resolution", "coarse", *SMALL, "-o", str(path))
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


def mp4_frames(path) -> tuple[dict, list[np.ndarray]]:
    reader = imageio_ffmpeg.read_frames(str(path))
    metadata = next(reader)
    width, height = metadata["size"]
    return metadata, [
        np.frombuffer(data, np.uint8).reshape(height, width, 3) for data in reader
    ]


@pytest.mark.slow
def test_film_for_browsers_has_the_frames_of_the_gif(tmp_path, capfd):
    """Its first frame is the picture at position 0, up to compression."""
    film, picture = tmp_path / "cycle.mp4", tmp_path / "start.png"
    run("--resolution", "coarse", *SMALL, "-o", str(film))
    assert capfd.readouterr().err == ""
    metadata, frames = mp4_frames(film)
    assert metadata["codec"] == "h264"
    assert metadata["pix_fmt"].startswith("yuv420p")
    assert metadata["size"] == (480, 270)
    assert len(frames) == 6
    assert b"moov" in film.read_bytes()[:200]  # a browser may begin at once
    run("--resolution", "coarse", "--width", "480", "-o", str(picture))
    start = 255.0 * imread(picture)[30:, :400, :3]
    differences = [np.abs(frame[30:, :400] - start).mean() for frame in frames]
    assert differences[0] < 12.0  # colours of a film suit all positions
    assert np.argmin(differences) == 0


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError])
def test_a_film_that_is_interrupted_leaves_no_file(tmp_path, error):
    path = tmp_path / "cycle.mp4"

    def frames():
        yield np.zeros((90, 160, 3), np.uint8)
        raise error

    with pytest.raises((KeyboardInterrupt, InputError)):
        write_whole(path, lambda target: write_film(frames(), target, NO_PALETTE))
    assert not list(tmp_path.iterdir())


def broken_pipe():
    yield
    raise OSError("broken pipe\n\nFFMPEG COMMAND:\nffmpeg ...")


def silent_end():
    while True:
        yield


@pytest.mark.parametrize("encoder", [broken_pipe, silent_end])
def test_an_encoder_that_fails_leaves_no_file(tmp_path, monkeypatch, encoder):
    monkeypatch.setattr("imageio_ffmpeg.write_frames", lambda *a, **k: encoder())
    images = [np.zeros((90, 160, 3), np.uint8)] * 2
    with pytest.raises(InputError, match="ffmpeg failed") as caught:
        write_whole(
            tmp_path / "a.mp4", lambda path: write_film(images, path, NO_PALETTE)
        )
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def pixel_of(look, size, point) -> np.ndarray:
    """Column and row of a place in the world, in the whole picture."""
    top, right = round(HEAD * size[1]), round((1.0 - MARGIN) * size[0])
    pixel = 2.0 * look.view.half_height / (size[1] - top)
    x, y = (point - [look.view.x, look.view.y]) / pixel
    return np.array([0.5 * right + x, top + 0.5 * (size[1] - top) - y])


@pytest.mark.slow
def test_strongest_colours_are_at_the_contact_and_in_the_loaded_fillets(scene):
    """Von Mises stress: the end of the colours."""
    view = scene.view("tooth", picture_aspect())
    field = contact_field(scene, 100.0, 0.0, view)
    look = look_of([field], "von-mises", view, scene.mesh.pair.driver.module)
    with drawing_window():
        image = draw(field, look, "test") / 255.0
    picture = image[:, : int((1.0 - MARGIN) * SIZE[0])]
    colour_distance, value = cKDTree(
        colormaps["turbo"](np.linspace(0, 1, 256))[:, :3]
    ).query(picture)
    rows, columns = np.nonzero((colour_distance < 0.03) & (value > 0.85 * 255))
    pixels = [pixel_of(look, SIZE, ribbon_base(field.pairs[0], look).mean(axis=0))]
    for gear in field.gears:
        node = gear.fillet[gear.von_mises[gear.fillet].argmax()]
        point = gear.points[node] + look.motion_scale * gear.motion[node]
        pixels.append(pixel_of(look, SIZE, point))
    distances = np.array([np.hypot(columns - x, rows - y) for x, y in pixels])
    # at the contact and in both gears' fillets
    assert distances.min(axis=1).max() < 8.0
    size = 0.3 * scene.mesh.pair.driver.module / (2.0 * view.half_height / SIZE[1])
    assert distances.min(axis=0).max() < size  # and nowhere else


@pytest.mark.slow
def test_first_frame_of_a_film_has_the_pressure_at_the_contact(
    scene, tmp_path, monkeypatch
):
    monkeypatch.setattr("fegear.rendering.contact_sequence.COLOUR_SCALE_POSITIONS", 1)
    film = tmp_path / "cycle.mp4"
    run("--field", "pressure", "--frames", "2", "--torque", "100", "-o", str(film))
    metadata, frames = mp4_frames(film)
    view = scene.view("contact", picture_aspect())
    field = contact_field(scene, 100.0, 0.0, view)
    look = look_of([field], "pressure", view, scene.mesh.pair.driver.module)
    (pair,) = field.pairs
    base = ribbon_base(pair, look)[pair.pressure.argmax()]
    tip = base + look.ribbon * view.half_height * pair.normals[pair.pressure.argmax()]
    ribbon = np.array([pixel_of(look, metadata["size"], p) for p in (base, tip)])
    frame = frames[0].astype(float)
    yellow = (frame[..., 0] > 190.0) & (frame[..., 2] < 90.0)
    yellow[:, int((1.0 - MARGIN) * metadata["size"][0]) :] = False
    rows, columns = np.nonzero(yellow)
    assert len(rows) > 5
    direction = (ribbon[1] - ribbon[0]) / np.hypot(*(ribbon[1] - ribbon[0]))
    x, y = columns - ribbon[0, 0], rows - ribbon[0, 1]
    offset = x * direction[1] - y * direction[0]
    assert np.abs(offset).max() < 8.0


def moving(tmp_path, **header) -> str:
    entries = {"friction coefficient": "0"} | header
    return str(written(tmp_path / "h.csv", HEADER | entries))


def test_film_of_a_motion(tmp_path):
    path = tmp_path / "motion.gif"
    options = ("--time-history", moving(tmp_path), "--torque", "100")
    coarse = ("--resolution", "coarse", "--width", "480", "--frames", "3")
    run(*options, *coarse, "-o", str(path))
    with Image.open(path) as film:
        assert film.n_frames == 3


def test_moment_of_the_largest_force_of_a_motion(tmp_path):
    path = tmp_path / "motion.vtu"
    run("--time-history", moving(tmp_path), "-o", str(path))
    loads = pyvista.read(path).field_data["pair_load_N"]
    table = columns()
    assert sum(loads) == pytest.approx(max(table["mesh1_force_N"]))


def test_page_of_a_motion_names_speed_time_and_force(tmp_path):
    path = tmp_path / "motion.html"
    run("--time-history", moving(tmp_path), "-o", str(path))
    text = path.read_text(encoding="utf-8")
    assert "1600 Hz up" in text
    assert "mesh force" in text
    assert "100 N m on the input" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--position", "0.5"), "has positions of its own"),
        (("--torque", "80"), "--torque = 80; "),
        (("--friction", "0.1"), "--friction = 0.1; "),
        (("--plane", "strain"), "--plane strain; "),
        (("--mesh", "2"), "--mesh = 2; liu-pair has 1"),
    ],
)
def test_options_that_contradict_a_motion(tmp_path, arguments, message):
    output = tmp_path / "a.png"
    with pytest.raises(InputError) as caught:
        run("--time-history", moving(tmp_path), *arguments, "-o", str(output))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not output.exists()


def test_figures_changed_for_the_motion_are_changed_here(tmp_path):
    history = moving(tmp_path, **{"set no.such.key": "5"})
    with pytest.raises(InputError, match=r"no\.such\.key"):
        run("--time-history", history, "-o", str(tmp_path / "a.png"))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="windows of Linux")
def test_without_any_window_one_line_says_what_to_install(tmp_path):
    """VTK itself would end the program with a segmentation fault."""
    hidden = {"__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path), "PATH": str(tmp_path)}
    drop = ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")
    environment = {k: v for k, v in os.environ.items() if k not in drop} | hidden
    process = subprocess.run(
        [
            sys.executable,
            "-c",
            "import fegear.rendering.headless as h; h._has_osmesa = lambda: False\n"
            "with h.drawing_window(): pass",
        ],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 1
    assert "InputError: cannot draw" in process.stderr
    assert "libegl1" in process.stderr


def test_teeth_that_no_load_leaves_in_mesh_are_not_drawn(tmp_path):
    with pytest.raises(InputError, match="exceeds a tenth of the module"):
        run("--torque", "1e8", "-o", str(tmp_path / "p.png"))
    assert not list(tmp_path.iterdir())


def test_render_says_what_it_drew(tmp_path):
    path = tmp_path / "contact.png"
    arguments = ("render", "liu-pair", "--resolution", "coarse", "--position", "0.5")
    lines = printed(*arguments, "-o", path).splitlines()
    drawn, largest, plane, written = lines[-5:-1]
    assert plane == "beside a contact they are those of plane strain"
    assert "liu-pair" in drawn
    assert re.match(r"largest von Mises stress in view: \w+ \d+ MPa, \w+ \d+", largest)
    assert largest.endswith(" MPa")
    assert "largest contact pressure" in largest
    assert written == f"wrote {path}"


def json_output(*arguments: str) -> dict:
    return json.loads(printed(*arguments, "--json"))


@pytest.mark.slow
def test_a_film_prints_the_largest_values_of_all_its_frames(tmp_path):
    """Seven frames hit moments that those which choose the colours do not."""
    films = ("--resolution", "coarse", "--width", "480", "--frames", "7")
    film = json_output("render", *films, "-o", str(tmp_path / "cycle.gif"))
    stills = [
        json_output(
            *("render", "--resolution", "coarse", "--position", str(i / 7)),
            *("-o", str(tmp_path / f"{i}.vtu")),
        )
        for i in range(7)
    ]
    assert film["frames"] == 7
    key = "largest_von_mises_MPa"
    for gear, value in film[key].items():
        every = [still[key][gear] for still in stills]
        assert value == pytest.approx(max(every))
        at = film["largest_von_mises_at"][gear]["position"]
        assert at == pytest.approx(int(np.argmax(every)) / 7)


def test_a_film_of_a_motion_prints_the_time_of_its_largest_values(tmp_path):
    path = tmp_path / "motion.gif"
    coarse = ("--resolution", "coarse", "--width", "480", "--frames", "3")
    history = ("--time-history", moving(tmp_path))
    film = json_output("render", *history, *coarse, "-o", str(path))
    times = {at["time_s"] for at in film["largest_von_mises_at"].values()}
    period = columns()["time_s"][-1]
    frames = [pytest.approx(i * period / 6) for i in range(6)]
    assert all(time in frames for time in times)
    assert film["frames"] == 3


SET = ("planetary-24-36-96", "--zoom", "set", "--resolution", "coarse")


@pytest.mark.slow
def test_data_of_a_whole_set_has_all_gears_and_meshes(tmp_path):
    path = tmp_path / "set.vtu"
    run(*SET, "--torque", "60", "--position", "0.3", "-o", str(path))
    grid = pyvista.read(path)
    names = list(grid.field_data["gear_name"])
    assert sorted(names) == ["planet-1", "planet-2", "planet-3", "ring", "sun"]
    assert set(np.unique(grid.cell_data["gear"])) == set(range(5))
    meshes, loads = grid.field_data["pair_mesh"], grid.field_data["pair_load_N"]
    sums = [loads[meshes == number].sum() for number in range(1, 7)]
    radius = load_gear_set("planetary-24-36-96").gears[0].geometry.base_radius
    assert sums == pytest.approx([20.0 / radius] * 6)
    assert "approach_m" not in grid.field_data


def test_picture_of_a_whole_set_shows_every_gear_and_the_forces(tmp_path):
    path = tmp_path / "set.png"
    run(*SET, "--width", "640", "-o", str(path))
    image = imread(path)[..., :3]
    assert image.shape == (360, 640, 3)
    centre = round(0.5 * (1.0 - MARGIN) * 640), round(360 * (1.0 + HEAD) / 2.0)
    pixel = 1.03 * 0.224 / (360 * (1.0 - HEAD))
    colours = image.reshape(-1, 3)
    force = np.array([0.816, 0.106, 0.545])
    assert (np.abs(colours - force).max(axis=1) < 0.15).sum() > 30
    for x, y in ((0.072, 0.021), (0.0, 0.018), (-0.108, 0.0)):  # planet, sun, ring
        row, column = centre[1] - round(y / pixel), centre[0] + round(x / pixel)
        assert image[row, column].max() < 0.9


def test_pressure_of_a_whole_set_is_drawn_over_all_contacts(tmp_path):
    path = tmp_path / "set.png"
    options = ("--zoom", "set", "--resolution", "coarse", "--width", "640")
    run("liu-countershaft", *options, "--field", "pressure", "-o", str(path))
    image = imread(path)[40:, : int(640 * (1.0 - MARGIN)), :3]
    coloured = np.ptp(image, axis=2) > 0.12  # lines of a pixel; bodies are grey
    _, columns = np.nonzero(coloured)
    assert (columns < 200).any()  # of the first mesh
    assert (columns > 230).any()  # and of the second
    assert 0.2 < (np.abs(image - [0.835, 0.859, 0.882]).max(axis=2) < 0.02).mean() < 0.9


def test_page_of_a_whole_set_names_its_gears(tmp_path):
    path = tmp_path / "set.html"
    run("liu-idler", "--zoom", "set", "--resolution", "coarse", "-o", str(path))
    text = path.read_text(encoding="utf-8")
    data = json.loads(re.search(r'json">(.*?)</script>', text, re.DOTALL)[1])
    assert data["names"] == ["pinion", "idler", "follower"]
    assert data["starts"][0] == 0
    assert data["starts"] == sorted(set(data["starts"]))
    assert "on the input" in text


@pytest.mark.slow
def test_film_of_a_third_of_a_turn_ends_where_it_began(tmp_path):
    """Only all gears drawn show a planet or tooth that is not where others were."""
    path = tmp_path / "turn.gif"
    turn = ("--turns", "0.333333333333", "--frames", "12", "--width", "480")
    run(*SET, *turn, "-o", str(path))
    with Image.open(path) as film:
        assert film.n_frames == 12
        frames = []
        for i in range(film.n_frames):
            film.seek(i)
            frames.append(np.asarray(film.convert("RGB"), float)[30:, :400])
    steps = [np.abs(a - b).mean() for a, b in pairwise([*frames, frames[0]])]
    assert min(steps) > 0.5
    assert steps[-1] < 1.5 * np.median(steps)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--zoom", "set", "--mesh", "2"), "--mesh = 2; --zoom set draws all"),
        (("--zoom", "set", "--torque", "0"), "--torque = 0; --zoom set needs a load"),
        (("--zoom", "set", "--position", "1.5"), "position = 1.5; must be 0 to 1"),
        (("--zoom", "set", "--turns", "1"), "only films have frames"),
        (("--zoom", "set", "--time-history", "h.csv"), "draws gears at rest"),
    ],
)
def test_options_that_do_not_suit_a_whole_set(tmp_path, arguments, message):
    output = tmp_path / "a.png"
    with pytest.raises(InputError) as caught:
        run("planetary-24-36-96", *arguments, "-o", str(output))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not output.exists()


def test_turns_are_those_of_films_of_whole_sets(tmp_path):
    with pytest.raises(InputError, match="--turns = 1; needs --zoom set"):
        run("--turns", "1", "-o", str(tmp_path / "a.gif"))
