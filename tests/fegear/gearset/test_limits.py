"""A limit that a refusal prints is allowed, and no refused value meets it."""

from __future__ import annotations

import copy
import math
import random
import re
from collections.abc import Iterator
from itertools import product
from typing import Any, get_args, get_origin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError, create_model
from pydantic.fields import FieldInfo

from fegear.files.errors import InputError
from fegear.gearset import make_gear_set, read_gear_set
from fegear.gearset.problems import first_problem, model_of
from fegear.gearset.rack_keys import MODULE_KEYS, PRESSURE_ANGLE_KEYS
from fegear.gearset.schema import Document
from lumped.common.checks import format_number
from meshes.gear import apart_from, ceiled, floored

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
    largest = limit(message, "at most")
    near = f"center_distance_mm = {largest!r}"
    pair = read(**PAIR | {"module": module, "spacing": near, "hub": module})
    assert pair.meshes[0].pair.contact_ratio == pytest.approx(1.0, abs=2e-3)


def test_a_refused_value_is_shown_as_it_was_given():
    hub = 33.7270001
    message = refusal(**PAIR | {"hub": hub})
    assert f"hub_radius_mm = {hub}; at most " in message
    assert limit(message, "at most") < hub


RING = {"teeth": 24, "internal": True, "rim_radius_mm": 60.0}
PINION = {"name": "pinion", "teeth": 16, "hub_radius_mm": 6.0}


@pytest.mark.parametrize(
    ("ring", "expected"),
    [
        (
            {"profile_shift": 0.5},
            "profile_shift = 0.5; must be below 0.286646, no cutter of 10 teeth cuts "
            "so thick a tooth",
        ),
        (
            {"profile_shift": -0.5, "cutter_teeth": 8},
            "dedendum_mm = 3.75 by default; must be below 3.67346 mm, the tip of a "
            "cutter of 8 teeth is pointed",
        ),
    ],
)
def test_a_ring_that_no_cutter_cuts_is_refused_with_the_reason(ring, expected):
    mesh = {"driver": "pinion", "driven": "ring", "center_distance_mm": 13.168}
    gears = [PINION, {"name": "ring"} | RING | ring]
    defaults = {"module_mm": 3.0, "face_width_mm": 20.0}
    message = said(PLAIN | {"defaults": defaults, "gear": gears, "mesh": [mesh]})
    assert message == f'gear "ring": {expected}'


def pair(mesh=None, **gear):
    """What is said of a pair of 28 teeth, module 3.175."""
    gears = [{"teeth": 28, "hub_radius_mm": 15.0, "name": name} for name in "pw"]
    if "hub_diameter_mm" in gear:
        del gears[0]["hub_radius_mm"]
    ends = {"driver": "p", "driven": "w", "center_distance_mm": 88.9}
    tables = {"gear": [gears[0] | gear, gears[1]], "mesh": [ends | (mesh or {})]}
    defaults = {"module_mm": 3.175, "face_width_mm": 6.35}
    return said(PLAIN | tables | {"defaults": defaults})


def test_limits_are_those_of_the_key_that_is_written():
    ratio = pair({"contact_ratio": 2.1})
    assert "contact_ratio = 2.1 of" in ratio
    assert "must be below 1.98141, the mate meets the root circle" in ratio
    assert not pair({"contact_ratio": 1.9814})
    assert "hub_diameter_mm = 90; at most 77.7875 mm" in pair(hub_diameter_mm=90.0)
    assert "tip_diameter_mm = 99; must be below 96.8375" in pair(tip_diameter_mm=99.0)


def test_a_limit_of_both_gears_holds_for_both_and_names_one():
    wide = {"teeth": 40}
    mesh = {"center_distance_mm": 107.95}
    mesh["tip_relief"] = {"magnitude_um": 9.0, "length_pitches": 5.0}
    message = pair(mesh, **wide)
    longest = limit(message, "at most")
    assert re.search(r'whole profile of gear "[pw]"$', message)
    mesh["tip_relief"]["length_pitches"] = longest
    assert not pair(mesh, **wide)
    points = {"roll_angle_deg": [1.0, 20.0], "deviation_um": [0.0, 0.0]}
    message = pair({"profile": points})
    assert re.search(r'at least [\d.]+ deg, the form circle of gear "[pw]"$', message)


