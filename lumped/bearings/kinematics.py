"""Rotation of the cage and ball-pass frequencies, by pure rolling.

All are over the rotation of the inner ring; the outer ring is fixed.
"""

from __future__ import annotations

from lumped.bearings.rolling import RollingBearing


def cage_over_shaft(bearing: RollingBearing) -> float:
    """Rotation of the cage."""
    # eq. 6.4 of the multi-mesh source
    return 0.5 * (1.0 - bearing.diameter_ratio)


def ball_pass_over_shaft(bearing: RollingBearing) -> float:
    """Frequency at which elements pass a point of the fixed outer race.

    Under a load that is fixed in space, the stiffness varies with it. The source's
    Z (omega_1 - omega_c) is that of a point of the inner race, see
    `inner_ball_pass_over_shaft`.
    """
    return bearing.elements * cage_over_shaft(bearing)


def inner_ball_pass_over_shaft(bearing: RollingBearing) -> float:
    """Frequency at which elements pass a point of the inner race."""
    return bearing.elements * (1.0 - cage_over_shaft(bearing))


def element_spin_over_shaft(bearing: RollingBearing) -> float:
    """Rotation of an element about its axis, relative to the cage."""
    ratio = bearing.diameter_ratio
    return 0.5 * (1.0 - ratio**2) / ratio
