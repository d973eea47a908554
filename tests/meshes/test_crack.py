"""Paths of cracks, what is refused, and meshes of sectors with cracks."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear
from hypothesis import given, settings
from hypothesis import strategies as st
from slow_tests import first_are_quick
from whole_gear import COARSE, small_gear, small_ring

from fegear.elasticity.plane_elements import plane_basis
from meshes import MeshSize, sector_mesh
from meshes.crack import CLEARANCE, Crack, arc_lengths, crack_points, fillet_slope
from meshes.cracked_sector import cracked_sector_mesh
from meshes.profile import fillet_points

GEARS = {
    "pinion": make_gear(17, 8e-3, profile_shift=0.4),
    "undercut": make_gear(11, 5e-3),
    "wheel": make_gear(60, 50e-3),
    "thin": make_gear(40, 44.8e-3),
    "ring": small_ring(36),
}
STEEPEST = {  # of tangents that a crack may begin at
    name: max(0.0, fillet_slope(g, g.form_normal_angle)) for name, g in GEARS.items()
}


def test_a_crack_begins_where_the_tangent_has_its_angle():
    gear = GEARS["pinion"]
    for degrees in (20.0, 30.0, 60.0):
        angle = math.radians(degrees)
        mouth, tip = crack_points(gear, Crack(depth=1e-3, tangent_angle=angle))
        dense = fillet_points(gear, np.linspace(0.0, gear.form_normal_angle, 20001))
        nearest = int(np.argmin(np.hypot(*(dense - mouth).T)))
        assert np.hypot(*(dense[nearest] - mouth)) < 1e-6
        way = dense[nearest + 1] - dense[nearest - 1]
        assert math.atan2(-way[0], way[1]) == pytest.approx(angle, abs=1e-3)
        # along the inward normal, by default
        assert (tip - mouth) @ way < 1e-3 * math.hypot(*way) * 1e-3
        assert math.hypot(*(tip - mouth)) == pytest.approx(1e-3)
        assert tip[0] < mouth[0]
        assert tip[1] < mouth[1]


def test_a_direction_is_measured_from_the_centre_line():
    mouth, tip = crack_points(GEARS["pinion"], Crack(depth=1e-3, direction=0.5))
    way = tip - mouth
    assert math.atan2(-way[0], -way[1]) == pytest.approx(0.5)


@pytest.mark.parametrize("name", GEARS)
def test_the_left_fillet_has_the_mirror_image(name):
    crack = Crack(depth=0.5e-3, tangent_angle=STEEPEST[name] + 0.3)
    right, left = (crack_points(GEARS[name], c) for c in (crack, crack.mirrored))
    np.testing.assert_array_equal(left, right * [-1.0, 1.0])
    assert crack.mirrored.mirrored == crack


def test_a_path_is_followed_as_far_as_the_depth():
    gear = GEARS["pinion"]
    mouth = crack_points(gear, Crack(depth=1e-4))[0]
    bends = mouth + np.array(
        [[-0.4e-3, -0.3e-3], [-0.8e-3, -0.3e-3], [-1.6e-3, -0.9e-3]]
    )
    path = tuple((float(x), float(y)) for x, y in bends)
    points = crack_points(gear, Crack(depth=1.4e-3, path=path))
    np.testing.assert_allclose(points[1:3], bends[:2])
    np.testing.assert_allclose(points[3], bends[1] + [-0.4e-3, -0.3e-3])
    assert arc_lengths(points)[-1] == pytest.approx(1.4e-3)
    with pytest.raises(ValueError, match=r"depth = 2 mm; at most 1\.9 mm, the length"):
        crack_points(gear, Crack(depth=2e-3, path=path))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"depth": 0.0}, "depth = 0 mm; must be positive"),
        ({"depth": math.nan}, "depth = nan mm; must be positive"),
        ({"depth": 1e-3, "tangent_angle": 2.0}, "tangent_angle = 114.592 deg; must be"),
        ({"depth": 1e-3, "direction": -0.1}, "direction = -5.72958 deg; must be 0 to"),
        ({"depth": 1e-3, "direction": 0.1, "path": ((0.0, 0.0),)}, "direction: only"),
        ({"depth": 1e-3, "path": ()}, "path: at least one point"),
        ({"depth": 1e-3, "path": ((math.inf, 0.0),)}, "path: its coordinates must be"),
    ],
)
def test_cracks_that_mean_nothing_are_refused(keys, message):
    with pytest.raises(ValueError, match=message):
        Crack(**keys)


@pytest.mark.parametrize(
    ("crack", "message"),
    [
        (Crack(depth=6e-3, direction=math.pi / 2), r"at most 5\.\d* mm .* left fillet"),
        (Crack(depth=2e-6), r"depth = 0.002 mm; at least 0.00\d+ mm"),
        (Crack(depth=6e-3, direction=1.9), r"at most 5\.\d* mm .* left flank"),
        (Crack(depth=9e-3, direction=0.0), r"at most \d\.\d* mm .* right edge of the"),
        (Crack(depth=30e-3, direction=0.24), r"at most 1[01]\.\d* mm .* the hub"),
        (
            Crack(depth=1e-3, tangent_angle=1.45),
            "tangent_angle = 83.0789 deg; tangents",
        ),
        (Crack(depth=1e-3, direction=math.radians(150.0)), "must be from 20 deg into"),
        (Crack(depth=1e-4, path=((0.5, 0.5),)), r"path: the crack begins at -\d+"),
        (Crack(depth=1e-4, path=((1e-3, 18e-3), (1e-3, 18e-3))), "path: two points"),
        (
            Crack(
                depth=2.5e-3,
                path=((1.5e-3, 19e-3), (1.5e-3, 18.9e-3), (2.9e-3, 18.9e-3)),
            ),
            r"path: its points .* mm apart; at least 0\.7 times",
        ),
    ],
)
def test_cracks_that_leave_the_tooth_are_refused(crack, message):
    with pytest.raises(ValueError, match=message) as caught:
        crack_points(GEARS["pinion"], crack)
    assert "\n" not in str(caught.value)


@given(
    name=st.sampled_from(sorted(GEARS)),
    slope=st.floats(0.05, 0.6),
    direction=st.floats(0.0, math.pi),
    left=st.booleans(),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_the_largest_depth_is_allowed(name, slope, direction, left):
    """What a refusal says is true: that depth passes, and has its clearance."""
    crack = Crack(
        depth=1.0,
        tangent_angle=STEEPEST[name] + slope,
        direction=direction,
        left=left,
    )
    gear = GEARS[name]
    with pytest.raises(ValueError, match=r"; (at most|must be)") as caught:
        crack_points(gear, crack)
    largest = re.search(r"at most ([\d.]+) mm", str(caught.value))
    if largest is None or float(largest[1]) == 0.0:
        return
    depth = 1e-3 * float(largest[1])
    mouth, tip = crack_points(gear, replace(crack, depth=depth))
    assert math.hypot(*(tip - mouth)) == pytest.approx(depth)
    other = fillet_points(gear, np.linspace(0.0, gear.form_normal_angle, 2001))
    other = other * ([1.0, 1.0] if left else [-1.0, 1.0])
    assert np.hypot(*(other - tip).T).min() > 0.99 * CLEARANCE * gear.module


def test_two_cracks_that_meet_are_refused():
    gear = GEARS["pinion"]
    one = Crack(depth=3.2e-3, direction=math.pi / 2)
    with pytest.raises(ValueError, match=r"depth = 3\.2 and 3\.2 mm; the two cracks"):
        cracked_sector_mesh(gear, COARSE, [one, one.mirrored])
    with pytest.raises(ValueError, match="2 cracks of a tooth; allowed one at each"):
        cracked_sector_mesh(gear, COARSE, [one, one])


SIZES = {"coarse": COARSE, "default": MeshSize()}


def cracks_of(name):
    angle = STEEPEST[name] + 0.35
    right = Crack(depth=0.9e-3, tangent_angle=angle)
    return {
        "one": [right],
        "left": [right.mirrored],
        "shallow": [replace(right, depth=2e-5)],
        "both": [right, Crack(depth=0.5e-3, tangent_angle=angle, left=True)],
    }


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("kind", ["one", "left", "shallow", "both"])
@pytest.mark.parametrize("name", first_are_quick(GEARS))
def test_a_cracked_sector_fits_its_neighbours(name, kind, size):
    gear, cracks = GEARS[name], cracks_of(name)[kind]
    healthy, mesh = sector_mesh(gear, size), cracked_sector_mesh(gear, size, cracks)
    for edge in ("tip", "flank", "root", "cut", "hub"):
        for edge_name in (edge, f"left_{edge}"):
            if edge_name in healthy.edges:
                np.testing.assert_array_equal(
                    mesh.points[mesh.edges[edge_name]],
                    healthy.points[healthy.edges[edge_name]],
                )
    np.testing.assert_array_equal(
        mesh.points[mesh.flank_nodes], healthy.points[healthy.flank_nodes]
    )
    basis = plane_basis(mesh.points, mesh.triangles, 2)
    assert (basis.mapping.detDF(basis.quadrature[0]) > 0.0).all()
    area = plane_basis(healthy.points, healthy.triangles, 2).dx.sum()
    assert basis.dx.sum() == pytest.approx(area, rel=1e-4)
    assert len(np.unique(mesh.triangles)) == len(mesh.points)


@pytest.mark.parametrize("kind", ["one", "both"])
def test_faces_part_and_meet_at_the_tip(kind):
    cracks = cracks_of("pinion")[kind]
    mesh = cracked_sector_mesh(GEARS["pinion"], COARSE, cracks)
    names = ["left_crack" if crack.left else "crack" for crack in cracks]
    assert [tip.name for tip in mesh.tips] == names
    for crack, tip in zip(cracks, mesh.tips, strict=True):
        edges = mesh.edges[tip.name]
        one, two = np.split(edges, 2)
        assert set(np.unique(one)) & set(np.unique(two)) == {tip.node}
        ends = [mesh.points[face[:, 2]] for face in (one, two)]
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-15)
        length = np.hypot(*(mesh.points[one[:, 1]] - mesh.points[one[:, 0]]).T).sum()
        assert length == pytest.approx(crack.depth)
        quarter, corner = (mesh.points[tip.faces[:, k]] for k in range(2))
        np.testing.assert_allclose(
            quarter - mesh.points[tip.node], 0.25 * (corner - mesh.points[tip.node])
        )


def test_every_edge_of_a_mesh_is_inside_or_named():
    mesh = cracked_sector_mesh(small_gear(13), COARSE, cracks_of("pinion")["both"])
    cells = mesh.triangles
    sides = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    sides, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    free = {tuple(side) for side in sides[count == 1].tolist()}
    named = [np.sort(edges[:, :2], axis=1) for edges in mesh.edges.values()]
    assert free == {tuple(side) for side in np.vstack(named).tolist()}
    assert sum(map(len, named)) == len(free)


def test_faces_run_around_the_body_as_the_outline_does():
    """Outward normals add up to nothing around the whole boundary."""
    mesh = cracked_sector_mesh(small_gear(13), COARSE, cracks_of("pinion")["both"])
    total, size = np.zeros(2), 0.0
    for name, edges in mesh.edges.items():
        ends = edges[:, [1, 0]] if name.startswith("left_") else edges[:, :2]
        way = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
        total += way.sum(axis=0)
        size += np.hypot(*way.T).sum()
        if name.endswith("crack"):  # the second face returns from the tip
            assert ends[-1, 0] == next(t.node for t in mesh.tips if t.name == name)
    assert np.abs(total).max() < 1e-12 * size


def test_meshing_is_deterministic():
    cracks = cracks_of("pinion")["both"]
    one, two = (cracked_sector_mesh(GEARS["pinion"], COARSE, cracks) for _ in range(2))
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.triangles, two.triangles)
