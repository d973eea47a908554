"""Vibration with tooth friction, beside equations written down a second time."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from friction_pairs import ACROSS, COUPLED, RADII, pair_system, update
from scipy.integrate import solve_ivp

from lumped.branches.balance import HarmonicBalance
from lumped.closed_forms import parametric_system
from lumped.stability.multipliers import largest_multiplier
from lumped.stability.periodic_system import periodic_system
from lumped.steady.integration_settings import Settings
from lumped.steady.losses import efficiency
from lumped.steady.motion import time_history
from lumped.steady.respond import respond
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.bodies import TrainError
from lumped.train.excitation_tables import bending_along_path, excitation_from_table
from lumped.train.friction import ToothFriction, base_pitch, with_bending
from lumped.train.system import LumpedSystem
from lumped.train.table import MeshTable
from lumped.train.waves import constant_wave, linear_wave

MU, BENDING, EPS, ALPHA, GAMMA, C = 0.1, 0.5, 0.3, 0.6, 0.28, 1.5
RATIO = 0.02


class Oracle:
    """Eq. 4.44 in u, x1, y1, x2, y2 with the sign of eq. 4.40, x across the line."""

    def __init__(self):
        turn = (2.0 * math.pi) ** 2
        a, b, c = update([f**2 for f in COUPLED], [0.0, *(f**2 for f in ACROSS)])
        self.k = a * turn
        masses = self.k / (b * turn), self.k / (c * turn)
        self.mass = np.array([1.0, masses[0], masses[0], masses[1], masses[1]])
        bearings = [m * turn * f**2 for m, f in zip(masses, ACROSS, strict=True)]
        rest = np.diag([0.0, *np.repeat(bearings, 2)])
        self.row = np.array([1.0, 0.0, 1.0, 0.0, -1.0])
        self.rest = rest
        whole = rest + self.k * np.outer(self.row, self.row)
        root = np.sqrt(self.mass)
        squares, shapes = np.linalg.eigh(whole / np.outer(root, root))
        root_matrix = shapes * np.sqrt(np.abs(squares)) @ shapes.T
        self.damping = 2.0 * RATIO * root_matrix * np.outer(root, root)
        self.eta = masses[1] / (masses[0] + masses[1])

    def stiffness(self, place):
        """Of the pair in recess and the pair in approach, eq. 4.42 and 4.43."""
        low, high = 1.0 + EPS * (1.0 - C), 1.0 + EPS * (2.0 - C)
        end = C - 1.0 + GAMMA
        if place < GAMMA:
            pairs = low, 0.0
        elif place < end:
            part = (place - GAMMA) / (end - GAMMA)
            share = ALPHA + (1.0 - 2.0 * ALPHA) * part
            pairs = high * share, high * (1.0 - share)
        else:
            pairs = 0.0, low
        change = 1.0 - BENDING * MU, 1.0 + BENDING * MU
        return [self.k * p * f for p, f in zip(pairs, change, strict=True)]

    def rate(self, speed):
        pitch = 2.0 * math.pi * RADII[0] / 38
        slope = math.tan(math.radians(20.0))

        def derivative(t, state):
            q, v = state[:5], state[5:]
            place = (speed * t) % 1.0
            force = np.array([1.0, 0.0, 0.0, 0.0, 0.0]) - self.rest @ q
            force -= self.damping @ v
            deflection = self.row @ q
            if deflection > 0.0:
                ways = place * pitch, (place - 1.0) * pitch
                stiff = self.stiffness(place)
                for side, way, k in zip((-1, 1), ways, stiff, strict=True):
                    arms = RADII[0] * slope + way, RADII[1] * slope - way
                    turned = self.eta * arms[0] / RADII[0]
                    turned += (1.0 - self.eta) * arms[1] / RADII[1]
                    across = np.array([turned, -1.0, 0.0, 1.0, 0.0])
                    load = k * deflection
                    force -= load * (self.row - side * MU * across)
            return np.concatenate([v, force / self.mass])

        return derivative

    def rms(self, speed, periods=240):
        """Of the deflection over the last period."""
        state = np.zeros(10)
        derivative = self.rate(speed)
        marks = np.cumsum([GAMMA, C - 1.0, 2.0 - C - GAMMA])
        for period in range(periods):
            ends = (period + np.concatenate([[0.0], marks])) / speed
            path = []
            for start, end in pairwise(ends):
                inside = start + 1e-13, end - 1e-13
                last = period == periods - 1
                solution = solve_ivp(
                    *(derivative, inside, state),
                    rtol=1e-9 if last else 1e-8,
                    atol=1e-12 / self.k,
                    dense_output=last,
                )
                state = solution.y[:, -1]
                if last:
                    nodes, weights = np.polynomial.legendre.leggauss(40)
                    half = 0.5 * (end - start)
                    times = start + half * (1.0 + nodes)
                    values = self.row @ solution.sol(times)[:5]
                    path.append((values, weights * half * speed))
        values, weight = (np.concatenate(column) for column in zip(*path, strict=True))
        mean = values @ weight
        return math.sqrt(float((values - mean) ** 2 @ weight))


def driven_power(system: LumpedSystem, mesh: int, frequency: float) -> float:
    """Power that the mesh would transmit without friction [W], from its mean force."""
    speed = frequency * float(system.train.mesh_rates[mesh])
    force = system.arrays.mean_stiffness[mesh] * system.static_deflection[mesh]
    return float(abs(force) * speed * base_pitch(system.train, mesh))


@pytest.mark.slow
@pytest.mark.parametrize("speed", [2.75, 4.4])
def test_vibration_is_that_of_equations_written_again(speed):
    pair = pair_system(EPS, RATIO, ToothFriction(MU, BENDING))
    assert largest_multiplier(periodic_system(pair), speed)[0] < 1.0
    response = respond(pair, speed, Settings(steps=512, tolerance=1e-7))
    assert response.dte_rms[0] == pytest.approx(Oracle().rms(speed), rel=2e-4)
    without = respond(pair_system(EPS, RATIO), speed).dte_rms[0]
    assert abs(response.dte_rms[0] / without - 1.0) > 0.01


def test_a_motion_next_to_the_periodic_one_grows_as_its_multiplier_says():
    """With contact kept, stable speeds settle and unstable ones lose contact.

    The motion starts from that with more damping: from rest, contact is lost at first,
    and whether it comes back depends on round-off.
    """
    rub = ToothFriction(0.1)
    pair, damped = (pair_system(0.3, ratio, rub) for ratio in (0.001, RATIO))
    varying = periodic_system(pair)
    for speed in (6.4, 7.2, 9.5):
        grows = largest_multiplier(varying, speed)[0] > 1.0
        near = respond(damped, speed)
        assert near.contact_loss[0] == 0.0
        response = respond(pair, speed, Settings(max_periods=20_000), near.state)
        assert bool(response.contact_loss[0] > 0.0) == grows, speed


def test_without_friction_nothing_changes():
    for speed in (2.75, 9.0):
        plain = respond(pair_system(EPS, RATIO), speed)
        none = respond(pair_system(EPS, RATIO, ToothFriction(0.0, 0.4)), speed)
        np.testing.assert_array_equal(plain.dte_rms, none.dte_rms)


def test_what_leaves_friction_out_says_so():
    pair = pair_system(EPS, RATIO, ToothFriction(MU))
    with pytest.raises(ValueError, match="rk4 for teeth with friction"):
        respond(pair, 9.0, Settings(method="dopri5"))
    with pytest.raises(TrainError, match="harmonic balance leaves it out"):
        HarmonicBalance(pair)
    with pytest.raises(ValueError, match="closed forms leave it out"):
        parametric_system(pair)


SLOW = 0.003  # Hz, a thousandth of the natural frequencies


def turned_slowly(contact_ratio, approach, coefficient=0.05):
    """A pair that shares its load evenly, and its motion.

    Its deflections are small beside the base pitch, as those of the classical formula.
    """
    pair = pair_system(0.0, RATIO)
    gears = tuple(replace(g, torque=1e-3 * g.torque) for g in pair.train.gears)
    figures = StiffnessParameters(
        mean=pair.excitations[0].mean_stiffness,
        variation=0.0,
        contact_ratio=contact_ratio,
        approach=approach,
        load_share=0.5,
    )
    rub = ToothFriction(coefficient)
    bent = with_bending(analytic_excitation(figures), rub)
    system = LumpedSystem(replace(pair.train, gears=gears), (bent,), friction=(rub,))
    return system, time_history(system, SLOW, Settings(steps=256))


@pytest.mark.parametrize(
    ("contact_ratio", "approach"), [(C, 1.0 - GAMMA), (1.3, 0.4), (1.8, 0.95)]
)
def test_losses_are_those_of_the_classical_formula(contact_ratio, approach):
    """Ohlendorf's loss factor: mean power over what is carried, mu pi (1/z1 + 1/z2)
    (1 - eps + eps1^2 + eps2^2), of pairs that carry all or half of the load."""
    system, motion = turned_slowly(contact_ratio, approach)
    recess = contact_ratio - approach
    factor = 1.0 - contact_ratio + approach**2 + recess**2
    exact = 0.05 * math.pi * (1.0 / 38 + 1.0 / 55) * factor
    lost = np.trapezoid(motion.friction_power[:, 0], motion.history.time)
    share = lost / (motion.history.time[-1] * driven_power(system, 0, SLOW))
    assert share == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize(
    ("sliding", "speed"),
    [
        *(("nominal", speed) for speed in (0.1, 1.0, 9.0)),
        *(("instantaneous", speed) for speed in (1.0, 9.0)),
    ],
)
def test_efficiency_is_that_of_the_balance_of_energy(sliding, speed):
    """Input = output + loss, in a motion of strong friction.

    By equilibrium of the means, written down for two gears: friction changes the power
    of each gear from F v in proportion to its inertia r^2 / J of the other.
    """
    pair = pair_system(EPS, RATIO)
    rub = ToothFriction(0.3, BENDING, sliding=sliding)
    bent = with_bending(pair.excitations[0], rub)
    gears = tuple(replace(gear, torque=1e-3 * gear.torque) for gear in pair.train.gears)
    system = LumpedSystem(replace(pair.train, gears=gears), (bent,), friction=(rub,))
    motion = time_history(system, speed, Settings(steps=2048))
    assert motion.response.multiple  # no acceleration is left in the mean
    (lost,) = motion.mean_of(motion.friction_power)
    driver, driven = (motion.mean_of(power)[0] for power in motion.transmitted_power)
    carried = driven_power(system, 0, speed)
    masses = [gear.inertia / gear.base_radius**2 for gear in system.train.gears]
    between = driver - driven  # friction at nominal sliding
    assert between == pytest.approx(lost, rel=0.05)  # the rest is of vibration
    assert driver == pytest.approx(
        carried + between * masses[0] / sum(masses), rel=2e-4
    )
    assert driven == pytest.approx(
        carried - between * masses[1] / sum(masses), rel=2e-4
    )
    share = efficiency(driver, driven, lost)
    assert share * (driven + lost) == pytest.approx(driven, rel=1e-12)
    assert abs(share - (1.0 - lost / carried)) > 1e-4  # not over what no friction has


def test_efficiency_of_power_that_flows_back():
    assert efficiency(-90.0, -100.0, 10.0) == pytest.approx(0.9)
    assert math.isnan(efficiency(5.0, -5.0, 10.0))


def test_power_is_that_of_the_force_in_balance_at_every_place():
    """mu N v of a single pair, N by eq. 4.40 shared out over both gears' inertia."""
    _, motion = turned_slowly(1.3, 0.4)
    pitch = 2.0 * math.pi * RADII[0] / 38
    place = (motion.history.time * SLOW) % 1.0
    x = np.where(place > 0.9, place - 1.0, place) * pitch
    # one pair, and what rang at the last change of contact or friction is gone
    single = (place > 0.15) & (place < 0.59) | (place > 0.98)
    slope, eta = math.tan(math.radians(20.0)), Oracle().eta
    arms = (RADII[0] * slope + x) / RADII[0], (RADII[1] * slope - x) / RADII[1]
    turn = eta * arms[0] + (1.0 - eta) * arms[1]
    force = 1e-3 / (1.0 + np.sign(x) * 0.05 * turn)
    sliding = np.abs(x) * SLOW * pitch * (1.0 / RADII[0] + 1.0 / RADII[1])
    exact = 0.05 * force * sliding
    power = motion.friction_power[:, 0]
    scale = 5e-4 * power.max()
    np.testing.assert_allclose(power[single], exact[single], rtol=1e-4, atol=scale)


