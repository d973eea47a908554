"""Teeth of both wheels: conjugate, those of ordinary gears without eccentricity."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mesh_quality import smallest_jacobian

from meshes import GearPair, GeometryError, SpurGear
from meshes.eccentric import EccentricPair
from meshes.eccentric.base import LEADING, TRAILING
from meshes.eccentric.outline import WheelEdges, outline_points
from meshes.eccentric.teeth import ToothedPair
from meshes.eccentric.wheel_mesh import largest_bore, wheel_mesh

ALPHA = math.radians(20.0)


def pair_of(part, ratio=1, teeth=40, alpha=ALPHA, radius=0.02, **heights):
    pair = EccentricPair(radius, part * radius, ratio)
    return ToothedPair(pair, alpha, teeth, **heights)


def world(points, angle, shift=0.0):
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + [shift, 0.0]


@pytest.mark.parametrize(("part", "ratio"), [(0.3, 1), (0.6, 1), (0.3, 2), (0.2, 3)])
def test_flanks_are_conjugate(part, ratio):
    """Both touch in one point with the normal through the pitch point, to 1e-9 of the
    radius, by the outlines alone."""
    toothed = pair_of(part, ratio)
    pair, step = toothed.pair, 1e-4 * toothed.rack.module
    worst = 0.0
    for number, (start, end) in enumerate(toothed.contact.tolist()):
        place = toothed.rack.pitch * (number - 0.25)
        for arc in np.linspace(start, end, 5).tolist():
            angle = arc / pair.radius
            turns = -float(pair.driver_turn(angle)), float(pair.driven_turn(angle))
            shifts = 0.0, pair.center_distance
            pitch_point = np.array([float(pair.driver_radius(angle)), 0.0])
            points = []
            wheels = (toothed.driver, TRAILING), (toothed.driven, LEADING)
            for (wheel, side), turn, shift in zip(wheels, turns, shifts, strict=True):
                near = wheel.flank(place, arc + step * np.arange(-1.0, 2.0), side)
                back, here, ahead = world(near, turn, shift)
                along = (ahead - back) / np.hypot(*(ahead - back))
                worst = max(worst, abs(along @ (pitch_point - here)) / 1e3)
                points.append(here)
            worst = max(worst, float(np.abs(points[0] - points[1]).max()))
    assert worst < 1e-9 * pair.radius


@pytest.mark.parametrize(("part", "ratio"), [(0.35, 1), (0.35, 2)])
def test_contact_begins_and_ends_at_tip_corners(part, ratio):
    toothed = pair_of(part, ratio, teeth=38)
    count, height = toothed.driven.teeth, toothed.rack.addendum
    for number, arcs in enumerate(toothed.contact):
        place = toothed.rack.pitch * (number - 0.25)
        mate = (number - 1) % count  # whose flank has the same place
        corners = (toothed.driven, LEADING, mate), (toothed.driver, TRAILING, number)
        for arc, (wheel, side, tooth) in zip(arcs, corners, strict=True):
            below = float(wheel.tips[side][1][tooth % wheel.teeth])
            corner = wheel.land(below, height)
            point = wheel.flank(place, arc, side)
            np.testing.assert_allclose(point, corner, atol=1e-9 * toothed.rack.module)


def test_without_eccentricity_they_are_those_of_ordinary_gears():
    teeth, m = 30, 2e-3
    toothed = pair_of(0.0, teeth=teeth, radius=0.5 * m * teeth)
    gear = SpurGear(
        teeth=teeth,
        module=m,
        pressure_angle=ALPHA,
        profile_shift=0.0,
        tip_radius=0.5 * m * teeth + m,
        dedendum=1.25 * m,
        rack_tip_radius=0.3 * m,
        hub_radius=5e-3,
    )
    for wheel in (toothed.driver, toothed.driven):
        rack = wheel.rack
        for side in (LEADING, TRAILING):
            place = wheel.place(side)
            tips = wheel.flank(place, wheel.tips[side][0], side)
            np.testing.assert_allclose(np.hypot(*tips.T), gear.tip_radius, rtol=1e-12)
            form = wheel.flank(place, place + side * rack.form, side)
            np.testing.assert_allclose(np.hypot(*form.T), gear.form_radius, rtol=1e-12)
            bottom = wheel.fillet(float(place[0]), np.zeros(1), side)
            assert np.hypot(*bottom.T) == pytest.approx(gear.root_radius)
        arcs = wheel.tips[LEADING][1] - wheel.tips[TRAILING][1]
        thick = arcs * gear.tip_radius / gear.reference_radius
        np.testing.assert_allclose(thick, gear.tip_thickness, rtol=1e-9)
    ratio = GearPair(gear, gear, 2.0 * gear.reference_radius).contact_ratio
    np.testing.assert_allclose(toothed.contact_ratio, ratio, rtol=1e-10)


@pytest.mark.parametrize(("part", "ratio"), [(0.5, 1), (0.25, 2)])
def test_wheels_do_not_enter_each_other(part, ratio):
    """At every position no point of one outline is deep inside of the other."""
    from matplotlib.path import Path

    toothed = pair_of(part, ratio, teeth=42)
    pair, edges = toothed.pair, WheelEdges(flank=24, fillet=12)
    driver, driven = (
        outline_points(wheel, edges) for wheel in (toothed.driver, toothed.driven)
    )
    allowed = 2e-3 * toothed.rack.module  # chords of the outlines
    for angle in np.linspace(0.1, 6.0, 7):
        one = world(driver, -float(pair.driver_turn(angle)))
        two = world(driven, float(pair.driven_turn(angle)), pair.center_distance)
        for points, other in ((one, two), (two, one)):
            inside = Path(other).contains_points(points)
            for point in points[inside]:
                start, way = other[:-1], np.diff(other, axis=0)
                t = np.sum((point - start) * way, axis=1) / np.sum(way**2, axis=1)
                foot = start + t.clip(0.0, 1.0)[:, None] * way
                assert np.hypot(*(foot - point).T).min() < allowed


def test_both_wheels_are_mirror_images_of_themselves():
    toothed = pair_of(0.4, teeth=31)
    points = outline_points(toothed.driver, WheelEdges())[:-1]
    mirrored = points * [1.0, -1.0]
    nearest = [np.hypot(*(points - p).T).min() for p in mirrored]
    assert max(nearest) < 1e-12


@pytest.mark.parametrize("ratio", [1, 2])
def test_a_mesh_has_its_nodes_on_the_curves(ratio):
    toothed = pair_of(0.3, ratio, teeth=22)
    for wheel in (toothed.driver, toothed.driven):
        edges = WheelEdges(flank=6, fillet=4)
        mesh = wheel_mesh(wheel, 0.004, edges)
        outline = outline_points(wheel, edges)[:-1]
        nodes = mesh.points[mesh.outline[:, 0]]
        assert len(nodes) == len(outline)
        nearest = [np.hypot(*(outline - p).T).min() for p in nodes]
        assert max(nearest) < 1e-12
        np.testing.assert_allclose(
            np.hypot(*mesh.points[np.unique(mesh.bore)].T), 0.004, rtol=1e-12
        )
        assert smallest_jacobian(mesh) > 0.2
        area = _area_of(mesh) + math.pi * 0.004**2
        x, y = outline_points(wheel, WheelEdges().refined(4.0))[:-1].T
        expected = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        assert area == pytest.approx(expected, rel=2e-4)


def _area_of(mesh):
    """Of curved triangles by their boundaries, Simpson's rule."""
    total = 0.0
    for i, (a, b) in enumerate(((0, 1), (1, 2), (2, 0))):
        one, two, mid = (mesh.points[mesh.triangles[:, k]] for k in (a, b, 3 + i))
        for p, q, w in ((one, 4 * mid - 3 * one - two, 1), (mid, two - one, 4)):
            total += w * np.sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
        last = 3 * two - 4 * mid + one
        total += np.sum(two[:, 0] * last[:, 1] - two[:, 1] * last[:, 0])
    return total / 12.0


