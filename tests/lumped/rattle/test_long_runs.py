"""What long runs settle to beside orbits and the attractors of basins."""

from __future__ import annotations

import numpy as np

from lumped.rattle.departures import apart
from lumped.rattle.long_runs import settled_departures
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import find_orbits

SPEEDS = 0.0, 7.0


def machine(damping):
    return Machine(damping=damping, eccentricity=0.1, half_backlash=0.6)


def test_runs_settle_to_all_stable_orbits_and_to_nothing_else():
    found = settled_departures(machine(0.575), SPEEDS)
    orbits = find_orbits(machine(0.575), 2, SPEEDS)
    stable = [d for orbit in orbits if orbit.stable for d in orbit.departures]
    assert len(stable) == 5
    for each in stable:
        assert min(apart(each, other) for other in found) < 1e-6
    for each in found:
        assert min(apart(each, other) for other in stable) < 1e-6


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


def test_long_runs_from_any_speed_are_those_of_the_machine():
    """From 1e6 rad per turn a run is not settled in all its returns."""
    machine = Machine(damping=0.6, eccentricity=0.1, half_backlash=0.6)
    wide = settled_departures(machine, (0.0, 1e6))
    assert wide[:, 1].max() < 7.0
    usual = settled_departures(machine, (0.0, machine.fastest))
    np.testing.assert_array_equal(wide, usual)
