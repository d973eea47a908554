"""The frame of a carrier, against closed forms, textbook matrices and integration."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import lumped
from lumped import Settings
from lumped.kernels.coupled_steps import settle_motion
from lumped.steady.steady_state import new_convergence
from lumped.train.coordinates import train_coordinates
from lumped.train.coupled import contact_grid, coupled_steps, coupled_system
from lumped.train.mode_families import mode_families, multiplicities, whirl_senses
from lumped.train.modes import natural_modes
from lumped.train.propagator import LinearPart
from lumped.train.rotating_frame import RotatingFrame, rotating_frame, whirl_modes
from tests.lumped.test_coupled_blocks import (
    FREQUENCY,
    GROUND,
    LOAD,
    POSITIONS,
    STIFFNESS,
    random_chain,
)
from tests.lumped.test_planetary_modes import (
    ALPHA,
    BEARING,
    CENTERS,
    MASS,
    MESH,
    REDUCED_INERTIA,
    RING_TORSION,
    closed,
    held,
    modes_of,
    planetary,
)

SPEEDS = [100.0, 500.0, 2000.0]  # rad/s of the carrier
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def single_disk(mass: float, stiffness: float, along_y: float | None = None):
    """Modes of a disk on a bearing, the other gear of its mesh and the carrier fixed.

    The mesh is so soft that it adds 1e-22 of the stiffness.
    """
    sizes = {"teeth": 20, "base_radius": 0.05, "inertia": 1.0}
    disk = lumped.Gear(
        name="disk",
        mass=mass,
        bearing_stiffness=(stiffness, along_y or stiffness),
        **sizes,
    )
    planet = lumped.Gear(name="planet", mass=1.0, **sizes)
    carrier = lumped.Carrier(
        name="carrier", gears=(1,), radius=0.1, angles=(0.0,), inertia=1.0
    )
    train = lumped.Train(
        gears=(disk, planet),
        meshes=(lumped.Mesh(driver=0, driven=1, pressure_angle=0.4),),
        carrier=carrier,
    )
    return natural_modes(train, [1e-22 * stiffness])


@settings(max_examples=30, deadline=None)
@given(st.floats(0.1, 10.0), st.floats(1e5, 1e9), st.floats(0.01, 0.99))
@example(9.507410339227212, 1e7, 0.01)  # the soft mesh has a frequency of 0
def test_one_disk_whirls_at_its_frequency_less_and_plus_the_speed(mass, k, part):
    """Seen from the frame; it is a circle at the natural frequency in space."""
    natural = math.sqrt(k / mass)
    speed = part * natural
    modes = whirl_modes(single_disk(mass, k), speed)
    angular = modes.angular[-2:]
    expected = [natural - speed, natural + speed]
    assert angular == pytest.approx(expected, rel=1e-9)
    assert (modes.growth == 0.0).all()
    assert not modes.is_supercritical


@pytest.mark.parametrize("part", [1.02, 1.5, 3.0])
def test_above_the_critical_speed_the_disk_still_whirls(part):
    """On a bearing that is fixed in space gyroscopic forces stabilise it."""
    modes = whirl_modes(single_disk(2.0, 2e6), part * 1000.0)
    expected = [(part - 1.0) * 1000.0, (part + 1.0) * 1000.0]
    assert modes.angular[-2:] == pytest.approx(expected, rel=1e-6)
    assert modes.growth[-2:] == pytest.approx([0.0, 0.0])
    assert modes.is_supercritical


def textbook(planets: int, consistent: bool, angles=None):
    """Matrices M, G, K and C in the coordinates of Lin and Parker, written from their
    equations of motion (1999, appendix) without any of ours.

    Central members have x, y and u = r theta, planets a radial and a tangential
    translation and u. consistent : C with the planets' tangential motion relative to
    the carrier's rotation, in place of that in the frame
    """
    angles = angles or [2.0 * math.pi * n / planets for n in range(planets)]
    kinds = ["carrier", "ring", "sun", *["planet"] * planets]
    size = 3 * len(kinds)
    M, G, K, C = (np.zeros((size, size)) for _ in range(4))

    def add(matrix, factor, terms):
        row = np.zeros(size)
        for index, value in terms:
            row[index] += value
        matrix += factor * np.outer(row, row)

    for number, kind in enumerate(kinds):
        i, m = 3 * number, MASS[kind]
        M[i : i + 3, i : i + 3] = np.diag([m, m, REDUCED_INERTIA[kind]])
        G[i : i + 2, i : i + 2] = 2.0 * m * TURN
        add(C, m, [(i, 1.0)])
        is_planet = kind == "planet" and consistent
        add(C, m, [(i + 1, 1.0), (2, -1.0 if is_planet else 0.0)])
        if kind != "planet":
            add(K, BEARING, [(i, 1.0)])
            add(K, BEARING, [(i + 1, 1.0)])
    add(K, RING_TORSION, [(5, 1.0)])
    sin, cos = math.sin, math.cos
    for n, psi in enumerate(angles):
        zeta, eta, u = range(9 + 3 * n, 12 + 3 * n)
        sun, ring = psi - ALPHA, psi + ALPHA
        at_sun = [(6, -sin(sun)), (7, cos(sun)), (8, 1.0)]
        at_ring = [(3, -sin(ring)), (4, cos(ring)), (5, 1.0)]
        planet_at_sun = [(zeta, -sin(ALPHA)), (eta, -cos(ALPHA)), (u, 1.0)]
        planet_at_ring = [(zeta, sin(ALPHA)), (eta, -cos(ALPHA)), (u, -1.0)]
        add(K, MESH, at_sun + planet_at_sun)
        add(K, MESH, at_ring + planet_at_ring)
        add(K, BEARING, [(0, cos(psi)), (1, sin(psi)), (zeta, -1.0)])
        add(K, BEARING, [(0, -sin(psi)), (1, cos(psi)), (2, 1.0), (eta, -1.0)])
    return M, G, K, C


def textbook_eigenvalues(planets: int, speed: float, consistent: bool, angles=None):
    """All eigenvalues, by the companion matrix."""
    M, G, K, C = textbook(planets, consistent, angles)
    root = 1.0 / np.sqrt(np.diag(M))
    skew, stiffness = (
        root[:, None] * matrix * root for matrix in (speed * G, K - speed**2 * C)
    )
    n = len(M)
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -skew]])
    return np.linalg.eigvals(companion)


def textbook_angular(planets: int, speed: float, consistent: bool, angles=None):
    """Angular frequencies above 0."""
    imaginary = textbook_eigenvalues(planets, speed, consistent, angles).imag
    return np.sort(imaginary[imaginary > 1.0])


def test_the_printed_centripetal_matrix_lets_a_free_train_diverge():
    """Its steady rotation grows; that with the load of the bearings does not."""
    assert textbook_eigenvalues(3, 500.0, consistent=False).real.max() > 100.0
    assert textbook_eigenvalues(3, 500.0, consistent=True).real.max() < 0.1
    assert (whirl_modes(modes_of(planetary(3)), 500.0).growth == 0.0).all()


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("planets", [3, 4, 5])
def test_frequencies_at_speed_are_those_of_the_textbook(planets, speed):
    computed = whirl_modes(modes_of(planetary(planets)), speed)
    expected = textbook_angular(planets, speed, consistent=True)
    assert computed.angular[1:] == pytest.approx(expected, rel=1e-9)
    assert computed.frequency_Hz[0] == 0.0


@pytest.mark.parametrize("speed", SPEEDS)
def test_unequal_positions_have_the_frequencies_of_the_textbook(speed):
    angles = [0.0, 1.3, 2.9, 4.4]
    computed = whirl_modes(modes_of(planetary(4, angles)), speed)
    expected = textbook_angular(4, speed, True, angles)
    assert computed.angular[1:] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_lin_and_parkers_centripetal_matrix_differs_for_rotational_modes(planets):
    """In the others the carrier does not rotate, and both matrices are the same."""
    train, speed = planetary(planets), 500.0
    modes = whirl_modes(modes_of(train), speed)
    families = np.array(mode_families(train, modes))
    printed = textbook_angular(planets, speed, consistent=False)
    for angular in modes.angular[families != "rotational"]:
        assert np.abs(printed / angular - 1.0).min() < 1e-9
    rotational = modes.angular[families == "rotational"][1:]
    errors = [np.abs(printed / angular - 1.0).min() for angular in rotational]
    assert 1e-5 < max(errors) < 1e-2


@pytest.mark.parametrize("speed", [*SPEEDS, -500.0])
@pytest.mark.parametrize("planets", [3, 4, 5])
def test_families_stay_and_pairs_split_into_both_senses(planets, speed):
    train = planetary(planets)
    at_rest = modes_of(train)
    modes = whirl_modes(at_rest, speed)
    names = mode_families(train, modes)
    assert sorted(names) == sorted(mode_families(train, at_rest))
    senses = whirl_senses(train, modes)
    of_pairs = [s for s, n in zip(senses, names, strict=True) if n == "translational"]
    assert of_pairs.count("forward") == of_pairs.count("backward") == 6
    assert senses.count("none") == len(names) - 12
    same = np.array(multiplicities(modes.frequency_Hz.tolist()))
    planet = np.array(names) == "planet"
    assert (same[planet] == planets - 3).all()
    assert (same[~planet] == 1).all()


@pytest.mark.parametrize("planets", [3, 5])
def test_without_speed_the_frequencies_are_those_at_rest(planets):
    train = planetary(planets)
    at_rest = modes_of(train)
    modes = whirl_modes(at_rest, 0.0)
    assert modes.frequency_Hz == pytest.approx(at_rest.frequency_Hz, rel=1e-12)
    assert mode_families(train, modes) == mode_families(train, at_rest)


def test_the_sense_of_rotation_does_not_change_frequencies():
    modes = modes_of(planetary(3))
    one, two = (whirl_modes(modes, speed).frequency_Hz for speed in (700.0, -700.0))
    assert two == pytest.approx(one, rel=1e-12)


@pytest.mark.parametrize(
    ("speed", "diverges", "supercritical"),
    [(900.0, False, False), (1200.0, True, True), (1600.0, False, True)],
)
def test_bearings_that_turn_and_differ_diverge_between_both_frequencies(
    speed, diverges, supercritical
):
    """Of a disk with 1000 and 1500 rad/s along x and y of the frame."""
    modes = whirl_modes(single_disk(1.0, 1000.0**2, 1500.0**2), speed)
    # (x'' + (k1 - W^2) x - 2 W y'), (y'' + (k2 - W^2) y + 2 W x')
    p, q = 1000.0**2 - speed**2, 1500.0**2 - speed**2
    roots = np.sqrt(np.roots([1.0, p + q + 4.0 * speed**2, p * q]).astype(complex))
    assert modes.growth.max() == pytest.approx(
        np.abs(roots.real).max() if diverges else 0.0, rel=1e-9
    )
    assert modes.angular[-1] == pytest.approx(np.abs(roots.imag).max(), rel=1e-9)
    assert modes.is_supercritical == supercritical
    assert (modes.growth.max() > 1.0) == diverges


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.floats(0.0, 6.28), min_size=1, max_size=5),
    st.sampled_from(["bearings", "fixed"]),
    st.integers(0, 2**32 - 1),
)
def test_forces_of_the_frame(angles, centres, seed):
    """Coriolis forces do no work, those of the centre pull outward, and rotation of
    the whole train is free of both kinds of stiffness."""
    train = closed(planetary(len(angles), list(angles)))
    if centres == "fixed":
        train = held(train)
    space = train_coordinates(train)
    G, C = space.gyroscopic, space.centripetal
    assert (G == -G.T).all()
    assert (C == C.T).all()
    velocity = np.random.default_rng(seed).normal(size=space.mass.size)
    assert abs(velocity @ G @ velocity) < 1e-12 * (
        abs(velocity) @ abs(G) @ abs(velocity) + 1e-300
    )
    assert np.linalg.eigvalsh(C).min() > -1e-12 * MASS["carrier"]
    motion = np.zeros(space.mass.size)
    for (body, kind), index in space.indices.items():
        if kind == "rotation":
            motion[index] = 1.0
        elif body in train.carrier.gears:
            angle = angles[train.carrier.gears.index(body)]
            motion[index] = CENTERS * (
                -math.sin(angle) if kind == "x" else math.cos(angle)
            )
    assert C @ motion == pytest.approx(np.zeros(len(C)), abs=1e-14)


def test_planets_without_bearings_are_masses_of_the_carrier():
    train = planetary(3)
    gears = tuple(
        replace(gear, bearing_stiffness=None)
        if gear.name.startswith("planet")
        else gear
        for gear in train.gears
    )
    space = train_coordinates(replace(train, gears=gears))
    x, y, turn = (space.indices[5, kind] for kind in ("x", "y", "rotation"))
    mass = MASS["carrier"] + 3.0 * MASS["planet"]
    assert space.gyroscopic[x, y] == pytest.approx(-2.0 * mass, rel=1e-15)
    assert space.gyroscopic[y, x] == pytest.approx(2.0 * mass, rel=1e-15)
    assert space.centripetal[x, x] == pytest.approx(mass, rel=1e-15)
    assert not space.centripetal[turn].any()
    assert not space.gyroscopic[turn].any()


def test_planets_without_bearings_are_those_on_stiff_bearings():
    """Frequencies at speed converge in proportion to the compliance."""
    train = planetary(3)

    def on(bearing):
        gears = tuple(
            replace(gear, bearing_stiffness=bearing and (bearing, bearing))
            if gear.name.startswith("planet")
            else gear
            for gear in train.gears
        )
        return whirl_modes(modes_of(replace(train, gears=gears)), 500.0).frequency_Hz

    rigid = on(None)
    errors = [np.abs(on(k)[: rigid.size] - rigid)[1:].max() for k in (1e12, 1e13)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


def lagrangian_acceleration(q, v, speed, carrier_inertia, mass, k, unstretched):
    """Accelerations of a carrier's rotation and one planet in the rotating frame.

    Nonlinear, from T = m |v + W x r|^2 / 2 and the spring between the planet and the
    point at `unstretched` on the turned carrier; no small angles.
    """
    angle, place = q[0], q[1:]
    point = unstretched * np.array([math.cos(angle), math.sin(angle)])
    force = -k * (place - point)
    torque = -(point[0] * force[1] - point[1] * force[0])
    inertial = -2.0 * speed * (TURN @ v[1:]) + speed**2 * place
    return np.concatenate([[torque / carrier_inertia], force / mass + inertial])


@pytest.mark.parametrize("speed", [300.0, 1500.0])
def test_carrier_and_planet_are_the_linearised_nonlinear_motion(speed):
    """About steady rotation, in which the centrifugal load stretches the bearing."""
    mass, k, inertia = 0.7, 1e7, 0.02
    unstretched = CENTERS * (1.0 - mass * speed**2 / k)
    rest = np.array([0.0, CENTERS, 0.0])

    def slope(y):
        values = inertia, mass, k, unstretched
        return np.concatenate(
            [y[3:], lagrangian_acceleration(y[:3], y[3:], speed, *values)]
        )

    state, step = np.concatenate([rest, np.zeros(3)]), 1e-6
    assert np.abs(slope(state)).max() < 1e-6 * k * CENTERS / mass
    size = np.array([1.0, CENTERS, CENTERS, 1.0, CENTERS, CENTERS])
    columns = [
        (slope(state + step * s * e) - slope(state - step * s * e)) / (2.0 * step * s)
        for s, e in zip(size, np.eye(6), strict=True)
    ]
    exact = np.linalg.eigvals(np.array(columns).T).imag
    exact = np.sort(exact[exact > 1.0])
    gear = lumped.Gear(
        name="planet",
        teeth=20,
        base_radius=0.03,
        inertia=1.0,
        mass=mass,
        bearing_stiffness=(k, k),
    )
    sun = lumped.Gear(name="sun", teeth=20, base_radius=0.03, inertia=1.0)
    carrier = lumped.Carrier(
        name="carrier", gears=(1,), radius=CENTERS, angles=(0.0,), inertia=inertia
    )
    mesh = lumped.Mesh(driver=0, driven=1, pressure_angle=0.4)
    train = lumped.Train(gears=(sun, gear), meshes=(mesh,), carrier=carrier)
    modes = whirl_modes(natural_modes(train, [1e-9]), speed)
    assert modes.angular[-2:] == pytest.approx(exact, rel=1e-7)


def test_speed_of_the_carrier_follows_from_the_held_gear():
    """Lin and Parker's teeth with the ring held: w_c / (w_s - w_c) = z_s / z_r."""
    train = held(planetary(3), "ring")
    assert train.carrier_speed == pytest.approx(27.0 / 99.0, rel=1e-15)
    angular = train.carrier_angular_speed(900.0)
    assert angular == pytest.approx(2.0 * math.pi * 900.0 / 99.0, rel=1e-15)
    sun_held = held(planetary(3), "sun")
    assert sun_held.carrier_speed == -1.0
    assert held(planetary(3), "carrier").carrier_speed == 0.0
    assert planetary(3).carrier_speed == 0.0
    free = planetary(3)
    free = replace(free, carrier=replace(free.carrier, speed=0.25))
    assert free.carrier_speed == 0.25


