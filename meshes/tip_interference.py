"""Tip interference of a gear in a ring: tips that meet beside the path of contact."""

from __future__ import annotations

import math
from dataclasses import replace

from meshes.gear import SpurGear, bisected
from meshes.involute import involute
from meshes.shaper import ShaperCutter


def corner_clearance(
    gear: SpurGear | ShaperCutter, ring: SpurGear, center_distance: float
) -> float:
    """Arc on the ring's tip circle between two tip corners where they pass [m].

    The corner of the gear's loaded flank leaves the ring's tip circle where both tip
    circles cross; the ring's next corner is ahead of it by this arc, and behind where
    it is negative: teeth then meet. Infinite where the circles do not cross. Its source
    is Colbourne, The Geometry of Involute Gears (1987), chapter 8, derived anew.
    """
    tip, ring_tip, a = gear.tip_radius, -ring.tip_radius, center_distance
    cosine = (ring_tip**2 - tip**2 - a**2) / (2.0 * tip * a)
    if not -1.0 < cosine < 1.0:
        return math.inf
    direction = math.acos(cosine)
    ring_direction = math.acos((ring_tip**2 + a**2 - tip**2) / (2.0 * ring_tip * a))
    operating = involute(math.acos(-(gear.base_radius + ring.base_radius) / a))
    turned = direction + involute(math.acos(gear.base_radius / tip)) - operating
    ring_turned = turned * gear.teeth / ring.teeth
    to_corner = operating - involute(math.acos(ring.base_radius / ring.tip_radius))
    return ring_tip * (ring_turned + to_corner - ring_direction)


def largest_tip(gear: SpurGear, ring: SpurGear, center_distance: float) -> float:
    """Tip radius of the gear up to which tips do not meet [m]."""

    def passes(tip_radius: float) -> bool:
        shorter = replace(gear, tip_radius=tip_radius)
        return corner_clearance(shorter, ring, center_distance) > 0.0

    return bisected(passes, gear.form_radius, gear.tip_radius)
