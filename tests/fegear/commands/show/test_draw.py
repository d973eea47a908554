"""The picture: teeth that interlock, and files that are whole."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from drawn_figures import axis_labels, saved_figures

import fegear
from fegear.commands.show.gear_set_figure import (
    gear_outline,
    gear_set_figure,
    line_of_action,
)
from fegear.gearset import GearSet, builtin_names, load_gear_set, read_gear_set
from fegear.gearset.placing import layout


def train(*meshes: tuple[str, str, str]) -> GearSet:
    """Gears a to d in meshes (driver, driven, further key)."""
    text = 'name = "train"\n[defaults]\nmodule_mm = 2\nface_width_mm = 20\n'
    for name, teeth in zip("abcd", (30, 41, 36, 25), strict=True):
        text += f'[[gear]]\nname = "{name}"\nteeth = {teeth}\nhub_radius_mm = 10\n'
    for driver, driven, more in meshes:
        text += f'[[mesh]]\ndriver = "{driver}"\ndriven = "{driven}"\n'
        text += f"operating_pressure_angle_deg = 20.5\n{more}\n"
    return read_gear_set(text)


SETS = {name: load_gear_set(name) for name in builtin_names()} | {
    "listed backward": train(("b", "c", ""), ("a", "b", "")),
    "two drivers": train(("a", "b", ""), ("c", "b", ""), ("d", "b", "")),
    "two driven": train(("a", "b", ""), ("a", "c", "phase = 0.3"), ("c", "d", "")),
    "apart": train(("a", "b", ""), ("c", "d", "phase = 0.1")),
    "bent": train(
        ("a", "b", "center_line_deg = 20"), ("b", "c", "center_line_deg = 75")
    ),
    "branching": train(
        ("a", "b", "center_line_deg = -90"),
        ("a", "c", "center_line_deg = 50"),
        ("d", "c", "center_line_deg = 115"),
    ),
}
PAIRS = [
    pytest.param(name, number, id=f"{name}-{number}")
    for name, gear_set in SETS.items()
    for number in range(len(gear_set.meshes))
]


def outlines(name: str, number: int):
    """Mesh and the outlines of its driver and driven gear as drawn [m]."""
    gear_set = SETS[name]
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
    assert one.sense == -two.sense * mesh.pair.sign


@pytest.mark.parametrize(("name", "number"), PAIRS)
def test_drawn_teeth_do_not_overlap(name, number):
    """No corner of one outline lies deeper in the other than the chords' error."""
    from matplotlib.path import Path

    mesh, _, (one, two) = outlines(name, number)
    signs = mesh.pair.driver.sign, mesh.pair.driven.sign
    for points, body, sign in ((one, two, signs[1]), (two, one, signs[0])):
        within = Path(body).contains_points(points)
        inside = points[
            within if sign > 0 else ~within
        ]  # a ring is outside of its line
        depths = [distance_to(body, point) for point in inside]
        assert max(depths, default=0.0) < 2e-3 * mesh.pair.driver.module


@pytest.mark.parametrize(("name", "number"), PAIRS)
def test_drive_flanks_meet_on_the_line_of_action(name, number):
    """Both outlines cross the line at the phase that the mesh is drawn in."""
    mesh, placed, curves = outlines(name, number)
    if mesh.phase is None:
        pytest.skip("drawn at whatever phase a row of centres gives")
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


@pytest.mark.parametrize(
    "name", ["two drivers", "two driven", "apart", "bent", "branching"]
)
def test_gears_that_do_not_mesh_stand_apart(name):
    gear_set = SETS[name]
    places = layout(gear_set).places
    meshing = [{mesh.driver, mesh.driven} for mesh in gear_set.meshes]
    for one, two in combinations(places, 2):
        if {one, two} in meshing:
            continue
        centers = [(places[index].x, places[index].y) for index in (one, two)]
        tips = [gear_set.gears[index].geometry.tip_radius for index in (one, two)]
        assert math.dist(*centers) > sum(tips)


def test_a_given_centre_line_is_not_turned_by_a_phase():
    bent = train(("a", "b", ""), ("b", "c", "center_line_deg = 75\nphase = 0.3"))
    assert layout(bent).directions == pytest.approx({0: 0.0, 1: math.radians(75.0)})


def test_first_driver_is_drawn_counter_clockwise():
    assert layout(SETS["listed backward"]).places[1].sense == 1


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_picture_is_written_and_nothing_else(tmp_path, suffix):
    path = tmp_path / f"gears{suffix}"
    with saved_figures() as figures:
        fegear.run(fegear.DerivedGeometry(gear_set="liu-pair")).write(path)
    assert axis_labels(*figures) == {"x [mm]", "y [mm]"}
    assert list(tmp_path.iterdir()) == [path]


def test_names_are_no_formulas(tmp_path):
    gear_set = load_gear_set("liu-pair")
    gears = tuple(replace(gear, name=r"$\nonsense{$") for gear in gear_set.gears)
    odd = replace(gear_set, name=r"$\nonsense{$", gears=gears, description="")
    path = tmp_path / "gears.svg"
    fegear.run(fegear.DerivedGeometry(gear_set=odd)).draw(
        path
    )  # matplotlib would refuse the formula
    assert path.read_text("utf-8").count(r"$\nonsense{$") >= 3


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_sections_of_helical_gears_are_named(helix):
    tables = {
        "name": "pair",
        "defaults": {
            "module_mm": 3.0,
            "helix_angle_deg": helix,
            "hub_radius_mm": 15.0,
            "face_width_mm": 30.0,
        },
        "gear": [{"name": "one", "teeth": 25}, {"name": "two", "teeth": 40}],
        "mesh": [{"driver": "one", "driven": "two"}],
    }
    figure = gear_set_figure(fegear.make_gear_set(tables))
    texts = [figure.get_suptitle(), *(axes.get_title() for axes in figure.axes)]
    named = any("transverse section" in text for text in texts)
    angle = any("overlap ratio 1.089, helix angle 20.00 deg" in text for text in texts)
    assert (named, angle) == (helix > 0.0,) * 2
