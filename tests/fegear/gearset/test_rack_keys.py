"""Module and pressure angle by the keys of both sections, in mm or teeth per inch."""

from __future__ import annotations

import copy
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fegear.commands.show.derived import gear_set_figures
from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.rack_keys import MODULE_KEYS, PRESSURE_ANGLE_KEYS, restated

ROUND_OFF = 1e-13


def values_of_module(module_mm: float, helix_deg: float) -> dict[str, float]:
    """One normal module by all four keys, from the definitions of each."""
    cosine = math.cos(math.radians(helix_deg))
    return {
        "module_mm": module_mm,
        "transverse_module_mm": module_mm / cosine,
        "diametral_pitch_per_in": 25.4 / module_mm,
        "transverse_diametral_pitch_per_in": 25.4 * cosine / module_mm,
    }


def values_of_angle(angle_deg: float, helix_deg: float) -> dict[str, float]:
    tangent = math.tan(math.radians(angle_deg))
    across = math.atan(tangent / math.cos(math.radians(helix_deg)))
    return {
        "pressure_angle_deg": angle_deg,
        "transverse_pressure_angle_deg": math.degrees(across),
    }


def pair_tables(helix_deg: float = 15.0, **keys: Any) -> dict[str, Any]:
    """A pair whose bores are small beside teeth of any module of a test."""
    return {
        "name": "pair",
        "defaults": {"helix_angle_deg": helix_deg, "hub_radius_mm": 2.0, **keys}
        | {"face_width_mm": 20.0},
        "gear": [{"name": "one", "teeth": 23}, {"name": "two", "teeth": 40}],
        "mesh": [{"driver": "one", "driven": "two"}],
        "load": {"gear": "one", "torques_Nm": [10.0]},
    }


def require_same_numbers(one: Any, two: Any, place: str = "") -> None:
    """Require equal values, numbers of them to round-off."""
    if isinstance(one, dict):
        assert one.keys() == two.keys(), place
        for key, value in one.items():
            require_same_numbers(value, two[key], f"{place}.{key}")
    elif isinstance(one, list):
        assert len(one) == len(two), place
        for number, (a, b) in enumerate(zip(one, two, strict=True)):
            require_same_numbers(a, b, f"{place}.{number}")
    elif isinstance(one, float):
        # backlash and clearances are differences of lengths of many millimetres
        assert two == pytest.approx(one, rel=1e-9, abs=1e-8), place
    else:
        assert one == two, place


@given(
    module=st.floats(0.8, 20.0),
    angle=st.floats(15.0, 24.0),
    helix=st.one_of(st.just(0.0), st.floats(1.0, 30.0)),
    shift=st.floats(0.0, 0.3),
    module_key=st.sampled_from(MODULE_KEYS),
    angle_key=st.sampled_from(PRESSURE_ANGLE_KEYS),
)
def test_all_keys_give_the_same_gears(
    module, angle, helix, shift, module_key, angle_key
):
    modules, angles = values_of_module(module, helix), values_of_angle(angle, helix)
    base = make_gear_set(
        pair_tables(
            helix, profile_shift=shift, module_mm=module, pressure_angle_deg=angle
        )
    )
    stated = {module_key: modules[module_key], angle_key: angles[angle_key]}
    other = make_gear_set(pair_tables(helix, profile_shift=shift, **stated))
    for gear, same in zip(base.gears, other.gears, strict=True):
        for name in (
            "module",
            "pressure_angle",
            "tip_radius",
            "root_radius",
            "base_radius",
            "form_radius",
            "tooth_thickness",
            "rack_tip_radius",
            "dedendum",
        ):
            expected = getattr(gear.geometry, name)
            value = getattr(same.geometry, name)
            assert value == pytest.approx(expected, rel=1e-12), name
    distances = (s.meshes[0].pair.center_distance for s in (base, other))
    assert next(distances) == pytest.approx(next(distances), rel=1e-12)


