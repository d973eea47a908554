"""Fields of whole gear sets, all of whose meshes are in contact at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fegear import solve_stress
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.gearset.phases import mesh_phases
from fegear.gearset.power_path import external_torques, input_torques
from fegear.rendering.fields import contact_field
from fegear.rendering.gear_set_scene import (
    SetMoment,
    field_at,
    gear_set_field,
    gear_set_scene,
    loaded_meshes,
    turn_moments,
)
from fegear.rendering.loaded_gears import (
    ROLES,
    LoadedGear,
    LoadedMesh,
    MeshSide,
    gears_in_meshes,
)
from fegear.rendering.pictures import PictureSettings
from fegear.statics.settings import StaticsSettings

COARSE = StaticsSettings(resolution="coarse")
TORQUE = 60.0  # N m
ASPECT = 1.6


@pytest.fixture(scope="module")
def planetary(compliance_cache):
    return gear_set_scene(load_gear_set("planetary-24-36-96"), COARSE)


@pytest.fixture(scope="module")
def idler(compliance_cache):
    settings = StaticsSettings(resolution="coarse", friction=0.1)
    return gear_set_scene(load_gear_set("liu-idler"), settings)


@pytest.fixture(scope="module")
def planetary_field(planetary):
    return gear_set_field(planetary, TORQUE, 0.3, planetary.view("set", ASPECT))


def same_nodes(one, other) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the points that both have in the same place, and that are alone there:
    stress has a value on each side of a cut between sectors.
    """
    trees = [cKDTree(points) for points in (one, other)]
    near = trees[1].query_ball_point(one, 1e-9)
    alone = trees[0].query_ball_point(one, 1e-9, return_length=True) == 1
    pairs = [(i, n[0]) for i, n in enumerate(near) if len(n) == 1 and alone[i]]
    first, second = np.array(pairs).T
    return first, second


def by_name(field) -> dict:
    return {gear.name: gear for gear in field.gears}


def turned(points, angle) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("position", [0.0, 0.37])
def test_an_idler_has_the_sum_of_the_fields_of_both_meshes(idler, position):
    """Each mesh alone is solved in its own frame; tensors add up at the nodes."""
    view = idler.view("set", ASPECT)
    whole = by_name(gear_set_field(idler, TORQUE, position, view))["idler"]
    torques = (TORQUE, TORQUE * idler.meshes[0].mesh.pair.driven.teeth)
    torques = torques[0], torques[1] / idler.meshes[0].mesh.pair.driver.teeth
    phases = mesh_phases(idler.gear_set)
    alone = [
        by_name(contact_field(mesh, torque, phase.value + position, view))["idler"]
        for mesh, torque, phase in zip(idler.meshes, torques, phases, strict=True)
    ]
    rows = [same_nodes(whole.points, gear.points) for gear in alone]
    nodes = np.intersect1d(rows[0][0], rows[1][0])
    assert len(nodes) > 0.7 * len(whole.points)
    picks = [second[np.isin(first, nodes)] for first, second in rows]
    for name in ("displacement", "stress"):
        total = sum(
            getattr(gear, name)[pick] for gear, pick in zip(alone, picks, strict=True)
        )
        values = getattr(whole, name)[nodes]
        scale = np.abs(values).max()
        assert scale > 0.0
        np.testing.assert_allclose(values, total, atol=1e-9 * scale)


def test_planets_have_equal_fields_turned_by_a_third(planetary_field):
    """Twenty-four teeth of the sun over three planets: all are in phase."""
    gears = by_name(planetary_field)
    one = gears["planet-1"]
    for number, angle in ((2, 2.0 * math.pi / 3.0), (3, -2.0 * math.pi / 3.0)):
        other = gears[f"planet-{number}"]
        assert len(other.points) == len(one.points)
        first, second = same_nodes(turned(one.points, angle), other.points)
        assert len(first) > 0.7 * len(one.points)  # refined triangles share none
        for name in ("von_mises", "out_of_plane", "elastic_shift", "principal_1"):
            values = getattr(one, name)[first]
            np.testing.assert_allclose(
                getattr(other, name)[second], values, atol=1e-7 * np.abs(values).max()
            )


def test_loads_of_all_pairs_balance_the_torques(planetary, planetary_field):
    torques = external_torques(planetary.gear_set, TORQUE)
    reactions = [0.0] * len(planetary.gear_set.gears)
    for pair in planetary_field.pairs:
        mesh = planetary.meshes[pair.mesh].mesh
        driver, driven = mesh.pair.driver, mesh.pair.driven
        senses = planetary.gear_set.senses
        reactions[mesh.driver] -= senses[mesh.driver] * abs(
            pair.load * driver.base_radius
        )
        reactions[mesh.driven] += senses[mesh.driven] * abs(
            pair.load * driven.base_radius
        )
    for index, reaction in enumerate(reactions):
        assert reaction + torques[index] == pytest.approx(0.0, abs=1e-9 * TORQUE)
    assert torques[0] == pytest.approx(TORQUE)


@pytest.mark.parametrize(("name", "far"), [("planetary", "ring"), ("idler", "driver")])
def test_a_far_mesh_hardly_changes_the_largest_fillet_stress(name, far, request):
    """Of a planet and of the idler, whose other mesh is half a turn away."""
    scene = request.getfixturevalue(name)
    meshes = loaded_meshes(scene, TORQUE, 0.3)
    gear = meshes[0].scene.mesh.driven
    sides = tuple(
        MeshSide(mesh, role)
        for mesh in meshes
        for index, role in zip(mesh.scene.mesh.gears, ROLES, strict=True)
        if index == gear
    )
    assert len(sides) == 2
    unloaded = MeshSide(
        LoadedMesh(sides[1].mesh.scene, sides[1].mesh.pose, []), sides[1].role
    )
    fillet = np.unique(sides[0].body.sector.mesh.edges["fillet"])
    largest = []
    for pair in (sides, (sides[0], unloaded)):
        sectors = LoadedGear(pair).sectors()
        near = next(s for s in sectors if s.loads)
        points = near.body.sector.mesh.points[fillet]
        largest.append(near.at(points)[:, 2:4].sum(axis=1).max())
    both, alone = largest
    assert both != alone
    assert both == pytest.approx(alone, rel=0.05)


