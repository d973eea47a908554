"""Teeth as helicoids in space, and contact as it lies on them."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest
import sliced_pairs
from wide_sets import HELICAL

import fegear
from fegear.contact.solve import solve_cycle
from fegear.gearset.phases import rolling_senses
from fegear.rendering.flank_surfaces import (
    ContactBand,
    band_surface,
    contact_band,
    gears_in_space,
    tooth_surface,
)
from fegear.rendering.width_contact import WidthMoments

HAND = ("right", "left")
POSITION = 0.3


def gear_set(hand="right", line_deg=0.0, third=False, helix_angle_deg=18.0):
    """A pair, or a train whose second mesh has a driver that turns clockwise."""
    defaults = {**HELICAL["defaults"], "helix_angle_deg": helix_angle_deg}
    one, two = HELICAL["gear"]
    if helix_angle_deg:
        one = {**one, "hand": hand}
    mesh = {**HELICAL["mesh"][0], "center_line_deg": line_deg}
    gears, meshes = [one, two], [mesh]
    if third:
        gears.append({"name": "three", "teeth": 30, "hub_radius_mm": 20.0})
        more = {"driver": "two", "driven": "three", "backlash_um": 60.0}
        meshes.append({**more, "center_line_deg": line_deg - 70.0})
    tables = {"name": "set", "defaults": defaults, "gear": gears, "mesh": meshes}
    return fegear.make_gear_set(tables)


def ring_set(driver, hand="right", line_deg=0.0, helix_angle_deg=18.0):
    """A pinion and an internal gear, one of which drives."""
    gears = [
        {"name": "pinion", "teeth": 19, "hub_radius_mm": 8.0},
        {"name": "ring", "teeth": 60, "internal": True, "rim_radius_mm": 72.0},
    ]
    if helix_angle_deg:
        gears[0]["hand"] = hand
    names = "pinion", "ring"
    mesh = {"driver": names[driver], "driven": names[1 - driver]}
    mesh |= {"backlash_um": 60.0, "center_line_deg": line_deg}
    defaults = {"module_mm": 2.0, "face_width_mm": 20.0}
    return fegear.make_gear_set(
        {
            "name": "ring",
            "defaults": defaults | {"helix_angle_deg": helix_angle_deg},
            "gear": gears,
            "mesh": [mesh],
        }
    )


CASES = [
    (gear_set(), 0),
    (ring_set(0), 0),
    (ring_set(0, "left", 35.0), 0),
    (ring_set(1), 0),
    (ring_set(1, "left", -50.0), 0),
    (ring_set(1, helix_angle_deg=0.0), 0),
    (gear_set("left"), 0),
    (gear_set("right", 35.0), 0),
    (gear_set("right", 35.0, third=True), 1),
    (gear_set("left", -50.0, third=True), 1),
    (gear_set(helix_angle_deg=0.0), 0),
]


def about_axis(gear, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radius, angle and z of points (n, 3) about the gear's axis."""
    center = gear.placed.centers[gear.index]
    x, y = (points[:, :2] - center).T
    return np.hypot(x, y), np.unwrap(np.arctan2(y, x)), points[:, 2]


@pytest.mark.parametrize(("gears", "mesh"), CASES)
@pytest.mark.parametrize("index", [0, 1])
def test_loaded_flanks_are_involute_helicoids(gears, mesh, index):
    """angle -+ inv(acos(rb / r)) turns as a screw along z, right-handed or left."""
    gear = gears_in_space(gears, mesh)[index]
    tooth = tooth_surface(gear, POSITION, 1)
    flank = tooth.points[~np.isnan(tooth.arc)]
    r, angle, z = about_axis(gear, flank)
    alpha = np.arccos(np.minimum(1.0, abs(gear.teeth.base_radius) / r))
    lead = np.tan(gear.teeth.base_helix_angle) / gear.teeth.base_radius
    involute = np.tan(alpha) - alpha
    remaining = [
        np.ptp((angle - lead * z + sign * involute) * r.mean()) for sign in (-1, 1)
    ]
    assert min(remaining) < 1e-9  # m
    assert max(remaining) > 1e-4
    # the flank that carries: leading of the driver, trailing of the driven gear
    turns = gears.senses[gears.meshes[mesh].gears[index]]
    leads = gear.teeth.sign * (1 if index == 0 else -1)
    assert np.argmin(remaining) == (1 if turns * leads > 0 else 0)
    ends = abs(gear.teeth.tip_radius), abs(gear.teeth.form_radius)
    assert (r.min(), r.max()) == pytest.approx(sorted(ends), abs=1e-9)


