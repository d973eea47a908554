"""Beams of known shape, a tooth against quadrature, and cracks in both."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from lumped.closed_forms.tooth_crack import (
    RootCrack,
    cracked_compliance,
    cracked_sections,
    hinge_factor,
)
from lumped.closed_forms.tooth_energy import (
    FlankForce,
    ToothFoundation,
    ToothMaterial,
    ToothOutline,
    beam_compliance,
    contact_compliance,
    mesh_stiffness,
)

STEEL = ToothMaterial(206e9, 0.3)
E, G = STEEL.young_modulus, STEEL.shear_modulus
WIDTH, LENGTH, HALF = 20e-3, 5.6e-3, 2e-3  # m
SQUARE_LOAD = FlankForce(LENGTH, 0.0)
MODELS = "parallel", "parabola", "hinge"


def straight(root=HALF, tip=HALF, points=2):
    """A trapezoid, half as thick as `root` and `tip` [m]."""
    return ToothOutline(
        np.linspace(0.0, LENGTH, points), np.linspace(root, tip, points)
    )


def curved(points=801):
    """A tooth with a fillet: 2.6 mm half as thick at its root, 0.9 mm at its tip."""
    x = LENGTH * np.linspace(0.0, 1.0, points) ** 1.5
    return ToothOutline(x, curved_half(x))


def curved_half(x):
    return 2.2e-3 - 1.3e-3 * (x / LENGTH) ** 1.3 + 0.4e-3 * np.exp(-x / 0.4e-3)


def compliance(outline, load=SQUARE_LOAD, end=LENGTH):
    return beam_compliance(outline.sections(end), load, STEEL, WIDTH)


def cracked(outline, crack, load=SQUARE_LOAD, end=LENGTH):
    return cracked_compliance(outline, end, load, crack, STEEL, WIDTH)


def test_rectangular_cantilever():
    """L^3 / (3 E I), 6/5 L / (G A) and L / (E A)."""
    area, inertia = 2.0 * HALF * WIDTH, (2.0 * HALF) ** 3 * WIDTH / 12.0
    across = compliance(straight())
    assert across.bending == pytest.approx(LENGTH**3 / (3 * E * inertia), rel=1e-13)
    assert across.shear == pytest.approx(1.2 * LENGTH / (G * area), rel=1e-13)
    assert across.axial == 0.0
    along = compliance(straight(), FlankForce(0.0, 0.5 * math.pi))
    assert along.axial == pytest.approx(LENGTH / (E * area), rel=1e-13)
    assert along.bending == pytest.approx(0.0, abs=1e-20)


def test_tapered_cantilever():
    """Thickness t0 + s xi from the load: integral of xi^2 / t^3, and of 1 / t."""
    root, tip = 2.0 * HALF, 0.8 * HALF
    slope = (root - tip) / LENGTH
    moment = math.log(root / tip) + 2.0 * tip / root - 0.5 * (tip / root) ** 2 - 1.5
    across = compliance(straight(0.5 * root, 0.5 * tip, points=41))
    bending = 12.0 * moment / (E * WIDTH * slope**3)
    shear = 1.2 * math.log(root / tip) / (G * WIDTH * slope)
    assert across.bending == pytest.approx(bending, rel=1e-12)
    assert across.shear == pytest.approx(shear, rel=1e-12)


@pytest.mark.parametrize("beta", [-0.1, 0.0, 0.35])
def test_curved_tooth_against_quadrature(beta):
    """Moment of the two components of the force about the centre line."""
    end = 0.8 * LENGTH
    side = float(curved_half(end))
    load = FlankForce(end * math.cos(beta) - side * math.sin(beta), beta)
    parts = compliance(curved(), load, end)

    def moment(x):
        return (end - x) * math.cos(beta) - side * math.sin(beta)

    def integral(function):
        return quad(function, 0.0, end, epsrel=1e-11, limit=200)[0]

    bending = integral(lambda x: moment(x) ** 2 / curved_half(x) ** 3)
    shear = integral(lambda x: 1.0 / curved_half(x))
    assert parts.bending == pytest.approx(1.5 * bending / (E * WIDTH), rel=1e-5)
    expected = 0.6 * math.cos(beta) ** 2 * shear / (G * WIDTH)
    assert parts.shear == pytest.approx(expected, rel=1e-5)
    expected = 0.5 * math.sin(beta) ** 2 * shear / (E * WIDTH)
    assert parts.axial == pytest.approx(expected, rel=1e-5, abs=1e-25)


def test_many_loads_at_once():
    sections = curved().sections(LENGTH)
    loads = FlankForce(np.array([4e-3, 5e-3]), np.array([0.3, 0.2]))
    both = beam_compliance(sections, loads, STEEL, WIDTH)
    one = beam_compliance(sections, FlankForce(5e-3, 0.2), STEEL, WIDTH)
    assert both.total.shape == (2,)
    assert both.total[1] == one.total


def test_outline_of_polygon_converges_with_order_two():
    exact = compliance(curved(6401)).total
    errors = [abs(compliance(curved(n)).total - exact) for n in (101, 201, 401)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


@pytest.mark.parametrize("angle", [0.5 * math.pi, 0.7])
def test_rectangle_with_a_parallel_limit_line(angle):
    """Whole below the crack tip, thinner by the depth across from there on."""
    start, depth = 2e-3, 0.9e-3
    crack = RootCrack(start=start, depth=depth, angle=angle)
    parts = cracked(straight(), crack)
    tip = start - depth * math.cos(angle)
    whole, rest = 2.0 * HALF, 2.0 * HALF - depth * math.sin(angle)
    cubes = (LENGTH**3 - (LENGTH - tip) ** 3) / whole**3
    cubes += (LENGTH - tip) ** 3 / rest**3
    assert parts.bending == pytest.approx(4.0 * cubes / (E * WIDTH), rel=1e-12)
    lengths = tip / whole + (LENGTH - tip) / rest
    assert parts.shear == pytest.approx(1.2 * lengths / (G * WIDTH), rel=1e-12)


def test_rectangle_with_a_parabola():
    """From mid-thickness at the root to the corner: HALF (1 + sqrt(t)), t = x / L.

    With u = sqrt(t) the integrals are those of 2 u (1 - u^2)^2 / (1 + u)^3, which is
    2 u (1 - u)^2 / (1 + u), and of 2 u / (1 + u).
    """
    crack = RootCrack(start=0.0, depth=HALF, model="parabola")
    x = LENGTH * np.linspace(0.0, 1.0, 2001) ** 2
    parts = cracked(ToothOutline(x, np.full(x.shape, HALF)), crack)
    # 2 u (1 - u)^2 / (1 + u) = 2 u^2 - 6 u + 8 - 8 / (1 + u)
    bending = 12.0 * LENGTH**3 * (2.0 / 3.0 + 5.0 - 8.0 * math.log(2.0))
    assert parts.bending == pytest.approx(bending / (E * WIDTH * HALF**3), rel=1e-6)
    shear = 1.2 * LENGTH * 2.0 * (1.0 - math.log(2.0)) / (G * WIDTH * HALF)
    assert parts.shear == pytest.approx(shear, rel=1e-6)


def test_parabola_over_a_shallow_crack():
    """A trapezoid whose crack tip is farther out than its corner."""
    outline = straight(2e-3, 0.5e-3, 2001)
    crack = RootCrack(start=0.0, depth=0.2e-3, model="parabola")
    x = np.array([0.0, 0.75 * LENGTH, LENGTH])
    expected = [1.8e-3, 0.5e-3 + 1.3e-3 * 0.5, 0.5e-3]
    np.testing.assert_allclose(crack.limit_line(outline, x), expected, rtol=1e-12)
    same = RootCrack(start=0.0, depth=1.5e-3, model="parabola")
    np.testing.assert_allclose(same.limit_line(outline, x), 0.5e-3, rtol=1e-12)


@pytest.mark.parametrize("part", [0.01, 0.1, 0.2, 0.4, 0.6])
def test_hinge_against_another_fit(part):
    """S (1 - a/b)^2 / (a/b)^2 of Tada, Paris and Irwin's handbook, up to 5 % off."""
    fit = np.polynomial.Polynomial((5.93, -19.69, 37.14, -35.84, 13.12))
    expected = (part / (1.0 - part)) ** 2 * fit(part)
    assert hinge_factor(part) == pytest.approx(expected, rel=0.05)


