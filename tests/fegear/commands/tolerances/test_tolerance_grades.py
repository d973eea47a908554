"""Tolerances of grades, against hand computations and table values."""

from __future__ import annotations

import math

import pytest

import fegear
from fegear.commands.tolerances.grades import (
    center_distance_tolerance,
    flank_tolerances,
    rounded_um,
    tolerances_of_pair,
)
from fegear.files.errors import InputError
from meshes import SpurGear

NAMES = "single_pitch", "profile_slope", "profile_form", "center_distance"


def gear_of(teeth: int, module_mm: float) -> SpurGear:
    m = 1e-3 * module_mm
    return SpurGear(
        teeth=teeth,
        module=m,
        pressure_angle=math.radians(20.0),
        profile_shift=0.0,
        tip_radius=(0.5 * teeth + 1.0) * m,
        dedendum=1.25 * m,
        rack_tip_radius=0.3 * m,
        hub_radius=0.2 * teeth * m,
    )


@pytest.mark.parametrize(
    ("teeth", "module_mm", "grade", "expected_um"),
    [
        # d = 81 mm: 0.081 + 1.2 + 5 = 6.281; 1.2 + 0.081 + 4 = 5.281; 1.65 + 5 = 6.65
        (27, 3.0, 5, (6.5, 5.5, 6.5)),
        # times 1.41421: 8.883, 7.468, 9.405
        (27, 3.0, 6, (9.0, 7.5, 9.5)),
        # times 2.82843: 17.765, 14.937, 18.809
        (27, 3.0, 8, (18.0, 15.0, 19.0)),
        # d = 20 mm, divided by 4: 5.42, 4.42, 5.55 are 1.355, 1.105, 1.3875
        (20, 1.0, 1, (1.4, 1.1, 1.4)),
    ],
)
def test_flank_tolerances_computed_by_hand(teeth, module_mm, grade, expected_um):
    limits = flank_tolerances(gear_of(teeth, module_mm), grade)
    values = limits.single_pitch, limits.profile_slope, limits.profile_form
    assert values == pytest.approx([1e-6 * um for um in expected_um], rel=1e-12)


@pytest.mark.parametrize(
    ("value", "expected"),
    [(0.04, 0.0), (1.355, 1.4), (5.0, 5.0), (5.2, 5.0), (5.25, 5.5), (9.8, 10.0)],
)
def test_rounding(value, expected):
    assert rounded_um(value) == expected


def test_rounding_above_ten():
    assert [rounded_um(v) for v in (10.2, 10.5, 17.7)] == [10.0, 11.0, 18.0]


@pytest.mark.parametrize(
    ("center_mm", "width_um"), [(50.0, 25), (50.001, 30), (100.0, 35), (2600.0, 210)]
)
def test_centre_distances_have_half_of_it7(center_mm, width_um):
    tolerance = center_distance_tolerance(1e-3 * center_mm)
    assert tolerance == pytest.approx(0.5e-6 * width_um, rel=1e-12)


def test_sizes_beyond_the_standards_are_refused():
    with pytest.raises(InputError, match="centre distance"):
        center_distance_tolerance(3.2)
    with pytest.raises(InputError, match=r"module = 0\.4 mm"):
        flank_tolerances(gear_of(30, 0.4), 6)


def test_amounts_take_the_place_of_a_grade():
    """Gears that the standard does not cover need all of them."""
    pair = fegear.load_gear_set("liu-pair").meshes[0].pair
    amounts = dict.fromkeys(NAMES) | {"single_pitch": 3.0}
    limits = tolerances_of_pair(pair, (5, 7), amounts)
    assert limits["driver_single_pitch"] == limits["driven_single_pitch"] == 3e-6
    assert limits["driven_profile_form"] > limits["driver_profile_form"] > 0.0
    given = tolerances_of_pair(pair, (5, 7), dict.fromkeys(NAMES, 2.0))
    assert set(given.values()) == {2e-6}
