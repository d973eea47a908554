"""Undercut teeth against the rack that cuts them, and their outlines."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from conftest import make_gear
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize_scalar

from fegear.commands.show.gear_set_figure import tooth_outline
from meshes import GearPair, GeometryError
from meshes.gear import fillet_at
from meshes.outline import MeshSize, half_sector_outline
from meshes.pairing import tip_clearance, undercut_clearance
from meshes.profile import fillet_points, flank_points

MODULE = 2.54e-3


def gear_of(teeth, shift=0.0, angle=20.0, **changes):
    tip = MODULE * (0.5 * teeth + 1.0 + shift)
    values = {"hub_radius": 1e-3, "tip_radius": tip, "profile_shift": shift}
    values["pressure_angle"] = math.radians(angle)
    return make_gear(teeth, **values | changes)


def distance_from_rack_tip(gear, roll_length):
    """Least distance of an involute point from the centre of the rack's rounded tip
    while the rack rolls off [m].

    In the frame of the space, whose axis is y, the rack's tooth is symmetric about it.
    """
    alpha, r, rho = gear.pressure_angle, gear.reference_radius, gear.rack_tip_radius
    tooth = MODULE * (0.5 * math.pi + 2.0 * gear.profile_shift * math.tan(alpha))
    depth = gear.dedendum - gear.profile_shift * MODULE  # below the rolling line
    half = 0.5 * (math.pi * MODULE - tooth) - depth * math.tan(alpha)
    x = half - rho * (1.0 - math.sin(alpha)) / math.cos(alpha)
    x, y = -x, depth - rho
    (px, py) = flank_points(gear, roll_length)
    radius, angle = math.hypot(px, py), math.atan2(px, py) - math.pi / gear.teeth

    def distance(turn):
        cx, cy = x + r * turn, r - y
        # the space has turned clockwise by as much as the rack has gone to the right
        return math.hypot(
            radius * math.sin(angle + turn) - cx, radius * math.cos(angle + turn) - cy
        )

    grid = np.linspace(-1.0, 1.0, 201)
    best = grid[np.argmin([distance(t) for t in grid])]
    return minimize_scalar(
        distance, bounds=(best - 0.02, best + 0.02), options={"xatol": 1e-12}
    ).fun


@pytest.mark.parametrize(
    ("teeth", "shift", "angle"),
    [(12, 0.0, 20.0), (8, 0.1, 20.0), (14, -0.2, 20.0), (16, 0.0, 14.5), (9, 0.0, 25)],
)
def test_the_flank_ends_where_the_rack_tip_cuts_it(teeth, shift, angle):
    gear = gear_of(teeth, shift, angle)
    assert gear.is_undercut

    def excess(s):
        return distance_from_rack_tip(gear, s) - gear.rack_tip_radius

    s = gear.form_roll_length
    assert excess(0.8 * s) < 0.0 < excess(1.2 * s)
    assert s == pytest.approx(brentq(excess, 0.8 * s, 1.2 * s, xtol=1e-13), rel=1e-6)
    np.testing.assert_allclose(
        fillet_points(gear, gear.form_normal_angle), flank_points(gear, s), atol=1e-15
    )


def test_fillet_points_and_numbers_are_the_same():
    gear = gear_of(12)
    for beta in np.linspace(0.0, 1.2, 9):
        x, y = fillet_points(gear, beta)
        expected = math.hypot(x, y), math.atan2(x, y)
        assert fillet_at(gear, beta) == pytest.approx(expected, rel=1e-13)


def segments_cross(points):
    """Whether segments of a polyline (n, 2) that are no neighbours intersect."""
    a, b = points[:-1], points[1:]

    def side(p, q, r):
        return np.sign(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1])
            - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    one, two = a[:, None], b[:, None]
    crosses = side(one, two, a[None]) * side(one, two, b[None]) < 0
    crosses &= crosses.T
    i, j = np.indices(crosses.shape)
    return bool((crosses & (np.abs(i - j) > 1)).any())


@settings(max_examples=60, deadline=None)
@given(
    teeth=st.integers(8, 16),
    shift=st.floats(-0.3, 0.3),
    angle=st.floats(14.5, 25.0),
    rounding=st.floats(0.05, 0.3),
)
def test_outlines_do_not_cross_themselves(teeth, shift, angle, rounding):
    try:
        gear = gear_of(teeth, shift, angle, rack_tip_radius=rounding * MODULE)
    except GeometryError:
        assume(False)
    outline = tooth_outline(gear)
    assert not segments_cross(outline)
    x, y = outline.T
    assert (np.abs(np.arctan2(x, y)) <= math.pi / teeth + 1e-12).all()
    pieces = half_sector_outline(gear, MeshSize())
    for before, after in pairwise(pieces):
        ends = before.vertices[-1], after.vertices[0]
        np.testing.assert_allclose(*ends, atol=1e-9 * gear.reference_radius)
    fillet = next(piece for piece in pieces if piece.name == "fillet").vertices
    assert (np.diff(np.hypot(*fillet.T)) < 0.0).all()


@settings(max_examples=60, deadline=None)
@given(teeth=st.integers(17, 60), shift=st.floats(-0.3, 0.8))
def test_a_tooth_without_undercut_is_cut_as_by_the_formula(teeth, shift):
    try:
        gear = gear_of(teeth, shift)
    except GeometryError:
        assume(False)
    assume(not gear.is_undercut)
    sin = math.sin(gear.pressure_angle)
    rounding = gear.rack_tip_radius * (1.0 - sin)
    depth = gear.dedendum - gear.profile_shift * gear.module - rounding
    assert gear.form_roll_length == gear.reference_radius * sin - depth / sin
    assert gear.form_normal_angle == 0.5 * math.pi - gear.pressure_angle


def test_the_form_circle_does_not_jump_where_undercut_begins():
    sin2 = math.sin(math.radians(20.0)) ** 2
    least = 1.25 - 0.3 * (1.0 - math.sqrt(sin2)) - 6.0 * sin2
    two = [gear_of(12, least + change) for change in (-1e-6, 1e-6)]
    assert [gear.is_undercut for gear in two] == [True, False]
    assert max(gear.form_roll_length for gear in two) < 1e-4 * MODULE


def test_a_tooth_that_is_cut_through_is_refused():
    with pytest.raises(GeometryError, match=r"undercut leaves .* of the tooth's foot"):
        gear_of(6, -0.6)


def test_the_path_of_contact_ends_where_the_flank_is_cut_off():
    pinion, wheel = gear_of(12), gear_of(45)
    center = 0.5 * MODULE * 57 + 1e-5
    pair = GearPair(pinion, wheel, center)
    assert pair.path_start == pinion.form_roll_length
    assert pair.path_start > pair.line_of_action - wheel.tip_roll_length
    swapped = pair.swapped
    assert swapped.contact_ratio == pytest.approx(pair.contact_ratio, rel=1e-12)
    assert 1.2 < pair.contact_ratio < 1.3


def clearance_of_polygon(gear, mate, center_distance, along_line=False):
    """The same from points: the mate's tooth turns beside the gear's outline.

    along_line : on the base circle, before the path of contact begins
    """
    ratio = gear.teeth / mate.teeth
    angle = math.acos((gear.base_radius + mate.base_radius) / center_distance)
    best = math.inf
    start = gear.form_roll_length / gear.base_radius - math.tan(angle)
    fillet = fillet_points(gear, np.linspace(0.0, gear.form_normal_angle, 2000))
    radii, angles = np.hypot(*fillet.T), np.arctan2(*fillet.T)
    for turn in np.linspace(-0.6, 0.6, 6001):
        # centre of the mate above; flanks touch at the pitch point at turn 0
        gear_axis = gear.half_angle(gear.base_radius / math.cos(angle)) + turn
        corner = mate.half_angle(mate.base_radius / math.cos(angle))
        corner -= mate.half_angle(mate.tip_radius)
        phi = ratio * turn - corner
        x = -mate.tip_radius * math.sin(phi)
        y = center_distance - mate.tip_radius * math.cos(phi)
        radius = math.hypot(x, y)
        if gear.root_radius < radius < gear.form_radius:
            place = gear_axis + math.atan2(x, y)
            edge = np.interp(radius, radii, angles)
            if not along_line:
                best = min(best, radius * (place - edge))
            elif -turn < start:  # the gear turns against its roll length
                best = min(best, gear.base_radius * (place - edge))
    return best


@pytest.mark.parametrize("teeth", [10, 12, 14])
def test_clearance_of_the_undercut_is_that_of_polygons(teeth):
    gear, mate = gear_of(teeth), gear_of(45)
    center = 0.5 * MODULE * (teeth + 45) + 1e-5
    clearance = undercut_clearance(gear, mate, center)
    assert clearance > 0.0
    expected = clearance_of_polygon(gear, mate, center)
    assert clearance == pytest.approx(expected, abs=3e-6)


@pytest.mark.parametrize("teeth", [10, 12, 14])
def test_clearance_of_the_tip_before_the_path_is_that_of_polygons(teeth):
    gear, mate = gear_of(teeth, 0.05), gear_of(45)
    center = 0.5 * MODULE * (teeth + 45.1) + 1e-5
    expected = clearance_of_polygon(gear, mate, center, along_line=True)
    clearance = tip_clearance(gear, mate, center)
    assert clearance == pytest.approx(expected, abs=3e-6)
    assert 0.0 < clearance < 1e-4


def test_tips_stay_above_the_fillet_before_the_path_of_ordinary_teeth():
    for teeth, other in [(20, 45), (30, 30), (60, 18)]:
        gear, mate = gear_of(teeth), gear_of(other)
        center = 0.5 * MODULE * (teeth + other) + 1e-5
        assert math.isinf(tip_clearance(gear, mate, center))
