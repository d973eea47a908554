"""A file as programs write them: relations first, ids in any order, mixed units.

Two spur stages on three shafts, between a helical stage and a ring gear.
"""

from __future__ import annotations

import math
import tomllib

import pytest

from fegear.commands.new.rexs import convert_gearbox
from fegear.commands.new.rexs.reading import parse_rexs
from fegear.commands.new.rexs.thickness_series import DIAMETERS_MM, thinning_of_series
from fegear.commands.new.study import problems_of
from fegear.files.errors import InputError
from fegear.gearset.read import read_gear_set

RELATIONS = """
<relation id="7" type="stage">
  <ref hint="cylindrical_gear" id="31" role="gear_2"/>
  <ref hint="cylindrical_stage" id="90" role="stage"/>
  <ref hint="cylindrical_gear" id="22" role="gear_1"/>
</relation>
<relation id="3" type="assembly">
  <ref hint="cylindrical_gear" id="22" role="part"/>
  <ref hint="shaft" id="2" role="assembly"/>
</relation>
<relation id="4" type="assembly">
  <ref id="2" role="assembly"/><ref id="21" role="part"/>
</relation>
<relation id="5" type="assembly">
  <ref id="3" role="assembly"/><ref id="31" role="part"/>
</relation>
<relation id="6" type="assembly">
  <ref id="1" role="assembly"/><ref id="11" role="part"/>
</relation>
<!-- the input stage, with its gears in the opposite order -->
<relation id="1" type="stage">
  <ref id="80" role="stage"/><ref id="21" role="gear_1"/><ref id="11" role="gear_2"/>
</relation>
<relation id="8" type="stage">
  <ref id="81" role="stage"/><ref id="31" role="gear_1"/><ref id="41" role="gear_2"/>
</relation>
<relation id="10" type="assembly">
  <ref id="1" role="assembly"/><ref id="60" role="part"/>
</relation>
<relation id="11" type="flank">
  <ref id="11" role="gear"/><ref id="70" role="left"/><ref id="71" role="right"/>
</relation>
<relation id="12" type="reference">
  <ref id="1" role="origin"/><ref id="50" role="referenced"/>
</relation>
<relation id="13" type="assembly">
  <ref id="2" role="assembly"/><ref id="65" role="part"/>
</relation>
<relation id="14" order="1" type="ordered_reference">
  <ref id="21" role="origin"/><ref id="66" role="referenced"/>
</relation>
"""
COMPONENTS = """
<component id="90" name="low stage" type="cylindrical_stage">
  <attribute id="center_distance" unit="mum">91500.0</attribute>
</component>
<component id="80" name="high stage" type="cylindrical_stage">
  <attribute id="center_distance" unit="mm">70.5</attribute>
</component>
<component id="81" name="helical stage" type="cylindrical_stage">
  <attribute id="center_distance" unit="mm">100</attribute>
</component>
<component id="11" name="Rad" type="cylindrical_gear">
  <attribute id="number_of_teeth" unit="none">20</attribute>
  <attribute id="normal_module" unit="mm">2.0</attribute>
  <attribute id="face_width" unit="m">0.02</attribute>
  <attribute id="helix_angle_reference_diameter" unit="°">-0.0</attribute>
  <attribute id="chamfer_at_tooth_end" unit="mm">0.2</attribute>
</component>
<component id="21" name="Rad" type="cylindrical_gear">
  <attribute id="u_coordinate_on_shaft" unit="mm">80.0</attribute>
  <attribute id="face_width" unit="mm">18</attribute>
  <attribute id="number_of_teeth" unit="">50</attribute>
  <attribute id="normal_module">2.0</attribute>
</component>
<component id="22" name="" type="cylindrical_gear">
  <attribute id="u_coordinate_on_shaft" unit="mm">30.0</attribute>
  <attribute id="face_width" unit="mm">25</attribute>
  <attribute id="number_of_teeth" unit="none">21</attribute>
  <attribute id="normal_module" unit="mm">3</attribute>
  <attribute id="root_diameter" unit="mm">55.2</attribute>
</component>
<component id="31" name="Abtrieb" type="cylindrical_gear">
  <attribute id="face_width" unit="mm">24</attribute>
  <attribute id="number_of_teeth" unit="none">40</attribute>
  <attribute id="normal_module" unit="mm">3</attribute>
  <attribute id="tip_diameter" unit="mm">126.1</attribute>
</component>
<component id="41" name="helical" type="cylindrical_gear">
  <attribute id="helix_angle_reference_diameter" unit="rad">0.2</attribute>
  <attribute id="number_of_teeth" unit="none">40</attribute>
</component>
<component id="1" name="ANW" type="shaft">
  <attribute id="defines_speed" unit="none">true</attribute>
</component>
<component id="2" name="ZW" type="shaft"/>
<component id="3" name="ABW" type="shaft"/>
<component id="60" name="motor" type="external_load"/>
<component id="61" name="6210" type="rolling_bearing_with_catalog_geometry"/>
<component id="62" name="6211" type="rolling_bearing_with_catalog_geometry"/>
<component id="70" name="" type="flank_geometry">
  <attribute id="normal_pressure_angle" unit="deg">20.0</attribute>
  <attribute id="addendum_modification_coefficient" unit="none">0.25</attribute>
</component>
<component id="71" name="" type="flank_geometry">
  <attribute id="normal_pressure_angle" unit="deg">20.0</attribute>
  <attribute id="addendum_modification_coefficient" unit="none">0.25</attribute>
</component>
<component id="50" name="16MnCr5" type="material">
  <attribute id="elastic_modulus" unit="MPa">2.1E5</attribute>
  <attribute id="poisson_ratio" unit="none">0.29</attribute>
  <attribute id="density" unit="kg / dm^3">7.8</attribute>
</component>
<component id="65" name="section" type="shaft_section">
  <attribute id="u_coordinate_on_shaft" unit="mm">0</attribute>
  <attribute id="length" unit="mm">100</attribute>
  <attribute id="outer_diameter_begin" unit="mm">30</attribute>
  <attribute id="outer_diameter_end" unit="mm">40</attribute>
</component>
<component id="66" name="hob" type="rack_shaped_tool">
  <attribute id="addendum_coefficient_reference_profile" unit="none">1.3</attribute>
  <attribute id="tip_radius_factor" unit="none">0.25</attribute>
</component>
"""
LOADS = """
<load_spectrum id="1">
  <load_case id="1">
    <component id="60" name="motor" type="external_load">
      <attribute id="torque_around_u_axis" unit="N mm">-40000</attribute>
    </component>
    <component id="1" name="ANW" type="shaft">
      <attribute id="rotational_speed" unit="1 / min">1500</attribute>
    </component>
  </load_case>
</load_spectrum>
"""


