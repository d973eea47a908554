"""Runs of loose wheels: events beside scipy's, energy, chatter and contact."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from loose_wheels import SINE, STILL, freedom, helical, impacts_by_scipy, spur

from lumped.clatter.gearbox import Harmonics, Variation
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import (
    centred_state,
    energy,
    join_impacts,
    random_state,
    simulate,
)


def varying(wheel, amplitude, order=2):
    """A wheel whose play of the teeth varies."""
    return replace(wheel, variation=Variation(amplitude, order, 0.7))


@pytest.mark.parametrize(
    ("wheel", "until"),
    [
        (spur(), 0.06),
        (helical(), 0.06),
        (varying(spur(), 4e-5), 0.06),
        (varying(helical(), 4e-5, 1), 0.034),  # later scipy overlooks a contact
    ],
    ids=["spur", "helical", "varying spur", "varying helical"],
)
def test_impacts_are_those_of_a_fine_integration(wheel, until):
    group = WheelGroup((wheel,), SINE)
    state = centred_state(group)
    wanted = impacts_by_scipy(group, state.q, state.v, until)
    impacts = join_impacts(list(simulate(group, state, until)))
    loud = [impact for impact in wanted if impact[2] > 1e-4]
    keep = impacts.speed > 1e-4
    assert len(loud) > 5
    times, plays, speeds = zip(*loud, strict=True)
    np.testing.assert_array_equal(impacts.play[keep][: len(plays)], plays)
    np.testing.assert_allclose(impacts.time[keep], times, atol=1e-9)
    np.testing.assert_allclose(impacts.speed[keep], speeds, atol=1e-8)


@pytest.mark.parametrize("amplitude", [None, 5e-5])
def test_no_play_is_left_and_none_overlooked(amplitude):
    wheel = helical() if amplitude is None else varying(helical(), amplitude)
    group = WheelGroup((wheel,), SINE)
    state = random_state(group, 4)
    for time in np.arange(0.0013, 4.0, 0.0013):
        for _ in simulate(group, state, time):
            pass
        e = group.excitation.at(np.array([time]))[0]
        s = group.ratios * e + group.rows @ state.q
        assert np.all(s <= 1e-15)
        assert np.all(s >= -group.widths(np.array([time]))[0] - 1e-15)


@pytest.mark.parametrize("wheel", [spur, helical], ids=lambda w: w.__name__)
def test_a_million_impacts_keep_the_energy(wheel):
    group = WheelGroup((wheel(1.0, 0.0, 0.0),), STILL)
    state = random_state(group, 1)
    box = group.box
    state.v = np.linalg.solve(box.rows, [-2e-4, 3e-4, 1e-4][: box.low.size])
    before, count = energy(group, state), 0
    for part in simulate(group, state, math.inf):
        count += len(part)
        if count > 1_000_000:
            break
    assert energy(group, state) == pytest.approx(before, rel=1e-9)


def test_bounces_of_decreasing_height_end_in_contact():
    """A wheel falling onto its edge: infinitely many impacts in a finite time."""
    wheel = spur(0.5, -0.1, 0.0, ratio=1.0)
    group = WheelGroup((wheel,), STILL)
    state = centred_state(group)  # s = -play / 2, accelerated by the drag toward s = 0
    a = 0.1 * wheel.base_radius / wheel.inertia
    fall = math.sqrt(wheel.rotation.play / a)
    end = fall * (1.0 + 0.5) / (1.0 - 0.5)
    first = join_impacts(list(simulate(group, state, 0.99999 * end)))
    assert state.held[0] == 0
    speeds = first.speed
    np.testing.assert_allclose(speeds[1:12] / speeds[:11], 0.5, rtol=1e-9)
    list(simulate(group, state, 1.001 * end))
    assert state.held[0] == 1
    assert sum(len(p) for p in simulate(group, state, 10.0)) == 0


def test_teeth_in_contact_follow_the_excitation_until_it_pulls_away():
    """Without restitution; the force i e'' M + drag over the base radius ends it."""
    wheel = spur(0.0, -0.08, 0.0, ratio=1.0, inertia=1e-3)
    sine = Harmonics(0.04, (0.15e-3,), (0.0,))
    group = WheelGroup((wheel,), sine)
    turn, radius = 2.0 * math.pi / 0.04, wheel.base_radius
    weight = wheel.rotation.drag * radius / wheel.inertia  # acceleration of s, minus
    # in contact s'' = e'' - a, force while e'' > weight; e'' = -A turn^2 sin(turn t)
    part = -weight / (0.15e-3 * turn**2)
    leave = (math.pi - math.asin(part)) if part > 1.0 else math.asin(part)
    leave = leave / turn
    state = centred_state(group)
    state.q[0] = 0.0
    state.v[0] = 0.15e-3 * turn / radius * 0.04  # with the excitation, per period
    list(simulate(group, state, 0.999 * leave))
    assert state.held[0] == 1
    list(simulate(group, state, 1.001 * leave))
    assert state.held[0] == 0
    e = float(sine.at(np.array([state.time * 0.04]))[0])
    assert e - radius * state.q[0] == pytest.approx(0.0, abs=1e-12)


def test_damped_contact_of_a_helical_wheel_is_that_of_its_equations():
    """Teeth held, axial and radial shifts free: beside scipy's solution."""
    from scipy.integrate import solve_ivp

    sides = {
        "axial": freedom(1e-2, 0.0, 0.01, 5.0),
        "radial": freedom(1e-2, 0.0, -0.02, 1.0),
    }
    wheel = helical(0.0, -0.5, 0.05, **sides)
    group = WheelGroup((wheel,), SINE)
    state, box = centred_state(group), group.box
    e = SINE.at(np.zeros(1))[0]
    state.q = np.linalg.solve(box.rows, [-box.ratios[0] * e, -5e-3, -5e-3])
    turn = 2.0 * math.pi / SINE.period
    e1 = 0.15e-3 * turn * math.cos(0.3)
    state.v[0] = -box.ratios[0] * e1 / box.rows[0, 0] * SINE.period
    start, speed = state.q.copy(), state.v / SINE.period
    w, masses = box.rows[0], group.masses
    drag = np.array([f.drag for f in group.freedoms])
    damping = np.array([f.damping for f in group.freedoms])

    def rates(t, y):
        e2 = -0.15e-3 * turn**2 * math.sin(turn * t + 0.3) * box.ratios[0]
        free = (drag - damping * y[3:]) / masses
        force = -(w @ free + e2) / np.sum(w**2 / masses)
        return np.concatenate([y[3:], free + w * force / masses])

    list(simulate(group, state, 0.02))
    assert state.held[0] == 1
    y = solve_ivp(
        *(rates, (0.0, 0.02), np.concatenate([start, speed]), "DOP853"),
        rtol=1e-12,
        atol=1e-15,
    ).y[:, -1]
    np.testing.assert_allclose(state.q, y[:3], rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(state.v / SINE.period, y[3:], rtol=1e-8, atol=1e-10)


def test_parts_of_a_run_are_the_whole_run():
    group = WheelGroup((helical(),), SINE)
    state, other = centred_state(group), centred_state(group)
    whole = join_impacts(list(simulate(group, state, 2.0)))
    parts = join_impacts(list(simulate(group, other, 2.0, max_impacts=7)))
    for name in vars(whole):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


def squeezed(mass: float, restitution: float = 0.8) -> WheelGroup:
    """A light body between a heavy tooth and the edge of its bearing."""
    play = freedom(1e-4, 0.5)
    return WheelGroup((spur(restitution, 0.0, 0.0, mass=mass, radial=play),), STILL)


@pytest.mark.parametrize("mass", [0.3, 1e-2, 1e-6])
def test_a_body_squeezed_without_end_is_one_impact(mass):
    """Impacts one after the other, by hand, as long as there are any."""
    group = squeezed(mass)
    state, rows, masses = centred_state(group), group.rows, group.masses
    state.q = np.linalg.solve(rows, [0.0, 0.0])  # both closed
    state.v = np.linalg.solve(rows, [0.3e-3, 0.2e-3])  # and both approach
    v, before = state.v.copy(), energy(group, state)
    closing, hits = rows @ v, 0
    g = rows / masses @ rows.T
    z = np.linalg.solve(g, [1.8 * closing[0], 1.5 * closing[1]])
    v -= rows.T @ z / masses  # the first one is of both at once
    while (rows @ v).max() > 1e-14:
        p = int(np.argmax(rows @ v))
        bounce = (0.8, 0.5)[p]
        v -= (1.0 + bounce) * (rows[p] @ v) / g[p, p] * rows[p] / masses
        hits += 1
    impacts = join_impacts(list(simulate(group, state, 1e-9)))
    np.testing.assert_allclose(state.v, v, atol=1e-10)
    assert sorted(impacts.play) == [0, 1]
    assert impacts.lost.sum() == pytest.approx(before - energy(group, state), rel=1e-9)


def test_a_light_body_between_heavy_ones_costs_few_impacts():
    """Without end they would be millions; energy that is lost is all recorded."""
    group = squeezed(1e-7)
    state = random_state(group, 2)
    state.v = np.linalg.solve(group.rows, [3e-3, 1e-4])
    before = energy(group, state)
    impacts = join_impacts(list(simulate(group, state, 10.0)))
    assert 10 < len(impacts) < 5000
    assert impacts.lost.sum() == pytest.approx(before - energy(group, state), rel=1e-9)


def test_contact_lasts_as_long_as_its_force():
    """Pressed onto the teeth for 10,000 periods, of 12 steps each at least."""
    group = WheelGroup((spur(0.5, -1e3),), SINE)
    state = centred_state(group)
    list(simulate(group, state, 1e4 * SINE.period))
    assert state.held[0] == 1
    assert state.time == pytest.approx(1e4)


def test_teeth_on_a_moving_edge_stay_on_it():
    """Pressed onto the lower edge of a play that varies, and damped."""
    group = WheelGroup((varying(spur(0.0, 1e3, 0.2), 5e-5, 3),), SINE)
    state = centred_state(group)
    for time in np.arange(0.04, 0.2, 0.0017):
        list(simulate(group, state, time))
        e = SINE.at(np.array([time]))[0]
        (s,) = group.ratios * e + group.rows @ state.q
        assert state.held.max() == 0
        assert state.held.min() == -1
        assert s == pytest.approx(-group.widths(np.array([time]))[0, 0], abs=1e-17)


def test_contact_on_a_moving_edge_ends_with_its_force():
    """The play of a still wheel opens faster than a weak drag moves the wheel."""
    amplitude, turn = 5e-5, 2.0 * math.pi / 0.04
    wheel = varying(spur(0.0, 0.0, 0.0), amplitude, 1)
    wheel = replace(wheel, rotation=replace(wheel.rotation, drag=0.01))
    group = WheelGroup((wheel,), STILL)
    state = centred_state(group)
    weight = 0.01 * wheel.base_radius / wheel.inertia  # s'' = -weight in flight
    # the edge is at -play - a sin(turn t + 0.7); it pulls away from the wheel where its
    # acceleration a turn^2 sin(...) falls below -weight
    part = weight / (amplitude * turn**2)
    leave = (math.pi + math.asin(part) - 0.7) / turn + 0.04
    list(simulate(group, state, 0.9999 * leave))
    assert state.held.min() == -1
    list(simulate(group, state, 1.0001 * leave))
    assert state.held.min() == 0
