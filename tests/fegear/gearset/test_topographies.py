"""Topographies of a gear set: keys, measured points, refusals and figures."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from small_sets import PAIR

from fegear.commands.show.derived import mesh_figures
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.edit import edited
from fegear.gearset.leads import require_no_width_gap, require_uniform_loads
from fegear.gearset.modifications import FlankTopography
from fegear.gearset.read import files_of_gear_set, load_tables, relative_tables
from fegear.gearset.topographies import topography_keys
from fegear.gearset.zones import zones

GRID = {
    "roll_angle_deg": [15.0, 22.0, 28.0],
    "place_mm": [-4.0, 3.0],
    "depth_um": [[0.0, 2.0], [1.0, 0.0], [-3.0, 4.0]],
}


def pair(role="driver", **keys):
    return edited(PAIR, {f"mesh.1.{role}_topography": {**GRID, **keys}})


def topographies(tables):
    return [flank.topography for flank in make_gear_set(tables).meshes[0].flanks]


def test_points_are_those_of_the_lists():
    gears = make_gear_set(pair())
    grid, none = (flank.topography for flank in gears.meshes[0].flanks)
    assert none is None
    radius = gears.gears[0].geometry.base_radius
    rolls = radius * np.radians(GRID["roll_angle_deg"])
    for (i, roll), (j, place) in product(enumerate(rolls), enumerate([-4e-3, 3e-3])):
        depth = grid.depth(np.array([roll]), np.array([place]))
        assert depth[0] == pytest.approx(1e-6 * GRID["depth_um"][i][j], abs=1e-18)
    assert gears.meshes[0].varies_over_width
    _, driven = topographies(pair("driven", roll_angle_deg=[17.0, 22.0, 27.0]))
    assert driven.places == pytest.approx((-4e-3, 3e-3))


def test_measured_points_are_an_excess_in_any_order(tmp_path):
    points = [
        (roll, place, -GRID["depth_um"][i][j])
        for i, roll in enumerate(GRID["roll_angle_deg"])
        for j, place in enumerate(GRID["place_mm"])
    ]
    np.random.default_rng(5).shuffle(points)
    text = "place_mm,deviation_um,roll_angle_deg\n"
    text += "".join(f"{place},{value},{roll}\n" for roll, place, value in points)
    (tmp_path / "flank.csv").write_text(text)
    tables = edited(PAIR, {"mesh.1.driver_topography": {"file": "flank.csv"}})
    path = tmp_path / "pair.toml"
    path.write_text(toml_text(tables))
    loaded = load_gear_set(path).meshes[0].driver_flank.topography
    assert loaded == topographies(pair())[0]
    assert [Path(file) for file in files_of_gear_set(str(path), {})] == [
        tmp_path / "flank.csv"
    ]
    again = relative_tables(load_tables(str(path), {}), path)
    assert again["mesh"][0]["driver_topography"] == {"file": "flank.csv"}


@pytest.mark.parametrize("missing", range(6))
def test_a_grid_with_a_hole_is_refused(tmp_path, missing):
    points = list(product(GRID["roll_angle_deg"], GRID["place_mm"]))
    roll, place = points.pop(missing)
    text = "roll_angle_deg,place_mm,deviation_um\n"
    text += "".join(f"{a},{b},0\n" for a, b in points)
    (tmp_path / "flank.csv").write_text(text)
    tables = edited(PAIR, {"mesh.1.driver_topography": {"file": "flank.csv"}})
    (tmp_path / "pair.toml").write_text(toml_text(tables))
    with pytest.raises(InputError) as refused:
        load_gear_set(tmp_path / "pair.toml")
    assert f"roll_angle_deg = {roll:g}, place_mm = {place:g}" in str(refused.value)
    assert "3 roll angles at each of 2 places" in str(refused.value)


def test_a_point_that_is_there_twice_is_refused(tmp_path):
    text = "roll_angle_deg,place_mm,deviation_um\n20,1,0\n20,2,0\n20,1,3\n"
    (tmp_path / "flank.csv").write_text(text)
    tables = edited(PAIR, {"mesh.1.driver_topography": {"file": "flank.csv"}})
    (tmp_path / "pair.toml").write_text(toml_text(tables))
    with pytest.raises(InputError, match=r"line 4: roll_angle_deg = 20, place_mm = 1"):
        load_gear_set(tmp_path / "pair.toml")
    (tmp_path / "flank.csv").write_text("roll_angle_deg,deviation_um\n20,1\n")
    with pytest.raises(InputError, match="needs the columns roll_angle_deg, place_mm"):
        load_gear_set(tmp_path / "pair.toml")


@pytest.mark.parametrize("bias", [4.0, -2.5])
def test_a_bias_twists_the_active_profile(bias):
    tables = edited(PAIR, {"mesh.1.driver_topography": {"bias_um": bias}})
    gears = make_gear_set(tables)
    grid = gears.meshes[0].driver_flank.topography
    flank, half = zones(gears.meshes[0].pair, "driver"), 5e-3
    middle = 0.5 * (flank.start + flank.tip)
    cases = {
        (flank.tip, half): 0.5,
        (flank.tip, -half): -0.5,
        (flank.start, half): -0.5,
        (flank.start, -half): 0.5,
        (middle, half): 0.0,
        (flank.tip, 0.0): 0.0,
        (flank.tip, 0.5 * half): 0.25,
        (0.5 * flank.start, half): -0.5,
    }
    for (roll, place), part in cases.items():
        depth = float(grid.depth(np.array([roll]), np.array([place]))[0])
        assert depth == pytest.approx(part * bias * 1e-6, abs=1e-15)
    assert topographies(edited(PAIR, {"mesh.1.driver_topography": {}})) == [None] * 2


def test_a_bias_comes_to_the_points():
    one, two, both = (
        topographies(edited(PAIR, {"mesh.1.driver_topography": keys}))[0]
        for keys in (GRID, {"bias_um": 3.0}, {**GRID, "bias_um": 3.0})
    )
    rng = np.random.default_rng(8)
    roll = rng.uniform(0.0, 1.1 * max(two.roll_lengths), 200)
    place = rng.uniform(-5e-3, 5e-3, 200)
    together = one.depth(roll, place) + two.depth(roll, place)
    assert both.depth(roll, place) == pytest.approx(together, abs=1e-17)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"depth_um": [[0.0, 1.0]] * 2}, "depth_um has 2 lists; must be 3, one for"),
        (
            {"depth_um": [[0.0, 1.0], [1.0], [0.0, 1.0]]},
            "depth_um entry 2 has 1 depths; must be 2, one for each place_mm",
        ),
        ({"place_mm": [3.0, -4.0]}, "place_mm = -4; must be above the one before, 3"),
        ({"place_mm": [-4.0, 5.1]}, "place_mm = 5.1; must be from -5 to 5"),
        (
            {"roll_angle_deg": [15.0, 22.0, 48.0]},
            "roll_angle_deg = 48; must be from",
        ),
        (
            {"roll_angle_deg": [15.0], "depth_um": [[0.0, 1.0]]},
            "roll_angle_deg = 1 values; must be 2 to 200",
        ),
        (
            {"depth_um": [[0.0, 2.0], [1.0, 0.0], [-3.0, 1001.0]]},
            "depth = 1001 um; must be from -1000 to 1000 um, half the module",
        ),
        ({"bias_um": -1001.0}, "bias_um = -1001 um; must be from -1000 to 1000 um"),
        (
            {"depth_um": [[0.0, 2.0], [1.0, 0.0], [900.0, 4.0]]},
            "must be at most 0.2",
        ),
        ({"file": "flank.csv"}, "file and depth_um are given; only one is allowed"),
    ],
)
def test_bad_topographies_are_refused(keys, message):
    with pytest.raises(InputError) as refused:
        make_gear_set(pair(**keys))
    assert message in str(refused.value)
    assert "driver_topography" in str(refused.value)


RING = {
    "name": "ring",
    "defaults": {"module_mm": 2.0, "face_width_mm": 10.0},
    "gear": [
        {"name": "p", "teeth": 36, "hub_radius_mm": 20.0},
        {"name": "r", "teeth": 96, "internal": True, "rim_radius_mm": 112.0},
    ],
    "mesh": [{"driver": "p", "driven": "r", "center_distance_mm": 60.0}],
    "load": {"gear": "p", "torques_Nm": [20.0]},
}


def of_ring(**keys):
    tables = edited(RING, {"mesh.1.driven_topography": keys})
    return topographies(tables)[1], make_gear_set(tables).meshes[0].pair


def test_angles_of_an_internal_gear_increase_to_its_root():
    """Its tip is inside, so that its roll lengths are from the last angle on."""
    angles = [20.5, 22.0, 24.0]
    keys = {"roll_angle_deg": angles, "place_mm": [-4.0, 4.0]}
    depths = [[3.0, 4.0], [0.0, 1.0], [-1.0, 2.0]]
    grid, pair = of_ring(**keys, depth_um=depths)
    radius = pair.driven.base_radius
    assert radius < 0.0
    for (i, angle), (j, place) in product(enumerate(angles), enumerate([-4e-3, 4e-3])):
        point = np.array([radius * math.radians(angle)]), np.array([place])
        assert grid.depth(*point)[0] == pytest.approx(1e-6 * depths[i][j], abs=1e-18)
    written = topography_keys(grid, radius, 9)
    assert written == keys | {"depth_um": depths}
    with pytest.raises(InputError, match=r"roll_angle_deg = 10; must be from 16\.9"):
        of_ring(**keys | {"roll_angle_deg": [10.0, 22.0, 24.0]}, depth_um=depths)
    twist, pair = of_ring(bias_um=4.0)
    flank = zones(pair, "driven")
    at_far_end = [
        twist.depth(np.array([roll]), np.array([5e-3]))[0]
        for roll in (flank.start, flank.tip)
    ]
    assert at_far_end == pytest.approx([-2e-6, 2e-6])


def test_tasks_of_uniform_loads_refuse_it():
    gears = make_gear_set(pair())
    with pytest.raises(InputError, match="have a topography; allowed for pictures"):
        require_uniform_loads(gears, "pictures")
    with pytest.raises(InputError, match="its lead, topography or misalignment"):
        require_no_width_gap(gears, 0, "a wave")


def test_figures_have_its_points_and_depths():
    flanks = mesh_figures(make_gear_set(pair()), 0)["flanks"]
    assert flanks[0]["topography"] == pytest.approx(
        {
            "roll_angles": 3,
            "places": 2,
            "least_depth_um": -3.0,
            "largest_depth_um": 4.0,
        }
    )
    assert flanks[1]["topography"] is None


def test_points_that_do_not_fit_each_other_are_refused():
    for keys, message in (
        ({"roll_lengths": (1.0, 1.0)}, "roll_lengths must increase"),
        ({"places": (0.0,)}, "places = 1 values; 2 to 200 are needed"),
        ({"depths": ((0.0, 0.0),)}, "depths = 1 rows of"),
        ({"depths": ((0.0, 0.0), (0.0,))}, "depths = 2 rows of"),
        ({"depths": ((0.0, 0.0), (0.0, math.nan))}, "depths"),
    ):
        good = {
            "roll_lengths": (1.0, 2.0),
            "places": (0.0, 1.0),
            "depths": ((0.0, 0.0), (0.0, 0.0)),
        }
        with pytest.raises(InputError, match=message):
            FlankTopography(**{**good, **keys})