def document(
    relations: str = RELATIONS,
    components: str = COMPONENTS,
    loads: str = LOADS,
    version: str = "1.1",
) -> str:
    return (
        f'<model applicationId="Test" version="{version}">{loads}'
        f"<relations>{relations}</relations>"
        f"<components>{components}</components></model>"
    )


def converted(text: str):
    return convert_gearbox(parse_rexs(text.encode()), "box.rexs", "box")


@pytest.mark.parametrize("version", ["1.0", "1.3", "1.4", "1.5", "1.7"])
def test_values_and_units(version):
    tables = tomllib.loads(converted(document(version=version)).text)
    first, second, third, last = tables["gear"]
    assert first == {
        "name": "Rad (11)",
        "teeth": 20,
        "module_mm": 2.0,
        "pressure_angle_deg": 20.0,
        "profile_shift": 0.25,
        "face_width_mm": 20.0,
        "hub_diameter_mm": 24.0,
        "young_modulus_GPa": pytest.approx(210.0, rel=1e-15),
        "poisson_ratio": 0.29,
        "density_kg_per_m3": 7800.0,
    }
    assert second["hub_diameter_mm"] == pytest.approx(38.0)  # of the conical section
    assert second["dedendum_mm"] == pytest.approx(2.6)
    assert second["rack_tip_radius_mm"] == pytest.approx(0.5)
    assert third["name"] == "gear (22)"
    assert third["dedendum_mm"] == pytest.approx(0.5 * (63.0 - 55.2))
    assert last["tip_diameter_mm"] == 126.1
    assert tables["load"] == {"gear": "Rad (11)", "torques_Nm": [40.0]}
    assert tables["shaft"] == [{"gears": ["gear (22)", "Rad (21)"]}]
    assert [m["center_distance_mm"] for m in tables["mesh"]] == pytest.approx(
        [70.5, 91.5]
    )
    assert tables["mesh"][0]["driver"] == "Rad (11)"


