"""Gears on rolling bearings: against scipy, springs, energy and ball-pass lines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped import (
    Gear,
    LumpedSystem,
    Mesh,
    Settings,
    StiffnessParameters,
    Train,
    TrainError,
    analytic_excitation,
    natural_modes,
    respond,
    respond_with_history,
)
from lumped.bearings.kinematics import ball_pass_over_shaft, cage_over_shaft
from lumped.bearings.rolling import BallBearing, RollerBearing, Waviness
from lumped.bearings.statics import RingSupport, load_distribution
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import FixedStepper
from lumped.train.coordinates import line_of_action
from lumped.train.rolling_supports import (
    bearing_loads,
    linearise_bearings,
    without_rolling_bearings,
)

TEETH = (30, 50)
MEAN = 3e8  # N/m
BALL = BallBearing(
    balls=9, element_diameter=7.94e-3, pitch_diameter=38.5e-3, clearance=5e-6
)
ROLLER = RollerBearing(
    rollers=13, element_diameter=7.5e-3, pitch_diameter=39e-3, length=7.5e-3
)
ROUGH = replace(
    BALL,
    runout=2e-6,
    waves=(
        Waviness(order=10, amplitude=0.3e-6, phase=0.4),
        Waviness(order=8, amplitude=0.2e-6, phase=1.1, inner=True),
    ),
)


def make_pair(one, other, torque: float = 50.0, damping: float = 0.05) -> Train:
    """A pair of gears on two bearings."""
    torques = torque, torque * TEETH[1] / TEETH[0]
    gears = tuple(
        Gear(
            name=name,
            teeth=teeth,
            base_radius=teeth * 1e-3,
            inertia=1e-3,
            mass=1.0,
            torque=on_gear,
            rolling_bearing=bearing,
        )
        for name, teeth, on_gear, bearing in zip(
            ("pinion", "wheel"), TEETH, torques, (one, other), strict=True
        )
    )
    mesh = Mesh(driver=0, driven=1, pressure_angle=math.radians(20.0), center_line=0.3)
    return Train(gears=gears, meshes=(mesh,), damping_ratio=damping)


def make_system(train: Train, variation: float = 0.3) -> LumpedSystem:
    figures = StiffnessParameters(mean=MEAN, variation=variation, contact_ratio=1.5)
    excitation = analytic_excitation(figures, 1, harmonics=3)
    return LumpedSystem(linearise_bearings(train), (excitation,))


def test_the_load_on_a_bearing_is_the_mesh_force():
    train = make_pair(BALL, ROLLER)
    push = 50.0 / (TEETH[0] * 1e-3) * np.array(line_of_action(train, train.meshes[0]))
    np.testing.assert_allclose(bearing_loads(train), [-push, push], rtol=1e-12)


def test_springs_of_a_bearing_lie_along_its_load():
    """The stiffness matrix is that of the mean over the cage, in any direction."""
    train = linearise_bearings(make_pair(BALL, ROLLER))
    load = bearing_loads(train)[0]
    spacing = 2.0 * math.pi / 9
    states = [load_distribution(BALL, tuple(load), spacing * k / 64) for k in range(64)]
    expected = np.mean([state.stiffness for state in states], axis=0)
    modes = natural_modes(train, [1e-3])  # N/m, no mesh to speak of
    K, indices = modes.stiffness_matrix, modes.coordinates.indices
    rows = [indices[0, "x"], indices[0, "y"]]
    np.testing.assert_allclose(
        K[np.ix_(rows, rows)], expected, atol=1e-3 * expected.max()
    )


def test_scipy_finds_the_same_motion():
    """The same equations in physical coordinates, with cage, runout and waviness."""
    system, frequency, periods = make_system(make_pair(ROUGH, ROLLER)), 900.0, 12
    stepper = FixedStepper(system)
    speed = Speed(frequency, Settings(steps=400))
    start = system.static_state
    _, history = stepper.record(start, speed, periods)
    step = (history.time.size - 1) // periods

    train, modes = system.train, system.modes
    space = modes.coordinates
    push = np.array(line_of_action(train, train.meshes[0]))
    radii = [gear.base_radius for gear in train.gears]
    # rotation 1, x1, y1, rotation 2, x2, y2, in the order of the coordinates
    row = np.array([radii[0], *push, radii[1], *-push])
    mass = np.array([1e-3, 1.0, 1.0, 1e-3, 1.0, 1.0])
    np.testing.assert_allclose(space.mass, mass)
    shapes = modes.shapes
    damping = (
        np.diag(mass)
        @ shapes
        @ np.diag(2.0 * 0.05 * modes.angular)
        @ shapes.T
        @ np.diag(mass)
    )
    load = np.array([train.gears[0].torque, 0, 0, train.gears[1].torque, 0, 0])
    pairs = system.excitations[0].pairs
    bearings = ROUGH, ROLLER
    speeds = 2.0 * math.pi * frequency / TEETH[0], -2.0 * math.pi * frequency / TEETH[1]

    def slope(time, state):
        x, v = state[:6], state[6:]
        place = np.array([frequency * time % 1.0])
        deflection = row @ x
        force = sum(
            float(pair.stiffness(place)[0])
            * max(deflection - float(pair.gap(place)[0]), 0.0)
            for pair in pairs
        )
        total = load - damping @ v - row * force
        for number, bearing in enumerate(bearings):
            cage = cage_over_shaft(bearing) * speeds[number] * time
            where = slice(3 * number + 1, 3 * number + 3)
            total[where] -= RingSupport(bearing, cage).force(x[where])
        return np.concatenate([v, total / mass])

    x0 = shapes[:, system.moving] @ start[0, : system.moving.size]
    solution = solve_ivp(
        slope,
        (0.0, periods / frequency),
        np.concatenate([x0, np.zeros(6)]),
        method="DOP853",
        rtol=1e-9,
        atol=1e-14,
        t_eval=np.minimum(history.time[::step], periods / frequency),
    )
    deflection = row @ solution.y[:6]
    size = np.ptp(history.deflection)
    np.testing.assert_allclose(
        history.deflection[::step, 0], deflection, atol=2e-6 * size
    )
    rings = history.bearings[::step, :, :2].reshape(len(deflection), 4)
    by_scipy = solution.y[[1, 2, 4, 5]].T
    np.testing.assert_allclose(rings, by_scipy, atol=5e-6 * np.ptp(by_scipy))


def test_rest_is_an_equilibrium():
    """Without mesh variation and at a tiny speed nothing moves."""
    system = make_system(make_pair(BALL, ROLLER), variation=0.0)
    q = system.static_state[0]
    np.testing.assert_allclose(system.static_state[1], 0.0)
    deflection = system.rk4_arrays.shapes @ q
    assert deflection * MEAN == pytest.approx(50.0 / 30e-3, rel=1e-9)
    rolling = system.rolling
    for rows, bearing, load in zip(
        rolling.rows, rolling.bearings, bearing_loads(system.train), strict=True
    ):
        ring = rows @ q[: system.moving.size]
        force = RingSupport(bearing, 0.0).force(ring)
        np.testing.assert_allclose(force, load, rtol=1e-8)


def test_tight_bearings_are_springs():
    """Preload far beyond the vibration makes the contacts linear: the linear train."""
    stiff = {"clearance": -4e-3, "contact_stiffness": 3.3e8}
    bearings = replace(BALL, **stiff), replace(BALL, **stiff)
    system = make_system(make_pair(*bearings, torque=5.0))
    linear = replace(system, train=without_rolling_bearings(system.train))
    for frequency in (700.0, 1500.0):
        one, two = (respond(s, frequency) for s in (system, linear))
        assert one.multiple == two.multiple == 1
        np.testing.assert_allclose(one.dte_rms, two.dte_rms, rtol=1e-6)
        np.testing.assert_allclose(one.force_peak, two.force_peak, rtol=1e-6)


def test_rigid_bearings_hold_the_centres():
    """Without clearance, stiffer bearings approach gears that only rotate."""
    errors = []
    for factor in (1e2, 1e4):
        bearing = replace(
            BALL, clearance=0.0, contact_stiffness=BALL.coefficient * factor
        )
        train = make_pair(bearing, bearing)
        system = make_system(train)
        held = replace(
            train,
            gears=tuple(replace(gear, rolling_bearing=None) for gear in train.gears),
        )
        fixed = LumpedSystem(held, system.excitations)
        settings = Settings(steps=64)
        one, two = (respond(s, 1500.0, settings) for s in (system, fixed))
        errors.append(abs(one.dte_rms / two.dte_rms - 1.0)[0])
    # softness goes with the coefficient to the power -2/3
    assert errors[1] < errors[0] * 1e2 ** (-1.0 / 2.0)
    assert errors[1] < 2e-2


def test_energy_comes_from_load_and_cage():
    """Without damping, energy changes by the loads and by the rotation of the cage."""
    train = make_pair(ROUGH, BALL, damping=0.0)
    system = make_system(train, variation=0.0)
    stepper, frequency, periods = FixedStepper(system), 1100.0, 20
    start = np.array(system.static_state)
    start[1, :5] = 1e-3
    speed = Speed(frequency, Settings(steps=400))
    end, history = stepper.record(start, speed, periods)
    arrays, rolling, n = system.arrays, system.rolling, system.moving.size

    def springs(state):
        q, v = state[:, :n]
        energy = 0.5 * v @ v + 0.5 * arrays.rigidity @ q**2 - arrays.load @ q
        for rows, reference in zip(rolling.rows, rolling.reference, strict=True):
            energy -= 0.5 * (rows @ q) @ reference @ (rows @ q)
        return energy

    def contacts(number, ring, shaft):
        bearing = rolling.bearings[number]
        return RingSupport(bearing, cage_over_shaft(bearing) * shaft).energy(ring)

    work, before, after = 0.0, springs(start), springs(end)
    for number, rate in enumerate(rolling.rates * frequency):
        rings, shafts = history.bearings[:, number, :2], rate * history.time
        step = 1e-5
        slopes = [
            contacts(number, ring, shaft + step) - contacts(number, ring, shaft - step)
            for ring, shaft in zip(rings, shafts, strict=True)
        ]
        work += np.trapezoid(np.array(slopes) / (2.0 * step), shafts)
        before += contacts(number, rings[0], shafts[0])
        after += contacts(number, rings[-1], shafts[-1])
    assert abs(work) > 1e-6 * abs(before)
    assert after - before == pytest.approx(work, abs=2e-4 * abs(work))


def test_lines_of_the_ball_pass_are_at_the_right_frequency():
    """Of the force on a bearing of a pair without mesh variation, to 1e-6."""
    loose = replace(BALL, clearance=20e-6)
    train = make_pair(loose, loose)
    system = make_system(train, variation=0.0)
    frequency = 1000.0
    response, _ = respond_with_history(system, frequency)
    stepper = FixedStepper(system)
    speed = Speed(frequency, Settings(steps=32))
    _, history = stepper.record(response.state, speed, 4000)
    for number, teeth in enumerate(TEETH):
        force = np.hypot(*history.bearings[:-1, number, 2:].T)
        # own bearing's line only, by comparison of phases of both halves
        expected = ball_pass_over_shaft(loose) * frequency / teeth
        assert line_near(history.time[:-1], force, expected) == pytest.approx(
            expected, rel=1e-6
        )


def line_near(time, signal, guess):
    """Frequency of a line by the phase between two halves under a smooth window."""
    half = time.size // 2
    window = np.blackman(half)
    phases = []
    for part in (slice(0, half), slice(half, 2 * half)):
        values = signal[part] - signal.mean()
        turning = np.exp(-2j * math.pi * guess * time[part])
        line = (window * values * turning).sum()
        assert abs(line) > 1e-6 * window.sum() * np.abs(signal).mean()
        phases.append(np.angle(line))
    shift = np.angle(np.exp(1j * (phases[1] - phases[0])))
    return guess + shift / (2.0 * math.pi * (time[half] - time[0]))


def test_cages_go_on_from_window_to_window():
    """Two records one after another are one record of twice the length."""
    system = make_system(make_pair(ROUGH, BALL))
    stepper, speed = FixedStepper(system), Speed(800.0, Settings(steps=64))
    state = system.static_state
    middle, first = stepper.record(state, speed, 7)
    _, second = stepper.record(middle, speed, 7)
    _, both = stepper.record(state, speed, 14)
    rows = len(first.bearings)
    np.testing.assert_array_equal(both.bearings[:rows], first.bearings)
    np.testing.assert_allclose(both.bearings[rows - 1 :], second.bearings, rtol=1e-12)


def test_steps_converge_with_fourth_order():
    system = make_system(make_pair(BALL, ROLLER))
    stepper, ends = FixedStepper(system), []
    for steps in (64, 128, 256, 1024):
        speed = Speed(1300.0, Settings(steps=steps))
        ends.append(stepper.record(system.static_state, speed, 4)[0][0])
    errors = [np.abs(end - ends[-1])[: system.moving.size].max() for end in ends[:-1]]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # elements come into contact within steps, with a kink of the second derivative
    assert (orders > 2.3).all()


@pytest.mark.parametrize("bearing", [BALL, ROLLER], ids=["ball", "roller"])
def test_a_motion_does_not_repeat_unless_contacts_are_linear(bearing):
    loose = replace(bearing, clearance=30e-6)
    response = respond(make_system(make_pair(loose, loose)), 1500.0)
    assert response.multiple == 0
    assert 0.0 < response.dte_rms_stderr[0] < 0.1 * response.dte_rms[0]


def test_what_rolling_bearings_do_not_go_with_is_refused():
    train = make_pair(BALL, BALL)
    system = make_system(train)
    with pytest.raises(TrainError, match="rolling_bearing without bearing_stiffness"):
        LumpedSystem(train, system.excitations)
    with pytest.raises(
        ValueError, match=r"method = .*; must be rk4 for rolling bearings"
    ):
        respond(system, 1000.0, Settings(method="dopri5"))
    with pytest.raises(TrainError, match="has no load"):
        linearise_bearings(make_pair(BALL, BALL, torque=0.0))
    with pytest.raises(TrainError, match="no common period"):
        FixedStepper(system).monodromy(
            system.static_state, Speed(1000.0, Settings()), 1
        )
