"""Closed forms beside the finite elements follow what the gears are made of."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fegear.gearset import load_gear_set
from fegear.statics.solving import StaticsSettings
from validation.study.compare import compare_mesh

COARSE = StaticsSettings(
    positions=16, resolution="coarse", estimate_error=False, corner_contact=False
)


def expected(gear_set, torque=100.0):
    rows = compare_mesh(gear_set, 0, torque, COARSE).rows
    return {(row.quantity, row.oracle): row.expected for row in rows}


def with_gears(gear_set, **changes):
    return replace(
        gear_set, gears=tuple(replace(gear, **changes) for gear in gear_set.gears)
    )


def test_every_stiffness_and_pressure_follows_the_material():
    steel = load_gear_set("liu-pair")
    plastic = with_gears(steel, young_modulus=3e9)
    hard, soft = expected(steel), expected(plastic, 100.0 * 3.0 / 206.0)
    for key, value in soft.items():
        if "over mean" in key[0] or "/ mean" in key[0]:
            assert value == pytest.approx(hard[key], rel=1e-9)
        elif "ISO" not in key[1]:  # which counts low loads besides
            assert value == pytest.approx(3.0 / 206.0 * hard[key], rel=1e-9), key


def test_iso_follows_material_rack_and_low_load():
    steel = load_gear_set("liu-pair")
    iso = ("mean mesh stiffness", "ISO 6336 c_gamma")
    base = expected(steel, 200.0)[iso]
    plastic = with_gears(steel, young_modulus=3e9)
    assert expected(plastic, 200.0)[iso] == pytest.approx(3.0 / 206.0 * base)
    pinion = steel.gears[0]
    specific = 10.0 / pinion.geometry.reference_radius / pinion.face_width
    low = (specific / 100e3) ** 0.25  # below 100 N/mm
    assert expected(steel, 10.0)[iso] == pytest.approx(base * low)
    deeper = with_gears(
        steel, geometry=replace(steel.gears[0].geometry, dedendum=1.3 * 2.54e-3)
    )
    mixed = replace(steel, gears=(deeper.gears[0], steel.gears[1]))
    mean_factor = (0.95 + 0.975) / 2.0
    assert expected(mixed, 200.0)[iso] == pytest.approx(base * mean_factor / 0.975)


def test_the_smaller_gear_is_the_pinion_whoever_drives():
    pair = load_gear_set("liu-pair")
    mesh = pair.meshes[0]
    back = replace(mesh, driver=1, driven=0, pair=mesh.pair.swapped)
    iso = ("mean mesh stiffness", "ISO 6336 c_gamma")
    swapped = expected(replace(pair, meshes=(back,)), 100.0 * 55 / 38)[iso]
    assert swapped == pytest.approx(expected(pair)[iso], rel=1e-9)
