"""What gears in mesh have in common: equal within printed digits, else refused."""

from __future__ import annotations

import math

import pytest

from fegear.files.errors import InputError
from fegear.gearset import make_gear_set

HELICAL = {"module_mm": 2.0, "helix_angle_deg": 20.0, "face_width_mm": 12.0}


def pair_tables(second=(), **defaults) -> dict:
    return {
        "name": "s",
        "defaults": {**HELICAL, "hub_radius_mm": 8.0, **defaults},
        "gear": [
            {"name": "a", "teeth": 17},
            {"name": "b", "teeth": 23, **dict(second)},
        ],
        "mesh": [
            {"driver": "a", "driven": "b", "operating_pressure_angle_deg": 26.0},
        ],
    }


def module_of_equal_base_pitch(angle_deg: float) -> float:
    """Normal module [mm] with the base pitch across the axis of the first gear."""
    helix = math.radians(HELICAL["helix_angle_deg"])
    cosines = [
        math.cos(math.atan(math.tan(math.radians(angle)) / math.cos(helix)))
        for angle in (20.0, angle_deg)
    ]
    return HELICAL["module_mm"] * cosines[0] / cosines[1]


def test_teeth_that_cross_on_the_base_cylinders_are_refused():
    module = module_of_equal_base_pitch(25.0)
    second = {"pressure_angle_deg": 25.0, "module_mm": module}
    expected = (
        "pressure_angle_deg = 20 and 25; base helix angles "
        "18.7472373 and 18.0577552 deg must be equal"
    )
    with pytest.raises(InputError, match=expected):
        make_gear_set(pair_tables(second))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("key", "rounding"),
    [
        ("helix_angle_deg", 5e-5),
        ("pressure_angle_deg", 5e-5),
        ("module_mm", 1.9e-6),
    ],
)
def test_a_gear_takes_what_its_mate_has_but_for_rounding(key, rounding, sign):
    value = {"pressure_angle_deg": 20.0, **HELICAL}[key]
    gears = make_gear_set(pair_tables({key: value + sign * rounding}))
    exact = make_gear_set(pair_tables())
    assert gears.gears[1].geometry == exact.gears[1].geometry
    assert gears.meshes[0].pair == exact.meshes[0].pair
    (sentence,) = set(gears.inferences) - set(exact.inferences)
    assert sentence.startswith(f'gear "b": {key} = {value:g} instead of ')


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("key", "step"),
    [
        ("helix_angle_deg", 6e-5),
        ("pressure_angle_deg", 6e-5),
        ("module_mm", 2.1e-6),
    ],
)
def test_values_further_apart_than_digits_are_refused(key, step, sign):
    value = {"pressure_angle_deg": 20.0, **HELICAL}[key] + sign * step
    with pytest.raises(InputError, match=key) as refused:
        make_gear_set(pair_tables({key: value}))
    assert f"{value:.12g}" in str(refused.value)


def test_base_pitches_of_other_racks_agree_within_digits():
    exact = 2.0 * math.cos(math.radians(20.0)) / math.cos(math.radians(25.0))
    second = {"pressure_angle_deg": 25.0, "module_mm": round(exact, 6)}
    assert second["module_mm"] != exact
    gears = make_gear_set(pair_tables(second, helix_angle_deg=0.0))
    one, two = (gear.geometry for gear in gears.gears)
    assert two.base_pitch == pytest.approx(one.base_pitch, rel=1e-14)
    assert two.module == pytest.approx(1e-3 * exact, rel=1e-14)


def test_a_chain_of_gears_has_the_values_of_the_first():
    tables = pair_tables({"helix_angle_deg": 20.00005})
    tables["gear"].append({"name": "c", "teeth": 23, "helix_angle_deg": 19.99995})
    tables["mesh"].append(
        {"driver": "b", "driven": "c", "operating_pressure_angle_deg": 26.0}
    )
    helices = [abs(g.geometry.helix_angle) for g in make_gear_set(tables).gears]
    assert helices == [math.radians(20.0)] * 3
