"""Two gears in mesh: the line of action and the contact of pairs on it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meshes.gear import (
    INWARD,
    Bound,
    Comparison,
    GeometryError,
    SpurGear,
    beyond,
    bisected,
    floored,
    require_bound,
)
from meshes.involute import inverse_involute, involute
from meshes.profile import fillet_points
from meshes.tip_interference import corner_clearance, largest_tip

BACKLASH_RTOL = 1e-9  # over the base pitch; round-off does not jam the gears
COMMON_RTOL = 1e-9  # of base pitches that are equal
COMMON_ATOL = 1e-9  # of base helix angles that are equal [rad]
PATH_POINTS = 4000  # of the path of a tip corner through an undercut


@dataclass(frozen=True)
class GearPair:
    """Driving and driven gear at a centre distance [m].

    Positions on the line of action are measured by the roll length of the
    driver, s1, from its base circle's point of tangency; s2 = length - s1. One of the
    gears may be internal: its roll lengths are negative, and so is the length.

    rounding : backlash [m] that the gears may lack by the rounding of their sizes

    Raises GeometryError if the two cannot run together.
    """

    driver: SpurGear
    driven: SpurGear
    center_distance: float
    rounding: float = 0.0

    def __post_init__(self) -> None:
        require_common_pitch(self)
        require_common_helix(self)
        require_path(self)
        require_clearances(self)

    def __repr__(self) -> str:
        teeth = f"{self.driver.teeth} / {self.driven.teeth}"
        return f"GearPair({teeth} teeth, center_distance={self.center_distance:.9g})"

    @property
    def operating_pressure_angle(self) -> float:
        bases = self.driver.base_radius + self.driven.base_radius
        return math.acos(abs(bases) / self.center_distance)

    @property
    def is_internal(self) -> bool:
        return self.sign < 0

    @property
    def sign(self) -> int:
        """-1 for a pair with an internal gear, else 1."""
        return self.driver.sign * self.driven.sign

    @property
    def driver_arm(self) -> float:
        """Arm of the mesh force about the driver's centre, its base radius."""
        return abs(self.driver.base_radius)

    @property
    def base_pitch(self) -> float:
        return self.driver.base_pitch

    @property
    def line_of_action(self) -> float:
        """Distance between the two points of tangency, a sin(aw)."""
        sine = math.sin(self.operating_pressure_angle)
        return self.sign * self.center_distance * sine

    @property
    def pitch_point(self) -> float:
        """Roll length s1 at the pitch point."""
        return self.driver.base_radius * math.tan(self.operating_pressure_angle)

    @property
    def path_start(self) -> float:
        """Roll length s1 where the driven gear's tip enters, or the undercut ends."""
        start = self.line_of_action - self.driven.tip_roll_length
        return max(start, undercut_end(self.driver))

    @property
    def path_end(self) -> float:
        """Roll length s1 where the driver's tip leaves, or the undercut begins."""
        end = self.driver.tip_roll_length
        return min(end, self.line_of_action - undercut_end(self.driven))

    def overlap_ratio(self, width: float) -> float:
        """Base pitches by which the helix leads over a face width [m], 0 of spurs."""
        driver = self.driver
        return abs(driver.base_radius * driver.twist * width) / driver.base_pitch

    @property
    def path(self) -> tuple[float, float]:
        """Start and end of the path of contact, base pitches past the pitch point."""
        start, end = (
            self.path_start - self.pitch_point,
            self.path_end - self.pitch_point,
        )
        return start / self.base_pitch, end / self.base_pitch

    @property
    def contact_ratio(self) -> float:
        return (self.path_end - self.path_start) / self.base_pitch

    @property
    def backlash(self) -> float:
        """Backlash along the line of action [m], 0 where it is lacking by rounding."""
        backlash = self.backlash_of_sizes
        return 0.0 if -self.rounding <= backlash < 0.0 else backlash

    @property
    def backlash_of_sizes(self) -> float:
        """Backlash along the line of action by the sizes as they are [m]."""
        one, two = self.driver, self.driven
        angle = self.operating_pressure_angle
        gap = involute(angle) - one.base_half_angle + 0.5 * one.pitch_angle
        return 2.0 * one.base_radius * gap + 2.0 * two.base_radius * (
            involute(angle) - two.base_half_angle
        )

    @property
    def swapped(self) -> GearPair:
        """Return the pair with driver and driven gear exchanged."""
        gears = self.driven, self.driver
        return GearPair(*gears, self.center_distance, self.rounding)


def undercut_end(gear: SpurGear) -> float:
    """Roll length up to which an undercut removes the flank, minus infinity without."""
    return gear.form_roll_length if gear.is_undercut else -math.inf


