"""Generated tooth profile as plane curves.

The tooth frame has its origin on the gear axis, y along the tooth's axis of
symmetry and x to the right; angles are measured clockwise from y. The right
flank is described; the left one is its mirror image. All coordinates are in
metres, with shape (n, 2).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshes.gear import SpurGear
from meshes.internal import InternalGear

Points = NDArray[np.float64]


def polar(radius: ArrayLike, angle: ArrayLike) -> Points:
    """Points (n, 2) at radii and clockwise angles from the tooth axis."""
    radius, angle = np.broadcast_arrays(radius, angle)
    return np.stack([radius * np.sin(angle), radius * np.cos(angle)], axis=-1)


def turn(points: Points, angle: ArrayLike) -> Points:
    """Rotate points (n, 2) clockwise by one angle, or by one angle for each point."""
    x, y = points[..., 0], points[..., 1]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x + s * y, c * y - s * x], axis=-1)


def angle_of(gear: SpurGear, point: Points) -> float:
    """Clockwise angle of a point (2,) from the tooth axis, whose inverse is `polar`."""
    return math.atan2(gear.sign * point[0], gear.sign * point[1])


def flank_points(gear: SpurGear, roll_length: ArrayLike) -> Points:
    """Points of the right involute flank at roll lengths s = sqrt(r^2 - rb^2) (n,)."""
    s, rb = np.asarray(roll_length, float), gear.base_radius
    angle = gear.base_half_angle - (s / rb - np.arctan(s / rb))
    return polar(np.copysign(np.hypot(rb, s), rb), angle)


def flank_tangents(gear: SpurGear, roll_length: ArrayLike) -> Points:
    """Unit tangents of the right flank toward the tip, shape (n, 2)."""
    s, rb = np.asarray(roll_length, float), gear.base_radius
    return polar(np.ones_like(s), gear.base_half_angle - s / rb)


def fillet_points(gear: SpurGear, normal_angle: ArrayLike) -> Points:
    """Points of the right root fillet, the trochoid cut by the rounded rack tip.

    normal_angle : (n,) angle between the profile normal and the radial
        direction of the space at the instant of cutting; 0 where the fillet
        meets the root circle, pi/2 - pressure_angle where it meets the flank, less
        where it cuts off the foot of an undercut one.

    The contact normal passes through the instantaneous centre of rolling
    (Litvin & Fuentes, Gear Geometry and Applied Theory, 2004, section 6.2).
    """
    beta = np.asarray(normal_angle, float)
    if isinstance(gear, InternalGear):
        return _shaped_fillet(gear, beta)
    half_width, depth = gear.rack_tip_center
    across, down, beside = gear.rack_tip_offset(np.sin(beta), np.cos(beta))
    rolled = half_width - depth * np.tan(beta) + beside  # r phi
    center = np.stack(
        [rolled - half_width, np.full_like(beta, gear.reference_radius - depth)], -1
    )
    in_space_frame = turn(
        center - np.stack([across, down], -1), -rolled / gear.reference_radius
    )
    return turn(in_space_frame, 0.5 * gear.pitch_angle)


def _shaped_fillet(gear: InternalGear, beta: NDArray[np.float64]) -> Points:
    """Fillet of an internal gear, the trochoid cut by the cutter's rounded tip.

    The centre of the rounding is where the normal through the instantaneous centre of
    rolling meets its circle about the cutter's centre; ring and cutter turn in the same
    sense.
    """
    cutter, sn, c = gear.cutter, np.sin(beta), np.cos(beta)
    rolling = -gear.base_radius / math.cos(gear.cutting_angle)  # radii of the circles
    cutter_rolling = rolling - cutter.center_distance
    way = np.sqrt(cutter.center_radius**2 - (cutter_rolling * sn) ** 2)
    way -= cutter_rolling * c
    turned = np.arctan2(way * sn, cutter_rolling + way * c) - cutter.center_angle
    depth = way + cutter.rounding
    points = np.stack([-depth * sn, -rolling - depth * c], axis=-1)
    ring_turned = turned * cutter.teeth / gear.teeth
    return turn(points, 0.5 * gear.pitch_angle - ring_turned)


def arc_from_tip(gear: SpurGear, roll_length: ArrayLike) -> NDArray[np.float64]:
    """Arc length along the flank from the tip corner, shape (n,)."""
    s = np.asarray(roll_length, float)
    return 0.5 * (gear.tip_roll_length**2 - s**2) / gear.base_radius


def roll_length_at_arc(gear: SpurGear, arc: ArrayLike) -> NDArray[np.float64]:
    """Inverse of `arc_from_tip`, shape (n,)."""
    squared = gear.tip_roll_length**2 - 2.0 * gear.base_radius * np.asarray(arc, float)
    return np.copysign(np.sqrt(squared), gear.base_radius)


def flank_frame(gear: SpurGear, arc: ArrayLike) -> tuple[Points, Points]:
    """Points (n, 2) and inward normals of the right flank at arcs (n,) from the tip."""
    roll_length = roll_length_at_arc(gear, arc)
    tangent = flank_tangents(gear, roll_length)
    inward = np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1)
    return flank_points(gear, roll_length), inward