def test_trains_without_a_carrier_have_no_such_forces():
    gears = tuple(
        lumped.Gear(
            name=name,
            teeth=20,
            base_radius=0.03,
            inertia=1e-3,
            mass=1.0,
            bearing_stiffness=(1e8, 1e8),
        )
        for name in "ab"
    )
    mesh = lumped.Mesh(driver=0, driven=1, pressure_angle=0.4)
    train = lumped.Train(gears=gears, meshes=(mesh,))
    space = train_coordinates(train)
    assert not space.gyroscopic.any()
    assert not space.centripetal.any()
    assert train.carrier_angular_speed(1000.0) == 0.0


def linear_system(stiffness, damping):
    """Three coordinates without contacts."""
    curve = 1e-6 * np.ones((1, 1, 2, 1, 4))
    return SimpleNamespace(
        stiffness=stiffness,
        damping=damping,
        load=np.zeros(3),
        whirl=np.zeros(0),
        contacts=SimpleNamespace(knots=np.array([[0.0, 1e-5]]), load_curve=curve),
        rows=np.ones((1, 1, 3)),
    )


def test_a_step_of_the_linear_part_is_that_of_scipy():
    """Three coordinates with G and C at two speeds, and cubic forces."""
    rng = np.random.default_rng(7)
    skew, root = rng.normal(size=(2, 3, 3))
    frame = RotatingFrame(skew - skew.T, root @ root.T, speed=0.4)
    K, D = np.diag([1e6, 4e6, 9e6]), np.diag([50.0, 80.0, 120.0])
    system = linear_system(K, D)
    push, h = np.array([1.0, -2.0, 0.5]), 1e-4
    start = np.array([1e-6, -2e-6, 1e-6, 2e-3, 1e-3, -3e-3])
    for frequency in (500.0, 1500.0):
        W = 0.4 * frequency

        def slope(time, y, W=W):
            force = push * (1.0 + 1e3 * time - 1e7 * time**2)
            damped = (D + W * frame.gyroscopic) @ y[3:]
            return [*y[3:], *(force - damped - (K - W**2 * frame.centripetal) @ y[:3])]

        options = {"rtol": 1e-12, "atol": 1e-18}
        exact = solve_ivp(slope, (0.0, h), start, **options).y[:, -1]
        step = LinearPart(system, frame).step(frequency, h)
        times = h * np.array([1.0, 0.0, -1.0, -2.0])
        end, *before = 1.0 + 1e3 * times - 1e7 * times**2
        inputs = np.concatenate([start, *(push * force for force in before)])
        state = inputs @ step.transition + (push * end) @ step.force_response
        np.testing.assert_allclose(state, exact, rtol=1e-8, atol=1e-14)