@pytest.mark.parametrize("angle_key", PRESSURE_ANGLE_KEYS)
@pytest.mark.parametrize("module_key", MODULE_KEYS)
def test_all_keys_give_the_same_figures(module_key, angle_key):
    modules, angles = values_of_module(2.5, 15.0), values_of_angle(20.0, 15.0)
    base = gear_set_figures(make_gear_set(pair_tables(module_mm=2.5)))
    stated = {module_key: modules[module_key], angle_key: angles[angle_key]}
    figures = gear_set_figures(make_gear_set(pair_tables(**stated)))
    for one in (base, figures):
        del one["inferences"]  # sentences with all digits of the centre distance
    require_same_numbers(base, figures)


@given(
    key=st.sampled_from(MODULE_KEYS),
    other=st.sampled_from(MODULE_KEYS),
    value=st.floats(0.1, 100.0),
    helix=st.floats(0.0, 45.0),
)
def test_a_value_that_is_restated_twice_is_the_first(key, other, value, helix):
    there = restated(key, value, other, helix)
    assert restated(other, there, key, helix) == pytest.approx(value, rel=ROUND_OFF)


@given(st.floats(0.5, 20.0), st.floats(1.0, 30.0), st.sampled_from(MODULE_KEYS))
def test_the_pitch_diameter_is_teeth_times_transverse_module(module, helix, key):
    """d = z m_t, and z / P_td inches of it are its transverse diametral pitch."""
    value = values_of_module(module, helix)[key]
    gear_set = make_gear_set(pair_tables(helix, **{key: value}))
    for gear, teeth in zip(gear_set.gears, (23, 40), strict=True):
        diameter_mm = 2e3 * gear.geometry.reference_radius
        across_mm = module / math.cos(math.radians(helix))
        assert diameter_mm == pytest.approx(teeth * across_mm, rel=ROUND_OFF)
    distance_mm = 1e3 * gear_set.meshes[0].pair.center_distance
    assert distance_mm == pytest.approx(0.5 * (23 + 40) * across_mm, rel=1e-12)


def test_a_transverse_pitch_of_eight_has_whole_inches():
    """40 teeth of 8 per inch across the axis: 5 inches at any helix angle."""
    for helix in (0.0, 10.0, 23.0):
        tables = pair_tables(helix, transverse_diametral_pitch_per_in=8)
        wheel = make_gear_set(tables).gears[1].geometry
        assert 2e3 * wheel.reference_radius == pytest.approx(127.0, rel=ROUND_OFF)


def test_lengths_in_modules_are_of_the_normal_one():
    tables = pair_tables(25.0, transverse_module_mm=3.0)
    gear = make_gear_set(tables).gears[0].geometry
    normal = 3e-3 * math.cos(math.radians(25.0))
    assert gear.tip_radius - gear.reference_radius == pytest.approx(normal)
    assert gear.dedendum == pytest.approx(1.25 * normal)
    assert gear.rack_tip_radius == pytest.approx(0.3 * normal)


@pytest.mark.parametrize("key", MODULE_KEYS)
@pytest.mark.parametrize("shared", MODULE_KEYS)
def test_the_key_of_a_gear_replaces_that_of_the_defaults(shared, key):
    tables = pair_tables(**{shared: values_of_module(4.0, 15.0)[shared]})
    value = values_of_module(2.0, 15.0)[key]
    for gear in tables["gear"]:
        gear[key] = value
    gears = make_gear_set(tables).gears
    for gear in gears:
        assert gear.geometry.normal_module == pytest.approx(2e-3, rel=ROUND_OFF)


def test_mates_may_use_different_keys():
    tables = pair_tables(module_mm=2.5)
    modules, angles = values_of_module(2.5, 15.0), values_of_angle(20.0, 15.0)
    key = "transverse_diametral_pitch_per_in"
    tables["gear"][1] |= {key: modules[key]}
    angle_key = "transverse_pressure_angle_deg"
    tables["gear"][1] |= {angle_key: angles[angle_key]}
    gears = make_gear_set(tables)
    assert not [line for line in gears.inferences if "to fit its mate" in line]
    tables["gear"][1][key] = round(modules[key], 6)
    (line,) = [
        line for line in make_gear_set(tables).inferences if "to fit its mate" in line
    ]
    assert line.startswith(f'gear "two": {key} = {modules[key]:.12g} instead of ')


