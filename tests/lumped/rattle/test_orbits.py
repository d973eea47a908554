"""Orbits beside closed forms, printed bifurcations and the attractors of basins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.rattle.machine import Machine
from lumped.rattle.orbits import default_speed, find_orbits
from lumped.rattle.periodic_orbits import simple_rattle

SPEEDS = 0.0, 7.0


def orbits(damping, count=2, **figures):
    machine = Machine(
        **({"damping": damping, "eccentricity": 0.1, "half_backlash": 0.6} | figures)
    )
    return machine, find_orbits(machine, count, SPEEDS)


def named(orbit_list, name):
    return [orbit for orbit in orbit_list if orbit.name == name]


def test_simple_rattle_is_that_of_the_closed_form():
    machine, orbit_list = orbits(0.6, 1)
    exact = {motion.in_phase: motion for motion in simple_rattle(machine)}
    for orbit, motion in zip(
        named(orbit_list, "P(1,1,0)"), (exact[True], exact[False]), strict=True
    ):
        assert orbit.departures[0][0] == pytest.approx(motion.time, abs=1e-9)
        assert orbit.departures[0][1] == pytest.approx(motion.velocity, abs=1e-9)
        assert orbit.stable == motion.in_phase


@pytest.mark.parametrize("restitution", [1.0, 0.95])
def test_multipliers_take_what_damping_and_impacts_take(restitution):
    """Their product is e^(-delta m) r^2 for each impact, Liouville's theorem."""
    _, orbit_list = orbits(0.55, restitution=restitution)
    assert len(orbit_list) >= 3
    for orbit in orbit_list:
        impacts = orbit.itinerary.upper + orbit.itinerary.lower
        exact = math.exp(-0.55 * orbit.itinerary.turns) * restitution ** (2 * impacts)
        product = orbit.multipliers[0] * orbit.multipliers[1]
        assert product == pytest.approx(exact, rel=1e-8)


def test_two_departures_a_turn_end_in_the_printed_saddle_node():
    """Figure 3.13: at a damping of 0.5997."""
    assert [o.stable for o in named(orbits(0.5996)[1], "P(1,2,0)")] == [True, False]
    assert not named(orbits(0.5998)[1], "P(1,2,0)")


def test_two_turns_with_one_lower_impact_double_where_printed():
    """Figure 3.14: at a damping of 0.5818 or 0.5819."""
    for damping, stable in ((0.5810, True), (0.5826, False)):
        (orbit,) = named(orbits(damping)[1], "P(2,2,1)")
        assert orbit.stable == stable
        assert orbit.multipliers[1].real < 0.0


def test_stiff_flanks_have_the_orbits_of_impacts():
    _, exact = orbits(0.575, 1)
    _, stiff_orbits = orbits(0.575, 1, stiffness=1e8)
    assert {o.name for o in exact} <= {o.name for o in stiff_orbits}
    for orbit in exact:
        near = min(
            np.abs(np.subtract(orbit.departures[0], other.departures[0])).max()
            for other in named(stiff_orbits, orbit.name)
        )
        assert near < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("highest", [100.0, 1e4, 1e9])
def test_wide_limits_of_speed_hide_no_orbit(highest):
    machine, reference = orbits(0.6)
    orbit_list = find_orbits(machine, 2, (0.0, highest))
    assert [orbit.name for orbit in orbit_list] == [orbit.name for orbit in reference]
    assert not find_orbits(machine, 2, (machine.fastest, highest + 100.0))


def test_a_lower_flank_out_of_reach_hides_no_orbit():
    """However far it is: the motions that miss it stay the same."""
    orbit_lists = []
    for half_backlash in (1e3, 1e9):
        machine, _ = orbits(0.6, 1, half_backlash=half_backlash)
        orbit_lists.append(find_orbits(machine, 2, (0.0, default_speed(machine))))
    near, far = orbit_lists
    assert [orbit.name for orbit in near] == ["P(1,1,0)", "P(1,1,0)"]
    for one, two in zip(near, far, strict=True):
        assert one.departures[0] == pytest.approx(two.departures[0], rel=1e-9)
