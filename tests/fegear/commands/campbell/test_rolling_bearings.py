"""Spinning shafts on rolling bearings that are linearised at rest."""

from __future__ import annotations

import numpy as np
import pytest
from rolling_machines import FLOATING, PRELOADED, TORQUE, machine_tables

import fegear
from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set
from fegear.gearset.tooth_forces import loads_on_gears
from fegear.gearset.yielding import on_shafts
from fegear.statics.machine import machine_at_rest
from fegear.train.rolling_bearings import bearings_at_rest

SHORT = {"points": 3, "elements": 3, "modes": 10}
ELEMENTS = fegear.StaticsSettings(resolution="coarse")


def tables_of(bearings=(PRELOADED, FLOATING), stiffness=2e8, **changes):
    tables = machine_tables(bearings, **changes)
    tables["mesh"][0]["mean_stiffness_N_per_m"] = stiffness
    return tables


def mirrored(tables):
    """The machine in a mirror across its axes; its driver turns as it did."""
    shafts = [
        shaft
        | {
            "positions_mm": [150.0 - place for place in shaft["positions_mm"]],
            "rolling_bearings": [
                bearing | {"contact_angle_deg": -bearing.get("contact_angle_deg", 0.0)}
                for bearing in reversed(shaft["rolling_bearings"])
            ],
        }
        for shaft in tables["shaft"]
    ]
    gears = [dict(gear) for gear in tables["gear"]]
    gears[0]["hand"] = "left"
    return tables | {"shaft": shafts, "gear": gears}


@pytest.fixture
def campbell(tmp_path):
    def run(tables, **changes):
        path = tmp_path / "machine.toml"
        path.write_text(toml_text(tables))
        study = fegear.CampbellDiagram(gear_set=str(path), **(SHORT | changes))
        return fegear.run(study)

    return run


def frequencies(result):
    return result.curves.frequency_Hz


def test_a_mirrored_machine_has_the_same_frequencies(campbell):
    tables = tables_of()
    one, other = campbell(tables), campbell(mirrored(tables))
    assert one.motion == other.motion == "space"
    assert frequencies(other) == pytest.approx(frequencies(one), rel=1e-10)


def test_frequencies_rise_with_the_torque(campbell):
    light, heavy = (
        campbell(tables_of(bearings=(FLOATING, FLOATING)), torque=torque)
        for torque in (5.0, 100.0)
    )
    assert frequencies(heavy)[0, 0] > 1.05 * frequencies(light)[0, 0]
    assert (light.torque, heavy.torque) == (5.0, 100.0)


def test_loads_by_angles_are_near_those_of_solved_teeth():
    gear_set = read_gear_set(toml_text(tables_of()))
    machine = machine_at_rest(on_shafts(gear_set), TORQUE, ELEMENTS)
    solved, stated = machine.loads_on_gears, loads_on_gears(gear_set, TORQUE)
    assert stated[:, :3] == pytest.approx(solved[:, :3], rel=1e-3)
    # solved loads are not in the middle of the face width
    force, width = np.linalg.norm(solved[0, :3]), gear_set.gears[0].face_width
    assert np.abs(stated[:, 3:] - solved[:, 3:]).max() < 0.2 * force * width
    bearings = bearings_at_rest(gear_set, TORQUE, solved)
    for index, (statics, _) in machine.axes.shafts.items():
        for one, other in zip(bearings[index], statics.rotor.bearings, strict=True):
            scale = np.abs(other.linearised.stiffness).max()
            change = one.linearised.stiffness - other.linearised.stiffness
            assert np.abs(change).max() < 1e-6 * scale


def test_stiffnesses_and_their_torque_are_in_results(campbell):
    result = campbell(tables_of())
    entries = result.summary["rolling_bearings"]
    assert [entry["position_mm"] for entry in entries] == [5.0, 145.0, 5.0, 145.0]
    assert entries[-1]["axial_N_per_m"] == 0.0
    at = "linearised at 30.000 N m on the input gear, forces of teeth in the middle"
    assert at in result.table.header["rolling bearings"]
    assert any("rolling bearings, linearised at" in str(p) for p in result.page())
    linear = {"bearing_kx_N_per_m": [1e8, 1e8], "bearing_ky_N_per_m": [1e8, 1e8]}
    tables = tables_of()
    for shaft in tables["shaft"]:
        del shaft["rolling_bearings"]
        shaft |= linear
    assert campbell(tables).summary["rolling_bearings"] == []


def test_teeth_that_are_solved_load_the_bearings(campbell):
    excitation = fegear.ExcitationSettings(resolution="coarse")
    settings = {"stiffness": "fe", "excitation": excitation}
    result = campbell(tables_of(), **settings)
    assert "loads of teeth in contact" in result.table.header["rolling bearings"]
    assert (result.response.radial_force[1:] > 0.0).all()
    # rollers float
    assert not result.response.bearing_force[:, 3, 2].any()


def test_thrust_that_no_bearing_takes_is_left_out_with_the_helix(campbell):
    rollers = [FLOATING[1]] * 2
    result = campbell(tables_of(bearings=(rollers, rollers)))
    assert result.motion == "plane"
    with pytest.raises(fegear.InputError, match="roller bearings only"):
        campbell(tables_of(bearings=(rollers, rollers)), motion="space")


def test_thrust_in_the_wrong_sense_is_refused(campbell):
    refused = []
    for preloaded in PRELOADED:
        try:
            campbell(tables_of(bearings=([preloaded, FLOATING[1]], FLOATING)))
        except fegear.InputError as error:
            refused.append(str(error))
    (message,) = refused
    assert "must be 0 without a ball bearing that takes it" in message
