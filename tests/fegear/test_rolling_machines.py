"""Machines at rest on rolling bearings: shafts and meshes beside code of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rolling_machines import FLOATING, PRELOADED, ROLLERS, TORQUE, machine_tables
from scipy.optimize import root
from shafts_at_rest import free_stiffness

from fegear import StaticsSettings
from fegear.commands.shafts.loads import loaded_shafts, meshes_on_shafts
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set
from fegear.gearset.yielding import on_shafts
from fegear.statics.axes import SLOPES
from fegear.statics.machine import machine_at_rest
from fegear.statics.solving import mesh_statics
from fegear.train.space import system_in_space
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import time_history
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of

SETTINGS = StaticsSettings(
    resolution="coarse", positions=8, estimate_error=False, root_stress=False
)


def machine_of(*bearings, **changes):
    return read_gear_set(toml_text(machine_tables(bearings, **changes)))


@pytest.fixture(scope="module")
def solved():
    gear_set = on_shafts(machine_of(PRELOADED, FLOATING))
    return machine_at_rest(gear_set, TORQUE, SETTINGS)


@pytest.mark.parametrize("index", [0, 1])
def test_shafts_are_in_equilibrium_beside_a_solver_of_scipy(solved, index):
    """All nodes of the shaft are unknowns, and bearings have their own forces."""
    shaft = solved.axes.rolling[index]
    nodes = [0.0, *(one.position for one in shaft.supports), *shaft.places, 0.15]
    nodes.sort()
    size = 5 * len(nodes)
    stiffness = free_stiffness(shaft.rotor, nodes)
    applied = np.zeros((len(nodes), 5))
    at_gear = nodes.index(shaft.places[0])
    applied[at_gear] = SLOPES.T @ solved.loads_on_gears[index]

    def out_of_balance(scaled):
        u = (1e-4 * scaled).reshape(-1, 5)
        forces = (stiffness @ u.ravel()).reshape(-1, 5) - applied
        for one in shaft.supports:
            at = nodes.index(one.position)
            forces[at] += one.mounted.state(u[at]).force
        return 1e-3 * forces.ravel()

    (loaded,) = [s for s in loaded_shafts(solved) if s.number == index + 1]
    curve = loaded.solution
    at = [int(np.abs(curve.position - node).argmin()) for node in nodes]
    ours = np.hstack([curve.deflection, curve.tilt])[at]
    start = 1e4 * ours.ravel() * np.random.default_rng(73).uniform(0.97, 1.03, size)
    result = root(out_of_balance, start, tol=1e-13)
    assert np.abs(out_of_balance(result.x)).max() < 1e-8
    expected = 1e-4 * result.x.reshape(-1, 5)
    np.testing.assert_allclose(ours, expected, atol=1e-7 * np.abs(expected).max())
    motion = SLOPES @ expected[at_gear]
    np.testing.assert_allclose(
        solved.motions[index], motion, atol=1e-7 * np.abs(motion).max()
    )
    assert loaded.imbalance < 1e-9
    forces = [
        -one.mounted.state(expected[nodes.index(one.position)]).force
        for one in shaft.supports
    ]
    largest = np.abs(curve.reactions).max()
    np.testing.assert_allclose(curve.reactions, forces, atol=1e-6 * largest)


def test_meshes_are_solved_on_the_shafts_as_they_are(solved):
    """Axes of the contact problem move under its mean loads as the shafts do."""
    assert 2 < solved.exchanges < 12
    for side, support in enumerate(solved.problems[0].solver.supports.gears):
        expected = solved.axes.frames[0] @ solved.motions[side]
        ours = support.compliance @ solved.loads[0, side] + TORQUE * support.motion
        np.testing.assert_allclose(ours, expected, atol=1e-8 * np.abs(expected).max())


def test_parts_of_the_misalignment_add_up(solved):
    (mesh,) = meshes_on_shafts(solved)
    parts = sum(mesh.by_shafts) + sum(mesh.by_bearings)
    assert parts == pytest.approx(mesh.misalignment, rel=1e-9)
    assert mesh.factor > mesh.held_factor


def test_bearings_stiffen_with_the_torque():
    """Gears move less than in proportion to the torque, and tables have that."""
    gear_set = on_shafts(machine_of(FLOATING, FLOATING))
    torques = [0.5 * TORQUE, TORQUE]
    both = mesh_statics(gear_set, 0, torques, SETTINGS)
    for t, torque in enumerate(torques):
        alone = mesh_statics(gear_set, 0, [torque], SETTINGS)
        assert both.cycle.ste[t] == pytest.approx(alone.cycle.ste[0], rel=1e-12)
    half, whole = (
        np.abs(machine_at_rest(gear_set, torque, SETTINGS).motions[:, :2]).max()
        for torque in torques
    )
    assert whole < 1.9 * half


def test_rollers_alone_carry_spur_gears():
    rollers = [{"roller_bearing": ROLLERS}] * 2
    gear_set = on_shafts(machine_of(rollers, rollers, helix_angle_deg=0.0))
    solved = machine_at_rest(gear_set, TORQUE, SETTINGS)
    assert not solved.motions[:, 2].any()
    assert np.abs(solved.motions[:, :2]).min() > 0.0


def test_thrust_that_no_bearing_takes_is_refused_before_anything_is_computed():
    rollers = [{"roller_bearing": ROLLERS}] * 2
    with pytest.raises(InputError, match="shaft 1: rolling_bearings has roller bearin"):
        on_shafts(machine_of(rollers, FLOATING))
    one_way = [replace_angle(25.0), {"roller_bearing": ROLLERS}]
    other_way = [replace_angle(-25.0), {"roller_bearing": ROLLERS}]
    refused = []
    for bearings in (one_way, other_way):
        gear_set = on_shafts(machine_of(bearings, FLOATING))
        try:
            machine_at_rest(gear_set, TORQUE, SETTINGS)
        except InputError as error:
            refused.append(str(error))
    # a right-handed driver is pushed toward the near end
    (message,) = refused
    assert message.startswith("rolling: rotor 'a': axial force = -")
    assert "toward the near end; must be 0 without a ball bearing" in message


def replace_angle(degrees):
    return PRELOADED[0] | {"contact_angle_deg": degrees}


def test_two_stages_exchange_their_loads():
    tables = machine_tables([PRELOADED, FLOATING])
    tables["gear"] += [
        {"name": "c", "teeth": 19, "hub_radius_mm": 10.0, "hand": "left"},
        {"name": "d", "teeth": 25, "hub_radius_mm": 12.0},
    ]
    tables["mesh"].append({"driver": "c", "driven": "d", "backlash_um": 50.0})
    tables["shaft"][1] |= {"gears": ["b", "c"], "positions_mm": [45.0, 95.0]}
    tables["shaft"].append(tables["shaft"][0] | {"gears": ["d"]})
    gear_set = on_shafts(read_gear_set(toml_text(tables)))
    solved = machine_at_rest(gear_set, TORQUE, SETTINGS)
    assert solved.exchanges < 20
    for shaft in loaded_shafts(solved):
        assert shaft.imbalance < 1e-9
        assert min(shaft.pressures) > 1e8
    supports = solved.problems[1].solver.supports
    driver = solved.axes.frames[1] @ solved.motions[2]
    of_mesh = supports.driver.compliance @ solved.loads[1, 0]
    ours = of_mesh + TORQUE * 25 / 19 * supports.driver.motion
    np.testing.assert_allclose(ours, driver, atol=1e-8 * np.abs(driver).max())
    held = replace(supports.driver, motion=np.zeros(5))
    assert not replace(supports, driver=held, driven=held).are_moved


@pytest.mark.parametrize("bearings", [PRELOADED, FLOATING], ids=["preloaded", "play"])
def test_local_stiffness_is_the_slope_over_the_torque(bearings):
    """Of machines solved at two torques, each with its bearings as they are there.

    The slope of a position has the load of that position, in place of its mean.
    """
    gear_set = on_shafts(machine_of(bearings, bearings))
    step = 1e-3 * TORQUE
    torques = [TORQUE - step, TORQUE, TORQUE + step]
    cycle = mesh_statics(gear_set, 0, torques, SETTINGS).cycle
    low, _, high = cycle.ste
    slope = 2.0 * step / cycle.base_radius / (high - low)
    np.testing.assert_allclose(cycle.local_stiffness[1], slope, rtol=1e-3)


def settled_forces(system, frequency, tolerance):
    """Times of a period (t,), and what sensors have in it (t, k)."""
    settings = Settings(tolerance=tolerance)
    motion = time_history(system, frequency, settings)
    _, history = stepper_of(system, settings).record(
        motion.response.state, Speed(frequency, settings), 1, with_states=True
    )
    shapes = system.modes.shapes[:, system.moving]
    displacement, velocity = (history.states[:, i] @ shapes.T for i in (0, 1))
    return history.time, system.space.sensed(displacement, velocity, 0.0 * displacement)


@pytest.mark.parametrize("frequency", [380.0, 1000.0, 4000.0])
def test_a_motion_has_settled_when_forces_of_bearings_have(solved, frequency):
    """By transmission errors alone an axial force was 1.4e-2 of its variation off."""
    system = system_in_space(machine_of(PRELOADED, FLOATING), solved)
    ours, settled = (
        np.ptp(settled_forces(system, frequency, tolerance)[1][:, :12], axis=0)
        for tolerance in (1e-4, 1e-9)
    )
    least = 1e-3 * settled.max()
    np.testing.assert_allclose(ours, settled, rtol=3e-4, atol=3e-4 * least)


def test_linearised_bearings_have_their_loads_in_motion(solved):
    """Mean forces on all bearings are those of statics, exactly with mean springs."""
    gear_set = machine_of(PRELOADED, FLOATING)
    system = system_in_space(gear_set, solved)
    time, sensed = settled_forces(system, 50.0, tolerance=1e-8)
    mean = np.trapezoid(sensed, time, axis=0) / (time[-1] - time[0])
    expected = np.concatenate(
        [-shaft.solution.reactions[:, :3].ravel() for shaft in loaded_shafts(solved)]
    )
    forces = mean[: expected.size]
    assert forces == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    # of both shafts together nothing is left but what teeth exchange
    total = forces.reshape(-1, 3).sum(axis=0)
    assert total == pytest.approx(0.0, abs=1e-6 * np.abs(expected).max())
