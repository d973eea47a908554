"""Spinning rotors against closed forms, and properties of their matrices."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh

from lumped.rotors.campbell import campbell, crossings, unstable_ranges
from lumped.rotors.critical import critical_speeds, synchronous_speeds
from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorError,
    RotorSystem,
    Section,
)
from lumped.rotors.frames import rotating_frame
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem, mode_kind

YOUNG, SHEAR, DENSITY = 2.1e11, 8e10, 7800.0
LENGTH, DIAMETER = 1.0, 0.05
AREA, SECOND = math.pi * DIAMETER**2 / 4.0, math.pi * DIAMETER**4 / 64.0
RIGID = 1e13  # N/m, of a bearing that hardly yields
LIGHT = 1e-3  # kg/m3, of a shaft whose mass hardly counts
PINNED = tuple(
    Bearing(position=z, stiffness=(RIGID, 0.0, 0.0, RIGID)) for z in (0.0, LENGTH)
)
CLAMPED = (
    Bearing(position=0.0, stiffness=(RIGID, 0.0, 0.0, RIGID), tilt_stiffness=1e12),
)
STIFFNESS = 48.0 * YOUNG * SECOND / LENGTH**3  # of a pinned shaft in its middle
MASS = 20.0


def shaft(**changes):
    usual = {
        "name": "shaft",
        "sections": (Section(length=LENGTH, diameter=DIAMETER),),
        "bearings": PINNED,
        "young_modulus": YOUNG,
        "shear_modulus": SHEAR,
        "density": DENSITY,
    }
    return Rotor(**usual | changes)


def problem(elements=8, **changes):
    return WhirlProblem(
        assemble(RotorSystem(rotors=(shaft(**changes),), elements=elements))
    )


def disk(position, polar=0.4, transverse=0.25):
    return Disk(
        position=position,
        mass=MASS,
        polar_inertia=polar,
        transverse_inertia=transverse,
    )


def rayleigh_shaft(speed, n):
    """Backward and forward frequency of the n-th bending of a pinned shaft.

    (1 + r^2 k^2) w^2 -+ 2 Omega r^2 k^2 w - E I k^4 / (rho A) = 0 with k = n pi / L and
    r^2 = I / A, of Rayleigh's beam in rotation.
    """
    k, r2 = n * math.pi / LENGTH, SECOND / AREA
    a, c = 1.0 + r2 * k**2, YOUNG * SECOND * k**4 / (DENSITY * AREA)
    b = speed * r2 * k**2
    root = math.sqrt(b**2 + a * c)
    return (root - b) / a, (root + b) / a


@pytest.mark.parametrize("speed", [0.0, 500.0, 5000.0])
def test_a_spinning_shaft_converges_to_its_closed_form_with_order_four(speed):
    expected = np.sort([w for n in (1, 2) for w in rayleigh_shaft(speed, n)])
    errors = [
        np.abs(problem(n).solve(speed, 4).frequency / expected - 1.0).max()
        for n in (4, 8, 16)
    ]
    assert errors[1] < 3e-4
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([4.0, 4.0], abs=0.1)


def test_without_rotary_inertia_the_speed_changes_nothing():
    k = math.pi / LENGTH
    expected = k**2 * math.sqrt(YOUNG * SECOND / (DENSITY * AREA))
    for speed in (0.0, 2000.0):
        computed = problem(16, rotary_inertia=False).solve(speed, 2).frequency
        assert computed == pytest.approx([expected] * 2, rel=2e-6)


def test_a_clamped_shaft_and_its_torsion():
    computed = problem(12, bearings=CLAMPED, rotary_inertia=False).solve(0.0)
    bending = 1.8751040687119611**2 / LENGTH**2
    expected = bending * math.sqrt(YOUNG * SECOND / (DENSITY * AREA))
    assert computed.frequency[:2] == pytest.approx([expected] * 2, rel=1e-5)
    twisting = computed.frequency[computed.torsion > 0.5]
    wave_speed = math.sqrt(SHEAR / DENSITY)  # free at both ends: bearings permit it
    assert twisting[0] == pytest.approx(math.pi * wave_speed / LENGTH, rel=3e-3)
    fine = problem(48, bearings=CLAMPED).solve(0.0)
    finer = fine.frequency[fine.torsion > 0.5]
    assert finer[0] == pytest.approx(math.pi * wave_speed / LENGTH, rel=2e-4)


def test_a_disk_in_the_middle_whirls_at_one_speed_and_tilts_with_the_spin():
    """Jeffcott's rotor, and the tilting that its middle is uncoupled from."""
    rotor = problem(2, disks=(disk(0.5),), density=LIGHT)
    speed = 300.0
    modes = rotor.solve(speed, 4)
    straight = math.sqrt(STIFFNESS / MASS)
    assert modes.frequency[:2] == pytest.approx([straight] * 2, rel=1e-6)
    tilt = 12.0 * YOUNG * SECOND / LENGTH  # moment by angle in the middle
    a, b, c = 0.25, 0.4 * speed, tilt
    pair = [(math.sqrt(b**2 + 4 * a * c) + s * b) / (2 * a) for s in (-1.0, 1.0)]
    assert modes.frequency[2:4] == pytest.approx(pair, rel=1e-6)
    assert modes.whirl[2:4] == pytest.approx([-1.0, 1.0])


