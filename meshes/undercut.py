"""Where the fillet of an undercut tooth crosses its involute.

A rack whose straight flank reaches below the base circle's tangent point cuts away the
foot of the involute. The swept boundary then turns back at the base circle, and the
trochoid of the rack's rounded tip crosses the involute above it: the tooth has a corner
there, from which the trochoid leads into the tooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from meshes.gear import SpurGear

MAX_BISECTIONS = 200  # halves an angle down to round-off
POINTS = 200  # of the fillet, for its least distance from the tooth axis


def fillet_at(gear: SpurGear, normal_angle: float) -> tuple[float, float]:
    """Radius [m] and clockwise angle from the tooth axis [rad] of a fillet point.

    That of `meshes.profile.fillet_points`, as numbers.
    """
    half_width, depth = gear.rack_tip_center
    r, rho = gear.reference_radius, gear.rack_tip_radius
    rolled = half_width - depth * math.tan(normal_angle)
    x = rolled - half_width - rho * math.sin(normal_angle)
    y = r - depth - rho * math.cos(normal_angle)
    angle = math.atan2(x, y) - rolled / r + math.pi / gear.teeth
    return math.hypot(x, y), angle


@lru_cache(maxsize=256)
def involute_crossing(gear: SpurGear) -> tuple[float, float]:
    """Roll length [m] and normal angle of the fillet [rad] where it crosses the flank.

    Along the fillet the radius grows with the normal angle. Its angle from the involute
    of the same radius is negative, within the tooth, at the base circle, and positive
    at its end, which touches the other branch of the involute.
    """
    rb, steepest = gear.base_radius, 0.5 * math.pi - gear.pressure_angle

    def is_below_base(beta: float) -> bool:
        return fillet_at(gear, beta)[0] < rb

    def is_in_tooth(beta: float) -> bool:
        radius, angle = fillet_at(gear, beta)
        return angle < gear.half_angle(max(radius, rb))

    low = _last_where(is_below_base, 0.0, steepest)
    beta = _last_where(is_in_tooth, low, steepest)
    radius = max(fillet_at(gear, beta)[0], rb * (1.0 + 1e-15))
    return math.sqrt((radius - rb) * (radius + rb)), beta


def _last_where(condition: Callable[[float], bool], low: float, high: float) -> float:
    """Angle up to which a condition holds that holds at the low end only."""
    for _ in range(MAX_BISECTIONS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if condition(middle) else (low, middle)
    return low


@lru_cache(maxsize=256)
def waist(gear: SpurGear) -> float:
    """Least thickness of an undercut tooth at its foot [m]; negative if cut through."""
    top = involute_crossing(gear)[1]
    points = (fillet_at(gear, top * i / POINTS) for i in range(POINTS + 1))
    return 2.0 * min(radius * math.sin(angle) for radius, angle in points)
