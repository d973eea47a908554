"""The exact piecewise-linear motion against closed forms, energy and itself."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from oracles import piecewise
from oracles.piecewise import Disk, Piece, PiecewiseTrain, Toothing

K, R, J = 3.0e8, 0.05, 2.5e-3
PAIR_MASS = J / R**2 / 2.0  # kg, of two equal disks along the line of action
FORCE = 2000.0  # N
ALWAYS = ((Piece(0.0, 1.0, K),),)


def make_pair(pairs=ALWAYS, force=FORCE, damping=0.0, backlash=math.inf):
    disk = Disk(radius=R, inertia=J, torque=force * R)
    mesh = Toothing(
        driver=0, driven=1, pairs=pairs, mean_stiffness=K, backlash=backlash
    )
    return PiecewiseTrain((disk, disk), (mesh,), damping)


def make_idler(relief=0.0, backlash=1e-4):
    radii, inertias = (0.04535, 0.06564, 0.11218), (0.002621, 0.01091, 0.1193)
    torques = (100.0, 0.0, -100.0 * radii[2] / radii[0])
    couplings = (3389.6, 0.0, 11297.9)
    figures = ((2.9831e8, 0.35, 1.504, 0.0), (3.2108e8, 0.4, 1.51, 0.2))
    return PiecewiseTrain(
        tuple(
            Disk(radius=r, inertia=j, torque=t, coupling=k)
            for r, j, t, k in zip(radii, inertias, torques, couplings, strict=True)
        ),
        tuple(
            Toothing(
                driver=n,
                driven=n + 1,
                sense=(1, -1)[n],
                pairs=piecewise.rectangular_pairs(mean, eps, c, relief),
                mean_stiffness=mean,
                backlash=backlash,
                phase=phase,
            )
            for n, (mean, eps, c, phase) in enumerate(figures)
        ),
        0.04,
    )


def state_of_pair(deflection, rate):
    """Equal shares of both disks."""
    return np.array([deflection, deflection, rate, rate]) / (2.0 * R)


def energies(motion):
    """Energy at both ends of every span (spans, 2) [J]."""
    out = []
    for span in motion.spans:
        after = piecewise.expm(span.length * span.equation.generator) @ span.state
        out.append([0.5 * z @ span.equation.energy @ z for z in (span.state, after)])
    return np.array(out)


def work(motion):
    """What damping and moving gaps have added [J]."""
    time, weight = motion.quadrature(0.0, math.inf)
    states, equations = motion.states(time)
    power = [
        z @ equation.power @ z for z, equation in zip(states, equations, strict=True)
    ]
    return float(weight @ np.array(power))


def test_free_vibration_in_contact_is_a_cosine():
    omega, s0 = math.sqrt(K / PAIR_MASS), FORCE / K
    motion = piecewise.march(
        make_pair(), 1000.0, state_of_pair(1.5 * s0, 0.0), 3.0, checks=8
    )
    time = np.linspace(0.0, 3e-3, 200)
    expected = s0 + 0.5 * s0 * np.cos(omega * time)
    np.testing.assert_allclose(motion.deflection(time)[:, 0], expected, rtol=1e-11)
    np.testing.assert_allclose(motion.force(time)[:, 0], K * expected, rtol=1e-11)
    assert motion.changes == ()


def test_bouncing_follows_from_fall_and_half_wave():
    """Apart the load accelerates evenly; in contact it is a sine about F / k."""
    height = 20e-6
    omega = math.sqrt(K / PAIR_MASS)
    speed = math.sqrt(2.0 * FORCE * height / PAIR_MASS)
    fall = speed * PAIR_MASS / FORCE
    contact = (math.pi + 2.0 * math.atan(FORCE / K * omega / speed)) / omega
    motion = piecewise.march(make_pair(), 1000.0, state_of_pair(-height, 0.0), 2.0)
    expected = fall + np.cumsum([0.0, *[contact, 2.0 * fall] * 5])
    np.testing.assert_allclose(motion.changes, expected, rtol=1e-11)


def test_backlash_is_crossed_at_even_speed_without_load():
    backlash, speed = 30e-6, 0.5
    omega = math.sqrt(K / PAIR_MASS)
    train = make_pair(force=0.0, backlash=backlash)
    motion = piecewise.march(train, 1000.0, state_of_pair(1e-12, -speed), 1.0)
    flight, contact = backlash / speed, math.pi / omega
    durations = np.diff(motion.changes)
    expected = np.tile([flight, contact], durations.size)[: durations.size]
    np.testing.assert_allclose(durations, expected, rtol=1e-9)
    assert durations.size >= 4


def test_energy_is_kept_through_free_play():
    train = make_pair(force=300.0, backlash=10e-6)
    motion = piecewise.march(train, 1000.0, state_of_pair(-20e-6, 0.2), 3.0)
    energy = energies(motion)
    assert len(motion.changes) > 5
    moving = 0.5 * PAIR_MASS * 0.2**2
    np.testing.assert_allclose(energy, energy[0, 0], atol=1e-11 * moving)


@pytest.mark.parametrize("relief", [0.0, 10e-6])
def test_energy_balance_of_the_idler(relief):
    """Change = work in the spans + jumps of stiffness; both meshes lose contact."""
    train = make_idler(relief)
    start = np.array([2e-4, 0.0, -4e-4, 0.0, -1.0, 1.0])
    motion = piecewise.march(train, 1300.0, start, 3.0)
    energy = energies(motion)
    jumps = sum(b[0] - a[1] for a, b in pairwise(energy))
    change = energy[-1, 1] - energy[0, 0]
    scale = np.abs(energy).max()
    assert len(motion.changes) > 10
    assert abs(jumps) > 1e-3 * scale
    assert change == pytest.approx(jumps + work(motion), abs=1e-9 * scale)


def test_energy_is_continuous_where_contacts_change():
    motion = piecewise.march(
        make_idler(10e-6), 1300.0, np.array([2e-4, 0.0, -4e-4, 0, -1, 1]), 2.0
    )
    energy = energies(motion)
    starts = np.array([span.start for span in motion.spans])
    for change in motion.changes:
        i = int(np.argmin(np.abs(starts - change)))
        if starts[i] != change or i == 0:
            continue
        assert energy[i, 0] == pytest.approx(energy[i - 1, 1], rel=1e-9)


def test_twice_the_checks_change_nothing():
    start = np.array([2e-4, 0.0, -4e-4, 0.0, -1.0, 1.0])
    ends = [
        piecewise.march(make_idler(10e-6), 1300.0, start, 4.0, checks)
        for checks in (48, 96, 192)
    ]
    for one, two in pairwise(ends):
        assert len(one.changes) == len(two.changes)
        np.testing.assert_allclose(one.changes, two.changes, rtol=1e-9)
        np.testing.assert_allclose(one.end_state, two.end_state, rtol=1e-7, atol=1e-12)


def test_marching_on_is_marching_through():
    start = np.array([2e-4, 0.0, -4e-4, 0.0, -1.0, 1.0])
    train = make_idler()
    through = piecewise.march(train, 1300.0, start, 2.0).end_state
    half = piecewise.march(train, 1300.0, start, 1.0).end_state
    on = piecewise.march(train, 1300.0, half, 1.0).end_state
    np.testing.assert_allclose(on, through, rtol=1e-8)


def test_static_deflection_is_kept():
    """Eq. (2.8) with one stiffness: F / k."""
    rest = state_of_pair(FORCE / K, 0.0)
    motion = piecewise.march(make_pair(), 500.0, rest, 2.0)
    time = np.linspace(0.0, 4e-3, 50)
    np.testing.assert_allclose(motion.deflection(time), FORCE / K, rtol=1e-9)
    assert motion.rms(0.0, 4e-3)[0] < 1e-12 * FORCE / K * 1e3


def test_rms_of_a_cosine():
    omega, s0 = math.sqrt(K / PAIR_MASS), FORCE / K
    frequency = omega / (2.0 * math.pi)
    motion = piecewise.march(
        make_pair(), frequency, state_of_pair(1.5 * s0, 0.0), 2.0, checks=32
    )
    rms = motion.rms(0.0, 2.0 / frequency)
    assert rms[0] == pytest.approx(0.5 * s0 / math.sqrt(2.0), rel=1e-9)


@pytest.mark.parametrize("gaps", [(0.0,) * 2, (0.0,) * 5])
@pytest.mark.parametrize("contact_ratio", [1.2, 1.504, 1.9])
def test_rectangle_keeps_mean_and_peak_to_peak(contact_ratio, gaps):
    pairs = piecewise.rectangular_pairs(3e8, 0.35, contact_ratio, gaps=gaps)
    (toothing,) = make_pair(pairs).toothings
    totals = []
    for x in (np.arange(5000) + 0.5) / 1000:
        pieces = [toothing.piece(pair, x) for pair in range(len(gaps))]
        totals.append(sum(piece[0].stiffness for piece in pieces if piece))
    assert np.mean(totals) == pytest.approx(3e8, rel=1e-12)
    assert np.ptp(totals) == pytest.approx(0.35 * 3e8, rel=1e-12)


def test_equal_teeth_without_variation_rest():
    pairs = piecewise.rectangular_pairs(K, 0.0, 1.6, gaps=[2e-6] * 3)
    start = state_of_pair(2e-6 + FORCE / K, 0.0)
    motion = piecewise.march(make_pair(pairs), 900.0, start, 6.0)
    time = np.linspace(0.0, 6.0 / 900.0, 50)
    np.testing.assert_allclose(motion.deflection(time), start.sum() * R, rtol=1e-9)
    np.testing.assert_allclose(motion.force(time), FORCE, rtol=1e-9)
    assert motion.contact_loss(0.0, 6.0 / 900.0) == 0.0


def test_one_mesh_cycle_a_turn_is_a_linear_oscillator():
    """Single teeth of constant stiffness under an error that rises and falls."""
    pairs = piecewise.rectangular_pairs(K, 0.0, 1.0, gaps=(0.0, 1e-7))
    frequency, zeta = 1000.0, 0.04
    start = state_of_pair(FORCE / K, 0.0)
    motion = piecewise.march(make_pair(pairs, damping=zeta), frequency, start, 42.0)
    time = (40.0 + np.arange(200) / 100.0) / frequency
    # a square wave of half the mesh frequency drives k (s - g) + c s' + m s''
    expected = np.full(time.shape, FORCE / K + 0.5e-7)
    omega = math.sqrt(K / PAIR_MASS)
    for harmonic in range(1, 801, 2):
        angular = harmonic * math.pi * frequency
        drive = -2e-7 / (math.pi * harmonic) * (-1) ** ((harmonic - 1) // 2)
        ratio = angular / omega
        stiff = 1.0 - ratio**2 + 2j * zeta * ratio
        expected += (drive / stiff * np.exp(1j * angular * time)).real
    np.testing.assert_allclose(motion.deflection(time)[:, 0], expected, atol=2e-11)


def test_damping_decays_at_the_modal_ratio():
    zeta, s0 = 0.05, FORCE / K
    omega = math.sqrt(K / PAIR_MASS)
    damped = omega * math.sqrt(1.0 - zeta**2)
    frequency = damped / (2.0 * math.pi)
    train = replace(make_pair(), damping_ratio=zeta)
    motion = piecewise.march(train, frequency, state_of_pair(1.5 * s0, 0.0), 2.0)
    peaks = motion.deflection(np.arange(3) / frequency)[:, 0] - s0
    decay = math.exp(-zeta * omega / frequency)
    np.testing.assert_allclose(peaks[1:] / peaks[:-1], decay, rtol=1e-8)