def test_hinge_by_the_energy_that_a_crack_releases():
    """Rate of the compliance 24 S / (E w b^2) over a is 2 w K^2 / (E M^2)."""
    b, M, a, step = 4e-3, 1.0, 1.4e-3, 1e-8
    rate = (hinge_factor((a + step) / b) - hinge_factor((a - step) / b)) / (2.0 * step)
    F = np.polynomial.polynomial.polyval(a / b, (1.122, -1.4, 7.33, -13.08, 14.0))
    K = 6.0 * M / (WIDTH * b**2) * math.sqrt(math.pi * a) * F
    expected = 2.0 * WIDTH * K**2 / (E * M**2)
    assert 24.0 * rate / (E * WIDTH * b**2) == pytest.approx(expected, rel=1e-6)


def test_hinge_turns_the_tooth_about_the_root():
    """24 S / (E w b^2) times the square of the moment arm."""
    part, start = 0.3, 1e-3
    crack = RootCrack(start=start, depth=part * 2.0 * HALF, model="hinge")
    added = cracked(straight(), crack).bending - compliance(straight()).bending
    turning = 24.0 * hinge_factor(part) / (E * WIDTH * (2.0 * HALF) ** 2)
    assert added == pytest.approx(turning * (LENGTH - start) ** 2, rel=1e-10)
    assert cracked(straight(), crack).shear == compliance(straight()).shear


