"""Faults of teeth: from the file to SI units, what is refused, where they are drawn."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.commands.show.fault_values import fault_figures, fault_lines
from fegear.commands.show.faulty_teeth import faulty_teeth
from fegear.commands.show.gear_set_figure import (
    damaged_outlines,
    line_of_action,
    outlines,
)
from fegear.files.errors import InputError
from fegear.gearset import GearSet, builtin_names, load_gear_set, make_gear_set
from fegear.gearset.faults.checks import require_no_faults, without_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS, NO_FAULTS, Faults
from fegear.gearset.phases import mesh_phases
from fegear.gearset.placing import at_place, layout
from fegear.gearset.zones import zones
from fegear.train.rotors import rotor_system
from meshes import GearPair, GeometryError

TABLES = {
    "name": "tall",
    "defaults": {
        "module_mm": 2.0,
        "face_width_mm": 20.0,
        "hub_radius_mm": 15.0,
        "tooth_thinning_um": 60.0,
        "addendum_mm": 2.6,
        "dedendum_mm": 3.0,
    },
    "gear": [{"name": "a", "teeth": 50}, {"name": "b", "teeth": 70}],
    "mesh": [{"driver": "a", "driven": "b", "center_distance_mm": 120.0}],
    "load": {"gear": "a", "torques_Nm": [100.0]},
}
RING = {
    "name": "ring",
    "defaults": {"module_mm": 2.0, "face_width_mm": 20.0, "tooth_thinning_um": 60.0},
    "gear": [
        {"name": "p", "teeth": 30, "hub_radius_mm": 15.0},
        {"name": "r", "teeth": 80, "internal": True, "rim_radius_mm": 95.0},
    ],
    "load": {"gear": "p", "torques_Nm": [100.0]},
}
INTERNAL = {
    f"{driver} drives": RING
    | {
        "mesh": [{"driver": driver, "driven": driven, "center_distance_mm": 50.0}],
        "load": {"gear": driver, "torques_Nm": [100.0]},
    }
    for driver, driven in (("p", "r"), ("r", "p"))
}
ALL_KINDS = {
    "cracks": [{"tooth": 5, "depth_mm": 1.5, "direction_deg": 60, "root": "back"}],
    "spalls": [
        {
            "tooth": 1,
            "start_roll_angle_deg": 20.0,
            "end_roll_angle_deg": 22.0,
            "width_share": 0.5,
        }
    ],
    "broken_tips": [{"tooth": 8, "height_mm": 0.25}],
    "missing_teeth": [3],
    "worn_teeth": [
        {"roll_angle_deg": [16.0, 24.0], "depth_um": [0.0, 5.0]},
        {"tooth": 2, "diameter_mm": [98.0, 102.0], "depth_um": [1.0, 0.0]},
    ],
    "eccentricity_um": 20.0,
    "eccentricity_angle_deg": 30.0,
}


def tall(first: dict | None = None, second: dict | None = None) -> GearSet:
    """A pair of contact ratio 2.26 with faults of its gears."""
    gears = [
        gear | (faults or {})
        for gear, faults in zip(TABLES["gear"], (first, second), strict=True)
    ]
    return make_gear_set(TABLES | {"gear": gears})


def tips(*heights: tuple[int, float]) -> dict:
    return {"broken_tips": [{"tooth": n, "height_mm": h} for n, h in heights]}


def test_values_are_in_si_units_and_teeth_count_from_zero():
    gear = tall(ALL_KINDS).gears[0]
    faults, base = gear.faults, gear.geometry.base_radius
    (crack,), (spall,) = faults.cracks, faults.spalls
    assert (crack.tooth, crack.crack.left) == (4, True)
    assert crack.crack.depth == pytest.approx(1.5e-3)
    assert crack.crack.tangent_angle == pytest.approx(math.radians(30.0))
    assert crack.crack.direction == pytest.approx(math.radians(60.0))
    assert (spall.tooth, spall.width_share) == (0, 0.5)
    assert spall.start_roll_length == pytest.approx(math.radians(20.0) * base)
    assert faults.broken_height(7) == pytest.approx(0.25e-3)
    assert faults.broken_height(6) == 0.0
    assert faults.missing == (2,)
    assert faults.wear_of(0).deviations == pytest.approx((0.0, -5e-6))
    assert faults.wear_of(1).deviations == pytest.approx((-1e-6, 0.0))
    assert faults.eccentricity == pytest.approx(20e-6)
    assert faults.kinds == FAULT_KINDS
    assert faults.teeth == (0, 1, 2, 4, 7)


def test_the_loaded_root_is_that_of_the_right_flank():
    gear = tall({"cracks": [{"tooth": 1, "depth_mm": 1.0}]}).gears[0]
    assert not gear.faults.cracks[0].crack.left


def test_without_faults_a_gear_set_is_the_healthy_one():
    healthy, faulty = tall(), tall(ALL_KINDS)
    assert healthy.gears[0].faults == NO_FAULTS == Faults()
    assert not NO_FAULTS.any
    assert faulty != healthy
    assert without_faults(faulty) == healthy


@pytest.mark.parametrize("kind", FAULT_KINDS)
def test_a_kind_is_refused_unless_it_is_modelled(kind):
    gear_set = tall(ALL_KINDS)
    others = [other for other in FAULT_KINDS if other != kind]
    require_no_faults(without_faults(gear_set, [kind]), [kind], "statics")
    with pytest.raises(InputError, match=r'gear "a": .*not modelled by statics'):
        require_no_faults(without_faults(gear_set, others), [kind], "statics")
    assert without_faults(gear_set, others).gears[0].faults.kinds == (kind,)


def test_shafts_that_bend_leave_no_fault_out():
    gears = tall(None, {"eccentricity_um": 1.0})
    with pytest.raises(InputError, match='tall: gear "b": eccentricity_um; not model'):
        rotor_system(gears, [1.0], 3)


def test_a_broken_tip_leaves_flank():
    teeth = tall().meshes[0].pair.driver
    most = 1e3 * (teeth.tip_radius - teeth.form_radius)
    assert tall(tips((4, most * (1.0 - 1e-9)))).gears[0].faults.broken_tips
    with pytest.raises(InputError, match=r"height_mm = .*; must be at most .* form c"):
        tall(tips((4, most * (1.0 + 1e-9))))


def test_teeth_may_be_missing_at_any_contact_ratio():
    assert tall({"missing_teeth": [50, 1]}).gears[0].faults.missing == (0, 49)
    pair = load_gear_set("liu-pair", {"gear.1.missing_teeth": [5]})
    assert pair.gears[0].faults.missing == (4,)


def test_all_teeth_missing():
    with pytest.raises(InputError, match="missing_teeth has all 50 teeth"):
        tall({"missing_teeth": list(range(1, 51))})


@settings(max_examples=60, deadline=None)
@given(
    amounts=st.tuples(st.floats(1.0, 2000.0), st.floats(0.0, 2000.0)),
)
def test_an_eccentricity_is_refused_where_the_extreme_distances_are(amounts):
    pair = tall().meshes[0].pair
    faults = [{"eccentricity_um": amount} for amount in amounts]
    total = 1e-6 * sum(amounts)
    try:
        for distance in (pair.center_distance - total, pair.center_distance + total):
            GearPair(pair.driver, pair.driven, distance)
    except GeometryError:
        with pytest.raises(InputError, match=r"eccentricity_um = .* at a centre dist"):
            tall(*faults)
    else:
        assert tall(*faults).gears[0].faults.eccentricity


def random_faults(r: np.random.Generator, pair: GearPair, second: bool) -> dict:
    """Faults of a gear of the tall pair that fit it; some kinds are left out."""
    flank = zones(pair, "driven" if second else "driver")
    low, high = (flank.roll_angle_deg(s) for s in (flank.start, flank.tip))
    teeth = [int(n) for n in r.permutation(flank.gear.teeth)[:8] + 1]
    start, end = sorted(r.uniform(low, low + 0.8 * (high - low), 2))
    points = np.sort(r.uniform(low, high, 3))
    faults = {
        "cracks": [
            {
                "tooth": teeth[0],
                "depth_mm": r.uniform(0.2, 1.5),
                "tangent_angle_deg": r.uniform(25.0, 40.0),
                "root": str(r.choice(["loaded", "back"])),
            }
            | ({"direction_deg": r.uniform(50.0, 80.0)} if r.random() < 0.5 else {})
        ],
        "spalls": [
            {
                "tooth": teeth[1],
                "start_roll_angle_deg": start,
                "end_roll_angle_deg": end + 0.1,
                "width_share": r.uniform(0.01, 0.95),
            }
        ],
        "broken_tips": [{"tooth": teeth[2], "height_mm": r.uniform(0.01, 0.5)}],
        "worn_teeth": [
            {
                "tooth": teeth[3],
                "roll_angle_deg": points.tolist(),
                "depth_um": r.uniform(0.0, 2.0, 3).tolist(),
                "interpolation": str(r.choice(["linear", "cubic"])),
            }
        ],
        "eccentricity_um": r.uniform(0.0, 20.0),
    }
    if r.random() < 0.3:
        del faults["worn_teeth"][0]["tooth"]
    (spall,) = faults["spalls"]
    if spall["width_share"] < 0.45:  # another one beside it
        faults["spalls"] += [spall | {"start_roll_angle_deg": 0.5 * (start + end)}]
    if r.random() < 0.5:
        room = 10.0 * (1.0 - spall["width_share"])  # to both ends of 20 mm
        spall["place_mm"] = room * r.uniform(-1.0, 1.0)
        end = str(r.choice(["near", "far"]))
        faults["broken_tips"][0] |= {"length_mm": r.uniform(0.1, 20.0), "end": end}
    return {key: value for key, value in faults.items() if r.random() < 0.7}


def close(one, other) -> bool:
    """Whether figures are equal to round-off of a change of units."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(
            close(value, other[key]) for key, value in one.items()
        )
    if isinstance(one, list):
        return len(one) == len(other) and all(map(close, one, other))
    if isinstance(one, float):
        return math.isclose(one, other, rel_tol=1e-12, abs_tol=1e-12)
    return one == other


