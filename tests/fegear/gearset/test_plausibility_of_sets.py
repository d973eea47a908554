"""Values of gear sets that cannot be meant are doubted, others are not."""

from __future__ import annotations

import json
import math

import pytest

from fegear import load_gear_set, make_gear_set
from fegear.cli import run
from fegear.gearset.materials import materials
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.read import builtin_names


def warnings_of(name: str, **edits: object) -> list[str]:
    keys = {key.replace("__", "."): value for key, value in edits.items()}
    return list(gear_set_warnings(load_gear_set(name, keys)))


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_sets_are_not_doubted(name):
    assert warnings_of(name) == []


@pytest.mark.parametrize("material", materials())
def test_no_material_of_the_list_is_doubted(material):
    assert warnings_of("liu-pair", gear__1__material=material) == []


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "young_modulus_GPa",
            2800.0,
            "young_modulus_GPa = 2800 is outside 0.1 to 1000",
        ),
        ("young_modulus_GPa", 0.0028, "young_modulus_GPa = 0.0028 is outside"),
        ("poisson_ratio", 0.03, "poisson_ratio = 0.03 is outside 0.1 to 0.48"),
        ("density_kg_per_m3", 7.85, "density_kg_per_m3 = 7.85 is outside 500 to 20000"),
    ],
)
def test_a_value_in_another_unit_is_doubted(key, value, message):
    (line,) = warnings_of("liu-pair", **{f"gear__1__{key}": value})
    assert message in line
    assert line.startswith('gear "pinion": ')
    assert line.endswith("[W34]")


def test_commands_print_the_warning(capsys):
    edit = ["--set", "gear.1.young_modulus_GPa=2800", "--json"]
    quick = ["--resolution", "coarse", "--positions", "4"]
    for command in (["show"], ["stiffness", *quick], ["export", "-o", "x.json"]):
        if command[0] == "export":
            continue
        assert run([command[0], "liu-pair", *command[1:], *edit]) == 0
        printed = capsys.readouterr()
        assert any("W34" in line for line in json.loads(printed.out)["warnings"])
        assert "young_modulus_GPa = 2800" in printed.err


IDLER = {
    "name": "triangle",
    "defaults": {"module_mm": 2.0, "face_width_mm": 10.0, "hub_radius_mm": 8.0},
    "gear": [{"name": name, "teeth": 20} for name in "abc"],
    "mesh": [
        {"driver": "a", "driven": "b", "backlash_um": 90.0},
        {"driver": "b", "driven": "c", "backlash_um": 90.0},
    ],
    "load": {"gear": "a", "torques_Nm": [10.0]},
}


def with_lines(tables: dict, *angles: float) -> list[str]:
    meshes = [
        mesh | {"center_line_deg": angle}
        for mesh, angle in zip(tables["mesh"], angles, strict=True)
    ]
    return list(gear_set_warnings(make_gear_set(tables | {"mesh": meshes})))


@pytest.mark.parametrize("angle", [100.0, 140.0, 180.0])
def test_gears_over_each_other_are_named_with_their_overlap(angle):
    """Distance of the outer gears by the law of cosines; tips of 22 mm."""
    gap = 2.0 * 40.0 * abs(math.cos(math.radians(0.5 * angle)))
    overlap = 44.0 - gap
    lines = with_lines(IDLER, 0.0, angle)
    if overlap <= 0.0:
        assert lines == []
        return
    (line,) = lines
    assert line.startswith('gears "a" and "c" do not mesh and overlap by ')
    assert f"{overlap:.4g} mm" in line
    assert line.endswith("[W35]")


def test_gears_behind_each_other_may_overlap():
    """Input and output of a counter-shaft on one axis, and wheels in two planes."""
    tables = IDLER | {
        "gear": [{"name": name, "teeth": 20} for name in "abcd"],
        "mesh": [
            IDLER["mesh"][0],
            {"driver": "c", "driven": "d", "backlash_um": 90.0},
        ],
        "shaft": [{"gears": ["b", "c"]}],
    }
    assert with_lines(tables, 0.0, 180.0) == []
    assert with_lines(tables, 0.0, 160.0) == []


def test_a_row_is_not_doubted():
    assert list(gear_set_warnings(make_gear_set(IDLER))) == []


# root diameter of pinion-1 of helical-machine
ROOT_MM = 46.0 / math.cos(math.radians(15.0)) - 5.0


@pytest.mark.parametrize(
    ("lengths", "diameters", "warned"),
    [
        ([100], [ROOT_MM - 1e-3], []),
        ([100], [ROOT_MM + 1e-3], ["42.6237"]),
        # the face width of 12 mm is from 24 to 36 mm; sections beside it may be thick
        ([24, 12, 64], [60, 20, 60], []),
        ([24, 12.1, 63.9], [60, 20, 60], []),
        ([24, 11.9, 64.1], [60, 20, 50], ["50"]),
        ([24.1, 12, 63.9], [60, 20, 50], ["60"]),
    ],
)
def test_a_shaft_thicker_than_a_root_circle_is_doubted(lengths, diameters, warned):
    keys = {"shaft__1__lengths_mm": lengths, "shaft__1__diameters_mm": diameters}
    lines = [line for line in warnings_of("helical-machine", **keys) if "W71" in line]
    assert lines == [
        f'shaft 1: diameters_mm = {value} under gear "pinion-1" is above its root '
        "diameter, 42.6227 mm [W71]"
        for value in warned
    ]


def test_a_ring_has_its_shaft_where_it_may_be():
    ring = {"name": "ring", "teeth": 80, "internal": True, "rim_radius_mm": 95.0}
    gears = [{"name": "a", "teeth": 23, "hub_radius_mm": 12.0}, ring]
    gears = [{"module_mm": 2.0, "face_width_mm": 12.0, **gear} for gear in gears]
    shafts = [
        {
            "gears": [name],
            "positions_mm": [30.0],
            "lengths_mm": [60.0],
            "diameters_mm": [200.0],
        }
        for name in ("a", "ring")
    ]
    mesh = {"driver": "a", "driven": "ring", "backlash_um": 50.0}
    load = {"gear": "a", "torques_Nm": [10.0]}
    gear_set = make_gear_set(
        {"name": "s", "gear": gears, "mesh": [mesh], "shaft": shafts, "load": load}
    )
    lines = [line for line in gear_set_warnings(gear_set) if "W71" in line]
    assert len(lines) == 1
    assert 'gear "a"' in lines[0]