def overhung_polynomial(speed, polar, transverse):
    """Frequencies, negative ones of backward whirl, of a disk at a shaft's free end.

    With y + i x for both planes: (K - w^2 M + w Omega G) x = 0 of deflection and slope.
    """
    k = YOUNG * SECOND * np.array([[12.0, -6.0], [-6.0, 4.0]])  # length 1
    w = np.polynomial.Polynomial([0.0, 1.0])
    one = k[0, 0] - MASS * w**2
    two = k[1, 1] - transverse * w**2 + polar * speed * w
    roots = (one * two - k[0, 1] ** 2).roots()
    return np.sort(roots.real)


@pytest.mark.parametrize("speed", [0.0, 100.0, 1000.0])
def test_an_overhung_disk(speed):
    disks = (disk(LENGTH),)
    rotor = problem(1, disks=disks, bearings=CLAMPED, density=LIGHT)
    modes = rotor.solve(speed, 4)
    expected = overhung_polynomial(speed, 0.4, 0.25)
    forward, backward = expected[expected > 0.0], -expected[expected < 0.0]
    np.testing.assert_allclose(
        modes.frequency[modes.whirl > 0.0], np.sort(forward), rtol=1e-5
    )
    np.testing.assert_allclose(
        modes.frequency[modes.whirl < 0.0], np.sort(backward), rtol=1e-5
    )


def test_a_disk_with_more_polar_inertia_has_one_forward_critical_speed():
    """As the gyroscopic moment stiffens faster than tilting inertia softens."""
    disks = (disk(LENGTH),)
    rotor = problem(1, disks=disks, bearings=CLAMPED, density=LIGHT)
    k = YOUNG * SECOND * np.array([[12.0, -6.0], [-6.0, 4.0]])
    square = np.polynomial.Polynomial([0.0, 1.0])
    roots = [
        (one * two - k[0, 1] ** 2).roots()
        for one, two in (
            (k[0, 0] - MASS * square, k[1, 1] - (0.25 - sign * 0.4) * square)
            for sign in (1.0, -1.0)
        )
    ]
    assert [(part > 0.0).sum() for part in roots] == [1, 2]
    squares = np.concatenate(roots)
    expected = np.sqrt(np.sort(squares[squares > 0.0]))
    computed = synchronous_speeds(rotor, 1.0)[:3]
    np.testing.assert_allclose(computed, expected, rtol=1e-5)


