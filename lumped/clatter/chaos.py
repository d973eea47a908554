"""Largest Lyapunov exponent of a run and the correlation dimension of its impacts."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lumped.clatter.groups import Group
from lumped.clatter.runs import State, move

Array = NDArray[np.float64]
NEIGHBOUR = 1e-7  # of the plays: distance that a neighbour is kept at
MET = 1e-5  # of this distance, which is left of round-off
WINDOW = 10  # impacts next to each other in time that are no neighbours (Theiler 1986)
MOST_POINTS = 4000
LEAST_POINTS = 1000
UNSURE = 0.5  # of a dimension: no scaling is found


def lyapunov_exponent(group: Group, start: State, periods: int) -> float:
    """Largest one [1/s] of the motion at every period, of a neighbour kept close.

    The distance is of plays and of speeds in periods, over the plays. NaN for a signal
    that does not repeat, minus infinity where both meet: in contact that holds all of
    its plays a wheel forgets where it came from. Benettin, Galgani, Strelcyn (1976).
    """
    if math.isfinite(group.excitation.lasts):
        return math.nan
    period, rows = group.excitation.period, group.rows
    play = np.array([each.play for each in group.freedoms])
    scale = np.concatenate([play, play])
    state, other = start.copy(), start.copy()
    other.q = other.q + NEIGHBOUR * np.linalg.solve(rows, -0.5 * play)
    total, first = 0.0, round(start.time)
    for number in range(1, periods + 1):
        for each in (state, other):
            for _ in move(group, each, (first + number) * period):
                pass
        apart = _coordinates(group, other) - _coordinates(group, state)
        size = float(np.linalg.norm(apart / scale))
        if size <= MET * NEIGHBOUR:
            return -math.inf
        total += math.log(size / NEIGHBOUR)
        shift = apart * (NEIGHBOUR / size)
        n = play.size
        other = state.copy()
        other.q = state.q + np.linalg.solve(rows, shift[:n])
        other.v = state.v + np.linalg.solve(rows, shift[n:])
    return total / (periods * period)


def _coordinates(group: Group, state: State) -> Array:
    """Plays and their speeds, without the excitation's part."""
    rows = group.rows
    return np.concatenate([rows @ state.q, rows @ state.v])


def correlation_dimension(phase: Array, speed: Array) -> tuple[float, float]:
    """Correlation dimension of impacts by the phase of the period, from 0 to 1, and the
    speed; and its error.

    The slope of the correlation sum between distances of 0.1 and 10 per cent of the
    pairs, Grassberger and Procaccia (1983), without neighbours in time; the error is
    the largest by which a third of this range departs. NaN of few impacts, and where
    slopes depart by more than `UNSURE`. The last impacts are taken.
    """
    from scipy.spatial import cKDTree

    phase, speed = phase[-MOST_POINTS:], speed[-MOST_POINTS:]
    count = len(phase)
    if count < LEAST_POINTS or not np.ptp(speed) > 0.0:
        return math.nan, math.nan
    angle, height = 2.0 * math.pi * phase, speed / np.std(speed)
    points = np.column_stack([np.cos(angle), np.sin(angle), height])
    tree = cKDTree(points)
    radii = np.geomspace(1e-5, 3.0, 120)
    pairs = tree.count_neighbors(tree, radii).astype(float) - count
    for lag in range(1, WINDOW + 1):
        near = np.linalg.norm(points[lag:] - points[:-lag], axis=1)
        pairs -= 2.0 * np.searchsorted(np.sort(near), radii, "right")
    part = pairs / ((count - WINDOW) * (count - WINDOW - 1.0))
    inside = (part > 1e-3) & (part < 0.1)
    if inside.sum() < 9:
        return math.nan, math.nan
    x, y = np.log(radii[inside]), np.log(part[inside])
    slope = np.polyfit(x, y, 1)[0]
    thirds = zip(np.array_split(x, 3), np.array_split(y, 3), strict=True)
    error = max(abs(np.polyfit(own, of, 1)[0] - slope) for own, of in thirds)
    return (math.nan, math.nan) if error > UNSURE else (float(slope), float(error))
