"""Departures from the upper flank: where they lead, and what their motions are called.

A departure is the time [turns] and the speed [rad per turn] at which the upper flank
is left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.rattle.kernels import settle as kernel
from lumped.rattle.machine import Machine

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
RETURNS = 1499  # of section 3.3 of the source


class Settled(NamedTuple):
    """Ends of c departures: period in returns (c,), returns until it was known (c,),
    and the last departure (c, 2); see `settle`.
    """

    period: Numbers
    returns: Numbers
    end: Array


def settle_departures(
    machine: Machine, departures: Array, iterations: int, early: bool = True
) -> Settled:
    """Follow departures (c, 2), times and speeds, to their ends."""
    time, speed = np.ascontiguousarray(departures.T)
    found = np.empty((time.size, 2), np.int64)
    end = np.empty((time.size, 2))
    kernel.settle_cells(machine.arrays, time, speed, iterations, early, found, end)
    return Settled(found[:, 0], found[:, 1], end)


def settling_returns(machine: Machine) -> int:
    """Returns in which a transient fades to what counts as the same, RETURNS at least.

    Of motions in the play and on flanks it fades at half the damping a turn or faster,
    and a return of those that last takes a turn or so.
    """
    turns = 2.0 * math.log(1.0 / kernel.SAME) / machine.damping
    return max(RETURNS, 100 * math.ceil(turns / 100.0))


def follow(machine: Machine, departure: Sequence[float] | Array, count: int) -> Array:
    """Path (count, 3) from a departure on: time, speed, and how often the lower flank
    is met before the next; NaN from where the flanks stay together."""
    path = np.full((count, 3), math.nan)
    kernel.follow(machine.arrays, departure[0], departure[1], count, path)
    return path


def apart(one: Sequence[float] | Array, two: Sequence[float] | Array) -> float:
    """Distance of two departures, whole turns aside."""
    turn = one[0] - two[0]
    return float(abs(turn - round(turn)) + abs(one[1] - two[1]))


class Itinerary(NamedTuple):
    """What a motion P(m, n+, n-) is called after: turns of a period, departures from
    the upper flank and impacts on the lower one in it."""

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
