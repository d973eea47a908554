"""Wear of flanks by Archard's law: closed forms, energy, convergence and files."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import fegear
from fegear.commands.wear.archard import (
    StepPlan,
    WearingMesh,
    path_points,
    position_error,
    step_error,
    wear_off,
)
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings

K = 1e-18  # m2/N
TORQUE = 100.0
PAIR = """
name = "pair"
[defaults]
module_mm = 3
pressure_angle_deg = 20
face_width_mm = 20
[[gear]]
name = "one"
teeth = {teeth[0]}
hub_radius_mm = 15
[[gear]]
name = "two"
teeth = {teeth[1]}
{body}
[[mesh]]
driver = "one"
driven = "two"
center_distance_mm = {distance}
[load]
gear = "one"
torques_Nm = [100]
"""


def pair_file(folder, teeth: tuple[int, int], internal: bool = False) -> str:
    body = "hub_radius_mm = 15"
    if internal:
        body = f"internal = true\nrim_radius_mm = {1.5 * teeth[1] + 20}"
    distance = 1.5 * (teeth[1] - teeth[0] if internal else sum(teeth))
    path = folder / f"pair{teeth[0]}-{teeth[1]}.toml"
    path.write_text(PAIR.format(teeth=teeth, body=body, distance=distance))
    return str(path)


def wearing(name: str, positions: int = 16, mesh: int = 0, **settings) -> WearingMesh:
    elements = StaticsSettings(resolution="coarse", positions=positions, **settings)
    contact = contact_problem(load_gear_set(name), mesh, elements)
    points = path_points(contact.pair, positions)
    return WearingMesh(contact, TORQUE, K, points)


@cache
def liu_pair(positions: int = 16) -> WearingMesh:
    return wearing("liu-pair", positions)


def unworn(mesh: WearingMesh) -> np.ndarray:
    return np.zeros_like(mesh.roll_angles)


def worn(mesh: WearingMesh, turns: float, count: int):
    return wear_off(mesh, unworn(mesh), turns, StepPlan(1.0, count))


def single_contact(mesh: WearingMesh) -> np.ndarray:
    """Points (p,) near the pitch point, at which a pair carries all of the load."""
    return np.abs(mesh.points.position) < 0.1


def test_a_passage_in_single_contact_is_the_closed_form():
    """k F |v1 - v2| / v, from radii of curvature at a distance from the pitch point."""
    mesh = liu_pair()
    pair, alone = mesh.pair, single_contact(mesh)
    assert alone.sum() >= 3
    distance = pair.base_pitch * mesh.points.position[alone]
    one, two = pair.driver, pair.driven
    angle = pair.operating_pressure_angle
    line_load = TORQUE / one.base_radius / mesh.contact.face_width
    sliding = np.abs(distance) * (1.0 + one.teeth / two.teeth)  # at 1 rad/s
    driver_radius = one.base_radius * np.tan(angle) + distance
    driven_radius = two.base_radius * np.tan(angle) - distance
    driver = K * line_load * sliding / driver_radius
    driven = K * line_load * sliding / (driven_radius * one.teeth / two.teeth)
    depth = mesh.depth_per_passage(mesh.load(unworn(mesh)))[:, alone]
    assert_allclose(depth, [driver, driven], rtol=1e-6, atol=1e-24)


def test_nothing_wears_at_the_pitch_point():
    mesh = liu_pair()
    pitch = np.flatnonzero(mesh.points.position == 0.0)
    assert pitch.size == 1
    depth = worn(mesh, 1e8, 6).depth
    assert_allclose(depth[:, pitch], 0.0, atol=1e-18)
    others = np.delete(depth, pitch, axis=1)
    assert others.min() > 1e-8


def test_the_volume_is_that_of_the_friction_work():
    """Torque lost by friction of the finite elements, which knows nothing of wear."""
    mesh = wearing("liu-pair", 256, corner_contact=False)
    friction = 1e-3
    pair, start = mesh.pair, mesh.pair.path[0]
    end = start + (pair.path[1] - start) % 1.0
    nodes, weights = np.polynomial.legendre.leggauss(24)
    lost = 0.0
    for low, high in ((start, end), (end, start + 1.0)):  # loads jump between these
        place = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        order = np.argsort(place % 1.0)
        torques = [
            solve_cycle(
                replace(mesh.contact, friction=mu), TORQUE, (place % 1.0)[order]
            ).driven_torque[0]
            for mu in (0.0, friction)
        ]
        change = (torques[0] - torques[1]) * pair.driver.teeth / pair.driven.teeth
        lost += 0.5 * (high - low) * float(weights[order] @ np.abs(change)) / TORQUE
    force = TORQUE / pair.driver.base_radius / mesh.contact.face_width
    work = force * pair.base_pitch * lost / friction
    loaded = mesh.load(unworn(mesh))
    assert mesh.sliding_work(loaded) == pytest.approx(work, rel=5e-4)
    areas = mesh.worn_areas(mesh.depth_per_passage(loaded))
    assert_allclose(areas, K * work, rtol=5e-4)


@pytest.mark.parametrize(
    ("teeth", "internal"),
    [((17, 43), False), ((31, 23), False), ((24, 96), True)],
)
def test_both_gears_lose_the_same_volume(tmp_path, teeth, internal):
    """Also of flanks that wear, each as often as its teeth pass."""
    mesh = wearing(pair_file(tmp_path, teeth, internal), 64)
    flanks = worn(mesh, 1e7, 3)
    volumes = mesh.worn_areas(flanks.depth) * np.array(teeth)
    assert_allclose(volumes, K * flanks.sliding_work * teeth[0], rtol=1e-3)


@pytest.mark.parametrize(
    ("corner_contact", "turns", "rtol"), [(False, 1e4, 1e-6), (True, 1e8, 5e-3)]
)
def test_equal_gears_wear_equally(tmp_path, corner_contact, turns, rtol):
    """But for the normals of tip corners and worn flanks, as the driver's torque is
    given.
    """
    name = pair_file(tmp_path, (30, 30))
    mesh = wearing(name, corner_contact=corner_contact)
    driver, driven = worn(mesh, turns, 6).depth
    assert_allclose(mesh.points.position, -mesh.points.position[::-1], atol=1e-9)
    assert_allclose(driver, driven[::-1], rtol=0, atol=rtol * driver.max())


def test_wear_of_a_few_turns_is_proportional():
    mesh = liu_pair()
    few = worn(mesh, 10.0, 2).depth
    assert_allclose(few, 10.0 * mesh.depth_per_turn(mesh.load(unworn(mesh))), rtol=1e-6)
    harder = replace(mesh, coefficient=7.0 * K)
    assert_allclose(worn(harder, 10.0, 2).depth, 7.0 * few, rtol=1e-6)


def test_steps_converge_to_first_order_and_their_error_is_estimated():
    mesh = liu_pair()
    reference = worn(mesh, 1e8, 192)
    runs = [worn(mesh, 1e8, count) for count in (4, 8, 16, 32)]
    errors = [
        float(np.abs(run.depth - reference.depth).max() / reference.depth.max())
        for run in runs
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # the reference is off as well
    assert np.all((orders > 0.85) & (orders < 1.35))
    for error, (coarser, run) in zip(errors[1:], pairwise(runs), strict=True):
        assert step_error(run, coarser) == pytest.approx(error, rel=0.35)


def test_positions_converge():
    """Between its points a flank is interpolated, which alone changes with them."""
    errors, estimates = [], []
    fine = worn(liu_pair(128), 1e8, 6)
    place = liu_pair(128).points.position
    for positions in (8, 16, 32, 64):
        mesh = liu_pair(positions)
        depth = worn(mesh, 1e8, 6).depth
        errors.append(
            max(
                np.abs(np.interp(place, mesh.points.position, a) - b).mean() / b.mean()
                for a, b in zip(depth, fine.depth, strict=True)
            )
        )
        estimates.append(position_error(mesh.points.position, [*depth]))
    assert np.all(np.array(errors[1:]) < 0.6 * np.array(errors[:-1]))
    assert np.all(np.array(errors) < estimates)
    assert errors[-1] < 2e-3


def test_two_runs_in_a_row_are_one_run():
    mesh = liu_pair()
    half = worn(mesh, 5e7, 3)
    second = wear_off(mesh, half.depth, 5e7, StepPlan(1.0, 3))
    assert_allclose(second.depth, worn(mesh, 1e8, 6).depth, rtol=1e-12)
    assert_allclose(second.lost, second.depth - half.depth, rtol=0, atol=0)


def test_a_step_takes_off_no_more_than_stated():
    mesh = liu_pair()
    for bound in (2e-7, 1e-6):
        run = wear_off(mesh, unworn(mesh), 1e8, StepPlan(bound))
        assert 0.3 * bound < run.largest_step <= bound


@given(
    st.floats(1e-9, 1e-5),
    st.none() | st.integers(2, 50),
    st.lists(st.floats(1e-8, 1e-5), min_size=1, max_size=20),
)
def test_plans_end_and_keep_their_bound(bound, count, depths):
    """depths : what would go until the end at the loads of each step"""
    plan, done, remaining = StepPlan(bound, count), 0, 1.0
    while remaining > 0.0:
        depth = remaining * depths[done % len(depths)]
        left = plan.steps_left(done, depth)
        assert left >= 1
        if count is None:
            assert depth / left <= bound * (1.0 + 1e-12)
        remaining = 0.0 if left == 1 else remaining * (1.0 - 1.0 / left)
        done += 1
        assert done < 20_000
    assert done >= 2
    assert count in (None, done)


def test_loads_move_to_the_ridge_that_wear_leaves():
    mesh = liu_pair(32)
    shifts = [worn(mesh, turns, 12).last.shift for turns in (1e6, 1e8, 4e8)]
    assert shifts[0] < 1e-3
    assert shifts[0] < shifts[1] < 0.05 < shifts[2]
    assert mesh.load(unworn(mesh)).shift < 1e-6


def study(**settings) -> fegear.FlankWear:
    elements = StaticsSettings(resolution="coarse", positions=16)
    return fegear.FlankWear(**{"elements": elements, "cycles": 1e8} | settings)


def columns_of(result) -> dict[str, tuple]:
    columns = zip(*result.table.rows(), strict=True)
    return dict(zip(result.table.names, columns, strict=True))


def test_the_written_gears_have_the_worn_flanks(tmp_path):
    result = fegear.run(study(gear_set="liu-pair", torque=TORQUE))
    path = tmp_path / "worn.toml"
    result.more_files["gears"](path)
    again = fegear.run(study(gear_set=str(path), torque=TORQUE, cycles=1e-3))
    columns, others = columns_of(result), columns_of(again)
    assert columns["gear"] == others["gear"]
    for name, last in (
        ("roll_angle_deg", "roll_angle_deg"),
        ("wear_depth_m", "wear_depth_m"),
        ("last_line_load_N_per_m", "first_line_load_N_per_m"),
        ("wear_of_last_turn_m", "wear_of_first_turn_m"),
    ):
        scale = np.abs(columns[name]).max()
        assert_allclose(others[last], columns[name], rtol=1e-6, atol=1e-8 * scale)
    table = fegear.solve_mesh(
        load_gear_set(str(path)),
        torques_on_driver=[TORQUE],
        settings=StaticsSettings(resolution="coarse", positions=16),
    )
    worn_row = result.summary["contact"][1]
    peak = 1e6 * float(np.ptp(table.cycle.ste))
    assert peak == pytest.approx(worn_row["ste_peak_to_peak_um"], rel=1e-6)
    mean = float(table.cycle.stiffness.mean())
    assert mean == pytest.approx(worn_row["mean_stiffness_N_per_m"], rel=1e-6)


def test_the_table_has_both_flanks_by_rising_roll_angle(tmp_path):
    name = pair_file(tmp_path, (24, 96), internal=True)
    result = fegear.run(study(gear_set=name, cycles=1e6))
    columns = columns_of(result)
    gear, angle = np.array(columns["gear"]), np.array(columns["roll_angle_deg"])
    for row, name in enumerate(("one", "two")):
        flank = gear == name
        assert np.all(np.diff(angle[flank]) > 0.0)
        depth = np.array(columns["wear_depth_m"])[flank]
        summary = result.summary["gears"][row]
        deepest = 1e6 * depth.max()
        assert summary["largest_depth_um"] == pytest.approx(deepest, rel=1e-12)
        assert angle[flank][depth.argmax()] == summary["at_roll_angle_deg"]
        sliding = np.array(columns["specific_sliding"])[flank]
        turn = np.array(columns["wear_of_first_turn_m"])[flank]
        load = np.array(columns["first_line_load_N_per_m"])[flank]
        assert_allclose(turn, K * load * np.abs(sliding), rtol=1e-12, atol=1e-30)
    revolutions = [row["revolutions"] for row in result.summary["gears"]]
    assert revolutions == pytest.approx([1e6, 2.5e5])


def test_wear_before_is_where_the_depth_begins():
    edits = ("gear.pinion.worn_teeth=[{roll_angle_deg=[14,29],depth_um=[2,2]}]",)
    ref = type(study().gear_set)(name="liu-pair", edits=edits)
    plain, result = (
        fegear.run(study(gear_set=gears, torque=TORQUE, cycles=1.0))
        for gears in ("liu-pair", ref)
    )
    assert_allclose(result.worn.depth[0], 2e-6, rtol=1e-6)
    assert result.worn.depth[1].max() < 1e-12
    # the same depth everywhere advances the gear and changes no load
    assert_allclose(result.worn.first.line_load, plain.worn.first.line_load, rtol=1e-4)
    shift = result.worn.first.ste - plain.worn.first.ste
    assert_allclose(shift, 2e-6, rtol=1e-3)


def test_a_second_mesh_wears_the_other_flank_of_the_idler():
    result = fegear.run(study(gear_set="liu-idler", mesh=2, cycles=1e6))
    assert [row["gear"] for row in result.summary["gears"]] == ["idler", "follower"]
    with pytest.raises(InputError, match=r"^liu-idler: no file; needs"):
        result.write_gears("worn.toml")


def test_warnings_name_large_steps_and_deep_wear():
    result = fegear.run(study(torque=TORQUE, cycles=1e9, steps=2))
    lines = result.summary["warnings"]
    assert [line.endswith("[W51]") for line in lines] == [True, True]
    assert "by its 2 steps" in lines[0]
    assert "base pitches from the points" in lines[1]
    assert fegear.run(study(torque=TORQUE)).summary["warnings"] == []


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cycles": 1e13}, r"^cycles = 1e\+13; needs \d+ steps of wear, allowed are"),
        (
            {"cycles": 1e13, "steps": 2},
            r"after .* wear is .* um deep, allowed are 1270",
        ),
        (
            {"cycles": 5e9, "steps": 6},
            r"^cycles = 5000000000; flanks are worn too",
        ),
        ({"elements": StaticsSettings(positions=4)}, "^positions = 4; must be 8 or"),
        ({"elements": StaticsSettings(positions=900)}, "makes 1358 points of a flank"),
        ({"gear_set": "planetary-24-36-96"}, "planetary sets; wear is that of gears"),
    ],
)
def test_what_cannot_be_computed_is_refused(settings, message):
    with pytest.raises(InputError, match=message):
        fegear.run(study(torque=TORQUE, **settings))
