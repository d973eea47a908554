"""Where two relieved involutes touch when one gear turns: points, angles, no kernel.

The driver's centre is the origin, the driven gear's lies on the x axis and is held; the
driver turns counter-clockwise. Where material is removed, the flank is at every radius
that of a tooth turned back by depth over base radius: the tip circle stays. While the
driver turns, each of its points keeps its radius: it meets the driven flank where that
has the same radius about the driver's centre. The least of all angles until then is the
one that closes the pair; it may be at a tip corner or where a relief begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lumped.common.array_types import Array

POINTS, ZOOMS = 2001, 6


class Flank(NamedTuple):
    """base_radius, tip_roll, lowest_roll : [m], roll lengths s = sqrt(r^2 - rb^2)
    depth : material removed at roll lengths (n,) [m]
    """

    base_radius: float
    tip_roll: float
    lowest_roll: float
    depth: Callable[[Array], Array]


def relief_depth(magnitude: float, start: float, end: float, power: float) -> Callable:
    """Depth [m] that grows from 0 at a roll length to the magnitude at another."""

    def depth(s: Array) -> Array:
        return magnitude * np.maximum((s - start) / (end - start), 0.0) ** power

    return depth


def closing_way(
    driver: Flank, driven: Flank, center_distance: float, roll: float
) -> float:
    """Way [m] of the driver's base circle until the pair touches.

    roll : the driver's roll length where unmodified flanks would touch [m]
    """
    bases = driver.base_radius + driven.base_radius
    angle = math.acos(bases / center_distance)
    mate_roll = center_distance * math.sin(angle) - roll
    along = np.array([math.sin(angle), math.cos(angle)])
    foot = np.array([math.cos(angle), -math.sin(angle)])

    def turn(t: Array) -> Array:
        """Rotation of the driver until it meets the driven flank's points (n,)
        [rad].
        """
        points = -driven.base_radius * foot - t[:, None] * along
        back = mate_roll - t - driven.depth(t)
        points = _turned(points, back / driven.base_radius)
        points[:, 0] += center_distance
        s = np.sqrt((points**2).sum(axis=1) - driver.base_radius**2)
        driver_points = driver.base_radius * foot + s[:, None] * along
        driver_points = _turned(
            driver_points, (roll - s - driver.depth(s)) / driver.base_radius
        )
        x, y = driver_points.T
        rotation = np.arctan2(
            x * points[:, 1] - y * points[:, 0], x * points[:, 0] + y * points[:, 1]
        )
        inside = (s <= driver.tip_roll) & (s >= driver.lowest_roll)
        return np.where(inside, rotation, np.inf)

    return driver.base_radius * _least(turn, driven.lowest_roll, driven.tip_roll)


def _least(function: Callable[[Array], Array], low: float, high: float) -> float:
    """Least value on ever finer grids around the best point."""
    for _ in range(ZOOMS):
        grid = np.linspace(low, high, POINTS)
        with np.errstate(invalid="ignore"):  # beyond the mate's base circle
            values = function(grid)
        best = int(np.nanargmin(values))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, POINTS - 1)]
    return float(values[best])


def _turned(points: Array, angle: Array) -> Array:
    """Points (n, 2) turned counter-clockwise by angles (n,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = points.T
    return np.stack([c * x - s * y, s * x + c * y], axis=1)
