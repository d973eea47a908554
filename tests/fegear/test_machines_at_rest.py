"""Gear sets on shafts that yield, beside a code of its own and by their balances."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from own_machine import OwnShaft, contact_points, solve_contact
from yielding_machines import (
    HUBS,
    SETTINGS,
    TEETH,
    TORQUE,
    tables_of_two_stages,
    two_stages,
)

from fegear.contact.pairs import pair_gaps
from fegear.contact.problem import ContactFailure
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.damage import MomentaryLine, PairsAt
from fegear.contact.width.lines import FaceSolver, pairs_over_width
from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.tooth_forces import tooth_forces
from fegear.statics.machine import loaded_problem, machine_at_rest
from fegear.statics.solving import mesh_statics
from lumped.rotors.description import MIN_ELEMENT


def shaft_keys(name, shaft: OwnShaft, place: float) -> dict[str, Any]:
    positions, *stiffnesses = zip(*shaft.bearings, strict=True)
    names = ("kx_N_per_m", "ky_N_per_m", "kz_N_per_m", "tilt_stiffness_Nm_per_rad")
    keys = {
        f"bearing_{name}": list(values)
        for name, values in zip(names, stiffnesses, strict=True)
    }
    return keys | {
        "gears": [name],
        "lengths_mm": [1e3 * shaft.length],
        "diameters_mm": [1e3 * shaft.diameter],
        "bores_mm": [1e3 * shaft.bore],
        "positions_mm": [1e3 * place],
        "bearing_positions_mm": [1e3 * position for position in positions],
    }


def random_shaft(rng) -> tuple[OwnShaft, float]:
    """A shaft on two or three bearings, and where its gear is, also overhung."""
    length, diameter = rng.uniform(0.1, 0.3), rng.uniform(0.02, 0.04)
    bore = rng.choice([0.0, rng.uniform(0.2, 0.7)]) * diameter
    count = rng.integers(2, 4)
    positions = np.sort(rng.uniform(0.0, 1.0, count))
    positions = np.linspace(0.05, 0.8, count) + 0.15 * positions
    bearings = [
        (
            float(position * length),
            *(10.0 ** rng.uniform(7.5, 9.0, 2)).tolist(),
            float(10.0 ** rng.uniform(7.5, 9.0)) if n == 0 else 0.0,
            float(rng.choice([0.0, 10.0 ** rng.uniform(2.0, 4.0)])),
        )
        for n, position in enumerate(positions)
    ]
    place = float(rng.uniform(0.1, 0.99) * length)
    return OwnShaft(length, diameter, float(bore), bearings), place


def machine(rng, helix_angle_deg: float):
    """A pair of fixed teeth on random shafts, its own shafts and their places."""
    shafts = [random_shaft(rng) for _ in range(2)]
    center_line = float(rng.uniform(0.0, 360.0))
    tables = {
        "name": "machine",
        "defaults": {
            "module_mm": 2.0,
            "face_width_mm": 16.0,
            "helix_angle_deg": helix_angle_deg,
        },
        "gear": [
            {"name": name, "teeth": teeth, "hub_radius_mm": hub}
            for name, teeth, hub in zip("ab", TEETH, HUBS, strict=True)
        ],
        "mesh": [
            {
                "driver": "a",
                "driven": "b",
                "backlash_um": 50.0,
                "center_line_deg": center_line,
                "misalignment_um": float(rng.uniform(-10.0, 10.0)),
            }
        ],
        "shaft": [
            shaft_keys(name, *shaft) | {"driven_from": str(end)}
            for name, shaft, end in zip(
                "ab", shafts, rng.choice(["start", "end"], 2), strict=True
            )
        ],
        "load": {"gear": "a", "torques_Nm": [TORQUE]},
    }
    if helix_angle_deg:
        tables["gear"][0]["hand"] = str(rng.choice(["left", "right"]))
    return make_gear_set(tables), shafts, math.radians(center_line)


def own_torsion(shaft, gear, end, places):
    """Approach along the normal at places by unit normal forces there (p, p).

    The gear is a beam of many elements that is held at the end of its face width.
    """
    helix = math.atan(gear.geometry.base_radius * gear.geometry.twist)
    lever = gear.geometry.base_radius * math.cos(helix)
    outside = max(gear.geometry.root_radius, 0.5 * shaft.diameter)
    solid = math.pi / 2.0 * outside**4
    rigidity = 206e9 / 2.6 * (solid - math.pi / 32.0 * shaft.bore**4)
    ends = 0.5 * gear.face_width * np.array([-1.0, 1.0])
    nodes = np.union1d(places, np.union1d(ends, np.linspace(*ends, 33)))
    elements = rigidity / np.diff(nodes)
    n, held = nodes.size, 0 if end == "start" else nodes.size - 1
    stiffness = np.zeros((n, n))
    for i, k in enumerate(elements):
        stiffness[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    free = np.delete(np.arange(n), held)
    twist = np.zeros((n, n))
    twist[np.ix_(free, free)] = np.linalg.inv(stiffness[np.ix_(free, free)])
    at = np.searchsorted(nodes, places)
    return lever**2 * twist[np.ix_(at, at)]


def by_own_code(gear_set, shafts, center_line, problem, position):
    """Normal forces, transmission error and slices at a position, shafts of its own."""
    held = replace(problem, solver=replace(problem.solver, supports=None))
    face, pair = held.solver, held.pair
    teeth = pairs_over_width(held, face, np.array([position]))
    solver = FaceSolver(held, face)
    gaps = pair_gaps(held, teeth, False)
    line = MomentaryLine.of(pair)
    lines = solver.lines(PairsAt(teeth, position, gaps, line, None))
    index = np.flatnonzero(np.isfinite(lines.gap))
    parts = lines.parts.chosen(index)
    size = solver.contact_size(TORQUE, lines)
    compliance = solver.compliance.between(teeth, parts)
    compliance += solver.compliance.near(parts, size)
    driver = pair.driver
    rolls = np.sqrt(
        driver.tip_roll_length**2 - 2.0 * driver.base_radius * parts.arcs[:, 0]
    )
    radii = np.hypot(driver.base_radius, rolls)
    points, push = contact_points(pair, radii, center_line, sense=1.0)
    helix = math.atan(driver.base_radius * driver.twist)
    force = np.append(math.cos(helix) * push, math.sin(helix))
    centers = (
        np.zeros(2),
        pair.center_distance * np.array([math.cos(center_line), math.sin(center_line)]),
    )
    for (shaft, place), center, sign, gear, spec in zip(
        shafts, centers, (-1.0, 1.0), gear_set.gears, gear_set.shafts, strict=True
    ):
        compliance += own_torsion(shaft, gear, spec.body.driven_from, parts.place)
        C = shaft.compliance(place)
        arms = np.column_stack([points - center, parts.place])
        loads = np.hstack(
            [np.tile(sign * force, (len(arms), 1)), np.cross(arms, sign * force)]
        )
        moved = loads @ C.T  # displacement and rotation by a unit force at each
        for j, motion in enumerate(moved):
            at = motion[:3] + np.cross(motion[3:], arms)
            compliance[:, j] += at @ (sign * force)

    def of_contact(load):
        return solver.compliance.own_contact(load, parts, size)

    forces, ste = solve_contact(
        compliance,
        of_contact,
        lines.gap[index],
        lines.closing[index],
        lines.arm[index],
        TORQUE,
    )
    on_slices = np.zeros(face.slices)
    np.add.at(on_slices, lines.slices[index], forces)
    return on_slices, ste


@pytest.mark.slow
@pytest.mark.parametrize("helix_angle_deg", [0.0, 17.0])
@pytest.mark.parametrize("seed", range(10))
def test_random_machines_beside_a_code_of_its_own(helix_angle_deg, seed):
    rng = np.random.default_rng([73, seed])
    gear_set, shafts, center_line = machine(rng, helix_angle_deg)
    solved = mesh_statics(SETTINGS.on_shafts(gear_set), 0, [TORQUE], SETTINGS)
    face = solved.cycle.face
    nearest = min(
        abs(bearing[0] - place) / shaft.length
        for shaft, place in shafts
        for bearing in shaft.bearings
    )
    # a gear that is nearer to a bearing hangs on it by a rigid arm
    bound = 1e-7 if nearest > MIN_ELEMENT else 1e-3
    for n, position in enumerate(solved.cycle.position.tolist()):
        forces, ste = by_own_code(
            gear_set, shafts, center_line, solved.problem, position
        )
        ours = face.load[0, n].sum(axis=0) * face.slice_length
        assert ours == pytest.approx(forces, abs=bound * forces.max())
        assert solved.cycle.ste[0, n] == pytest.approx(ste, rel=bound)


def test_a_machine_in_a_mirror_has_mirrored_loads():
    """Seen from the other end: ends of shafts, hands and places are exchanged.

    One shaft passes torque from gear to gear, the others from outside.
    """
    tables, mirrored = tables_of_two_stages(), tables_of_two_stages()
    (length,) = tables["shaft"][0]["lengths_mm"]
    for shaft in mirrored["shaft"]:
        shaft["gears"].reverse()
        shaft["positions_mm"] = [length - z for z in reversed(shaft["positions_mm"])]
    for number, end, other in ((0, "start", "end"), (2, "end", "start")):
        tables["shaft"][number]["driven_from"] = end
        mirrored["shaft"][number]["driven_from"] = other
    mirrored["gear"][0]["hand"], mirrored["gear"][2]["hand"] = "left", "right"
    ours, seen = (
        machine_at_rest(SETTINGS.on_shafts(make_gear_set(one)), TORQUE, SETTINGS)
        for one in (tables, mirrored)
    )
    torsions = [
        one.torsion for mesh in ours.problems for one in mesh.solver.supports.gears
    ]
    assert None not in torsions
    for mesh, other in zip(ours.cycles, seen.cycles, strict=True):
        assert mesh.ste == pytest.approx(other.ste, rel=1e-10)
        load = mesh.face.load
        scale = load.max()
        assert load == pytest.approx(other.face.load[..., ::-1], abs=1e-10 * scale)


def test_meshes_on_a_common_shaft_agree_on_its_loads():
    gear_set = two_stages()
    solved = machine_at_rest(SETTINGS.on_shafts(gear_set), TORQUE, SETTINGS)
    forces = np.zeros((4, 3))
    for force in tooth_forces(gear_set):
        forces[force.gear] += force.vectors[0]
    scale = np.abs(forces).max()
    assert solved.loads_on_gears[:, :3] == pytest.approx(forces, abs=1e-9 * scale)
    # loads of the other mesh move a gear as much as they do in the solution
    supports = solved.problems[1].solver.supports
    driver = solved.axes.frames[1] @ solved.motions[2]
    of_own = supports.driver.compliance @ solved.loads[1, 0]
    torque = TORQUE * TEETH[1] / TEETH[0]
    expected = of_own + torque * supports.driver.motion
    assert driver == pytest.approx(expected, abs=1e-8 * np.abs(driver).max())
    assert supports.are_moved
    alone = replace(supports, driver=replace(supports.driver, motion=np.zeros(5)))
    assert not alone.are_moved
    assert 2 < solved.exchanges < 20


def test_torques_of_a_table_are_solved_each_with_its_loads():
    gear_set = SETTINGS.on_shafts(two_stages())
    torques = [0.5 * TORQUE, TORQUE]
    both = mesh_statics(gear_set, 0, torques, SETTINGS)
    for t, torque in enumerate(torques):
        alone = mesh_statics(gear_set, 0, [torque], SETTINGS)
        assert both.cycle.ste[t] == pytest.approx(alone.cycle.ste[0], rel=1e-12)
        ours, expected = both.cycle.face.load[t], alone.cycle.face.load[0]
        assert ours == pytest.approx(expected, abs=1e-9 * expected.max())


def test_stiff_shafts_and_bearings_are_held_axes():
    bearings = {f"bearing_{k}_N_per_m": [1e15, 1e15] for k in ("kx", "ky", "kz")}
    stiff = two_stages(
        diameters_mm=[2000.0], bearing_tilt_stiffness_Nm_per_rad=[1e12] * 2, **bearings
    )
    ours = mesh_statics(SETTINGS.on_shafts(stiff), 1, [TORQUE], SETTINGS)
    held = mesh_statics(stiff, 1, [TORQUE], SETTINGS)
    assert ours.cycle.ste == pytest.approx(held.cycle.ste, rel=1e-3)
    assert isinstance(held.problem.solver, WidthContact)
    assert held.problem.solver.supports is None


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"bearing_kz_N_per_m": [0.0, 0.0]}, "shaft 1: bearing_kz_N_per_m is 0 at all"),
        (
            {"bearing_positions_mm": [5.0]}
            | {f"bearing_{k}_N_per_m": [1e8] for k in ("kx", "ky", "kz")},
            "bearings at 0.005 m do not hold the shaft",
        ),
    ],
)
def test_shafts_that_nothing_holds_are_refused(keys, message):
    with pytest.raises(InputError, match=message):
        mesh_statics(SETTINGS.on_shafts(two_stages(**keys)), 0, [TORQUE], SETTINGS)


def test_thrust_needs_a_bearing_that_the_file_names():
    gear_set = two_stages()
    unknown = [
        replace(bearing, axial_stiffness=None)
        for bearing in gear_set.shafts[1].body.bearings
    ]
    body = replace(gear_set.shafts[1].body, bearings=tuple(unknown))
    shafts = list(gear_set.shafts)
    shafts[1] = replace(shafts[1], body=body)
    with pytest.raises(InputError, match=r"shaft 2: bearing_kz_N_per_m is missing"):
        SETTINGS.on_shafts(replace(gear_set, shafts=tuple(shafts)))
    assert replace(SETTINGS, shafts="off").on_shafts(gear_set) is gear_set
    assert replace(SETTINGS, plane="stress").on_shafts(gear_set) is gear_set


def test_pitch_errors_change_nothing_of_the_loads_of_other_meshes():
    gear_set = SETTINGS.on_shafts(two_stages())
    errors = (0.0, 4e-6, *[0.0] * (TEETH[0] - 2))
    gears = (replace(gear_set.gears[0], pitch_errors=errors), *gear_set.gears[1:])
    uneven = replace(gear_set, gears=gears)
    place = 0, SETTINGS, TORQUE
    equal, other = (
        np.array(
            [one.motion for one in loaded_problem(gears, *place).solver.supports.gears]
        )
        for gears in (gear_set, uneven)
    )
    assert np.abs(equal).max() > 1e-6
    assert other == pytest.approx(equal, rel=1e-12)
    assert loaded_problem(uneven, *place).driver.pitch_errors == errors


def test_a_shaft_that_hardly_anything_holds_is_said_to_be_one():
    keys = {"bearing_positions_mm": [5.0, 5.000001]}
    gear_set = SETTINGS.on_shafts(two_stages(**keys))
    with pytest.raises(ContactFailure, match="bearings of the shafts hardly hold"):
        mesh_statics(gear_set, 0, [TORQUE], SETTINGS)