@pytest.mark.parametrize("seed", range(25))
def test_round_trip_of_random_faults(seed):
    """Tables, the gear set of them, its figures as tables and as single edits."""
    r, pair = np.random.default_rng(seed), tall().meshes[0].pair
    faults = [random_faults(r, pair, second) for second in (False, True)]
    gear_set = tall(*faults)
    figures = [fault_figures(gear) for gear in gear_set.gears]
    for given_keys, written in zip(faults, figures, strict=True):
        for key, value in given_keys.items():
            if isinstance(value, list):
                defaults = {"tooth": None, "direction_deg": None, "place_mm": 0.0}
                defaults |= {"length_mm": None, "end": None}
                value = [
                    {k: v for k, v in defaults.items() if k in entry} | row
                    for row, entry in zip(value, written[key], strict=True)
                ]
            assert close(value, written[key])
    again = tall(*({k: plain(v) for k, v in one.items() if v} for one in figures))
    assert close([fault_figures(gear) for gear in again.gears], figures)
    edits = {
        f"gear.{n}.{name}": value
        for n, one in enumerate(faults, 1)
        for name, value in single_values(one)
    }
    assert make_gear_set(TABLES, edits) == gear_set


ENDS = {"tooth": 3, "start_roll_angle_deg": 20.0, "end_roll_angle_deg": 22.0}
CORNER = {"tooth": 4, "height_mm": 0.5}


