"""Shafts under tooth forces: balance, symmetry, and where misalignments come from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from small_sets import PAIR

import fegear
from fegear.commands.shafts.loads import (
    bending_stress,
    loaded_shafts,
    meshes_on_shafts,
    tooth_torques,
)
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset import load_gear_set
from fegear.gearset.axial_forces import shaft_axial_force
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.read import read_gear_set
from fegear.gearset.tooth_forces import tooth_forces
from fegear.gearset.yielding import on_shafts
from fegear.statics.axes import require_thrust_on_bearings
from fegear.statics.machine import machine_at_rest
from fegear.statics.settings import StaticsSettings
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.rotors.description import Bearing, Rotor, Section
from lumped.rotors.statics import ShaftLoad, shaft_statics

SET = "helical-machine"
COARSE = StaticsSettings(resolution="coarse")
ON_PATH = replace(COARSE, corner_contact=False, root_stress=False)
STIFFNESS = {"bearing_kx_N_per_m": [1e8, 1e8], "bearing_ky_N_per_m": [1e8, 1e8]}
MIDDLE = PAIR | {
    "shaft": [
        {
            "gears": [name],
            "positions_mm": [40.0],
            "lengths_mm": [80.0],
            "diameters_mm": [14.0],
            "bearing_positions_mm": [0.0, 80.0],
            **STIFFNESS,
        }
        for name in ("a", "b")
    ]
}


def shafts_of(gear_set, **settings):
    study = fegear.LoadedShafts(gear_set=gear_set, elements=COARSE, **settings)
    return fegear.run(study)


@pytest.fixture(scope="module")
def result():
    return shafts_of(SET)


@pytest.fixture(scope="module")
def machine():
    """The same machine, without contact of tip corners."""
    return machine_at_rest(on_shafts(load_gear_set(SET)), 40.0, ON_PATH)


def test_the_picture_has_a_panel_for_every_shaft_and_mesh(result):
    """Without parts of figures, which pages for browsers do not have."""
    figure = result.figures["plot"]()
    assert not figure.subfigs
    titles = [axes.get_title() for axes in figure.axes]
    assert [title.partition(":")[0] for title in titles if "shaft" in title] == [
        f"shaft {number}" for number in (1, 2, 3)
    ]
    assert sum(title.startswith("mesh ") for title in titles) == 2
    assert len(figure.axes) == 8


def test_a_lead_is_stated_in_place_of_those_that_there_are(result):
    """Also beside a misalignment of the gear set, which it takes away as well."""
    lead = GearSetRef(name=SET, edits=("mesh.1.driver_lead.slope_um=-1",))
    misaligned = GearSetRef(name=SET, edits=("mesh.1.misalignment_um=-3",))
    nominal = result.meshes[0].away
    assert shafts_of(lead).meshes[0].away == pytest.approx(nominal, rel=1e-6)
    moved = [slope + 3e-6 for slope in nominal]
    assert shafts_of(misaligned).meshes[0].away == pytest.approx(moved, abs=5e-8)


def test_shafts_that_are_too_thin_are_warned_of(result):
    thin = GearSetRef(name=SET, edits=("shaft.1.diameters_mm=[4]",))
    texts = [w for w in shafts_of(thin).summary["warnings"] if "[W69]" in w]
    assert {text.partition(":")[0] for text in texts} == {"shaft of pinion-1"}
    assert "tilts by" in texts[0]
    assert not [w for w in result.summary["warnings"] if "[W69]" in w]


def test_reactions_balance_the_forces(result):
    for shaft in result.shafts:
        assert shaft.imbalance < 1e-12


def test_loads_on_gears_are_tooth_forces(machine):
    gears = machine.gear_set
    expected = np.zeros((len(gears.gears), 3))
    for force in tooth_forces(gears):
        expected[force.gear] += force.vectors[0]
    scale = np.abs(expected).max()
    assert np.abs(machine.loads_on_gears[:, :3] - expected).max() < 1e-9 * scale


def test_torques_of_teeth_add_to_those_of_the_ends():
    gears = load_gear_set(SET)
    torques = tooth_torques(gears, 40.0)
    assert torques[0] == pytest.approx(-40.0)
    assert torques[1] == pytest.approx(-torques[2])
    assert torques[3] == pytest.approx(40.0 * 47 / 23 * 50 / 21)


def test_reactions_of_two_bearings_by_levers(result):
    """Those of a lever about the first bearing, with the tooth forces on the gear."""
    settings = replace(COARSE, root_stress=False)
    machine = machine_at_rest(on_shafts(load_gear_set(SET)), result.torque, settings)
    for shaft, gears in zip(result.shafts, ([0], [1, 2], [3]), strict=True):
        first, second = shaft.bearing_positions
        levers = np.array(shaft.gear_positions) - first
        loads = machine.loads_on_gears[gears]
        turning = levers @ loads[:, :2] + loads[:, 3:].sum(axis=0)
        expected = -turning / (second - first)
        scale = np.abs(loads[:, :2]).max()
        deviation = shaft.solution.reactions[1, :2] - expected
        assert np.abs(deviation).max() < 1e-8 * scale
        axial = shaft.solution.reactions[:, 2].sum()
        assert axial == pytest.approx(-loads[:, 2].sum(), abs=1e-9 * scale)


def test_parts_of_a_misalignment_add_up(result):
    for mesh in result.meshes:
        parts = sum(mesh.by_shafts) + sum(mesh.by_bearings) + sum(mesh.by_torsion)
        assert parts == pytest.approx(mesh.misalignment, rel=1e-9)
        # the load goes away from the end with the gap
        assert mesh.center * mesh.misalignment < 0.0


def test_torsion_opens_the_end_away_from_the_torque(result):
    """By the twist at the centre of the load.

    The torque leaves wheel-1 at its far end and enters pinion-2 at its near end.
    """
    gears = load_gear_set(SET)
    torques = tooth_torques(gears, result.torque)
    for mesh, role, sign in ((0, 1, -1.0), (1, 0, 1.0)):
        index = gears.meshes[mesh].gears[role]
        gear = gears.gears[index]
        rigidity = 206e9 / 2.6 * math.pi / 2.0 * gear.geometry.root_radius**4
        distance = 0.5 * gear.face_width + sign * result.meshes[mesh].center
        opened = gear.geometry.base_radius * abs(torques[index]) * distance / rigidity
        part = result.meshes[mesh].by_torsion
        assert part[role] == pytest.approx(sign * opened, rel=1e-3)
        assert part[1 - role] == 0.0
    page = "".join(line for line in result.page() if isinstance(line, str))
    assert "pinion-1, wheel-2 (left out, without driven_from)" in page
    assert "wheel-1 (torque at the end); pinion-2 (torque at the start)" in page


@pytest.mark.parametrize(("end", "before"), [("start", 40.0), ("end", 0.0)])
def test_torque_of_a_shaft_begins_where_it_enters(end, before):
    edit = GearSetRef(name=SET, edits=(f"shaft.1.driven_from={end}",))
    solution = shafts_of(edit).shafts[0].solution
    gear = int(np.argmin(np.abs(solution.position - 0.03)))
    torque = np.abs(solution.torque)
    assert torque[1:gear].ravel() == pytest.approx(before)
    assert torque[gear + 1 : -1].ravel() == pytest.approx(40.0 - before, abs=1e-9)


def test_bearings_tilt_a_rigid_shaft_by_their_own_displacements(result, machine):
    """Displacement of a bearing is its force over its stiffness."""
    gears = machine.gear_set
    shafts = {0: (0, -1.0, 0), 1: (0, 1.0, 1), 2: (1, -1.0, 1), 3: (1, 1.0, 2)}
    for gear, (number, sign, index) in shafts.items():
        mesh, shaft = result.meshes[number], result.shafts[index]
        bearings = gears.shafts[index].body.bearings
        moved = np.array(
            [
                -force[:2] / bearing.stiffness[0]
                for force, bearing in zip(
                    shaft.solution.reactions, bearings, strict=True
                )
            ]
        )
        slope = (moved[1] - moved[0]) / np.ptp(shaft.bearing_positions)
        push = machine.axes.frames[number][0, :2]
        role = gears.meshes[number].gears.index(gear)
        expected = sign * mesh.width * float(slope @ push)
        assert mesh.by_bearings[role] == pytest.approx(expected, rel=1e-6)


def test_thrust_is_that_of_show_but_for_contact_of_tip_corners(result, machine):
    """Forces of tip corners have shorter arms about the axis."""
    thrusts = [-shaft_axial_force(machine.gear_set, gear, 40.0) for gear in (0, 1, 3)]
    on_path, with_corners = np.zeros(3), np.zeros(3)
    for index, shaft in enumerate(loaded_shafts(machine)):
        on_path[index] = shaft.solution.reactions[:, 2].sum()
    for index, shaft in enumerate(result.shafts):
        with_corners[index] = shaft.solution.reactions[:, 2].sum()
    assert on_path == pytest.approx(thrusts, rel=1e-9)
    excess = with_corners / thrusts - 1.0
    assert (excess > 1e-5).all()
    assert (excess < 1e-3).all()


def test_gears_amid_equal_bearings_stay_parallel():
    """Tip corners left out, whose arms differ: axes that move share loads otherwise."""
    gears = on_shafts(read_gear_set(toml_text(MIDDLE)))
    (mesh,) = meshes_on_shafts(machine_at_rest(gears, 20.0, ON_PATH))
    assert mesh.factor == pytest.approx(mesh.held_factor, rel=1e-6)
    assert abs(mesh.misalignment) < 1e-12
    assert abs(mesh.center) < 1e-9


@pytest.mark.parametrize("roles", [("driver", "driven"), ("driven", "driver")])
def test_opposite_lead_slopes_take_the_misalignments_away(roles):
    """The loads are then those of axes that are held, in both meshes.

    On a shaft as soft as this the load that moves to the middle tilts axes further.
    """
    soft = "shaft.2.diameters_mm=[12]"
    meshes = shafts_of(GearSetRef(name=SET, edits=(soft,))).meshes
    slopes = [
        f"mesh.{mesh.number}.{role}_lead.slope_um="
        f"{1e6 * mesh.away[('driver', 'driven').index(role)]!r}"
        for mesh, role in zip(meshes, roles, strict=True)
    ]
    mended = shafts_of(GearSetRef(name=SET, edits=(soft, *slopes))).meshes
    for before, after in zip(meshes, mended, strict=True):
        assert before.factor > 1.5 * before.held_factor
        assert after.factor == pytest.approx(before.held_factor, rel=0.05)
        assert after.misalignment == pytest.approx(before.to_mend, rel=0.02)


def test_bending_stress_is_that_of_round_sections():
    """Of both sides of a step, a solid and a hollow one, with a load amid bearings."""
    hollow, solid = (0.03, 0.02), (0.02, 0.0)
    rotor = Rotor(
        name="stepped",
        sections=tuple(
            Section(length=0.1, diameter=diameter, bore=bore)
            for diameter, bore in (hollow, solid)
        ),
        bearings=tuple(
            Bearing(position=position, stiffness=(1e8, 0.0, 0.0, 1e8))
            for position in (0.0, 0.2)
        ),
        young_modulus=206e9,
        shear_modulus=80e9,
        density=7850.0,
    )
    statics = shaft_statics(rotor, [0.1], 4)
    load = ShaftLoad(position=0.1, force=(300.0, -400.0, 0.0))
    stress = bending_stress(statics, statics.solve([load]))
    moment = 500.0 * 0.2 / 4.0
    middle = statics.nodes.index(0.1)
    for side, (diameter, bore) in enumerate((hollow, solid)):
        modulus = math.pi / 32.0 * diameter**3 * (1.0 - (bore / diameter) ** 4)
        assert stress[middle, side] == pytest.approx(moment / modulus, rel=1e-9)
    assert stress[[0, -1]] == pytest.approx(0.0, abs=1e-3)


def test_gears_with_errors_are_refused():
    pinion, wheel = MIDDLE["gear"]
    uneven = pinion | {"pitch_errors_um": [1.0, *18 * [0.0]]}
    gears = read_gear_set(toml_text(MIDDLE | {"gear": [uneven, wheel]}))
    with pytest.raises(fegear.InputError, match="pitch_errors_um; not modelled by"):
        shafts_of(gears)


@pytest.mark.parametrize(
    ("factor", "is_refused"), [(0.999, True), (1.001, False)], ids=["soft", "stiff"]
)
def test_thrust_may_move_a_shaft_by_a_tenth_of_the_face_width(factor, is_refused):
    gear_set = load_gear_set(SET)
    thrust = abs(shaft_axial_force(gear_set, 0, 40.0))
    stiffness = factor * thrust / (0.1 * 12e-3)
    edit = f"shaft.1.bearing_kz_N_per_m=[{stiffness}, 0]"
    edited = on_shafts(GearSetRef(name=SET, edits=(edit,)).loaded)
    torques = mesh_torques_at(edited, 40.0)
    if not is_refused:
        require_thrust_on_bearings(edited, torques)
        return
    expected = r"shaft 1, pinion-1: bearing_kz_N_per_m = .* at most 1.2 mm"
    with pytest.raises(InputError, match=expected):
        require_thrust_on_bearings(edited, torques)
