"""Pages for browsers: whole in one file, true in their numbers, safe in their words."""

from __future__ import annotations

import gzip
import json
import re
import shutil
import subprocess
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from fegear.gearset import load_gear_set
from fegear.rendering.fields import contact_field, mesh_scene
from fegear.rendering.look import look_of, picture_aspect, ribbon_base
from fegear.rendering.viewer_page import page
from fegear.statics.settings import StaticsSettings

SHOWN = ("von-mises", "principal", "displacement", "pressure")


@pytest.fixture(scope="module")
def scene(compliance_cache):
    return mesh_scene(load_gear_set("liu-pair"), 0, StaticsSettings())


@pytest.fixture(scope="module")
def field(scene):
    return contact_field(scene, 100.0, 0.5, scene.view("contact", picture_aspect()))


@pytest.fixture(scope="module")
def looks(scene, field):
    view = scene.view("contact", picture_aspect())
    module = scene.mesh.pair.driver.module
    return [look_of([field], name, view, module) for name in SHOWN]


def data_of(text: str) -> dict:
    script = re.search(r'type="application/json">(.*?)</script>', text, re.DOTALL)
    assert script
    return json.loads(script[1])


def unpacked(text: str, kind: str, columns: int = 1) -> np.ndarray:
    values = np.frombuffer(gzip.decompress(b64decode(text)), kind)
    return values.reshape(-1, columns) if columns > 1 else values


def test_numbers_are_those_of_the_fields(field, looks):
    data = data_of(page(field, looks, "title"))
    used_nodes = [np.union1d(gear.triangles, gear.outline) for gear in field.gears]
    gear_nodes = list(zip(field.gears, used_nodes, strict=True))
    points = unpacked(data["points"], "<f4", 2) + data["center"]
    expected = 1e3 * np.vstack([gear.points[nodes] for gear, nodes in gear_nodes])
    np.testing.assert_allclose(points, expected, atol=1e-4)  # mm
    motion = unpacked(data["motion"], "<f4", 2)
    expected = 1e3 * np.vstack([gear.motion[nodes] for gear, nodes in gear_nodes])
    np.testing.assert_allclose(motion, expected, rtol=1e-3, atol=1e-9)
    stress = unpacked(data["fields"][0]["values"], "<f4")
    expected = 1e-6 * np.concatenate(
        [gear.von_mises[nodes] for gear, nodes in gear_nodes]
    )
    np.testing.assert_allclose(stress, expected, rtol=1e-3)
    triangles = unpacked(data["triangles"], "<u4", 3)
    assert triangles.max() == len(points) - 1
    assert len(triangles) == 4 * sum(len(gear.triangles) for gear in field.gears)
    a, b, c = (points[triangles[:, i]] for i in range(3))
    (ax, ay), (bx, by) = (b - a).T, (c - a).T
    area = ax * by - ay * bx
    assert (area > 0.0).mean() > 0.999
    outline = points[unpacked(data["outline"], "<u4", 2)]
    sides = [gear.points[gear.outline] for gear in field.gears]
    expected = np.vstack([side[:, i : i + 2] for i in (0, 1) for side in sides])
    np.testing.assert_allclose(outline, 1e3 * expected, atol=1e-4)
    assert [entry["unit"] for entry in data["fields"]] == ["MPa", "MPa", "um", "MPa"]


def test_ribbon_stands_on_the_contact(field, looks):
    data = data_of(page(field, looks, "title"))
    ribbon = data["ribbon"]
    base = unpacked(ribbon["points"], "<f4", 2) + data["center"]
    motion = unpacked(ribbon["motion"], "<f4", 2)
    crest = unpacked(ribbon["crest"], "<f4", 2)
    pressure = unpacked(ribbon["values"], "<f4")
    assert pressure.max() == pytest.approx(
        1e-6 * max(pair.pressure.max() for pair in field.pairs), rel=1e-6
    )
    top = int(np.hypot(*crest.T).argmax())
    displaced = base[top] + data["scale"] * motion[top]
    places = np.vstack([1e3 * ribbon_base(pair, looks[0]) for pair in field.pairs])
    assert np.hypot(*(places - displaced).T).min() < 1e-4


def test_many_nodes_are_thinned_out(field, looks, monkeypatch):
    monkeypatch.setattr("fegear.rendering.viewer_page.MIN_NODES_OF_CORNERS", 100)
    data = data_of(page(field, looks, "title"))
    assert len(unpacked(data["triangles"], "<u4", 3)) == sum(
        len(gear.triangles) for gear in field.gears
    )
    count = len(unpacked(data["points"], "<f4", 2))
    assert count == len(unpacked(data["fields"][0]["values"], "<f4"))
    assert unpacked(data["outline"], "<u4").max() < count


def test_a_page_needs_no_other_file(field, looks):
    text = page(field, looks, "title")
    assert len(text) < 5e6
    assert not re.search(r"https?:|src=|href=|@import|@[A-Z]+@", text)
    assert "default-src 'none'" in text


def test_words_of_files_stay_words(field, looks):
    nasty = '</script><script>alert("1")</script>@DATA@'
    gears = tuple(replace(gear, name=nasty) for gear in field.gears)
    text = page(replace(field, gears=gears), looks, nasty)
    assert nasty not in text
    assert text.count("<script") == page(field, looks, "").count("<script")
    assert data_of(text)["names"] == [nasty, nasty]
    assert "&lt;/script&gt;" in text


def test_loads_add_up_in_the_table(field, looks):
    text = page(field, looks, "title")
    rows = re.findall(r"<tr><td>(-?\d+|sum)</td><td>(\d+)</td>", text)
    assert len(rows) == len(field.pairs) + 1
    assert abs(sum(int(load) for _, load in rows[:-1]) - int(rows[-1][1])) <= 1
    html = page(replace(field, pairs=()), looks, "title")
    assert "No tooth pair carries load" in html


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no browser")
def test_browser_draws_the_stress_without_a_network(field, looks, tmp_path):
    path, picture = tmp_path / "contact.html", tmp_path / "contact.png"
    path.write_text(page(field, looks, "title"), encoding="utf-8")
    options = "--headless --no-sandbox --use-angle=swiftshader --window-size=1200,700"
    options += " --enable-unsafe-swiftshader --virtual-time-budget=3000"
    subprocess.run(
        [
            "chromium",
            *options.split(),
            "--host-resolver-rules=MAP * ~NOTFOUND",
            f"--user-data-dir={tmp_path / 'profile'}",
            f"--screenshot={picture}",
            path.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )
    view = imread(picture)[80:, :900, :3]
    strongest = np.array([0.48, 0.016, 0.011])  # the end of the colour map turbo
    close = np.abs(view - strongest).max(axis=2) < 0.05
    assert 50 < close.sum() < 0.05 * close.size  # at the contacts and in fillets
    assert (view.min(axis=2) > 0.99).mean() > 0.02  # tooth spaces
