"""A bearing without gears, from a file of its own."""

from __future__ import annotations

import numpy as np
import pytest

import fegear
from fegear.commands.bearing.study import BearingLoad
from fegear.files.errors import InputError
from fegear.files.templates import template_text
from fegear.studies.trains.gear_sets import GearSetRef

OF_A_GEAR = "{balls=9, ball_diameter_mm=7.94, pitch_diameter_mm=38.5, clearance_um=10}"


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "bearing.toml"
    file.write_text(template_text("bearing"))
    return str(file)


def solved(name, *edits, **settings):
    return fegear.run(
        BearingLoad(gear_set=GearSetRef(name=name, edits=edits), **settings)
    )


def test_it_has_the_loads_of_the_same_bearing_of_a_gear(path):
    alone = solved(path, load=1000.0)
    gear = solved("liu-pair", f"gear.1.ball_bearing={OF_A_GEAR}", load=1000.0)
    for name, values in alone.distribution.items():
        np.testing.assert_array_equal(values, gear.distribution[name])
    assert alone.summary["bearing"] == "my-bearing"
    assert "gear_set" not in alone.summary


def test_an_edit_changes_it(path):
    loose, tight = (
        solved(path, f"ball_bearing.clearance_um={um}", load=1000.0).summary
        for um in (10, 0)
    )
    assert tight["max_element_load_N"] < loose["max_element_load_N"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "load is missing; a bearing without gears needs it"),
        ({"load": 1.0, "gear_name": "x"}, "my-bearing has no gears"),
    ],
)
def test_what_belongs_to_gears_is_refused(path, settings, message):
    with pytest.raises(InputError, match=message):
        solved(path, **settings)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ("ball_bearing.ball=9", "unknown key ball_bearing.ball, did you mean balls"),
        ("ball_bearing.balls=90", "ball_bearing: ball_diameter_mm = 7.94; at most"),
        ("roller_bearing.rollers=9", "roller_bearing.pitch_diameter_mm is missing"),
        ("teeth.z=9", "unknown key teeth"),
    ],
)
def test_what_is_wrong_in_its_file_is_named(path, edit, message):
    with pytest.raises(InputError, match=f"{path}: {message}"):
        solved(path, edit, load=1.0)


def test_two_bearings_are_one_too_many(tmp_path):
    file = tmp_path / "two.toml"
    file.write_text(
        template_text("bearing")
        + "[roller_bearing]\nrollers = 14\nroller_diameter_mm = 9.0\n"
        "roller_length_mm = 9.0\npitch_diameter_mm = 55.0\n"
    )
    with pytest.raises(InputError, match="one of ball_bearing and roller_bearing"):
        solved(str(file), load=1.0)


def test_other_commands_say_who_reads_it(path):
    with pytest.raises(InputError, match="a bearing file, which `fegear bearing`"):
        fegear.load_gear_set(path)
