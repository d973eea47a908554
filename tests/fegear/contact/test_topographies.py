"""Gaps over profile and face width, where loads vary over the width."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sliced_pairs import WIDTH, problem, slope

from fegear.contact.pairs import with_back_flanks
from fegear.contact.solve import solve_cycle
from fegear.gearset.modifications import FlankLead, FlankProfile, FlankTopography

TORQUES, PLACES = [80.0, 200.0], np.arange(4) / 4.0 + 0.05
CASES = {
    "straight": lambda: problem(gap=slope(8e-6), corner_contact=False),
    "helical": lambda: problem(18.0, corner_contact=False),
    "friction": lambda: problem(
        18.0, gap=slope(8e-6), friction=0.05, corner_contact=False
    ),
    "ring": lambda: problem(18.0, ring="driven", corner_contact=False),
    "ring that drives": lambda: problem(ring="driver", corner_contact=False),
}
GEARS = "driver", "driven"
HALF = 0.5 * WIDTH


def with_flank(contact, role, **changes):
    return replace(contact, **{role: replace(getattr(contact, role), **changes)})


def topography(rolls, places, depths):
    return FlankTopography(
        roll_lengths=tuple(rolls),
        places=tuple(places),
        depths=tuple(map(tuple, np.asarray(depths, float).tolist())),
    )


def active_profile(contact, role):
    """Roll lengths [m] of its start and of the tip."""
    pair = contact.pair
    mate = getattr(pair, GEARS[1 - GEARS.index(role)])
    tip = getattr(pair, role).tip_roll_length
    return pair.line_of_action - mate.tip_roll_length, tip


def with_slope(ends, depth):
    """Excess of material [m] at the tip, linear from far below the active profile."""
    start, tip = ends
    low = 2.0 * start - tip
    return topography([low, tip], [-HALF, HALF], [[depth] * 2, [-depth] * 2])


def solve(contact):
    return solve_cycle(contact, TORQUES, PLACES)


def bilinear(grid, roll, place):
    """Depth at a point, by the four corners around it, one after another."""
    rolls, places = (
        np.clip(value, axis[0], axis[-1])
        for value, axis in ((roll, grid.roll_lengths), (place, grid.places))
    )
    along_width = [np.interp(places, grid.places, row) for row in grid.depths]
    return np.interp(rolls, grid.roll_lengths, along_width)


def test_depths_are_bilinear_between_points():
    rng = np.random.default_rng(3)
    for _ in range(20):
        counts = rng.integers(2, 6, 2)
        rolls, places = (np.cumsum(rng.uniform(0.1, 2.0, n)) for n in counts)
        grid = topography(rolls, places - 2.0, rng.normal(size=counts))
        points = rng.uniform(-3.0, 12.0, (2, 50))
        points[0, :2], points[1, :2] = rolls[[0, -1]], grid.places[0]  # on the points
        expected = [bilinear(grid, *point) for point in points.T]
        assert grid.depth(*points) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("role", GEARS)
def test_what_is_alike_over_the_profile_is_a_lead(kind, role):
    contact = CASES[kind]()
    lead = with_flank(contact, role, lead=FlankLead(slope=6e-6))
    depths = [[0.0, 6e-6]] * 3
    rolls = np.linspace(*active_profile(contact, role), 3)
    grid = topography(rolls, [-HALF, HALF], depths)
    ours, expected = solve(with_flank(contact, role, topography=grid)), solve(lead)
    assert ours.ste == pytest.approx(expected.ste, rel=1e-12)
    scale = expected.face.load.max()
    assert ours.face.load == pytest.approx(expected.face.load, abs=1e-9 * scale)
    assert np.abs(expected.ste - solve(contact).ste).max() > 1e-7


@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("role", GEARS)
def test_what_is_alike_over_the_width_is_a_profile(kind, role):
    """Gaps to the square of the slope; flanks with a slope also touch elsewhere, which
    changes their compliance."""
    contact = CASES[kind]()
    # half a squared slope of 3e-4 times the radius of curvature of the gap, which in
    # a ring is 62 mm and 7 mm between external gears, comes to it
    bound = 3e-3 if "ring" in kind else 2e-3
    ends, distances = active_profile(contact, role), []
    plain = solve(contact)
    for depth in (2e-6, 4e-6):
        sloped = with_flank(contact, role, profile=FlankProfile(slope=depth))
        grid = with_slope(ends, depth)
        ours = solve(with_flank(contact, role, topography=grid))
        expected = solve(sloped)
        faces = np.isfinite(expected.gap) & (expected.load > 0.0)
        distances.append(np.abs(ours.gap[faces] - expected.gap[faces]).max())
        assert distances[-1] < bound * depth
        effect = np.abs(expected.ste - plain.ste).max()
        assert effect > 0.3 * depth
        assert np.abs(ours.ste - expected.ste).max() < 0.02 * effect
    assert distances[0] < 0.3 * distances[1]


def test_a_gap_is_where_the_flank_touches():
    """Material missing over a part of the flank unloads there, on either gear."""
    contact = CASES["straight"]()
    pair = contact.pair
    for role in GEARS:
        start, tip = active_profile(contact, role)
        middle = 0.5 * (start + tip)
        grid = topography(
            [start, middle, middle + 1e-4, tip],
            [-HALF, -1e-4, 1e-4, HALF],
            [*[[0.0] * 4] * 2, *[[0.0, 0.0, 2e-3, 2e-3]] * 2],
        )
        ours = solve(with_flank(contact, role, topography=grid))
        loads, plain = ours.face.load[0], solve(contact).face.load[0]
        position = ours.position[:, None] + ours.teeth
        roll = pair.pitch_point + pair.base_pitch * position
        if role == "driven":
            roll = pair.line_of_action - roll
        near_tip = roll > middle + 2e-4
        far = ours.face.place > 2e-3
        assert plain[near_tip][:, far].max() > 0.0
        assert loads[near_tip][:, far].max() == 0.0
        assert loads[near_tip][:, ours.face.place < -2e-3].max() > 0.0
        assert loads[roll < middle - 1e-4][:, far].max() > 0.0


def test_a_twist_of_spur_gears_mirrors_the_width():
    contact = problem()
    ends = active_profile(contact, "driver")
    ours, other = (
        solve(
            with_flank(
                contact,
                "driver",
                topography=topography(
                    ends, [-HALF, HALF], [[sign * 3e-6, 0.0], [0.0, sign * 3e-6]]
                ),
            )
        )
        for sign in (1.0, -1.0)
    )
    # both differ by 3 um over the whole flank
    assert ours.ste - 3e-6 == pytest.approx(other.ste, rel=1e-9)
    mirrored = other.face.load[..., ::-1]
    scale = mirrored.max()
    assert ours.face.load == pytest.approx(mirrored, abs=1e-9 * scale)
    assert np.abs(ours.face.load - mirrored[..., ::-1]).max() > 0.05 * scale


def test_a_topography_follows_the_flank_of_its_own_gear():
    """Shifted along the axis, the gear takes its depths with it."""
    contact = problem()
    depths = [[0.0, 4e-6, -2e-6], [3e-6, 1e-6, 2e-6]]
    ends = active_profile(contact, "driven")
    places = np.array([-8e-3, 0.0, 5e-3])
    grids = [topography(ends, places + shift, depths) for shift in (0.0, 1e-3)]
    face = replace(contact.solver, width=WIDTH - 2e-3, gap=np.zeros(16))
    narrow = replace(contact, face_width=WIDTH - 2e-3)
    shifted = replace(narrow, solver=replace(face, offsets=(0.0, 1e-3)))
    straight = replace(narrow, solver=replace(face, offsets=(0.0, 0.0)))
    gaps = [
        with_flank(one, "driven", topography=grid)
        for one, grid in zip((straight, shifted), grids, strict=True)
    ]
    one, two = (solve(gap).no_load for gap in gaps)
    assert one == pytest.approx(two, rel=1e-9)
    assert np.ptp(one) > 1e-7


def test_back_flanks_have_none():
    grid = topography([4e-3, 9e-3], [-HALF, HALF], [[0.0, 1e-6]] * 2)
    contact = with_flank(problem(), "driver", topography=grid)
    back = with_back_flanks(contact)
    assert back.topographies == (None, None)
    assert contact.topographies == (grid, None)
