"""Axes that yield under the forces of slices, beside axes that are moved."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sliced_pairs import TORQUE, WIDTH, problem, slope

from fegear.contact.solve import solve_cycle
from fegear.contact.width.supports import (
    MOTIONS,
    AxisSupports,
    GearSupport,
)

HELD = GearSupport(np.zeros((MOTIONS, MOTIONS)), np.zeros(MOTIONS))
CASES = {
    "straight": {},
    "helical": {"helix_angle_deg": 18.0},
    "left-handed": {"helix_angle_deg": -18.0},
    "ring": {"helix_angle_deg": 18.0, "ring": "driven"},
    "ring that drives": {"ring": "driver"},
}
PLACES = np.array([0.1, 0.6])


def supported(contact, driver=HELD, driven=HELD):
    solver = replace(contact.solver, supports=AxisSupports(driver, driven))
    return replace(contact, solver=solver)


def moved(*motions):
    return GearSupport(HELD.compliance, np.array(motions) / TORQUE)


def random_compliance(rng):
    """Symmetrical and positive, of a size that matters beside the teeth."""
    root = rng.normal(size=(MOTIONS, MOTIONS))
    scale = np.diag([1.0, 1.0, 1.0, 60.0, 60.0])  # slopes over half a width of 17 mm
    return 3e-10 * scale @ root @ root.T @ scale


@pytest.mark.parametrize("kind", CASES)
def test_forces_are_those_of_the_torque(kind):
    """Along the push, off the axis of the other gear, and along the axis."""
    contact = problem(corner_contact=False, **CASES[kind])
    cycle = solve_cycle(contact, TORQUE, PLACES)
    pair = contact.pair
    push = TORQUE / pair.driver_arm
    for at in range(PLACES.size):
        driver, driven = cycle.face.axis_loads[0, at]
        # flanks without relief touch on the path of contact
        assert driver[:2] == pytest.approx([-push, 0.0], rel=1e-9)
        assert driven[:3] == pytest.approx(-driver[:3], rel=1e-9)
        axial = TORQUE * pair.driver.twist * pair.driver.sign
        assert driver[2] == pytest.approx(-axial, rel=1e-9, abs=1e-9 * push)


@pytest.mark.parametrize("kind", CASES)
def test_moments_of_both_gears_balance(kind):
    """The axial force alone has an arm from one axis to the other.

    Wherever lines of contact end within a slice.
    """
    contact = problem(corner_contact=False, gap=slope(3e-6), **CASES[kind])
    face = solve_cycle(contact, TORQUE, np.arange(16) / 16).face
    driver, driven = np.moveaxis(face.axis_loads[0], 1, 0)
    both = (driver + driven)[:, 3:]
    pair = contact.pair
    bases = pair.driver.base_radius + pair.driven.base_radius
    expected = np.outer(driven[:, 2], [pair.line_of_action, bases])
    scale = np.abs(driver[:, 3:]).max()
    np.testing.assert_allclose(both, expected, atol=1e-9 * scale)


@pytest.mark.parametrize("kind", CASES)
def test_a_yielding_axis_is_one_that_its_own_loads_have_moved(kind):
    rng = np.random.default_rng(73)
    contact = problem(gap=slope(3e-6), **CASES[kind])
    compliances = [random_compliance(rng) for _ in range(2)]
    yielding = supported(
        contact, *(GearSupport(one, np.zeros(MOTIONS)) for one in compliances)
    )
    expected = solve_cycle(yielding, TORQUE, PLACES)
    held = solve_cycle(contact, TORQUE, PLACES)
    assert np.abs(expected.ste - held.ste).max() > 0.05 * np.ptp(held.face.load) / 1e12
    for at in range(PLACES.size):
        loads = expected.face.axis_loads[0, at]
        axes = [
            moved(*(one @ load)) for one, load in zip(compliances, loads, strict=True)
        ]
        again = solve_cycle(supported(contact, *axes), TORQUE, PLACES)
        assert again.ste[0, at] == pytest.approx(expected.ste[0, at], rel=1e-4)
        scale = expected.face.load.max()
        deviation = np.abs(again.face.load[0, at] - expected.face.load[0, at])
        assert deviation.max() < 3e-3 * scale


@pytest.mark.parametrize("kind", ["straight", "ring that drives"])
def test_a_tilted_axis_is_a_misalignment(kind):
    """Away from the mate at the far end, by either gear.

    Spur gears alone: helical teeth also feel that a tilted disc moves along its axis
    where it is ahead of its centre.
    """
    depth = 8e-6
    contact = problem(**CASES[kind])
    misaligned = problem(gap=slope(depth), **CASES[kind])
    expected = solve_cycle(misaligned, TORQUE, PLACES)
    for sign, gear in ((-1.0, "driver"), (1.0, "driven")):
        tilted = moved(0.5 * sign * depth, 0.0, 0.0, sign * depth / WIDTH, 0.0)
        ours = solve_cycle(supported(contact, **{gear: tilted}), TORQUE, PLACES)
        assert ours.ste == pytest.approx(expected.ste, rel=2e-3)
        assert ours.face.distribution_factor == pytest.approx(
            expected.face.distribution_factor, rel=2e-3
        )


def test_a_free_axis_moves_along_itself_as_the_helix_lets_it():
    contact = problem(18.0, corner_contact=False)
    angle = contact.solver.driver.kernel.base_helix_angle
    held = solve_cycle(contact, TORQUE, PLACES)
    ours = solve_cycle(
        supported(contact, driven=moved(0.0, 0.0, 1e-6, 0.0, 0.0)), TORQUE, PLACES
    )
    away = 1e-6 * math.tan(angle)
    assert ours.ste - held.ste == pytest.approx(away, rel=1e-9)
    assert ours.no_load == pytest.approx(held.no_load, rel=1e-12)


def test_back_flanks_refuse_axes_of_drive_flanks():
    contact = supported(problem())
    with pytest.raises(ValueError, match="drive flanks"):
        _ = contact.solver.of_back_flanks


@pytest.mark.parametrize("kind", CASES)
def test_stiffness_against_rigid_motions_is_that_of_moved_axes(kind):
    """At a constant torque, by small motions of either axis."""
    contact = supported(problem(gap=slope(3e-6), corner_contact=False, **CASES[kind]))
    base = solve_cycle(contact, TORQUE, PLACES)
    at, step = 0, 1e-9
    stiffness = base.face.rigid_stiffness[0, at]
    assert stiffness == pytest.approx(stiffness.T, rel=1e-9, abs=1e-9 * stiffness.max())
    assert stiffness[0, 0] == pytest.approx(base.local_stiffness[0, at], rel=0.1)
    before = base.face.axis_loads[0, at].ravel()
    for gear in range(2):
        for motion in range(MOTIONS):
            q = np.zeros(MOTIONS)
            q[motion] = step if motion < 3 else step / WIDTH
            axes = [HELD, HELD]
            axes[gear] = moved(*q)
            after = solve_cycle(supported(contact, *axes), TORQUE, PLACES)
            change = after.ste[0, at] - base.ste[0, at]
            rigid = np.concatenate([[change], *(np.zeros(MOTIONS),) * 2])
            rigid[1 + MOTIONS * gear :][:MOTIONS] = q
            # loads on the gears are against the stiffness of their motions
            expected = -(stiffness @ rigid)[1:]
            loads = after.face.axis_loads[0, at].ravel() - before
            force = stiffness[0, 0] * step
            scale = np.array([force] * 3 + [force * WIDTH] * 2)
            assert (np.abs(loads - expected) < 0.02 * np.tile(scale, 2)).all()
            assert abs(stiffness[0] @ rigid) < 0.02 * force
