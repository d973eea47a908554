"""Derived figures against relations that must hold between them."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from fegear.commands.show.derived import gear_set_figures
from fegear.elasticity.cyclic_gear import cyclic_gear
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from fegear.gearset import builtin_names, load_gear_set, read_gear_set
from fegear.gearset.phases import geometric_phase

MESHES = [
    pytest.param(mesh, id=f"{name}-{mesh['driver']}")
    for name in builtin_names()
    for mesh in gear_set_figures(load_gear_set(name))["meshes"]
]


@pytest.mark.parametrize("mesh", MESHES)
def test_approach_and_recess_make_the_contact_ratio(mesh):
    total = mesh["approach_pitches"] + mesh["recess_pitches"]
    assert total == pytest.approx(mesh["contact_ratio"])


@pytest.mark.parametrize("mesh", MESHES)
def test_points_on_the_flank_are_in_order(mesh):
    for flank in mesh["flanks"]:
        sign = -1.0 if flank["gear"] == "ring" else 1.0
        angles = [
            flank["form_roll_angle_deg"],
            flank["sap_roll_angle_deg"],
            flank["lpstc_roll_angle_deg"],
            flank["hpstc_roll_angle_deg"],
            flank["tip_roll_angle_deg"],
        ]
        assert angles == sorted(angles, key=lambda angle: sign * angle)
        assert flank["tip_root_clearance_mm"] > 0.0


@pytest.mark.parametrize("name", builtin_names())
def test_double_contact_spans_the_contact_ratio_less_one(name):
    figures = gear_set_figures(load_gear_set(name))
    teeth = {gear["name"]: gear["teeth"] for gear in figures["gears"]}
    for mesh in figures["meshes"]:
        for flank in mesh["flanks"]:
            span = abs(flank["tip_roll_angle_deg"] - flank["hpstc_roll_angle_deg"])
            pitches = span * teeth[flank["gear"]] / 360.0
            assert pitches == pytest.approx(mesh["contact_ratio"] - 1.0)


@pytest.mark.parametrize("name", builtin_names())
def test_figures_are_json_without_nan(name):
    figures = gear_set_figures(load_gear_set(name))
    assert json.loads(json.dumps(figures, allow_nan=False))["name"] == name


def test_relief_is_shown_as_it_was_given():
    text = """
name = "relieved"
[defaults]
module_mm = 2.54
face_width_mm = 25
[[gear]]
name = "one"
teeth = 38
hub_radius_mm = 13
[[gear]]
name = "two"
teeth = 55
hub_radius_mm = 20
[[mesh]]
driver = "one"
driven = "two"
center_distance_mm = 119
driver_tip_relief = { magnitude_um = 12, length_pitches = 0.25, shape = "parabolic" }
driven_root_relief = { magnitude_um = 8, start_roll_angle_deg = 20 }
"""
    driver, driven = gear_set_figures(read_gear_set(text))["meshes"][0]["flanks"]
    assert driver["root_relief"] is None
    assert driven["tip_relief"] is None
    assert driver["tip_relief"]["magnitude_um"] == pytest.approx(12)
    assert driver["tip_relief"]["length_pitches"] == pytest.approx(0.25)
    assert driver["tip_relief"]["shape"] == "parabolic"
    assert driven["root_relief"]["magnitude_um"] == pytest.approx(8)
    assert driven["root_relief"]["start_roll_angle_deg"] == pytest.approx(20)


def idler_train(teeth: int, angle_deg: float = 20.0) -> str:
    gears = [("in", 30), ("idler", teeth), ("out", 40)]
    text = 'name = "train"\n[defaults]\nmodule_mm = 2\nface_width_mm = 20\n'
    for name, count in gears:
        text += f'[[gear]]\nname = "{name}"\nteeth = {count}\nhub_radius_mm = 10\n'
    for driver, driven in (("in", "idler"), ("idler", "out")):
        text += f'[[mesh]]\ndriver = "{driver}"\ndriven = "{driven}"\n'
        text += f"operating_pressure_angle_deg = {angle_deg}\n"
    return text


@pytest.mark.parametrize(("teeth", "phase"), [(36, 0.5), (37, 0.0), (38, 0.5)])
def test_phase_of_standard_gears_in_line(teeth, phase):
    """Half a pitch of tooth thickness, and half a turn is a whole or half pitch."""
    mesh = gear_set_figures(read_gear_set(idler_train(teeth)))["meshes"][1]
    assert abs(mesh["phase_pitches"]) == pytest.approx(phase, abs=1e-12)
    assert mesh["phase_origin"] == "derived, centres in line"


def test_thinner_idler_teeth_shift_the_phase():
    """The trailing flank leads: the other flank comes earlier by the thinning."""
    thinning = 100.0
    thin = idler_train(37).replace(
        "teeth = 37\n", f"teeth = 37\ntooth_thinning_um = {thinning}\n"
    )
    gear_set = read_gear_set(thin)
    pitch_um = 2e3 * math.pi
    phase = geometric_phase(gear_set, 1)
    assert phase == pytest.approx(-thinning / pitch_um)


def test_phase_adds_up_along_a_row_and_stops_at_a_shaft():
    gear_set = read_gear_set(idler_train(37, 21.0))
    first, second = gear_set.meshes
    shifted = replace(second, phase=0.2)
    row = replace(gear_set, meshes=(first, shifted))
    assert gear_set_figures(row)["meshes"][1]["phase_pitches"] == 0.2
    assert gear_set_figures(row)["meshes"][1]["phase_origin"] == "given"
    countershaft = load_gear_set("liu-countershaft")
    assert geometric_phase(countershaft, 1) is None
    open_phase = replace(countershaft.meshes[1], phase=None)
    loose = replace(countershaft, meshes=(countershaft.meshes[0], open_phase))
    chosen = gear_set_figures(loose)["meshes"][1]
    assert chosen["phase_pitches"] == 0.0
    assert chosen["phase_origin"] == "chosen, gears on a shaft can be clocked at will"


def test_missing_inertia_and_mass_are_those_of_the_meshed_body():
    gear, *_ = read_gear_set(idler_train(37)).gears
    steel = PlaneMaterial(gear.young_modulus, gear.poisson_ratio)
    body = cyclic_gear(CyclicSector(gear.geometry, steel), gear.density)
    figures, *_ = gear_set_figures(read_gear_set(idler_train(37)))["gears"]
    width = gear.face_width
    assert figures["inertia_kg_m2"] == pytest.approx(width * body.inertia, rel=1e-5)
    assert figures["mass_kg"] == pytest.approx(width * body.mass, rel=1e-5)
    assert (figures["mass_origin"], figures["inertia_origin"]) == ("derived",) * 2


def test_given_inertia_and_mass_stand():
    figures = gear_set_figures(load_gear_set("liu-countershaft"))
    assert figures["gears"][0]["inertia_kg_m2"] == 0.01837
    assert figures["gears"][0]["inertia_origin"] == "given"
    assert figures["gears"][0]["mass_origin"] == "derived"