def test_unequal_modules_are_named_by_their_keys():
    tables = pair_tables(module_mm=2.5)
    tables["gear"][1]["diametral_pitch_per_in"] = 10
    with pytest.raises(
        InputError, match=r"module_mm = 2\.5 and diametral_pitch_per_in = 10; base"
    ):
        make_gear_set(tables)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"module_mm": 2.0, "transverse_module_mm": 2.0},
            "module_mm and transverse_module_mm are given; only one is allowed",
        ),
        ({}, "one of module_mm, transverse_module_mm, diametral_pitch_per_in, "),
        (
            {"module_mm": 2.0, "pressure_angle_deg": 20.0}
            | {"transverse_pressure_angle_deg": 20.0},
            "pressure_angle_deg and transverse_pressure_angle_deg are given; only one",
        ),
        (
            {"transverse_module_mm": 0.001},
            "transverse_module_mm = 0.001; must be at least 0.01",
        ),
        (
            {"diametral_pitch_per_in": -8.0},
            "diametral_pitch_per_in = -8; must be at least 0.0254",
        ),
        (
            {"transverse_diametral_pitch_per_in": 5000},
            "transverse_diametral_pitch_per_in = 5000; must be at most 2540",
        ),
        (
            {"module_mm": 2.0, "transverse_pressure_angle_deg": 36.0},
            "transverse_pressure_angle_deg = 36; must be at most 35",
        ),
        ({"transverse_module_mm": "2"}, "must be a number"),
    ],
)
@pytest.mark.parametrize("place", ["defaults", "gear"])
def test_refusals_name_key_value_and_limit(keys, message, place):
    tables = pair_tables()
    if place == "defaults":
        tables["defaults"] |= keys
    else:
        for gear in tables["gear"]:
            gear |= keys
    with pytest.raises(InputError) as caught:
        make_gear_set(tables)
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("key", PRESSURE_ANGLE_KEYS)
def test_the_largest_pressure_angle_is_told_in_the_key_that_states_it(key):
    """35 deg across the axis, in the normal section by its definition."""
    helix = 30.0
    tables = pair_tables(helix, module_mm=3.0, **{key: 34.9})
    if key == "transverse_pressure_angle_deg":
        geometry = make_gear_set(tables).gears[0].geometry
        assert math.degrees(geometry.pressure_angle) == pytest.approx(34.9)
        return
    tangent = math.tan(math.radians(35.0)) * math.cos(math.radians(helix))
    most = math.degrees(math.atan(tangent))
    with pytest.raises(InputError) as caught:
        make_gear_set(tables)
    stated, _, limit = str(caught.value).partition("; at most ")
    assert stated == f'gear "one": {key} = 34.9'
    assert float(limit.split()[0]) == pytest.approx(most, abs=1e-4)
    tables["defaults"][key] = float(limit.split()[0])
    make_gear_set(tables)


@pytest.mark.parametrize("key", MODULE_KEYS)
def test_pitch_errors_have_the_limit_of_half_a_normal_module(key):
    tables = pair_tables(20.0, **{key: values_of_module(2.0, 20.0)[key]})
    tables["gear"][0]["pitch_errors_um"] = [1001.0, *[0.0] * 22]
    with pytest.raises(InputError, match="must be from -1000 to 1000, half the module"):
        make_gear_set(tables)


@pytest.mark.parametrize("key", MODULE_KEYS)
@pytest.mark.parametrize("edit", MODULE_KEYS)
def test_an_edit_replaces_the_key_of_the_file(key, edit):
    tables = pair_tables(**{key: values_of_module(2.0, 15.0)[key]})
    before = copy.deepcopy(tables)
    value = values_of_module(3.0, 15.0)[edit]
    gears = make_gear_set(tables, {f"defaults.{edit}": value}).gears
    assert gears[0].geometry.normal_module == pytest.approx(3e-3, rel=ROUND_OFF)
    of_gears = {f"gear.{name}.{edit}": value for name in ("one", "two")}
    assert make_gear_set(tables, of_gears).gears == gears
    assert tables == before


PLANETS = {
    "name": "planets",
    "defaults": {"face_width_mm": 20.0, "hub_radius_mm": 6.0},
    "gear": [
        {"name": "sun", "teeth": 24},
        {"name": "planet", "teeth": 36},
        {"name": "ring", "teeth": 96, "internal": True, "rim_radius_mm": 120.0},
    ],
    "planetary": [{"sun": "sun", "planet": "planet", "ring": "ring", "planets": 3}],
    "load": {"gear": "sun", "torques_Nm": [40.0]},
}


