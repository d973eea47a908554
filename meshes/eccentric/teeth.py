"""Teeth of both wheels, as cut by one rolling rack with rounded tips.

The same rack rolls on both pitch curves, so flanks that are cut by its two sides touch
in one point, with the normal through the pitch point. When the pitch point has passed
the place s0 of a flank by s - s0, the flank is cut at the distance

    l = (s0 - s) cos(alpha)

along the line of action from the pitch point; it is an involute of the base curve. The
rounded rack tip cuts the fillet. See Litvin & Fuentes, Gear Geometry and Applied
Theory, 2004, sections 6 and 12.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from meshes.array_types import Array
from meshes.eccentric.base import LEADING, TRAILING, Side, feasibility
from meshes.eccentric.pitch import EccentricPair, PitchCurve
from meshes.gear import GeometryError, apart_from, floored

MIN_TEETH, MAX_TEETH = 5, 2_000
ROUNDING = 0.3  # rounding of the rack's tips, in modules, as usual in gear sets
MIN_TIP = 0.05  # least tip thickness in modules
MIN_ANGLE = 1.0  # degrees, smaller pressure angles do not help
STEPS = 50  # largest number of Newton steps
NEWTON_TOL, ROUND_OFF = 1e-12, 2e-15  # error over a module, and over the circumference
LOOKED_AT = 33  # points of a flank that are checked


@dataclass(frozen=True, kw_only=True)
class Rack:
    """Generating rack, whose teeth are as wide as its spaces.

    module : pitch of the teeth over pi [m]
    pressure_angle : [rad]
    tip_height, root_depth : height and depth of the teeth that it cuts, in modules
        (ISO 53: A)

    Raises GeometryError if no such rack exists.
    """

    module: float
    pressure_angle: float
    tip_height: float = 1.0
    root_depth: float = 1.25

    def __post_init__(self) -> None:
        if not 0.1 <= self.tip_height <= 2.0:
            got = f"{apart_from(self.tip_height, '0.1', '2')} modules; must be 0.1 to 2"
            raise GeometryError("addendum", got)
        if not self.tip_height < self.root_depth <= 3.0:
            low = f"{self.tip_height:.12g}"
            got = f"{apart_from(self.root_depth, low, '3')} modules; must be above"
            raise GeometryError("dedendum", f"{got} the addendum {low}, to 3")
        if not self.rounding > 0.0:
            most = floored(0.25 * math.pi / math.tan(self.pressure_angle))
            got = f"{apart_from(self.root_depth, most)} modules; the rack's tips are"
            got = f"{got} pointed, below {most} is needed"
            raise GeometryError("dedendum", got)

    @property
    def pitch(self) -> float:
        return math.pi * self.module

    @property
    def addendum(self) -> float:
        """Addendum of the teeth that the rack cuts [m]."""
        return self.tip_height * self.module

    @property
    def dedendum(self) -> float:
        """Dedendum of the teeth that the rack cuts [m]."""
        return self.root_depth * self.module

    @cached_property
    def rounding(self) -> float:
        """Rounding of the tips, at most the one that fits between the rack's flanks."""
        slope = math.tan(0.25 * math.pi - 0.5 * self.pressure_angle)
        room = 0.25 * self.pitch - self.dedendum * math.tan(self.pressure_angle)
        return min(ROUNDING * self.module, room / slope)

    @property
    def depth(self) -> float:
        """Depth of the centre of the rounding below the pitch line."""
        return self.dedendum - self.rounding

    @property
    def offset(self) -> float:
        """Offset of the centre of the rounding from the place of its flank, along the
        pitch line."""
        alpha = self.pressure_angle
        return self.depth * math.tan(alpha) + self.rounding / math.cos(alpha)

    @property
    def form(self) -> float:
        """Arc from a flank's place to the end of its involute at the fillet."""
        return self.offset + self.depth / math.tan(self.pressure_angle)


