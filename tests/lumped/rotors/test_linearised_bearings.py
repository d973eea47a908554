"""Spinning shafts on linearised bearings: their tangents, and linear bearings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from machines_in_space import random_machine
from shafts_at_rest import random_loads, shaft

from lumped.bearings.mounted import MountedBearing
from lumped.bearings.rolling import BallBearing
from lumped.rotors.bearing_matrices import is_isotropic
from lumped.rotors.description import Bearing, LinearisedSupport, RotorSystem
from lumped.rotors.frames import rotating_frame
from lumped.rotors.matrices import assemble
from lumped.rotors.response import HarmonicForce, bearing_forces, steady_response
from lumped.rotors.rolling_statics import RollingSupport, rolling_shaft_statics
from lumped.rotors.statics import ShaftLoad
from lumped.rotors.whirl import WhirlProblem

BALL = BallBearing(balls=9, element_diameter=7.94e-3, pitch_diameter=38.5e-3)
SUPPORTS = [
    RollingSupport(
        position=place,
        mounted=MountedBearing(bearing=BALL, contact_angle=angle, axial_preload=1e-5),
    )
    for place, angle in ((0.05, -0.4), (0.75, 0.4))
]
SPEED = 300.0  # rad/s


def linearised(bearing, stiffness=None):
    """The bearing with the diagonal of its stiffness as a linearised one."""
    if stiffness is None:
        kx, _, _, ky = bearing.stiffness
        tilt = bearing.tilt_stiffness
        stiffness = np.diag([kx, ky, bearing.axial_stiffness, tilt, tilt])
    support = LinearisedSupport(stiffness=stiffness, force=np.zeros(5))
    return Bearing(
        position=bearing.position,
        stiffness=(0.0, 0.0, 0.0, 0.0),
        torsional_stiffness=bearing.torsional_stiffness,
        linearised=support,
    )


def with_bearings(system, change):
    rotors = tuple(
        replace(rotor, bearings=tuple(map(change, rotor.bearings)))
        for rotor in system.rotors
    )
    return replace(system, rotors=rotors)


def tangents_under_load():
    loads = random_loads(np.random.default_rng(81), (0.3, 0.6))
    statics = rolling_shaft_statics(shaft([]), SUPPORTS, loads)
    return statics, statics.motions_of_bearings(statics.solve(loads))


def test_the_tangent_is_a_difference_quotient_of_the_bearing_s_own_forces():
    statics, motions = tangents_under_load()
    steps = np.array([1e-9, 1e-9, 1e-9, 1e-7, 1e-7])
    for support, bearing, motion in zip(
        SUPPORTS, statics.rotor.bearings, motions, strict=True
    ):
        columns = [
            (
                support.mounted.state(motion + step).force
                - support.mounted.state(motion - step).force
            )
            / (2.0 * step.sum())
            for step in np.diag(steps)
        ]
        tangent, quotient = bearing.linearised.stiffness, np.array(columns).T
        scale = np.sqrt(np.outer(np.diag(tangent), np.diag(tangent)))
        assert (tangent == tangent.T).all()
        assert np.abs((quotient - tangent) / scale).max() < 1e-6


@pytest.mark.parametrize("axial_motion", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_a_diagonal_tangent_is_a_linear_bearing(seed, axial_motion):
    system = random_machine(np.random.default_rng([82, seed]))
    if not axial_motion:
        flat = tuple(replace(mesh, base_helix_angle=0.0) for mesh in system.meshes)
        system = replace(system, axial_motion=False, meshes=flat)
    changed = with_bearings(system, linearised)
    one, other = (
        WhirlProblem(assemble(machine)).solve(SPEED, 12).frequency
        for machine in (system, changed)
    )
    assert other == pytest.approx(one, rel=1e-12)


def single_shaft(change=lambda stiffness: stiffness, axial_motion=True):
    """A shaft on preloaded bearings that are linearised under load."""
    statics, _ = tangents_under_load()
    bearings = tuple(
        linearised(bearing, change(bearing.linearised.stiffness.copy()))
        for bearing in statics.rotor.bearings
    )
    rotor = replace(statics.rotor, bearings=bearings)
    return RotorSystem(rotors=(rotor,), axial_motion=axial_motion)


def without_coupling(stiffness):
    stiffness[2, [0, 1, 3, 4]] = stiffness[[0, 1, 3, 4], 2] = 0.0
    return stiffness


def test_axial_motion_and_tilt_are_coupled_by_angular_contact():
    coupled, alone = (
        WhirlProblem(assemble(machine)).solve(0.0, 4).frequency
        for machine in (single_shaft(), single_shaft(without_coupling))
    )
    assert np.abs(coupled / alone - 1.0).max() > 0.01


def test_rows_along_the_axis_are_left_out_in_the_plane():
    held = WhirlProblem(assemble(single_shaft(axial_motion=False)))
    alone = WhirlProblem(assemble(single_shaft(without_coupling, axial_motion=False)))
    one, other = (problem.solve(SPEED, 6).frequency for problem in (held, alone))
    assert one == pytest.approx(other, rel=1e-12)


def test_forces_of_bearings_balance_a_force_that_acts_slowly():
    system = single_shaft()
    matrices = assemble(system)
    problem = WhirlProblem(matrices)
    force = np.zeros(matrices.size, complex)
    position = system.rotors[0].length
    for kind, value in zip(("x", "y", "z"), (3.0, -2.0, 5.0), strict=True):
        force[matrices.index(0, position, kind)] = value
    motion = steady_response(problem, [HarmonicForce(1e-6, force)], 1.0, 0.0)
    forces = bearing_forces(system, matrices, np.array([1e-6]), motion)
    total = np.sum(forces, axis=0)[0]
    assert total == pytest.approx([-3.0, 2.0, -5.0], rel=1e-6)


def test_a_frame_that_turns_takes_bearings_that_are_alike_in_all_directions():
    thrust = ShaftLoad(position=0.3, force=(0.0, 0.0, 300.0))
    statics = rolling_shaft_statics(shaft([]), SUPPORTS, [thrust])
    alike = replace(statics.rotor, speed_ratio=1.0)
    assert all(map(is_isotropic, alike.bearings))
    system = RotorSystem(rotors=(alike,), axial_motion=True)
    fixed = WhirlProblem(assemble(system)).solve(0.0, 8).frequency
    turning = WhirlProblem(rotating_frame(system)).solve(0.0, 8).frequency
    assert turning == pytest.approx(fixed, rel=1e-6)
    loaded, _ = tangents_under_load()
    with pytest.raises(ValueError, match="differs in x and y"):
        rotating_frame(replace(system, rotors=(loaded.rotor,)))
