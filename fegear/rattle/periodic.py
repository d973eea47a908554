"""Motions of a machine that repeat, stable or not."""

from __future__ import annotations

from typing import Any

from fegear.rattle.machines import NamedMachine, figures_of
from lumped.rattle.departures import apart
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import Orbit, find_orbits
from lumped.rattle.periodic import (
    has_closed_form,
    least_eccentricity,
    simple_rattle,
    two_sided_rattle,
)
from lumped.rattle.sticking import Sticking, sticking_motions


def periodic_summary(
    named: NamedMachine, departures: int, velocity: tuple[float, float]
) -> dict[str, Any]:
    """Orbits of up to so many departures a period, plain values ready for JSON.

    velocity : lowest and highest speed of departures [rad per turn]
    """
    machine = named.machine
    known = has_closed_form(machine)
    return {
        **named.heading,
        **figures_of(machine),
        "departures": departures,
        "velocity_rad_per_turn": list(velocity),
        "least_eccentricity_of_P(1,1,0)_rad": (
            least_eccentricity(machine) if known else None
        ),
        "orbits": [
            {
                "name": orbit.name,
                "turns": orbit.itinerary.turns,
                "stable": orbit.stable,
                "largest_multiplier": max(map(abs, orbit.multipliers)),
                "departures": [list(each) for each in orbit.departures],
                "from_construction": _from_construction(machine, orbit),
            }
            for orbit in find_orbits(machine, departures, velocity)
        ]
        + [_resting(motion) for motion in sticking_motions(machine)],
    }


def _resting(motion: Sticking) -> dict[str, Any]:
    """One that comes to rest, in the same words: it forgets all changes."""
    return {
        "name": motion.name,
        "turns": motion.turns,
        "stable": True,
        "largest_multiplier": 0.0,
        "departures": [list(motion.point)],
        "from_construction": None,
    }


def _from_construction(machine: Machine, orbit: Orbit) -> float | None:
    """Distance of the departure from that of a constructed one, where there is one."""
    turns, upper, lower = orbit.itinerary
    if upper > 1 or lower > 1 or not has_closed_form(machine):
        return None
    construct = two_sided_rattle if lower else simple_rattle
    (departure,) = orbit.departures
    exact = construct(machine, turns)
    return min((apart(departure, (s.time, s.velocity)) for s in exact), default=None)