def test_foundation_by_hand():
    """h = 4, theta = 0.06: L 6.929, M 1.454, P 5.796, Q 0.333 of the printed table."""
    body = ToothFoundation(
        root_radius=40e-3, hub_radius=10e-3, root_half_angle=0.06, young_modulus=E
    )
    height, beta = 44e-3, 0.3
    u = 4e-3 / (2.0 * 0.06 * 40e-3)
    shape = 6.929 * u**2 + 1.454 * u + 5.796 * (1.0 + 0.333 * math.tan(beta) ** 2)
    expected = math.cos(beta) ** 2 * shape / (E * WIDTH)
    assert body.compliance(height, beta, WIDTH) == pytest.approx(expected, rel=1e-3)


def test_contact_and_mesh():
    hertz = contact_compliance(STEEL, STEEL, WIDTH)
    assert 1.0 / hertz == pytest.approx(math.pi * E * WIDTH / (4.0 * 0.91), rel=1e-14)
    pairs = np.array([[hertz, 2.0 * hertz], [hertz, math.inf]])
    np.testing.assert_allclose(mesh_stiffness(pairs), [1.5 / hertz, 1.0 / hertz])


OUTLINES = st.builds(
    straight, st.floats(1e-3, 3e-3), st.floats(0.4e-3, 1e-3), st.just(101)
)
ANGLES = st.floats(0.3, 0.5 * math.pi)


@settings(max_examples=50, deadline=None)
@given(
    outline=OUTLINES,
    angle=ANGLES,
    model=st.sampled_from(MODELS),
    start=st.floats(0.0, 0.4),
    beta=st.floats(0.0, 0.5),
)
def test_no_crack_is_the_healthy_tooth_to_the_bit(outline, angle, model, start, beta):
    crack = RootCrack(start=start * LENGTH, depth=0.0, angle=angle, model=model)
    load = FlankForce(0.9 * LENGTH, beta)
    assert cracked(outline, crack, load) == compliance(outline, load)


@settings(max_examples=100, deadline=None)
@given(
    outline=OUTLINES,
    angle=ANGLES,
    model=st.sampled_from(MODELS),
    start=st.floats(0.0, 0.3),
    depths=st.tuples(st.floats(0.0, 0.5), st.floats(0.0, 0.5)),
)
def test_deeper_cracks_are_softer(outline, angle, model, start, depths):
    """Depths up to half the thickness at the mouth."""
    mouth = 2.0 * float(outline.thickness_at(start * LENGTH))
    shallow, deep = (
        cracked(
            outline,
            RootCrack(start=start * LENGTH, depth=d * mouth, angle=angle, model=model),
        )
        for d in sorted(depths)
    )
    assert deep.total >= shallow.total * (1.0 - 1e-9)
    assert deep.axial == shallow.axial


def test_wrong_inputs_are_refused():
    outline = straight(2e-3, 0.5e-3, 11)
    with pytest.raises(ValueError, match="position must rise"):
        ToothOutline(np.array([0.0, 1e-3, 1e-3]), np.full(3, HALF))
    with pytest.raises(ValueError, match="half_thickness must be positive"):
        ToothOutline(np.array([0.0, 1e-3]), np.array([HALF, math.nan]))
    with pytest.raises(ValueError, match=r"end = .*; must be above"):
        outline.sections(1.01 * LENGTH)
    with pytest.raises(ValueError, match=r"angle = .*; must be above 0"):
        RootCrack(start=0.0, depth=1e-3, angle=2.0)
    with pytest.raises(
        ValueError, match=r"model = .*; must be one of parallel, parabola"
    ):
        RootCrack(start=0.0, depth=1e-3, model="curve")
    with pytest.raises(ValueError, match=r"depth = .*; must be 0 or more"):
        RootCrack(start=0.0, depth=math.nan)
    with pytest.raises(ValueError, match=r"start = .*; must be"):
        cracked_sections(outline, LENGTH, RootCrack(start=-1e-3, depth=1e-3))
    with pytest.raises(
        ValueError, match=r"depth = .*; must be 0 to 0\.6 of the thickness"
    ):
        cracked(outline, RootCrack(start=0.0, depth=2.5e-3, model="hinge"))
    with pytest.raises(ValueError, match=r"depth = .*; must leave some thickness"):
        cracked_sections(outline, LENGTH, RootCrack(start=0.0, depth=3.9e-3))
