"""What long runs settle to beside orbits and the attractors of basins."""

from __future__ import annotations

import numpy as np

from lumped.rattle.kernels.settle import CHANGING
from lumped.rattle.long_runs import settled_departures
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import default_speed, find_orbits
from lumped.rattle.return_map import distance, follow, iterate_map_points

SPEEDS = 0.0, 7.0


def machine(damping):
    return Machine(damping=damping, eccentricity=0.1, half_backlash=0.6)


def test_runs_settle_to_all_stable_orbits_and_to_nothing_else():
    departures = settled_departures(machine(0.575), SPEEDS)
    orbits = find_orbits(machine(0.575), 2, SPEEDS)
    stable = [d for orbit in orbits if orbit.stable for d in orbit.departures]
    assert len(stable) == 5
    for departure in stable:
        assert min(distance(departure, other) for other in departures) < 1e-6
    for departure in departures:
        assert min(distance(departure, other) for other in stable) < 1e-6


def test_chaos_fills_a_range_of_speeds():
    speeds = settled_departures(machine(0.6), SPEEDS)[:, 1]
    assert np.unique(np.round(speeds, 2)).size > 20
    assert speeds.min() > 3.7  # none on their way to rest


def test_quiet_ends_leave_nothing():
    assert not settled_departures(machine(0.7), SPEEDS).size


def test_what_was_chaotic_for_long_and_dies_leaves_nothing():
    """Beside the boundary of chaos, where runs leave it after thousands of returns."""
    for damping in np.linspace(0.682, 0.689, 8):
        assert (settled_departures(machine(float(damping)), SPEEDS)[:, 1] > 3.5).all()


def test_what_has_left_chaos_is_not_where_runs_settle():
    """Nor what is on its way to rest, from speeds up to the usual one."""
    which = machine(0.685375)
    departures = settled_departures(which, (0.0, default_speed(which)))
    assert np.isfinite(departures).all()
    assert not departures.size  # all end quietly


def test_slow_transients_are_followed_to_the_end():
    """Those of ten departures a period that attract by 0.02 % a return."""
    departures = settled_departures(machine(0.61), SPEEDS)
    assert np.isfinite(departures).all()
    last = follow(machine(0.61), departures[-1], 30_000)[-20:, 1]
    np.testing.assert_allclose(last[:10], last[10:], atol=1e-6)
    for speed in last:
        assert np.abs(departures[:, 1] - speed).min() < 1e-4


def test_runs_of_low_damping_are_given_what_they_take():
    """Their departures repeat at once, or are chaotic and last."""
    which = Machine(damping=0.01, eccentricity=0.002, half_backlash=0.012)
    departures = settled_departures(which, (0.0, default_speed(which)))
    assert np.isfinite(departures).all()
    repeats = np.array([repeats_in(which, departure, 200) for departure in departures])
    assert repeats.sum() > 10
    others = departures[~repeats]
    later = iterate_map_points(which, others[:: len(others) // 5 + 1], 10_000)
    assert (later.period == CHANGING).all()


def repeats_in(which: Machine, departure, count: int) -> bool:
    later = follow(which, departure, count + 1)[1:]
    return min(distance(departure, other) for other in later) < 1e-5


def test_long_runs_from_any_speed_are_those_of_the_machine():
    """From 1e6 rad per turn a run is not settled in all its returns."""
    machine = Machine(damping=0.6, eccentricity=0.1, half_backlash=0.6)
    wide = settled_departures(machine, (0.0, 1e6))
    assert wide[:, 1].max() < 7.0
    usual = settled_departures(machine, (0.0, machine.fastest))
    np.testing.assert_array_equal(wide, usual)
