"""Helical gears, leads and offsets of a gear set: keys, sections, refusals."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from small_sets import PAIR

from fegear.commands.show.derived import gear_figures, mesh_figures
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.leads import misaligned_gap, require_uniform_loads, width_gap
from fegear.gearset.phases import mesh_phases
from fegear.gearset.planes import plane_in_words

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


def test_hands_that_follow_are_inferred():
    gear_set = make_gear_set(tables())
    assert [line for line in gear_set.inferences if "hand" in line] == [
        'gear "one": hand = "right", that of the first gear where no hand is given',
        'gear "two": hand = "left", opposite to that of its mate "one"',
    ]
    (line,) = [
        line
        for line in make_gear_set(tables(gear={"hand": "right"})).inferences
        if "hand" in line
    ]
    assert line == 'gear "one": hand = "left", opposite to that of its mate "two"'
    spur = make_gear_set(tables(helix_angle_deg=0.0))
    assert not [line for line in spur.inferences if "hand" in line]


@pytest.mark.parametrize(("hand", "sign"), [("right", 1.0), ("left", -1.0)])
def test_a_ring_has_the_hand_of_its_planets(hand, sign):
    edits = {"defaults.helix_angle_deg": 15.0, "gear.sun.hand": hand}
    gear_set = load_gear_set("planetary-24-36-96", edits)
    twists = [gear.geometry.twist for gear in gear_set.gears]
    assert np.sign(twists).tolist() == [sign, -sign, -sign, -sign, -sign]
    turned = twists * np.array([24, 36, 36, 36, 96])
    assert np.abs(turned) == pytest.approx(np.abs(turned[0]), rel=1e-12)
    (line,) = [line for line in gear_set.inferences if '"ring": hand' in line]
    assert line.endswith('as fits that of its mates "planet-1", "planet-2", "planet-3"')
    with pytest.raises(InputError, match="one of them internal"):
        load_gear_set("planetary-24-36-96", edits | {"gear.ring.hand": hand})


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
        (
            {
                "gear": {"internal": True, "rim_radius_mm": 75.0, "hand": "left"},
                "first": "right",
            },
            'hand = "left".*must be "right".*one of them internal',
        ),
        (
            {"gear": {"pin_dimension_mm": 120.0, "pin_diameter_mm": 5.0}},
            "pin_dimension_mm = 120 over pins of 5 mm; must be above",
        ),
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
            {"helix_angle_deg": 0.0, "mesh": {"lead": {"crowning_um": 3.0}}},
            "have a lead modification",
        ),
    ],
)
def test_what_knows_uniform_loads_only_refuses_others(changes, has):
    with pytest.raises(
        InputError, match=f'"one" and "two" {has}; allowed for pictures'
    ):
        require_uniform_loads(make_gear_set(tables(**changes)), "pictures")


def test_spur_gears_without_leads_are_for_all():
    require_uniform_loads(make_gear_set(tables(helix_angle_deg=0.0)), "pictures")


def idler(offset_mm):
    """A train whose middle gear is as wide as the others, the last one beside it."""
    of_train = tables(hub_radius_mm=12.0)
    of_train["gear"].append({"name": "three", "teeth": 31})
    of_train["mesh"].append(
        {"driver": "two", "driven": "three", "center_line_deg": 40.0}
    )
    of_train["mesh"][1]["offset_mm"] = offset_mm
    return make_gear_set(of_train)


@pytest.mark.parametrize("offset_mm", [-7.0, 3.0, 12.0])
def test_an_offset_shifts_the_phase_by_the_lead(offset_mm):
    """A flank of the idler is where it is, wherever its mate lies along the axis.

    The driver's flank at a place z along the axis touches r_b twist z / p_b base
    pitches earlier, and the middle of the common width moves by half the offset.
    """
    straight, shifted = idler(0.0), idler(offset_mm)
    phases = [mesh_phases(gears)[1].value for gears in (straight, shifted)]
    gear = shifted.gears[1].geometry  # drives the second mesh
    assert shifted.senses[1] == -1
    right_handed = math.copysign(1.0, gear.helix_angle)
    turned = math.tan(math.radians(HELIX)) * 0.5e-3 * offset_mm / gear.reference_radius
    lead = right_handed * turned / gear.pitch_angle
    apart = math.remainder(phases[1] - (phases[0] + lead), 1.0)
    assert apart == pytest.approx(0.0, abs=1e-12)
    assert abs(lead) > 0.02
    middle = shifted.width_middles(1)[0]
    assert middle == pytest.approx(0.5e-3 * offset_mm)


def test_an_offset_of_spur_gears_leaves_the_phase():
    spur = {"helix_angle_deg": 0.0, "hub_radius_mm": 12.0}
    of_train = tables(**spur)
    of_train["gear"].append({"name": "three", "teeth": 31})
    of_train["mesh"].append({"driver": "two", "driven": "three"})
    phase = mesh_phases(make_gear_set(of_train))[1].value
    of_train["mesh"][1]["offset_mm"] = 8.0
    assert mesh_phases(make_gear_set(of_train))[1].value == phase


@pytest.mark.parametrize(
    ("helix_deg", "shift"), [(8.0, 0.0), (20.0, 0.3), (35.0, -0.2)]
)
def test_a_base_tangent_gives_the_thinning_of_a_helical_gear(helix_deg, shift):
    """By ISO 21771 of the normal section, less the thinning there times cos(alpha)."""
    module, teeth, number = 3.0, 25, 4
    alpha, beta = math.radians(20.0), math.radians(helix_deg)
    transverse = math.atan(math.tan(alpha) / math.cos(beta))
    involute = math.tan(transverse) - transverse
    tangent = module * math.cos(alpha) * (math.pi * (number - 0.5) + teeth * involute)
    tangent += 2.0 * shift * module * math.sin(alpha)
    thinning = 0.06  # mm, across the axis
    tangent -= thinning * math.cos(beta) * math.cos(alpha)
    measured = {"span_mm": tangent, "span_teeth": number}
    of_pair = tables(helix_angle_deg=helix_deg)
    of_pair["gear"][0] |= {"profile_shift": shift, **measured}
    gear = make_gear_set(of_pair).gears[0].geometry
    assert gear.tooth_thinning == pytest.approx(1e-3 * thinning, rel=1e-9)
    del of_pair["gear"][0]["profile_shift"]
    of_pair["gear"][0]["tooth_thinning_um"] = 1e3 * thinning
    gear = make_gear_set(of_pair).gears[0].geometry
    assert gear.profile_shift / math.cos(beta) == pytest.approx(shift, abs=1e-9)


@pytest.mark.parametrize(("helix_deg", "teeth"), [(8.0, 25), (20.0, 26), (35.0, 31)])
def test_what_show_prints_gives_the_same_teeth(helix_deg, teeth):
    """Thinning from the base tangent length and from the dimension over balls."""
    of_pair = tables(helix_angle_deg=helix_deg)
    of_pair["gear"][0] |= {"teeth": teeth, "tooth_thinning_um": 60.0}
    figures = gear_figures(make_gear_set(of_pair).gears[0])
    del of_pair["gear"][0]["tooth_thinning_um"]
    for keys in (
        ("span_mm", "span_teeth"),
        ("pin_dimension_mm", "pin_diameter_mm"),
    ):
        measured = {key: figures[key] for key in keys}
        first = {**of_pair["gear"][0], "profile_shift": 0.2, **measured}
        changed = {**of_pair, "gear": [first, of_pair["gear"][1]]}
        gear = make_gear_set(changed).gears[0].geometry
        assert gear.tooth_thinning == pytest.approx(60e-6, abs=1e-12)


def test_the_normal_backlash_is_that_of_the_normal_section():
    gears = make_gear_set(tables(gear={"tooth_thinning_um": 80.0}))
    figures = mesh_figures(gears, 0)
    # the arc across the axis becomes a distance of flanks along their normal
    expected = 80.0 * math.cos(math.radians(HELIX)) * math.cos(math.radians(20.0))
    assert figures["normal_backlash_um"] == pytest.approx(expected, rel=1e-9)


PLACES = np.array([-15e-3, 0.0, 15e-3])


def test_misalignment_is_a_gap_once():
    aligned = make_gear_set(tables(mesh={"lead": {"crowning_um": 8}}))
    assert width_gap(aligned, 0, PLACES) == pytest.approx([16e-6, 0.0, 16e-6])
    for keys in (
        {"misalignment_um": 20, "lead": {"crowning_um": 8}},
        {"lead": {"crowning_um": 8, "slope_um": 20}},
        {"lead": {"crowning_um": 8}, "misalignment_um": 20},
    ):
        gears = make_gear_set(tables(mesh=keys))
        expected = [16e-6, 10e-6, 36e-6]
        assert width_gap(gears, 0, PLACES) == pytest.approx(expected), keys
        assert [flank.lead.slope for flank in gears.meshes[0].flanks] == [0.0, 0.0]
    of_driver = make_gear_set(tables(mesh={"driver_lead": {"slope_um": 20}}))
    assert width_gap(of_driver, 0, PLACES) == pytest.approx([0.0, 10e-6, 20e-6])
    assert of_driver.meshes[0].misalignment == 0.0
    with pytest.raises(InputError, match=r"= 5 and lead\.slope_um = 5"):
        make_gear_set(tables(mesh={"misalignment_um": 5, "lead": {"slope_um": 5}}))
    with pytest.raises(InputError, match=r"slope_um = 1600; must be from -1500"):
        make_gear_set(tables(mesh={"misalignment_um": 1600}))


def test_misalignment_is_of_the_common_width():
    gears = make_gear_set(
        tables(gear={"face_width_mm": 20.0}, mesh={"misalignment_um": 12.0})
    )
    assert gears.meshes[0].varies_over_width
    ends = np.array([-10e-3, 10e-3])
    assert width_gap(gears, 0, ends) == pytest.approx([0.0, 12e-6], abs=1e-18)


def test_show_prints_the_gap_of_both_flanks_along_the_normal():
    lead = {"crowning_um": 8, "slope_um": 20}
    figures = mesh_figures(make_gear_set(tables(mesh={"lead": lead})), 0)
    base = math.sin(math.radians(HELIX)) * math.cos(math.radians(20.0))
    cosine = math.sqrt(1.0 - base**2)
    gaps = [figures[f"normal_width_gap_{end}_um"] for end in ("near", "middle", "far")]
    assert gaps == pytest.approx([16.0 * cosine, 10.0 * cosine, 36.0 * cosine])
    assert figures["misalignment_um"] == pytest.approx(20.0)


def test_shifts_are_those_of_the_normal_section():
    sums = tables(gear={"profile_shift": 0.1})
    gears = make_gear_set(sums)
    assert gears.inferences[0].endswith("sum of profile shifts 0.3")
    assert gears.gears[0].geometry.normal_profile_shift == pytest.approx(0.2)
    assert gears.gears[0].geometry.normal_module == pytest.approx(3e-3)


def test_a_shift_by_a_span_is_refused_as_the_normal_one():
    """W_k = m_n (cos a_n (pi (k - 1/2) + z inv a_t) + 2 x sin a_n)."""
    normal, helix = math.radians(20.0), math.radians(HELIX)
    across = math.atan(math.tan(normal) / math.cos(helix))
    teeth = math.pi * 4.5 + 40 * (math.tan(across) - across)
    shift = (48.0 / 3.0 - math.cos(normal) * teeth) / (2.0 * math.sin(normal))
    changed = tables()
    two = {"name": "two", "teeth": 40, "span_mm": 48.0, "span_teeth": 5}
    changed["gear"][1] = two
    with pytest.raises(InputError, match=f"profile shift {shift:.6g}; must be -2 to 2"):
        make_gear_set(changed)


def test_half_the_module_is_half_of_the_normal_one():
    with pytest.raises(InputError, match="must be from -1500 to 1500, half the module"):
        make_gear_set(tables(mesh={"driver_lead": {"crowning_um": 1550.0}}))


def low_teeth(width_mm: float, **gear) -> dict:
    """Helical teeth so low that their transverse contact ratio is below 1."""
    two = {"name": "two", "teeth": 45, "hub_radius_mm": 30.0}
    return {
        "name": "low",
        "defaults": {"module_mm": 2.5, "helix_angle_deg": 25.0, "addendum_mm": 1.3},
        "gear": [
            {
                "name": "one",
                "teeth": 21,
                "hub_radius_mm": 12.5,
                "face_width_mm": width_mm,
                **gear,
            },
            two | {"face_width_mm": 40.0},
        ],
        "mesh": [{"driver": "one", "driven": "two", "backlash_um": 40.0}],
    }


def test_helical_gears_run_by_their_total_contact_ratio():
    wide = make_gear_set(low_teeth(30.0))
    assert wide.meshes[0].pair.contact_ratio < 0.8
    start, end = wide.engagement(0)
    assert end - start == pytest.approx(2.411, abs=1e-3)
    flank = mesh_figures(wide, 0)["flanks"][0]
    assert flank["lpstc_roll_angle_deg"] is None
    with pytest.raises(InputError, match=r"total contact ratio 0\.95.*at least 1"):
        make_gear_set(low_teeth(3.0))
    spur = low_teeth(30.0)
    spur["defaults"]["helix_angle_deg"] = 0.0
    with pytest.raises(InputError, match="at least 1 is needed for continuous motion"):
        make_gear_set(spur)


def test_titles_do_not_name_a_setting():
    assert plane_in_words("width") == "teeth of true width"
    assert plane_in_words("strain") == "plane strain"


@pytest.mark.parametrize(
    ("word", "value", "told"),
    [
        ("helix_angle", 20, "unknown key helix_angle, did you mean helix_angle_deg?"),
        ("beta", 20, "unknown key beta, did you mean helix_angle_deg?"),
        ("helical", True, "unknown key helical, did you mean helix_angle_deg?"),
        ("internal_gear", True, "unknown key internal_gear, did you mean internal?"),
        ("transverse_module", 2.1, "did you mean transverse_module_mm?"),
        ("m_t", 2.1, "unknown key m_t, did you mean transverse_module_mm?"),
        ("alpha_t", 21, "did you mean transverse_pressure_angle_deg?"),
        ("diametral_pitch", 8, "did you mean diametral_pitch_per_in?"),
        ("DP", 8, "unknown key DP, did you mean diametral_pitch_per_in?"),
        ("transverse_diametral_pitch", 8, "transverse_diametral_pitch_per_in?"),
        ("bevel_angle_deg", 45, "spur and helical gears on parallel axes only"),
        ("overlap_ratio", 1.2, "follows from helix_angle_deg and face_width_mm"),
        (
            "helix_angle_deg",
            -20.0,
            'must be at least 0; .* by hand = "left" or "ri',
        ),
        ("teeth", -45, "teeth = -45; .*; an internal gear has teeth = 45 and internal"),
    ],
)
def test_words_of_others_lead_to_the_keys_that_are_meant(word, value, told):
    pattern = told if ".*" in told else re.escape(told)
    with pytest.raises(InputError, match=pattern):
        make_gear_set(tables(gear={word: value}))


def test_depths_that_cannot_be_negative_have_the_limits_of_their_key():
    lead = {"end_relief_um": 2000.0, "end_relief_length_mm": 5.0}
    with pytest.raises(
        InputError, match="end_relief_um = 2000; must be from 0 to 1500"
    ):
        make_gear_set(tables(mesh={"lead": lead}))


def test_gaps_of_back_flanks():
    """Axes give way on one side and come nearer on the other; removal is alike."""
    place = np.linspace(-5e-3, 5e-3, 5)

    def gears(**keys):
        return make_gear_set({**PAIR, "mesh": [{**PAIR["mesh"][0], **keys}]})

    misaligned = gears(misalignment_um=20.0)
    drive, back = (misaligned_gap(misaligned, 0, place, side) for side in (False, True))
    assert drive == pytest.approx(2e-6 * (5.0 + 1e3 * place))
    # normals of both flanks of a tooth, in the section
    angle = np.radians(24.0)
    of_drive, of_back = (np.array([s * np.cos(angle), np.sin(angle)]) for s in (1, -1))
    assert back == pytest.approx(drive * (of_drive @ of_back))
    for keys, sign in (({"slope_um": 12.0}, -1.0), ({"crowning_um": 12.0}, 1.0)):
        lead = gears(driven_lead=keys).meshes[0].driven_flank.lead
        depths = [one.depth(place, 10e-3) for one in (lead, lead.of_back_flanks)]
        assert depths[1] == pytest.approx(sign * depths[0])
