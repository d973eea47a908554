"""Machines in a housing: closed forms, limits and matrices of another assembly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_rotors import dense_eigenvalues, dense_machine
from free_housings import (
    bearing_nodes,
    free_block,
    node_motions,
    random_definite,
    random_housing,
)
from machines_in_space import random_machine

from lumped.rotors.description import (
    Bearing,
    Disk,
    LinearisedSupport,
    Rotor,
    RotorError,
    RotorSystem,
    Section,
)
from lumped.rotors.frames import rotating_frame
from lumped.rotors.housing import Housing, HousingError, HousingNode
from lumped.rotors.matrices import assemble
from lumped.rotors.response import (
    HarmonicForce,
    bearing_forces,
    housing_accelerations,
    mean_power,
    steady_response,
)
from lumped.rotors.whirl import WhirlProblem, mode_kind

SPEED = 300.0  # rad/s
LENGTH = 0.4
ROTOR = Rotor(
    name="shaft",
    sections=(Section(length=LENGTH, diameter=0.04),),
    disks=(Disk(position=0.3, mass=8.0, polar_inertia=0.05, transverse_inertia=0.03),),
    bearings=tuple(
        Bearing(
            position=position,
            stiffness=(1e8, 0.0, 0.0, 2e8),
            damping=(200.0, 0.0, 0.0, 300.0),
            axial_stiffness=axial,
            tilt_stiffness=2e4,
        )
        for position, axial in ((0.0, 5e7), (LENGTH, 1e7))
    ),
    young_modulus=2.06e11,
    shear_modulus=7.9e10,
    density=7850.0,
)
POINTS = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, LENGTH]])
ON_GROUND = RotorSystem(rotors=(ROTOR,), elements=4, axial_motion=True)


def undamped(system):
    rotors = tuple(
        replace(
            rotor,
            bearings=tuple(replace(one, damping=(0.0,) * 4) for one in rotor.bearings),
        )
        for rotor in system.rotors
    )
    return replace(system, rotors=rotors)


def frequencies(system, count=10, speed=SPEED):
    return WhirlProblem(assemble(system)).solve(speed, count).frequency


def diagonal_housing(system, stiffness):
    """Massless springs under every bearing, alike in the order of coordinates."""
    nodes = bearing_nodes(system)
    values = np.tile(stiffness, len(nodes))
    size = len(values)
    return Housing(stiffness=np.diag(values), mass=np.zeros((size, size)), nodes=nodes)


@pytest.mark.parametrize("axial_motion", [False, True])
def test_massless_springs_are_in_series_with_the_bearings(axial_motion):
    system = undamped(replace(ON_GROUND, axial_motion=axial_motion))
    under = np.array([3e8, 1e8, 7e7, 5e4, 9e4, 1e5])
    housing = diagonal_housing(system, under)

    def in_series(bearing):
        kx, _, _, ky = bearing.stiffness
        tilt, kz = bearing.tilt_stiffness, bearing.axial_stiffness
        springs = np.array([kx, ky, kz, tilt, tilt])
        both = springs * under[:5] / (springs + under[:5])
        support = LinearisedSupport(stiffness=np.diag(both), force=np.zeros(5))
        return replace(bearing, linearised=support)

    (rotor,) = system.rotors
    joined = replace(rotor, bearings=tuple(map(in_series, rotor.bearings)))
    one = frequencies(replace(system, housing=housing))
    assert one == pytest.approx(
        frequencies(replace(system, rotors=(joined,))), rel=1e-9
    )


def test_a_stiff_housing_is_ground():
    """The error falls as the inverse of its stiffness."""
    on_ground = frequencies(undamped(ON_GROUND))
    errors = []
    for factor in (1e3, 1e4, 1e5, 1e6):
        rng = np.random.default_rng(91)
        nodes = bearing_nodes(ON_GROUND)
        stiffness = random_definite(rng, np.full(12, 2e8 * factor))
        mass = random_definite(rng, np.full(12, 1e-3))
        housing = Housing(stiffness=stiffness, mass=mass, nodes=nodes)
        held = frequencies(undamped(replace(ON_GROUND, housing=housing)))
        errors.append(np.abs(held / on_ground - 1.0).max())
    rates = -np.diff(np.log10(errors))
    assert rates == pytest.approx(1.0, abs=0.03)
    assert errors[-1] < 1e-5


@pytest.mark.parametrize("seed", range(4))
def test_a_random_housing_with_modes_beside_another_assembly(seed):
    rng = np.random.default_rng([92, seed])
    nodes = (HousingNode(0, 1), None, HousingNode(0, 0))
    housing = random_housing(rng, nodes, modes=3)
    tangent = random_definite(rng, np.array([1e8, 1e8, 5e7, 2e4, 2e4]))
    support = LinearisedSupport(stiffness=tangent, force=np.zeros(5))
    first, second = ROTOR.bearings
    rotor = replace(ROTOR, bearings=(replace(first, linearised=support), second))
    system = replace(ON_GROUND, rotors=(rotor,), housing=housing)
    damping = np.diag([200.0, 300.0, 0.0, 0.0, 0.0])
    of_second = np.diag([1e8, 2e8, 1e7, 2e4, 2e4])
    tensors = [(0, tangent, damping, 12), (4, of_second, damping, 0)]
    expected = dense_eigenvalues(dense_machine(rotor, 4, tensors, housing), SPEED)
    solved = WhirlProblem(assemble(system)).solve(SPEED, 20).eigenvalues
    assert solved == pytest.approx(expected[:20], rel=1e-7)


def test_bearings_without_a_node_stay_on_ground():
    rng = np.random.default_rng(93)
    housing = random_housing(rng, (HousingNode(0, 1), None))
    system = replace(ON_GROUND, housing=housing)
    damping = np.diag([200.0, 300.0, 0.0, 0.0, 0.0])
    stiffnesses = [np.diag([1e8, 2e8, kz, 2e4, 2e4]) for kz in (5e7, 1e7)]
    tensors = [(0, stiffnesses[0], damping, None), (4, stiffnesses[1], damping, 0)]
    expected = dense_eigenvalues(dense_machine(ROTOR, 4, tensors, housing), SPEED)
    solved = WhirlProblem(assemble(system)).solve(SPEED, 15).eigenvalues
    assert solved == pytest.approx(expected[:15], rel=1e-7)


def test_a_free_block_has_six_frequencies_of_zero():
    rng = np.random.default_rng(94)
    block = free_block(rng, POINTS, (None, None))
    alone = WhirlProblem(assemble(replace(ON_GROUND, housing=block)))
    assert (alone.squares == 0.0).sum() == 6
    on_ground = WhirlProblem(assemble(ON_GROUND))
    assert alone.rigid_motions == on_ground.rigid_motions == 1
    elastic = np.sqrt(on_ground.squares[:6])
    assert np.sqrt(alone.squares[6:12]) == pytest.approx(elastic, rel=1e-9)


def test_a_floating_machine_moves_as_one_body():
    rng = np.random.default_rng(95)
    block = free_block(rng, POINTS, bearing_nodes(ON_GROUND))
    matrices = assemble(replace(ON_GROUND, housing=block))
    body = np.zeros((matrices.size, 6))
    for node, position in enumerate(matrices.nodes[0]):
        motion = node_motions([[0.0, 0.0, position]])
        body[5 * node : 5 * node + 5] = motion[[0, 1, 3, 4, 5]]
        body[5 * matrices.node_count + node] = motion[2]
    body[matrices.shaft_size :] = node_motions(POINTS)
    inertia = body.T @ matrices.mass @ body
    shaft = 7850.0 * 0.25 * np.pi * 0.04**2 * LENGTH + 8.0
    assert np.diag(inertia)[:3] == pytest.approx(shaft + 30.0)
    assert np.abs(matrices.stiffness @ body).max() < 1e-9 * matrices.stiffness.max()
    problem = WhirlProblem(matrices)
    # and the shaft rotates in its bearings
    assert (problem.squares == 0.0).sum() + problem.rigid_motions == 7


@pytest.mark.parametrize("seed", range(4))
def test_power_of_forces_is_that_of_damping(seed):
    rng = np.random.default_rng([96, seed])
    system = random_machine(rng)
    nodes = (*bearing_nodes(system), None)
    housing = random_housing(rng, nodes, modes=2)
    matrices = assemble(replace(system, housing=housing))
    problem, ratio = WhirlProblem(matrices), 0.02
    for order in rng.uniform(0.5, 30.0, 3):
        force = rng.normal(size=matrices.size) + 1j * rng.normal(size=matrices.size)
        one = HarmonicForce(float(order), force)
        (motion,) = steady_response(problem, [one], SPEED, ratio)
        velocity = 1j * order * SPEED * motion
        modal = problem.basis.T @ matrices.mass @ velocity
        of_modes = (2.0 * ratio * np.sqrt(problem.squares) * np.abs(modal) ** 2).sum()
        of_dampers = np.vdot(velocity, matrices.damping @ velocity).real
        assert of_dampers > 0.0
        power = mean_power(one, motion, SPEED)
        assert power == pytest.approx(0.5 * (of_modes + of_dampers), rel=1e-8)


def test_bearings_push_the_shaft_by_what_they_push_the_housing():
    """Slowly, the shaft is in equilibrium, and so are feet and bearings."""
    rng = np.random.default_rng(97)
    housing = random_housing(rng, (HousingNode(0, 0), HousingNode(0, 1), None))
    system = replace(ON_GROUND, housing=housing)
    matrices = assemble(system)
    force = np.zeros(matrices.size, complex)
    for kind, value in zip(("x", "y", "z"), (3.0, -2.0, 5.0), strict=True):
        force[matrices.index(0, 0.3, kind)] = value
    problem, order = WhirlProblem(matrices), 1e-6
    motion = steady_response(problem, [HarmonicForce(order, force)], 1.0, 0.0)
    forces = bearing_forces(system, matrices, np.array([order]), motion)
    assert np.sum(forces, axis=0)[0] == pytest.approx([-3.0, 2.0, -5.0], rel=1e-6)
    in_feet = housing.stiffness @ motion[0, matrices.shaft_size :]
    for node, one in enumerate(forces):
        assert in_feet[6 * node : 6 * node + 3] == pytest.approx(-one[0], rel=1e-6)
    frequencies = np.array([200.0])
    accelerations = housing_accelerations(system, matrices, frequencies, motion)
    assert len(accelerations) == 3
    expected = -(200.0**2) * motion[:, matrices.shaft_size + 12 : matrices.size][:, :3]
    assert accelerations[2] == pytest.approx(expected)


def test_modes_of_a_heavy_housing_on_soft_feet_are_its_own():
    rng = np.random.default_rng(98)
    block = free_block(rng, POINTS, bearing_nodes(ON_GROUND), mass=500.0, inertia=20.0)
    feet = np.diag(np.tile([1e6, 1e6, 1e6, 1e4, 1e4, 1e4], 2))
    housing = replace(block, stiffness=block.stiffness + feet)
    modes = WhirlProblem(assemble(replace(ON_GROUND, housing=housing))).solve(0.0, 20)
    parts = zip(modes.whirl, modes.torsion, modes.axial, modes.housing, strict=True)
    kinds = [mode_kind(*one) for one in parts]
    assert kinds[:6] == ["housing"] * 6
    mass = 500.0 + 8.0 + 7850.0 * 0.25 * np.pi * 0.04**2 * LENGTH
    assert modes.frequency[:6].min() < np.sqrt(2e6 / mass) * 1.05
    total = modes.torsion + modes.axial + modes.housing
    assert (total <= 1.0 + 1e-9).all()


def housing_of(**changes):
    values = {"stiffness": np.eye(12), "mass": np.eye(12), "nodes": (None, None)}
    return Housing(**(values | changes))


def changed(row, column, value):
    matrix = np.eye(12)
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"stiffness": np.eye(11)}, "stiffness is 11 x 11; must have 6 rows for each"),
        ({"mass": np.eye(13)}, "mass is 13 x 13; must be square, 12 x 12"),
        ({"damping": np.ones((12, 3))}, "damping is 12 x 3; must be square, 12 x 12"),
        ({"mass": changed(0, 3, np.nan)}, r"mass\(1, 4\) = nan; must be finite"),
        (
            {"stiffness": changed(0, 3, 1e-3)},
            r"stiffness\(1, 4\) = 0.001 and stiffness\(4, 1\) = 0; the matrix must be",
        ),
        (
            {"mass": changed(2, 2, -1.0)},
            "mass has an eigenvalue of -1 times the largest",
        ),
        (
            {"nodes": (HousingNode(0, 1), HousingNode(0, 1))},
            "nodes row 1 = 1, 2; the bearing is named more than once",
        ),
    ],
)
def test_matrices_and_nodes_that_are_refused(values, message):
    with pytest.raises(HousingError, match=message):
        housing_of(**values)


def test_small_deviations_of_printed_digits_are_taken():
    housing = housing_of(stiffness=changed(0, 3, 5e-9), nodes=(HousingNode(0, 0), None))
    problem = WhirlProblem(assemble(replace(undamped(ON_GROUND), housing=housing)))
    assert problem.is_hermitian


@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_coordinates_without_stiffness_and_mass_do_nothing(noise):
    """Solid elements have no rotations, and condensed matrices few exact zeros."""
    rng = np.random.default_rng(101)
    held = np.diag(np.tile([1e10, 2e10, 1e10, 0.0, 0.0, 0.0], 2))
    rough = held + noise * rng.normal(size=held.shape)
    nodes = bearing_nodes(ON_GROUND)
    housing = Housing(stiffness=rough, mass=1e-9 * held, nodes=nodes)
    # bearings on rings that turn freely are hinges
    bearings = tuple(replace(one, tilt_stiffness=0.0) for one in ROTOR.bearings)
    hinges = replace(ON_GROUND, rotors=(replace(ROTOR, bearings=bearings),))
    of_rotations = np.diag(np.tile([0.0, 0.0, 0.0, 1e5, 1e5, 1e5], 2))
    full = Housing(stiffness=held + of_rotations, mass=1e-9 * held, nodes=nodes)
    expected = frequencies(replace(hinges, housing=full))
    for system in (hinges, ON_GROUND):
        solved = frequencies(replace(system, housing=housing))
        assert solved == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("node", "message"),
    [
        (HousingNode(1, 0), "rotor index = 1; must be 0 to 0"),
        (HousingNode(0, 2), "bearing index = 2; rotor 0 has 2 bearings"),
    ],
)
def test_bearings_that_no_rotor_has_are_refused(node, message):
    with pytest.raises(RotorError, match=message):
        replace(ON_GROUND, housing=housing_of(nodes=(node, None)))


def test_a_motion_without_stiffness_and_mass_is_refused():
    pair = np.eye(12)
    pair[10:, 10:] = 1.0  # the difference of both has neither
    housing = housing_of(stiffness=1e8 * pair, mass=pair)
    with pytest.raises(RotorError, match="neither stiffness nor mass"):
        WhirlProblem(assemble(replace(ON_GROUND, housing=housing)))


def test_a_frame_that_turns_has_no_housing():
    system = replace(ON_GROUND, housing=housing_of())
    with pytest.raises(RotorError, match="a housing does not turn"):
        rotating_frame(system)