def require_common_pitch(pair: GearPair) -> None:
    one, two = pair.driver.base_pitch, pair.driven.base_pitch
    if abs(one - two) > COMMON_RTOL * one:
        raise GeometryError(
            "gears",
            f"base pitches {1e3 * one:.9g} mm, {1e3 * two:.9g} mm; they must be equal",
        )


def require_common_helix(pair: GearPair) -> None:
    one, two = pair.driver.base_helix_angle, pair.driven.base_helix_angle
    if abs(one + two) > COMMON_ATOL:
        angles = f"{math.degrees(one):.9g} and {math.degrees(two):.9g} deg"
        raise GeometryError(
            "gears", f"base helix angles {angles}; they must be opposite"
        )


def require_path(pair: GearPair) -> None:
    if pair.driver.sign + pair.driven.sign < 0:
        raise GeometryError("internal", "both gears are internal; only one may be")
    bases = abs(pair.driver.base_radius + pair.driven.base_radius)
    name = "difference" if pair.is_internal else "sum"
    a = pair.center_distance
    bound = Bound("must be above", bases, f"the {name} of base radii")
    require_bound("center_distance", bases < a < math.inf, a, bound)
    # helical teeth take over from each other along the width as well
    least = 0.0 if pair.driver.twist else 1.0
    if not pair.contact_ratio >= least:
        _refuse_contact_ratio(pair, least)


def _refuse_contact_ratio(pair: GearPair, least: float) -> None:
    """Raise GeometryError with the centre distance, or what else, that raises it."""
    one, two = pair.driver, pair.driven
    ratio = f"{one.section_name}contact ratio {floored(pair.contact_ratio)}"
    ratio = f"{ratio}, at least {least:g} is needed for continuous motion"
    tips = "larger tips"
    if pair.is_internal:
        tips = "larger tips of the gear or smaller ones of the ring"
    line = one.tip_roll_length + two.tip_roll_length - least * one.base_pitch
    if one.is_undercut or two.is_undercut:
        remedy = f"less undercut by a profile shift or more teeth, or {tips}"
    elif pair.sign * line > 0.0:  # the line of action at the least contact ratio
        distance = math.hypot(line, one.base_radius + two.base_radius)
        comparison: Comparison = "at least" if pair.is_internal else "at most"
        bound = Bound(comparison, distance, f"{ratio}; or {tips}")
        raise beyond("center_distance", pair.center_distance, bound)
    else:
        remedy = "the teeth are too short at any centre distance"
    raise GeometryError("contact_ratio", f"{ratio}, {remedy}")


def require_clearances(pair: GearPair) -> None:
    length = pair.line_of_action
    roles = [("driver", pair.driver, pair.driven), ("driven", pair.driven, pair.driver)]
    other = {"driver": "driven", "driven": "driver"}
    for name, gear, mate in roles:
        start = length - mate.tip_roll_length
        if gear.is_undercut:
            require_undercut_clearance(pair, name)
        elif start < gear.form_roll_length:
            allowed = math.hypot(mate.base_radius, length - gear.form_roll_length)
            reason = (
                "trochoid interference: the mate digs below the form circle of the "
                f"{name} gear ({gear.teeth} teeth)"
            )
            if gear.sign < 0:
                reason += ", or a cutter of more teeth"
            bound = Bound("at most" if mate.sign > 0 else "at least", allowed, reason)
            raise beyond("tip_radius", mate.tip_radius, bound, other[name])
        reach = pair.sign * pair.center_distance - gear.root_radius
        if mate.tip_radius >= reach:
            reason = (
                f"the mate meets the root circle of the {name} gear ({gear.teeth} "
                "teeth)"
            )
            side: Comparison = "must be below" if mate.sign > 0 else "must be above"
            bound = Bound(side, abs(reach), reason)
            raise beyond("tip_radius", mate.tip_radius, bound, other[name])
    if pair.is_internal:
        require_tip_clearance(pair)
    if pair.backlash < -BACKLASH_RTOL * pair.base_pitch:
        reason = f"backlash {1e6 * pair.backlash:.6g} um, teeth would jam"
        comparison: Comparison = "at most" if pair.is_internal else "at least"
        bound = Bound(comparison, tight_center_distance(pair), reason)
        raise beyond("center_distance", pair.center_distance, bound)


