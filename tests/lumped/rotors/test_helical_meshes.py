"""Helical teeth between shafts, against rigid bodies in space."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles.helical_bodies import HelicalTeeth

from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorError,
    RotorSystem,
    Section,
)
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem

ANGLE, STIFFNESS, WIDTH = math.radians(21.0), 4e8, 0.04
RADII = (0.05, 0.12)
PATH = (-0.006, 0.011)  # from the pitch point
OFFSETS = (0.004, -0.003)
# of a node: x, y, tilt x, tilt y, rotation; z is apart
KINDS = ("x", "y", "z", "tilt x", "tilt y", "rotation")
GEARS = ((2.0, 4e-3, 2.3e-3), (9.0, 5e-2, 2.7e-2))  # mass, polar, transverse
SUPPORTS = (
    {"x": 8e7, "y": 1.1e8, "z": 3e7, "tilt": 2e5, "rotation": 4e4},
    {"x": 2e8, "y": 1.5e8, "z": 9e6, "tilt": 6e5, "rotation": 0.0},
)


def spring(helix, center_line=0.7, internal=False, sense=1, **changes):
    """The mesh of `teeth`, as `lumped` describes it."""
    radii = RADII[0], -RADII[1] if internal else RADII[1]
    line = center_line + (math.pi if internal else 0.0)
    angle = line + sense * (0.5 * math.pi - ANGLE)
    pitch = RADII[0] * math.tan(ANGLE)
    usual = {
        "rotors": (0, 1),
        "positions": (0.05, 0.05),
        "offsets": OFFSETS,
        "base_radii": radii,
        "direction": (math.cos(angle), math.sin(angle)),
        "sense": sense,
        "stiffness": STIFFNESS,
        "width": WIDTH,
        "base_helix_angle": helix,
        "pressure_angle": ANGLE,
        "path": (pitch + PATH[0], pitch + PATH[1]),
    }
    return MeshSpring(**usual | changes)


def teeth(helix, center_line=0.7, internal=False, sense=1, offsets=OFFSETS):
    counter_clockwise = sense > 0
    return HelicalTeeth(
        RADII,
        ANGLE,
        center_line,
        helix,
        PATH,
        WIDTH,
        internal,
        counter_clockwise,
        offsets,
    )


def pair(mesh, **changes):
    """Both gears amid short light shafts, on supports at their centres."""
    rotors = tuple(
        Rotor(
            name=str(i),
            sections=(Section(length=0.1, diameter=0.05),),
            disks=(
                Disk(
                    position=0.05,
                    mass=GEARS[i][0],
                    polar_inertia=GEARS[i][1],
                    transverse_inertia=GEARS[i][2],
                ),
            ),
            bearings=(
                Bearing(
                    position=0.05,
                    stiffness=(held["x"], 0.0, 0.0, held["y"]),
                    axial_stiffness=held["z"],
                    tilt_stiffness=held["tilt"],
                    torsional_stiffness=held["rotation"],
                ),
            ),
            young_modulus=2.1e11,
            shear_modulus=8e10,
            density=1e-6,
            speed_ratio=(1.0, -RADII[0] / RADII[1])[i],
        )
        for i, held in enumerate(SUPPORTS)
    )
    usual = {"rotors": rotors, "meshes": (mesh,), "elements": 1, "axial_motion": True}
    return RotorSystem(**usual | changes)


def at_gears(system, kinds=KINDS):
    return np.array(
        [system.index(rotor, 0.05, kind) for rotor in (0, 1) for kind in kinds]
    )


VARIANTS = pytest.mark.parametrize(
    ("center_line", "internal", "sense"),
    [(0.7, False, 1), (4.0, False, -1), (2.1, True, 1), (-0.4, True, -1)],
)
HELICES = pytest.mark.parametrize("helix", [0.0, 0.02, 0.45, -0.45])


@VARIANTS
@HELICES
def test_the_matrix_is_that_of_bodies_in_space(center_line, internal, sense, helix):
    variant = helix, center_line, internal, sense
    system = assemble(pair(spring(*variant)))
    at = at_gears(system)
    expected = teeth(*variant).matrix(STIFFNESS)
    np.testing.assert_allclose(
        system.mesh_stiffness[0][np.ix_(at, at)], expected, atol=1e-14 * STIFFNESS
    )
    others = np.setdiff1d(np.arange(system.size), at)
    assert not system.mesh_stiffness[0][others].any()


def test_the_oracle_has_forces_that_are_dual_to_displacements():
    rng = np.random.default_rng(73)
    contact = teeth(0.45)
    for motion in rng.uniform(-1.0, 1.0, (5, 12)):
        energy = contact.energy_by_displacements(STIFFNESS, motion)
        by_forces = 0.5 * motion @ contact.matrix(STIFFNESS) @ motion
        assert by_forces == pytest.approx(energy, rel=1e-13)


@VARIANTS
def test_rigid_motions_of_the_whole_machine_strain_no_mesh(
    center_line, internal, sense
):
    system = assemble(
        pair(spring(0.45, center_line, internal, sense, offsets=(0.01, 0.01)))
    )
    at, contact = at_gears(system), teeth(0.45, center_line, internal, sense)
    for theta, u in zip(np.eye(6)[:, :3], np.eye(6)[:, 3:], strict=True):
        motion = np.zeros(system.size)
        motion[at] = np.concatenate(
            [[*(u + np.cross(theta, c)), *theta] for c in contact.centers]
        )
        forces = system.mesh_stiffness[0] @ motion
        assert np.abs(forces).max() < 1e-13 * STIFFNESS


def test_of_spur_gears_the_matrix_stays_as_it_was_to_the_last_bit():
    """k (row row^T + b^2 / 12 slope slope^T), whatever the path of contact is."""
    mesh = spring(0.0)
    spur = replace(mesh, pressure_angle=None, path=None)
    for axial_motion in (False, True):
        one, other = (
            assemble(pair(m, axial_motion=axial_motion)) for m in (mesh, spur)
        )
        np.testing.assert_array_equal(one.mesh_stiffness, other.mesh_stiffness)
    cosine, sine = mesh.direction
    row, slope = np.zeros((2, 10))
    row[[0, 1, 4]] = cosine, sine, RADII[0]
    row[[5, 6, 9]] = -cosine, -sine, RADII[1]
    slope[[3, 2]], slope[[8, 7]] = (cosine, -sine), (-cosine, sine)
    row[[2, 3]] += OFFSETS[0] * slope[[2, 3]]
    row[[7, 8]] += OFFSETS[1] * slope[[7, 8]]
    expected = np.outer(row, row) + WIDTH**2 / 12.0 * np.outer(slope, slope)
    at = at_gears(one, ("x", "y", "tilt x", "tilt y", "rotation"))
    np.testing.assert_array_equal(
        one.mesh_stiffness[0][np.ix_(at, at)], STIFFNESS * expected
    )


def body_matrices(helix):
    """Mass, stiffness and gyroscopic matrix (12, 12) of both gears in space."""
    mass, stiffness = np.zeros((2, 12))
    gyroscopic = np.zeros((12, 12))
    for i, (held, (m, polar, transverse)) in enumerate(
        zip(SUPPORTS, GEARS, strict=True)
    ):
        at = slice(6 * i, 6 * i + 6)
        mass[at] = m, m, m, transverse, transverse, polar
        tilt = held["tilt"]
        stiffness[at] = (held["x"], held["y"], held["z"], tilt, tilt, held["rotation"])
        # Euler: omega x H with H along the axis, omega the rate of tilting
        momentum = polar * (1.0, -RADII[0] / RADII[1])[i]
        for rate in (3, 4):
            omega = np.eye(3)[rate - 3]
            moment = np.cross(omega, [0.0, 0.0, momentum])
            gyroscopic[6 * i + 3 : 6 * i + 6, 6 * i + rate] += moment
    return (
        np.diag(mass),
        np.diag(stiffness) + teeth(helix).matrix(STIFFNESS),
        gyroscopic,
    )


@pytest.mark.parametrize("helix", [0.02, 0.45, -0.45])
@pytest.mark.parametrize("speed", [0.0, 800.0, 6000.0])
def test_frequencies_are_those_of_two_bodies_in_space(helix, speed):
    mass, stiffness, gyroscopic = body_matrices(helix)
    inverse = np.linalg.inv(mass)
    lower = [-inverse @ stiffness, -speed * inverse @ gyroscopic]
    state = np.block([[np.zeros((12, 12)), np.eye(12)], lower])
    values = np.linalg.eigvals(state)
    expected = np.sort(values.imag[values.imag > 1.0])
    assert expected.size == 12
    problem = WhirlProblem(assemble(pair(spring(helix))))
    computed = problem.solve(speed, 12).frequency
    np.testing.assert_allclose(computed, expected, rtol=1e-9)


def test_without_axial_motion_shafts_are_held_along_their_axes():
    """As by bearings that hardly yield; a helical mesh still tilts its gears."""
    held = pair(spring(0.45), axial_motion=False)
    stiff = pair(spring(0.45))
    stiff = replace(
        stiff,
        rotors=tuple(
            replace(r, bearings=(replace(r.bearings[0], axial_stiffness=1e16),))
            for r in stiff.rotors
        ),
    )
    spur = pair(spring(0.0), axial_motion=False)
    one, other, spur = (
        WhirlProblem(assemble(s)).solve(800.0, 10) for s in (held, stiff, spur)
    )
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-7)
    assert not one.axial.any()
    assert np.abs(one.frequency / spur.frequency - 1.0).max() > 1e-3


def test_small_helix_angles_change_frequencies_by_their_square():
    """Where no offset of the teeth couples tilts with motion in the section already."""

    def frequencies(helix):
        system = assemble(pair(spring(helix, offsets=(0.0, 0.0))))
        return WhirlProblem(system).solve(800.0, 12).frequency

    spur = frequencies(0.0)
    first, second = (np.abs(frequencies(h) / spur - 1.0) for h in (2e-3, 1e-3))
    assert second.max() < 1e-5
    np.testing.assert_allclose(first / second, 4.0, rtol=1e-3)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"path": None}, "path is missing; base_helix_angle = 0.45 needs it"),
        ({"pressure_angle": None}, "pressure_angle is missing; base_helix_angle = "),
        ({"pressure_angle": 0.0}, "pressure_angle = 0"),
        ({"base_helix_angle": 2.0}, "base_helix_angle = 2.0; must be above -1.57"),
    ],
)
def test_what_is_refused(wrong, message):
    with pytest.raises((RotorError, ValueError), match=message):
        spring(0.45, **wrong)
