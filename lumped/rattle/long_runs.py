"""Departures of the motions that remain after long runs, by brute force."""

from __future__ import annotations

import math

import numpy as np

from lumped.common.array_types import Array, Indices
from lumped.rattle.attractors import DEFAULT_SETTINGS, classify_attractors
from lumped.rattle.kernels.settle import CHANGING, STICKING, UNKNOWN
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import (
    MAP_POINT_TOL,
    follow,
    iterate_map_points,
    settling_returns,
)

STARTS_PER_SIDE = 6  # departures per side of the grid from which runs start
# Returns before motions are classified; a damping of 2e-4 needs them
MAX_RETURNS = 200_000
CHAOTIC_DEPARTURES = 60  # departures that are stored of a motion that never repeats


def settled_departures(machine: Machine, velocity: tuple[float, float]) -> Array:
    """Times and speeds (d, 2) of departures of all motions that a grid of starts leads
    to.

    Quiet motions have none; motions that come to rest have the first ones after that;
    chaotic motions have CHAOTIC_DEPARTURES departures of each run. The last rows are
    NaN, one for each run that has not settled.

    velocity : lowest and highest speed of the starts [rad per turn]; runs that start
        faster than forcing permits would remain transient
    """
    fractions = (np.arange(STARTS_PER_SIDE) + 0.5) / STARTS_PER_SIDE
    low, high = np.minimum(velocity, machine.fastest)
    speeds = low + fractions * (high - low)
    starts = np.stack(np.meshgrid(fractions, speeds), axis=-1).reshape(-1, 2)
    iterations = min(settling_returns(machine), MAX_RETURNS)
    period, end = _settled(machine, iterations, starts)
    count = np.where(
        (period == CHANGING) | (period == STICKING), CHAOTIC_DEPARTURES, period
    )
    repeats = count > 0
    paths = [
        follow(machine, departure, returns)[:, :2]
        for departure, returns in zip(
            end[repeats], count[repeats].tolist(), strict=True
        )
    ]
    departures = np.vstack([np.empty((0, 2)), *paths])
    departures = departures[
        np.isfinite(departures).all(axis=1) & (departures[:, 1] > 0.0)
    ]
    departures[:, 0] %= 1.0
    _, first = np.unique(
        np.round(departures / MAP_POINT_TOL), axis=0, return_index=True
    )
    unsettled = np.full((int(np.sum(period == UNKNOWN)), 2), math.nan)
    return np.vstack([departures[np.sort(first)], unsettled])


def _settled(machine: Machine, iterations: int, starts: Array) -> tuple[Indices, Array]:
    """Period and end of runs, see `Settled`; only chaotic ones are CHANGING."""
    settled = iterate_map_points(machine, starts, iterations)
    _, motion, settled = classify_attractors(machine, iterations, settled)
    period, _, end = settled
    period[motion < 0] = UNKNOWN
    # transients may depart from the same region as chaotic motions
    changing = np.flatnonzero(period == CHANGING)
    later = iterate_map_points(machine, end[changing], DEFAULT_SETTINGS.late_returns)
    ended = later.period != CHANGING
    period[changing[ended]], end[changing[ended]] = (
        later.period[ended],
        later.end[ended],
    )
    return period, end
