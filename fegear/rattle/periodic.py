"""Motions of a machine that repeat, stable or not."""

from __future__ import annotations

from typing import Any

from fegear.rattle.machines import NamedMachine, figures_of
from lumped.rattle.orbits import find_orbits


def periodic_summary(
    named: NamedMachine, departures: int, velocity: tuple[float, float]
) -> dict[str, Any]:
    """Orbits of up to so many departures a period, plain values ready for JSON.

    velocity : lowest and highest speed of departures [rad per turn]
    """
    found = find_orbits(named.machine, departures, velocity)
    return {
        "machine": named.name,
        **figures_of(named.machine),
        "departures": departures,
        "velocity_rad_per_turn": list(velocity),
        "orbits": [
            {
                "name": orbit.name,
                "turns": orbit.turns,
                "stable": orbit.stable,
                "largest_multiplier": max(map(abs, orbit.multipliers)),
                "departures": [list(each) for each in orbit.departures],
            }
            for orbit in found
        ],
    }