@pytest.mark.parametrize(("gears", "mesh"), CASES)
@pytest.mark.parametrize(("position", "pair"), [(0.1, 0), (0.3, 0), (0.7, -1)])
def test_flanks_meet_where_the_plane_of_action_cuts_them(gears, mesh, position, pair):
    """Both gears have their points of the line of contact in the same places."""
    driver, driven = gears_in_space(gears, mesh)
    geometry = gears.meshes[mesh].pair
    place = np.linspace(-8e-3, 8e-3, 9)
    turns = rolling_senses(gears)[gears.meshes[mesh].driver]
    slope = turns * geometry.driver.base_radius * geometry.driver.twist
    rolls = geometry.pitch_point + geometry.base_pitch * (position + pair)
    rolls = rolls - slope * place
    on_path = (rolls > geometry.path_start) & (rolls < geometry.path_end)
    assert on_path.sum() > 3
    rolls, place = rolls[on_path], place[on_path]
    points = [
        gear.flank(
            0.5 * (gear.teeth.tip_roll_length**2 - roll**2) / gear.teeth.base_radius,
            place,
            position,
            pair,
        )
        for gear, roll in ((driver, rolls), (driven, geometry.line_of_action - rolls))
    ]
    np.testing.assert_allclose(points[0], points[1], atol=1e-9)
    np.testing.assert_allclose(points[0][:, 2], -place, atol=1e-12)
    # a line of length dz / cos(helix angle on the base cylinder)
    length = np.linalg.norm(points[0][-1] - points[0][0])
    cosine = math.cos(geometry.driver.base_helix_angle)
    assert length == pytest.approx((place[-1] - place[0]) / cosine, rel=1e-9)


def test_a_gear_reaches_over_its_own_width():
    one, two = (dict(gear) for gear in HELICAL["gear"])
    two["face_width_mm"] = 26.0
    mesh = {**HELICAL["mesh"][0], "offset_mm": 2.0}
    gears = fegear.make_gear_set({**HELICAL, "gear": [one, two], "mesh": [mesh]})
    # the wheel reaches 13 mm from a middle that is 2 mm nearer to the far end
    driver, driven = gears_in_space(gears, 0)
    assert driver.ends == pytest.approx((-10e-3, 10e-3))
    assert driven.ends == pytest.approx((-11e-3, 15e-3))
    z = tooth_surface(driven, 0.0, 0).points[:, 2]
    assert (z.min(), z.max()) == pytest.approx((-15e-3, 11e-3))


def test_teeth_are_closed_but_for_the_cuts_through_the_rim():
    """Every edge belongs to two faces, but along both cuts and below the rim."""
    gear = gears_in_space(gear_set(), 0)[0]
    tooth = tooth_surface(gear, POSITION, 0)
    edges = Counter(
        tuple(sorted((int(a), int(b))))
        for face in tooth.faces
        for a, b in zip(face, np.roll(face, -1), strict=True)
        if a != b
    )
    assert set(edges.values()) == {1, 2}
    open_nodes = {node for edge, count in edges.items() if count == 1 for node in edge}
    r, _, _ = about_axis(gear, tooth.points[sorted(open_nodes)])
    assert r.max() <= gear.teeth.root_radius + 1e-9


@pytest.fixture(scope="module")
def cycle():
    problem = sliced_pairs.problem(20.0, sliced_pairs.slope(15e-6))
    return problem, solve_cycle(problem, [100.0], [0.1, 0.6])


@pytest.mark.parametrize("gear", [0, 1])
def test_a_band_has_the_loads_of_the_cycle(cycle, gear):
    _, cycle = cycle
    face = cycle.face
    for n in (0, 1):
        band = contact_band(cycle, n, gear)
        assert band.pair.size == (face.load[0, n] > 0.0).sum()
        for i in range(band.pair.size):
            k = int(np.flatnonzero(face.teeth == band.pair[i])[0])
            m = int(np.argmin(np.abs(face.place - band.place[i].mean())))
            assert band.pressure[i] == face.pressure[0, n, k, m]
            assert band.on_path[i] == face.on_path[n, k, m]
            arc = face.arc[0, n, k, m, gear]
            assert band.arc[i].mean() == pytest.approx(arc, abs=1e-15)
            # the pressure of Hertz over the width of the contact is the load
            force = 0.5 * np.pi * band.half_width[i] * band.pressure[i]
            assert force == pytest.approx(face.load[0, n, k, m], rel=1e-12)


