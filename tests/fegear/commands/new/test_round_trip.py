"""Gear sets that are written as REXS and read again."""

from __future__ import annotations

import math
import zipfile

import pytest
from rexs_files import RexsWriter, as_json, as_xml, attribute

from fegear import load_gear_set
from fegear.commands.new.rexs import convert_gearbox
from fegear.commands.new.rexs.reading import parse_rexs
from fegear.commands.new.study import gear_set_of_rexs
from fegear.gearset.read import builtin_names, read_gear_set

# planetary sets are not written as REXS
BUILT_IN = [name for name in builtin_names() if load_gear_set(name).carrier is None]


def gear_set_of(text: str):
    model = parse_rexs(text.encode())
    return read_gear_set(convert_gearbox(model, "x.rexs", "x").text)


def assert_same_gears(read, original):
    assert [gear.name for gear in read.gears] == [gear.name for gear in original.gears]
    for gear, expected in zip(read.gears, original.gears, strict=True):
        assert gear.geometry.teeth == expected.geometry.teeth
        for name in (
            *("module", "pressure_angle", "profile_shift", "tip_radius", "dedendum"),
            *("rack_tip_radius", "hub_radius", "tooth_thickness"),
        ):
            value, wanted = (
                getattr(gear.geometry, name),
                getattr(expected.geometry, name),
            )
            assert value == pytest.approx(wanted, rel=1e-12, abs=1e-15), name
        for name in "face_width", "young_modulus", "poisson_ratio", "density":
            wanted = getattr(expected, name)
            assert getattr(gear, name) == pytest.approx(wanted, rel=1e-12), name


def assert_same_meshes(read, original):
    for mesh, expected in zip(read.meshes, original.meshes, strict=True):
        assert mesh.gears == expected.gears
        distance = expected.pair.center_distance
        assert mesh.pair.center_distance == pytest.approx(distance, rel=1e-12)
        assert mesh.torques == pytest.approx(expected.torques, rel=1e-12)
    joined = [s.gears for s in original.shafts if len(s.gears) > 1]
    assert [s.gears for s in read.shafts] == joined


@pytest.mark.parametrize("write", [as_xml, as_json])
@pytest.mark.parametrize("name", BUILT_IN)
def test_a_gear_set_returns(name, write):
    original = load_gear_set(name)
    read = gear_set_of(write(RexsWriter(original).tree()))
    assert_same_gears(read, original)
    assert_same_meshes(read, original)


def test_a_zip_file(tmp_path):
    original = load_gear_set("liu-idler")
    path = tmp_path / "box.rexsz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("picture.png", b"\x89PNG")
        archive.writestr("box.rexs", as_xml(RexsWriter(original).tree()))
    assert_same_gears(read_gear_set(gear_set_of_rexs(path).text), original)


def test_places_of_gears_are_directions_of_meshes():
    """Of a train with two directions; the plane is that across the u axis."""
    original = load_gear_set("liu-idler")
    writer = RexsWriter(original)
    tree = writer.tree()
    angles = [math.radians(30.0), math.radians(140.0)]
    x, y, number = 0.0, 0.0, original.meshes[0].driver
    places = {number: (x, y)}
    for mesh, angle in zip(original.meshes, angles, strict=True):
        distance = 1e3 * mesh.pair.center_distance
        x, y = places[mesh.driver]
        places[mesh.driven] = (
            x + distance * math.cos(angle),
            y + distance * math.sin(angle),
        )
    gears = [c for c in tree["components"] if c["type"] == "cylindrical_gear"]
    for index, gear in enumerate(gears):
        vector = [7.0, *places[index]]
        gear["attributes"].append(attribute("support_vector", vector, "mm"))
    for write in as_xml, as_json:
        read = gear_set_of(write(tree))
        assert [m.center_line for m in read.meshes] == pytest.approx(angles, rel=1e-12)
