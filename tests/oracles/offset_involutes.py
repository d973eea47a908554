"""Rigid involute gears on displaced centres, brought into touch by search.

Shares no formula with `fegear.contact.offset_centers`: the driver is turned until the
closest of its flank points lies on the driven gear's flank.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq, minimize_scalar


def involute(alpha: float) -> float:
    return math.tan(alpha) - alpha


def driver_lead(pair, rotated, driver=(0.0, 0.0), driven=(0.0, 0.0)) -> float:
    """How far the driver is ahead where flanks touch [m on its base circle].

    rotated : rotation of a pair of teeth in contact from the pitch point [base pitches]
    driver, driven : displacements of the centres [m], x toward the driven gear, the
        driver rotating counter-clockwise
    """
    r1, r2 = pair.driver.base_radius, pair.driven.base_radius
    alpha = pair.operating_pressure_angle
    turn1 = rotated * pair.driver.pitch_angle
    turn2 = rotated * pair.driven.pitch_angle
    between = np.array([pair.center_distance, 0.0]) + np.array(driven) - driver

    def past_flank(roll: float, lead: float) -> float:
        """How far a driver's point is past the driven flank, on its base circle."""
        base = involute(alpha) + turn1 + lead
        tangent = base - roll
        point = r1 * np.array(
            [
                math.cos(tangent) - roll * math.sin(tangent),
                math.sin(tangent) + roll * math.cos(tangent),
            ]
        )
        x, y = between - point  # in the frame turned by half a turn
        radius = math.hypot(x, y)
        mate_roll = math.sqrt((radius / r2) ** 2 - 1.0)
        # direction of the driven involute's point at that radius
        start = involute(alpha) - turn2
        flank = start - (mate_roll - math.atan(mate_roll))
        return math.atan2(y, x) - flank

    def overlap(lead: float) -> float:
        low, high = 0.3 * math.tan(alpha), 2.0 * math.tan(alpha)
        best = minimize_scalar(
            lambda roll: past_flank(roll, lead),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-12},
        )
        return float(best.fun)

    return r1 * brentq(overlap, -0.01, 0.01, xtol=1e-14)