def test_a_length_of_a_spall_is_a_share_of_the_width():
    """Loads vary over the width where damage is off the middle of the teeth."""
    middle = tall({"spalls": [ENDS | {"length_mm": 5.0}]})
    assert middle == tall({"spalls": [ENDS | {"width_share": 0.25}]})
    assert not middle.meshes[0].varies_over_width
    beside = tall({"spalls": [ENDS | {"length_mm": 5.0, "place_mm": -7.5}]})
    (spall,) = beside.gears[0].faults.spalls
    assert (spall.width_share, spall.place) == (0.25, -7.5e-3)
    assert beside.meshes[0].varies_over_width
    (line,) = fault_lines(beside.gears[0])
    assert line.endswith("25 % of the face width, 7.5 mm from its middle toward the "
                         "near end")  # fmt: skip


def test_a_corner_is_at_an_end_of_the_width():
    gears = tall(second={"broken_tips": [CORNER | {"length_mm": 6.0, "end": "far"}]})
    (tip,) = gears.gears[1].faults.broken_tips
    assert (tip.height, tip.length, tip.end) == (0.5e-3, 6e-3, "far")
    assert gears.meshes[0].varies_over_width
    assert not tall(second={"broken_tips": [CORNER]}).meshes[0].varies_over_width
    (line,) = fault_lines(gears.gears[1])
    told = "corner of 0.5 mm height broken off over 6 mm at the far end"
    assert line.endswith(told)


