"""The analytic tooth against beam integration, scaling, symmetry and the FE mean."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from lumped.closed_forms.tooth_energy import body_factors
from validation.oracles import potential_energy as pe
from validation.oracles import ring
from validation.oracles.potential_energy import AnalyticGear

WIDTH, FORCE = 25.4e-3, 2205.0  # m, N: the idler set, 100 N m on the pinion
ANGLE = math.radians(21.22)
FE_MEAN = 2.98e8  # N/m, printed for this pair
POSITIONS = (np.arange(400) + 0.5) / 400.0


def standard_gear(teeth, module=2.54e-3, hub=0.4, **changes):
    """Standard steel gear, tip 1 m and root 1.25 m off the reference circle."""
    radius = 0.5 * module * teeth
    values = {
        "teeth": teeth,
        "module": module,
        "pressure_angle": math.radians(20.0),
        "profile_shift": 0.0,
        "tip_radius": radius + module,
        "root_radius": radius - 1.25 * module,
        "hub_radius": hub * radius,
        "young_modulus": 206e9,
        "poisson_ratio": 0.3,
    }
    return AnalyticGear(**(values | changes))


# Tip radii of equal addenda that give the printed contact ratio 1.504.
PINION = standard_gear(38, tip_radius=51.008e-3, hub_radius=13.5e-3)
IDLER = standard_gear(55, tip_radius=72.598e-3, hub_radius=20e-3)


def idler_mesh(positions=POSITIONS, force=FORCE, driver=PINION, driven=IDLER, **law):
    return pe.mesh_stiffness(driver, driven, ANGLE, positions, force, WIDTH, **law)


def mid_flank(gear, fraction=0.6):
    low, high = gear.form_roll_length, gear.tip_roll_length
    return np.array([low + fraction * (high - low)])


def deflection_by_beam_theory(gear, roll, section_count=4001):
    """Compliance along the line of action by integrating the beam outwards [m/N].

    Timoshenko's beam under unit load, rotation and displacements from the root; the
    outline is a spline through the sections, so only the geometry is common.
    """
    x, h, _, _ = (a[0] for a in pe.tooth_sections(gear, np.array([roll])))
    beta = roll / gear.base_radius - gear.base_half_angle
    root = gear.root_radius * np.exp(1j * gear.root_half_angle)
    tip = gear.base_radius * np.exp(-1j * beta) * (1 + 1j * roll / gear.base_radius)
    outline = CubicSpline(np.r_[root.real, x, tip.real], np.r_[root.imag, h, tip.imag])
    x = root.real + (tip.real - root.real) * np.linspace(0, 1, section_count) ** 2
    h, E = outline(x), gear.young_modulus
    G = E / (2.0 * (1.0 + gear.poisson_ratio))
    # The load on the flank, its offset from the axis included.
    moment = (tip.real - x) * np.cos(beta) - tip.imag * np.sin(beta)
    turn = cumulative_simpson(moment / (E * 2 / 3 * h**3), x=x, initial=0.0)
    slope = turn + 1.2 * np.cos(beta) / (G * 2 * h)
    across = cumulative_simpson(slope, x=x, initial=0.0)[-1]
    along = cumulative_simpson(np.sin(beta) / (E * 2 * h), x=x, initial=0.0)[-1]
    along -= turn[-1] * tip.imag
    return across * np.cos(beta) + along * np.sin(beta)


@pytest.mark.parametrize("teeth", [17, 38, 55, 120])
@pytest.mark.parametrize("fraction", [0.2, 0.5, 0.9])
def test_energy_agrees_with_the_integrated_beam(teeth, fraction):
    gear = standard_gear(teeth)
    (roll,) = mid_flank(gear, fraction)
    parts = pe.tooth_compliance(gear, roll, 1.0)
    beam = parts.bending + parts.shear + parts.axial
    assert deflection_by_beam_theory(gear, roll) == pytest.approx(beam[0], rel=2e-3)


@pytest.mark.parametrize("teeth", [14, 17, 38, 55, 120])
def test_sections_fill_the_tooth_without_gaps(teeth):
    gear = standard_gear(teeth)
    roll = mid_flank(gear)
    x, h, _, dx = pe.tooth_sections(gear, roll)
    tangent = roll[0] / gear.base_radius
    loaded = math.hypot(gear.base_radius, roll[0])
    angle = gear.base_half_angle - tangent + math.atan(tangent)
    root = gear.root_radius * math.cos(gear.root_half_angle)
    assert dx.sum() == pytest.approx(loaded * math.cos(angle) - root, rel=1e-12)
    assert (np.diff(x) > 0.0).all()
    assert h[0, 0] == pytest.approx(gear.root_radius * gear.root_half_angle, rel=0.02)


def test_fillet_ends_on_the_flank():
    """The arc and the involute meet with one tangent at the form point."""
    gear = PINION
    x, h, _, _ = pe.tooth_sections(gear, mid_flank(gear))
    q = pe.QUADRATURE_POINTS
    arc = CubicSpline(x[0, q - 4 : q], h[0, q - 4 : q])
    flank = CubicSpline(x[0, q : q + 4], h[0, q : q + 4])
    middle = 0.5 * (x[0, q - 1] + x[0, q])
    assert float(arc(middle)) == pytest.approx(float(flank(middle)), rel=1e-4)
    assert float(arc(middle, 1)) == pytest.approx(float(flank(middle, 1)), abs=0.05)


def test_tooth_thickness_on_the_reference_circle():
    gear = standard_gear(38, profile_shift=0.1, tooth_thinning=50e-6)
    roll = 0.5 * gear.module * gear.teeth * math.sin(gear.pressure_angle)
    angle = gear.base_half_angle - math.tan(gear.pressure_angle) + gear.pressure_angle
    thickness = math.pi / 2 + 0.2 * math.tan(gear.pressure_angle)
    expected = thickness * gear.module - 50e-6
    assert angle * gear.module * gear.teeth == pytest.approx(expected)
    assert gear.form_roll_length < roll < gear.tip_roll_length


def test_quadrature_has_converged(monkeypatch):
    roll = mid_flank(PINION, 0.95)
    coarse = pe.tooth_compliance(PINION, roll, WIDTH)
    monkeypatch.setattr(pe, "QUADRATURE_POINTS", 80)
    fine = pe.tooth_compliance(PINION, roll, WIDTH)
    np.testing.assert_allclose(coarse, fine, rtol=1e-9)


def test_body_factors_by_hand():
    """h = 4, theta = 0.06, from the printed table."""
    L, M, P, Q = body_factors(4.0, 0.06)
    assert pytest.approx(6.929, abs=1e-3) == L
    assert pytest.approx(1.454, abs=1e-3) == M
    assert pytest.approx(5.796, abs=1e-3) == P
    assert pytest.approx(0.333, abs=1e-3) == Q


def test_body_formula_contains_the_twist_of_the_ring():
    """P* grows with h as the torsion of the held ring does: E w C = 2.6/(4 pi) h^2."""
    growth = body_factors(7.0, 0.06)[2] - body_factors(1.4, 0.06)[2]
    rings = [
        ring.Ring(
            hub_radius=1 / h, outer_radius=1.0, shear_modulus=1 / 2.6, face_width=1
        )
        for h in (7.0, 1.4)
    ]
    large, small = (1.0 / ring.line_of_action_stiffness(body, 1.0) for body in rings)
    assert growth == pytest.approx(large - small, rel=0.1)


def test_linear_pair_adds_its_compliances():
    s1 = PINION.base_radius * math.tan(ANGLE)
    s2 = IDLER.base_radius * math.tan(ANGLE)
    teeth = sum(
        pe.tooth_compliance(gear, s, WIDTH).total[0]
        for gear, s in ((PINION, s1), (IDLER, s2))
    )
    hertz = 4.0 * (1.0 - 0.3**2) / (math.pi * 206e9 * WIDTH)
    pair = pe.pair_stiffness(PINION, IDLER, ANGLE, s1, 1.0, WIDTH, contact_law="linear")
    assert pair[0] == pytest.approx(1.0 / (teeth + hertz), rel=1e-12)


def test_pairs_sum_in_linear_contact():
    start, end = pe.nominal_path(PINION, IDLER, ANGLE)
    middle = PINION.base_radius * math.tan(ANGLE)
    rolls = middle + (POSITIONS[:, None] + np.arange(-3, 4)) * PINION.base_pitch
    touching = (rolls >= start) & (rolls <= end)
    pairs = np.zeros(rolls.shape)
    pairs[touching] = pe.pair_stiffness(
        PINION, IDLER, ANGLE, rolls[touching], 1.0, WIDTH, contact_law="linear"
    )
    mesh = idler_mesh(contact_law="linear")
    np.testing.assert_allclose(mesh, pairs.sum(axis=1), rtol=1e-12)


def test_pairs_deflect_equally():
    """Given its share of the force each pair has the deflection of the mesh."""
    start, end = pe.nominal_path(PINION, IDLER, ANGLE)
    rolls = np.array([start + 1e-6, start + 1e-6 + PINION.base_pitch])
    middle = PINION.base_radius * math.tan(ANGLE)
    mesh = idler_mesh((rolls[:1] - middle) / PINION.base_pitch)
    deflection = FORCE / mesh[0]
    shares = FORCE * np.array([0.4, 0.6])
    for _ in range(50):
        pairs = pe.pair_stiffness(PINION, IDLER, ANGLE, rolls, shares, WIDTH)
        shares = pairs * deflection
    assert rolls[1] < end
    assert shares.sum() == pytest.approx(FORCE, rel=1e-10)


def test_double_contact_lasts_as_long_as_the_contact_ratio_says():
    start, end = pe.nominal_path(PINION, IDLER, ANGLE)
    contact_ratio = (end - start) / PINION.base_pitch
    assert contact_ratio == pytest.approx(1.504, abs=1e-3)
    stiffness = idler_mesh()
    jump = 0.5 * (stiffness.min() + stiffness.max())
    assert (stiffness > jump).mean() == pytest.approx(contact_ratio - 1.0, abs=0.02)


@pytest.mark.parametrize("law", ["linear", "stress", "strain"])
def test_swapping_driver_and_driven_mirrors_the_cycle(law):
    forward = idler_mesh(contact_law=law)
    backward = idler_mesh(-POSITIONS, driver=IDLER, driven=PINION, contact_law=law)
    np.testing.assert_allclose(forward, backward, rtol=1e-10)


def test_mesh_is_periodic():
    np.testing.assert_allclose(idler_mesh(POSITIONS + 7.0), idler_mesh(), rtol=1e-9)


def test_equal_gears_mesh_symmetrically():
    stiffness = idler_mesh(driver=PINION, driven=PINION)
    np.testing.assert_allclose(stiffness, stiffness[::-1], rtol=1e-10)


@settings(max_examples=25, deadline=None)
@given(
    teeth=st.tuples(st.integers(17, 120), st.integers(17, 120)),
    scale=st.floats(0.2, 5.0),
    width=st.floats(0.2, 5.0),
    softness=st.floats(0.2, 2.0),
)
def test_scaling(teeth, scale, width, softness):
    """Module and face width: K ~ w at F ~ m w; Young's modulus: K ~ E at F ~ E."""
    pair = [standard_gear(z) for z in teeth]
    other = [
        standard_gear(z, module=scale * 2.54e-3, young_modulus=softness * 206e9)
        for z in teeth
    ]
    position, angle = [0.05, 0.45], math.radians(20.5)
    one = pe.mesh_stiffness(*pair, angle, position, FORCE, WIDTH)
    force = softness * scale * width * FORCE
    many = pe.mesh_stiffness(*other, angle, position, force, width * WIDTH)
    np.testing.assert_allclose(many, softness * width * one, rtol=1e-9)


