"""Impacts of several contacts: the complementarity problem and what it keeps."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from loose_wheels import SINE, freedom, helical, spur

from lumped.clatter.groups import WheelGroup
from lumped.clatter.kernels.contact import N_TERMS
from lumped.clatter.kernels.group_arrays import new_workspace
from lumped.clatter.kernels.impact import solve_impact, solve_lcp


def enumerated(g, b):
    """The solution by trying every set of active contacts."""
    n = len(b)
    for active in itertools.product((False, True), repeat=n):
        on = np.flatnonzero(active)
        z = np.zeros(n)
        z[on] = np.linalg.solve(g[np.ix_(on, on)], -b[on])
        if z.min() >= -1e-12 and (g @ z + b).min() >= -1e-12:
            return z
    raise AssertionError("no solution")


def solved(g, b):
    n = len(b)
    z, basis = np.zeros(n), np.zeros(n, np.int64)
    assert solve_lcp(g, b, z, basis, n, np.zeros((n, n + 1)))
    return z


def test_impulses_are_those_of_the_active_set_that_fits():
    random = np.random.default_rng(3)
    for n in (1, 2, 3, 4, 6):
        for _ in range(20):
            a = random.normal(size=(n, n + 1))
            g, b = a @ a.T, random.normal(size=n)
            np.testing.assert_allclose(solved(g, b), enumerated(g, b), atol=1e-9)


def struck(group, v, contacts, e_rate=0.0):
    """Speeds after an impact of closed contacts (play, edge), and its impulses."""
    box, n = group.box, len(v)
    work, after = new_workspace(n, n, N_TERMS), np.array(v)
    for k, (p, side) in enumerate(contacts):
        work.contact[k], work.side[k] = p, side
        work.s[p, 1] = box.ratios[p] * e_rate + box.rows[p] @ v
    assert solve_impact(box, work, after, len(contacts), True)
    return after, work.z[: len(contacts)].copy()


# edges that the speeds below close, all at once
SPEEDS = np.array([2.0, -0.02, -0.05])
CLOSING = [(0, -1), (1, -1), (2, -1)]


def test_no_order_of_contacts_matters():
    group = WheelGroup((helical(0.6),), SINE)
    first, _ = struck(group, SPEEDS, CLOSING)
    for order in itertools.permutations(CLOSING):
        after, _ = struck(group, SPEEDS, order)
        np.testing.assert_allclose(after, first, rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_impacts_of_several_plays_follow_equation_6(count):
    """q+ = [E - M^-1 Z0' (Z0 M^-1 Z0')^-1 (Z0 + Z1)] q- - M^-1 Z0' (...)^-1 Z2."""
    group, e_rate = WheelGroup((helical(0.6),), SINE), 1e-3
    contacts = CLOSING[:count]
    after, impulses = struck(group, SPEEDS, contacts, e_rate)
    assert np.all(impulses > 0.0)
    plays = [p for p, _ in contacts]
    eps, mass = 0.6, np.diag(1.0 / group.masses)
    z0 = -group.rows[plays]
    z1 = eps * z0
    z2 = -(1.0 + eps) * group.box.ratios[plays] * e_rate
    lift = mass @ z0.T @ np.linalg.inv(z0 @ mass @ z0.T)
    wanted = (np.eye(3) - lift @ (z0 + z1)) @ SPEEDS - lift @ z2
    np.testing.assert_allclose(after, wanted, rtol=1e-12)


def test_an_impact_of_teeth_follows_equation_3():
    wheel = helical(0.6)
    group, e_rate = WheelGroup((wheel,), SINE), 2e-3
    v = np.array([0.001, -0.001, 0.002])
    w = np.array(
        [
            0.04 * math.cos(wheel.helix_angle),
            *(math.sin(wheel.helix_angle), math.cos(wheel.helix_angle)),
        ]
    )
    closing = wheel.ratio * e_rate - w @ v
    assert closing > 0.0
    after, _ = struck(group, v, [(0, 1)], e_rate)
    inertia, mass = wheel.inertia, wheel.mass
    eta = 1.6 / (w[0] ** 2 / inertia + (w[1] ** 2 + w[2] ** 2) / mass)
    wanted = v + eta * closing * w / np.array([inertia, mass, mass])
    np.testing.assert_allclose(after, wanted, rtol=1e-12)


def test_a_mesh_of_loose_wheels_keeps_their_momentum():
    """What one wheel gets along and across its axis the other loses."""
    sides = {"axial": freedom(1e-4, 0.5), "radial": freedom(5e-5, 0.5)}
    first = spur(0.6, ratio=1.3, mass=2.0, helix_angle=0.1, **sides)
    second = helical(0.6, name="second", driver="spur", ratio=0.8, mass=0.7)
    group = WheelGroup((first, second), SINE)
    v = np.array([1.0, 0.02, -0.03, -2.0, 0.01, 0.04])
    rate = float(group.rows[3] @ v)
    after, impulses = struck(group, v, [(3, 1 if rate > 0.0 else -1)])
    assert impulses[0] > 0.0
    momentum_change = group.masses * (after - v)
    assert momentum_change[4] == pytest.approx(-momentum_change[1])
    assert momentum_change[5] == pytest.approx(-momentum_change[2])
    # about their axes by the radii of the teeth that mesh
    assert momentum_change[3] / 0.04 == pytest.approx(
        -momentum_change[0] / (0.8 * 0.04)
    )


@pytest.mark.parametrize(
    "restitutions", [(1.0, 1.0, 1.0), (0.3, 1.0, 0.0), (0.9, 0.2, 0.7)]
)
def test_no_impact_adds_energy(restitutions):
    teeth, axial, radial = restitutions
    wheel = helical(teeth, axial=freedom(1e-4, axial), radial=freedom(5e-5, radial))
    group = WheelGroup((wheel,), SINE)
    random = np.random.default_rng(1)
    for _ in range(200):
        v = random.normal(size=3) * np.array([25.0, 1.0, 1.0])
        rates = group.rows @ v
        every = [(p, 1 if rates[p] > 0.0 else -1) for p in range(3)]
        for contacts in (every[:1], every[1:], every):
            after, impulses = struck(group, v, contacts)
            before = np.sum(group.masses * v**2)
            assert np.sum(group.masses * after**2) <= before * (1.0 + 1e-12)
            assert impulses.min() >= 0.0
            if len(contacts) == 1 and teeth == 1.0:
                assert np.sum(group.masses * after**2) == pytest.approx(before)