@dataclass(frozen=True, eq=False)
class ToothedWheel:
    """One wheel: its pitch curve and the positions of its teeth.

    teeth : number of teeth
    first : arc at the middle of tooth 0 [m]
    """

    curve: PitchCurve
    rack: Rack
    teeth: int
    first: float

    def place(self, side: Side) -> Array:
        """Arcs (teeth,) of the flanks on the pitch curve [m]."""
        number = np.arange(self.teeth, dtype=float)
        return self.first + self.rack.pitch * (number + 0.25 * side)

    def flank(self, place: ArrayLike, arc: ArrayLike, side: Side) -> Array:
        """Points (n, 2) of flanks from their place and the arc that has rolled [m]."""
        frames = self.curve.frames(np.asarray(arc) / self.curve.radius)
        action = self.action(arc, side)
        alpha = self.rack.pressure_angle
        along = (np.asarray(place) - arc) * math.cos(alpha)
        return frames.point + np.asarray(along)[..., None] * action

    def action(self, arc: ArrayLike, side: Side) -> Array:
        """Direction (n, 2) of the line of action, along the pitch point's motion."""
        frames = self.curve.frames(np.asarray(arc) / self.curve.radius)
        alpha = self.rack.pressure_angle
        out = side * math.sin(alpha) * frames.normal
        return math.cos(alpha) * frames.tangent + out

    def fillet(self, place: float, angle: ArrayLike, side: Side) -> Array:
        """Points (n, 2) of a fillet [m].

        angle : angle of its normal from that of the pitch curve, 0 at the bottom and
            pi/2 - pressure angle at the flank [rad]
        """
        rack, beta = self.rack, np.asarray(angle, float)
        arc = place + side * (rack.offset + rack.depth * np.tan(beta))
        frames = self.curve.frames(arc / self.curve.radius)
        below = (rack.depth / np.cos(beta) + rack.rounding)[..., None]
        out = side * np.sin(beta)[..., None] * frames.tangent
        return frames.point - below * (out + np.cos(beta)[..., None] * frames.normal)

    def land(self, arc: ArrayLike, height: float) -> Array:
        """Points (n, 2) at a height above the pitch curve [m]."""
        frames = self.curve.frames(np.asarray(arc) / self.curve.radius)
        return frames.point + height * frames.normal

    @cached_property
    def tips(self) -> dict[Side, tuple[Array, Array]]:
        """Arcs (teeth,) at which tip corners are cut, and arcs of the pitch curve below
        them, by side [m]."""
        return {side: self._tips(side) for side in (TRAILING, LEADING)}

    def _tips(self, side: Side) -> tuple[Array, Array]:
        """Tips by Newton's method: points of the flank an addendum above the curve."""
        rack, radius, place = self.rack, self.curve.radius, self.place(side)
        sin, cos = math.sin(rack.pressure_angle), math.cos(rack.pressure_angle)
        arc = place - side * 0.5 * rack.addendum / (sin * cos)
        below = arc + (place - arc) * cos**2
        exact = NEWTON_TOL * rack.module + ROUND_OFF * self.curve.length
        for _ in range(STEPS):
            here = self.curve.frames(arc / radius)
            foot = self.curve.frames(below / radius)
            from_foot = self.flank(place, arc, side) - foot.point
            ahead = np.einsum("ij,ij->i", from_foot, foot.tangent)
            height = np.einsum("ij,ij->i", from_foot, foot.normal)
            across = cos * here.normal - side * sin * here.tangent
            rate = -side * sin - (place - arc) * cos * here.curvature
            a = rate * np.einsum("ij,ij->i", across, foot.tangent)
            b = rate * np.einsum("ij,ij->i", across, foot.normal)
            d = 1.0 + height * foot.curvature
            # the height is stationary in the foot point of the perpendicular
            e = ahead * foot.curvature
            wrong = height - rack.addendum
            whole = b * d - a * e
            step = (d * wrong - e * ahead) / whole
            foot_step = (b * ahead - a * wrong) / whole
            arc, below = arc - step, below + foot_step
            if np.abs([step, foot_step]).max() <= exact:
                return arc, below
        raise GeometryError(
            "teeth", f"{self.teeth}; the teeth are pointed, more are needed"
        )


