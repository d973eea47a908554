"""Closed forms of linear trains against limits, energy and each other."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import linear_train as lt
from oracles.linear_train import LinearTrain, Tone

RADII = (0.04535, 0.06564, 0.06564, 0.1122)
INERTIAS = (2.62e-3, 8.588e-3, 1.0721e-2, 0.119)
STIFFNESS = (2.98e8, 1.08 * 2.98e8)
SHAFT = 6.35e5  # N m/rad
positive = st.floats(0.1, 10.0)


def make_idler(damping=0.04, coupling=0.0):
    r = np.array([0.04535, 0.06564, 0.11218])
    rows = np.array([[r[0], r[1], 0.0], [0.0, -r[1], -r[2]]])
    return LinearTrain(
        inertia=np.array([0.002621, 0.01091, 0.1193]),
        rows=rows,
        stiffness=np.array([2.9831e8, 3.2108e8]),
        ground=np.diag([coupling, 0.0, coupling]),
        torque=np.array([100.0, 0.0, -100.0 * r[2] / r[0]]),
        damping_ratio=damping,
    )


def test_printed_ratios_of_the_countershaft():
    frequencies = lt.countershaft_frequencies(RADII, INERTIAS, STIFFNESS, SHAFT)
    np.testing.assert_allclose(
        frequencies / frequencies[0], [1.0, 2.34, 3.29], rtol=2e-3
    )


def test_printed_ratio_of_the_idler():
    """Chapter 3 with I2 = 3.27e-3 and I3 = 0.119: c = 2.763."""
    r, j = (0.04535, 0.06564, 0.11218), (0.002621, 3.27e-3, 0.119)
    masses = [a / b**2 for a, b in zip(j, r, strict=True)]
    low, high = lt.idler_frequencies(masses, (2.9831e8, 3.2108e8))
    assert high / low == pytest.approx(2.763, rel=1e-3)


@given(masses=st.tuples(positive, positive, positive))
def test_idler_mass_is_the_inverse_of_its_flexibility(masses):
    """B M^-1 B^T with x1 = u1 + u2 and x2 = -u2 - u3."""
    b = np.array([[1.0, 1.0, 0.0], [0.0, -1.0, -1.0]])
    flexibility = b @ np.diag(1.0 / np.array(masses)) @ b.T
    np.testing.assert_allclose(
        lt.idler_mass(masses) @ flexibility, np.eye(2), atol=1e-10
    )


def test_countershaft_flexibility_from_its_coordinates():
    r1, r2, r3, r4 = RADII
    b = np.array([[r1, r2, 0, 0], [0, 0, -r3, -r4], [0, r2, -r2, 0]])
    expected = b @ np.diag(1.0 / np.array(INERTIAS)) @ b.T
    np.testing.assert_allclose(
        lt.countershaft_flexibility(RADII, INERTIAS), expected, rtol=1e-13
    )


def test_hard_shaft_makes_an_idler():
    """Gears 2 and 3 of one radius move as one."""
    low, middle, _ = lt.countershaft_frequencies(RADII, INERTIAS, STIFFNESS, 1e14)
    masses = [
        INERTIAS[0] / RADII[0] ** 2,
        (INERTIAS[1] + INERTIAS[2]) / RADII[1] ** 2,
        INERTIAS[3] / RADII[3] ** 2,
    ]
    expected = lt.idler_frequencies(masses, STIFFNESS)
    np.testing.assert_allclose([low, middle], expected, rtol=1e-6)


def test_heavy_third_disk_leaves_a_pair():
    """A very stiff second mesh on a very heavy disk holds the idler."""
    m1 = 1.3
    low, _ = lt.idler_frequencies((m1, 2.5, 1e9), (3e8, 1e16))
    assert low == pytest.approx(math.sqrt(3e8 / m1) / (2.0 * math.pi), rel=1e-6)


def test_static_deflection_without_couplings_is_force_over_stiffness():
    train = make_idler()
    force = 100.0 / 0.04535
    np.testing.assert_allclose(
        lt.static_deflection(train), force / train.stiffness, rtol=1e-10
    )


def test_couplings_carry_a_part_of_the_load():
    train = make_idler(coupling=1e4)
    assert (lt.static_deflection(train) < 100.0 / 0.04535 / train.stiffness).all()


@pytest.mark.parametrize("mesh", [0, 1])
def test_slow_errors_are_followed_without_strain(mesh):
    """At rest a free train takes up the error: deflection = error."""
    error = np.zeros(2, complex)
    error[mesh] = 1e-6 * np.exp(0.4j)
    deflection = lt.harmonic_deflection(make_idler(), [Tone(1e-2, error)])[0]
    np.testing.assert_allclose(deflection, error, atol=1e-13)


def test_fast_errors_meet_inertia_only():
    """x -> -M^-1 k e / w^2 above all resonances."""
    train, w = make_idler(damping=0.0), 1e8
    error = np.array([1e-6, 0.0], complex)
    deflection = lt.harmonic_deflection(train, [Tone(w, error)])[0]
    flexibility = train.rows @ np.diag(1.0 / train.inertia) @ train.rows.T
    expected = -flexibility @ (train.stiffness * error) / w**2
    np.testing.assert_allclose(deflection, expected, rtol=1e-5)


def test_errors_work_as_much_as_damping_takes():
    """Re(conj(i w x) k e) summed over the meshes = 2 zeta w_i |q_i'|^2 summed."""
    train, w = make_idler(), 2.0 * math.pi * 2500.0
    error = np.array([1e-6, 2e-6 * np.exp(0.7j)])
    x = lt.harmonic_deflection(train, [Tone(w, error)])[0]
    given_power = 4.0 * (0.5 * np.conj(1j * w * x) * train.stiffness * error).real.sum()
    squares, shapes = lt.eigh(train.matrix, np.diag(train.inertia))
    omega = np.sqrt(np.maximum(squares, 0.0))
    deflections = train.rows @ shapes[:, 1:]
    q = np.linalg.solve(deflections, x)
    taken = 2.0 * (2 * 0.04 * omega[1:] * np.abs(1j * w * q) ** 2).sum()
    assert given_power == pytest.approx(taken, rel=1e-9)


def test_rms_adds_squares():
    assert lt.rms([[1.0 + 0j], [1j]])[0] == pytest.approx(2.0)
