"""Crowning, profile slope and measured profiles against geometry and reliefs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numba import njit
from oracles.relieved_flanks import Flank, closing_way, relief_depth

from fegear.contact.edges import edge_arcs
from fegear.contact.plane.constants import kernel_inputs
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.plane.kernels import flanks as kernel
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.profiles import profile_depth, profile_kinks
from fegear.contact.solve import solve_cycle
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.gearset import FlankProfile, Relief, load_gear_set
from fegear.gearset.modifications import MAX_PROFILE_POINTS
from meshes import MeshSize
from meshes.profile import arc_from_tip

POSITIONS = np.arange(24) / 24 + 0.003
CLOSE = 50e-6  # m, gap of pairs that could carry load
TORQUE = 200.0
NAMES = ("driver", "driven")


@pytest.fixture(scope="module")
def unmodified():
    spec = load_gear_set("liu-pair").meshes[0]
    steel, size = PlaneMaterial(2.06e11, 0.3), MeshSize().refined(0.7)
    driver, driven = (
        cached_flank_compliance(gear, steel, size)
        for gear in (spec.pair.driver, spec.pair.driven)
    )
    return ContactProblem(
        pair=spec.pair,
        driver=ContactFlank(compliance=driver),
        driven=ContactFlank(compliance=driven),
        face_width=0.025,
        solver=PlaneContact(nodes=17),
    )


def ways_of(pair):
    """Roll lengths at which the active profile begins and ends, by role."""
    line = pair.line_of_action
    return {
        "driver": (pair.path_start, pair.path_end),
        "driven": (line - pair.path_end, line - pair.path_start),
    }


def no_load_of_geometry(problem, depths):
    """Least transmission error [m] that closes a pair, from points and angles alone."""
    pair, flanks = problem.pair, []
    for name in NAMES:
        gear = getattr(pair, name)
        low = gear.form_roll_length
        flanks.append(Flank(gear.base_radius, gear.tip_roll_length, low, depths[name]))
    rolls = pair.pitch_point + pair.base_pitch * np.add.outer(POSITIONS, (-1, 0, 1))
    ends = [s - 0.2 * pair.base_pitch for s in (pair.path_start, -pair.path_end)]
    near = (rolls > ends[0]) & (-rolls > ends[1])
    ways = [
        closing_way(*flanks, pair.center_distance, roll) if there else np.inf
        for roll, there in zip(rolls.ravel(), near.ravel(), strict=True)
    ]
    return np.reshape(ways, rolls.shape).min(axis=1)


def none(s):
    return 0.0 * s


def test_crowning_and_slope_open_the_gap_of_their_formula(unmodified):
    ways = ways_of(unmodified.pair)
    (low, tip), (low2, tip2) = ways["driver"], ways["driven"]

    def crowned(s):
        return 8e-6 * ((s - 0.5 * (low + tip)) / (0.5 * (tip - low))) ** 2

    def sloped(s):  # excess at the tip is positive: less depth
        return -5e-6 * (s - low2) / (tip2 - low2)

    problem = replace(
        unmodified,
        driver=replace(unmodified.driver, profile=FlankProfile(crowning=8e-6)),
        driven=replace(unmodified.driven, profile=FlankProfile(slope=5e-6)),
    )
    cycle = solve_cycle(problem, [TORQUE], POSITIONS)
    exact = no_load_of_geometry(problem, {"driver": crowned, "driven": sloped})
    np.testing.assert_allclose(cycle.no_load[0], exact, rtol=0.0, atol=1e-12)


def waves(low, high, amplitude=2e-6, count=120):
    """Measured points of a profile with several valleys."""
    s = np.linspace(low, high, count)
    return s, amplitude * np.sin(9.0 * np.pi * (s - low) / (high - low)) + 1e-6


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
def test_gap_of_a_wavy_profile_is_that_of_the_geometry(unmodified, interpolation):
    low, tip = ways_of(unmodified.pair)["driver"]
    rolls, deviations = waves(low + 1e-3, tip - 0.3e-3)
    profile = FlankProfile(
        roll_lengths=tuple(rolls),
        deviations=tuple(deviations),
        interpolation=interpolation,
    )
    problem = with_flanks(unmodified, driver_profile=profile)
    cycle = solve_cycle(problem, [TORQUE], POSITIONS)

    def depth(s):
        return profile_depth(profile, s, low, tip)

    exact = no_load_of_geometry(problem, {"driver": depth, "driven": none})
    np.testing.assert_allclose(cycle.no_load[0], exact, rtol=0.0, atol=2e-10)


@njit
def modification_at(flank, s):
    """Depth and slope of a modification at roll lengths (n,)."""
    depth, slope = np.empty(s.size), np.empty(s.size)
    for i in range(s.size):
        depth[i] = kernel.modification(flank, s[i])
        slope[i] = kernel.modification_slope(flank, s[i])
    return depth, slope


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
def test_kernel_has_depth_and_slope_of_the_curve(unmodified, interpolation):
    low, tip = ways_of(unmodified.pair)["driver"]
    rolls, deviations = waves(low + 1e-3, tip - 0.3e-3, count=30)
    profile = FlankProfile(
        crowning=3e-6,
        slope=-4e-6,
        roll_lengths=tuple(rolls),
        deviations=tuple(deviations),
        interpolation=interpolation,
    )
    problem = with_flanks(unmodified, driver_profile=profile)
    flank = kernel_inputs(problem)[1][0]
    s, step = np.linspace(low, tip, 777), 1e-9
    depth, slope = modification_at(flank, s)
    expected = profile_depth(profile, s, low, tip)
    np.testing.assert_allclose(depth, expected, rtol=0.0, atol=1e-18)
    ends = (profile_depth(profile, x, low, tip) for x in (s + step, s - step))
    quotient = np.subtract(*ends) / (2.0 * step)
    np.testing.assert_allclose(slope, quotient, rtol=0.0, atol=2e-7)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_measured_points_of_a_relief_are_that_relief(unmodified, shape):
    low, tip = ways_of(unmodified.pair)["driver"]
    begin = low + unmodified.pair.base_pitch
    s = np.array([low, begin, tip])
    if shape == "parabolic":
        s = np.append(s[0], np.linspace(begin, tip, 990))
    power = {"linear": 1.0, "parabolic": 2.0}[shape]
    profile = FlankProfile(
        roll_lengths=tuple(s),
        deviations=tuple(-relief_depth(15e-6, begin, tip, power)(s)),
        interpolation="linear" if shape == "linear" else "cubic",
    )
    relief = Relief(magnitude=15e-6, start_roll_length=begin, shape=shape)
    one = solve_cycle(
        with_flanks(unmodified, driver_tip_relief=relief),
        [TORQUE],
        POSITIONS,
    )
    two = solve_cycle(
        with_flanks(unmodified, driver_profile=profile),
        [TORQUE],
        POSITIONS,
    )
    np.testing.assert_allclose(two.ste, one.ste, rtol=1e-6)
    np.testing.assert_allclose(two.stiffness, one.stiffness, rtol=1e-6)


def test_slopes_of_both_gears_that_cancel_only_shift_the_error(unmodified):
    """The sum of depths on the path is the same everywhere: that of a pitch error."""
    ways, slope = ways_of(unmodified.pair), 1e-4
    sizes = [slope * (ways[name][1] - ways[name][0]) for name in NAMES]
    profiles = [FlankProfile(slope=size) for size in sizes]
    problem = replace(
        unmodified,
        driver=replace(unmodified.driver, profile=profiles[0]),
        driven=replace(unmodified.driven, profile=profiles[1]),
    )
    problem, plain = (
        solve_cycle(replace(p, corner_contact=False), [TORQUE], POSITIONS)
        for p in (problem, unmodified)
    )
    shift = problem.no_load - plain.no_load
    assert np.ptp(shift) < 2.0 * slope * np.abs(shift).mean()
    assert shift.mean() == pytest.approx(-sizes[0], rel=2.0 * slope)
    # normals turn by about the slope
    np.testing.assert_allclose(problem.stiffness, plain.stiffness, rtol=5.0 * slope)


def test_modifications_add_up(unmodified):
    low, tip = ways_of(unmodified.pair)["driver"]
    s = np.linspace(low, tip, 5)
    parts = [
        FlankProfile(crowning=2e-6),
        FlankProfile(slope=3e-6),
        FlankProfile(roll_lengths=tuple(s), deviations=(0.0, 1e-6, -1e-6, 0.0, 2e-6)),
    ]
    both = replace(parts[2], crowning=2e-6, slope=3e-6)
    s = np.linspace(low, tip, 100)
    total = sum(profile_depth(part, s, low, tip) for part in parts)
    np.testing.assert_allclose(profile_depth(both, s, low, tip), total, atol=1e-20)


def test_only_kinks_are_edges(unmodified):
    low, tip = ways_of(unmodified.pair)["driver"]
    s = np.linspace(low + 1e-3, tip, 5)
    profile = FlankProfile(
        roll_lengths=tuple(s), deviations=(0.0, 0.0, 1e-6, 2e-6, 0.0)
    )
    assert profile_kinks(profile, low, tip).size == 0
    linear = replace(profile, interpolation="linear")
    np.testing.assert_allclose(profile_kinks(linear, low, tip), s[[1, 3]])
    problem = with_flanks(unmodified, driver_profile=linear)
    arcs = arc_from_tip(problem.pair.driver, s[[1, 3]])
    np.testing.assert_allclose(edge_arcs(problem)[0], [0.0, *arcs])


def test_kernels_have_room_for_the_most_points():
    assert kernel.MAX_KNOTS == MAX_PROFILE_POINTS


DEVIATIONS = st.lists(st.floats(-3e-6, 3e-6), min_size=2, max_size=40)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    driver=DEVIATIONS,
    driven=DEVIATIONS,
    crowning=st.floats(-5e-6, 10e-6),
    interpolation=st.sampled_from(["cubic", "linear"]),
    position=st.floats(0.0, 1.0),
)
def test_any_profile_has_a_solution_that_grows_with_the_torque(
    unmodified, driver, driven, crowning, interpolation, position
):
    ways = ways_of(unmodified.pair)
    profiles = {
        f"{name}_profile": FlankProfile(
            crowning=crowning,
            roll_lengths=tuple(np.linspace(*ways[name], len(deviations))),
            deviations=tuple(deviations),
            interpolation=interpolation,
        )
        for name, deviations in (("driver", driver), ("driven", driven))
    }
    problem = with_flanks(unmodified, **profiles)
    torques = TORQUE * np.array([0.01, 0.1, 0.5, 1.0, 2.0])
    cycle = solve_cycle(problem, torques, [position, position + 0.31])
    assert cycle.residual.max() < 1e-10
    assert (cycle.load >= 0.0).all()
    assert (np.diff(cycle.ste, axis=0) > 0.0).all()
    assert (cycle.ste > cycle.no_load).all()
    assert math.isfinite(cycle.stiffness.max())
