"""Periodic motions, stable or not: fixed points of the return map, by Newton."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lumped.rattle.arcs import arcs_of, linearise_arcs
from lumped.rattle.kernels import arcs as kernel
from lumped.rattle.machine import Machine
from lumped.rattle.periodic_orbits import (
    has_closed_form,
    simple_rattle,
    two_sided_rattle,
)
from lumped.rattle.return_map import (
    MAP_POINT_TOL,
    Itinerary,
    distance,
    follow,
    itinerary,
)

# Largest number of arcs of a return in the search for an orbit
MAX_ARCS_PER_RETURN = 32
STARTS_PER_SIDE = 24  # departures per side of the grid from which the search starts
FAST_STARTS = 6  # rows of the grid for speeds that are higher than usual
MAX_TURNS = 4  # largest number of turns of constructed motions
MIN_SPEED_RATIO = 3e-4  # least speed of a departure, over that of P(1,1,0)


@dataclass(frozen=True)
class Orbit:
    """Motion P(m, n+, n-), described by its departures.

    departures : (time in turns from 0 to 1, speed) of each, the fastest first
    multipliers : Floquet multipliers of the whole orbit
    """

    itinerary: Itinerary
    departures: tuple[tuple[float, float], ...]
    multipliers: tuple[complex, complex]

    @property
    def name(self) -> str:
        return self.itinerary.name

    @property
    def stable(self) -> bool:
        return max(map(abs, self.multipliers)) < 1.0


def default_speed(machine: Machine) -> float:
    """Usual speed: twice that of P(1,1,0), plus the speed that takes gears through the
    play and back in a turn, if the forcing suffices."""
    return min(2.0 * machine.speed + 4.0 * machine.half_backlash, machine.fastest)


def find_orbits(
    machine: Machine, max_departures: int, velocity: tuple[float, float]
) -> list[Orbit]:
    """Orbits with a limited number of departures, sorted by name, stable ones first.

    These are all orbits that a grid of starts and the constructed P(m, 1, n-) lead to;
    more may exist.

    velocity : lowest and highest speed of the departures on the grid
    """
    machine = _with_play_in_reach(machine)
    orbits: list[Orbit] = []
    for count in range(1, max_departures + 1):
        for orbit in _from_starts(machine, count, velocity):
            if not any(_is_same_orbit(orbit, existing) for existing in orbits):
                orbits.append(orbit)
    return sorted(orbits, key=_rank)


def _with_play_in_reach(machine: Machine) -> Machine:
    """Machine with the same orbits but less backlash: a lower flank that no departure
    reaches may be anywhere, and positions are resolved to 16 digits of the backlash."""
    max_displacement = machine.fastest / machine.damping + sum(
        map(abs, machine.forced(0.0))
    )
    return replace(
        machine, half_backlash=min(machine.half_backlash, 2.0 * max_displacement)
    )


def _rank(orbit: Orbit) -> tuple[int, int, int, bool, tuple[float, float]]:
    turns, count, lower = orbit.itinerary
    return turns, count, lower, not orbit.stable, orbit.departures[0]


def _from_starts(
    machine: Machine, count: int, velocity: tuple[float, float]
) -> Iterator[Orbit]:
    slowest = MIN_SPEED_RATIO * machine.speed
    low, high = max(velocity[0], slowest), velocity[1]
    arcs, change = (
        np.empty((MAX_ARCS_PER_RETURN * count + 1, kernel.N_COLUMNS)),
        np.empty((2, 2)),
    )
    for start in _starts(machine, count, low, high):
        departure = kernel.find_periodic_point(
            machine.arc_arrays, *start, count, slowest, machine.speed, arcs, change
        )
        if low <= departure[1] <= high:
            orbit = _orbit(machine, departure, count)
            if orbit is not None:
                yield orbit


def _starts(
    machine: Machine, count: int, low: float, high: float
) -> Iterator[tuple[float, float]]:
    limit = replace(machine, stiffness=math.inf)
    if count == 1 and has_closed_form(limit):  # some repel the closest neighbours
        for turns in range(1, MAX_TURNS + 1):
            both = simple_rattle(limit, turns) + two_sided_rattle(limit, turns)
            yield from (
                (motion.time, motion.velocity) for motion in both if motion.physical
            )
    for speed in _speeds(machine, low, high):
        yield from (
            ((i + 0.5) / STARTS_PER_SIDE, speed) for i in range(STARTS_PER_SIDE)
        )


def _speeds(machine: Machine, low: float, high: float) -> list[float]:
    """Speeds of starts, equally dense at usual speeds however wide the limits are."""
    usual = max(min(default_speed(machine), high), low)
    parts = (np.arange(STARTS_PER_SIDE) + 0.5) / STARTS_PER_SIDE
    speeds = low + parts * (usual - low) if usual > low else np.empty(0)
    most = min(high, machine.fastest)
    if most > usual:
        fast = (np.arange(FAST_STARTS) + 0.5) / FAST_STARTS
        speeds = np.append(speeds, usual * (most / usual) ** fast)
    return [float(speed) for speed in speeds]


def _orbit(
    machine: Machine, departure: tuple[float, float], count: int
) -> Orbit | None:
    """Orbit at a departure, or None if it repeats sooner or its departures end."""
    path = follow(machine, departure, count + 1)
    if not np.isfinite(path).all():
        return None
    repetitions = [
        n for n in range(1, count) if distance(path[0], path[n]) < MAP_POINT_TOL
    ]
    if repetitions or path[:, 1].min() < MIN_SPEED_RATIO * machine.speed:
        return None
    multipliers = np.linalg.eigvals(linearise_arcs(machine, arcs_of(machine, path)))
    fastest = int(path[:-1, 1].argmax())
    points = np.roll(path[:-1, :2], -fastest, axis=0)
    departures = tuple((float(t % 1.0), float(v)) for t, v in points)
    one, two = sorted(map(complex, multipliers), key=abs)
    itinerary_of_path = itinerary(path)
    if itinerary_of_path.turns < 1:
        return None
    return Orbit(itinerary_of_path, departures, (one, two))


def _is_same_orbit(one: Orbit, two: Orbit) -> bool:
    return one.name == two.name and any(
        distance(one.departures[0], other) < MAP_POINT_TOL for other in two.departures
    )
