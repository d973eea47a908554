"""The vibrating ring against its equations of motion, its limits and itself."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import thick_ring_modes as oracle
from oracles.thick_ring_modes import ThickRing
from scipy.special import jv, jvp, yv, yvp

RING = ThickRing(
    hub_radius=20e-3,
    outer_radius=66e-3,
    young_modulus=206e9,
    poisson_ratio=0.3,
    density=7850.0,
)
BOTH = pytest.mark.parametrize("plane", ["stress", "strain"])


def lame(ring):
    """(lambda, G) of the plane state, written apart from the oracle [Pa]."""
    E, nu = ring.young_modulus, ring.poisson_ratio
    if ring.plane == "stress":
        return E * nu / (1 - nu**2), E / (2 + 2 * nu)
    return E * nu / (1 + nu) / (1 - 2 * nu), E / (2 + 2 * nu)


def field(ring, n, omega, weights, points):
    """Cartesian displacement (k, 2) at points (k, 2) of a mixture of potentials."""
    r, theta = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    u, v = np.einsum(
        "ijk,j->ik", oracle.displacement_and_stress(ring, n, omega, r), weights
    )[:2]
    turned = n * theta + 0.7  # any zero of theta will do; n = 0 shows both parts
    u, v = u * np.cos(turned), v * np.sin(turned)
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([u * c - v * s, u * s + v * c], axis=1)


@BOTH
@pytest.mark.parametrize("column", range(4))
@pytest.mark.parametrize("n", [0, 1, 3])
def test_potentials_obey_the_equation_of_motion(plane, column, n):
    """(lambda + G) grad div u + G laplace u + rho omega^2 u = 0, by differences."""
    ring = replace(RING, plane=plane)
    omega, h, weights = 2e5, 2e-5, np.eye(4)[column]
    steps = h * np.arange(-1, 2)
    x, y = np.meshgrid(0.031 + steps, 0.017 + steps, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    u = field(ring, n, omega, weights, points).reshape(3, 3, 2)
    xx = (u[2, 1] - 2 * u[1, 1] + u[0, 1]) / h**2
    yy = (u[1, 2] - 2 * u[1, 1] + u[1, 0]) / h**2
    xy = (u[2, 2] - u[2, 0] - u[0, 2] + u[0, 0]) / (4 * h**2)
    lam, G = lame(ring)
    grad_div = np.array([xx[0] + xy[1], xy[0] + yy[1]])
    inertia = ring.density * omega**2 * u[1, 1]
    residual = (lam + G) * grad_div + G * (xx + yy) + inertia
    scale = (lam + 2 * G) * np.abs([xx, yy, xy]).max() + np.abs(inertia).max()
    assert np.abs(residual).max() < 1e-5 * scale


@BOTH
@pytest.mark.parametrize("n", [0, 1, 3])
def test_stresses_follow_from_the_displacement(plane, n):
    ring, omega, r, h = replace(RING, plane=plane), 2e5, 0.041, 1e-7
    lam, G = lame(ring)
    below, here, above = (
        oracle.displacement_and_stress(ring, n, omega, q) for q in (r - h, r, r + h)
    )
    slope = (above[:2] - below[:2]) / (2 * h)
    u, v, radial, shear = here
    direct = lam * (slope[0] + (u + n * v) / r) + 2 * G * slope[0]
    np.testing.assert_allclose(
        G * radial, direct, rtol=1e-6, atol=1e-6 * G * np.abs(radial).max()
    )
    direct = slope[1] - (v + n * u) / r
    np.testing.assert_allclose(
        shear, direct, rtol=1e-6, atol=1e-6 * np.abs(shear).max()
    )


def torsional_frequencies(ring, highest):
    """n = 0, u_theta = J1(k r) Y1(k a) - Y1(k r) J1(k a), a at the hub [Hz].

    d(u/r)/dr = 0 at the rim b: J2(k b) Y1(k a) = Y2(k b) J1(k a), k = omega / c_s.
    """

    def condition(frequency):
        k = 2.0 * np.pi * frequency / ring.shear_speed
        a, b = k * ring.hub_radius, k * ring.outer_radius
        return jv(2, b) * yv(1, a) - yv(2, b) * jv(1, a)

    return oracle.roots(condition, highest)


def radial_frequencies(ring, highest):
    """n = 0, u_r = J1(k r) Y1(k a) - Y1(k r) J1(k a), a at the hub [Hz].

    At the rim b: (lambda + 2 G) u' + lambda u / b = 0, k = omega / c_p.
    """
    lam, G = lame(ring)
    speed = np.sqrt((lam + 2.0 * G) / ring.density)

    def condition(frequency):
        k = 2.0 * np.pi * frequency / speed
        a, b = k * ring.hub_radius, k * ring.outer_radius
        first, second = (
            (lam + 2.0 * G) * bessel(1, b, 1) + lam * bessel(1, b, 0) / b
            for bessel in (jvp, yvp)
        )
        return first * yv(1, a) - second * jv(1, a)

    return oracle.roots(condition, highest)


@BOTH
def test_determinant_of_n_0_parts_into_twist_and_breathing(plane):
    ring = replace(RING, plane=plane)
    parts = [
        torsional_frequencies(ring, 1e5),
        radial_frequencies(ring, 1e5),
    ]
    assert min(map(len, parts)) >= 2
    full_ring = oracle.frequencies(ring, 0, 1e5)
    np.testing.assert_allclose(full_ring, np.sort(np.concatenate(parts)), rtol=1e-10)


@BOTH
def test_thin_ring_is_a_layer_of_quarter_waves(plane):
    """(2 k - 1) c / (4 t), c of shear or of dilatation, as t -> 0."""
    ring = replace(RING, outer_radius=20e-3 + 2e-5, plane=plane)
    lam, G = lame(ring)
    for speed, frequencies in (
        (np.sqrt(G / ring.density), torsional_frequencies(ring, 5e8)),
        (np.sqrt((lam + 2 * G) / ring.density), radial_frequencies(ring, 5e8)),
    ):
        layer = (2 * np.arange(len(frequencies)) + 1) * speed / 4 / 2e-5
        assert len(frequencies) >= 3
        np.testing.assert_allclose(frequencies, layer, rtol=2e-3)


def test_shift_of_the_rim_is_softer_in_plane_stress():
    stress, strain = (
        oracle.frequencies(replace(RING, plane=plane), 1, 5e4)
        for plane in ("stress", "strain")
    )
    assert stress[0] < strain[0]


@settings(max_examples=8, deadline=None)
@given(scale=st.floats(0.1, 10.0), n=st.integers(0, 5))
def test_frequency_goes_with_one_over_size(scale, n):
    larger = replace(RING, hub_radius=scale * 20e-3, outer_radius=scale * 66e-3)
    one = oracle.frequencies(RING, n, 6e4)
    two = oracle.frequencies(larger, n, 6e4 / scale)
    np.testing.assert_allclose(scale * two, one, rtol=1e-9)


@pytest.mark.parametrize("hub", [0.0, 66e-3, np.nan])
def test_hub_radius_is_checked(hub):
    with pytest.raises(ValueError, match="hub_radius"):
        replace(RING, hub_radius=hub)
