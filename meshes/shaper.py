"""Shaper cutter: the pinion with rounded tips that cuts an internal gear.

Lengths are in metres, angles in radians. The cutter has no profile shift.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from meshes.involute import Involute, inverse_involute, involute


@dataclass(frozen=True, kw_only=True)
class ShaperCutter(Involute):
    """Cutter of an internal gear, at the centre distance without backlash.

    ring_teeth : of the ring
    center_distance : of ring and cutter
    tip_radius : outer radius of the cutter
    rounding : radius of its tips, which cut the fillet
    """

    ring_teeth: int
    center_distance: float
    tip_radius: float
    rounding: float

    @property
    def cutting_angle(self) -> float:
        """Pressure angle of ring and cutter [rad]."""
        base = self.module * math.cos(self.pressure_angle) / 2.0
        return math.acos((self.ring_teeth - self.teeth) * base / self.center_distance)

    @property
    def line_of_action(self) -> float:
        """Distance between the points of tangency of both base circles."""
        return self.center_distance * math.sin(self.cutting_angle)

    @property
    def base_half_angle(self) -> float:
        """Half the angle of its tooth on the base circle."""
        return half_angle(self.teeth, self.pressure_angle)

    @property
    def center_radius(self) -> float:
        """Distance of the centre of the rounding from that of the cutter."""
        return self.tip_radius - self.rounding

    @property
    def center_roll_length(self) -> float:
        """Roll length of the centre of the rounding; 0 within the base circle."""
        return math.sqrt(max(0.0, self.center_radius**2 - self.base_radius**2))

    @property
    def flank_roll_length(self) -> float:
        """Roll length up to which the flank is an involute."""
        return self.center_roll_length + self.rounding

    @property
    def center_angle(self) -> float:
        """Angle of the centre of the rounding from the tooth axis.

        It lies on an involute that is inside that of the flank by the rounding. Below 0
        the rounding does not fit the tip.
        """
        roll = self.center_roll_length / self.base_radius
        half = self.base_half_angle - self.rounding / self.base_radius
        return half - (roll - math.atan(roll))

    @property
    def pointed_tip_radius(self) -> float:
        """Outer radius at which its sharp tip has no land."""
        return self.base_radius / math.cos(inverse_involute(self.base_half_angle))

    @property
    def widest_rounding(self) -> float:
        """Rounding of a tip without a land, 0 where the tip is pointed."""
        from dataclasses import replace

        from scipy.optimize import brentq

        def angle(rounding: float) -> float:
            return replace(self, rounding=rounding).center_angle

        widest = self.tip_radius - self.base_radius
        if not angle(0.0) > 0.0:
            return 0.0
        if angle(widest) > 0.0:
            return widest
        return float(brentq(angle, 0.0, widest, xtol=1e-15, rtol=1e-15))


def half_angle(teeth: int, pressure_angle: float) -> float:
    """Half the angle on the base circle of a tooth that fills half its pitch."""
    return 0.5 * math.pi / teeth + involute(pressure_angle)


class ThickTooth(ValueError):
    """No cutter cuts so thick a tooth; excess : of the reference arc [m]."""

    def __init__(self, teeth: int, excess: float) -> None:
        super().__init__(f"no cutter of {teeth} teeth cuts so thick a tooth")
        self.excess = excess


def shaper_cutter(
    ring: Involute, base_half_angle: float, root_radius: float, teeth: int
) -> ShaperCutter:
    """Cutter of a ring, with sharp tips; ThickTooth where the teeth are too thick.

    base_half_angle, root_radius : of the ring, both negative
    """
    rb = 0.5 * ring.module * teeth * math.cos(ring.pressure_angle)
    filled = rb * (half_angle(teeth, ring.pressure_angle) - math.pi / teeth)
    bases = ring.base_radius + rb
    value = (filled + ring.base_radius * base_half_angle) / bases
    if not value > 0.0:
        thin = -filled / ring.base_radius  # at which the cutter would have no tip
        angle = base_half_angle - thin
        raise ThickTooth(teeth, 2.0 * ring.reference_radius * angle)
    distance = -bases / math.cos(inverse_involute(value))
    return ShaperCutter(
        teeth=teeth,
        module=ring.module,
        pressure_angle=ring.pressure_angle,
        ring_teeth=ring.teeth,
        center_distance=distance,
        tip_radius=-root_radius - distance,
        rounding=0.0,
    )
