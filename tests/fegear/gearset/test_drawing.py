"""Gears by what a drawing states of them: diameters, tooth thickness, material."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.commands.show.derived import gear_figures
from fegear.files.errors import InputError
from fegear.files.templates import template_text
from fegear.gearset import GearSet, make_gear_set, read_gear_set
from fegear.gearset.materials import materials
from fegear.gearset.plausibility import gear_set_warnings
from meshes.tooth_thickness import default_span_teeth, pin_dimension, span

PLAIN = {
    "name": "one",
    "teeth": 30,
    "module_mm": 2.0,
    "face_width_mm": 20.0,
    "hub_radius_mm": 12.0,
}
MATE = PLAIN | {"name": "two", "teeth": 41, "tip_radius_mm": 42.7}
# elasticity factors of a gear on one of steel, ISO 6336-2 [sqrt(N/mm2)]
ELASTICITY_FACTORS = {
    "steel": 189.8,
    "ductile iron": 181.4,
    "bronze": 155.0,
    "cast iron": 162.0,
}


def gear_set(edits=None, defaults=None, shift=0.0, **keys) -> GearSet:
    """Two gears with clearance; shift : of the first, as the centre distance has it."""
    gear = {key: value for key, value in (PLAIN | keys).items() if value is not None}
    center_mm = gear["teeth"] + MATE["teeth"] + 2.0 * shift + 0.4
    mesh = {"driver": "one", "driven": "two", "center_distance_mm": center_mm}
    tables = {"name": "pair", "gear": [gear, MATE], "mesh": [mesh]}
    return make_gear_set(tables | {"defaults": defaults or {}}, edits or {})


def teeth_of(**keys):
    return gear_set(**keys).gears[0].geometry


def test_diameters_are_twice_the_radii():
    by_radius = gear_set(tip_radius_mm=32.1, hub_radius_mm=11.0)
    by_diameter = gear_set(
        tip_diameter_mm=64.2, hub_diameter_mm=22.0, hub_radius_mm=None
    )
    assert by_radius == by_diameter


@settings(deadline=None, max_examples=25)
@given(shift=st.floats(-0.1, 0.4), thinning_um=st.floats(-200.0, 300.0))
def test_span_and_shift_give_the_thinning(shift, thinning_um):
    gear = teeth_of(shift=shift, profile_shift=shift, tooth_thinning_um=thinning_um)
    number = default_span_teeth(gear)
    length_mm = 1e3 * span(gear, gear.tooth_thickness, number)
    keys = {"span_mm": length_mm, "span_teeth": number}
    by_span = teeth_of(shift=shift, profile_shift=shift, **keys)
    assert 1e6 * by_span.tooth_thinning == pytest.approx(thinning_um, abs=1e-8)
    by_both = teeth_of(shift=shift, tooth_thinning_um=thinning_um, **keys)
    assert by_both.profile_shift == pytest.approx(shift, abs=1e-11)


@settings(deadline=None, max_examples=25)
@given(
    teeth=st.sampled_from([30, 31]),
    shift=st.floats(-0.1, 0.4),
    pin_mm=st.floats(3.4, 4.2),
)
def test_pins_alone_give_the_shift(teeth, shift, pin_mm):
    gear = teeth_of(shift=shift, teeth=teeth, profile_shift=shift)
    dimension = pin_dimension(gear, gear.tooth_thickness, 1e-3 * pin_mm)
    keys = {"pin_dimension_mm": 1e3 * dimension, "pin_diameter_mm": pin_mm}
    by_pins = teeth_of(shift=shift, teeth=teeth, **keys)
    assert by_pins.profile_shift == pytest.approx(shift, abs=1e-11)
    assert by_pins.tooth_thinning == 0.0
    assert by_pins.tip_radius == pytest.approx(gear.tip_radius)


def test_what_followed_is_among_the_inferences():
    keys = {"span_mm": 21.5, "span_teeth": 4}
    assert gear_set(profile_shift=0.0, **keys).inferences == (
        'gear "one": tooth_thinning_um = 5.5895, from span_mm = 21.5 over 4 teeth '
        "with profile_shift = 0",
    )
    assert gear_set(**keys).inferences == (
        'gear "one": profile_shift = -0.00383926, from span_mm = 21.5 over 4 teeth '
        "with tooth_thinning_um = 0 by default",
    )
    assert gear_set().inferences == ()


def test_shown_measures_are_read_back():
    shown = gear_figures(
        gear_set(shift=0.3, profile_shift=0.3, tooth_thinning_um=50.0).gears[0]
    )
    for names in (("span_mm", "span_teeth"), ("pin_dimension_mm", "pin_diameter_mm")):
        keys = {name: shown[name] for name in names}
        gear = teeth_of(shift=0.3, profile_shift=0.3, **keys)
        assert 1e6 * gear.tooth_thinning == pytest.approx(50.0, abs=1e-8)


def test_a_key_of_a_gear_replaces_the_shared_one():
    shared = {"tip_radius_mm": 32.5, "hub_radius_mm": 10.0, "young_modulus_GPa": 70.0}
    keys = {"tip_diameter_mm": 64.2, "hub_diameter_mm": 22.0, "hub_radius_mm": None}
    gear = gear_set(defaults=shared, **keys, material="POM").gears[0]
    assert gear.geometry.tip_radius == pytest.approx(32.1e-3)
    assert gear.geometry.hub_radius == pytest.approx(11e-3)
    assert gear.young_modulus == pytest.approx(2.9e9)


def test_a_change_replaces_what_says_the_same():
    gears = gear_set(
        {"gear.1.tip_diameter_mm": 64.2, "gear.1.pin_dimension_mm": 64.7}
        | {"gear.1.pin_diameter_mm": 3.5, "gear.1.hub_diameter_mm": 22.0},
        tip_radius_mm=32.5,
        span_mm=21.5,
        span_teeth=4,
    )
    gear = gears.gears[0].geometry
    assert gear.tip_radius == pytest.approx(32.1e-3)
    assert gear.hub_radius == pytest.approx(11e-3)
    dimension = pin_dimension(gear, gear.tooth_thickness, 3.5e-3)
    assert dimension == pytest.approx(64.7e-3)


@pytest.mark.parametrize("edits", [("material", "young"), ("young", "material")])
def test_a_changed_material_replaces_values_that_are_not_changed(edits):
    values = {
        "material": ("gear.1.material", "PEEK"),
        "young": ("gear.1.young_modulus_GPa", 3.7),
    }
    changes = dict(values[name] for name in edits)
    gear = gear_set(changes, young_modulus_GPa=70.0, poisson_ratio=0.34).gears[0]
    assert (gear.young_modulus, gear.poisson_ratio) == (3.7e9, 0.38)
    assert gear.material == "PEEK, young_modulus_GPa as given"


@pytest.mark.parametrize("name", materials())
def test_a_named_material_has_its_values(name):
    gear, material = gear_set(material=name).gears[0], materials()[name]
    shown = gear_figures(gear)
    assert shown["material"] == name
    for key in ("young_modulus_GPa", "poisson_ratio", "density_kg_per_m3"):
        assert shown[key] == pytest.approx(getattr(material, key))


def test_without_a_name_gears_are_of_steel_unless_values_differ():
    assert gear_set().gears[0].material == "steel"
    assert gear_set(young_modulus_GPa=206.0).gears[0].material == "steel"
    assert gear_set(young_modulus_GPa=210.0).gears[0].material == "as given"


@pytest.mark.parametrize("name", ELASTICITY_FACTORS)
def test_metals_have_the_elasticity_factors_of_the_standard(name):
    def compliance(material):  # mm2/N
        nu, modulus = material.poisson_ratio, 1e3 * material.young_modulus_GPa
        return (1.0 - nu**2) / modulus

    both = compliance(materials()["steel"]) + compliance(materials()[name])
    factor = math.sqrt(1.0 / (math.pi * both))
    assert factor == pytest.approx(ELASTICITY_FACTORS[name], abs=0.06)


def test_every_material_says_where_its_values_are_from():
    for material in materials().values():
        assert material.source
        assert material.condition


@pytest.mark.parametrize("keys", ["span_mm span_teeth", "pin_dimension_mm pin_diam"])
def test_measures_of_the_template_are_those_of_its_thinning(keys):
    lines = template_text("pair")
    for key in keys.split():
        lines = re.sub(rf"^# ({key})", r"\1", lines, flags=re.M)
    thinning = read_gear_set(lines).gears[0].geometry.tooth_thinning
    assert 1e6 * thinning == pytest.approx(40.0, abs=4.0)


def test_the_example_of_the_page_is_read():
    page = Path(__file__).parents[3] / "docs/howto/gear-set-file.md"
    example = next(
        block
        for block in re.findall(r"```toml\n(.*?)```", page.read_text("utf-8"), re.S)
        if "span_mm" in block
    )
    rest = """
