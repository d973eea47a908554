"""Departures from the upper flank, the motions that follow them, and their names.

A departure is the time [turns] and the speed [rad per turn] at which the teeth leave
the upper flank.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lumped.common.array_types import Array, Indices
from lumped.rattle.kernels import settle as kernel
from lumped.rattle.machine import Machine

MAP_POINT_TOL = 1e-6  # distance of departures on one orbit
DEFAULT_RETURNS = 1499  # returns in section 3.3 of the source


class Settled(NamedTuple):
    """Result of following c departures: period in returns (c,), returns until it was
    known (c,), and the last departure (c, 2); see `settle`."""

    period: Indices
    returns: Indices
    end: Array


def iterate_map_points(
    machine: Machine, departures: Array, iterations: int, stop_early: bool = True
) -> Settled:
    """Follow departures (c, 2), times and speeds, until they settle."""
    time, speed = np.ascontiguousarray(departures.T)
    outcomes = np.empty((time.size, 2), np.int64)
    end = np.empty((time.size, 2))
    kernel.settle_cells(
        machine.arrays, time, speed, iterations, stop_early, outcomes, end
    )
    return Settled(outcomes[:, 0], outcomes[:, 1], end)


def settling_returns(machine: Machine) -> int:
    """Returns in which a transient decays, at least DEFAULT_RETURNS.

    In the play and on flanks a transient decays per turn at half the damping or faster,
    and a return of a lasting motion takes about a turn.
    """
    turns = 2.0 * math.log(1.0 / kernel.DEPARTURE_TOL) / machine.damping
    return max(DEFAULT_RETURNS, 100 * math.ceil(turns / 100.0))


def follow(machine: Machine, departure: Sequence[float] | Array, count: int) -> Array:
    """Path (count, 3) from a departure on: time, speed, and the number of impacts on
    the lower flank before the next departure; NaN once the flanks stay together."""
    path = np.full((count, 3), math.nan)
    kernel.iterate_map(machine.arrays, departure[0], departure[1], count, path)
    return path


def distance(one: Sequence[float] | Array, two: Sequence[float] | Array) -> float:
    """Distance of two departures, modulo whole turns."""
    turn = one[0] - two[0]
    return float(abs(turn - round(turn)) + abs(one[1] - two[1]))


class Itinerary(NamedTuple):
    """Indices that name a motion P(m, n+, n-): turns of a period, departures from the
    upper flank and impacts on the lower one in it."""

    turns: int
    upper: int
    lower: int

    @property
    def name(self) -> str:
        return f"P({self.turns},{self.upper},{self.lower})"


def itinerary(path: Array) -> Itinerary:
    """Itinerary of a path that ends where its motion begins to repeat; see `follow`."""
    turns = round(path[-1, 0] - path[0, 0])
    return Itinerary(turns, len(path) - 1, int(path[:-1, 2].sum()))