@dataclass(frozen=True, eq=False)
class ToothedPair:
    """Both wheels with their teeth.

    pressure_angle : [rad]
    teeth : number of teeth of the driver; the driven wheel has `ratio` times as many
    tip_height, root_depth : height and depth of the teeth, in modules

    Raises GeometryError if involute teeth cannot exist on the pitch curves, or if they
    are undercut or pointed.
    """

    pair: EccentricPair
    pressure_angle: float
    teeth: int
    tip_height: float = 1.0
    root_depth: float = 1.25

    def __post_init__(self) -> None:
        most = MAX_TEETH // self.pair.lobes
        if not MIN_TEETH <= self.teeth <= most:
            allowed = f"must be {MIN_TEETH} to {most}"
            raise GeometryError("teeth", f"{self.teeth}; {allowed}")
        require_feasible(self.pair, self.pressure_angle)
        for name, wheel in (("driver", self.driver), ("driven wheel", self.driven)):
            require_teeth(wheel, name, self.teeth)
        self._require_clear_roots()
        self._require_contact()

    def _require_contact(self) -> None:
        """Raise GeometryError if a pair of teeth separates before the next meets."""
        start, end = self.contact.T
        least = float(
            (end - np.append(start[1:], start[0] + self.driven.curve.length)).min()
        )
        if not least > 0.0:
            ratio = float(self.contact_ratio.min())
            raise GeometryError(
                "addendum",
                f"{self.tip_height:g} modules; a larger one is needed, the contact "
                f"ratio falls to {ratio:.3g} and must stay above 1",
            )

    def _require_clear_roots(self) -> None:
        """Raise GeometryError if tips of one wheel reach below the other's flanks, so
        that a fillet would be in contact."""
        form, reach = self.rack.form, self.contact
        place = self.rack.pitch * (np.arange(len(reach)) - 0.25)
        if not max((place - reach[:, 0]).max(), (reach[:, 1] - place).max()) < form:
            got = f"{self.root_depth:g} modules; the mate's tips reach into the fillets"
            raise GeometryError("dedendum", f"{got}, a larger one is needed")

    @cached_property
    def rack(self) -> Rack:
        return Rack(
            module=2.0 * self.pair.radius / self.teeth,
            pressure_angle=self.pressure_angle,
            tip_height=self.tip_height,
            root_depth=self.root_depth,
        )

    @cached_property
    def driver(self) -> ToothedWheel:
        return ToothedWheel(self.pair.driver, self.rack, self.teeth, 0.0)

    @cached_property
    def driven(self) -> ToothedWheel:
        """Driven wheel, with its teeth in the driver's spaces."""
        count = self.teeth * self.pair.lobes
        return ToothedWheel(self.pair.driven, self.rack, count, 0.5 * self.rack.pitch)

    @cached_property
    def contact(self) -> Array:
        """Arcs (n, 2) at which the driver's teeth enter and leave contact [m], over a
        turn of the driven wheel."""
        # a driver's tooth meets the preceding driven tooth, whose place is the same arc
        start = np.roll(self.driven.tips[LEADING][0], 1)
        start[0] -= self.driven.curve.length
        laps = self.driver.curve.length * np.arange(self.pair.lobes)
        end = (self.driver.tips[TRAILING][0] + laps[:, None]).ravel()
        return np.stack([start, end], axis=1)

    @property
    def contact_ratio(self) -> Array:
        """Contact ratio (n,) of every tooth."""
        return (self.contact[:, 1] - self.contact[:, 0]) / self.rack.pitch


def require_feasible(pair: EccentricPair, pressure_angle: float) -> None:
    """Raise GeometryError if involutes cannot exist on the pitch curves."""
    outcome = feasibility(pair, pressure_angle)
    limit = floored(1e3 * outcome.largest_eccentricity)
    degrees = math.degrees(outcome.largest_pressure_angle)
    if not outcome.feasible and degrees < MIN_ANGLE:
        raise GeometryError(
            "eccentricity",
            f"{1e3 * pair.eccentricity:g} mm; {outcome.reason}: below {limit} mm is "
            "needed with this pressure angle",
        )
    if not outcome.feasible:
        raise GeometryError(
            "pressure_angle",
            f"{math.degrees(pressure_angle):g} deg; {outcome.reason}: below "
            f"{floored(degrees)} deg is needed with this eccentricity, or an "
            f"eccentricity below {limit} mm",
        )


def require_teeth(wheel: ToothedWheel, name: str, driver_teeth: int) -> None:
    """Raise GeometryError if teeth are undercut or pointed.

    driver_teeth : number of teeth of the driver
    """
    rack = wheel.rack
    sin, cos = math.sin(rack.pressure_angle), math.cos(rack.pressure_angle)
    reach = np.linspace(0.0, rack.form, LOOKED_AT)
    for side in (TRAILING, LEADING):
        arc = wheel.place(side)[:, None] + side * reach
        curvature = wheel.curve.frames(arc / wheel.curve.radius).curvature
        if not (sin - reach * cos * curvature > 0.0).all():
            got = f"{driver_teeth}; teeth of the {name} are undercut, more teeth"
            raise GeometryError("teeth", f"{got} or a larger pressure angle are needed")
    thickness = wheel.tips[LEADING][1] - wheel.tips[TRAILING][1]
    if not thickness.min() > MIN_TIP * rack.module:
        raise GeometryError(
            "teeth",
            f"{driver_teeth}; teeth of the {name} are pointed, their tips thinner than "
            f"{MIN_TIP:g} modules; more teeth, a smaller pressure angle or addendum "
            "are needed",
        )