def test_critical_speeds_are_eigenvalues_and_roots_of_the_curves():
    """By two ways, for orders below and above 1, with bearings that differ."""
    bearings = (
        Bearing(position=0.1, stiffness=(1e7, 0.0, 0.0, 2e7)),
        Bearing(position=0.8, stiffness=(2e7, 0.0, 0.0, 1.5e7)),
    )
    rotor = problem(6, bearings=bearings, disks=(disk(0.5), disk(1.0)))
    diagram = campbell(rotor, np.linspace(0.0, 4000.0, 21).tolist(), 12)
    for order in (0.5, 1.0, 23.0):
        exact = critical_speeds(rotor, diagram, order)
        roots = crossings(rotor, diagram, order)
        top = np.nanmax(diagram.eigenvalues.imag)
        speeds = [one.speed for one in exact if one.frequency < 0.3 * top]
        assert len(speeds) > 1
        near = [one.speed for one in roots]
        for speed in speeds:
            assert min(abs(other / speed - 1.0) for other in near) < 1e-8
        for one in exact:
            assert one.frequency == pytest.approx(order * one.speed, rel=1e-8)
            assert one.damping_ratio == 0.0


def test_modes_are_followed_where_they_cross():
    """Forward and backward whirl of an isotropic rotor cross without any coupling."""
    rotor = problem(4, disks=(disk(LENGTH), disk(0.4)), bearings=CLAMPED)
    diagram = campbell(rotor, np.linspace(0.0, 6000.0, 25).tolist(), 8)
    whirl = diagram.whirl
    bending = np.flatnonzero(diagram.torsion[0] < 0.5)
    assert np.abs(np.diff(whirl[:, bending], axis=0)).max() < 1e-6
    frequency = diagram.frequency_Hz[:, bending]
    rising = np.sign(whirl[0, bending])
    assert set(rising) == {-1.0, 1.0}
    assert (np.diff(frequency, axis=0) * rising > -1e-9).all()
    order = np.argsort(frequency, axis=1)
    assert (order != order[0]).any()  # they did cross
    every = np.sort(frequency, axis=1)
    for row, speed in enumerate(diagram.speeds):
        present = rotor.solve(float(speed)).frequency / (2.0 * math.pi)
        assert np.abs(every[row][:, None] / present - 1.0).min(axis=1).max() < 1e-9


@pytest.mark.parametrize("external", [0.0, 30.0])
def test_damping_of_the_material_makes_flutter_above_a_speed(external):
    """Omega = w (1 + c_e / c_i), of Jeffcott's rotor."""
    retardation = 2e-5  # s
    outer = Bearing(
        position=0.5,
        stiffness=(0.0, 0.0, 0.0, 0.0),
        damping=(external, 0.0, 0.0, external),
    )
    rotor = problem(
        2,
        disks=(disk(0.5, 0.0, 0.05),),
        bearings=(*PINNED, outer),
        density=LIGHT,
        rotary_inertia=False,
        internal_damping=retardation,
    )
    natural = math.sqrt(STIFFNESS / MASS)
    expected = natural * (1.0 + external / (retardation * STIFFNESS))
    diagram = campbell(rotor, np.linspace(0.0, 2.0 * expected, 9).tolist(), 2)
    (unstable,) = unstable_ranges(rotor, diagram)
    assert unstable.kind == "flutter"
    assert unstable.low == pytest.approx(expected, rel=1e-4)
    assert unstable.high == diagram.speeds[-1]
    assert unstable.frequency == pytest.approx(natural, rel=1e-3)
    damping = diagram.damping_ratio
    assert (damping[0] > 0.0).all()
    assert damping[-1].min() < 0.0


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_forces_across_the_displacement_cause_flutter_where_damping_is_less(factor):
    """q > c w, of Jeffcott's rotor, at every speed."""
    damping = 40.0
    cross = factor * damping * math.sqrt(STIFFNESS / MASS)
    seal = Bearing(
        position=0.5,
        stiffness=(0.0, cross, -cross, 0.0),
        damping=(damping, 0.0, 0.0, damping),
    )
    rotor = problem(2, disks=(disk(0.5),), bearings=(*PINNED, seal), density=LIGHT)
    diagram = campbell(rotor, [0.0, 50.0, 100.0], 2)
    ranges = unstable_ranges(rotor, diagram)
    assert [(part.low, part.high, part.kind) for part in ranges] == (
        [(0.0, 100.0, "flutter")] if factor > 1.0 else []
    )


