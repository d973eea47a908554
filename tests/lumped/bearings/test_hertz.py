"""Contact coefficients: Hertz by direct integration, Harris's steel, Palmgren."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from lumped.bearings.hertz import (
    POINT_EXPONENT,
    effective_modulus,
    elliptic_contact,
    in_series,
    line_coefficient,
    line_pressure,
)
from lumped.bearings.rolling import BallBearing

E, NU = 207e9, 0.3
MODULUS = effective_modulus(E, NU)  # twice Johnson's E*


def approach_by_integrals(rolling: float, transverse: float, load: float) -> float:
    """Approach of two bodies from the integrals over the pressure's ellipsoid.

    Johnson, Contact Mechanics (1985), eqs. (3.33), (3.63) to (3.65), without elliptic
    integrals: half-axes a > b and the pressure p0 satisfy the curvatures.
    """
    half_modulus = 0.5 * MODULUS

    def shape(ratio: float, power: int) -> float:
        # int dw / ((a^2 + w)^(..) ...) with a = 1, b = 1 / ratio, w = tan^2
        def integrand(angle: float) -> float:
            sine, cosine = math.sin(angle), math.cos(angle)
            root = math.sqrt(cosine**2 / ratio**2 + sine**2)
            return (1.0, cosine**2, cosine**2 / (cosine**2 / ratio**2 + sine**2))[
                power
            ] / root

        return quad(integrand, 0.0, 0.5 * math.pi, epsabs=1e-14, limit=400)[0]

    def balance(ratio: float) -> float:
        # along the long axis the bodies curve less: A / B is the ratio of integrals
        return shape(ratio, 1) / shape(ratio, 2) - transverse / rolling

    ratio = brentq(balance, 1.0 + 1e-12, 1e3, xtol=1e-13)
    # 3 P / (2 pi a^3 E*) times the integrals: A = half the transverse curvature
    a3 = 3.0 * load * shape(ratio, 1) / (math.pi * half_modulus * transverse)
    return 1.5 * load * shape(ratio, 0) / (math.pi * half_modulus * a3 ** (1.0 / 3.0))


@pytest.mark.parametrize("ratio", [1.5, 5.0, 20.0, 60.0])
def test_a_point_contact_is_that_of_the_ellipsoid_of_pressure(ratio):
    rolling, load = 300.0, 700.0
    contact = elliptic_contact(rolling, rolling / ratio)
    approach = (load / contact.coefficient(MODULUS)) ** (1.0 / POINT_EXPONENT)
    expected = approach_by_integrals(rolling, rolling / ratio, load)
    assert approach == pytest.approx(expected, rel=1e-9)


def test_equal_curvatures_are_a_sphere_on_a_plane():
    radius = 5e-3
    contact = elliptic_contact(1.0 / radius, 1.0 / radius)
    assert contact.ellipticity == 1.0
    expected = 4.0 / 3.0 * 0.5 * MODULUS * math.sqrt(radius)
    assert contact.coefficient(MODULUS) == pytest.approx(expected, rel=1e-12)
    load = 100.0
    pressure = (6.0 * load * (0.5 * MODULUS) ** 2 / (math.pi**3 * radius**2)) ** (1 / 3)
    assert contact.pressure(load, MODULUS) == pytest.approx(pressure, rel=1e-12)


def test_almost_equal_curvatures_lead_to_equal_ones():
    one, two = (elliptic_contact(100.0 * (1.0 + d), 100.0) for d in (0.0, 1e-7))
    ratio = two.coefficient(MODULUS) / one.coefficient(MODULUS)
    assert ratio == pytest.approx(1.0, abs=1e-6)


def test_the_constant_of_steel():
    """Harris (2007), eq. (7.8): 2.15e5 N/mm^1.5 over sqrt(sum of curvatures / mm)."""
    contact = elliptic_contact(100.0, 100.0)  # delta* = 1
    per_mm = contact.coefficient(MODULUS) * (1e-3) ** 1.5
    assert per_mm == pytest.approx(2.15e5 / math.sqrt(200.0 * 1e-3), rel=3e-3)


def test_curvatures_of_a_209_bearing():
    """Harris (2007), example 2.3: sums of 0.2018 and 0.1378 1/mm at both races."""
    bearing = BallBearing(balls=9, element_diameter=12.7e-3, pitch_diameter=65e-3)
    inner, outer = bearing.contacts
    assert 1e-3 / inner.radius == pytest.approx(0.2018, abs=1e-4)
    assert 1e-3 / outer.radius == pytest.approx(0.1378, abs=1e-4)


@pytest.mark.parametrize(
    ("diameter", "pitch", "balls"), [(7.94e-3, 38.5e-3, 9), (15.081e-3, 65e-3, 8)]
)
def test_approximations_of_hamrock_and_brewe(diameter, pitch, balls):
    """Of bearings 6205 and 6308; the approximations err by up to 3 %."""
    bearing = BallBearing(balls=balls, element_diameter=diameter, pitch_diameter=pitch)
    grooves = 2.0 / diameter - 1.0 / (0.52 * diameter)
    races = (2.0 / (pitch - diameter), -2.0 / (pitch + diameter))
    for race, contact in zip(races, bearing.contacts, strict=True):
        ratio = (2.0 / diameter + race) / grooves
        ellipticity = 1.0339 * ratio**0.636
        first = 1.5277 + 0.6023 * math.log(ratio)
        second = 1.0003 + 0.5968 / ratio
        assert contact.ellipticity == pytest.approx(ellipticity, rel=0.03)
        assert contact.first == pytest.approx(first, rel=0.03)
        assert contact.second == pytest.approx(second, rel=0.03)


def test_a_line_contact_in_the_units_of_palmgren():
    """Harris (2007), eq. (7.10): 8.06e4 l^(8/9) N/mm^(10/9) of steel."""
    length, modulus = 7.5e-3, effective_modulus(206e9, 0.3)
    per_mm = line_coefficient(length, modulus) * (1e-3) ** (10.0 / 9.0)
    assert per_mm == pytest.approx(8.06e4 * 7.5 ** (8.0 / 9.0), rel=2e-3)


def test_pressure_of_cylinders():
    """p0 = sqrt(P E* / (pi l R)), Johnson (1985), eq. (4.45)."""
    load, length, radius = 500.0, 8e-3, 4e-3
    expected = math.sqrt(load * 0.5 * MODULUS / (math.pi * length * radius))
    pressure = line_pressure(load, length, 1.0 / radius, MODULUS)
    assert pressure == pytest.approx(expected, rel=1e-12)


@given(
    one=st.floats(1e5, 1e12),
    other=st.floats(1e5, 1e12),
    load=st.floats(1.0, 1e5),
    exponent=st.sampled_from([1.5, 10.0 / 9.0]),
)
def test_contacts_in_series_carry_one_load(one, other, load, exponent):
    both = in_series(one, other, exponent)
    parts = sum((load / k) ** (1.0 / exponent) for k in (one, other))
    assert (load / both) ** (1.0 / exponent) == pytest.approx(parts, rel=1e-9)