def require_tip_clearance(pair: GearPair) -> None:
    """Require that a gear's tips pass those of the ring beside the path."""
    gear, ring, role = pair.driver, pair.driven, "driver"
    if gear.sign < 0:
        gear, ring, role = ring, gear, "driven"
    clearance = corner_clearance(gear, ring, pair.center_distance)
    if clearance <= 0.0:
        allowed = largest_tip(gear, ring, pair.center_distance)
        reason = (
            "tip interference: tips meet those of the ring beside the path of contact "
            f"by {-1e3 * clearance:.4g} mm, or a ring of more teeth"
        )
        bound = Bound("at most", allowed, reason)
        raise beyond("tip_radius", gear.tip_radius, bound, role)


def require_undercut_clearance(pair: GearPair, name: str) -> None:
    """Require that the mate's tip corner passes the undercut of a gear.

    name : "driver" or "driven", the undercut gear
    """
    gear, mate, role = pair.driver, pair.driven, "driven"
    if name == "driven":
        gear, mate, role = mate, gear, "driver"

    def passes(tip_radius: float) -> bool:
        shorter = replace(mate, tip_radius=tip_radius)
        return undercut_clearance(gear, shorter, pair.center_distance) > 0.0

    if passes(mate.tip_radius):
        return
    reason = f"the mate digs into the undercut foot of the {name} gear"
    least = mate.form_radius * (1.0 + INWARD)
    allowed = bisected(passes, least, mate.tip_radius)
    bound = Bound("at most", allowed, f"{reason} ({gear.teeth} teeth)")
    raise beyond("tip_radius", mate.tip_radius, bound, role)


def undercut_clearance(gear: SpurGear, mate: SpurGear, center_distance: float) -> float:
    """Least distance, along circles, of the mate's tip corner from the fillet [m].

    Of the side that carries load, while the corner is below the form circle of the
    undercut gear; infinite where it stays above.
    """
    line = _line_length(gear, mate, center_distance)
    start = line - mate.tip_roll_length
    roll = start + np.linspace(-1.0, 1.0, PATH_POINTS) * gear.base_pitch
    radius, angle = _fillet_gap(gear, mate, line, roll)
    return float((radius * angle).min(initial=math.inf))


def tip_clearance(gear: SpurGear, mate: SpurGear, center_distance: float) -> float:
    """Transmission error at which the mate's tip corner meets the fillet [m].

    Of rigid teeth, along the line of action, before the path of contact begins: on it
    the teeth in contact yield together. It is least where the corner passes the edge of
    the undercut gear; infinite where it stays above.
    """
    line = _line_length(gear, mate, center_distance)
    start = max(line - mate.tip_roll_length, gear.form_roll_length)
    roll = start + np.linspace(-1.0, 0.0, PATH_POINTS) * gear.base_pitch
    angle = _fillet_gap(gear, mate, line, roll)[1]
    return float(gear.base_radius * angle.min(initial=math.inf))


def _line_length(gear: SpurGear, mate: SpurGear, center_distance: float) -> float:
    bases = gear.base_radius + mate.base_radius
    return gear.sign * mate.sign * math.sqrt(center_distance**2 - bases**2)


def _fillet_gap(
    gear: SpurGear, mate: SpurGear, line: float, roll: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radius (n,) of the mate's tip corner [m] and its angle (n,) from the fillet.

    roll : of the gear where both flanks cross the line of action [m]

    In coordinates of the line, from the gear's point of tangency, its centre is at
    (0, -rb); the corner is an involute point of the mate, turned about its centre. The
    angle [rad] is infinite above the form circle of the gear.
    """
    rb, mate_rb, tip = gear.base_radius, mate.base_radius, mate.tip_roll_length
    turn = (tip - line + roll) / mate_rb
    x = line - np.cos(turn) * tip + np.sin(turn) * mate_rb
    y = mate_rb - np.sin(turn) * tip - np.cos(turn) * mate_rb + rb
    radius = np.hypot(x, y)
    # clockwise from the tooth axis, in the gear's frame
    angle = gear.base_half_angle + np.arctan2(x, y) - roll / rb
    fillet = fillet_points(gear, np.linspace(0.0, gear.form_normal_angle, PATH_POINTS))
    edge = np.interp(radius, np.hypot(*fillet.T), np.arctan2(*fillet.T))
    return radius, np.where(radius < gear.form_radius, angle - edge, math.inf)


def tight_center_distance(pair: GearPair) -> float:
    """Centre distance [m] of these gears without backlash."""
    one, two = pair.driver, pair.driven
    bases = one.base_radius + two.base_radius
    filled = one.base_radius * (one.base_half_angle - 0.5 * one.pitch_angle)
    value = (filled + two.base_radius * two.base_half_angle) / bases
    return abs(bases) / math.cos(inverse_involute(value))