@pytest.mark.parametrize(
    ("overrides", "field", "reason"),
    [
        ({"part": 0.627, "teeth": 30}, "teeth", "undercut"),
        ({"part": 0.3, "teeth": 12}, "teeth", "undercut"),
        (
            {"part": 0.0, "teeth": 14, "alpha": math.radians(30), "tip_height": 1.2},
            "teeth",
            "pointed",
        ),
        ({"part": 0.0, "alpha": math.radians(34)}, "dedendum", "rack's tips"),
        ({"part": 0.0, "tip_height": 0.0}, "addendum", "must be 0.1 to 2"),
        ({"part": 0.0, "tip_height": math.nan}, "addendum", "must be 0.1 to 2"),
        ({"part": 0.0, "tip_height": 1.25}, "dedendum", "above the addendum"),
        (
            {"part": 0.0, "teeth": 400, "tip_height": 1.24},
            "dedendum",
            "reach into the fillets",
        ),
        ({"part": 0.7, "teeth": 60}, "pressure_angle", "cusps"),
        ({"part": 0.3, "teeth": 4}, "teeth", "must be 5 to"),
        ({"part": 0.0, "teeth": 1001, "ratio": 2}, "teeth", "must be 5 to 1000"),
        ({"part": 0.3, "tip_height": 0.4}, "addendum", "contact ratio falls to 0.7"),
    ],
)
def test_teeth_that_cannot_be(overrides, field, reason):
    with pytest.raises(GeometryError, match=reason) as error:
        pair_of(**overrides)
    assert error.value.field == field


def test_bores_that_do_not_fit():
    wheel = pair_of(0.3).driver
    largest = largest_bore(wheel)
    assert largest == pytest.approx(0.014 - 1.75e-3, rel=1e-6)
    for bore in (0.0, 1.01 * largest, math.nan):
        with pytest.raises(GeometryError, match="at most"):
            wheel_mesh(wheel, bore)


def test_many_teeth():
    toothed = pair_of(0.3, teeth=2_000)
    assert toothed.contact_ratio.min() > 1.7
