"""Places on the path of contact against closed forms, and the loss of sliding."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear
from hypothesis import given
from hypothesis import strategies as st

from fegear.contact.path import (
    contact_diameters,
    loss_factor,
    on_path,
    path_positions,
    roll_angles,
    sliding_over_pitch_speed,
    sliding_sign,
)
from fegear.contact.solve import solve_cycle
from meshes import GearPair


@st.composite
def pairs(draw):
    one, two = (make_gear(draw(st.integers(26, 90)), 12e-3) for _ in range(2))
    apart = draw(st.floats(0.1e-3, 0.6e-3))  # of the reference circles
    return GearPair(one, two, one.reference_radius + two.reference_radius + apart)


@given(pairs())
def test_the_path_ends_at_the_tips(pair):
    start, end = (np.array(place) for place in pair.path)
    assert contact_diameters(pair, end)[0] == pytest.approx(
        2.0 * pair.driver.tip_radius
    )
    driven = contact_diameters(pair, start)[1]
    assert driven == pytest.approx(2.0 * pair.driven.tip_radius)
    assert on_path(pair, np.array([start, 0.0, end])).all()
    assert not on_path(pair, np.array([start - 1e-6, end + 1e-6])).any()


@given(pairs(), st.floats(-0.8, 0.8))
def test_both_contact_points_are_one_point_of_the_plane(pair, position):
    """By the radii at a point of the line of action through the pitch point."""
    place = np.array(position)
    pitch_radius = pair.center_distance * pair.driver.teeth
    pitch_radius /= pair.driver.teeth + pair.driven.teeth
    angle, along = pair.operating_pressure_angle, position * pair.base_pitch
    # driver's centre at the origin, the driven one's on x; the line of action leans
    x = pitch_radius + along * math.sin(angle)
    y = along * math.cos(angle)
    one, two = contact_diameters(pair, place)
    assert one == pytest.approx(2.0 * math.hypot(x, y))
    assert two == pytest.approx(2.0 * math.hypot(x - pair.center_distance, y))


@given(pairs())
def test_roll_angles_advance_by_the_pitch_angle_in_a_base_pitch(pair):
    steps = np.diff(roll_angles(pair, np.array([-0.4, 0.6])), axis=1)[:, 0]
    pitches = 2.0 * math.pi / np.array([pair.driver.teeth, -pair.driven.teeth])
    np.testing.assert_allclose(steps, pitches)
    at_pitch_point = math.tan(pair.operating_pressure_angle)
    for angle in roll_angles(pair, np.array(0.0)):
        assert angle == pytest.approx(at_pitch_point)


@given(pairs(), st.floats(-0.8, 0.8))
def test_sliding_is_the_difference_of_the_flanks_speeds(pair, position):
    place = np.array(position)
    speed = 1.7  # of the driver [rad/s]
    driven_speed = speed * pair.driver.teeth / pair.driven.teeth
    one, two = roll_angles(pair, place)
    slip = speed * one * pair.driver.base_radius
    slip -= driven_speed * two * pair.driven.base_radius
    pitch_line = speed * pair.driver.base_radius
    pitch_line /= math.cos(pair.operating_pressure_angle)
    sliding = sliding_over_pitch_speed(pair, place)
    assert sliding == pytest.approx(slip / pitch_line, abs=1e-12)


def test_friction_acts_toward_the_roots_before_the_pitch_point():
    places = np.array([-0.3, -1e-14, 0.0, 1e-14, 0.4])
    np.testing.assert_array_equal(sliding_sign(places), [1.0, 0.0, 0.0, 0.0, -1.0])


@pytest.mark.parametrize(("start", "end"), [(-0.7, 0.9), (-0.75, 0.75)])
def test_loss_factor_of_equal_shares(start, end):
    """Two of one to two pairs share equally: an integral in closed form."""
    count, teeth = 20_000, (20, 60)
    position = (np.arange(count) + 0.5) / count
    places = position[:, None] + np.array([0, -1, 1, -2])
    touching = (places > start) & (places < end)
    share = touching / touching.sum(axis=1, keepdims=True)
    single = 0.5 * ((end - 1.0) ** 2 + (start + 1.0) ** 2)
    every = 0.5 * (start**2 + end**2)
    expected = 2.0 * math.pi * (1 / 20 + 1 / 60) * 0.5 * (every + single)
    assert loss_factor(teeth, places, share) == pytest.approx(expected, rel=1e-4)


def test_loss_factor_is_the_lost_work_over_a_small_coefficient(problem):
    """Mean of T2/T1 over the cycle with friction and without."""
    positions = np.arange(128) / 128
    friction = 0.01
    free, rubbing = (
        solve_cycle(replace(problem, friction=mu), 100.0, positions)
        for mu in (0.0, friction)
    )
    lost = 1.0 - float(rubbing.driven_torque.mean() / free.driven_torque.mean())
    pair = problem.pair
    teeth = pair.driver.teeth, pair.driven.teeth
    factor = loss_factor(teeth, path_positions(free), free.load_share)[0]
    assert factor == pytest.approx(lost / friction, rel=0.02)
