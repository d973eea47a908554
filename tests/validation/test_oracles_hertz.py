"""The line contact formulas against quadrature, limits and scaling."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from validation.oracles import hertz
from validation.oracles.hertz import Material

STEEL = Material(206e9, 0.3)
BRONZE = Material(110e9, 0.34)
RADIUS = 9e-3  # m
LOAD = 90e3  # N/m
PLANES = ("stress", "strain")


def contact(plane, load=LOAD):
    """Half-width [m] and peak pressure [Pa] of steel on bronze."""
    modulus = hertz.effective_modulus(STEEL, BRONZE, plane)
    return (
        float(hertz.half_width(load, RADIUS, modulus)),
        float(hertz.peak_pressure(load, RADIUS, modulus)),
    )


def total_approach(load, depths=(3e-3, 4e-3), plane="strain"):
    return hertz.approach(load, RADIUS, (STEEL, BRONZE), depths, plane)


def line_load_compression(x, depth, body):
    """Sinking at x of the surface towards (0, depth), per line load [m^2/N].

    Flamant's normal displacement, Johnson eq. (2.19) at the surface and its interior
    form, so that every logarithm has one datum. Elastic moduli are in-plane.
    """
    r = np.hypot(x, depth)
    E, nu = body
    inside = 2.0 * np.log(r) - (1.0 + nu) * depth**2 / r**2 + (1.0 + nu)
    surface = 2.0 * np.log(abs(x)) + (1.0 + nu)
    return (inside - surface) / (np.pi * E)


def axis_stress(z, a, peak):
    """(lateral, normal) below the middle of the contact, Johnson eqs. (4.46a, b)."""
    root = np.hypot(a, z)
    return -peak / a * ((a**2 + 2.0 * z**2) / root - 2.0 * z), -peak * a / root


def test_plane_moduli_by_hand():
    body = hertz.plane_moduli(Material(200e9, 0.25), "strain")
    assert body.young_modulus == pytest.approx(200e9 / 0.9375)
    assert body.poisson_ratio == pytest.approx(1.0 / 3.0)
    assert hertz.plane_moduli(STEEL, "stress") == STEEL


def test_effective_radius_of_a_flat():
    assert hertz.effective_radius(RADIUS, np.inf) == pytest.approx(RADIUS)


@pytest.mark.parametrize("plane", PLANES)
def test_pressure_carries_the_load(plane):
    a, peak = contact(plane)
    carried, _ = quad(lambda x: hertz.pressure(x, a, peak), -a, a)
    assert carried == pytest.approx(LOAD, rel=1e-7)
    np.testing.assert_array_equal(hertz.pressure([-2 * a, 1.1 * a], a, peak), 0.0)


@pytest.mark.parametrize("plane", PLANES)
def test_pressure_flattens_the_gap(plane):
    """Within the contact the surface displacements add up to x^2 / (2 R)."""
    a, peak = contact(plane)
    modulus = hertz.effective_modulus(STEEL, BRONZE, plane)

    def relative_sinking(x):
        split = np.linspace(-a, a, 4001)
        middle = 0.5 * (split[1:] + split[:-1])
        arm = split - x
        antiderivative = arm * (np.log(np.abs(arm) + 1e-300) - 1.0)  # of ln|s - x|
        kernel = np.diff(antiderivative)
        return -2.0 / (np.pi * modulus) * hertz.pressure(middle, a, peak) @ kernel

    for x in (0.3 * a, 0.6 * a, 0.9 * a):
        drop = relative_sinking(0.0) - relative_sinking(x)
        assert drop == pytest.approx(x**2 / (2.0 * RADIUS), rel=1e-4)


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("depth_ratio", [0.5, 3.0, 40.0])
def test_compression_is_the_integral_of_the_half_plane_kernel(plane, depth_ratio):
    a, peak = contact(plane)
    depth, body = depth_ratio * a, hertz.plane_moduli(STEEL, plane)

    def integrand(angle):  # x = a cos(angle) removes the square root
        x = a * np.cos(angle)
        return peak * a * np.sin(angle) ** 2 * line_load_compression(x, depth, body)

    half, _ = quad(integrand, 0.0, 0.5 * np.pi, epsabs=0.0, epsrel=1e-9)
    exact = hertz.compression(LOAD, a, depth, body)
    assert exact == pytest.approx(2.0 * half, rel=1e-7)


@pytest.mark.parametrize("plane", PLANES)
def test_compression_is_the_integral_of_the_axial_strain(plane):
    a, peak = contact(plane)
    E, nu = body = hertz.plane_moduli(STEEL, plane)

    def strain(z):
        lateral, normal = axis_stress(z, a, peak)
        return -(normal - nu * lateral) / E

    integral, _ = quad(strain, 0.0, 20 * a, epsrel=1e-10)
    assert hertz.compression(LOAD, a, 20 * a, body) == pytest.approx(integral, rel=1e-8)


@pytest.mark.parametrize("plane", PLANES)
def test_compression_tends_to_the_deep_form(plane):
    """Johnson eq. (5.57); the remainder falls with (a/d)^2."""
    a, _ = contact(plane)
    E, nu = body = hertz.plane_moduli(STEEL, plane)
    ratios = np.array([10.0, 20.0, 40.0])
    deep = LOAD / (np.pi * E) * (2.0 * np.log(2.0 * ratios) - nu)
    error = np.abs(hertz.compression(LOAD, a, ratios * a, body) - deep)
    rate = np.polyfit(np.log(ratios), np.log(error), 1)[0]
    assert rate == pytest.approx(-2.0, abs=0.02)


def test_compression_does_not_cancel_far_away():
    body = hertz.plane_moduli(STEEL, "strain")
    deep = 1.0 / (np.pi * body.young_modulus)
    deep *= 2.0 * np.log(2e9) - body.poisson_ratio
    assert hertz.compression(1.0, 1e-9, 1.0, body) == pytest.approx(deep, rel=1e-12)


@pytest.mark.parametrize("plane", PLANES)
def test_tangent_compliance_follows_from_the_approach(plane):
    """Deep form: a grows with sqrt(P), so d delta/dP = delta/P - 1 / (pi E*)."""
    depths = (3e-3, 4e-3)
    step = 1e-4 * LOAD
    secant = total_approach(LOAD, depths, plane) / LOAD
    tangent = np.diff(total_approach(LOAD + np.array([-step, step]), depths, plane))
    tangent = tangent[0] / (2.0 * step)
    modulus = hertz.effective_modulus(STEEL, BRONZE, plane)
    assert secant - tangent == pytest.approx(1.0 / (np.pi * modulus), rel=2e-3)


def test_energy_is_the_integral_of_the_force():
    """Contact stiffens: work = P delta / 2 - P^2 / (4 pi E*), from the deep form.

    The work is P delta less the complementary energy, the integral of delta dP.
    """
    complementary, _ = quad(total_approach, 1e-9 * LOAD, LOAD, epsrel=1e-9)
    product = LOAD * float(total_approach(LOAD))
    modulus = hertz.effective_modulus(STEEL, BRONZE, "strain")
    surplus = LOAD**2 / (4.0 * np.pi * modulus)
    work = product - complementary
    assert 0.5 * product - work == pytest.approx(surplus, rel=1e-3)


def test_plane_strain_is_stiffer():
    assert total_approach(LOAD, plane="strain") < total_approach(LOAD, plane="stress")


def test_swapping_the_bodies_changes_nothing():
    swapped = hertz.approach(LOAD, RADIUS, (BRONZE, STEEL), (4e-3, 3e-3), "strain")
    assert swapped == pytest.approx(float(total_approach(LOAD)), rel=1e-14)


@given(
    scale=st.floats(0.01, 100.0),
    load=st.floats(1e3, 1e6),
    plane=st.sampled_from(PLANES),
)
def test_similar_contacts(scale, load, plane):
    """Lengths and load per length times `scale`: approach times `scale` as well."""
    bodies, depths = (STEEL, BRONZE), np.array([3e-3, 4e-3])
    one = hertz.approach(load, RADIUS, bodies, tuple(depths), plane)
    many = hertz.approach(
        scale * load, scale * RADIUS, bodies, tuple(scale * depths), plane
    )
    np.testing.assert_allclose(many, scale * one, rtol=1e-12)


@given(load=st.floats(1e2, 1e6), factor=st.floats(1.01, 10.0))
def test_contact_stiffens_with_load(load, factor):
    soft, hard = total_approach(load) / load, total_approach(factor * load) / load
    assert hard / factor < soft


def test_linear_compliance_of_equal_bodies():
    expected = 4.0 * (1.0 - 0.3**2) / (np.pi * 206e9)
    assert hertz.linear_compliance(STEEL, STEEL) == pytest.approx(expected)


@pytest.mark.parametrize("load", [0.0, -1.0, np.nan])
def test_load_must_be_positive(load):
    with pytest.raises(ValueError, match=r"load = .*; must be positive"):
        total_approach(load)


def test_plane_is_checked():
    with pytest.raises(ValueError, match="plane = 'axial'"):
        hertz.plane_moduli(STEEL, "axial")
