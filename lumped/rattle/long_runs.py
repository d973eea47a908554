"""What long runs settle to, by brute force: departures of the motions that last."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lumped.rattle.attractors import LATE, sort_departures
from lumped.rattle.departures import follow, settle_departures, settling_returns
from lumped.rattle.kernels.settle import CHANGING, STICKING, UNKNOWN
from lumped.rattle.machine import Machine

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
STARTS = 6  # a side of the grid of departures from which runs start
MOST = 200_000  # returns before motions are told apart; a damping of 2e-4 takes so many
KEPT = 60  # departures of a motion that changes for ever
ALIKE = 1e-6  # distance of departures that are one


def settled_departures(machine: Machine, velocity: tuple[float, float]) -> Array:
    """Times and speeds (d, 2) of departures of all motions that a grid of starts
    settles to; none of quiet ones, of those that come to rest the first ones after it,
    of chaotic ones KEPT of each run. Last a row of NaN for each run that has not
    settled.

    velocity : lowest and highest speed of the starts [rad per turn]; from faster ones
        than forcing can give, runs would only be on their way
    """
    place = (np.arange(STARTS) + 0.5) / STARTS
    low, high = np.minimum(velocity, machine.fastest)
    speeds = low + place * (high - low)
    starts = np.stack(np.meshgrid(place, speeds), axis=-1).reshape(-1, 2)
    iterations = min(settling_returns(machine), MOST)
    period, end = _settled(machine, iterations, starts)
    count = np.where((period == CHANGING) | (period == STICKING), KEPT, period)
    lasts = count > 0
    paths = [
        follow(machine, each, returns)[:, :2]
        for each, returns in zip(end[lasts], count[lasts].tolist(), strict=True)
    ]
    found = np.vstack([np.empty((0, 2)), *paths])
    found = found[np.isfinite(found).all(axis=1) & (found[:, 1] > 0.0)]
    found[:, 0] %= 1.0
    _, first = np.unique(np.round(found / ALIKE), axis=0, return_index=True)
    lost = np.full((int(np.sum(period == UNKNOWN)), 2), math.nan)
    return np.vstack([found[np.sort(first)], lost])


def _settled(machine: Machine, iterations: int, starts: Array) -> tuple[Numbers, Array]:
    """Period and end of runs, see `Settled`; CHANGING are chaotic ones alone."""
    settled = settle_departures(machine, starts, iterations)
    _, motion, settled = sort_departures(machine, iterations, settled)
    period, _, end = settled
    period[motion < 0] = UNKNOWN
    # beside chaotic ones others depart alike that are on their way
    changing = np.flatnonzero(period == CHANGING)
    later = settle_departures(machine, end[changing], LATE)
    ended = later.period != CHANGING
    period[changing[ended]], end[changing[ended]] = (
        later.period[ended],
        later.end[ended],
    )
    return period, end
