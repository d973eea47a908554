"""Helical gears: their transverse section, cut by a rack rounded in the normal one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear, make_helical
from scipy.optimize import minimize_scalar
from sliced_pairs import ring_of

from meshes import GearPair, GeometryError
from meshes.gear import fillet_at
from meshes.profile import fillet_points


def test_a_small_helix_leaves_a_spur_gear():
    spur, helical = make_gear(23, 8e-3), make_helical(23, 8e-3, 1e-3)
    beta = np.linspace(0.0, spur.form_normal_angle, 7)
    apart = fillet_points(helical, beta) - fillet_points(spur, beta)
    assert np.abs(apart).max() < 1e-9 * spur.module
    assert helical.form_radius == pytest.approx(spur.form_radius, rel=1e-9)
    assert helical.base_radius == spur.base_radius


@pytest.mark.parametrize("teeth", [14, 23, 60])
@pytest.mark.parametrize("helix_angle_deg", [-12.0, 30.0])
def test_the_fillet_is_what_an_ellipse_leaves(teeth, helix_angle_deg):
    """The rounding rolls past every point of the fillet and just touches it."""
    hub = 0.3 * teeth * 2.54e-3
    gear = make_helical(teeth, hub, helix_angle_deg)
    half_width, depth = gear.rack_tip_center
    rho, r = gear.rack_tip_radius, gear.reference_radius
    stretch = 1.0 / math.cos(math.radians(helix_angle_deg))
    for beta in np.linspace(0.05, 0.95, 5) * gear.form_normal_angle:
        x, y = fillet_points(gear, beta)

        def outside(rolled, x=x, y=y):
            """How far a point of the gear is from the ellipse at a roll of the rack."""
            angle = rolled / r - math.pi / gear.teeth
            c, s = math.cos(angle), math.sin(angle)
            across = (c * x + s * y) - (rolled - half_width)
            up = (c * y - s * x) - (r - depth)
            return math.hypot(across / (rho * stretch), up / rho) - 1.0

        rolled = half_width - depth * math.tan(beta)
        near = minimize_scalar(
            outside, bracket=(rolled - rho, rolled + rho), options={"xtol": 1e-12}
        )
        assert abs(near.fun) < 1e-9


def test_the_fillet_as_numbers_is_that_as_arrays():
    gear = make_helical(23, 8e-3, 25.0)
    for beta in (0.1, 0.6, gear.form_normal_angle):
        radius, angle = fillet_at(gear, beta)
        x, y = fillet_points(gear, beta)
        assert radius == pytest.approx(math.hypot(x, y), rel=1e-13)
        assert angle == pytest.approx(math.atan2(x, y), rel=1e-9)


def test_the_fillet_meets_flank_and_root():
    gear = make_helical(23, 8e-3, 25.0)
    ends = fillet_points(gear, np.array([0.0, gear.form_normal_angle]))
    radius = np.hypot(*ends.T)
    assert radius == pytest.approx([gear.root_radius, gear.form_radius], rel=1e-12)
    angle = math.atan2(*ends[1])
    assert angle == pytest.approx(gear.half_angle(gear.form_radius), rel=1e-9)


def test_the_twist_is_that_of_the_helix():
    gear = make_helical(23, 8e-3, -20.0)
    lead = 2.0 * math.pi / gear.twist
    expected = 2.0 * math.pi * gear.reference_radius / math.tan(math.radians(-20.0))
    assert lead == pytest.approx(expected, rel=1e-14)
    slope = math.tan(math.radians(-20.0)) * math.cos(gear.pressure_angle)
    assert math.tan(gear.base_helix_angle) == pytest.approx(slope, rel=1e-14)


@pytest.mark.parametrize("helix_angle_deg", [0.0, 46.0, -90.0, math.nan])
def test_helix_angles_have_limits(helix_angle_deg):
    with pytest.raises(GeometryError, match="deg; must be above 0"):
        make_helical(23, 8e-3, helix_angle_deg)


@pytest.mark.parametrize("helix_angle_deg", [20.0, -21.0])
def test_helices_of_a_pair_are_opposite(helix_angle_deg):
    driver = make_helical(23, 8e-3, 20.0)
    pitch = driver.module * math.cos(driver.pressure_angle)
    driven = make_helical(31, 8e-3, helix_angle_deg)
    driven = replace(driven, module=pitch / math.cos(driven.pressure_angle))
    distance = 1.01 * (driver.reference_radius + driven.reference_radius)
    with pytest.raises(GeometryError, match="they must be opposite"):
        GearPair(driver, driven, distance)


def test_a_ring_has_the_hand_of_its_pinion():
    """Both are turned alike, by as much less as the ring has more teeth."""
    pinion = make_helical(25, 8e-3, 20.0)
    ring = ring_of(pinion)
    ratio = pinion.teeth / ring.teeth
    assert ring.twist == pytest.approx(ratio * pinion.twist, rel=1e-14)
    distance = -(pinion.reference_radius + ring.reference_radius)
    assert GearPair(pinion, ring, distance).overlap_ratio(0.02) > 0.0
    with pytest.raises(GeometryError, match="they must be opposite"):
        GearPair(pinion, replace(ring, helix_angle=-ring.helix_angle), distance)
    with pytest.raises(GeometryError, match="deg; must be above 0"):
        replace(ring, helix_angle=0.0)