PLAIN = {
    "name": "sets",
    "defaults": {"module_mm": 2.0, "face_width_mm": 12.0},
}


def external_pair(r, third=False):
    names = ["one", "two", "three"][: 3 if third else 2]
    teeth = [r.randint(19, 50) for _ in names]
    gears = [
        {"name": n, "teeth": z, "hub_radius_mm": 6.0}
        for n, z in zip(names, teeth, strict=True)
    ]
    meshes = [
        {
            "driver": names[i],
            "driven": names[i + 1],
            "center_distance_mm": float(sum(teeth[i : i + 2])) + r.choice([0.0, 0.05]),
        }
        for i in range(len(names) - 1)
    ]
    return PLAIN | {"gear": gears, "mesh": meshes, "load": {"gear": "one"} | LOAD}


def ring_and_planet(r):
    planet = r.randint(19, 40)
    ring = planet + r.randint(25, 50)
    gears = [
        {"name": "planet", "teeth": planet, "hub_radius_mm": 6.0},
        {"name": "ring", "teeth": ring, "internal": True, "rim_radius_mm": ring + 9.0},
    ]
    ends = r.choice([("planet", "ring"), ("ring", "planet")])
    mesh = {"center_distance_mm": float(ring - planet)}
    mesh |= dict(zip(("driver", "driven"), ends, strict=True))
    return PLAIN | {"gear": gears, "mesh": [mesh], "load": {"gear": ends[0]} | LOAD}


def planetary_set(r):
    sun, planet = r.choice([(24, 36), (30, 21), (20, 31)])
    ring = sun + 2 * planet
    gears = [
        {"name": "sun", "teeth": sun, "hub_radius_mm": 6.0},
        {"name": "planet", "teeth": planet, "hub_radius_mm": 6.0},
        {"name": "ring", "teeth": ring, "internal": True, "rim_radius_mm": ring + 9.0},
    ]
    members = {"sun": "sun", "planet": "planet", "ring": "ring"}
    tables = {"gear": gears, "planetary": [members | {"planets": 2}]}
    tables["planetary"][0]["center_distance_mm"] = float(sun + planet)
    return PLAIN | tables | {"load": {"gear": "sun"} | LOAD}


LOAD = {"torques_Nm": [40.0]}
SETS = [
    external_pair,
    ring_and_planet,
    lambda r: external_pair(r, third=True),
    planetary_set,
]
BEARING = {"balls": 9, "ball_diameter_mm": 8.0, "pitch_diameter_mm": 40.0}
CRACK = {"tooth": 1, "depth_mm": 1.0}
# values far beyond a limit; those of a mesh are of one of its reliefs or profiles
GEAR_VALUES = {
    "hub_radius_mm": (15.0, 90.0),
    "hub_diameter_mm": (30.0, 180.0),
    "rim_radius_mm": (20.0, 70.0),
    "tip_radius_mm": (10.0, 90.0),
    "tip_diameter_mm": (20.0, 180.0),
    "addendum_mm": (-4.0, 6.0),
    "dedendum_mm": (0.5, 8.0),
    "rack_tip_radius_mm": (0.7, 3.0),
    "profile_shift": (-2.0, 4.0),
    "tooth_thinning_um": (-1500.0, 1500.0),
    "cutter_teeth": (2, 90),
    "teeth": (1, 4),
    "pressure_angle_deg": (1.0, 80.0),
    "transverse_pressure_angle_deg": (1.0, 80.0),
    "module_mm": (0.001, 0.009),
    "transverse_module_mm": (0.001, 0.009),
    "diametral_pitch_per_in": (3e3, 9e3),
    "transverse_diametral_pitch_per_in": (0.001, 0.02),
    "face_width_mm": (-3.0, 0.0),
    "poisson_ratio": (0.5, 2.0),
    "density_kg_per_m3": (-1.0, 0.0),
    "young_modulus_GPa": (-1.0, 0.0),
    "inertia_kg_m2": (-1.0, 0.0),
    "mass_kg": (-1.0, 0.0),
    "coupling_stiffness_Nm_per_rad": (-5.0, -1.0),
    "bearing_kx_N_per_m": (-5.0, 0.0),
    "eccentricity_um": (-5.0, -1.0),
}
MESH_VALUES = {
    "center_distance_mm": (10.0, 120.0),
    "operating_pressure_angle_deg": (5.0, 80.0),
    "contact_ratio": (0.5, 3.0),
    "backlash_um": (-9.0, -1.0),
    "load_share": (-1.0, 2.0),
    "stiffness_variation": (-1.0, 2.0),
    "mean_stiffness_N_per_m": (-9.0, 0.0),
}
RELIEF_VALUES = {"length_pitches": (0.5, 4.0), "start_roll_angle_deg": (1.0, 60.0)}
PROFILE_VALUES = {
    "crowning_um": (-3000.0, 3000.0),
    "slope_um": (-3000.0, 3000.0),
    "roll_angle_deg": (1.0, 60.0),
    "diameter_mm": (10.0, 200.0),
}