def test_what_is_left_out_is_named():
    result = converted(document())
    lines = "\n".join(result.left_out)
    # its mate is a spur gear
    assert 'cylindrical_stage 81 "helical stage": helix angle of' in lines
    assert "is 0 deg; must be 11.4592" in lines
    assert "2 rolling_bearing_with_catalog_geometry" in lines
    assert '61 "6210"' in lines
    assert "attributes of cylindrical_gear: chamfer_at_tooth_end" in lines
    assert "1500 rpm" in lines
    for line in result.left_out:
        assert f"# - {line}\n" in result.text
    assumed = "\n".join(result.assumed)
    assert 'bore of cylindrical_gear 31 "Abtrieb"' in assumed
    assert 'defines_speed of shaft 1 "ANW"' in assumed
    assert list(result.assumed) == tomllib.loads(result.text)["inferences"]
    gear_set = read_gear_set(result.text)
    assert [mesh.gears for mesh in gear_set.meshes] == [(0, 1), (2, 3)]


def test_a_torque_on_the_output_goes_by_the_ratio():
    """20/50 and 21/40: T1 = T3 / (2.5 * 40/21)."""
    relations = RELATIONS.replace(
        '<ref id="1" role="assembly"/><ref id="60" role="part"/>',
        '<ref id="3" role="assembly"/><ref id="60" role="part"/>',
    )
    tables = tomllib.loads(converted(document(relations)).text)
    (torque,) = tables["load"]["torques_Nm"]
    assert torque == pytest.approx(40.0 / (2.5 * 40 / 21), rel=1e-12)


def test_the_driving_gear_by_stage_data():
    relations = RELATIONS + (
        '<relation id="20" type="stage_gear_data"><ref id="90" role="stage"/>'
        '<ref id="31" role="gear"/><ref id="200" role="stage_gear_data"/></relation>'
    )
    components = COMPONENTS + (
        '<component id="200" type="stage_gear_data">'
        '<attribute id="is_driving_gear">true</attribute></component>'
    )
    tables = tomllib.loads(converted(document(relations, components)).text)
    pairs = [(mesh["driver"], mesh["driven"]) for mesh in tables["mesh"]]
    assert pairs == [("Abtrieb", "gear (22)"), ("Rad (21)", "Rad (11)")]


def without(text: str, attribute: str) -> str:
    """The components without the first attribute of a name."""
    start = text.index(f'<attribute id="{attribute}"')
    end = text.index("</attribute>", start) + len("</attribute>")
    return text[:start] + text[end:]


def changed(old: str, new: str) -> str:
    assert old in COMPONENTS
    return document(components=COMPONENTS.replace(old, new))


WRONG = [
    (
        document(components=without(COMPONENTS, "face_width")),
        'cylindrical_gear 11 "Rad": attribute face_width is missing',
    ),
    (
        document(components=without(COMPONENTS, "center_distance")),
        'cylindrical_stage 90 "low stage": attribute center_distance is missing',
    ),
    (
        changed('unit="m">0.02', 'unit="ell">0.02'),
        'face_width has unit "ell"; allowed are mm, mum, um, cm, m',
    ),
    (changed('unit="m">0.02', 'unit="m">wide'), "face_width = wide; must be a finite"),
    (changed('unit="m">0.02', 'unit="m">nan'), "face_width = nan; must be a finite"),
    (changed(">20<", ">20.5<"), "number_of_teeth = 20.5; must be a whole number"),
    (changed('id="31" name', 'id="32" name'), "there is no such component"),
    (changed('id="62"', 'id="61"'), "component id = 61; is there twice"),
    (changed('id="62"', 'id="six"'), "component id = six; must be a whole number"),
    (
        document(
            components=COMPONENTS.replace(">0.25<", ">0.35<", 1),
        ),
        "flanks of a gear are alike",
    ),
    (
        changed(
            'coefficient" unit="none">0.25</attribute>',
            'coefficient" unit="none">0.25</attribute>'
            '<attribute id="addendum_modification" unit="mm">2.2</attribute>',
        ),
        "they must be equal",
    ),
    (document(version="2.0"), "version = 2.0; must be one of REXS 1"),
    (document().replace(' version="1.1"', ""), "version = missing; must be one"),
    (
        document(loads=LOADS.replace(' type="shaft"', "")),
        "load case 1: component 1: type is missing",
    ),
    (document(relations=""), "a relation of type stage is needed"),
    (
        '<!DOCTYPE model [<!ENTITY a "aaaa">]>' + document(),
        "XML with a DOCTYPE",
    ),
    ("<model", "XML syntax"),
    ("<page/>", "root <page>; must be <model>"),
    ('{"a": 1}', 'JSON without the object "model"'),
    ('{"model": {"version": "1.4", "components": 5}}', "components: must be a list"),
    ("[" * 10, "not a REXS file"),
]