@pytest.mark.parametrize("speed", SPEEDS)
def test_modes_without_the_free_rotation_keep_their_frequencies(speed):
    """Its speed follows from the moment of momentum, as in an integrated motion."""
    modes = modes_of(planetary(3))
    moving = np.flatnonzero(modes.frequency_Hz > 0.0)
    frame = rotating_frame(modes, moving, 1.0)
    stiffness = np.diag(modes.angular[moving] ** 2) + frame.stiffness(speed)
    n = moving.size
    companion = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-stiffness, -frame.damping(speed)]]
    )
    imaginary = np.linalg.eigvals(companion).imag
    expected = whirl_modes(modes, speed).angular[1:]
    assert np.sort(imaginary[imaginary > 0.0]) == pytest.approx(expected, rel=1e-9)


def test_the_linear_part_keeps_its_energy_without_damping():
    """Coriolis forces do no work; those of the centre have a potential."""
    rng = np.random.default_rng(3)
    skew, root = rng.normal(size=(2, 3, 3))
    frame = RotatingFrame(skew - skew.T, root @ root.T, speed=0.3)
    K, frequency = np.diag([1e6, 4e6, 9e6]), 1000.0
    step = LinearPart(linear_system(K, 0.0 * K), frame).step(frequency, 5e-5)
    stiffness = K + frame.stiffness(frequency)
    y = rng.normal(size=6) * np.repeat([1e-6, 1e-3], 3)
    energies = []
    for _ in range(200):
        energies.append(0.5 * (y[3:] @ y[3:] + y[:3] @ stiffness @ y[:3]))
        y = y @ step.transition[:6]
    assert energies == pytest.approx([energies[0]] * 200, rel=1e-9)
    assert np.abs(frame.damping(frequency)).max() > 100.0


