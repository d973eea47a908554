"""Cascades of period doublings of the idler, beside plain integration by scipy."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.branches.balance import HarmonicBalance
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.cascades import FEIGENBAUM, Cascade, find_cascades
from lumped.branches.motions import SpeedFamily
from lumped.branches.period_map import SPRING_STEPS
from lumped.branches.periodic import BranchFinder
from lumped.branches.points import BranchPoint, PeriodicBranch
from lumped.continuation.bifurcations import DOUBLING
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import AdaptiveStepper

INERTIAS = 2.621e-3, 3.27e-3, 0.119  # kg m2, chapter 3
RADII = 0.04535, 0.06564, 0.11218  # m
MEANS, VARIATIONS = np.array([2.9831e8, 3.2108e8]), np.array([0.35, 0.4])
LAG = -0.125  # base pitches of the second mesh, pi/4
# Of a mesh cycle, where a stiffness jumps: two pairs carry for half of it, about the
# middle between two pitch points
EDGES = 0.0, 0.25, 0.375, 0.75, 0.875, 1.0
LIMITS = 1500.0, 1640.0  # Hz, with the first two doublings
SIZE = np.array([1e-6, 1e-6, 1e-2, 1e-2])  # m and m/s
OFF = 2e-5  # of a speed, to both sides of a doubling


@pytest.fixture(scope="module")
def train(system, idler):
    """The idler of chapter 3 on rectangular waves, free to turn."""
    free = idler(inertias=INERTIAS, coupled=False, phases=(0.0, LAG))
    return system(free, contact_ratio=1.5)


def followed(train, limits, **settings):
    """Branches of the motion from rest at the upper limit and of its doublings."""
    finder = BranchFinder(SpeedFamily(train), limits, BranchSettings(**settings))
    finder.from_rest(limits[1])
    finder.doublings()
    return finder.branches


@pytest.fixture(scope="module")
def branches(train):
    return followed(train, LIMITS, period_multiple=2)


def rates_of():
    """Right-hand side of s'' = p - A F - C s', F = k_m(t) max(s, 0), of both meshes."""
    first, idle, last = (r**2 / j for r, j in zip(RADII, INERTIAS, strict=True))
    a = np.array([[first + idle, -idle], [-idle, idle + last]])
    p = 100.0 / RADII[0] * np.array([first, last])
    square, shapes = np.linalg.eig(a * MEANS)
    c = shapes @ np.diag(0.08 * np.sqrt(square)) @ np.linalg.inv(shapes)

    def rates(t, y, k):
        force = k * np.maximum(y[:2], 0.0)
        return np.concatenate([y[2:], p - a @ force - c @ y[2:]])

    return rates


def mapped(z, frequency, periods, rates):
    """Scaled deflections and rates (4,) after mesh periods."""
    y = z * SIZE
    for _ in range(periods):
        for begin, end in pairwise(EDGES):
            middle = 0.5 * (begin + end)
            high = np.array([abs(middle - 0.5) < 0.25, abs(middle + LAG - 0.5) < 0.25])
            k = MEANS * (1.0 + VARIATIONS * (high - 0.5))
            span = begin / frequency, end / frequency
            motion = solve_ivp(
                rates, span, y, "DOP853", args=(k,), rtol=1e-10, atol=1e-16
            )
            y = motion.y[:, -1]
    return y / SIZE


def largest_alternation(z, frequency, periods):
    """Most negative Floquet multiplier of the motion near z, by Newton's method with
    differences of motions."""
    rates = rates_of()

    def jacobian(z):
        steps = 1e-2 * np.eye(4)
        ends = [
            [mapped(z + side * s, frequency, periods, rates) for side in (1.0, -1.0)]
            for s in steps
        ]
        return np.array([(up - down) / 2e-2 for up, down in ends]).T

    change = jacobian(z)
    for _ in range(6):
        error = mapped(z, frequency, periods, rates) - z
        z = z - np.linalg.solve(change - np.eye(4), error)
    assert np.abs(error).max() < 1e-5
    return np.linalg.eigvals(jacobian(z)).real.min()


def section(train, branch, point):
    """Scaled deflections and rates of a bifurcating motion at the period's start."""
    balance = HarmonicBalance(train, BranchSettings().harmonics, branch.multiple)
    state = balance.state(point.x, point.frequency)
    speed = Speed(point.frequency, SPRING_STEPS)
    _, history = AdaptiveStepper(train).record(state, speed, 1)
    return np.append(history.deflection[0], history.rate[0]) / SIZE


