"""The generated tooth against its definition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import make_gear
from hypothesis import given
from hypothesis import strategies as st

from meshes import GeometryError
from meshes.involute import inverse_involute, involute
from meshes.profile import (
    arc_from_tip,
    fillet_points,
    flank_points,
    flank_tangents,
    roll_length_at_arc,
)

STEEPEST = math.radians(70.0)


@given(st.floats(1e-2, 1.5))
def test_inverse_involute(angle):
    assert inverse_involute(involute(angle)) == pytest.approx(angle, rel=1e-9)


def test_normals_of_the_flank_touch_the_base_circle(pinion):
    roll = np.linspace(pinion.form_roll_length, pinion.tip_roll_length, 30)
    points, tangents = flank_points(pinion, roll), flank_tangents(pinion, roll)
    arm = np.einsum("ij,ij->i", points, tangents)  # of the normal about the centre
    np.testing.assert_allclose(arm, pinion.base_radius, rtol=1e-13)


def test_tangents_and_arcs_are_those_of_the_curve(pinion):
    roll = np.linspace(pinion.form_roll_length, pinion.tip_roll_length, 4001)
    steps = np.diff(flank_points(pinion, roll), axis=0)
    length = np.hypot(*steps.T)
    along = np.diff(-arc_from_tip(pinion, roll))
    np.testing.assert_allclose(length, along, rtol=1e-7)
    middle = 0.5 * (roll[1:] + roll[:-1])
    np.testing.assert_allclose(
        steps / length[:, None], flank_tangents(pinion, middle), atol=1e-7
    )


def test_roll_length_and_arc_are_inverse(pinion):
    roll = np.linspace(pinion.form_roll_length, pinion.tip_roll_length, 9)
    np.testing.assert_allclose(
        roll_length_at_arc(pinion, arc_from_tip(pinion, roll)), roll, rtol=1e-12
    )


@given(
    teeth=st.integers(10, 120),
    shift=st.floats(-0.3, 0.8),
    rounding=st.floats(0.05, 0.38),
    dedendum=st.floats(1.1, 1.4),
)
def test_fillet_joins_flank_and_root_smoothly(teeth, shift, rounding, dedendum):
    module = 2.54e-3
    try:
        gear = make_gear(
            teeth,
            2e-3,
            profile_shift=shift,
            rack_tip_radius=rounding * module,
            dedendum=dedendum * module,
            tip_radius=module * (0.5 * teeth + 1.0 + shift),
        )
    except GeometryError:
        return  # pointed or without room for the rack tip
    if gear.is_undercut:
        return  # the fillet has a corner there
    start = flank_points(gear, gear.form_roll_length)
    np.testing.assert_allclose(fillet_points(gear, STEEPEST), start, atol=1e-13)
    root = fillet_points(gear, 0.0)
    assert np.hypot(*root) == pytest.approx(gear.root_radius, rel=1e-12)
    beta = STEEPEST - np.array([2e-6, 1e-6])
    last = np.diff(fillet_points(gear, beta), axis=0)[0]
    tangent = flank_tangents(gear, gear.form_roll_length)
    assert last @ tangent / np.hypot(*last) == pytest.approx(1.0, abs=1e-6)


def test_no_point_of_the_fillet_lies_below_the_root(pinion):
    radius = np.hypot(*fillet_points(pinion, np.linspace(0.0, STEEPEST, 200)).T)
    assert (np.diff(radius) > 0.0).all()


@pytest.mark.parametrize(
    ("changes", "field", "message"),
    [
        (
            {
                "teeth": 6,
                "profile_shift": -0.6,
                "hub_radius": 1e-3,
                "tip_radius": 8.6e-3,
            },
            "profile_shift",
            "undercut",
        ),
        ({"tip_radius": 54e-3}, "tip_radius", "pointed"),
        ({"tip_radius": 45e-3}, "tip_radius", "form radius"),
        ({"hub_radius": 46e-3}, "hub_radius", "root circle"),
        ({"hub_radius": -1e-3}, "hub_radius", "positive"),
        ({"module": math.nan}, "module", "positive and finite"),
        ({"rack_tip_radius": 2e-3}, "rack_tip_radius", "at most"),
        ({"pressure_angle": 1.0}, "pressure_angle", "5 to 35"),
        ({"tooth_thinning": 2e-3}, "tooth_thinning", "half a module"),
    ],
)
def test_impossible_gears_are_named(changes, field, message):
    with pytest.raises(GeometryError, match=message) as caught:
        make_gear(**({"teeth": 38, "hub_radius": 15e-3} | changes))
    assert caught.value.field == field
