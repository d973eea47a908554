"""Largest Lyapunov exponent of a run and the correlation dimension of its impacts."""

from __future__ import annotations

import math

import numpy as np

from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import State, simulate
from lumped.common.array_types import Array

# Distance at which a neighbour is held, relative to the plays
NEIGHBOUR_DISTANCE = 1e-7
MIN_SEPARATION_RATIO = 1e-5  # part of this distance that remains from round-off
# Impacts next to each other in time that are no neighbours (Theiler 1986)
THEILER_WINDOW = 10
MAX_POINTS = 4000
MIN_POINTS = 1000
MAX_DIMENSION_ERROR = 0.5  # error of a dimension above which there is no scaling


def lyapunov_exponent(group: WheelGroup, start: State, periods: int) -> float:
    """Largest Lyapunov exponent [1/s], from a neighbour that is held close.

    The distance is measured at every period in plays and in speeds per period, relative
    to the plays. The exponent is NaN for a signal that does not repeat, and minus
    infinity if both motions coincide: a wheel that is held in all of its plays loses
    the memory of its initial state. See Benettin, Galgani, Strelcyn (1976).
    """
    if math.isfinite(group.excitation.lasts):
        return math.nan
    period, rows = group.excitation.period, group.rows
    play = np.array([freedom.play for freedom in group.freedoms])
    scale = np.concatenate([play, play])
    state, other = start.copy(), start.copy()
    other.q = other.q + NEIGHBOUR_DISTANCE * np.linalg.solve(rows, -0.5 * play)
    total, first = 0.0, round(start.time)
    for number in range(1, periods + 1):
        for trajectory in (state, other):
            for _ in simulate(group, trajectory, (first + number) * period):
                pass
        separation = _coordinates(group, other) - _coordinates(group, state)
        distance = float(np.linalg.norm(separation / scale))
        if distance <= MIN_SEPARATION_RATIO * NEIGHBOUR_DISTANCE:
            return -math.inf
        total += math.log(distance / NEIGHBOUR_DISTANCE)
        shift = separation * (NEIGHBOUR_DISTANCE / distance)
        n = play.size
        other = state.copy()
        other.q = state.q + np.linalg.solve(rows, shift[:n])
        other.v = state.v + np.linalg.solve(rows, shift[n:])
    return total / (periods * period)


def _coordinates(group: WheelGroup, state: State) -> Array:
    """Plays and their speeds, without the contribution of the excitation."""
    rows = group.rows
    return np.concatenate([rows @ state.q, rows @ state.v])


def correlation_dimension(phase: Array, speed: Array) -> tuple[float, float]:
    """Correlation dimension and its error, of impacts by phase (0 to 1) and speed.

    It is the slope of the correlation sum between distances of 0.1 and 10 per cent of
    the pairs, Grassberger and Procaccia (1983), without neighbours in time. The error
    is the largest deviation of the slope in a third of this range. Both are NaN for few
    impacts and if slopes deviate by more than `MAX_DIMENSION_ERROR`. The last
    impacts are used.
    """
    from scipy.spatial import cKDTree

    phase, speed = phase[-MAX_POINTS:], speed[-MAX_POINTS:]
    count = len(phase)
    if count < MIN_POINTS or not np.ptp(speed) > 0.0:
        return math.nan, math.nan
    angle, height = 2.0 * math.pi * phase, speed / np.std(speed)
    points = np.column_stack([np.cos(angle), np.sin(angle), height])
    tree = cKDTree(points)
    radii = np.geomspace(1e-5, 3.0, 120)
    pairs = tree.count_neighbors(tree, radii).astype(float) - count
    for lag in range(1, THEILER_WINDOW + 1):
        distances = np.linalg.norm(points[lag:] - points[:-lag], axis=1)
        pairs -= 2.0 * np.searchsorted(np.sort(distances), radii, "right")
    correlation_sum = pairs / (
        (count - THEILER_WINDOW) * (count - THEILER_WINDOW - 1.0)
    )
    inside = (correlation_sum > 1e-3) & (correlation_sum < 0.1)
    if inside.sum() < 9:
        return math.nan, math.nan
    x, y = np.log(radii[inside]), np.log(correlation_sum[inside])
    slope = np.polyfit(x, y, 1)[0]
    thirds = zip(np.array_split(x, 3), np.array_split(y, 3), strict=True)
    error = max(
        abs(np.polyfit(third_x, third_y, 1)[0] - slope) for third_x, third_y in thirds
    )
    return (
        (math.nan, math.nan)
        if error > MAX_DIMENSION_ERROR
        else (float(slope), float(error))
    )