@pytest.mark.parametrize(("text", "message"), WRONG, ids=[m[:40] for _, m in WRONG])
def test_a_wrong_file_is_refused_in_one_line(text, message):
    with pytest.raises(InputError) as error:
        converted(text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_without_spur_stages():
    text = document().replace('unit="°">-0.0', 'unit="°">15')
    text = text.replace(
        '<attribute id="number_of_teeth" unit="none">40</attribute>',
        '<attribute id="number_of_teeth" unit="none">-40</attribute>',
    )
    with pytest.raises(
        InputError, match=r"no stage of external gears: .*internal gear|only spur"
    ):
        converted(text)


def test_a_planetary_stage_is_left_out():
    """The gear that meshes with an internal one is a planet in its other stage too."""
    text = document().replace(
        '<component id="41" name="helical" type="cylindrical_gear">',
        '<component id="41" name="ring" type="ring_gear">',
    )
    lines = "\n".join(converted(text).left_out)
    assert 'ring_gear 41 "ring" is an internal gear' in lines
    assert '"low stage": cylindrical_gear 31 "Abtrieb" also meshes with an' in lines


def helical(angles=("0.2", "-0.2")):
    """The document with a helical low stage, of angles [rad]."""
    text = document().replace('unit="rad">0.2<', 'unit="rad">0.3<')
    for number, angle in zip((22, 31), angles, strict=True):
        start = text.index(f'<component id="{number}"')
        place = text.index(">", start) + 1
        attribute = (
            f'<attribute id="helix_angle_reference_diameter" unit="rad">{angle}'
            "</attribute>"
        )
        text = text[:place] + attribute + text[place:]
    # at the distance of their reference circles: 3 mm / cos(0.2)
    return text.replace('unit="mum">91500.0', 'unit="mum">93366.0')


def test_helical_stages_are_read():
    result = converted(helical())
    tables = tomllib.loads(result.text)
    pinion, wheel = tables["gear"][2:]
    assert [g["helix_angle_deg"] for g in (pinion, wheel)] == pytest.approx(
        [11.4591559] * 2
    )
    assert (pinion["hand"], wheel["hand"]) == ("right", "left")
    assert "helix_angle_deg" not in tables["gear"][0]
    gear_set = read_gear_set(result.text)
    assert gear_set.meshes[1].is_helical
    assert not gear_set.meshes[0].is_helical
    cosine = math.cos(0.2)
    teeth = gear_set.gears[2].geometry
    assert teeth.module == pytest.approx(3e-3 / cosine)
    # a root diameter of 55.2 mm
    assert teeth.root_radius == pytest.approx(27.6e-3, rel=1e-9)


def test_spans_of_helical_gears_are_read():
    text, shifts = helical(), []
    place = text.index(">", text.index('<component id="31"')) + 1
    for length_mm in (41.5, 41.4):
        span = (
            f'<attribute id="span_measurement" unit="mm">{length_mm}</attribute>'
            '<attribute id="number_of_teeth_for_span_measurement">5</attribute>'
        )
        result = converted(text[:place] + span + text[place:])
        gear = tomllib.loads(result.text)["gear"][3]
        assert (gear["span_mm"], gear["span_teeth"]) == (length_mm, 5)
        assert "tooth thickness of cylindrical_gear 31" not in str(result.assumed)
        shifts.append(read_gear_set(result.text).gears[3].geometry.profile_shift)
    # in normal modules: no shift is stated, and a flank moves by x m sin(alpha)
    change = (shifts[1] - shifts[0]) / math.cos(0.2)
    expected = -0.1 / (2.0 * 3.0 * math.sin(math.radians(20.0)))
    assert change == pytest.approx(expected, rel=1e-6)


def test_helices_of_one_sign_are_magnitudes():
    result = converted(helical(("0.2", "0.2")))
    assert "hand" not in tomllib.loads(result.text)["gear"][2]
    assert "the same sign" in "\n".join(result.assumed)
    signs = [
        math.copysign(1, g.geometry.twist) for g in read_gear_set(result.text).gears
    ]
    assert signs[2] == -signs[3]


# tolerances of series 21 to 30 by reference diameter, as the standard prints them [um]
TOLERANCES = """
3 5 8 12 20 30 50 80 130 200
5 8 12 20 30 50 80 130 200 300
6 10 16 25 40 60 100 160 250 400
8 12 20 30 50 80 130 200 300 500
10 16 25 40 60 100 160 250 400 600
12 20 30 50 80 130 200 300 500 800
16 25 40 60 100 160 250 400 600 1000
20 30 50 80 130 200 300 500 800 1300
25 40 60 100 160 250 400 600 1000 1600
30 50 80 130 200 300 500 800 1300 2000
40 60 100 160 250 400 600 1000 1600 2400
"""


def test_tolerances_of_series_are_those_of_the_standard():
    printed = [list(map(float, row.split())) for row in TOLERANCES.split("\n")[1:-1]]
    assert printed == [
        [thinning_of_series(f"h{number}", diameter)[1] for number in range(21, 31)]
        for diameter in DIAMETERS_MM
    ]
    # of the wheels of many drawings
    assert thinning_of_series("cd25", 50.0) == (54.0, 84.0)
    assert thinning_of_series("CD25", 50.1) == (70.0, 110.0)


@pytest.mark.parametrize("series", ["cd20", "cd31", "i25", "25", "", "cd 25"])
def test_what_is_no_series_is_refused(series):
    with pytest.raises(InputError, match="allowed are a, ab, b"):
        thinning_of_series(series, 50.0)


def with_attribute(text: str, number: int, name: str, value: str) -> str:
    place = text.index(">", text.index(f'<component id="{number}"')) + 1
    return f'{text[:place]}<attribute id="{name}">{value}</attribute>{text[place:]}'


@pytest.mark.parametrize(
    "name",
    [
        "tooth_thickness_deviation_tolerance_series_din_3967_1978",
        "din_3967_deviation_tolerance_series",
    ],
)
def test_a_series_of_tolerances_thins_teeth(name):
    result = converted(with_attribute(helical(), 31, name, "c25"))
    wheel = tomllib.loads(result.text)["gear"][3]
    # 122.4 mm: 85 to 125 um in the normal section
    assert wheel["tooth_thinning_um"] == round(105.0 / math.cos(0.2), 1)
    assert "85 to 125 um in the normal section, by c25" in "\n".join(result.assumed)
    plain = read_gear_set(converted(helical()).text).meshes[1]
    assert read_gear_set(result.text).meshes[1].pair.backlash > plain.pair.backlash


def test_an_unknown_series_is_said():
    name = "din_3967_deviation_tolerance_series"
    result = converted(with_attribute(document(), 31, name, "z99"))
    assert "tooth_thinning_um" not in result.text
    assert "without thinning, series 'z99' of DIN 3967" in "\n".join(result.assumed)


def test_all_bad_pairs_are_listed():
    text = document().replace('unit="mum">91500.0', 'unit="mum">91000.0')
    assert text != document()
    assert problems_of(converted(document())) == ()
    (only,) = problems_of(converted(text))
    assert 'mesh "gear (22)"' in only
    other = text.replace('unit="mm">70.5', 'unit="mm">70.1')
    assert other != text
    first, second = problems_of(converted(other))
    assert 'mesh "Rad (11)"' in first
    assert second == only
