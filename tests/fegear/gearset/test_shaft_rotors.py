"""Shafts of gear sets as beams on bearings."""

from __future__ import annotations

import pytest
from small_sets import BENT

from fegear.gearset.edit import edited
from fegear.gearset.read import make_gear_set
from fegear.gearset.shaft_rotors import shaft_rotor
from fegear.train.rotors import rotor_system
from lumped.rotors.description import Bearing, Section


def first_shaft(edits=()):
    gear_set = make_gear_set(edited(BENT, dict(edits)))
    shaft = gear_set.shafts[0]
    return gear_set, shaft_rotor(gear_set, shaft, shaft.body)


def test_a_shaft_has_the_sections_and_bearings_of_its_table():
    _, rotor = first_shaft()
    assert rotor.name == "a"
    assert rotor.sections == (
        Section(length=0.1, diameter=0.016, bore=0.002),
        Section(length=0.08, diameter=0.02, bore=0.004),
    )
    assert rotor.bearings == (
        Bearing(
            position=0.01,
            stiffness=(5e7, 0.0, 0.0, 6e7),
            axial_stiffness=2e7,
            tilt_stiffness=3e3,
            damping=(100.0, 0.0, 0.0, 100.0),
        ),
        Bearing(
            position=0.15,
            stiffness=(4e7, 1e6, -1e6, 3e7),
            damping=(50.0, 0.0, 0.0, 50.0),
        ),
    )
    assert rotor.disks == ()
    assert rotor.young_modulus == pytest.approx(
        2.0 * rotor.shear_modulus * (1.0 + make_gear_set(BENT).gears[0].poisson_ratio)
    )


@pytest.mark.parametrize("key", ["kz_N_per_m", "tilt_stiffness_Nm_per_rad"])
def test_a_key_that_is_left_out_is_none_or_zero(key):
    gear_set, rotor = first_shaft({f"shaft.1.bearing_{key}": None}.items())
    field = "axial_stiffness" if key[0] == "k" else "tilt_stiffness"
    absent = None if key[0] == "k" else 0.0
    stated = [getattr(one, field) for one in gear_set.shafts[0].body.bearings]
    assert stated == [absent, absent]
    assert [getattr(one, field) for one in rotor.bearings] == [0.0, 0.0]


def test_shafts_that_spin_have_these_bearings():
    gear_set, rotor = first_shaft()
    spinning = rotor_system(gear_set, [8e8], 3).rotors[0]
    assert spinning.bearings == rotor.bearings
    assert spinning.sections == rotor.sections
    assert len(spinning.disks) == 2
