"""A limit that a refusal prints is allowed, and no refused value meets it."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fegear.files.errors import InputError
from fegear.gearset import read_gear_set
from meshes.gear import ceiled, floored

GEARS = """\
name = "pair"
[defaults]
module_mm = {module!r}
face_width_mm = 20
hub_radius_mm = {hub!r}
[[gear]]
name = "one"
teeth = {teeth}
profile_shift = {shift!r}
[[gear]]
name = "two"
teeth = 41
[[mesh]]
driver = "one"
driven = "two"
{spacing}
"""
PAIR = {"module": 2.3, "hub": 8.0, "teeth": 31, "shift": 0.0}
modules = st.floats(0.5, 20.0)


def read(**values):
    text = GEARS.format(**{"spacing": "operating_pressure_angle_deg = 21"} | values)
    return read_gear_set(text)


def refusal(**values) -> str:
    with pytest.raises(InputError) as caught:
        read(**values)
    return str(caught.value)


def limit(message: str, label: str) -> float:
    return float(re.search(rf"{label} ([-0-9.]+)", message)[1])


@given(st.floats(1e-9, 1e9), st.booleans())
def test_no_refused_value_meets_a_rounded_limit(value, negative):
    value = -value if negative else value
    slack = 1e-12 * abs(value)  # that a change of units may add
    assert float(floored(value)) <= value + slack
    assert float(ceiled(value)) >= value - slack
    for rounded in (floored(value), ceiled(value)):
        assert float(rounded) == pytest.approx(value, rel=2e-5)
        assert "e" not in rounded.lower()


@given(modules)
def test_the_largest_hub(module):
    message = refusal(**PAIR | {"module": module, "hub": 40.0 * module})
    largest = limit(message, "at most")
    read(**PAIR | {"module": module, "hub": largest})
    message = refusal(**PAIR | {"module": module, "hub": 1.001 * largest})
    assert "hub_radius_mm" in message


def outcome(**values) -> str:
    try:
        read(**values)
    except InputError as error:
        return str(error)
    return ""


@given(modules)
def test_the_centre_distance_that_gives_a_contact_ratio_of_one(module):
    far = f"center_distance_mm = {(31 + 41) / 2 * module + 2.1 * module!r}"
    message = refusal(**PAIR | {"module": module, "spacing": far, "hub": module})
    assert message.startswith('gear set: mesh "one"-"two": center_distance_mm = ')
    assert "contact ratio" in message
    largest = limit(message, "centre distance at most")
    near = f"center_distance_mm = {largest!r}"
    pair = read(**PAIR | {"module": module, "spacing": near, "hub": module})
    assert pair.meshes[0].pair.contact_ratio == pytest.approx(1.0, abs=2e-3)


def test_a_refused_value_is_shown_as_it_was_given():
    hub = 33.7270001
    message = refusal(**PAIR | {"hub": hub})
    assert f"hub_radius_mm = {hub}; at most " in message
    assert limit(message, "at most") < hub