def ratio_table(pitches=64):
    """Two pairs, stiffness and friction-bending ratio by the way x through the mesh."""
    position = np.arange(pitches) / pitches
    columns = {"stiffness_N_per_m": np.full((1, pitches), 3e8)}
    for pair, ahead in enumerate((0, -1), start=1):
        x = position + ahead
        columns[f"pair{pair}_stiffness_N_per_m"] = STIFF(x)[None]
        columns[f"pair{pair}_load_share"] = np.full((1, pitches), 0.5)
        columns[f"pair{pair}_gap_m"] = np.zeros((1, pitches))
        columns[f"pair{pair}_friction_bending_ratio"] = BENT(x)[None]
    return MeshTable(np.array([100.0]), position, columns)


def STIFF(x):
    return 2e8 * (1.0 - 0.3 * x**2)


def BENT(x):
    return 0.4 + 0.05 * np.cos(1.5 * x + 0.3)


def test_bending_varies_over_the_way_of_a_pair():
    """k (1 + sgn mu beta) at every place, in approach and in recess."""
    errors = []
    for count in (16, 32, 64):
        table = ratio_table(count)
        rub = ToothFriction(0.2, bending_along_path(table, 100.0))
        bent = with_bending(excitation_from_table(table, 100.0), rub)
        assert [pair.ahead for pair in bent.pairs] == [-1, 0]
        place = np.linspace(0.1, 0.9, 321)  # off the ends, which cubics know less of
        stiffness = np.array([pair.stiffness(place) for pair in bent.pairs])
        x = place + np.array([[-1.0], [0.0]])
        exact = STIFF(x) * (1.0 + np.array([[0.2], [-0.2]]) * BENT(x))
        errors.append(np.abs(stiffness / exact - 1.0).max())
    assert errors[-1] < 1e-6
    assert errors[0] / errors[-1] > 4.0**2 * 0.9


def test_bending_that_varies_is_told_apart_from_its_mean():
    """A ratio that is the same everywhere is a number; what is not one is refused."""
    same = {0: constant_wave(0.3), -1: constant_wave(0.3)}
    plain = pair_system(EPS, RATIO).excitations[0]
    for one, other in zip(
        with_bending(plain, ToothFriction(MU, same)).pairs,
        with_bending(plain, ToothFriction(MU, 0.3)).pairs,
        strict=True,
    ):
        np.testing.assert_array_equal(
            one.stiffness.coefficients, other.stiffness.coefficients
        )
    with pytest.raises(ValueError, match=r"bending of pair -1 = .*; must be 0"):
        ToothFriction(MU, {0: constant_wave(0.3), -1: linear_wave(0.9, 0.2)})
