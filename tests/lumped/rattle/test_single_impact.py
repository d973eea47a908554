"""Rattle of one impact a turn: both of its conditions beside integrated flights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.rattle.assembly import Assembly, Shafts
from lumped.rattle.impulses import impulse_rattle
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.motions import AssemblyIntegrator
from lumped.rattle.orbits import find_orbits
from lumped.rattle.periodic_orbits import min_eccentricity, simple_rattle
from lumped.rattle.single_impact import single_impact, single_impact_of_parts

TIMES = np.linspace(0.0, 1.0, 2001)


def random_machine(seed):
    """Flights rise to damping * pi / 2 about: plays are smaller and larger."""
    random = np.random.default_rng(seed)
    damping = 10.0 ** random.uniform(-3.0, 0.0)
    return Machine(
        damping=damping,
        eccentricity=damping * 10.0 ** random.uniform(-1.5, 0.3),
        half_backlash=damping * random.uniform(0.1, 2.0),
        restitution=random.uniform(0.3, 1.0),
        drive=random.uniform(0.7, 1.4),
    )


def gaps(machine, start, speed):
    """Gaps to the driving flank over a turn, by integration of eq. 2.26."""

    def rates(t, state):
        eccentricity, drag = machine.eccentricity, machine.damping
        load = 2.0 * TURN * drag * machine.drive
        load -= TURN**2 * eccentricity * math.cos(TURN * t)
        load -= TURN * drag * eccentricity * math.sin(TURN * t)
        return [state[1], load - drag * state[1]]

    play = machine.half_backlash
    size = {"rtol": 1e-10, "atol": 1e-11 * play}
    solution = solve_ivp(
        rates, (start, start + 1.0), [play, -speed], t_eval=start + TIMES, **size
    )
    return play - solution.y[0]


@pytest.mark.parametrize("seed", range(40))
def test_flights_are_those_of_the_equation_of_motion(seed):
    machine = random_machine(seed)
    conditions = single_impact(machine)
    motions = simple_rattle(machine)
    assert len(conditions.flights) == len(motions)
    for flight in conditions.flights:
        (motion,) = (m for m in motions if m.in_phase == flight.in_phase)
        gap = gaps(machine, motion.time, motion.velocity)
        assert gap[-1] == pytest.approx(0.0, abs=1e-7 * machine.half_backlash)
        assert gap.max() == pytest.approx(flight.height, rel=1e-5)
        meets_back = gap.max() > 2.0 * machine.half_backlash
        meets_driving = gap[1:-1].min() < 0.0
        assert (flight.meets is not None) == (meets_back or meets_driving)
        assert (flight.meets is None) == motion.physical


@pytest.mark.parametrize("seed", range(40))
def test_a_flight_stays_between_the_flanks_within_the_window(seed):
    machine = random_machine(seed)
    conditions = single_impact(machine)
    assert conditions.orbit_from == min_eccentricity(machine)
    larger = 2.0 * machine.half_backlash > conditions.least_play
    assert (conditions.window is not None) == larger
    window = conditions.window or (conditions.orbit_from, 10.0 * machine.damping)
    ratio = window[1] / window[0]
    for part in (-0.02, 0.02, 0.5, 0.98, 1.02):
        eccentricity = window[0] * ratio**part
        inside = conditions.window is not None and 0.0 < part < 1.0
        motions = simple_rattle(replace(machine, eccentricity=eccentricity))
        assert any(motion.physical for motion in motions) == inside


def test_a_small_play_forbids_rattle_that_a_large_one_has():
    """The flight is pi delta / 2 high where its impact is at a mean position."""
    machine = Machine(
        damping=0.02, eccentricity=5e-3, half_backlash=2e-3, restitution=0.9
    )
    small = single_impact(machine)
    large = single_impact(replace(machine, half_backlash=5e-2))
    assert small.window is None
    assert [flight.meets for flight in small.flights] == ["back", "back"]
    assert small.orbit_from == large.orbit_from == large.window[0]
    assert [flight.meets for flight in large.flights] == [None, None]
    heights = [flight.height for flight in small.flights]
    assert heights == [flight.height for flight in large.flights]
    mean = sum(heights) / 2.0
    assert mean == pytest.approx(0.02 * math.pi / 2.0, rel=0.02)
    names = [orbit.name for orbit in find_orbits(machine, 1, (0.0, 1.0))]
    assert "P(1,1,0)" not in names


def test_flanks_that_do_not_rebound_have_no_rattle_of_one_impact():
    machine = Machine(
        damping=0.02, eccentricity=5e-3, half_backlash=0.5, restitution=0.0
    )
    conditions = single_impact(machine)
    assert conditions.window is conditions.least_play is None
    assert not any(motion.physical for motion in simple_rattle(machine))


@pytest.mark.parametrize("seed", range(10))
def test_equal_shafts_in_parts_have_the_same_conditions(seed):
    machine = replace(random_machine(seed), drive=1.0)
    whole = single_impact(machine)
    parts = single_impact_of_parts(AssemblyIntegrator(Assembly(machine=machine)))
    assert parts.orbit_from == pytest.approx(whole.orbit_from, rel=1e-6)
    assert parts.least_play == pytest.approx(whole.least_play, rel=1e-6)
    assert (parts.window or ()) == pytest.approx(whole.window or (), rel=1e-6)
    for part, flight in zip(parts.flights, whole.flights, strict=True):
        assert part.height == pytest.approx(flight.height, rel=1e-6)
        assert part.meets == flight.meets


@pytest.mark.parametrize("seed", range(10))
def test_flights_of_unequal_shafts_are_those_of_their_matrices(seed):
    random = np.random.default_rng(100 + seed)
    factors = dict(
        zip(
            ("driving_inertia", "driven_inertia", "driving_drag", "driven_drag"),
            random.uniform(0.6, 1.6, 4),
            strict=True,
        )
    )
    machine = replace(random_machine(seed), drive=1.0, restitution=1.0)
    assembly = Assembly(machine=machine, shafts=Shafts(**factors))
    least = impulse_rattle(AssemblyIntegrator(assembly)).min_eccentricity
    machine = replace(machine, eccentricity=least * random.uniform(1.1, 3.0))
    motions = AssemblyIntegrator(replace(assembly, machine=machine))
    conditions, linear = single_impact_of_parts(motions), motions.linear
    rattle = impulse_rattle(motions)
    heights = []
    for time in rattle.times:
        state = rattle.state(time)
        n = state.size // 2
        solution = solve_ivp(
            lambda t, y, n=n: np.append(
                y[n:],
                np.linalg.solve(
                    linear.mass,
                    linear.mean - linear.damping @ y[n:] - linear.stiffness @ y[:n],
                ),
            ),
            *((time, time + 1.0), state),
            t_eval=time + TIMES,
            rtol=1e-11,
            atol=1e-13,
        )
        error = machine.eccentricity * np.cos(TURN * solution.t)
        gap = machine.half_backlash - linear.row @ solution.y[:n] - error
        heights.append(float(gap.max()))
    expected = [flight.height for flight in conditions.flights]
    assert sorted(heights) == pytest.approx(sorted(expected), rel=1e-5)