def test_the_first_two_doublings_are_where_a_multiplier_is_minus_one(train, branches):
    """By an integration that shares nothing with the solver: 1624.69 and 1524.96 Hz."""
    (cascade,) = find_cascades(branches, 1000.0)
    assert cascade.multiples == (1, 2)
    assert cascade.parameters == pytest.approx((1624.69, 1524.96), abs=0.02)
    for branch, at in zip(branches, cascade.parameters, strict=True):
        (point,) = (p for p in branch.bifurcations if p.kind == DOUBLING)
        start = section(train, branch, point)
        above, below = (
            largest_alternation(start, at * (1.0 + side), branch.multiple)
            for side in (OFF, -OFF)
        )
        assert (above + 1.0) * (below + 1.0) < 0.0
        assert abs(above + below + 2.0) < 0.1 * abs(above - below)


def test_shooting_finds_the_doubling_of_harmonic_balance(train, branches):
    shot = followed(train, (1600.0, 1640.0), period_multiple=1, solver="shooting")
    (doubling,) = shot[0].bifurcations
    (balanced,) = branches[0].bifurcations
    assert doubling.kind == balanced.kind == DOUBLING
    assert doubling.best_parameter == pytest.approx(balanced.best_parameter, rel=1e-6)
    assert shot[0].error < 1e-6


@pytest.mark.parametrize(("frequency", "periods"), [(1500.0, 1), (1700.0, 3)])
def test_a_monodromy_by_differences_has_the_determinant_of_the_damping(
    train, frequency, periods
):
    """exp(-2 zeta T sum of omega), whatever the motion and its contact."""
    state = 3.0 * train.static_state
    speed = Speed(frequency, SPRING_STEPS)
    end, matrix = AdaptiveStepper(train).monodromy(state, speed, periods)
    exponent = 0.08 * 2.0 * math.pi * train.resonances_Hz.sum() * periods / frequency
    assert np.linalg.det(matrix) == pytest.approx(math.exp(-exponent), rel=1e-5)
    once, history = AdaptiveStepper(train).record(state, speed, periods)
    assert (history.force == 0.0).any()
    np.testing.assert_allclose(end, once, rtol=1e-7)


def point(parameter, rms=1e-6, kind=""):
    figures = {"dte_rms": np.array([rms])}
    return BranchPoint(parameter, 1.0, np.zeros(1), np.zeros(1), figures, kind=kind)


def branch(multiple, *points):
    return PeriodicBranch(multiple, points, "", "")


def doublings(count):
    """Branches with doublings at 1 - delta^-n, each begun at the one before."""
    at = [1.0 - FEIGENBAUM**-n for n in range(count)]
    yield branch(1, point(-1.0), point(at[0], kind=DOUBLING), point(2.0))
    for n in range(1, count):
        ends = point(at[n - 1]), point(at[n], kind=DOUBLING), point(2.0)
        yield branch(2**n, *(ends if n % 2 else ends[::-1]))


@pytest.mark.parametrize("count", [2, 3, 5])
def test_a_cascade_of_known_ratios_is_linked_from_branch_to_branch(count):
    (cascade,) = find_cascades(list(doublings(count))[::-1], unit=1e-6)
    assert cascade.multiples == tuple(2**n for n in range(count))
    assert cascade.ratios == pytest.approx([FEIGENBAUM] * (count - 2))
    assert cascade.limit == pytest.approx(1.0)


def test_a_branch_of_another_motion_does_not_continue_a_cascade():
    parent, child = doublings(2)
    other = branch(2, *(point(p.parameter, 2e-6, p.kind) for p in child.points))
    assert find_cascades([parent, other], unit=1e-6) == []
    assert find_cascades([parent, branch(4, *child.points)], unit=1e-6) == []


def test_ratios_of_a_cascade_are_of_intervals_of_either_sign():
    cascade = Cascade((1, 2, 4), (10.0, 6.0, 5.0))
    assert cascade.ratios == (4.0,)
    assert cascade.limit == pytest.approx(5.0 - 1.0 / (FEIGENBAUM - 1.0))


@pytest.mark.slow
def test_six_doublings_of_the_idler_approach_the_constant_of_feigenbaum(train):
    """By shooting; only the last of six ratios, 4.79, is near enough to tell it."""
    doubled = followed(train, (1471.4, 1640.0), period_multiple=32, solver="shooting")
    cascade = max(find_cascades(doubled, 1000.0), key=lambda c: c.multiples)
    assert cascade.multiples == (1, 2, 4, 8, 16, 32)
    assert cascade.ratios[-1] == pytest.approx(FEIGENBAUM, rel=0.05)
