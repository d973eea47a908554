"""Figures of a gear set changed by name."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fegear.files.errors import InputError
from fegear.files.printable import printable
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.edit import edited, parsed_value
from fegear.gearset.read import load_tables


def test_originals_stay():
    tables = {"mesh": [{"phase": 0.1}]}
    assert edited(tables, {"mesh.1.phase": 0.2})["mesh"][0]["phase"] == 0.2
    assert tables["mesh"][0]["phase"] == 0.1


def test_gears_by_name_and_by_number():
    one = load_gear_set("liu-idler", {"gear.idler.mass_kg": 3.0})
    two = load_gear_set("liu-idler", {"gear.2.mass_kg": 3.0})
    assert one.gears[1].mass == two.gears[1].mass == 3.0


def test_new_relief_begins_at_single_contact():
    mesh = load_gear_set("liu-idler", {"mesh.2.tip_relief.magnitude_um": 12}).meshes[1]
    pair, relief = mesh.pair, mesh.driver_flank.tip_relief
    assert relief.magnitude == pytest.approx(12e-6)
    assert relief.start_roll_length == pytest.approx(pair.path_start + pair.base_pitch)


def test_relief_of_nothing_goes_away():
    edits = {"mesh.1.tip_relief.magnitude_um": 0, "mesh.1.tip_relief.start": "HPSTC"}
    assert load_gear_set("liu-idler", edits) == load_gear_set("liu-idler")


def test_one_way_of_saying_it_replaces_the_other():
    edits = {
        "mesh.1.tip_relief.magnitude_um": 10,
        "mesh.1.tip_relief.start": "HPSTC",
        "mesh.1.tip_relief.length_pitches": 0.3,
        "mesh.1.center_distance_mm": 119.0,
    }
    mesh = load_gear_set("liu-idler", edits).meshes[0]
    pair = mesh.pair
    length = (
        pair.driver.tip_roll_length - mesh.driver_flank.tip_relief.start_roll_length
    )
    assert length == pytest.approx(0.3 * pair.base_pitch)
    assert pair.center_distance == pytest.approx(0.119)


def test_tables_are_made_where_missing():
    gear_set = load_gear_set("liu-idler", {"dynamics.damping_ratio": 0.02})
    assert gear_set.damping_ratio == 0.02


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("phase", "must name a table"),
        ("mesh.phase", "which mesh"),
        ("mesh.3.phase", "no mesh 3"),
        ("gear.pin.teeth", "known: pinion, idler, follower"),
        ("mesh.1.phase.phase", "must be a number"),
        ("mesh.1.driver.phase", "driver is a value"),
        ("mesh.1.driver.deep", "unknown key deep"),
        ("mesh.1.fase", "did you mean phase"),
    ],
)
def test_names_that_lead_nowhere(name, message):
    with pytest.raises(InputError, match=message):
        load_gear_set("liu-idler", {name: 1.0})


def test_values_are_read_as_toml():
    assert parsed_value("3") == 3
    assert parsed_value("HPSTC") == "HPSTC"
    assert parsed_value("[1, 2]") == [1, 2]
    assert math.isinf(parsed_value("inf"))


@pytest.mark.parametrize("masked", [np.ma.masked, np.ma.array(3.0, mask=True)])
def test_a_masked_number_is_none(masked):
    with pytest.raises(InputError, match=r"gear\.1\.profile_shift = masked; must be a"):
        load_gear_set("liu-pair", {"gear.1.profile_shift": masked})
    with pytest.raises(InputError, match=r"load\.torques_Nm entry 2 = masked; must be"):
        load_gear_set("liu-pair", {"load.torques_Nm": [1.0, masked]})
    tables = load_tables("liu-pair", {})
    tables["mesh"][0]["phase"] = masked
    with pytest.raises(
        InputError, match=r"mesh entry 1\.phase = masked; must be a num"
    ):
        make_gear_set(tables)


def test_a_number_of_a_masked_array_that_is_there_is_taken():
    edits = {"gear.1.mass_kg": np.ma.array(3.0, mask=False)}
    assert load_gear_set("liu-pair", edits).gears[0].mass == 3.0


def test_control_characters_are_spelled_out_in_errors():
    for name in ("a\x1b[31m.toml", "a\x00b.toml", "\x1b", "\u202eb"):
        with pytest.raises(InputError) as refused:
            load_gear_set(name)
        assert printable(str(refused.value)) == str(refused.value)
