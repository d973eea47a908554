"""The twisted ring against equilibrium, energy and the law of the torsion spring."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from validation.oracles import ring
from validation.oracles.ring import Ring

BODY = Ring(hub_radius=13.5e-3, outer_radius=45e-3, shear_modulus=79e9, face_width=0.02)
TORQUE = 100.0  # N m


def shear_stress(radius):
    """tau_r_theta = T / (2 pi r^2 b): moment about the axis."""
    return TORQUE / (2.0 * np.pi * radius**2 * BODY.face_width)


def grid_displacement(centre, step):
    """Displacement on a 3 x 3 grid around centre, shape (3, 3, 2), axes y, x."""
    offset = step * np.arange(-1, 2)
    x, y = np.meshgrid(centre[0] + offset, centre[1] + offset)
    r = np.hypot(x, y)
    turn = ring.tangential_displacement(BODY, TORQUE, r) / r
    return np.stack((-y * turn, x * turn), axis=2)


@pytest.mark.parametrize("centre", [(0.02, 0.0), (0.0, 0.03), (-0.025, 0.017)])
def test_equilibrium_by_finite_differences(centre):
    """div u = 0 and laplace u = 0: Navier's equations for any Poisson's ratio."""
    step = 1e-5
    u = grid_displacement(centre, step)
    divergence = (u[1, 2, 0] - u[1, 0, 0] + u[2, 1, 1] - u[0, 1, 1]) / (2.0 * step)
    neighbours = u[1, 2] + u[1, 0] + u[2, 1] + u[0, 1]
    laplacian = (neighbours - 4.0 * u[1, 1]) / step**2
    scale = np.linalg.norm(u[1, 1]) / np.hypot(*centre)
    assert abs(divergence) < 1e-5 * scale
    assert np.linalg.norm(laplacian) < 1e-4 * scale / np.hypot(*centre)


def test_stress_follows_from_the_displacement():
    r, step = 0.025, 1e-6
    turn = [
        ring.tangential_displacement(BODY, TORQUE, q) / q for q in (r - step, r + step)
    ]
    strain = r * (turn[1] - turn[0]) / (2.0 * step)
    expected = BODY.shear_modulus * strain
    assert shear_stress(r) == pytest.approx(expected, rel=1e-6)


def test_stress_carries_the_torque_on_every_circle():
    r = np.linspace(BODY.hub_radius, BODY.outer_radius, 7)
    moment = shear_stress(r) * 2 * np.pi * r**2 * BODY.face_width
    np.testing.assert_allclose(moment, TORQUE, rtol=1e-14)


def test_hub_is_held_and_the_rim_turns_with_the_torque():
    assert ring.tangential_displacement(BODY, TORQUE, BODY.hub_radius) == 0.0
    rim = ring.tangential_displacement(BODY, TORQUE, BODY.outer_radius)
    assert rim == pytest.approx(BODY.outer_radius * ring.rotation(BODY, TORQUE))
    assert rim > 0.0


def test_energy_is_half_torque_times_rotation():
    def energy(r):
        square = shear_stress(r) ** 2
        return square / (2.0 * BODY.shear_modulus) * 2.0 * np.pi * r * BODY.face_width

    stored, _ = quad(energy, BODY.hub_radius, BODY.outer_radius, epsrel=1e-12)
    work = 0.5 * TORQUE * ring.rotation(BODY, TORQUE)
    assert stored == pytest.approx(work, rel=1e-10)


def test_thin_ring_is_a_shear_layer():
    """k -> G 2 pi r b / t for the tangential force at r = rb as t -> 0."""
    r, t = 0.05, 1e-6
    thin = Ring(hub_radius=r, outer_radius=r + t, shear_modulus=79e9, face_width=0.02)
    layer = thin.shear_modulus * 2.0 * np.pi * r * thin.face_width / t
    assert ring.line_of_action_stiffness(thin, r) == pytest.approx(layer, rel=1e-4)


def test_line_of_action_stiffness_is_force_over_displacement():
    rb, force = 42e-3, 2000.0
    displacement = rb * ring.rotation(BODY, force * rb)
    stiffness = ring.line_of_action_stiffness(BODY, rb)
    assert stiffness == pytest.approx(force / displacement, rel=1e-13)


@given(cut=st.floats(0.05, 0.95))
def test_rings_in_series(cut):
    """Compliances of the inner and outer part add up to the whole."""
    middle = BODY.hub_radius + cut * (BODY.outer_radius - BODY.hub_radius)
    shared = {"shear_modulus": BODY.shear_modulus, "face_width": BODY.face_width}
    inner = Ring(hub_radius=BODY.hub_radius, outer_radius=middle, **shared)
    outer = Ring(hub_radius=middle, outer_radius=BODY.outer_radius, **shared)
    parts = ring.rotation(inner, TORQUE) + ring.rotation(outer, TORQUE)
    assert parts == pytest.approx(ring.rotation(BODY, TORQUE), rel=1e-10)


@given(scale=st.floats(0.1, 10.0))
def test_stiffness_does_not_depend_on_size(scale):
    """At one face width the line-of-action stiffness is a matter of shape only."""
    scaled = Ring(
        hub_radius=scale * BODY.hub_radius,
        outer_radius=scale * BODY.outer_radius,
        shear_modulus=BODY.shear_modulus,
        face_width=BODY.face_width,
    )
    assert ring.line_of_action_stiffness(scaled, scale * 0.04) == pytest.approx(
        ring.line_of_action_stiffness(BODY, 0.04), rel=1e-12
    )


def test_shear_modulus_of_steel():
    assert ring.shear_modulus(206e9, 0.3) == pytest.approx(79.23e9, rel=1e-4)


@pytest.mark.parametrize("hub", [0.0, 45e-3, np.nan])
def test_hub_radius_is_checked(hub):
    with pytest.raises(ValueError, match="hub_radius"):
        Ring(hub_radius=hub, outer_radius=45e-3, shear_modulus=1.0, face_width=1.0)