@settings(max_examples=40, deadline=None)
@given(teeth=st.integers(17, 150), fraction=st.floats(0.3, 0.9))
def test_tooth_softens_towards_the_tip(teeth, fraction):
    """From the lower flank on; near the base circle the moment of the load turns."""
    gear = standard_gear(teeth)
    low, high = mid_flank(gear, fraction), mid_flank(gear, fraction + 0.1)
    inner = pe.tooth_compliance(gear, low, WIDTH)
    outer = pe.tooth_compliance(gear, high, WIDTH)
    assert outer.total > inner.total
    assert outer.shear > inner.shear
    assert min(*inner, *outer) > 0.0


def test_larger_hub_is_stiffer():
    means = [
        idler_mesh(
            driver=replace(PINION, hub_radius=scale * 13.5e-3),
            driven=replace(IDLER, hub_radius=scale * 20e-3),
        ).mean()
        for scale in (0.7, 1.0, 1.4, 2.0)
    ]
    assert (np.diff(means) > 0.0).all()


def test_thinner_teeth_are_softer():
    thinned = replace(PINION, tooth_thinning=0.2e-3)
    assert (idler_mesh(driver=thinned) < idler_mesh()).all()


def test_stiffness_grows_with_force_but_not_in_linear_contact():
    low, high = idler_mesh(force=200.0), idler_mesh(force=4000.0)
    assert (high > low).all()
    assert (high < 1.15 * low).all()
    linear = idler_mesh(force=200.0, contact_law="linear")
    np.testing.assert_allclose(linear, idler_mesh(contact_law="linear"), rtol=1e-11)