def value_in(r, limits):
    low, high = limits
    return r.randint(low, high) if isinstance(low, int) else r.uniform(low, high)


def mesh_table(r, tables):
    """A table that has the keys of a mesh."""
    if "mesh" in tables:
        return r.choice(tables["mesh"])
    return tables["planetary"][0].setdefault(r.choice(["sun_mesh", "ring_mesh"]), {})


def table_with_value(r, tables):
    """A table with a value of a key put in, and the key."""
    kind = r.choice(["gear", "gear", "mesh", "mesh", "relief", "profile", "fault"])
    if kind == "gear":
        table, key = r.choice(tables["gear"]), r.choice(list(GEAR_VALUES))
        if key in MODULE_KEYS or key in PRESSURE_ANGLE_KEYS:  # which all gears share
            table = tables["defaults"]
        if key in MODULE_KEYS:
            del table["module_mm"]
        if key.startswith("hub"):
            table.pop("hub_radius_mm", None)
        table[key] = value_in(r, GEAR_VALUES[key])
        if key == "bearing_kx_N_per_m":
            table["bearing_ky_N_per_m"] = 1e8
        return table, key
    if kind == "fault":
        table = r.choice(tables["gear"])
        key, entry, limits = r.choice(
            [
                ("ball_bearing", BEARING, {"ball_diameter_mm": (14.0, 39.0)}),
                ("ball_bearing", BEARING, {"balls": (16, 90)}),
                ("cracks", CRACK, {"depth_mm": (1e-4, 9.0)}),
                ("broken_tips", {"tooth": 1, "height_mm": 0.1}, {"tooth": (60, 99)}),
            ]
        )
        name = next(iter(limits))
        entry = entry | {name: value_in(r, limits[name])}
        table[key] = entry if key == "ball_bearing" else [entry]
        return (entry, name)
    mesh = mesh_table(r, tables)
    if kind == "mesh":
        key = r.choice(list(MESH_VALUES))
        if key in SPACING:
            mesh = tables.get("mesh", tables.get("planetary"))[0]
            mesh.pop("center_distance_mm")
        mesh[key] = value_in(r, MESH_VALUES[key])
        return mesh, key
    role = r.choice(["", "driver_", "driven_"])
    if kind == "relief":
        key = r.choice(list(RELIEF_VALUES))
        relief = {"magnitude_um": 9.0, key: value_in(r, RELIEF_VALUES[key])}
        mesh[f"{role}{r.choice(['tip', 'root'])}_relief"] = relief
        return relief, key
    key = r.choice(list(PROFILE_VALUES))
    profile = {key: value_in(r, PROFILE_VALUES[key])}
    if key in ("roll_angle_deg", "diameter_mm"):
        profile = {key: [profile[key], profile[key] + 300.0], "deviation_um": [0, 0]}
    mesh[f"{role}profile"] = profile
    return profile, key


SPACING = ("center_distance_mm", "operating_pressure_angle_deg")
NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"
LIMIT = re.compile(
    rf"(at most|at least|must be at most|must be at least) {NUMBER}"
    rf"|(must be above|must be below|must stay below half a module,) {NUMBER}"
    rf"|(?:must be from|allowed) {NUMBER} to {NUMBER}"
)


def limit_of(message, key, value):
    """The value that a refusal of a key allows; None where it states none."""
    stated = rf"\b{key}(?: entry \d+)? = [^;]*; "
    match = re.search(stated, message)
    limit = match and LIMIT.match(message, match.end())
    if not limit:
        return None
    closed, number, opened, edge, low, high = limit.groups()
    if closed:
        return float(number)
    if opened:
        step = 1e-6 * max(1.0, abs(float(edge)))
        inside = float(edge) + (step if opened == "must be above" else -step)
        return math.copysign(inside, value) if "half" in opened else inside
    return min(max(value, float(low)), float(high))


