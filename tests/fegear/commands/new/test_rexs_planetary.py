"""Planetary stages of REXS files."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from rexs_files import RexsParts, as_xml, attribute

from fegear.commands.new.rexs import convert_gearbox
from fegear.commands.new.rexs.reading import parse_rexs
from fegear.files.errors import InputError
from fegear.gearset.read import read_gear_set

Edit = Callable[[RexsParts], Any]
DISTANCE = 78.0  # of the public sample of FVA: 17/22/61 teeth, module 4 mm


def planetary_stage(edit: Edit = lambda parts: None, held: str = "ring") -> RexsParts:
    """Sun, three planets and ring with their shafts, as programs write them."""
    parts = RexsParts()
    casing = parts.component("gear_casing", "casing")
    stage = parts.component("planetary_stage", "stage")
    shafts = {
        "sun": parts.shaft("sun shaft", 34.0, attribute("defines_speed", "true")),
        "ring": parts.shaft("ring shaft", 280.0),
        "carrier": parts.shaft("carrier shaft", 80.0),
    }
    coupling = parts.component("switchable_coupling", "brake")
    parts.relate("side", assembly=coupling, inner_part=shafts[held], outer_part=casing)
    for name in ("sun", "ring"):
        parts.relate("central_shaft", planetary_stage=stage, shaft=shafts[name])
    parts.relate("planet_carrier_shaft", planetary_stage=stage, shaft=shafts["carrier"])
    load = parts.component(
        "external_load",
        "motor",
        attribute("torque_around_u_axis", 1591.5, "Nm"),
        attribute("defines_torque", "true"),
    )
    parts.relate("assembly", assembly=shafts["sun"], part=load)
    sun = parts.gear("sun", 17, (0.0, 0.0), shafts["sun"])
    ring = parts.gear("ring", 61, (0.0, 0.0), shafts["ring"], kind="ring_gear")
    cutter = parts.component(
        "cutter_wheel_tool",
        "cutter",
        attribute("number_of_teeth", 23),
        attribute("addendum_coefficient_reference_profile", 1.25),
    )
    parts.relate("ordered_reference", origin=ring, referenced=cutter)
    parts.planets = []
    for n, angle in enumerate((90.0, 210.0, 330.0)):
        place = (
            DISTANCE * math.cos(math.radians(angle)),
            DISTANCE * math.sin(math.radians(angle)),
        )
        shaft = parts.shaft(f"planet shaft @ {angle}", 58.0)
        planet = parts.gear(f"planet @ {angle}", 22, place, shaft)
        parts.planets.append(planet)
        for gears in ((sun, planet), (planet, ring)):
            mesh = parts.component(
                "cylindrical_stage",
                f"mesh {n}",
                attribute("center_distance", DISTANCE, "mm"),
            )
            parts.relate("stage", stage=mesh, gear_1=gears[0], gear_2=gears[1])
            parts.relate("assembly", assembly=stage, part=mesh)
    edit(parts)
    return parts


def converted(parts: RexsParts):
    model = parse_rexs(as_xml(parts.tree()).encode())
    return convert_gearbox(model, "x.rexs", "x")


def test_a_planetary_stage_is_a_planetary_set():
    result = converted(planetary_stage())
    gears = read_gear_set(result.text)
    assert gears.carrier is not None
    teeth = [(gear.name, gear.geometry.teeth) for gear in gears.gears]
    assert teeth == [
        ("sun", 17),
        *((f"planet-{n}", 22) for n in (1, 2, 3)),
        ("ring", 61),
    ]
    distances = [mesh.pair.center_distance for mesh in gears.meshes]
    assert distances == pytest.approx([1e-3 * DISTANCE] * 6)
    assert gears.carrier.torques == pytest.approx((1591.5,))
    sun = gears.gears[0]
    assert sun.geometry.hub_radius == pytest.approx(0.017)
    assert "rim_radius_mm = 140.0" in result.text
    assert 'input = "sun"' in result.text
    assert 'output = "carrier"' in result.text
    assert 'held = "ring"' in result.text
    assert "cutter_teeth = 23" in result.text


@pytest.mark.parametrize(("held", "output"), [("carrier", "ring"), ("ring", "carrier")])
def test_what_is_coupled_with_the_casing_is_held(held, output):
    text = converted(planetary_stage(held=held)).text
    assert f'held = "{held}"' in text
    assert f'output = "{output}"' in text


def test_negative_teeth_are_those_of_a_ring():
    def negative(parts: RexsParts) -> None:
        parts.change("ring", "number_of_teeth", -61)

    one, other = converted(planetary_stage()), converted(planetary_stage(negative))
    assert one.text == other.text


def test_unequal_places_are_positions_of_planets():
    def moved(parts: RexsParts) -> None:
        angle = math.radians(90.0 + 360.0 * 8 / 26)  # of (17 + 61) / 3 = 26 places
        place = [0.0, DISTANCE * math.cos(angle), DISTANCE * math.sin(angle)]
        parts.change("planet @ 210.0", "support_vector", place)

    text = converted(planetary_stage(moved)).text
    gears = read_gear_set(text)
    assert "positions_deg = [0.0, 110.769" in text
    assert len(gears.meshes) == 6


def unequal(parts: RexsParts) -> None:
    parts.change("planet @ 210.0", "number_of_teeth", 21)


def helical(parts: RexsParts) -> None:
    parts.change("sun", "helix_angle_reference_diameter", 12.0)


def one_planet(parts: RexsParts) -> None:
    first = parts.planets[0]
    parts.relations = [
        relation
        for relation in parts.relations
        if relation["type"] != "stage"
        or first in [ref["id"] for ref in relation["refs"]]
    ]


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (unequal, "number_of_teeth of .* differ; equal planets are needed"),
        (helical, "helix_angle_reference_diameter of .* is 12 deg; only spur gears"),
        (one_planet, "1 sun, 1 planets and 1 ring"),
    ],
)
def test_what_is_no_planetary_set_is_refused_with_the_reason(edit, message):
    with pytest.raises(InputError, match=message):
        converted(planetary_stage(edit))


def test_all_reasons_are_listed_where_there_is_no_spur_stage():
    parts = RexsParts()
    for n, angle in enumerate((10.0, 20.0)):
        gears = [
            parts.gear(f"{name}{n}", teeth, (0.0, 0.0), parts.shaft(f"{name}{n}", 30.0))
            for name, teeth in (("a", 20), ("b", 40))
        ]
        parts.change(f"a{n}", "helix_angle_reference_diameter", angle)
        mesh = parts.component("cylindrical_stage", f"mesh {n}")
        parts.relate("stage", stage=mesh, gear_1=gears[0], gear_2=gears[1])
    with pytest.raises(InputError, match=r"must be 10; .*must be 20"):
        converted(parts)