def test_the_frame_that_turns_shifts_frequencies_by_the_speed():
    system = RotorSystem(rotors=(shaft(disks=(disk(0.3), disk(0.9))),), elements=5)
    fixed, turning = (
        WhirlProblem(assemble(system)),
        WhirlProblem(rotating_frame(system)),
    )
    speed = 700.0
    modes = fixed.solve(speed, 8)
    bending = modes.torsion < 0.5
    shifted = np.abs(modes.frequency - np.sign(modes.whirl) * speed)[bending]
    present = turning.solve(speed).frequency
    gaps = np.abs(shifted[:, None] / present - 1.0).min(axis=1)
    assert gaps.max() < 1e-9
    assert turning.solve(speed).instability is None


def test_the_centripetal_matrix_is_singular_at_forward_critical_speeds():
    """K - Omega^2 N of the frame that turns, and N = m, I_t - I_p of a disk."""
    system = RotorSystem(rotors=(shaft(disks=(disk(0.3),)),), elements=5)
    turning = rotating_frame(system)
    squares = eigh(
        turning.centripetal,
        turning.stiffness + 1e-3 * np.diag(turning.is_rotation * 1.0),
        eigvals_only=True,
    )
    positive = squares[squares > 1e-12]
    divergence = np.sort(1.0 / np.sqrt(positive))[:6:2]
    fixed = WhirlProblem(assemble(system))
    diagram = campbell(fixed, [0.0, 4.0 * divergence[-1]], 2)
    forward = [
        one.speed for one in critical_speeds(fixed, diagram, 1.0) if one.whirl > 0.0
    ]
    np.testing.assert_allclose(divergence, forward[:3], rtol=1e-9)
    at = turning.index(0, 0.3, "x")
    light = shaft(disks=(disk(0.3),), density=1e-9)
    centripetal = rotating_frame(RotorSystem(rotors=(light,), elements=5)).centripetal
    of_disk = np.diag(centripetal)[at : at + 5]
    assert of_disk == pytest.approx([MASS, MASS, -0.15, -0.15, 0.0], abs=1e-9)


@pytest.mark.parametrize("asymmetry", [0.05, -0.2])
def test_an_asymmetric_shaft_diverges_between_its_two_critical_speeds(asymmetry):
    """Omega from sqrt(k_1 / m) to sqrt(k_2 / m), of Jeffcott's rotor."""
    section = Section(length=LENGTH, diameter=DIAMETER, asymmetry=asymmetry)
    rotor = shaft(sections=(section,), disks=(disk(0.5, 0.0, 0.05),), density=LIGHT)
    system = RotorSystem(rotors=(rotor,), elements=2)
    with pytest.raises(RotorError, match="asymmetry"):
        assemble(system)
    turning = WhirlProblem(rotating_frame(system))
    natural = math.sqrt(STIFFNESS / MASS)
    ends = [natural * math.sqrt(1.0 + s * abs(asymmetry)) for s in (-1.0, 1.0)]
    speeds = np.linspace(0.0, 1.5 * natural, 40).tolist()
    (unstable,) = unstable_ranges(turning, campbell(turning, speeds, 2))
    assert unstable.kind == "divergence"
    assert [unstable.low, unstable.high] == pytest.approx(ends, rel=1e-5)


NO_SHRINK = (Phase.explicit, Phase.generate)
lengths = st.floats(0.05, 1.0)
diameters = st.floats(0.01, 0.2)
stiffnesses = st.floats(1e5, 1e9)
inertias = st.floats(1e-3, 1.0)
rotors = st.builds(
    lambda sections, bearings, disks, ratio: (sections, bearings, disks, ratio),
    st.lists(st.tuples(lengths, diameters), min_size=1, max_size=3),
    st.tuples(*[st.tuples(stiffnesses, stiffnesses)] * 2),
    st.lists(
        st.tuples(st.floats(0.0, 1.0), st.floats(0.1, 50.0), inertias, inertias),
        max_size=2,
    ),
    st.sampled_from([1.0, -0.4, 3.0]),
)