def test_plane_strain_contact_is_the_stiffer():
    assert (idler_mesh(contact_law="strain") > idler_mesh(contact_law="stress")).all()


def test_mean_stiffness_is_near_the_finite_elements():
    """3.22e8 N/m in plane stress, 8 % above the printed 2.98e8."""
    mean = idler_mesh(contact_law="stress").mean()
    assert mean == pytest.approx(3.22e8, rel=0.01)
    assert mean == pytest.approx(FE_MEAN, rel=0.15)


def test_counting_the_twist_once_brings_the_mean_to_the_finite_elements():
    """The excess is the body twist counted per pair; once, it gives 2.91e8 N/m."""
    twist = sum(1.0 / hub_stiffness(gear) for gear in (PINION, IDLER))
    mesh = idler_mesh(contact_law="linear")
    contact = idler_mesh(contact_law="stress")
    double = mesh > 0.5 * (mesh.min() + mesh.max())
    pairs = np.where(double, 2, 1)  # of nearly equal stiffness
    once = 1.0 / (1.0 / contact + twist * (1.0 - 1.0 / pairs))
    assert once.mean() == pytest.approx(FE_MEAN, rel=0.05)
    assert np.ptp(once) / once.mean() < np.ptp(contact) / contact.mean()


def hub_stiffness(gear):
    body = ring.Ring(
        hub_radius=gear.hub_radius,
        outer_radius=gear.root_radius,
        shear_modulus=ring.shear_modulus(gear.young_modulus, gear.poisson_ratio),
        face_width=WIDTH,
    )
    return ring.line_of_action_stiffness(body, gear.base_radius)


def test_roll_length_must_lie_on_the_involute():
    for roll in (0.5 * PINION.form_roll_length, 1.1 * PINION.tip_roll_length, math.nan):
        with pytest.raises(ValueError, match="roll_length must lie on the involute"):
            pe.tooth_compliance(PINION, roll, WIDTH)


def test_bad_gears_are_refused():
    with pytest.raises(ValueError, match="radii must satisfy"):
        replace(PINION, hub_radius=0.05)
    with pytest.raises(ValueError, match="tooth thickness"):
        replace(PINION, tip_radius=56e-3)
    with pytest.raises(ValueError, match="fit between the teeth"):
        replace(PINION, profile_shift=1.5)


def test_bad_meshes_are_refused():
    with pytest.raises(ValueError, match="one base pitch"):
        idler_mesh(driven=standard_gear(55, module=2.5e-3))
    with pytest.raises(ValueError, match="contact ratio"):
        pe.mesh_stiffness(PINION, IDLER, math.radians(25), [0.0], FORCE, WIDTH)
    with pytest.raises(ValueError, match="plane = 'axial'"):
        idler_mesh(contact_law="axial")
