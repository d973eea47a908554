"""Double helical gears: two halves side by side, free along the axis."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sliced_pairs import TORQUE, WIDTH, problem, slope

from fegear.contact.solve import solve_cycle
from fegear.contact.width.double import half_faces
from fegear.contact.width.load_curves import interpolated_curves

GROOVE = 6e-3
POSITIONS = np.arange(8) / 8.0
HELIX = 18.0


def double(gaps=(None, None), **changes):
    """A pair of two halves; gaps : of the near and of the far one."""
    near, far = (problem(HELIX, gap).solver for gap in gaps)
    far = replace(far.mirrored, gap=far.gap)
    solver = replace(near, far=far, groove=GROOVE)
    whole = problem(HELIX, **changes)
    return replace(whole, solver=solver, face_width=2.0 * WIDTH)


def test_two_halves_are_twice_as_stiff_as_one():
    half = solve_cycle(problem(HELIX), [TORQUE], POSITIONS)
    both = solve_cycle(double(), [2.0 * TORQUE], POSITIONS)
    assert both.ste == pytest.approx(half.ste, rel=1e-9)
    assert both.stiffness == pytest.approx(2.0 * half.stiffness, rel=1e-9)
    assert both.local_stiffness == pytest.approx(2.0 * half.local_stiffness, rel=1e-6)
    assert both.load == pytest.approx(2.0 * half.load, rel=1e-8)
    assert both.driven_torque == pytest.approx(2.0 * half.driven_torque, rel=1e-9)
    face, most = both.face, half.face.load.max()
    assert not face.axial_force_on_driver.any()
    assert half.face.axial_force_on_driver.all()
    assert both.axial_float == pytest.approx(0.0, abs=1e-12)
    # the far half is the near one in a mirror
    assert np.abs(face.load - face.load[..., ::-1]).max() < 1e-7 * most
    assert face.place == pytest.approx(-face.place[::-1])
    assert face.place[len(face.place) // 2] > 0.5 * GROOVE
    assert face.center == pytest.approx(0.0, abs=1e-7 * WIDTH)


@pytest.mark.parametrize("seed", range(3))
def test_a_free_gear_goes_where_axial_forces_are_equal(seed):
    """Halves whose gaps are those after the shift have one transmission error.

    Forces of tip corners have other arms, so that equal torques are theirs to 4e-4.
    """
    on_path = {"corner_contact": False}
    chance = np.random.default_rng([72, seed])
    near, far = (slope(depth) for depth in chance.uniform(-15e-6, 15e-6, 2))
    shift = chance.uniform(-10e-6, 10e-6)
    free = solve_cycle(
        double((near, lambda z: far(z) + shift), **on_path),
        [2.0 * TORQUE],
        POSITIONS,
    )
    forces = [half.load.sum(axis=(2, 3)) for half, _ in half_faces(free.face)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)
    base_helix = free.face.base_helix_angle
    assert base_helix > 0.0
    for n, moved in enumerate(free.axial_float[0]):
        closed = moved * math.tan(base_helix)
        gaps = lambda z, c=closed: near(z) - c, lambda z, c=closed: far(z) + shift + c
        one, other = (
            solve_cycle(
                replace(problem(HELIX, **on_path), solver=half),
                [TORQUE],
                POSITIONS[[n]],
            )
            for half in double(gaps).solver.halves
        )
        assert one.ste == pytest.approx(other.ste, rel=1e-9)
        assert one.ste[0, 0] == pytest.approx(free.ste[0, n], rel=1e-9)


def test_back_flanks_carry_as_drive_flanks_in_a_mirror():
    contact = double((slope(8e-6), None))
    forward = solve_cycle(contact, [2.0 * TORQUE], POSITIONS)
    back = solve_cycle(contact, [-2.0 * TORQUE], -POSITIONS)
    assert (back.load <= 0.0).all()
    assert back.stiffness.mean() == pytest.approx(forward.stiffness.mean(), rel=0.1)


def test_halves_that_are_pressed_together_carry_twice():
    contact = double()
    penetration = np.linspace(0.0, 20e-6, 9)
    one = interpolated_curves(
        problem(HELIX), contact.solver.halves[0], POSITIONS, penetration
    )
    both = interpolated_curves(contact, contact.solver, POSITIONS, penetration)
    assert both.load == pytest.approx(2.0 * one.load, rel=1e-6)
    assert both.coupling == pytest.approx(0.5 * one.coupling, rel=1e-6)
    assert both.gap == pytest.approx(one.gap, abs=1e-12)
