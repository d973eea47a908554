"""What long runs settle to, by brute force: departures of the motions that last."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lumped.rattle.departures import follow, settle_departures
from lumped.rattle.kernels.settle import CHANGING, STICKING
from lumped.rattle.machine import Machine

Array = NDArray[np.float64]
STARTS = 6  # a side of the grid of departures from which runs start
ITERATIONS = 1499  # returns after which they count as settled
KEPT = 60  # departures of a motion that changes for ever
ALIKE = 1e-6  # distance of departures that are one


def settled_departures(machine: Machine, velocity: tuple[float, float]) -> Array:
    """Times and speeds (d, 2) of departures of all motions that a grid of starts
    settles to; none of quiet ones, of those that come to rest the first ones after it.

    velocity : lowest and highest speed of the starts [rad per turn]; from faster ones
        than forcing can give, runs would only be on their way
    """
    place = (np.arange(STARTS) + 0.5) / STARTS
    low, high = np.minimum(velocity, machine.fastest)
    speeds = low + place * (high - low)
    starts = np.stack(np.meshgrid(place, speeds), axis=-1).reshape(-1, 2)
    settled = settle_departures(machine, starts, ITERATIONS)
    changing = settled.period == CHANGING
    # those that are quiet in the end have been on their way only
    later = settle_departures(machine, settled.end[changing], ITERATIONS)
    counts, ends = settled.period.copy(), settled.end.copy()
    counts[changing] = np.where(later.period == CHANGING, KEPT, later.period)
    ends[changing] = later.end
    paths = [
        follow(machine, end, count)[:, :2]
        for end, count in zip(ends, counts.tolist(), strict=True)
        if count > 0
    ]
    for end in np.unique(ends[counts == STICKING], axis=0):
        paths.append(follow(machine, end, KEPT)[:, :2])
    found = np.vstack([np.empty((0, 2)), *paths])
    found = found[np.isfinite(found).all(axis=1) & (found[:, 1] > 0.0)]
    found[:, 0] %= 1.0
    _, first = np.unique(np.round(found / ALIKE), axis=0, return_index=True)
    return np.asarray(found[np.sort(first)])
