"""Steady vibration of spinning shafts: closed forms, another solution and balances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from machines_in_space import random_machine

from lumped.rotors.description import Bearing, Disk, Rotor, RotorSystem, Section
from lumped.rotors.matrices import assemble
from lumped.rotors.response import (
    HarmonicForce,
    bearing_forces,
    mean_power,
    steady_response,
)
from lumped.rotors.whirl import WhirlProblem

SPEED = 210.0  # rad/s


def one_disk(stiffness=2e6, damping=40.0, mass=3.0):
    """A disk on a short stiff shaft between two equal bearings."""
    bearings = tuple(
        Bearing(
            position=position,
            stiffness=(0.5 * stiffness, 0.0, 0.0, 0.5 * stiffness),
            damping=(0.5 * damping, 0.0, 0.0, 0.5 * damping),
            axial_stiffness=0.25 * stiffness,
        )
        for position in (0.0, 0.1)
    )
    rotor = Rotor(
        name="disk",
        sections=(Section(length=0.1, diameter=0.08),),
        disks=(
            Disk(
                position=0.05,
                mass=mass,
                polar_inertia=1e-2,
                transverse_inertia=1e-2,
            ),
        ),
        bearings=bearings,
        young_modulus=2e14,
        shear_modulus=8e13,
        density=1e-6,
    )
    return RotorSystem(rotors=(rotor,), elements=2, axial_motion=True)


def random_forces(rng, size, count=3):
    return [
        HarmonicForce(
            order=float(order), force=rng.normal(size=size) + 1j * rng.normal(size=size)
        )
        for order in rng.uniform(0.5, 40.0, count)
    ]


@pytest.mark.parametrize("order", [0.5, 3.0, 9.0])
def test_a_disk_on_springs_is_an_oscillator(order):
    system = one_disk()
    matrices = assemble(system)
    force = np.zeros(matrices.size, complex)
    force[matrices.index(0, 0.05, "x")] = 5.0
    problem = WhirlProblem(matrices)
    motion = steady_response(problem, [HarmonicForce(order, force)], SPEED, 0.0)
    frequency = order * SPEED
    expected = 5.0 / (2e6 - 3.0 * frequency**2 + 40j * frequency)
    assert motion[0, matrices.index(0, 0.05, "x")] == pytest.approx(expected, rel=1e-5)
    forces = bearing_forces(system, matrices, np.array([frequency]), motion)
    of_half = -(1e6 + 20j * frequency) * expected
    for one in forces:
        assert one[0] == pytest.approx([of_half, 0.0, 0.0], rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_response_is_that_of_the_physical_equations(seed):
    """Without modes, but for the damping ratio, which is theirs."""
    rng = np.random.default_rng([73, seed])
    system = random_machine(rng)
    matrices = assemble(system)
    problem = WhirlProblem(matrices)
    for one in random_forces(rng, matrices.size):
        (motion,) = steady_response(problem, [one], SPEED, 0.0)
        w = one.order * SPEED
        dynamic = matrices.stiffness - w**2 * matrices.mass
        dynamic = dynamic + 1j * w * (matrices.damping + SPEED * matrices.gyroscopic)
        # a force without work on rotations that nothing resists
        force = matrices.mass @ problem.basis @ (problem.basis.T @ one.force)
        expected = np.linalg.solve(dynamic, force)
        scale = np.abs(expected).max()
        assert motion == pytest.approx(expected, abs=1e-6 * scale)


@pytest.mark.parametrize("seed", range(6))
def test_power_of_forces_is_that_of_damping(seed):
    rng = np.random.default_rng([74, seed])
    matrices = assemble(random_machine(rng))
    problem = WhirlProblem(matrices)
    ratio = 0.03
    for one in random_forces(rng, matrices.size):
        (motion,) = steady_response(problem, [one], SPEED, ratio)
        velocity = 1j * one.order * SPEED * motion
        # shapes have unit modal mass
        modal = problem.basis.T @ matrices.mass @ velocity
        of_modes = (2.0 * ratio * np.sqrt(problem.squares) * np.abs(modal) ** 2).sum()
        of_bearings = np.vdot(velocity, matrices.damping @ velocity).real
        power = mean_power(one, motion, SPEED)
        assert power > 0.0
        assert power == pytest.approx(0.5 * (of_modes + of_bearings), rel=1e-8)


def test_forces_at_rest_give_the_deflection_at_rest():
    rng = np.random.default_rng(75)
    matrices = assemble(random_machine(rng))
    problem = WhirlProblem(matrices)
    (one,) = random_forces(rng, matrices.size, 1)
    (motion,) = steady_response(problem, [one], 0.0, 0.04)
    force = matrices.mass @ problem.basis @ (problem.basis.T @ one.force)
    left = matrices.stiffness @ motion - force
    assert np.abs(left).max() < 1e-6 * np.abs(force).max()


@pytest.mark.parametrize("ratio", [0.0, 0.04], ids=["bearings alone", "modal too"])
def test_cross_stiffness_grows_where_it_exceeds_damping_times_frequency(ratio):
    """Both axes: m x'' + c x' + k x = -q y grows for q above c sqrt(k/m)."""
    stiffness, damping, mass = 2e6, 40.0, 3.0
    frequency = np.sqrt(stiffness / mass)
    limit = (damping + 2.0 * ratio * mass * frequency) * frequency
    (rotor,) = one_disk(stiffness, damping, mass).rotors
    disk = replace(rotor.disks[0], polar_inertia=1e-3, transverse_inertia=1e-3)

    def grows(cross):
        half = 0.5 * stiffness, 0.5 * cross, -0.5 * cross, 0.5 * stiffness
        bearings = tuple(replace(one, stiffness=half) for one in rotor.bearings)
        crossed = replace(rotor, bearings=bearings, disks=(disk,))
        system = RotorSystem(rotors=(crossed,), elements=2, axial_motion=True)
        return WhirlProblem(assemble(system)).grows(0.0, ratio)

    assert not grows(0.0)
    assert not grows(0.999 * limit)
    assert grows(1.001 * limit)


@pytest.mark.parametrize("cross", [0.0, 1e5, 1e8])
def test_growth_is_that_of_the_modes(cross):
    """Cross stiffness against little damping of all bearings."""
    system = random_machine(np.random.default_rng(4))
    turned, damping = np.array([0.0, cross, -cross, 0.0]), (1e3, 0.0, 0.0, 1e3)
    rotors = tuple(
        replace(
            rotor,
            bearings=tuple(
                replace(
                    one,
                    stiffness=tuple((one.stiffness + turned).tolist()),
                    damping=damping,
                )
                for one in rotor.bearings
            ),
        )
        for rotor in system.rotors
    )
    problem = WhirlProblem(assemble(replace(system, rotors=rotors)))
    assert problem.is_dissipative == (cross == 0.0)
    for speed in (0.0, SPEED):
        modes = problem.solve(speed)
        assert problem.grows(speed) == (modes.instability is not None)
        assert problem.grows(speed) == (cross == 1e8)
