"""Internal gears against the cutter that makes them, and pairs against geometry."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.spatial import cKDTree
from slow_tests import first_are_quick

from fegear.commands.show.gear_set_figure import tooth_outline
from meshes import GearPair, GeometryError
from meshes.internal import InternalGear
from meshes.involute import involute
from meshes.profile import fillet_points, flank_points, flank_tangents, turn
from meshes.tip_interference import corner_clearance, largest_tip

MODULE = 2e-3


def make_ring(teeth=96, **changes):
    values = {
        "teeth": teeth,
        "module": MODULE,
        "pressure_angle": math.radians(20.0),
        "profile_shift": 0.0,
        "tip_radius": -(0.5 * teeth - 0.8) * MODULE,
        "dedendum": 1.25 * MODULE,
        "rack_tip_radius": 0.2 * MODULE,
        "hub_radius": -(0.5 * teeth + 6.0) * MODULE,
        "cutter_teeth": max(8, teeth // 3),
    }
    return InternalGear(**(values | changes))


def make_planet(teeth=36, addendum=1.0, **changes):
    values = {
        "module": MODULE,
        "tip_radius": (0.5 * teeth + addendum) * MODULE,
        "dedendum": 1.25 * MODULE,
        "rack_tip_radius": 0.3 * MODULE,
    }
    return make_gear(teeth, 0.3 * teeth * MODULE, **(values | changes))


RINGS = {
    "plain": make_ring(),
    "small-cutter": make_ring(cutter_teeth=18),
    "large-cutter": make_ring(cutter_teeth=70, rack_tip_radius=0.1 * MODULE),
    "shifted": make_ring(60, profile_shift=-0.4, tip_radius=-(30 - 0.4) * MODULE),
    "thinned": make_ring(
        40, tooth_thinning=60e-6, rack_tip_radius=0.1 * MODULE, cutter_teeth=20
    ),
    "steep": make_ring(
        50, pressure_angle=math.radians(25.0), rack_tip_radius=0.1 * MODULE
    ),
}


def cutter_tooth(ring, count=1500):
    """Outline (n, 2) of a tooth of the cutter about its axis and its outward normals.

    Involute flanks, tips rounded by circles that touch flank and tip circle, the land
    between them. The tooth points up.
    """
    cutter, rho = ring.cutter, ring.rack_tip_radius
    rb, ra = cutter.base_radius, cutter.tip_radius
    half = 0.5 * math.pi / cutter.teeth + involute(cutter.pressure_angle)

    def flank(s):
        """Right flank and its outward normal at a roll length."""
        angle = half - s / rb
        along = np.array([math.sin(angle), math.cos(angle)])
        across = np.array([along[1], -along[0]])
        return rb * along + s * across * 1.0, across

    def mirrored(points, normals):
        both = np.concatenate([points[::-1] * [-1, 1], points])
        return both, np.concatenate([normals[::-1] * [-1, 1], normals])

    def excess(s):
        point, normal = flank(s)
        return np.hypot(*(point - rho * normal)) - (ra - rho)

    end = brentq(excess, 0.0, math.hypot(rb, ra), xtol=1e-15)
    point, normal = flank(end)
    center = point - rho * normal
    low = math.atan2(normal[0], normal[1])
    high = math.atan2(center[0], center[1])
    angles = np.linspace(low, high, count)
    directions = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    land = np.linspace(high, 0.0, count)[1:]
    up = np.stack([np.sin(land), np.cos(land)], axis=1)
    rolls = np.linspace(0.0, end, count)[:-1]
    flanks = [flank(s) for s in rolls]
    points = [p for p, _ in flanks]
    normals = [n for _, n in flanks]
    points = np.concatenate([points, center + rho * directions, ra * up])
    normals = np.concatenate([normals, directions, up])
    return mirrored(points[::-1], normals[::-1])


@pytest.mark.parametrize("ring", first_are_quick(RINGS.values()), ids=RINGS)
def test_the_space_is_what_the_rolling_cutter_leaves(ring):
    """No point of the outline is within the cutter, and the cutter touches each."""
    outline, normals = cutter_tooth(ring)
    tree, cutter = cKDTree(outline), ring.cutter
    right = tooth_outline(ring, 12)[-30:-1]  # flank, fillet and the end of the root
    right = right[np.hypot(*right.T) > -ring.tip_radius + 1e-9]
    in_space = turn(right, -0.5 * ring.pitch_angle)  # the space is below the centre
    center = np.array([0.0, cutter.center_distance])
    deepest, nearest = np.full(len(right), np.inf), np.full(len(right), np.inf)
    for phi in np.linspace(-1.1, 1.1, 3001):
        psi = phi * cutter.teeth / ring.teeth
        seen = turn(in_space, -psi) + center
        seen = turn(-seen, phi)  # the cutter's tooth points down
        distance, index = tree.query(seen)
        signed = np.einsum("ic,ic->i", seen - outline[index], normals[index])
        near = distance < 2e-4
        deepest[near] = np.minimum(deepest, signed)[near]
        nearest = np.minimum(nearest, distance)
    assert deepest.min() > -2e-9
    assert deepest.max() < 1e-7
    assert nearest.max() < 4e-6


@settings(max_examples=80, deadline=None)
@given(
    teeth=st.integers(24, 200),
    cutter=st.floats(0.1, 0.9),
    shift=st.floats(-0.6, 0.6),
    rounding=st.floats(0.02, 0.3),
    angle=st.floats(14.5, 28.0),
)
def test_fillet_joins_flank_and_root_smoothly(teeth, cutter, shift, rounding, angle):
    try:
        ring = make_ring(
            teeth,
            cutter_teeth=int(cutter * teeth),
            profile_shift=shift,
            pressure_angle=math.radians(angle),
            rack_tip_radius=rounding * MODULE,
            tip_radius=-(0.5 * teeth - 0.6 + shift) * MODULE,
        )
    except GeometryError:
        assume(False)
    end = ring.form_normal_angle
    start = flank_points(ring, ring.form_roll_length)
    np.testing.assert_allclose(fillet_points(ring, end), start, atol=1e-13)
    root = fillet_points(ring, 0.0)
    assert np.hypot(*root) == pytest.approx(-ring.root_radius, rel=1e-12)
    last = np.diff(fillet_points(ring, end - np.array([2e-6, 1e-6])), axis=0)[0]
    tangent = flank_tangents(ring, ring.form_roll_length)
    assert last @ tangent / np.hypot(*last) == pytest.approx(1.0, abs=1e-6)
    first = np.diff(fillet_points(ring, np.array([1e-6, 2e-6])), axis=0)[0]
    assert abs(first @ root) < 1e-5 * np.hypot(*first) * np.hypot(*root)


def allowed(error, values):
    """The change of a ring that the message of an error allows; None if it has none."""
    field, bound = error.field, error.bound
    if bound is None and field == "cutter_teeth" and "must be" in error.message:
        low, high = map(int, re.findall(r"\d+", error.message.partition(";")[2])[:2])
        return min(max(values[field], low), high)
    if bound is None:
        return None
    if field == "cutter_teeth":
        return round(bound.inside)
    if field == "profile_shift":
        return bound.inside
    number = 1e-3 * bound.mapped(lambda metres: 1e3 * metres).inside
    return -number if field in ("tip_radius", "hub_radius") else number


def refusal(teeth, values):
    """The error of a ring that cannot be cut, None where it can."""
    try:
        ring = make_ring(teeth, **values)
    except GeometryError as error:
        return error
    assert -ring.tip_radius < -ring.form_radius <= -ring.root_radius
    return None


def test_random_rings_are_cut_or_refused_with_a_number_that_works():
    rng, cut, refused = np.random.default_rng(20261125), 0, {}
    for _ in range(600):
        teeth = int(rng.integers(15, 150))
        values = {
            "cutter_teeth": int(rng.integers(3, teeth)),
            "profile_shift": rng.uniform(-1.0, 1.0),
            "pressure_angle": math.radians(rng.uniform(12.0, 30.0)),
            "dedendum": rng.uniform(0.6, 1.6) * MODULE,
            "rack_tip_radius": rng.uniform(0.02, 0.6) * MODULE,
            "tip_radius": -(0.5 * teeth + rng.uniform(-2.0, 0.5)) * MODULE,
            "hub_radius": -(0.5 * teeth + rng.uniform(0.0, 5.0)) * MODULE,
        }
        complaints: list[tuple] = []
        while (error := refusal(teeth, values)) is not None:
            refused[error.field] = refused.get(error.field, 0) + 1
            change = allowed(error, values)
            if change is None:
                break
            cause = error.message.partition("; ")[2][:12]
            reason = error.bound and error.bound.reason
            complaints.append((error.field, cause, reason, values["cutter_teeth"]))
            assert len(set(complaints)) == len(complaints), (error.message, values)
            values[error.field] = change
        cut += error is None
    assert cut > 200
    assert set(refused) >= {"cutter_teeth", "rack_tip_radius", "tip_radius"}


def deepest_overlap(gear, ring, center_distance, positions=2000):
    """Arc by which tips of the gear enter the ring's teeth over a pitch [m].

    Of every tip corner and tip middle; negative by the least gap where none enters.
    """
    operating = math.acos(-(gear.base_radius + ring.base_radius) / center_distance)
    one = gear.half_angle(gear.base_radius / math.cos(operating))
    two = -ring.half_angle(ring.base_radius / math.cos(operating))
    pitch, deepest = abs(ring.pitch_angle), -np.inf
    corner = gear.half_angle(gear.tip_radius)
    for p in np.arange(positions) / positions:
        axes = math.pi - one + (p + np.arange(gear.teeth)) * gear.pitch_angle
        angles = (axes[:, None] + np.array([-corner, 0.0, corner])).ravel()
        tips = gear.tip_radius * np.exp(1j * angles) - center_distance
        radius, angle = np.abs(tips), np.angle(tips)
        inside = radius > -ring.tip_radius
        radius, angle = radius[inside], angle[inside]
        off_axis = angle - (math.pi + two + p * pitch)
        off_axis = (off_axis + 0.5 * pitch) % pitch - 0.5 * pitch
        reach = np.minimum(radius, -ring.form_radius)
        half = np.array([-ring.half_angle(-r) for r in reach])
        deepest = max(deepest, ((half - np.abs(off_axis)) * radius).max(initial=-1.0))
    return deepest


# no profile shift: closed forms of the tips alone, whatever the pair allows
@pytest.mark.parametrize(
    ("teeth", "addenda"),
    [((42, 50), (1.0, 0.8)), ((43, 50), (1.0, 0.8)), ((44, 50), (1.0, 0.8)),
     ((24, 30), (0.8, 0.6)), ((34, 40), (0.8, 0.6)), ((20, 26), (0.8, 0.6))],
)  # fmt: skip
def test_tip_interference_is_that_of_rolled_outlines(teeth, addenda):
    gear = make_planet(teeth[0], addenda[0])
    tip = -(0.5 * teeth[1] - addenda[1]) * MODULE
    ring = make_ring(
        teeth[1],
        tip_radius=tip,
        rack_tip_radius=0.05 * MODULE,
        cutter_teeth=3 * teeth[1] // 5,
    )
    distance = 0.5 * (teeth[1] - teeth[0]) * MODULE
    clearance = corner_clearance(gear, ring, distance)
    overlap = deepest_overlap(gear, ring, distance)
    if clearance < 0.0:
        assert overlap == pytest.approx(-clearance, rel=1e-2)
        shorter = replace(gear, tip_radius=largest_tip(gear, ring, distance))
        assert deepest_overlap(shorter, ring, distance) < 1e-7
    else:
        assert overlap < 1e-8  # flanks touch without backlash
    closest = largest_tip(gear, ring, distance)
    shorter = replace(gear, tip_radius=closest)
    if clearance < 0.0:
        assert corner_clearance(shorter, ring, distance) == pytest.approx(0, abs=1e-9)


def test_tips_that_meet_are_refused_with_a_tip_that_works():
    gear, ring = make_planet(44, 0.9), make_ring(50, tip_radius=-24.3 * MODULE)
    with pytest.raises(GeometryError, match="tip interference") as caught:
        GearPair(gear, ring, 6e-3)
    assert caught.value.role == "driver"
    number = float(re.search(r"at most ([\d.]+) mm", caught.value.message)[1])
    GearPair(replace(gear, tip_radius=1e-3 * number), ring, 6e-3)


def test_contact_ratio_is_that_of_a_textbook():
    """Colbourne, The Geometry of Involute Gears (1987), chapter 8."""
    gear, ring = make_planet(), make_ring()
    distance = 59.7e-3
    ring = replace(ring, tip_radius=-95.0e-3)
    pair = GearPair(gear, ring, distance)
    cos = 0.5 * MODULE * math.cos(math.radians(20.0))
    operating = math.acos((96 - 36) * cos / distance)
    one, two = math.acos(36 * cos / gear.tip_radius), math.acos(96 * cos / 95.0e-3)
    turns = 36 * (math.tan(one) - math.tan(operating))
    turns -= 96 * (math.tan(two) - math.tan(operating))
    ratio = turns / (2.0 * math.pi)
    assert pair.contact_ratio == pytest.approx(ratio, rel=1e-12)
    assert pair.swapped.contact_ratio == pytest.approx(ratio, rel=1e-12)
    assert pair.swapped.path == pytest.approx([-x for x in pair.path[::-1]])


def test_pitch_point_divides_the_centres_in_the_ratio_of_teeth():
    pair = GearPair(make_planet(), make_ring(), 60e-3)
    angle = pair.operating_pressure_angle
    assert pair.driver.base_radius / math.cos(angle) == pytest.approx(36e-3)
    assert -pair.driven.base_radius / math.cos(angle) == pytest.approx(96e-3)
    # both points of tangency are on the same side of the pitch point
    assert pair.pitch_point == pytest.approx(36e-3 * math.sin(angle))
    assert pair.line_of_action == pytest.approx(-60e-3 * math.sin(angle))


def test_a_ring_jams_above_a_centre_distance():
    """Backlash is that of arcs at the operating pitch circles; it ends at the bound."""
    gear = make_planet(addendum=0.7, tooth_thinning=100e-6)
    ring = make_ring(tip_radius=-95e-3)
    pair = GearPair(gear, ring, 60e-3)
    along = 100e-6 * math.cos(pair.operating_pressure_angle)
    assert pair.backlash == pytest.approx(along, rel=1e-9)
    with pytest.raises(GeometryError, match="at most") as caught:
        GearPair(gear, ring, 60.3e-3)
    largest = 1e-3 * float(re.search(r"at most ([\d.]+) mm", caught.value.message)[1])
    tight = GearPair(gear, ring, largest)
    assert 0.0 <= tight.backlash < 1e-7
    for distance in (59.9e-3, 60.1e-3):
        moved = GearPair(gear, ring, distance)
        assert (moved.backlash - pair.backlash) * (60e-3 - distance) > 0.0


def test_a_tip_that_digs_into_the_fillet_is_refused_with_one_that_works():
    ring = make_ring(tip_radius=-93.0e-3)
    with pytest.raises(GeometryError, match="trochoid interference") as caught:
        GearPair(make_planet(), ring, 60e-3)
    assert caught.value.role == "driven"
    least = 1e-3 * float(re.search(r"at least ([\d.]+) mm", caught.value.message)[1])
    pair = GearPair(make_planet(), replace(ring, tip_radius=-least), 60e-3)
    assert pair.path_start >= pair.driver.form_roll_length


def test_two_rings_do_not_mesh():
    with pytest.raises(GeometryError, match="only one may be"):
        GearPair(make_ring(), make_ring(60), 60e-3)


@pytest.mark.parametrize("sign", [1, -1])
def test_many_teeth_tend_to_the_rack(sign):
    """From both sides: contact ratio and path with a gear of ever more teeth."""
    gear, alpha, ratios = make_planet(), math.radians(20.0), []
    rack = 1.0 / math.sin(alpha)  # of the addendum of a module, along the line
    mate = 0.8 * MODULE * rack
    recess = gear.tip_roll_length - 36e-3 * math.sin(alpha)
    limit = (mate + recess) / gear.base_pitch
    for teeth in (1000, 10000):
        if sign > 0:
            other = make_planet(teeth, 0.8)
        else:
            other = make_ring(teeth, cutter_teeth=40)
        distance = 0.5 * MODULE * (teeth + sign * 36)
        ratios.append(GearPair(gear, other, distance).contact_ratio)
    assert sign * (limit - np.array(ratios)) == pytest.approx(0.0, abs=2e-2)
    assert sign * (limit - ratios[0]) > 0.0
    first, second = (abs(limit - ratio) for ratio in ratios)
    assert first / second == pytest.approx(10.0, rel=0.05)
