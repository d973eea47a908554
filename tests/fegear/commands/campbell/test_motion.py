"""Campbell diagrams of helical gears, whose shafts move along their axes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_sets import BENT

import fegear
from fegear.contact.width.supports import unit_wrenches
from fegear.files.errors import InputError
from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.edit import edited
from fegear.gearset.read import make_gear_set
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.train.rotors import rotor_system
from lumped.rotors.matrices import assemble
from lumped.rotors.mesh_springs import mesh_rows
from lumped.rotors.whirl import WhirlProblem
from meshes.profile import arc_from_tip

SETTINGS = {"points": 4, "elements": 3, "modes": 8, "max_rpm": 9000.0}
HELICAL = ("defaults.helix_angle_deg=15", "mesh.1.center_distance_mm=198.773")
THRUST = tuple(f"shaft.{i}.bearing_kz_N_per_m=[1e8,0]" for i in (1, 2))
RING = {
    "gear": [
        BENT["gear"][0],
        {"name": "b", "teeth": 71, "internal": True, "rim_radius_mm": 85.0},
    ],
    "mesh": [{"driver": "a", "driven": "b", "mean_stiffness_N_per_m": 1e8}],
    "defaults": BENT["defaults"] | {"profile_shift": 0.0},
}
# ring and pinion change places
DRIVING_RING = RING | {
    "mesh": [{"driver": "b", "driven": "a", "mean_stiffness_N_per_m": 1e8}],
    "load": {"gear": "b", "torques_Nm": [20.0]},
}


def diagram(*edits, **settings):
    study = fegear.CampbellDiagram(
        gear_set=GearSetRef(name="turbo-pair", edits=edits), **SETTINGS | settings
    )
    return fegear.run(study)


@pytest.fixture(scope="module")
def in_space():
    return diagram(*HELICAL, *THRUST)


def helical_bent(hand="right", changes=None):
    tables = BENT | (changes or {})
    first = tables["mesh"][0]["driver"] == "a"
    edits = {"defaults.helix_angle_deg": 20.0}
    edits[f"gear.{1 if first else 2}.hand"] = hand
    return make_gear_set(edited(tables, edits))


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize(
    "changes", [{}, RING, DRIVING_RING], ids=["external", "ring", "driving ring"]
)
def test_teeth_push_gears_along_the_axis_as_at_rest(hand, changes):
    """The thrust per torque of a driver that advances against its driven gear."""
    gear_set = helical_bent(hand, changes)
    rotors = rotor_system(gear_set, [8e8], 3)
    assert rotors.axial_motion
    system, (mesh,) = assemble(rotors), rotors.meshes
    rotation, z = (
        system.index(mesh.rotors[0], mesh.positions[0], kind)
        for kind in ("rotation", "z")
    )
    sense = gear_set.senses[gear_set.meshes[0].driver]
    advanced = np.zeros(system.size)
    advanced[rotation] = sense * 1e-6
    forces = -system.mesh_stiffness[0] @ advanced
    torque = -sense * forces[rotation]
    assert torque > 0.0
    on_driver = axial_force_on_driver(gear_set, 0, 1.0)
    radius = abs(gear_set.meshes[0].pair.driver.reference_radius)
    assert abs(on_driver) == pytest.approx(math.tan(math.radians(20.0)) / radius)
    assert forces[z] / torque == pytest.approx(on_driver, rel=1e-12)
    other = system.index(mesh.rotors[1], mesh.positions[1], "z")
    assert forces[other] == pytest.approx(-forces[z], rel=1e-12)


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize(
    "changes", [{}, RING, DRIVING_RING], ids=["external", "ring", "driving ring"]
)
def test_a_mesh_loads_its_axes_as_the_contact_at_rest_does(hand, changes):
    """Forces and moments along push, normal and axis of `unit_wrenches`."""
    gear_set = helical_bent(hand, changes)
    rotors = rotor_system(gear_set, [8e8], 3)
    system, (mesh,) = assemble(rotors), rotors.meshes
    row, slope = mesh_rows(system, mesh)
    pair, helix = gear_set.meshes[0].pair, mesh.base_helix_angle
    rolls = mesh.middle_roll_lengths
    arcs = np.array(
        [
            [
                arc_from_tip(gear, roll)
                for gear, roll in zip((pair.driver, pair.driven), rolls, strict=True)
            ]
        ]
    )
    push = np.array(mesh.direction)
    normal = mesh.sense * np.array([push[1], -push[0]])
    for place in (0.0, 0.004):
        places = np.array([place])
        loads = unit_wrenches((pair.driver, pair.driven), helix, arcs, (places, places))
        at_place = row + place * slope
        for gear, (load,) in enumerate(loads):
            kinds = ("x", "y", "z", "tilt x", "tilt y")
            x, y, z, tilt_x, tilt_y = (
                at_place[system.index(mesh.rotors[gear], mesh.positions[gear], kind)]
                for kind in kinds
            )
            force, moment = np.array([x, y]), np.array([tilt_y, -tilt_x])
            parts = push @ force, normal @ force, z, push @ moment, normal @ moment
            # a row is the approach by displacements, against the force
            expected = -load / math.cos(helix)
            np.testing.assert_allclose(parts, expected, rtol=1e-9, atol=1e-12)


def test_helical_gears_on_bearings_that_take_thrust_move_in_space(in_space):
    summary = in_space.summary
    assert summary["motion"] == "space"
    assert not [line for line in summary["warnings"] if line.endswith("[W59]")]
    kinds = [mode["kind"] for mode in summary["modes"]]
    assert "axial" in kinds
    for mode in summary["modes"]:
        assert 0.0 <= mode["axial_fraction"] <= 1.0
        assert (mode["axial_fraction"] > 0.5) <= (mode["kind"] == "axial")
    rows = [
        dict(zip(in_space.table.names, row, strict=True))
        for row in in_space.table.rows()
    ]
    for row in rows:
        assert row["axial_fraction"] + row["torsion_fraction"] <= 1.0 + 1e-12
    assert max(row["axial_fraction"] for row in rows) > 0.5
    assert "axial" in {entry.kind for entry in in_space.critical}
    # of rods, whose error falls with the square, and still small
    assert in_space.discretisation < 2e-3


@pytest.mark.parametrize("settings", [{}, {"motion": "plane"}])
def test_the_plane_leaves_out_the_helix_and_says_so(settings):
    thrust = THRUST if settings else ()
    plane = diagram(*HELICAL, *thrust, **settings)
    assert plane.summary["motion"] == "plane"
    lines = [line for line in plane.page() if isinstance(line, str)]
    (line,) = [line for line in lines if "helix" in line]
    assert "are left out" in line
    assert {mode["axial_fraction"] for mode in plane.summary["modes"]} == {0.0}
    gear_set = GearSetRef(name="turbo-pair", edits=HELICAL).loaded
    (mesh,) = rotor_system(gear_set, [8e8], 3, "plane").meshes
    assert (mesh.base_helix_angle, mesh.path) == (0.0, None)


def test_spur_gears_in_space_have_modes_along_the_axis_besides(in_space):
    """All others are those of the plane; pages of the plane have no line on a helix."""
    plane, space = (
        diagram(*THRUST, motion=motion, modes=10, points=2)
        for motion in (None, "space")
    )
    assert plane.summary["motion"] == "plane"
    assert not [line for line in plane.page() if "helix" in str(line)]
    axial = space.curves.axial[0] > 0.5
    assert np.isin(space.curves.axial[0].round(9), [0.0, 1.0]).all()
    others = space.curves.frequency_Hz[0, ~axial]
    np.testing.assert_allclose(
        others, plane.curves.frequency_Hz[0, : others.size], rtol=1e-9
    )
    assert 1 <= axial.sum() <= 2


@pytest.mark.parametrize(
    ("edits", "state"),
    [((), "is missing"), (("shaft.1.bearing_kz_N_per_m=[0,0]",), "is 0 at all")],
)
def test_space_needs_a_bearing_that_takes_thrust(edits, state):
    with pytest.raises(InputError, match=f"shaft 1: bearing_kz_N_per_m {state}.*plane"):
        diagram(*HELICAL, *edits, motion="space")


def test_a_thrust_bearing_has_its_share_in_frequencies(in_space):
    """Both rigid shafts, amid other motion, lie on their bearings along the axis."""
    stiff = [edit.replace("1e8", "4e8") for edit in THRUST]
    stiffer = diagram(*HELICAL, *stiff, points=2)
    first = in_space.curves.frequency_Hz[0, 0]
    gear_set = GearSetRef(name="turbo-pair", edits=(*HELICAL, *THRUST)).loaded
    system = assemble(rotor_system(gear_set, [8e8], 3))
    assert WhirlProblem(system).solve(0.0, 1).frequency[0] == pytest.approx(
        2.0 * math.pi * first, rel=1e-12
    )
    assert stiffer.curves.frequency_Hz[0, 0] > 1.2 * first