def test_half_widths_are_those_of_hertz(cycle):
    """b^2 = 4 w R / (pi E*), where flanks touch over a whole slice."""
    problem, cycle = cycle
    band, pair = contact_band(cycle, 0, 0), problem.pair
    gear = pair.driver
    arc = band.arc.mean(axis=1)
    rolls = np.sqrt(gear.tip_roll_length**2 - 2.0 * gear.base_radius * arc)
    other = pair.line_of_action - rolls
    cosine = math.cos(gear.base_helix_angle)
    radius = rolls * other / (rolls + other) / cosine
    load = 0.5 * np.pi * band.half_width * band.pressure
    modulus = 206e9 / (1.0 - 0.3**2) / 2.0
    expected = np.sqrt(4.0 * load * radius / (np.pi * modulus))
    whole = np.isclose(band.half_width, expected, rtol=2e-2)
    assert whole[band.on_path].mean() > 0.8  # others are cut by an end of the path


def test_ends_of_slices_follow_each_other_along_a_line(cycle):
    _, cycle = cycle
    band = contact_band(cycle, 0, 0)
    lines = [
        band.chosen((band.pair == pair) & band.on_path) for pair in np.unique(band.pair)
    ]
    long_lines = [line for line in lines if line.pair.size > 4]
    assert long_lines
    for line in long_lines:
        gaps = np.abs(line.arc[1:, 0] - line.arc[:-1, 1])
        step = np.abs(np.diff(line.arc, axis=1)).max()
        assert np.median(gaps) < 0.02 * step
        assert (
            gaps.max() < 0.3 * step
        )  # beside a slice that is cut by an end of the path


def synthetic_band(arc, half_width) -> ContactBand:
    return ContactBand(
        pair=np.array([0]),
        place=np.array([[1e-3, 2e-3]]),
        arc=np.array([[arc, arc]]),
        half_width=np.array([half_width]),
        pressure=np.array([8e8]),
        on_path=np.array([True]),
    )


@pytest.mark.parametrize("widening", [1.0, 5.0])
def test_a_band_is_as_wide_as_it_is_said_to_be(widening):
    gear = gears_in_space(gear_set(helix_angle_deg=0.0), 0)[0]
    arc, half = 2e-3, 1e-4
    surface = band_surface(gear, synthetic_band(arc, half), POSITION, widening)
    across = surface.points[0, 0, -1] - surface.points[0, 0, 0]
    # a chord of a curved flank is a little shorter than its arc
    assert np.linalg.norm(across) == pytest.approx(2.0 * widening * half, rel=2e-3)
    middle = surface.pressure.shape[1] // 2
    assert surface.pressure[0, middle] == 8e8
    assert surface.arc[0, :, middle] == pytest.approx([arc, arc])
    assert surface.pressure[0, [0, -1]].tolist() == [0.0, 0.0]
    quarter = surface.pressure[0, middle // 2]  # half way to the edge of the contact
    assert quarter == pytest.approx(8e8 * math.sqrt(0.75))
    expected = gear.flank(np.full(2, arc), np.array([1e-3, 2e-3]), POSITION, 0)
    np.testing.assert_allclose(surface.points[0, :, middle], expected, atol=1e-12)


def test_a_band_ends_at_the_tip_corner():
    gear = gears_in_space(gear_set(), 0)[0]
    surface = band_surface(gear, synthetic_band(1e-5, 1e-4), POSITION, 2.0)
    assert surface.arc.min() == 0.0
    r, _, _ = about_axis(gear, surface.points.reshape(-1, 3))
    assert r.max() <= gear.teeth.tip_radius + 1e-12


def test_the_peak_is_that_of_slices_on_the_path(cycle):
    _, cycle = cycle
    face = cycle.face
    moments = WidthMoments(gears_in_space(gear_set(), 0), cycle)
    peak = moments.peak
    on_path = np.where(face.on_path, face.pressure[0], 0.0)
    assert peak is not None
    assert peak.value == on_path.max() == moments.limit
    n, k, m = np.argwhere(on_path == peak.value)[0]
    assert (peak.position, peak.pair) == (cycle.position[n], face.teeth[k])
    assert peak.place == face.place[m]
    edges = (face.load[0] > 0.0) & ~face.on_path
    assert moments.edge_slices == edges.sum()
    touching = face.teeth[(face.load[0] > 0.0).any(axis=(0, 2))]
    first, last = touching.min() - 1, touching.max() + 1
    assert moments.pairs == list(range(first, last + 1))


def test_loads_of_pairs_add_up_to_the_torque(cycle):
    """Without friction their normal forces have the arm rb cos(beta_b)."""
    problem, cycle = cycle
    moments = WidthMoments(gears_in_space(gear_set(), 0), cycle)
    gear = problem.pair.driver
    arm = gear.base_radius * math.cos(gear.base_helix_angle)
    for n in range(len(moments)):
        total = sum(pair.load for pair in moments[n].pair_loads(0))
        assert arm * total == pytest.approx(100.0, rel=5e-3)  # corners turn forces