@pytest.mark.parametrize("name", ["planetary", "idler"])
def test_hubs_turn_so_that_flanks_in_contact_stay_together(name, request):
    """Along the normal the driven gear's nodes at a contact move as the driver's."""
    scene = request.getfixturevalue(name)
    meshes = loaded_meshes(scene, TORQUE, 0.0)
    turns = scene.hub_turns([mesh.pose.ste for mesh in meshes])
    gears, pairs = gears_in_meshes(meshes, turns, scene.view("set", ASPECT))
    fields = {gear.name: gear for gear in gears}
    for pair in pairs:
        mesh = meshes[pair.mesh]
        gear = fields[mesh.scene.gear_names[1]]
        top = int(pair.pressure.argmax())
        node = cKDTree(gear.points).query(pair.points[top])[1]
        normal = pair.normals[top]
        driven, driver = gear.motion[node] @ normal, pair.motion[top] @ normal
        assert driver == pytest.approx(driven, abs=0.1 * mesh.pose.ste)


@pytest.mark.slow
def test_the_ring_is_at_rest_while_the_carrier_turns(planetary):
    view, whole = planetary.view("set", ASPECT), 40
    moments = turn_moments(planetary.gear_set, 1.0, 24 * whole)
    at = moments[10]
    assert at.position == pytest.approx(1.0)
    assert at.carrier_angle == pytest.approx(2.0 * math.pi / 96.0)
    start, later = (
        by_name(field_at(planetary, TORQUE, moment, view))
        for moment in (moments[0], moments[4])
    )
    first, _ = same_nodes(start["ring"].points, later["ring"].points)
    assert len(first) > 0.8 * len(start["ring"].points)
    hub = later["planet-1"].center
    angle = math.atan2(hub[1], hub[0])
    assert angle == pytest.approx(moments[4].carrier_angle)
    assert angle > 0.0  # as the sun


def test_turned_fields_keep_stress_and_load(planetary_field):
    moved = planetary_field.turned(0.7, np.array([0.02, -0.01]))
    for gear, original in zip(moved.gears, planetary_field.gears, strict=True):
        np.testing.assert_allclose(gear.von_mises, original.von_mises, rtol=1e-6)
        assert not np.allclose(gear.stress, original.stress)
    for pair, original in zip(moved.pairs, planetary_field.pairs, strict=True):
        assert pair.load == original.load
        (x, y), (u, v) = original.normals.T, pair.normals.T
        np.testing.assert_allclose(x * v - y * u, math.sin(0.7), atol=1e-12)


def test_the_smaller_gear_of_a_shaft_is_in_front(compliance_cache):
    scene = gear_set_scene(load_gear_set("liu-countershaft"), COARSE)
    layers = [scene.layers[gear] for gear in range(4)]
    assert layers == [1, 1, 0, 0]
    field = gear_set_field(scene, 100.0, 0.0, scene.view("set", ASPECT))
    assert [gear.layer for gear in field.gears] == [1, 1, 0, 0]
    assert scene.rates == pytest.approx((1.0, 19.0 / 72.0))


def test_a_held_carrier_makes_no_turns():
    gears = load_gear_set(
        "planetary-24-36-96",
        {"planetary.1.output": "ring", "planetary.1.held": "carrier"},
    )
    with pytest.raises(InputError, match="turns = 1; the carrier of") as caught:
        turn_moments(gears, 1.0, 4)
    assert "\n" not in str(caught.value)


def test_turns_of_a_train_are_those_of_its_input():
    moments = turn_moments(load_gear_set("liu-idler"), 2.0, 4)
    teeth = load_gear_set("liu-idler").gears[0].geometry.teeth
    assert moments == [SetMoment(teeth * turn) for turn in (0.0, 0.5, 1.0, 1.5)]


def test_phases_that_do_not_fit_the_centre_lines_are_refused(compliance_cache):
    edits = {
        "mesh.1.center_line_deg": 0,
        "mesh.2.center_line_deg": 0,
        "mesh.2.phase": 0.3,
    }
    gears = load_gear_set("liu-idler", edits)
    scene = gear_set_scene(gears, COARSE)
    with pytest.raises(InputError, match="mesh of idler and follower") as caught:
        gear_set_field(scene, TORQUE, 0.0, scene.view("set", ASPECT))
    assert "\n" not in str(caught.value)


def test_stress_of_a_whole_set(compliance_cache):
    """The torque is on the driver of the mesh that is named."""
    gears = load_gear_set("planetary-24-36-96")
    torque = input_torques(gears)[0]
    result = solve_stress(gears, torque / 3.0, zoom="set", settings=COARSE)
    assert result.field.torque == pytest.approx(torque)
    assert set(result.largest_Pa) == {gear.name for gear in gears.gears}
    assert len({pair.mesh for pair in result.field.pairs}) == 6


def test_a_view_of_another_kind_is_refused(planetary):
    with pytest.raises(InputError, match="zoom = tooth; must be set"):
        planetary.view("tooth", ASPECT)
    with pytest.raises(InputError, match="zoom = set; must be contact, tooth or gear"):
        planetary.meshes[0].view("set", ASPECT)
    assert PictureSettings(zoom="set").zoom == "set"
