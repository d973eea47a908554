"""At which end torque enters gears, and how rigid their bodies are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from yielding_machines import one_stage, tables_of_two_stages, two_stages

from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.torsion import torque_ends, torsional_flexibility


def ends_of(gear_set):
    return {gear_set.gears[one.gear].name: one.end for one in torque_ends(gear_set)}


def test_torque_passes_between_the_gears_of_a_shaft():
    """From outside it comes at the end that the file names, if it does."""
    assert ends_of(two_stages()) == {"a": None, "b": "end", "c": "start", "d": None}
    tables = tables_of_two_stages()
    tables["shaft"][1]["positions_mm"].reverse()
    tables["shaft"][0]["driven_from"] = "start"
    tables["shaft"][2]["driven_from"] = "end"
    expected = {"a": "start", "b": "start", "c": "end", "d": "end"}
    assert ends_of(make_gear_set(tables)) == expected
    tables["shaft"][1]["positions_mm"] = [60.0, 60.0]
    ends = {one.gear: one for one in torque_ends(make_gear_set(tables))}
    assert ends[1].end is None
    assert "no known way" in ends[1].reason


def idler():
    """Three gears in a row, of which that in the middle is in two meshes."""
    tables = tables_of_two_stages()
    del tables["gear"][2]
    tables["gear"][2]["hand"] = "right"
    tables["mesh"][1]["driver"] = "b"
    tables["shaft"] = [
        tables["shaft"][0] | {"gears": [name], "positions_mm": [45.0]} for name in "abd"
    ]
    return tables


def test_an_idler_does_not_twist():
    ends = {one.gear: one for one in torque_ends(make_gear_set(idler()))}
    assert ends[1].end is None
    assert "in several meshes" in ends[1].reason


@pytest.mark.parametrize(
    ("tables", "meshes"), [(tables_of_two_stages(), 2), (idler(), 2)]
)
def test_torque_from_outside_is_refused_amid_meshes(tables, meshes):
    tables["shaft"][1]["driven_from"] = "start"
    with pytest.raises(InputError, match=f"shaft 2: driven_from .* in {meshes} meshes"):
        make_gear_set(tables)


def test_internal_gears_do_not_twist():
    tables = tables_of_two_stages()
    ring = {"name": "b", "teeth": 57, "internal": True, "rim_radius_mm": 70.0}
    tables["gear"][1:] = [ring]
    del tables["mesh"][1], tables["shaft"][2], tables["mesh"][0]["backlash_um"]
    tables["shaft"][1] |= {"gears": ["b"], "positions_mm": [45.0]}
    tables["shaft"][1]["driven_from"] = "start"
    ends = {one.gear: one for one in torque_ends(make_gear_set(tables))}
    assert ends[1].end is None
    assert "internal" in ends[1].reason


@pytest.mark.parametrize("end", ["start", "end"])
def test_bodies_are_solid_from_the_bore_to_the_root_circle(end):
    """With a step of the shaft below the gear, and another material around it."""
    tables = tables_of_two_stages()
    tables["gear"][0] |= {"young_modulus_GPa": 110.0, "poisson_ratio": 0.25}
    tables["shaft"][0] |= {
        "lengths_mm": [42.0, 108.0],
        "diameters_mm": [25.0, 20.0],
        "bores_mm": [0.0, 8.0],
        "positions_mm": [45.0],
        "driven_from": end,
    }
    gear_set = make_gear_set(tables)
    places, flexibility = torsional_flexibility(gear_set, 0)
    root = gear_set.gears[0].geometry.root_radius
    rigidities = [
        110e9 / 2.5 * math.pi / 2.0 * (root**4 - outer**4)
        + 206e9 / 2.6 * math.pi / 2.0 * (outer**4 - bore**4)
        for outer, bore in ((12.5e-3, 0.0), (10e-3, 4e-3))
    ]
    expected = np.array([5e-3, 11e-3]) / rigidities
    assert places == pytest.approx([-8e-3, -3e-3, 8e-3])
    assert np.abs(np.diff(flexibility)) == pytest.approx(expected, rel=1e-12)
    held = 0 if end == "start" else -1
    assert flexibility[held] == 0.0
    assert flexibility.min() == 0.0


def test_torsion_is_left_out_where_the_end_is_unknown():
    gear_set = one_stage()
    for gear in range(2):
        assert torsional_flexibility(gear_set, gear) is None
    assert [one.end for one in torque_ends(gear_set)] == [None, None]