OFF_THE_FACE = {
    "only one of width_share and length_mm": (
        "spalls", ENDS | {"width_share": 0.5, "length_mm": 3.0}),
    "one of width_share and length_mm is needed": ("spalls", ENDS),
    "length_mm = 19.5; must be at most 19, 0.95 of face_width_mm": (
        "spalls", ENDS | {"length_mm": 19.5}),
    "place_mm = 7.6; must be from -7.5 to 7.5": (
        "spalls", ENDS | {"length_mm": 5.0, "place_mm": 7.6}),
    "length_mm = 20.5; must be at most face_width_mm, 20": (
        "broken_tips", CORNER | {"length_mm": 20.5, "end": "near"}),
    "entry 1: height_mm = 12; must be at most 4.66776, down to the form": (
        "broken_tips", CORNER | {"height_mm": 12.0, "length_mm": 5.0, "end": "near"}),
    "end is needed with length_mm": ("broken_tips", CORNER | {"length_mm": 2.0}),
    "length_mm is needed with end": ("broken_tips", CORNER | {"end": "far"}),
}  # fmt: skip


@pytest.mark.parametrize("told", OFF_THE_FACE)
def test_damage_lies_within_the_face(told):
    key, entry = OFF_THE_FACE[told]
    with pytest.raises(InputError, match=told):
        tall({key: [entry]})


def plain(value):
    """Figures without keys that have no value."""
    if not isinstance(value, list):
        return value
    return [
        {k: v for k, v in entry.items() if v is not None}
        if isinstance(entry, dict)
        else entry
        for entry in value
    ]


def single_values(faults: dict):
    for key, value in faults.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            for n, entry in enumerate(value, 1):
                yield from ((f"{key}.{n}.{name}", v) for name, v in entry.items())
        else:
            yield key, value


SPALL = {
    "tooth": 3,
    "start_roll_angle_deg": 20.0,
    "end_roll_angle_deg": 25.0,
    "width_share": 0.5,
}


@pytest.mark.parametrize(
    ("others", "message"),
    [
        (
            [{"start_roll_angle_deg": 24.0, "end_roll_angle_deg": 26.0}],
            "spalls entry 2: at 24 deg of roll angle spalls of tooth 3 take 1 of",
        ),
        (
            [
                {"start_roll_angle_deg": 20.0 + n / 2, "end_roll_angle_deg": 25.0}
                | {"width_share": 0.01}
                for n in range(8)
            ],
            "tooth 3 has 9; at most 8 are allowed",
        ),
    ],
)
def test_spalls_that_leave_no_width_or_are_too_many_are_refused(others, message):
    with pytest.raises(InputError, match=message):
        tall({"spalls": [SPALL, *(SPALL | other for other in others)]})


