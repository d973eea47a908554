"""The return map beside SciPy's integration of the equation of motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.rattle.attractors import AttractorClassifier
from lumped.rattle.kernels.flight import MAX_RESTING_SPEED, return_map
from lumped.rattle.kernels.settle import CHANGING, PERMANENT_CONTACT, UNKNOWN
from lumped.rattle.machine import Machine
from lumped.rattle.periodic_orbits import min_eccentricity, simple_rattle
from lumped.rattle.return_map import follow, iterate_map_points

TURN = 2.0 * math.pi


def acceleration(machine, t, x, w, force):
    load = 2.0 * TURN * machine.damping
    load -= TURN**2 * machine.eccentricity * math.cos(TURN * t)
    load -= TURN * machine.damping * machine.eccentricity * math.sin(TURN * t)
    angle = TURN * machine.ripple_order * t + machine.ripple_phase
    load += machine.ripple * math.cos(angle)
    return load - machine.damping * w - force(x)


def next_departure(machine, t, v):
    """From the upper flank, by integration to events; lower flanks that were met."""
    beta, lower, w, x = machine.half_backlash, 0, -v, machine.half_backlash

    def force(x):
        if machine.is_impact:
            return 0.0
        return 2.0 * machine.stiffness * (max(x - beta, 0.0) + min(x + beta, 0.0))

    def rates(t, y):
        return [y[1], acceleration(machine, t, *y, force)]

    def crossing(level, direction):
        event = lambda t, y: y[0] - level  # noqa: E731
        event.terminal, event.direction = True, direction
        return event

    tight = {"rtol": 1e-11, "atol": 1e-13, "method": "DOP853"}
    while True:
        # an event at the very start is the departure itself
        start = t + 1e-7, [x + 1e-7 * w, w + 1e-7 * rates(t, [x, w])[1]]
        events = [crossing(-beta, -1), crossing(beta, 1)]
        if not machine.is_impact:
            events = [crossing(-beta, -1), crossing(beta, -1)]
        solution = solve_ivp(
            rates, (start[0], t + 30.0), start[1], events=events, **tight
        )
        low, high = solution.t_events
        if not low.size and not high.size:
            return math.nan, 0.0, lower
        side = 1 if high.size and not (low.size and low[0] < high[0]) else -1
        t = (high if side > 0 else low)[0]
        x, w = side * beta, solution.y_events[(side + 1) // 2][0][1]
        lower += side < 0
        if machine.is_impact:
            w = -machine.restitution * w
            if side > 0:
                return t, -w, lower
        elif side > 0:
            return t, -w, lower


SCALED = {"damping": 0.6, "half_backlash": 0.6}
MACHINES = [
    Machine(**SCALED, eccentricity=0.1),
    Machine(**SCALED, eccentricity=0.3, restitution=0.8),
    Machine(**SCALED, eccentricity=0.1, ripple=2.0, ripple_order=3, ripple_phase=0.4),
    Machine(**SCALED, eccentricity=0.1, stiffness=1e3),
    Machine(**SCALED, eccentricity=0.25, stiffness=1e4, ripple=1.5, ripple_order=2),
]


@pytest.mark.parametrize("machine", MACHINES)
def test_departures_follow_as_by_integration(machine):
    random, lower = np.random.default_rng(4), 0
    for _ in range(12):
        t, v = random.uniform(0.0, 1.0), random.uniform(0.3, 7.0)
        exact = next_departure(machine, t, v)
        departure = return_map(machine.arrays, t, v)
        assert departure[2] == exact[2]
        # grazing flanks make small errors large
        np.testing.assert_allclose(departure[:2], exact[:2], rtol=2e-5, atol=2e-5)
        lower += exact[2]
    assert lower >= 3


@pytest.mark.parametrize("restitution", [1.0, 0.9])
def test_simple_rattle_is_a_fixed_point(restitution):
    """Closed form, eqs. 2.47 and 2.56, beside the map."""
    machine = Machine(**SCALED, eccentricity=0.1, restitution=restitution)
    both = simple_rattle(machine)
    assert [motion.in_phase for motion in both] == [True, False]
    lower_counts = []
    for motion in both:
        t, v, lower = return_map(machine.arrays, motion.time, motion.velocity)
        lower_counts.append(lower)
        if not lower:
            assert t == pytest.approx(motion.time + 1.0, abs=1e-9)
            assert v == pytest.approx(motion.velocity, abs=1e-9)
    assert not all(lower_counts)


def test_events_that_are_not_found_are_not_taken_for_quiet():
    """No crossing is found from an infinite speed, nor what a huge one leads to."""
    machine = Machine(**SCALED, eccentricity=0.1)
    starts = np.array([[0.3, math.inf], [0.3, 1e6], [0.3, 2.0]])
    assert return_map(machine.arrays, *starts[0])[0] == math.inf
    settled = iterate_map_points(machine, starts, 1499)
    np.testing.assert_array_equal(
        settled.period, [UNKNOWN, CHANGING, PERMANENT_CONTACT]
    )
    naming = AttractorClassifier(machine, 1499)
    np.testing.assert_array_equal(naming.sort(settled)[0], [-1, -1, 0])
    assert [attractor.name for attractor in naming.attractors] == ["quiet"]


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_flanks_that_stick_part_when_the_load_turns(restitution):
    """Departures from rest are those times, to round-off."""
    machine = Machine(**SCALED, eccentricity=0.3, restitution=restitution)
    path = follow(machine, (0.3, 2.0), 400)
    times = path[path[:, 1] == MAX_RESTING_SPEED, 0]
    assert times.size
    load = [acceleration(machine, t, 0.6, 0.0, lambda x: 0.0) for t in times]
    np.testing.assert_allclose(load, 0.0, atol=1e-9)


def test_soft_flanks_repeat_two_turns_below_the_critical_eccentricity():
    """A motion that was taken for quiet, beside SciPy's integration."""
    machine = Machine(**SCALED, eccentricity=0.1826, stiffness=2000.0)
    starts = np.array([[0.6, 0.05]])
    settled = iterate_map_points(machine, starts, 3000)
    assert settled.period[0] == 4
    t, v = settled.end[0]
    for _ in range(4):
        t, v, lower = next_departure(machine, t, v)
        assert not lower
    assert t == pytest.approx(settled.end[0, 0] + 2.0, abs=1e-6)
    assert v == pytest.approx(settled.end[0, 1], abs=1e-6)


def test_simple_rattle_exists_above_the_checked_eccentricity():
    machine = Machine(**SCALED, eccentricity=0.0597)
    assert min_eccentricity(machine) == pytest.approx(0.05964, abs=5e-6)
    assert len(simple_rattle(machine)) == 2
    assert simple_rattle(Machine(**SCALED, eccentricity=0.0596)) == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"damping": 0.0}, "damping = 0; must be above 0 and finite"),
        ({"half_backlash": -1.0}, "half_backlash = -1; must be above 0 and finite"),
        ({"eccentricity": math.nan}, "eccentricity = nan; must be 0 or more"),
        ({"stiffness": 0.0}, "stiffness = .*; must be above 0.045"),
        ({"restitution": 1.5}, "restitution = 1.5; must be from 0 to 1"),
        ({"ripple_order": 0}, "ripple_order = 0; must be 1 or more"),
    ],
)
def test_a_machine_that_cannot_be_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Machine(**({**SCALED, "eccentricity": 0.1} | change))
