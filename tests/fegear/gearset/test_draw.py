"""The picture: teeth that interlock, and files that are whole."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.errors import InputError
from fegear.gearset import builtin_names, load_gear_set
from fegear.gearset.draw import (
    gear_outline,
    line_of_action,
    require_picture,
    save_gear_set_figure,
)
from fegear.gearset.placing import layout

PAIRS = [
    pytest.param(name, number, id=f"{name}-{number}")
    for name in builtin_names()
    for number in range(len(load_gear_set(name).meshes))
]


def outlines(name: str, number: int):
    """Mesh and the outlines of its driver and driven gear as drawn [m]."""
    gear_set = load_gear_set(name)
    mesh, placed = gear_set.meshes[number], layout(gear_set)
    curves = [
        gear_outline(gear_set.gears[index].geometry, placed.places[index])
        for index in (mesh.driver, mesh.driven)
    ]
    return mesh, placed, curves


@pytest.mark.parametrize(("name", "number"), PAIRS)
def test_centres_are_at_their_distance(name, number):
    mesh, placed, _ = outlines(name, number)
    one, two = placed.places[mesh.driver], placed.places[mesh.driven]
    distance = np.hypot(two.x - one.x, two.y - one.y)
    assert distance == pytest.approx(mesh.pair.center_distance)
    assert one.sense == -two.sense


@pytest.mark.parametrize(("name", "number"), PAIRS)
def test_drawn_teeth_do_not_overlap(name, number):
    """No corner of one outline lies deeper in the other than the chords' error."""
    from matplotlib.path import Path

    mesh, _, (one, two) = outlines(name, number)
    for points, body in ((one, two), (two, one)):
        inside = points[Path(body).contains_points(points)]
        depths = [distance_to(body, point) for point in inside]
        assert max(depths, default=0.0) < 2e-3 * mesh.pair.driver.module


@pytest.mark.parametrize(("name", "number"), PAIRS)
def test_drive_flanks_meet_on_the_line_of_action(name, number):
    """Both outlines cross the line at the phase that the mesh is drawn in."""
    mesh, placed, curves = outlines(name, number)
    line = line_of_action(mesh, placed.places[mesh.driver], placed.directions[number])
    pair = mesh.pair
    for shift in (0.0, -1.0, 1.0):
        phase = (mesh.phase or 0.0) + shift
        roll_length = pair.pitch_point + phase * pair.base_pitch
        if not pair.path_start < roll_length < pair.path_end:
            continue
        point = 1e-3 * np.array(line.at(roll_length))
        for curve in curves:
            assert distance_to(curve, point) < 2e-3 * pair.driver.module


def distance_to(curve, point) -> float:
    """From a point to a closed polygon (n, 2)."""
    start, end = curve, np.roll(curve, -1, axis=0)
    edge = end - start
    along = np.einsum("ij,ij->i", point - start, edge) / np.einsum(
        "ij,ij->i", edge, edge
    )
    nearest = start + np.clip(along, 0.0, 1.0)[:, None] * edge
    return float(np.hypot(*(nearest - point).T).min())


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_picture_is_written_and_nothing_else(tmp_path, suffix):
    path = tmp_path / f"gears{suffix}"
    save_gear_set_figure(load_gear_set("liu-pair"), path)
    assert path.stat().st_size > 5000
    assert list(tmp_path.iterdir()) == [path]


def test_unknown_picture_format(tmp_path):
    with pytest.raises(InputError, match=r"must end in \.png, \.pdf, \.svg"):
        require_picture(tmp_path / "gears.docx")