@pytest.mark.parametrize(
    "size", ["cracks.1.depth_mm", "broken_tips.1.height_mm", "spalls.1.width_share"]
)
def test_a_fault_of_no_size_goes_away(size):
    key = size.partition(".")[0]
    faults = {key: ALL_KINDS[key]}
    tables = TABLES | {"gear": [TABLES["gear"][0] | faults, TABLES["gear"][1]]}
    assert make_gear_set(tables) != tall()
    assert make_gear_set(tables, {f"gear.a.{size}": 0}) == tall()


def test_an_edit_changes_one_fault_of_several():
    cracks = [{"tooth": n, "depth_mm": 1.0} for n in (3, 5)]
    tables = TABLES | {"gear": [TABLES["gear"][0] | {"cracks": cracks}]}
    tables["gear"].append(TABLES["gear"][1])
    edited = make_gear_set(tables, {"gear.a.cracks.2.depth_mm": 1.5})
    assert [c.crack.depth for c in edited.gears[0].faults.cracks] == pytest.approx(
        [1e-3, 1.5e-3]
    )
    assert tables["gear"][0]["cracks"][1]["depth_mm"] == 1.0


def test_every_fault_has_a_line():
    lines = list(fault_lines(tall(ALL_KINDS).gears[0]))
    assert len(lines) == 7
    for text in ("tooth 5: crack of 1.5 mm at the back root", "tooth 3: missing"):
        assert any(text in line for line in lines)
    assert not list(fault_lines(tall().gears[0]))


SETS = {name: load_gear_set(name) for name in builtin_names()} | {
    name: make_gear_set(tables) for name, tables in INTERNAL.items()
}


@pytest.mark.parametrize("name", SETS)
def test_drawn_flanks_are_where_the_teeth_touch(name):
    """Of a gear's first mesh, in the reference pair and the pair that follows it."""
    gear_set = SETS[name]
    placed, phases = layout(gear_set), mesh_phases(gear_set)
    for index in range(len(gear_set.gears)):
        number = gear_set.meshes_of[index][0]
        mesh, place = gear_set.meshes[number], placed.places[index]
        pair, teeth = mesh.pair, faulty_teeth(gear_set, placed, index)
        driver = placed.places[mesh.driver]
        line = line_of_action(mesh, driver, placed.directions[number])
        for tooth in (0, 1):
            position = phases[number].value - tooth
            roll = pair.pitch_point + position * pair.base_pitch
            length = roll if index == mesh.driver else pair.line_of_action - roll
            if not length * teeth.gear.sign > 0.0:
                continue  # beyond the base circle
            if abs(length) > abs(teeth.gear.tip_roll_length) and teeth.gear.sign > 0:
                continue  # beyond the tip
            point = teeth.flank(tooth, length, length)[:1]
            drawn = 1e3 * at_place(point, teeth.gear, place, teeth.turn(tooth))[0]
            assert drawn == pytest.approx(line.at(roll), abs=1e-6)


def test_outlines_of_damaged_teeth():
    gear_set = tall({"missing_teeth": [1]} | tips((8, 0.5)))
    gear, placed = gear_set.gears[0].geometry, layout(gear_set)
    teeth = faulty_teeth(gear_set, placed, 0)
    damaged = damaged_outlines(teeth)
    assert set(damaged) == {teeth.turn(0), teeth.turn(7)}
    assert np.hypot(*damaged[teeth.turn(0)].T) == pytest.approx(gear.root_radius)
    top = np.hypot(*damaged[teeth.turn(7)].T).max()
    assert top == pytest.approx(gear.tip_radius - 0.5e-3)
    whole, other = outlines(tall())["a"], outlines(gear_set)["a"]
    assert area(other) < area(whole)


def area(curve: np.ndarray) -> float:
    closed = [*curve, curve[0]]
    crossed = (a[0] * b[1] - b[0] * a[1] for a, b in pairwise(closed))
    return abs(0.5 * sum(crossed))