[[gear]]
name = "wheel"
teeth = 61
hub_radius_mm = 25
[[mesh]]
driver = "pinion"
driven = "wheel"
center_distance_mm = 105.7
"""
    shared = 'name = "p"\n[defaults]\nmodule_mm = 2.5\nface_width_mm = 20\n'
    gear = read_gear_set(shared + example + rest).gears[0].geometry
    assert 0.0 < gear.tooth_thinning < 100e-6


def test_a_tooth_too_thick_for_its_shift_is_thinned_by_less_than_nothing():
    gear = teeth_of(profile_shift=0.0, span_mm=21.51, span_teeth=4)
    assert -10e-6 < gear.tooth_thinning < 0.0


def test_a_span_over_more_than_half_of_the_teeth_is_refused():
    with pytest.raises(InputError, match="span_teeth = 40 of 30 teeth; must be 1 to 1"):
        gear_set(profile_shift=0.0, span_mm=21.5, span_teeth=40)


def test_a_shift_that_no_gear_has_names_the_span_it_is_from():
    with pytest.raises(InputError, match=r"over 9 teeth; profile shift -\d"):
        gear_set(span_mm=21.5, span_teeth=9)


def test_a_measure_that_implies_no_tooth_of_a_gear_is_doubted():
    """A millimetre off in the span; a shift without any thinning."""
    by_span = gear_set(profile_shift=0.0, span_mm=20.9, span_teeth=4)
    (line,) = gear_set_warnings(by_span)
    thinning_um = 1e6 * by_span.gears[0].geometry.tooth_thinning
    assert (
        f"span_mm = 20.9 over 4 teeth gives tooth_thinning_um = {thinning_um:.4g}"
        in (line)
    )
    assert line.endswith("[W38]")
    large = {"teeth": 60, "hub_radius_mm": 20.0}
    shifted = teeth_of(shift=1.6, profile_shift=1.6, **large)
    number = default_span_teeth(shifted)
    length_mm = 1e3 * span(shifted, shifted.tooth_thickness, number)
    keys = large | {"span_mm": length_mm, "span_teeth": number}
    (line,) = gear_set_warnings(gear_set(shift=1.6, **keys))
    assert f"over {number} teeth gives profile_shift = 1.6; gears have" in line
    typed = gear_set(profile_shift=0.0, tooth_thinning_um=640.0)
    assert list(gear_set_warnings(typed)) == []


def test_a_span_over_one_tooth_too_many_is_refused():
    with pytest.raises(InputError, match="over 5 teeth; tooth thinning"):
        gear_set(profile_shift=0.0, span_mm=21.5, span_teeth=5)
