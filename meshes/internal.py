"""Internal gear: the teeth of a ring, cut by a shaper cutter.

Radii, roll lengths and the angle from tooth to tooth are negative, as in ISO 21771,
where an internal gear has a negative number of teeth. The formulas of external gears
then hold without change, for the gear and for a pair: a centre distance and a line of
action are negative in a pair with a ring. In the tooth frame the centre is above, and
the tooth points up as that of an external gear does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

from meshes.gear import (
    SLACK,
    Bound,
    GeometryError,
    SpurGear,
    require,
    require_bound,
    stated_mm,
)
from meshes.shaper import ShaperCutter, ThickTooth, shaper_cutter
from meshes.tip_interference import corner_clearance

MIN_TANGENTIAL = 1e6  # N/m3; without it the ring would rotate freely
MAX_STIFFNESS = 1e21  # N/m3; the ring is held to 1e-6 from 1e20 on
MIN_CUTTER_TEETH = 5  # of a cutter, and fewer than the ring has


@dataclass(frozen=True, kw_only=True)
class Foundation:
    """Springs between the outside of a ring and what carries it, per area [N/m3].

    radial, tangential : stiffness along and across the radius
    """

    radial: float
    tangential: float

    def __post_init__(self) -> None:
        for name, least in (("radial", 0.0), ("tangential", MIN_TANGENTIAL)):
            stiffness = getattr(self, name)
            if not least <= stiffness <= MAX_STIFFNESS:
                raise ValueError(
                    f"{name} = {stiffness:g} N/m3; must be {least:g} to "
                    f"{MAX_STIFFNESS:g} N/m3"
                )

    def translation(self, radius: float) -> float:
        """Stiffness of a rigid ring of an outer radius [m] to shifts [N/m per m]."""
        return math.pi * radius * (self.radial + self.tangential)

    def rotation(self, radius: float) -> float:
        """Stiffness of the same to rotation about its axis [N m/rad per m]."""
        return 2.0 * math.pi * radius**3 * self.tangential


@dataclass(frozen=True, kw_only=True)
class InternalGear(SpurGear):
    """Internal involute gear cut by a shaper cutter with rounded tips.

    tip_radius : inner radius of the teeth, negative
    dedendum : depth of the space beyond the reference circle
    rack_tip_radius : rounding of the cutter's tips, which generates the root fillet
    hub_radius : outer radius of the ring, where it is held, negative
    cutter_teeth : number of teeth of the cutter
    foundation : springs that carry the outside; None where it is held rigidly

    Raises GeometryError if no such gear can be cut.
    """

    cutter_teeth: int
    foundation: Foundation | None = None

    @property
    def sign(self) -> int:
        return -1

    @property
    def outer_radius(self) -> float:
        return -self.hub_radius

    @property
    def is_undercut(self) -> bool:
        return False

    @cached_property
    def cutter(self) -> ShaperCutter:
        sharp = shaper_cutter(
            self, self.base_half_angle, self.root_radius, self.cutter_teeth
        )
        return replace(sharp, rounding=self.rack_tip_radius)

    @property
    def cutting_angle(self) -> float:
        """Pressure angle of ring and cutter [rad]."""
        return self.cutter.cutting_angle

    @property
    def rack_roll_length(self) -> float:
        """Roll length that the involute of the cutter reaches."""
        return -(self.cutter.flank_roll_length + self.cutter.line_of_action)

    @property
    def form_normal_angle(self) -> float:
        return 0.5 * math.pi - self.cutting_angle

    def require_sizes(self) -> None:
        rows = [("tip_radius", -self.tip_radius), ("hub_radius", -self.hub_radius)]
        for field, length in rows:
            ok = 0.0 < length < math.inf
            require(field, ok, stated_mm(length), "must be positive and finite")
        fewest = MIN_CUTTER_TEETH
        most = self.teeth - fewest
        bound = Bound("at most", most, f"{fewest} fewer than the ring has")
        if self.cutter_teeth < fewest:
            bound = Bound("at least", fewest, "as cutters have")
        if not fewest <= self.cutter_teeth <= most:
            message = f"{self.cutter_teeth}; {bound.stated()}"
            raise GeometryError("cutter_teeth", message, bound=bound)

    def require_generated_tooth(self) -> None:
        """Require that the cutter leaves a tooth with a tip land in an existing rim."""
        self._require_cutter_tip()
        tip, base, form = -self.tip_radius, -self.base_radius, -self.form_radius
        above_base = Bound("must be above", base, "the base radius")
        require_bound("tip_radius", tip > base, tip, above_base)
        below_form = Bound("must be below", form, "the form radius")
        require_bound("tip_radius", tip < form, tip, below_form)
        self.require_tip_land()
        self._require_cutter_flank()
        smallest, rim = -self.root_radius + 0.5 * self.module, -self.hub_radius
        circle = f"half a module beyond the root circle {stated_mm(-self.root_radius)}"
        bound = Bound("at least", smallest, circle)
        require_bound("hub_radius", rim >= smallest * (1.0 - SLACK), rim, bound)

    def _require_cutter_flank(self) -> None:
        """Require that the cutter's involute makes the tip, and spares other tips."""
        tip, cutter = -self.tip_radius, self.cutter
        least = math.hypot(self.base_radius, cutter.line_of_action)
        cause = f"a cutter of {self.cutter_teeth} teeth has no flank below its base "
        bound = Bound("at least", least, f"{cause}circle")
        require_bound("tip_radius", tip >= least * (1.0 - SLACK), tip, bound)
        if not corner_clearance(cutter, self, cutter.center_distance) > 0.0:
            reason = "tips of the cutter meet those of the ring"
            most = self._most_cutter_teeth
            limit = None if most is None else Bound("at most", most, reason)
            text = limit.stated() if limit else f"{reason}, as do those of any other"
            message = f"{self.cutter_teeth}; {text}"
            raise GeometryError("cutter_teeth", message, bound=limit)

    @property
    def _most_cutter_teeth(self) -> int | None:
        """Number of teeth of the largest cutter whose tips pass those of the ring.

        None where there is no smaller one.
        """
        for teeth in range(self.cutter_teeth - 1, MIN_CUTTER_TEETH - 1, -1):
            cutter = shaper_cutter(self, self.base_half_angle, self.root_radius, teeth)
            if corner_clearance(cutter, self, cutter.center_distance) > 0.0:
                return teeth
        return None

    def _require_cutter_tip(self) -> None:
        try:
            cutter = self.cutter
        except ThickTooth as error:
            by_shift = 2.0 * self.module * math.tan(self.pressure_angle)
            most = self.profile_shift - error.excess / by_shift
            bound = Bound("must be below", most, str(error))
            text = f"{self.profile_shift:g}; {bound.stated()}"
            raise GeometryError("profile_shift", text, bound=bound) from None
        missing = cutter.base_radius - cutter.center_radius
        reason = "the cutter's tip must be beyond its base circle"
        bound = Bound("must be above", self.dedendum + missing, reason)
        require_bound("dedendum", missing < 0.0, self.dedendum, bound)
        widest = cutter.widest_rounding
        reason = f"what fits the tip of a cutter of {self.cutter_teeth} teeth"
        require_bound(
            "rack_tip_radius",
            self.rack_tip_radius <= widest * (1.0 + SLACK),
            self.rack_tip_radius,
            Bound("at most", widest, reason),
        )
