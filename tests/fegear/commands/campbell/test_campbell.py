"""Campbell diagrams of gear sets: what the study adds to rotors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from drawn_figures import axis_labels, saved_figures

import fegear
from fegear.gearset import load_gear_set
from fegear.gearset.inertia import inertia_of, mass_of
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.train.rotors import rotor_system, transverse_inertia
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem

SETTINGS = {"points": 7, "elements": 3, "modes": 8}
CROSS = (
    "shaft.2.bearing_kxy_N_per_m=[4e7,4e7]",
    "shaft.2.bearing_kyx_N_per_m=[-4e7,-4e7]",
    "shaft.2.bearing_cx_Ns_per_m=[1e3,1e3]",
    "shaft.2.bearing_cy_Ns_per_m=[1e3,1e3]",
)


@pytest.fixture(scope="module")
def result():
    return fegear.run(
        fegear.CampbellDiagram(gear_set="turbo-pair", max_rpm=9000.0, **SETTINGS)
    )


def changed(*edits, **settings):
    study = fegear.CampbellDiagram(
        gear_set=GearSetRef(name="turbo-pair", edits=edits), **SETTINGS | settings
    )
    return fegear.run(study)


def test_shafts_turn_as_their_teeth_impose(result):
    ratios = [shaft["speed_ratio"] for shaft in result.summary["shafts"]]
    assert ratios == [1.0, pytest.approx(-97.0 / 31.0)]
    orders = {line.name: line.order for line in result.orders}
    assert orders == {
        "rotation of wheel": 1.0,
        "rotation of pinion": pytest.approx(97.0 / 31.0),
        "mesh 1": pytest.approx(97.0),
    }


def test_a_critical_speed_is_where_an_order_is_a_frequency(result):
    assert len(result.critical) > 10
    system = rotor_system(load_gear_set("turbo-pair"), [8e8], SETTINGS["elements"])
    problem = WhirlProblem(assemble(system))
    for entry in result.critical:
        hertz = entry.order * entry.driver_speed_rpm / 60.0
        assert entry.frequency_Hz == pytest.approx(hertz, rel=1e-9)
        modes = problem.solve(entry.driver_speed_rpm * math.pi / 30.0)
        distances = np.abs(modes.frequency / (2.0 * math.pi * hertz) - 1.0)
        assert distances.min() < 1e-9


def test_the_table_has_the_modes_of_every_speed(result):
    rows = [
        dict(zip(result.table.names, row, strict=True)) for row in result.table.rows()
    ]
    assert len(rows) == 7 * 8
    assert {row["driver_speed_rpm"] for row in rows} == set(range(0, 9001, 1500))
    first = [row["frequency_Hz"] for row in rows[:8]]
    assert first == [mode["at_rest_Hz"] for mode in result.summary["modes"]]
    assert first == sorted(first)
    assert {row["damping_ratio"] for row in rows} == {0.0}


def test_gears_are_disks_of_their_own_mass_and_inertia():
    gears = load_gear_set("turbo-pair")
    wheel, *_ = rotor_system(gears, [8e8], 2).rotors
    gear = gears.gears[0]
    assert wheel.disks[0].mass == mass_of(gear)
    assert wheel.disks[0].polar_inertia == inertia_of(gear)
    width = gear.face_width
    assert transverse_inertia(gear) == pytest.approx(
        0.5 * inertia_of(gear) + mass_of(gear) * width**2 / 12.0
    )


def test_a_spring_to_ground_holds_the_rotation():
    free, held = (
        changed(*edits, points=2, modes=3)
        for edits in ((), ("gear.1.coupling_stiffness_Nm_per_rad=1e4",))
    )
    inertia = sum(
        ratio**2 * (inertia_of(gear) + added)
        for gear, ratio, added in zip(
            load_gear_set("turbo-pair").gears,
            (1.0, 97.0 / 31.0),
            (0.0, 0.026),
            strict=True,
        )
    )
    lowest = held.curves.frequency_Hz[0, 0]
    assert lowest < 0.5 * free.curves.frequency_Hz[0, 0]
    rigid = math.sqrt(1e4 / inertia) / (2.0 * math.pi)
    assert lowest == pytest.approx(rigid, rel=0.02)  # shafts have little inertia
    assert held.curves.kind(0) == "torsion"


def test_forces_across_the_displacement_make_flutter_with_a_warning(tmp_path):
    unstable = changed(*CROSS, points=3)
    (warning,) = unstable.summary["warnings"]
    assert warning.endswith("[W43]")
    assert "flutter" in warning
    (part,) = unstable.summary["instabilities"]
    assert part["from_rpm"] == 0.0
    assert min(row[3] for row in unstable.table.rows()) < 0.0
    with saved_figures() as figures:
        unstable.draw(tmp_path / "x.png")
    assert "natural frequency [Hz]" in axis_labels(*figures)
    damped = [edit.replace("1e3", "1e5") for edit in CROSS]
    assert changed(*damped, points=3).summary["instabilities"] == []


@pytest.mark.slow
def test_the_error_by_elements_falls_with_their_fourth_power():
    errors = [
        changed(elements=n, points=2, modes=4, max_rpm=3000.0).discretisation
        for n in (6, 24)
    ]
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 30.0  # 256, but short sections are divided unevenly


def test_a_wider_mesh_and_other_bearings_are_heard():
    gears = load_gear_set("turbo-pair")
    narrow = replace(
        gears, gears=tuple(replace(g, face_width=0.02) for g in gears.gears)
    )
    systems = [rotor_system(one, [8e8], 3) for one in (gears, narrow)]
    assert [system.meshes[0].width for system in systems] == [0.057, 0.02]