def drawn_rotor(parts):
    sections, bearings, disks, ratio = parts
    total = math.fsum(length for length, _ in sections)
    return shaft(
        sections=tuple(Section(length=L, diameter=d) for L, d in sections),
        bearings=tuple(
            Bearing(position=place * total, stiffness=(kx, 0.0, 0.0, ky))
            for place, (kx, ky) in zip((0.1, 0.8), bearings, strict=True)
        ),
        disks=tuple(
            Disk(
                position=place * total,
                mass=mass,
                polar_inertia=polar,
                transverse_inertia=transverse,
            )
            for place, mass, polar, transverse in disks
        ),
        speed_ratio=ratio,
    )


@settings(max_examples=30, deadline=None, phases=NO_SHRINK)
@given(rotors, rotors, st.floats(0.0, 2000.0), st.floats(1e6, 1e9), st.floats(0.0, 6.3))
def test_structure_of_the_matrices(one, other, speed, stiffness, angle):
    first, second = drawn_rotor(one), drawn_rotor(other)
    mesh = MeshSpring(
        rotors=(0, 1),
        positions=(0.5 * first.length, 0.3 * second.length),
        base_radii=(0.05, 0.08),
        direction=(math.cos(angle), math.sin(angle)),
        stiffness=stiffness,
        width=0.03,
    )
    system = assemble(RotorSystem(rotors=(first, second), meshes=(mesh,), elements=2))
    assert (system.mass == system.mass.T).all()
    scale = np.abs(system.stiffness).max()
    assert np.abs(system.stiffness - system.stiffness.T).max() <= 1e-15 * scale
    assert np.abs(system.gyroscopic + system.gyroscopic.T).max() <= 1e-15 * np.abs(
        system.gyroscopic
    ).max(initial=0.0)
    assert not system.centripetal.any()  # of the frame that does not turn
    assert np.linalg.eigvalsh(system.mass).min() > 0.0
    modes = WhirlProblem(system).solve(speed)
    assert (modes.eigenvalues.real == 0.0).all()  # to the last bit
    assert modes.instability is None
    assert (np.diff(modes.frequency) >= 0.0).all()
    assert (np.abs(modes.whirl) <= 1.0 + 1e-9).all()
    # both of a pair satisfy the polynomial, forces by the mode itself
    for value, shape in zip(modes.eigenvalues[:4], modes.shapes.T, strict=False):
        strain = (shape.conj() @ system.stiffness @ shape).real
        # of the products of large entries that cancel in this very sum
        round_off = 1e-14 * (abs(shape) @ abs(system.stiffness) @ abs(shape))
        for w, x in ((value, shape), (value.conjugate(), shape.conj())):
            forces = w**2 * system.mass + w * speed * system.gyroscopic
            assert abs(x.conj() @ (forces + system.stiffness) @ x) <= (
                1e-8 * strain + round_off
            )
    assert (modes.frequency > 0.0).all()


# A shaft whose six lowest natural frequencies reach from 2 to 29 000 Hz. Of the higher
# ones eight digits are right.
STIFF_ABOVE_SOFT = (
    [(0.05, 0.19987171959352515)],
    ((1e5, 1e5), (229713790.5215998, 1e7)),
    [
        (
            0.41217889617064773,
            39.96830029864565,
            0.1172220274854334,
            0.19987171959352515,
        ),
        (0.3514369077913971, 6.8676099069469085, 0.8968380681561395, 0.5),
    ],
    1.0,
)


@settings(max_examples=15, deadline=None, phases=NO_SHRINK)
@given(rotors)
@example(STIFF_ABOVE_SOFT)
def test_at_rest_frequencies_are_those_of_mass_and_stiffness(parts):
    system = assemble(RotorSystem(rotors=(drawn_rotor(parts),), elements=2))
    squares = eigh(system.stiffness, system.mass, eigvals_only=True)
    computed = WhirlProblem(system).solve(0.0).frequency
    # the first is the free rotation; Cholesky's factor of M multiplies round-off of
    # the highest square by how much masses differ
    scaled = system.mass / np.sqrt(np.outer(*[np.diag(system.mass)] * 2))
    condition = np.linalg.cond(scaled)
    error = 1e-15 * condition * squares.max()
    # ours are inverses of eigenvalues, with the round-off of the lowest mode's
    lowest = squares[1:7]
    error += 1e-15 * lowest**2 / lowest[0]
    assert (np.abs(computed[:6] ** 2 - lowest) <= 1e-8 * lowest + error).all()


