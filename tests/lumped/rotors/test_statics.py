"""Shafts at rest against closed forms, and the balance of their forces."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shafts_at_rest import (
    AREA,
    BENDING,
    DIAMETER,
    LENGTH,
    SLIDING,
    YOUNG,
    bearing,
    random_loads,
    shaft,
)

from lumped.rotors.beams import bending_stiffness
from lumped.rotors.description import Bearing, Disk, RotorError, Section
from lumped.rotors.free_shafts import shear_coefficient
from lumped.rotors.statics import ShaftLoad, shaft_statics

SOFT, HARD = 4e7, 9e7  # N/m, of bearings
TWO = (bearing(0.0, SOFT), bearing(LENGTH, HARD))
AT = 0.25  # m, of the load


def node(solution, position):
    (index,) = np.flatnonzero(np.isclose(solution.position, position, atol=1e-12))
    return index


@pytest.mark.parametrize("elements", [1, 12])
def test_a_load_off_the_middle_between_elastic_bearings(elements):
    a, b, L, P = AT, LENGTH - AT, LENGTH, 3000.0
    solution = shaft_statics(shaft(TWO), [a], elements).solve(
        [ShaftLoad(position=a, force=(P, 0.0, 0.0))]
    )
    near, far = P * b / L / SOFT, P * a / L / HARD  # yield of the bearings

    def side(z, a, b):
        """Deflection and slope at a distance from the bearing beyond a."""
        bent = P * b * z * (L**2 - b**2 - z**2) / (6.0 * L * BENDING)
        slope = P * b * (L**2 - b**2 - 3.0 * z**2) / (6.0 * L * BENDING)
        return bent + P * b * z / (L * SLIDING), slope

    for index, z in enumerate(solution.position):
        w, slope = side(z, a, b) if z <= a else side(L - z, b, a)
        slope = slope if z <= a else -slope
        w += near + (far - near) * z / L
        assert solution.deflection[index, 0] == pytest.approx(w, rel=1e-10)
        tilt = slope + (far - near) / L
        assert solution.tilt[index, 1] == pytest.approx(tilt, rel=1e-10)
    np.testing.assert_array_equal(solution.deflection[:, 1:], 0.0)
    np.testing.assert_array_equal(solution.tilt[:, 0], 0.0)
    reactions = [[-P * b / L, 0, 0, 0, 0], [-P * a / L, 0, 0, 0, 0]]
    np.testing.assert_allclose(solution.reactions, reactions, rtol=1e-12, atol=1e-9)
    at = node(solution, a)
    # beyond a section before the load are the load and the far bearing
    np.testing.assert_allclose(solution.shear[at, :, 0], [P * b / L, -P * a / L])
    np.testing.assert_allclose(solution.moment[at, :, 1], -P * a * b / L)


def test_an_overhung_load():
    a, c = 0.5, LENGTH - 0.5
    rotor = shaft([bearing(0.0, SOFT), bearing(a, HARD)])
    statics = shaft_statics(rotor, [LENGTH])
    bent = c**2 * (a + c) / (3.0 * BENDING) + c * (1.0 + c / a) / SLIDING
    springs = (c / a) ** 2 / SOFT + (1.0 + c / a) ** 2 / HARD
    assert statics.compliance[0, 0] == pytest.approx(bent + springs, rel=1e-11)
    assert statics.compliance[1, 1] == pytest.approx(bent + springs, rel=1e-11)
    slope = c * (2.0 * a + 3.0 * c) / (6.0 * BENDING)
    springs = c / a**2 / SOFT + (1.0 + c / a) / a / HARD
    sliding = c / (a * SLIDING)  # of the part between bearings, beside its bending
    assert statics.compliance[4, 0] == pytest.approx(
        slope + sliding + springs, rel=1e-11
    )
    assert statics.compliance[3, 1] == pytest.approx(
        -slope - sliding - springs, rel=1e-11
    )


def test_a_moment_between_bearings():
    a, b, L, M = AT, LENGTH - AT, LENGTH, 70.0
    statics = shaft_statics(shaft(TWO), [a])
    tilt = (a**3 + b**3) / (3.0 * L**2 * BENDING) + 1.0 / (L * SLIDING)
    tilt += (1.0 / SOFT + 1.0 / HARD) / L**2
    for index in (3, 4):
        assert statics.compliance[index, index] == pytest.approx(tilt, rel=1e-11)
    solution = statics.solve([ShaftLoad(position=a, moment=(0.0, M, 0.0))])
    at = node(solution, a)
    assert solution.tilt[at, 1] == pytest.approx(M * tilt, rel=1e-11)
    # the moment about y on the shaft jumps by the load
    np.testing.assert_allclose(solution.moment[at, :, 1], [M * a / L, -M * b / L])
    np.testing.assert_allclose(solution.reactions[:, 0], [M / L, -M / L])


def test_a_clamped_shaft_with_a_load_and_a_moment_at_its_end():
    rotor = shaft([bearing(0.0, SOFT, tilt_stiffness=3e5, axial_stiffness=HARD)])
    statics, L = shaft_statics(rotor, [LENGTH]), LENGTH
    sway = L**3 / (3.0 * BENDING) + L / SLIDING + L**2 / 3e5 + 1.0 / SOFT
    slope = L**2 / (2.0 * BENDING) + L / 3e5
    tilt, z = L / BENDING + 1.0 / 3e5, L / (YOUNG * AREA) + 1.0 / HARD
    expected = [
        [sway, 0, 0, 0, slope],
        [0, sway, 0, -slope, 0],
        [0, 0, z, 0, 0],
        [0, -slope, 0, tilt, 0],
        [slope, 0, 0, 0, tilt],
    ]
    np.testing.assert_allclose(statics.compliance, expected, rtol=1e-11, atol=1e-20)


stiffnesses = st.floats(3.0, 15.0).map(lambda power: 10.0**power)
shares = st.floats(0.0, 1.0)


@given(
    st.lists(st.tuples(shares, stiffnesses, stiffnesses), min_size=1, max_size=4),
    st.lists(shares, min_size=1, max_size=4),
    st.lists(st.floats(0.01, 0.5), min_size=1, max_size=4),
    st.sampled_from([0.0, 1e5]),
)
def test_reactions_balance_loads(bearings, places, lengths, cross):
    sections = tuple(Section(length=length, diameter=0.04) for length in lengths)
    length = math.fsum(lengths)
    rotor = shaft(
        [
            Bearing(
                position=share * length,
                stiffness=(kx, cross, -cross, ky),
                axial_stiffness=kx,
                tilt_stiffness=1e3 * number,
            )
            for number, (share, kx, ky) in enumerate(bearings, start=1)
        ],
        sections,
    )
    places = [share * length for share in places]
    loads = random_loads(np.random.default_rng(73), places)
    solution = shaft_statics(rotor, places).solve(loads)
    force = np.array([load.force for load in loads])
    moment = np.array([load.moment for load in loads])[:, :2]
    at = [*places, *(one.position for one in rotor.bearings)]
    forces = np.concatenate([force, solution.reactions[:, :3]])
    moments = np.concatenate([moment, solution.reactions[:, 3:]])
    arms = np.stack([-np.array(at) * forces[:, 1], np.array(at) * forces[:, 0]], axis=1)
    size = np.abs(forces).sum() + np.abs(moments).sum() + np.abs(arms).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-9 * size
    assert np.abs((moments + arms).sum(axis=0)).max() < 1e-9 * size
    # nothing is beyond the last node
    assert np.abs(solution.shear[-1, 1]).max() < 1e-9 * size
    assert np.abs(solution.moment[-1, 1]).max() < 1e-9 * size
    assert abs(solution.axial_force[-1, 1]) < 1e-9 * size


CROSSED = [
    Bearing(
        position=z,
        stiffness=(kx, cross, cross, 2.0 * kx),
        tilt_stiffness=tilt,
        axial_stiffness=axial,
    )
    for z, kx, cross, tilt, axial in (
        (0.05, SOFT, 1e7, 0.0, 0.0),
        (0.4, HARD, -2e7, 2e4, HARD),
        (0.75, SOFT, 0.0, 1e5, SOFT),
    )
]
STEPPED = (
    Section(length=0.2, diameter=0.04),
    Section(length=0.45, diameter=0.07, bore=0.02),
    Section(length=0.15, diameter=0.05),
)


def test_displacements_are_reciprocal():
    statics = shaft_statics(shaft(CROSSED, STEPPED), [0.0, 0.3, 0.6, LENGTH])
    compliance = statics.compliance
    diagonal = np.diag(compliance)
    assert (np.linalg.eigvalsh(compliance) > 0.0).all()
    scale = np.sqrt(np.outer(diagonal, diagonal))
    assert (np.abs(compliance - compliance.T) / scale).max() < 1e-13


def test_a_bearing_whose_cross_stiffness_is_skew_is_not_reciprocal():
    skew = Bearing(position=0.0, stiffness=(SOFT, 3e7, -3e7, SOFT))
    statics = shaft_statics(shaft([skew, TWO[1]]), [0.0])
    # all of the load is on this bearing
    expected = np.linalg.inv([[SOFT, 3e7], [-3e7, SOFT]])
    np.testing.assert_allclose(statics.compliance[:2, :2], expected, rtol=1e-10)


def test_internal_forces_make_the_shape_and_reactions_make_the_springs():
    rotor, places = shaft(CROSSED, STEPPED), [0.1, 0.33, 0.6]
    loads = random_loads(np.random.default_rng(73), places)
    solution = shaft_statics(rotor, places).solve(loads)
    z, ends = solution.position, np.cumsum([s.length for s in STEPPED])
    for low, (start, end) in enumerate(pairwise(z)):
        section = STEPPED[int(np.searchsorted(ends, 0.5 * (start + end)))]
        length = end - start
        V, M = solution.shear[low, 1], solution.moment[low, 1]
        np.testing.assert_allclose(solution.shear[low + 1, 0], V, rtol=1e-9, atol=1e-8)
        change = length * np.array([V[1], -V[0]])
        later = solution.moment[low + 1, 0]
        np.testing.assert_allclose(later, M + change, rtol=1e-9, atol=1e-8)
        rate = 0.5 * (M + later) / (YOUNG * section.second_moment)
        tilted = solution.tilt[low + 1] - solution.tilt[low]
        np.testing.assert_allclose(tilted, rate * length, rtol=1e-8, atol=1e-13)
        stretch = solution.deflection[low + 1, 2] - solution.deflection[low, 2]
        tension = solution.axial_force[low, 1] * length / (YOUNG * section.area)
        assert stretch == pytest.approx(tension, rel=1e-8, abs=1e-16)
    for one, reaction in zip(rotor.bearings, solution.reactions, strict=True):
        at = node(solution, one.position)
        x, y, axial = solution.deflection[at]
        kxx, kxy, kyx, kyy = one.stiffness
        tilts = -one.tilt_stiffness * solution.tilt[at]
        forces = [-kxx * x - kxy * y, -kyx * x - kyy * y, -one.axial_stiffness * axial]
        np.testing.assert_allclose(reaction, [*forces, *tilts], rtol=1e-8, atol=1e-9)


def test_loads_and_their_jumps():
    places = [0.1, 0.33, 0.6]
    loads = random_loads(np.random.default_rng(73), places)
    solution = shaft_statics(shaft(CROSSED, STEPPED), places).solve(loads)
    for load in loads:
        at = node(solution, load.position)
        steps = [
            *(solution.shear[at, 0] - solution.shear[at, 1]),
            solution.axial_force[at, 0] - solution.axial_force[at, 1],
            *(solution.moment[at, 0] - solution.moment[at, 1]),
            solution.torque[at, 0] - solution.torque[at, 1],
        ]
        np.testing.assert_allclose(steps, [*load.force, *load.moment], rtol=1e-9)


def test_solutions_are_sums_of_compliances():
    places = [0.1, 0.33, 0.6]
    statics = shaft_statics(shaft(CROSSED, STEPPED), places)
    loads = random_loads(np.random.default_rng(73), places)
    solution = statics.solve(loads)
    applied = np.array([[*load.force, *load.moment[:2]] for load in loads])
    expected = (statics.compliance @ applied.ravel()).reshape(-1, 5)
    at = [node(solution, place) for place in places]
    moved = np.hstack([solution.deflection[at], solution.tilt[at]])
    np.testing.assert_allclose(moved, expected, rtol=1e-9)
    assert not statics.solve([]).deflection.any()


def test_elements_and_disks_change_nothing():
    rotor = shaft(CROSSED, STEPPED)
    places = [0.1, 0.6]
    one = shaft_statics(rotor, places, 1).compliance
    many = shaft_statics(rotor, places, 60).compliance
    np.testing.assert_allclose(many, one, rtol=1e-9, atol=1e-20)
    loaded = replace(rotor, disks=(Disk(position=0.45, mass=3.0),))
    with_disk = shaft_statics(loaded, places).compliance
    np.testing.assert_allclose(with_disk, one, rtol=1e-9, atol=1e-20)


def test_a_load_beside_a_node_is_on_a_rigid_arm():
    rotor, distance = shaft(CROSSED, STEPPED), 0.4e-3
    statics = shaft_statics(rotor, [0.2 + distance])
    at_node = shaft_statics(rotor, [0.2])
    assert statics.nodes == at_node.nodes
    arm = np.eye(5)
    arm[0, 4], arm[1, 3] = distance, -distance
    expected = arm @ at_node.compliance @ arm.T
    np.testing.assert_allclose(statics.compliance, expected, rtol=1e-12, atol=1e-20)


def test_a_shaft_between_two_bearings_that_take_thrust():
    rotor = shaft(
        [
            bearing(0.1, SOFT, axial_stiffness=SOFT),
            bearing(0.7, SOFT, axial_stiffness=HARD),
        ],
        STEPPED,
    )
    z = 0.5
    statics = shaft_statics(rotor, [z])
    assert statics.has_thrust_path
    areas = [section.area for section in STEPPED]
    near = 1.0 / SOFT + (0.1 / areas[0] + 0.3 / areas[1]) / YOUNG
    far = 1.0 / HARD + (0.15 / areas[1] + 0.05 / areas[2]) / YOUNG
    expected = 1.0 / (1.0 / near + 1.0 / far)
    assert statics.compliance[2, 2] == pytest.approx(expected, rel=1e-12)
    solution = statics.solve([ShaftLoad(position=z, force=(0.0, 0.0, 50.0))])
    shares = -50.0 * expected * np.array([1.0 / near, 1.0 / far])
    np.testing.assert_allclose(solution.reactions[:, 2], shares, rtol=1e-12)
    sides = [-shares[0], shares[1]]
    np.testing.assert_allclose(solution.axial_force[node(solution, z)], sides)


def test_without_a_bearing_along_the_axis_thrust_has_to_balance():
    statics = shaft_statics(shaft(TWO), [0.2, 0.6])
    assert not statics.has_thrust_path
    compliance = statics.compliance.reshape(2, 5, 2, 5)
    np.testing.assert_array_equal(compliance[:, 2], 0.0)
    np.testing.assert_array_equal(compliance[..., 2], 0.0)
    thrust = ShaftLoad(position=0.2, force=(0.0, 0.0, 40.0))
    with pytest.raises(RotorError, match=r"^rotor 'counter': axial force = 40 N; must"):
        statics.solve([thrust])
    opposite = ShaftLoad(position=0.6, force=(0.0, 0.0, -40.0))
    solution = statics.solve([thrust, opposite])
    np.testing.assert_array_equal(solution.deflection, 0.0)
    between = (solution.position > 0.3) & (solution.position < 0.5)
    np.testing.assert_array_equal(solution.axial_force[between], -40.0)


def test_torques_run_from_the_first_end():
    loads = [
        ShaftLoad(position=z, moment=(0.0, 0.0, torque))
        for z, torque in ((0.2, 30.0), (0.6, -30.0))
    ]
    statics = shaft_statics(shaft(TWO), [0.2, 0.6])
    solution = statics.solve(loads)
    inside = (solution.position > 0.3) & (solution.position < 0.5)
    np.testing.assert_array_equal(solution.torque[inside], -30.0)
    np.testing.assert_array_equal(solution.torque[[0, -1]], 0.0)
    assert statics.solve(loads[:1]).torque[-1, 1] == -30.0


@pytest.mark.parametrize(
    ("bore", "expected"),
    [
        (0.0, 6.0 * 1.3 / (7.0 + 6.0 * 0.3)),
        (1.0 - 1e-9, 2.0 * 1.3 / (4.0 + 3.0 * 0.3)),
        (0.5, 6.0 * 1.3 * 1.5625 / (8.8 * 1.5625 + 23.6 * 0.25)),
    ],
    ids=["solid", "thin tube", "half"],
)
def test_shear_coefficients_of_tubes(bore, expected):
    section = Section(length=1.0, diameter=1.0, bore=bore)
    assert shear_coefficient(section, 0.3) == pytest.approx(expected, rel=1e-8)


def test_an_element_with_shear_is_a_timoshenko_cantilever():
    length, phi = 0.3, 1.7
    stiffness = bending_stiffness(length, phi)
    rigid = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, length, 1.0]]).T
    np.testing.assert_allclose(stiffness @ rigid, 0.0, atol=1e-10)
    sway, slope = length**3 / 3.0 + phi * length**3 / 12.0, length**2 / 2.0
    expected = [[sway, slope], [slope, length]]
    np.testing.assert_allclose(np.linalg.inv(stiffness[2:, 2:]), expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("bearings", "places"),
    [
        ([], "none"),
        ([bearing(0.3, SOFT)], "0.3 m"),
        ([bearing(0.3, SOFT), bearing(0.3, HARD)], "0.3 m, 0.3 m"),
        ([bearing(0.1, SOFT), bearing(0.5, SOFT, 0.0)], "0.1 m, 0.5 m"),
        ([bearing(0.1, 0.0, tilt_stiffness=1e4)], "0.1 m"),
        ([bearing(0.1, 0.0), bearing(0.5, 0.0)], "0.1 m, 0.5 m"),
    ],
    ids=["none", "one", "one place", "one in y", "tilt alone", "no stiffness"],
)
def test_bearings_that_do_not_hold_a_shaft_are_refused(bearings, places):
    expected = f"^rotor 'counter': bearings at {places} do not hold the shaft; "
    for axial in (0.0, SOFT):
        with_thrust = [replace(one, axial_stiffness=axial) for one in bearings]
        with pytest.raises(RotorError, match=expected):
            shaft_statics(shaft(with_thrust), [0.2])


def test_loads_off_the_places_and_places_off_the_shaft_are_refused():
    statics = shaft_statics(shaft(TWO), [0.2], 1)
    with pytest.raises(RotorError, match=r"load at 0\.25 m; must be at one of the pla"):
        statics.solve([ShaftLoad(position=0.25)])
    with pytest.raises(RotorError, match=r"load at 0\.9 m; the shaft is 0\.8 m long"):
        shaft_statics(shaft(TWO), [0.9])
    with pytest.raises(ValueError, match="elements = 0"):
        shaft_statics(shaft(TWO), [0.2], 0)
    oval = (Section(length=LENGTH, diameter=DIAMETER, asymmetry=0.1),)
    with pytest.raises(RotorError, match=r"its stiffness varies with the rotation$"):
        shaft_statics(shaft(TWO, oval), [0.2])
    with pytest.raises(ValueError, match="position = -1"):
        ShaftLoad(position=-1.0)
