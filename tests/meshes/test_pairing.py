"""Two gears in mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import center_distance_at, make_gear

from meshes import GearPair, GeometryError


def test_figures_of_the_sample_pair(pair):
    assert pair.contact_ratio == pytest.approx(1.504, abs=1e-6)
    assert math.degrees(pair.operating_pressure_angle) == pytest.approx(21.22)
    assert pair.pitch_point + pair.driven.base_radius * math.tan(
        pair.operating_pressure_angle
    ) == pytest.approx(pair.line_of_action)


def test_swapping_keeps_contact_ratio_and_backlash(pair):
    assert pair.swapped.contact_ratio == pytest.approx(pair.contact_ratio)
    assert pair.swapped.backlash == pytest.approx(pair.backlash)


def test_backlash_vanishes_at_the_reference_distance(pinion, wheel):
    tight = GearPair(pinion, wheel, pinion.reference_radius + wheel.reference_radius)
    assert tight.backlash == pytest.approx(0.0, abs=1e-12)


def test_backlash_is_the_thinning_along_the_line_of_action(wheel):
    thin = make_gear(38, 15e-3, tooth_thinning=100e-6)
    pair = GearPair(thin, wheel, thin.reference_radius + wheel.reference_radius)
    expected = 100e-6 * math.cos(math.radians(20.0))
    assert pair.backlash == pytest.approx(expected, rel=1e-9)


def test_wider_distance_opens_backlash_and_lowers_contact_ratio(pinion, wheel):
    angles = np.radians([20.0, 21.0, 22.0])
    pairs = [
        GearPair(pinion, wheel, center_distance_at(pinion, wheel, a)) for a in angles
    ]
    assert np.all(np.diff([p.backlash for p in pairs]) > 0.0)
    assert np.all(np.diff([p.contact_ratio for p in pairs]) < 0.0)


@pytest.mark.parametrize(
    ("changes", "distance", "message"),
    [
        ({}, 0.100, "base radii"),
        ({}, 0.1215, "at least 1"),
        ({}, 0.1180, "jam"),
        ({"module": 3e-3, "tip_radius": 86e-3}, 0.1330, "base pitches"),
        ({"tip_radius": 73.8e-3}, 0.1183, "digs below"),
    ],
)
def test_impossible_pairs_are_named(pinion, changes, distance, message):
    with pytest.raises(GeometryError, match=message):
        GearPair(pinion, make_gear(55, 20e-3, **changes), distance)
