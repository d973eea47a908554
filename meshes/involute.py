"""The involute function, and what all gears of one rack and number of teeth share."""

from __future__ import annotations

import math
from dataclasses import dataclass


def involute(angle: float) -> float:
    """Involute function inv(angle) = tan(angle) - angle, angles in radians."""
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """Pressure angle [rad] whose involute function is `value` >= 0.

    Newton's method solves t - atan(t) = value for t = tan(angle). The function is
    convex, so that the iteration descends to the root from above.
    """
    t = value + 0.5 * math.pi
    for _ in range(100):
        step = (t - math.atan(t) - value) * (1.0 + t * t) / (t * t)
        t -= step
        if not abs(step) > 1e-15 * t:
            break
    return math.atan(t)


@dataclass(frozen=True, kw_only=True)
class Involute:
    """Properties shared by all gears of one generating rack and number of teeth.

    module : reference pitch diameter over number of teeth [m]
    pressure_angle : pressure angle of the generating rack [rad]
    """

    teeth: int
    module: float
    pressure_angle: float

    @property
    def sign(self) -> int:
        """-1 for internal gears, whose radii are negative, else 1."""
        return 1

    @property
    def reference_radius(self) -> float:
        return 0.5 * self.sign * self.module * self.teeth

    @property
    def base_radius(self) -> float:
        return self.reference_radius * math.cos(self.pressure_angle)

    @property
    def base_pitch(self) -> float:
        return math.pi * self.module * math.cos(self.pressure_angle)

    @property
    def twist(self) -> float:
        """Turn of the teeth per length of the axis, right-handed positive [rad/m]."""
        return 0.0

    @property
    def base_helix_angle(self) -> float:
        """Helix angle on the base cylinder, right-handed positive [rad].

        Positive left-handed on an internal gear, whose base radius is negative.
        """
        return math.atan(self.twist * self.base_radius)

    @property
    def base_helix_cosine(self) -> float:
        """Cosine of that angle, by which normals are inclined; 1 of spur gears."""
        return math.cos(self.base_helix_angle)

    @property
    def helix_cosine(self) -> float:
        """Cosine of the helix angle on the reference cylinder, 1 of spur gears."""
        return math.cos(math.atan(self.twist * self.reference_radius))

    @property
    def normal_module(self) -> float:
        """Module in the normal section, that of the rack [m]."""
        return self.helix_cosine * self.module

    @property
    def section_name(self) -> str:
        """What a length across the axis is called, nothing where there is one alone."""
        return "transverse " if self.twist else ""

    @property
    def pitch_angle(self) -> float:
        """Angle between teeth, 2 pi / z."""
        return 2.0 * self.sign * math.pi / self.teeth