def test_parts_that_are_close_hang_on_a_rigid_arm():
    """Nearly a node of their own at the largest distance, and the same node at none."""

    def frequencies(place):
        rotor = shaft(disks=(disk(0.6), disk(place)))
        system = assemble(RotorSystem(rotors=(rotor,), elements=8))
        return len(system.nodes[0]), WhirlProblem(system).solve(900.0).frequency[:6]

    (fewer, arm), (more, node) = (
        frequencies(0.6 - 1e-3 * (1.0 + sign * 1e-6)) for sign in (-1.0, 1.0)
    )
    assert more == fewer + 1
    np.testing.assert_allclose(arm, node, rtol=3e-3)  # of the slope over the arm
    (_, one), (_, other) = frequencies(0.6), frequencies(0.6 - 1e-8)
    np.testing.assert_allclose(one, other, rtol=1e-7)


@settings(max_examples=15, deadline=None, phases=NO_SHRINK)
@given(rotors, st.floats(1.0, 2000.0))
def test_the_other_sense_of_rotation_has_the_same_frequencies(parts, speed):
    """And the same whirl, which is counted in the rotor's own sense."""
    rotor = drawn_rotor(parts)
    one, other = (
        WhirlProblem(assemble(RotorSystem(rotors=(r,), elements=2))).solve(speed)
        for r in (rotor, replace(rotor, speed_ratio=-rotor.speed_ratio))
    )
    np.testing.assert_allclose(one.frequency[:8], other.frequency[:8], rtol=1e-7)


def test_kinds_of_modes():
    assert mode_kind(0.9, 0.2) == "forward"
    assert mode_kind(-0.9, 0.2) == "backward"
    assert mode_kind(0.05, 0.2) == "planar"
    assert mode_kind(0.9, 0.6) == "torsion"


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: Section(length=0.0, diameter=1.0), "length = .*; must be above 0"),
        (lambda: Section(length=1.0, diameter=0.1, bore=0.2), "bore = 0.2; must be"),
        (lambda: shaft(disks=(disk(1.5),)), "disk at 1.5 m; the shaft is 1 m long"),
        (lambda: shaft(sections=()), "one or more needed"),
        (lambda: shaft(density=0.0), "density = .*; must be above 0"),
        (lambda: RotorSystem(rotors=()), "one or more are needed"),
        (
            lambda: RotorSystem(rotors=(shaft(),), meshes=(spring(rotors=(0, 1)),)),
            "rotor index = 1; must be 0 to 0",
        ),
        (lambda: spring(direction=(1.0, 1.0)), "must be a unit vector"),
        (
            lambda: rotating_frame(RotorSystem(rotors=(shaft(), shaft()))),
            "a frame turns with one rotor",
        ),
        (
            lambda: rotating_frame(RotorSystem(rotors=(shaft(bearings=UNEQUAL),))),
            "differs in x and y",
        ),
        (
            lambda: synchronous_speeds(problem(bearings=()), 1.0),
            "needs bearings",
        ),
        (
            lambda: synchronous_speeds(problem(internal_damping=1e-5), 1.0),
            "no critical speeds as eigenvalues",
        ),
        (lambda: synchronous_speeds(problem(), 0.0), "order = 0; must be above 0"),
        (lambda: campbell(problem(), [0.0, 0.0], 2), "speeds must be one or more"),
    ],
)
def test_what_is_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()


UNEQUAL = (Bearing(position=0.0, stiffness=(1e6, 0.0, 0.0, 2e6)),)


def spring(**changes):
    usual = {
        "rotors": (0, 0),
        "positions": (0.1, 0.2),
        "base_radii": (0.1, 0.1),
        "direction": (1.0, 0.0),
        "stiffness": 1e8,
    }
    return MeshSpring(**usual | changes)