@pytest.mark.parametrize("place", ["defaults", "gear"])
@pytest.mark.parametrize("key", MODULE_KEYS)
def test_planetary_sets_take_their_centre_distance_from_any_key(key, place):
    """a = m (z_sun + z_planet) / 2 by default."""
    tables = copy.deepcopy(PLANETS)
    value = values_of_module(2.0, 0.0)[key]
    for table in [tables["defaults"]] if place == "defaults" else tables["gear"]:
        table[key] = value
    gear_set = make_gear_set(tables)
    assert len(gear_set.meshes) == 6
    for mesh in gear_set.meshes:
        assert mesh.pair.center_distance == pytest.approx(0.06, rel=ROUND_OFF)
    edits = {f"defaults.{key}": 0.9 * value}
    if place == "gear":
        edits = {f"gear.{g}.{key}": 0.9 * value for g in ("sun", "planet", "ring")}
    ratio = 1.0 / 0.9 if "pitch" in key else 0.9
    edits["gear.ring.rim_radius_mm"] = 130.0
    changed = make_gear_set(tables, edits).meshes[0].pair.center_distance
    assert changed == pytest.approx(0.06 * ratio, rel=ROUND_OFF)


@pytest.mark.parametrize("key", MODULE_KEYS)
def test_planetary_sets_with_wrong_modules_are_refused_by_key(key):
    tables = copy.deepcopy(PLANETS)
    tables["defaults"][key] = -1.0
    with pytest.raises(InputError, match=f"defaults: {key} = -1; must be at least"):
        make_gear_set(tables)
    tables["defaults"] |= {key: 2.0, MODULE_KEYS[key == MODULE_KEYS[0]]: 2.0}
    with pytest.raises(InputError, match="only one is allowed"):
        make_gear_set(tables)


@pytest.mark.parametrize("key", MODULE_KEYS)
def test_a_centre_distance_of_planets_is_not_inferred_where_teeth_do_not_fit(key):
    tables = copy.deepcopy(PLANETS)
    tables["defaults"][key] = values_of_module(2.0, 0.0)[key]
    inferences = make_gear_set(tables).inferences
    assert not [line for line in inferences if "center_distance_mm" in line]
    tables["gear"][2]["teeth"] = 99
    with pytest.raises(InputError, match="planetary: center_distance_mm is needed; te"):
        make_gear_set(tables)


def test_round_off_of_another_key_is_no_other_value():
    for step in range(60):
        module, helix = 1.0 + 0.137 * step, 3.0 + 0.41 * step
        tables = pair_tables(helix, module_mm=module)
        values = values_of_module(module, helix)
        key = MODULE_KEYS[1 + step % 3]
        tables["gear"][1] |= {key: values[key]}
        tables["gear"][1] |= {
            "transverse_pressure_angle_deg": values_of_angle(20.0, helix)[
                "transverse_pressure_angle_deg"
            ]
        }
        inferences = make_gear_set(tables).inferences
        assert not [line for line in inferences if "to fit its mate" in line]


@pytest.mark.parametrize(
    ("key", "value", "distance_mm"),
    [
        # of 3.19246 mm; 31.5 m_t = 100.56249 mm, teeth of 3.1925 mm need 100.56375 mm
        ("transverse_module_mm", 3.1925, 100.562),
        # 7.95625 per inch are the same module, 7.9562 need 100.56309 mm
        ("transverse_diametral_pitch_per_in", 7.9562, 100.562),
    ],
)
def test_digits_of_the_key_in_the_file_may_take_backlash(key, value, distance_mm):
    """Half a unit of the last digit of the module and of the centre distance."""
    tables = pair_tables(20.0, **{key: value})
    tables["mesh"][0]["center_distance_mm"] = distance_mm
    assert make_gear_set(tables).meshes[0].backlash == 0.0
    tables["mesh"][0]["center_distance_mm"] = distance_mm - 0.001
    with pytest.raises(InputError, match=r"center_distance_mm = 100\.561"):
        make_gear_set(tables)