def contact_forces(system, q, position):
    """Loads (c,) by Newton's method, at a position of the mesh cycle from 0 to 1."""
    place = position * POSITIONS
    cell = min(int(place), POSITIONS - 1)
    weights = 1.0 - (place - cell), place - cell

    def at(table):
        return weights[0] * table[cell] + weights[1] * table[cell + 1]

    contacts = system.contacts
    B, Q = at(system.rows.swapaxes(0, 1)), at(contacts.normal_compliance)
    gap = at(contacts.gap.T)
    x = np.zeros(len(gap))
    for _ in range(50):
        # the same curve at all positions, F = k x + c x^2
        F = np.where(x > 0.0, STIFFNESS * x + 1e12 * x**2, 0.0)
        slope = np.where(x > 0.0, STIFFNESS + 2e12 * x, 0.0)
        residual = x + Q @ F - B @ q + gap
        x = x - np.linalg.solve(np.eye(len(x)) + Q * slope, residual)
        if np.abs(residual).max() < 1e-18:
            break
    return B.T @ np.where(x > 0.0, STIFFNESS * x + 1e12 * x**2, 0.0)


def test_the_coupled_model_in_the_frame_is_that_of_scipy():
    """A chain of three gears with contacts over a mesh cycle; the error of its steps
    decreases with their number."""
    coupled, train = random_chain(3, 2, 0, 0, 5)
    system = coupled_system(coupled, train)
    G = np.array([[0.0, -2.0, 1.0], [2.0, 0.0, 0.5], [-1.0, -0.5, 0.0]])
    frame = RotatingFrame(G, np.diag([1.0, 2.0, 0.5]), speed=1.0)
    stiffness = system.stiffness + frame.stiffness(FREQUENCY)
    damping = system.damping + frame.damping(FREQUENCY)
    start = np.stack([np.linspace(2.0, 1.0, 3) * LOAD / GROUND, np.zeros(3)])

    def slope(time, y):
        pushed = contact_forces(system, y[:3], time * FREQUENCY)
        force = system.load - stiffness @ y[:3] - damping @ y[3:]
        return np.concatenate([y[3:], force - pushed])

    y = start.ravel()
    for cell in range(POSITIONS):  # the gaps have corners between
        span = cell / POSITIONS / FREQUENCY, (cell + 1) / POSITIONS / FREQUENCY
        options = {"rtol": 1e-10, "atol": 1e-15, "method": "DOP853"}
        y = solve_ivp(slope, span, y, **options).y[:, -1]
    errors = []
    for steps in (96, 192, 384):
        grid = contact_grid(system, steps, np.ones(system.rate.size, np.int64))
        linear = LinearPart(system, frame)
        state = start.copy()
        convergence = new_convergence(system.shapes, np.full(3, 1e4), Settings())
        arguments = coupled_steps(system, linear, grid, FREQUENCY, 1), 1e9, state
        settle_motion(system, *arguments, convergence, 1)
        errors.append(np.abs(state.ravel() - y).max() / np.abs(y).max())
    without = coupled_steps(system, LinearPart(system), grid, FREQUENCY, 1)
    state = start.copy()
    settle_motion(system, without, 1e9, state, convergence, 1)
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx([2.0, 2.0], abs=0.2)
    assert errors[2] < 1e-3
    assert np.abs(state.ravel() - y).max() / np.abs(y).max() > 100.0 * errors[2]
