"""Forces of rolling bearings by five displacements of the inner ring."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from lumped.bearings.mounted import LAMINAE, MountedBearing, groove_distance
from lumped.bearings.rolling import BallBearing, RollerBearing, Waviness
from lumped.bearings.statics import load_distribution

BALL = BallBearing(balls=9, element_diameter=7.94e-3, pitch_diameter=38.5e-3)
ROLLER = RollerBearing(
    rollers=13, element_diameter=7.5e-3, pitch_diameter=39e-3, length=7.5e-3
)
DEEP_GROOVE = MountedBearing(bearing=replace(BALL, clearance=10e-6))
ANGULAR = MountedBearing(
    bearing=BALL, contact_angle=math.radians(25.0), axial_preload=8e-6
)
OPPOSITE = replace(ANGULAR, contact_angle=-ANGULAR.contact_angle)
ROLLERS = MountedBearing(bearing=replace(ROLLER, clearance=5e-6))
EVERY = (DEEP_GROOVE, ANGULAR, OPPOSITE, ROLLERS)
IDS = ("deep groove", "angular contact", "opposite contact", "rollers")
SCALES = np.array([20e-6, 20e-6, 40e-6, 2e-3, 2e-3])


def random_displacements(count: int = 40):
    return np.random.default_rng(73).uniform(-1.0, 1.0, (count, 5)) * SCALES


def differences(function, at, steps=1e-4 * SCALES):
    """Central differences of fourth order, by the five displacements."""
    columns = []
    for step in np.diag(steps):
        near = function(at + step) - function(at - step)
        far = function(at + 2.0 * step) - function(at - 2.0 * step)
        columns.append((8.0 * near - far) / (12.0 * step.sum()))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("mounted", EVERY, ids=IDS)
def test_force_is_the_gradient_of_the_energy(mounted):
    for u in random_displacements():
        force = mounted.state(u).force
        gradient = differences(lambda v: mounted.state(v).energy, u)
        error = np.abs(gradient - force) * SCALES
        assert error.max() <= 1e-6 * np.abs(force * SCALES).max() + 1e-12


@pytest.mark.parametrize("mounted", EVERY, ids=IDS)
def test_stiffness_is_the_derivative_of_the_force(mounted):
    for u in random_displacements():
        stiffness = mounted.state(u).stiffness
        slopes = differences(lambda v: mounted.state(v).force, u)
        error = np.abs(slopes - stiffness) * SCALES[:, None] * SCALES
        # a contact that begins within a step has a slope of the power 1/2 or 1/9
        largest = np.abs(stiffness * SCALES[:, None] * SCALES).max()
        assert error.max() <= 2e-2 * largest
        assert np.median(error) <= 1e-4 * largest
        np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-9 * stiffness.max())


@pytest.mark.parametrize("mounted", EVERY, ids=IDS)
def test_energy_is_convex(mounted):
    for u in random_displacements():
        scaled = mounted.state(u).stiffness * SCALES[:, None] * SCALES
        values = np.linalg.eigvalsh(scaled)
        assert values[0] >= -1e-12 * abs(values[-1])


@pytest.mark.parametrize("mounted", EVERY, ids=IDS)
def test_one_pitch_of_elements_turns_the_force(mounted):
    pitch = 2.0 * math.pi / mounted.bearing.elements
    c, s = math.cos(pitch), math.sin(pitch)
    plane = np.array([[c, -s], [s, c]])
    turn = np.eye(5)
    turn[:2, :2] = turn[3:, 3:] = plane
    for u in random_displacements(8):
        before, after = mounted.state(u), mounted.state(turn @ u)
        largest = np.abs(before.force).max()
        np.testing.assert_allclose(
            after.force, turn @ before.force, atol=1e-11 * largest
        )
        np.testing.assert_allclose(
            after.stiffness,
            turn @ before.stiffness @ turn.T,
            atol=1e-10 * before.stiffness.max(),
        )


@pytest.mark.parametrize("mounted", EVERY, ids=IDS)
def test_a_mirror_with_the_axis_in_it_mirrors_the_force(mounted):
    # y is reversed, so is the tilt about x, and a tilt about y is not
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    for u in random_displacements(8):
        force = mounted.state(u).force
        mirrored = mounted.state(mirror * u).force
        np.testing.assert_allclose(
            mirrored, mirror * force, atol=1e-11 * np.abs(force).max()
        )


def test_a_mirror_across_the_axis_reverses_the_contact_angle():
    mirror = np.array([1.0, 1.0, -1.0, -1.0, -1.0])
    for u in random_displacements(8):
        force, mirrored = ANGULAR.state(u).force, OPPOSITE.state(mirror * u).force
        np.testing.assert_allclose(
            mirrored, mirror * force, atol=1e-11 * np.abs(force).max()
        )


@pytest.mark.parametrize("bearing", [BALL, ROLLER], ids=["ball", "roller"])
@pytest.mark.parametrize("clearance", [-5e-6, 0.0, 12e-6])
def test_radial_load_is_that_of_the_plane_bearing(bearing, clearance):
    bearing = replace(bearing, clearance=clearance)
    plane = load_distribution(bearing, (1200.0, 500.0))
    state = MountedBearing(bearing=bearing).state(
        np.array([*plane.displacement, 0, 0, 0])
    )
    np.testing.assert_allclose(state.force[:2], [1200.0, 500.0], rtol=1e-9)
    np.testing.assert_allclose(state.loads, plane.loads, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(state.stiffness[:2, :2], plane.stiffness, rtol=1e-9)
    np.testing.assert_allclose(
        state.pressures, bearing.pressures(plane.loads.max()), rtol=1e-9
    )


@pytest.mark.parametrize("mounted", [DEEP_GROOVE, ANGULAR], ids=IDS[:2])
def test_thrust_loads_all_balls_alike(mounted):
    """Harris (2007), chapter 7: cos(alpha) = cos(alpha0) / (1 + delta / A)."""
    bearing, thrust = mounted.bearing, 2000.0
    free, A = mounted.free_contact_angle, groove_distance(mounted.bearing)
    inclined = replace(
        bearing,
        pitch_diameter=bearing.pitch_diameter / math.cos(mounted.contact_angle),
        clearance=0.0,
    )

    def excess(alpha):
        delta = A * (math.cos(free) / math.cos(alpha) - 1.0)
        load = inclined.coefficient * delta**1.5
        return bearing.elements * load * math.sin(alpha) - thrust

    alpha = brentq(excess, free + 1e-9, 1.2, xtol=1e-15)
    path = A * math.sin(alpha - free) / math.cos(alpha)
    # what mounting displaces, and the groove of a deep-groove bearing that is centred
    start = 0.0 if mounted.contact_angle else A * math.sin(free)
    moved = np.array([0.0, 0.0, path + start - mounted.axial_preload, 0.0, 0.0])
    state = mounted.state(moved)
    np.testing.assert_allclose(state.force[2], thrust, rtol=1e-9)
    np.testing.assert_allclose(state.force[[0, 1, 3, 4]], 0.0, atol=1e-8)
    load = thrust / (bearing.elements * math.sin(alpha))
    np.testing.assert_allclose(state.loads, load, rtol=1e-9)


def test_deep_groove_contact_begins_at_the_free_contact_angle():
    A = groove_distance(BALL)
    assert math.cos(DEEP_GROOVE.free_contact_angle) == pytest.approx(1.0 - 5e-6 / A)
    begins = A * math.sin(DEEP_GROOVE.free_contact_angle)
    for sense in (-1.0, 1.0):
        before, after = (
            DEEP_GROOVE.state(np.array([0, 0, sense * factor * begins, 0, 0])).loads
            for factor in (1.0 - 1e-6, 1.0 + 1e-6)
        )
        assert before.max() == 0.0 < after.min()


def test_loads_act_through_the_apex_of_the_contact_cone():
    """A force there does not tilt the ring: moment = arm times force, arm r tan(alpha).

    The contact angle changes by the load alone, which is small.
    """
    preloaded = replace(ANGULAR, axial_preload=1e-7)
    force = preloaded.state(np.array([1e-9, 0.0, 0.0, 0.0, 0.0])).force
    arm = force[4] / force[0]
    apex = -0.5 * BALL.pitch_diameter * math.tan(ANGULAR.contact_angle)
    assert arm == pytest.approx(apex, rel=2e-3)


def test_an_angular_contact_bearing_takes_thrust_in_one_sense():
    assert (ANGULAR.thrust_senses, OPPOSITE.thrust_senses) == ((1,), (-1,))
    assert (DEEP_GROOVE.thrust_senses, ROLLERS.thrust_senses) == ((-1, 1), ())
    for away in (20e-6, 1e-3):
        released = np.array([0.0, 0.0, -away, 0.0, 0.0])
        assert not ANGULAR.state(released).loads.any()
        assert OPPOSITE.state(released).force[2] < 0.0


def test_rollers_resist_tilting_and_not_thrust():
    tilted = ROLLERS.state(np.array([20e-6, 0.0, 1e-3, 0.0, 2e-3])).force
    assert tilted[2] == 0.0
    assert tilted[4] > 0.0


def test_laminae_are_the_integral_along_a_roller():
    """Preloaded rollers in contact all along: no lamina begins contact."""
    bearing = replace(ROLLER, clearance=-40e-6)
    tilt, n = 1e-3, 10.0 / 9.0
    state = MountedBearing(bearing=bearing).state(np.array([0.0, 0.0, 0.0, 0.0, tilt]))

    def moment(place, angle):
        approach = 20e-6 + tilt * place * math.cos(angle)
        return (
            bearing.coefficient / bearing.length * approach**n * place * math.cos(angle)
        )

    half = 0.5 * bearing.length
    angles = 2.0 * math.pi * np.arange(13) / 13
    exact = sum(quad(moment, -half, half, args=(angle,))[0] for angle in angles)
    assert state.force[4] == pytest.approx(exact, rel=2.0 / LAMINAE**2)


def test_what_a_bearing_at_rest_cannot_have_is_refused():
    wave = Waviness(order=2, amplitude=1e-6)
    for wrong, keys in (
        ("runout", {"bearing": replace(BALL, waves=(wave,))}),
        ("contact_angle = 0.1; must be 0", {"bearing": ROLLER, "contact_angle": 0.1}),
        ("axial_preload = 1e-06", {"bearing": ROLLER, "axial_preload": 1e-6}),
        ("clearance = 1e-05", {"bearing": DEEP_GROOVE.bearing, "contact_angle": 0.4}),
        ("contact_angle", {"bearing": BALL, "contact_angle": 1.5}),
    ):
        with pytest.raises(ValueError, match=wrong):
            MountedBearing(**keys)
