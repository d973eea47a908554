"""Properties that hold for whole families of gear set files."""

from __future__ import annotations

import math

from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fegear.files.errors import InputError
from fegear.gearset import read_gear_set

GEAR_KEYS = {
    "teeth": "30",
    "module_mm": "2.5",
    "pressure_angle_deg": "20",
    "profile_shift": "0.1",
    "dedendum_mm": "3.2",
    "hub_radius_mm": "12",
    "face_width_mm": "20",
    "young_modulus_GPa": "210",
    "tooth_thinning_um": "40",
}
MESH_KEYS = {
    "driver": '"one"',
    "driven": '"two"',
    "operating_pressure_angle_deg": "22",
    "contact_ratio": "1.4",
    "tip_relief": "{ magnitude_um = 10, length_pitches = 0.3 }",
}
LOAD_KEYS = {"gear": '"one"', "torques_Nm": "[10, 20]"}


def table(header: str, keys: dict[str, str]) -> str:
    return "\n".join([header, *(f"{key} = {value}" for key, value in keys.items()), ""])


def pair_text(gear: dict[str, str], mesh: dict[str, str], load: dict[str, str]) -> str:
    return 'name = "pair"\n' + "\n".join(
        [
            table("[[gear]]", gear | {"name": '"one"'}),
            table("[[gear]]", gear | {"name": '"two"', "teeth": "47"}),
            table("[[mesh]]", mesh),
            table("[load]", load),
        ]
    )


def refusal(text: str) -> str:
    """What is said against a text, nothing if it can be read."""
    try:
        read_gear_set(text)
    except InputError as error:
        return str(error)
    return ""


def shuffled(keys: dict[str, str]):
    return st.permutations(list(keys.items())).map(dict)


@settings(max_examples=25, deadline=None)
@given(gear=shuffled(GEAR_KEYS), mesh=shuffled(MESH_KEYS), load=shuffled(LOAD_KEYS))
def test_order_of_keys_does_not_matter(gear, mesh, load):
    ordered = read_gear_set(pair_text(GEAR_KEYS, MESH_KEYS, LOAD_KEYS))
    assert read_gear_set(pair_text(gear, mesh, load)) == ordered


@settings(max_examples=60, deadline=None)
@given(
    teeth=st.tuples(st.integers(20, 90), st.integers(20, 90)),
    angle=st.floats(20.0, 22.0),
    ratio=st.floats(1.05, 1.8),
    shift=st.floats(-0.1, 0.3),
)
def test_equal_addenda_give_the_contact_ratio(teeth, angle, ratio, shift):
    mesh = MESH_KEYS | {
        "operating_pressure_angle_deg": repr(angle),
        "contact_ratio": repr(ratio),
        "tip_relief": "{ magnitude_um = 10, length_pitches = 0.01 }",
    }
    shape = GEAR_KEYS | {"module_mm": "3", "dedendum_mm": "4.2"}
    one = shape | {"teeth": str(teeth[0]), "profile_shift": repr(shift)}
    two = shape | {"teeth": str(teeth[1]), "profile_shift": repr(-shift)}
    text = 'name = "pair"\n' + "\n".join(
        [
            table("[[gear]]", one | {"name": '"one"'}),
            table("[[gear]]", two | {"name": '"two"'}),
            table("[[mesh]]", mesh),
        ]
    )
    assume(not refusal(text))  # no such gears
    gear_set = read_gear_set(text)
    pair = gear_set.meshes[0].pair
    addenda = [
        g.geometry.tip_radius - g.geometry.reference_radius for g in gear_set.gears
    ]
    assert math.isclose(pair.contact_ratio, ratio, abs_tol=1e-9)
    assert math.isclose(*addenda, abs_tol=1e-12)


BARE = st.characters(min_codepoint=32, max_codepoint=126, exclude_characters='"\\')


@settings(max_examples=200, deadline=None)
@given(st.text())
def test_any_text_is_read_or_refused_in_one_line(text):
    assert len(refusal(text).splitlines()) <= 1


VALUES = st.one_of(
    st.integers(-(10**30), 10**30).map(str),
    st.floats().map(repr),
    st.booleans().map(lambda value: str(value).lower()),
    st.text(BARE, max_size=60).map(lambda text: f'"{text}"'),
    st.sampled_from(["[]", "{}", "[1, [2]]", "1979-05-27", "[{}]", '[""]']),
)
PLACES = [("gear", key) for key in GEAR_KEYS]
PLACES += [("gear", key) for key in ("addendum_mm", "tip_radius_mm", "pitch_errors_um")]
PLACES += [("mesh", key) for key in [*MESH_KEYS, "phase", "root_relief"]]
PLACES += [("load", key) for key in LOAD_KEYS]
PLACES += [("gear", "bearing_kx_N_per_m"), ("gear", "coupling_stiffness_Nm_per_rad")]
PLACES += [("mesh", key) for key in ("center_line_deg", "backlash_um", "load_share")]
PLACES += [("mesh", key) for key in ("mean_stiffness_N_per_m", "stiffness_variation")]


@settings(max_examples=400, deadline=None)
@given(place=st.sampled_from(PLACES), value=VALUES)
def test_any_value_is_read_or_refused_in_one_line(place, value):
    tables = {"gear": GEAR_KEYS, "mesh": MESH_KEYS, "load": LOAD_KEYS}
    name, key = place
    tables[name] = tables[name] | {key: value}
    message = refusal(pair_text(tables["gear"], tables["mesh"], tables["load"]))
    assert len(message.splitlines()) <= 1
    assert len(message) < 400