def said(tables):
    try:
        make_gear_set(copy.deepcopy(tables))
    except InputError as error:
        return str(error)
    return ""


def refusals_that_are_followed(seed, count):
    """Keys of refused values, their messages, and those after the limit is followed."""
    r = random.Random(seed)
    while count:
        tables = copy.deepcopy(r.choice(SETS)(r))
        table, key = table_with_value(r, tables)
        message = said(tables)
        entry = isinstance(table[key], list)
        value = table[key][0] if entry else table[key]
        allowed = limit_of(message, key, value)
        if allowed is None:
            continue
        count -= 1
        allowed = round(allowed) if isinstance(value, int) else allowed
        table[key] = [allowed, *table[key][1:]] if entry else allowed
        yield key, message, said(tables)


def require_accepted(seed, count):
    wrong = [
        (message, after)
        for key, message, after in refusals_that_are_followed(seed, count)
        if re.search(rf"\b{key}(?: entry 1)? = ", after)
    ]
    assert not wrong, f"{len(wrong)} of {count}: " + "\n".join(map(str, wrong[:3]))


def test_a_limit_that_is_followed_is_not_refused():
    require_accepted(seed=1, count=60)


@pytest.mark.slow
def test_limits_that_are_followed_are_not_refused():
    require_accepted(seed=2, count=200)


def models(model: type[BaseModel], seen: set[type[BaseModel]]) -> set[type[BaseModel]]:
    """The tables of a document, and those within them."""
    if model not in seen:
        seen.add(model)
        for entry in model.model_fields.values():
            if inner := model_of(entry.annotation):
                models(inner, seen)
    return seen


def limits_in(kind: Any) -> Iterator[tuple[str, float]]:
    """Limits of numbers, of lists not of their entries."""
    for part in getattr(kind, "__metadata__", ()):
        metadata = part.metadata if isinstance(part, FieldInfo) else [part]
        for limit, side in product(metadata, SIGNS):
            if getattr(limit, side, None) is not None:
                yield side, getattr(limit, side)
    if get_origin(kind) is not tuple:
        for inner in get_args(kind):
            yield from limits_in(inner)


SIGNS = {"ge": -1, "le": 1}


def limits_of_keys() -> Iterator[tuple[str, Any, float]]:
    """Each key with a limit: its name, its type with limits, a value just beyond."""
    for model in sorted(models(Document, set()), key=lambda table: table.__name__):
        for name, entry in model.model_fields.items():
            kind = entry.rebuild_annotation()
            if "float" in str(kind):
                for side, end in limits_in(kind):
                    value = end + SIGNS[side] * 1e-9 * (abs(end) or 1.0)
                    yield f"{model.__name__}.{name}", kind, value


LIMITS_OF_KEYS = list(limits_of_keys())


def test_there_are_keys_with_limits():
    assert len(LIMITS_OF_KEYS) > 30


@pytest.mark.parametrize(("name", "kind", "value"), LIMITS_OF_KEYS)
def test_a_value_just_beyond_a_limit_is_printed_apart_from_it(name, kind, value):
    model = create_model("Table", key=(kind, ...))
    with pytest.raises(ValidationError) as caught:
        model.model_validate({"key": float(value)})
    message = first_problem(caught.value, {}, model)
    stated, _, allowed = message.partition(";")
    assert float(stated.removeprefix("key = ")) == value
    end = float(allowed.split()[-1])
    assert end != value == pytest.approx(end, rel=1e-8, abs=1e-8)


@given(st.floats(1e-9, 1e9), st.floats(1e-12, 1.0))
def test_a_value_beyond_a_limit_is_told_apart_from_it(limit, beyond):
    above, below = limit * (1.0 + beyond), limit * (1.0 - beyond)
    assert float(apart_from(above, floored(limit))) > float(floored(limit))
    assert float(apart_from(below, ceiled(limit))) < float(ceiled(limit))
    for value in (above, below):
        assert float(format_number(value)) == value
    assert apart_from(10.8, "3") == "10.8"
