"""Helical gears, leads and offsets of a gear set: keys, sections, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.leads import require_uniform_loads

HELIX = 20.0


def tables(gear=(), mesh=(), **shared):
    """A pair of helical gears; changes of the second gear and of the mesh."""
    defaults = {"module_mm": 3.0, "helix_angle_deg": HELIX, "hub_radius_mm": 15.0}
    return {
        "name": "pair",
        "defaults": {**defaults, "face_width_mm": 30.0, **shared},
        "gear": [
            {"name": "one", "teeth": 25, "profile_shift": 0.2},
            {"name": "two", "teeth": 40, **dict(gear)},
        ],
        "mesh": [{"driver": "one", "driven": "two", **dict(mesh)}],
    }


def test_normal_sizes_become_those_across_the_axis():
    gears = make_gear_set(tables())
    one, two = (gear.geometry for gear in gears.gears)
    cosine = math.cos(math.radians(HELIX))
    assert one.module == pytest.approx(3e-3 / cosine, rel=1e-14)
    tangent = math.tan(math.radians(20.0)) / cosine
    assert math.tan(one.pressure_angle) == pytest.approx(tangent, rel=1e-14)
    assert one.profile_shift * one.module == pytest.approx(0.2 * 3e-3, rel=1e-14)
    assert one.tip_radius - one.reference_radius == pytest.approx(3.6e-3, rel=1e-12)
    assert one.reference_radius - two.reference_radius < 0.0
    assert one.dedendum == pytest.approx(3.75e-3, rel=1e-14)
    assert one.rack_tip_radius == pytest.approx(0.9e-3, rel=1e-14)
    assert (one.helix_angle, two.helix_angle) == pytest.approx(
        (math.radians(HELIX), -math.radians(HELIX)), rel=1e-14
    )


def test_hands_follow_from_mates():
    left = make_gear_set(tables(gear={"hand": "right"}))
    assert left.gears[0].geometry.helix_angle < 0.0
    idler = tables()
    idler["gear"].append({"name": "three", "teeth": 30})
    idler["mesh"].append({"driver": "two", "driven": "three"})
    signs = [np.sign(gear.geometry.twist) for gear in make_gear_set(idler).gears]
    assert signs == [1, -1, 1]


def test_pairs_are_engaged_longer_by_the_overlap():
    gears = make_gear_set(tables())
    start, end = gears.engagement(0)
    pair = gears.meshes[0].pair
    overlap = 30e-3 * math.sin(math.radians(HELIX)) / (math.pi * 3e-3)
    assert end - start == pytest.approx(pair.contact_ratio + overlap, rel=1e-9)
    assert start + end == pytest.approx(sum(pair.path), rel=1e-9)
    spur = make_gear_set(tables(helix_angle_deg=0.0))
    assert spur.engagement(0) == spur.meshes[0].pair.path


def test_a_set_names_its_plane():
    assert make_gear_set(tables()).plane == "width"
    assert make_gear_set({**tables(), "plane": "strain"}).plane == "strain"


def test_the_common_width_is_where_gears_face_each_other():
    gears = make_gear_set(tables(gear={"face_width_mm": 20.0}, mesh={"offset_mm": 9.0}))
    assert gears.common_width(0) == pytest.approx(16e-3)
    driver, driven = gears.width_middles(0)
    assert (driver, driven) == pytest.approx((7e-3, -2e-3))
    inside = make_gear_set(tables(gear={"face_width_mm": 20.0}, mesh={"offset_mm": -4}))
    assert inside.common_width(0) == pytest.approx(20e-3)
    assert inside.width_middles(0) == pytest.approx((-4e-3, 0.0))


def test_leads_are_depths_over_the_width():
    entry = {"crowning_um": 6, "slope_um": -4, "end_relief_um": 10}
    entry["end_relief_length_mm"] = 3.0
    mesh = make_gear_set(tables(mesh={"driver_lead": entry})).meshes[0]
    assert mesh.driven_flank.lead is None
    lead = mesh.driver_flank.lead
    places = np.array([-15e-3, -12e-3, 0.0, 13.5e-3, 15e-3])
    expected = [16.0, 3.84 - 0.4, -2.0, 4.86 - 3.8 + 2.5, 12.0]
    assert lead.depth(places, 30e-3) == pytest.approx(1e-6 * np.array(expected))
    assert mesh.varies_over_width


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gear": {"helix_angle_deg": 21.0}}, "helix_angle_deg = 21 .*must be 20"),
        (
            {"gear": {"hand": "right"}, "first": "right"},
            'hand = "right".*must be "left"',
        ),
        ({"gear": {"internal": True, "rim_radius_mm": 75.0}}, "must be 0 of"),
        ({"gear": {"span_mm": 40.0, "span_teeth": 5}}, "not known of helical gears"),
        ({"mesh": {"offset_mm": 27.5}}, "offset_mm = 27.5; must be at most 27 mm"),
        ({"mesh": {"lead": {"end_relief_um": 5}}}, "end_relief_length_mm is needed"),
        (
            {"mesh": {"lead": {"end_relief_length_mm": 5}}},
            "end_relief_um above 0 is needed",
        ),
        (
            {"mesh": {"lead": {"end_relief_um": 5, "end_relief_length_mm": 16}}},
            "end_relief_length_mm = 16; must be at most 15 mm",
        ),
        ({"mesh": {"lead": {"slope_um": 2000}}}, "slope_um = 2000; must be from"),
        ({"mesh": {"lead": {}, "driver_lead": {}}}, "only one is allowed"),
        ({"helix_angle_deg": 46.0}, "helix_angle_deg"),
    ],
)
def test_refusals_name_field_value_and_limit(changes, message):
    changes, first = dict(changes), changes.get("first")
    changes.pop("first", None)
    written = tables(**changes)
    if first:
        written["gear"][0]["hand"] = first
    with pytest.raises(InputError, match=message):
        make_gear_set(written)


def test_a_hand_needs_a_helix():
    with pytest.raises(InputError, match="helix_angle_deg is needed"):
        make_gear_set(tables(gear={"hand": "left"}, helix_angle_deg=0.0))


@pytest.mark.parametrize(
    ("changes", "has"),
    [
        ({}, "are helical"),
        ({"helix_angle_deg": 0.0, "mesh": {"offset_mm": 2.0}}, "have an axial offset"),
        (
            {"helix_angle_deg": 0.0, "mesh": {"lead": {"slope_um": 3.0}}},
            "have a lead modification",
        ),
    ],
)
def test_what_knows_uniform_loads_only_refuses_others(changes, has):
    with pytest.raises(InputError, match=f'"one" and "two" {has}; allowed for wear'):
        require_uniform_loads(make_gear_set(tables(**changes)), "wear")


def test_spur_gears_without_leads_are_for_all():
    require_uniform_loads(make_gear_set(tables(helix_angle_deg=0.0)), "wear")
