"""Internal gear: the teeth of a ring, cut by a shaper cutter.

Radii, roll lengths and the angle from tooth to tooth are negative, as in ISO 21771,
where an internal gear has a negative number of teeth. The formulas of external gears
then hold without change, for the gear and for a pair: a centre distance and a line of
action are negative in a pair with a ring. In the tooth frame the centre is above, and
the tooth points up as that of an external gear does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from meshes.gear import (
    SLACK,
    GeometryError,
    SpurGear,
    ceiled,
    floored,
    inverse_involute,
    involute,
    require,
    stated_mm,
)

MIN_CUTTER_TEETH = 5


@dataclass(frozen=True, kw_only=True)
class InternalGear(SpurGear):
    """Internal involute gear cut by a shaper cutter with rounded tips.

    tip_radius : inner radius of the teeth, negative
    dedendum : depth of the space beyond the reference circle
    rack_tip_radius : rounding of the cutter's tips, which generates the root fillet
    hub_radius : outer radius of the ring, where it is held, negative
    cutter_teeth : number of teeth of the cutter, whose profile shift is zero

    Raises GeometryError if no such gear can be cut.
    """

    cutter_teeth: int

    @property
    def sign(self) -> int:
        return -1

    @property
    def is_undercut(self) -> bool:
        return False

    @property
    def rack_roll_length(self) -> float:
        """Roll length down to which the cutter's involute reaches."""
        contact = self.rack_tip_radius + self.rounding_roll_length
        return -(contact + self.cutting_line)

    @property
    def form_normal_angle(self) -> float:
        return 0.5 * math.pi - self.cutting_angle

    @property
    def cutter_base_radius(self) -> float:
        radius = 0.5 * self.module * self.cutter_teeth
        return radius * math.cos(self.pressure_angle)

    @property
    def cutter_base_half_angle(self) -> float:
        return 0.5 * math.pi / self.cutter_teeth + involute(self.pressure_angle)

    @property
    def cutting_angle(self) -> float:
        """Pressure angle of cutter and ring without backlash [rad]."""
        rb, cutter_rb = self.base_radius, self.cutter_base_radius
        filled = cutter_rb * (self.cutter_base_half_angle - math.pi / self.cutter_teeth)
        value = (filled + rb * self.base_half_angle) / (rb + cutter_rb)
        if not value > 0.0:
            raise GeometryError(
                "profile_shift",
                f"{self.profile_shift:g}; a cutter of {self.cutter_teeth} teeth cannot "
                "cut so thick a tooth",
            )
        return inverse_involute(value)

    @property
    def cutting_distance(self) -> float:
        """Distance of the centres of ring and cutter, positive."""
        bases = abs(self.base_radius) - self.cutter_base_radius
        return bases / math.cos(self.cutting_angle)

    @property
    def cutting_line(self) -> float:
        """Distance of the points of tangency of ring and cutter, positive."""
        return self.cutting_distance * math.sin(self.cutting_angle)

    @property
    def cutter_tip_radius(self) -> float:
        return -self.root_radius - self.cutting_distance

    @property
    def rounding_center_radius(self) -> float:
        """Distance of the centre of the tip rounding from that of the cutter."""
        return self.cutter_tip_radius - self.rack_tip_radius

    @property
    def rounding_roll_length(self) -> float:
        """Roll length of the centre of the tip rounding on the cutter."""
        r, rb = self.rounding_center_radius, self.cutter_base_radius
        return math.sqrt(max(0.0, r * r - rb * rb))

    @property
    def rounding_angle(self) -> float:
        """Angle of the centre of the tip rounding from the cutter's tooth axis [rad].

        It lies on an involute that is inside that of the flank by the rounding.
        """
        rb = self.cutter_base_radius
        roll = self.rounding_roll_length / rb
        half = self.cutter_base_half_angle - self.rack_tip_radius / rb
        return half - (roll - math.atan(roll))

    def require_sizes(self) -> None:
        rows = [("tip_radius", -self.tip_radius), ("hub_radius", -self.hub_radius)]
        for field, length in rows:
            ok = 0.0 < length < math.inf
            require(field, ok, stated_mm(length), "must be positive and finite")
        most = self.teeth - MIN_CUTTER_TEETH
        require(
            "cutter_teeth",
            MIN_CUTTER_TEETH <= self.cutter_teeth <= most,
            f"{self.cutter_teeth}",
            f"allowed {MIN_CUTTER_TEETH} to {most}, {MIN_CUTTER_TEETH} fewer than the "
            "ring has",
        )

    def require_generated_tooth(self) -> None:
        """Require that the cutter leaves a tooth with a tip land in an existing rim."""
        self._require_cutter_tip()
        tip, base, form = -self.tip_radius, -self.base_radius, -self.form_radius
        require(
            "tip_radius",
            tip > base,
            stated_mm(tip),
            f"must exceed the base radius {ceiled(1e3 * base)} mm",
        )
        require(
            "tip_radius",
            tip < form,
            stated_mm(tip),
            f"must be below the form radius {floored(1e3 * form)} mm",
        )
        self.require_tip_land()
        smallest, rim = -self.root_radius + 0.5 * self.module, -self.hub_radius
        require(
            "hub_radius",
            rim >= smallest * (1.0 - SLACK),
            stated_mm(rim),
            f"at least {ceiled(1e3 * smallest)} mm, half a module beyond the root "
            f"circle {stated_mm(-self.root_radius)}",
        )

    def _require_cutter_tip(self) -> None:
        missing = self.cutter_base_radius - self.rounding_center_radius
        require(
            "dedendum",
            missing < 0.0,
            stated_mm(self.dedendum),
            f"at least {ceiled(1e3 * (self.dedendum + missing))} mm, the cutter's tip "
            "must be beyond its base circle",
        )
        require(
            "rack_tip_radius",
            self.rounding_angle >= -1e-9,
            stated_mm(self.rack_tip_radius),
            f"does not fit the tip of a cutter of {self.cutter_teeth} teeth",
        )
