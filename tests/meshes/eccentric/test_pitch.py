"""Pitch curves of an eccentric circle and its mate, against integrals of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from meshes import GeometryError
from meshes.eccentric import EccentricPair
from validation.oracles.rolling import (
    closing_residual_dop853,
    closing_residual_rk4,
    shoot,
)

PAIRS = st.builds(EccentricPair, st.just(1.0), st.floats(0.0, 0.9), st.integers(1, 6))


def rolled(theta, pair, distance):
    """d psi / d theta from the rolling condition, with a difference for d rho / ds."""
    r, e = pair.radius, pair.eccentricity

    def rho(angle):
        return math.hypot(r * math.cos(angle) - e, r * math.sin(angle))

    step = 1e-5
    slope = (rho(theta + step) - rho(theta - step)) / (2.0 * step * r)
    return r * math.sqrt(1.0 - slope**2) / (distance - rho(theta))


@settings(max_examples=25, deadline=None)
@given(PAIRS)
def test_the_driven_curve_closes(pair):
    turn, _ = quad(rolled, 0.0, math.pi, args=(pair, pair.center_distance), limit=200)
    assert turn == pytest.approx(math.pi / pair.ratio, rel=1e-8)
    assert abs(pair.closing_error(pair.center_distance)) < 1e-12


@pytest.mark.parametrize("e", [0.1, 0.627, 0.8])
def test_the_source_s_equations_by_shooting(e):
    distance = shoot(closing_residual_dop853(e, 1e-12), e)
    assert EccentricPair(1.0, e).center_distance == pytest.approx(distance, abs=1e-10)


def test_shooting_is_of_order_four():
    exact = EccentricPair(1.0, 0.627).center_distance
    errors = [
        abs(shoot(closing_residual_rk4(0.627, n), 0.627) - exact) for n in (32, 64)
    ]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


@settings(max_examples=25, deadline=None)
@given(PAIRS, st.floats(-20.0, 20.0))
def test_frames_are_those_of_the_points(pair, angle):
    step = 1e-5
    for curve in (pair.driver, pair.driven):
        here = curve.frames(angle)
        ahead, back = (curve.frames(angle + way * step) for way in (1.0, -1.0))
        moved = (ahead.point - back.point) / (2.0 * step)
        np.testing.assert_allclose(moved, here.tangent, atol=1e-7)
        turned = (ahead.normal - back.normal) / (2.0 * step)
        expected = here.curvature * here.tangent
        np.testing.assert_allclose(turned, expected, atol=1e-6)
        slope = (ahead.curvature - back.curvature) / (2.0 * step)
        assert slope == pytest.approx(float(here.slope), rel=1e-5, abs=1e-4)
        assert here.tangent @ here.normal == pytest.approx(0.0, abs=1e-12)


@settings(max_examples=25, deadline=None)
@given(PAIRS)
def test_both_curves_are_as_long(pair):
    angle = np.linspace(0.0, 2.0 * math.pi * pair.lobes, 20_001)
    points = pair.driven.frames(angle).point
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    assert length == pytest.approx(pair.driven.length, rel=1e-5)
    np.testing.assert_allclose(points[0], points[-1], atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(PAIRS, st.floats(0.0, 6.28))
def test_pitch_points_meet_and_roll(pair, angle):
    """Turned by their own angles, both wheels have point and tangent in common."""
    for curve, turn, shift in (
        (pair.driver, -pair.driver_turn(angle), 0.0),
        (pair.driven, pair.driven_turn(angle), pair.center_distance),
    ):
        frames = curve.frames(angle)
        c, s = math.cos(turn), math.sin(turn)
        point = np.array([[c, -s], [s, c]]) @ frames.point + [shift, 0.0]
        expected = [pair.driver_radius(angle), 0.0]
        np.testing.assert_allclose(point, expected, atol=1e-9)
        tangent = np.array([[c, -s], [s, c]]) @ frames.tangent
        assert tangent[1] > 0.0


def test_a_wheel_with_its_bearing_in_the_centre_drives_a_circle():
    for ratio in (1, 2, 5):
        pair = EccentricPair(0.02, 0.0, ratio)
        assert pair.center_distance == pytest.approx(0.02 * (1 + ratio), rel=1e-14)
        assert pair.driven.frames(1.0).curvature == pytest.approx(50.0 / ratio)
        assert pair.torque_ratio(0.3) == pytest.approx(ratio)


@pytest.mark.parametrize(("ratio", "order"), [(1, 4), (2, 6), (3, 4)])
def test_order_of_the_approximation_for_small_eccentricities(ratio, order):
    parts = np.array([0.2, 0.1])
    pairs = [EccentricPair(1.0, part, ratio) for part in parts]
    errors = [p.approximate_center_distance - p.center_distance for p in pairs]
    assert errors[0] > 0.0
    rate = math.log(errors[0] / errors[1]) / math.log(2.0)
    assert rate == pytest.approx(order, abs=0.2)


@settings(max_examples=25, deadline=None)
@given(PAIRS, st.floats(0.0, 6.28))
def test_power_is_kept(pair, angle):
    """Torque ratio times the ratio of speeds is one."""
    step = 1e-6
    out = pair.driven_turn(angle + step) - pair.driven_turn(angle - step)
    into = pair.driver_turn(angle + step) - pair.driver_turn(angle - step)
    assert pair.torque_ratio(angle) * out / into == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ((0.0, 0.0, 1), "radius"),
        ((math.inf, 0.0, 1), "radius"),
        ((math.nan, 0.0, 1), "radius"),
        ((1.0, -0.1, 1), "eccentricity"),
        ((1.0, 1.0, 1), "eccentricity"),
        ((1.0, math.nan, 1), "eccentricity"),
        ((1.0, 0.1, 0), "ratio"),
        ((1.0, 0.1, 1.5), "ratio"),
        ((1.0, 0.1, math.nan), "ratio"),
        ((1.0, 0.1, math.inf), "ratio"),
        ((1.0, 0.1, 101), "ratio"),
    ],
)
def test_pairs_that_cannot_be(arguments, field):
    with pytest.raises(GeometryError) as error:
        EccentricPair(*arguments)
    assert error.value.field == field
