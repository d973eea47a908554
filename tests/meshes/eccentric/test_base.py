"""Base curves and where they end, against the source's formula and crossings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from meshes.eccentric import EccentricPair
from meshes.eccentric.base import (
    LEADING,
    TRAILING,
    base_points,
    feasibility,
    largest_eccentricity,
    largest_pressure_angle,
    min_curvature,
)

PARTS, ANGLES = st.floats(0.0, 0.6), st.floats(math.radians(5.0), math.radians(35.0))


def crossings(points):
    """Pairs of edges of a polygon (n, 2) that cut each other, one by one."""
    start, end = points, np.roll(points, -1, axis=0)

    def side(a, b, p):
        return (b[..., 0] - a[..., 0]) * (p[..., 1] - a[..., 1]) - (
            b[..., 1] - a[..., 1]
        ) * (p[..., 0] - a[..., 0])

    a, b = start[:, None], end[:, None]
    c, d = start[None], end[None]
    apart = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    return int(apart.sum()) // 2


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(PARTS, ANGLES, st.sampled_from([1, 2]))
def test_the_base_curve_is_touched_by_the_line_of_action(part, alpha, ratio):
    pair, step = EccentricPair(1.0, part, ratio), 1e-5
    angle = np.linspace(0.1, 6.0, 12)
    assume(min_curvature(pair) > 0.1)
    for side in (LEADING, TRAILING):
        frames = [pair.driven.frames(angle + way * step) for way in (-1.0, 0.0, 1.0)]
        back, here, ahead = (base_points(f, alpha, side) for f in frames)
        along = (ahead - back) / (2.0 * step)
        frame = frames[1]
        action = math.cos(alpha) * frame.tangent + side * math.sin(alpha) * frame.normal
        across = along[:, 0] * action[:, 1] - along[:, 1] * action[:, 0]
        assert np.abs(across).max() < 1e-4
        speed = np.sum(along * action, axis=1)
        least = feasibility(pair, alpha).min_speed * math.cos(alpha)
        assert (speed >= least - 1e-4).all()
        assert np.isfinite(here).all()


def test_the_source_s_formula():
    """X and Y with the rotation matrix of alpha, derivatives by differences."""
    pair, alpha, step = EccentricPair(1.0, 0.3), math.radians(22.0), 1e-4
    angle = np.linspace(0.2, 6.0, 9)
    back, here, ahead = (pair.driven.frames(angle + w * step) for w in (-1, 0, 1))
    first = (ahead.point - back.point) / (2.0 * step)
    second = (ahead.point - 2.0 * here.point + back.point) / step**2
    d1, d2 = math.cos(alpha), math.sin(alpha)
    bend = first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]
    x = here.point[:, 0] - d2 * (d1 * first[:, 0] + d2 * first[:, 1]) / bend
    y = here.point[:, 1] + d2 * (d2 * first[:, 0] - d1 * first[:, 1]) / bend
    curves = [base_points(here, alpha, side) for side in (LEADING, TRAILING)]
    off = [np.abs(np.stack([x, y], axis=1) - curve).max() for curve in curves]
    assert min(off) < 1e-6


@pytest.mark.parametrize("ratio", [1, 3])
def test_the_base_of_a_circle_is_a_circle(ratio):
    alpha = math.radians(20.0)
    pair = EccentricPair(0.03, 0.0, ratio)
    points = base_points(pair.driven.frames(np.linspace(0, 6, 9)), alpha, LEADING)
    np.testing.assert_allclose(
        np.hypot(*points.T), 0.03 * ratio * math.cos(alpha), rtol=1e-12
    )


def test_the_source_s_limit_of_eccentricity_0_627():
    pair = EccentricPair(1.0, 0.627)
    low, high = (feasibility(pair, math.radians(a)) for a in (22.0, 28.0))
    assert low.feasible
    assert low.reason == ""
    assert not high.feasible
    assert high.reason == "the base curve has cusps and cuts itself"
    assert math.degrees(largest_pressure_angle(pair)) == pytest.approx(23.834, abs=1e-3)


@pytest.mark.parametrize("part", [0.5, 0.627, 0.7])
def test_the_base_curve_cuts_itself_beyond_the_largest_angle(part):
    pair = EccentricPair(1.0, part)
    largest = largest_pressure_angle(pair)
    # crowded where the loop opens, on the sharp end of the wheel
    angle = np.linspace(-1.0, 1.0, 1501)
    angle = math.pi * angle**3
    for alpha, expected in ((0.99 * largest, False), (1.05 * largest, True)):
        points = base_points(pair.driven.frames(angle), alpha, LEADING)[:-1]
        assert (crossings(points) > 0) == expected


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(st.floats(math.radians(8.0), math.radians(35.0)), st.sampled_from([1, 2, 3]))
def test_both_limits_are_one_boundary(alpha, ratio):
    e = largest_eccentricity(1.0, ratio, alpha)
    limit = largest_pressure_angle(EccentricPair(1.0, e, ratio))
    assert limit == pytest.approx(alpha, rel=1e-6)


def test_a_wheel_that_is_not_convex():
    outcome = feasibility(EccentricPair(1.0, 0.9), math.radians(10.0))
    assert outcome.reason == "the driven pitch curve is not convex"
    assert outcome.largest_pressure_angle == 0.0
