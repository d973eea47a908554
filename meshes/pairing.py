"""Two gears in mesh: the line of action and where pairs touch on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from meshes.gear import (
    GeometryError,
    SpurGear,
    ceiled,
    floored,
    inverse_involute,
    involute,
)


@dataclass(frozen=True)
class GearPair:
    """A driving and a driven gear at a centre distance [m].

    Positions on the line of action are measured by the roll length of the
    driver, s1, from its base circle's point of tangency; s2 = length - s1.

    Raises GeometryError where the two cannot run together.
    """

    driver: SpurGear
    driven: SpurGear
    center_distance: float

    def __post_init__(self) -> None:
        require_common_pitch(self)
        require_path(self)
        require_clearances(self)

    @property
    def operating_pressure_angle(self) -> float:
        bases = self.driver.base_radius + self.driven.base_radius
        return math.acos(bases / self.center_distance)

    @property
    def base_pitch(self) -> float:
        return self.driver.base_pitch

    @property
    def line_of_action(self) -> float:
        """Distance between the two points of tangency, a sin(aw)."""
        return self.center_distance * math.sin(self.operating_pressure_angle)

    @property
    def pitch_point(self) -> float:
        """Roll length s1 at the pitch point."""
        return self.driver.base_radius * math.tan(self.operating_pressure_angle)

    @property
    def path_start(self) -> float:
        """Roll length s1 where the driven gear's tip enters."""
        return self.line_of_action - self.driven.tip_roll_length

    @property
    def path_end(self) -> float:
        """Roll length s1 where the driver's tip leaves."""
        return self.driver.tip_roll_length

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
        """Normal backlash along the line of action."""
        one, two = self.driver, self.driven
        angle = self.operating_pressure_angle
        gap = involute(angle) - one.base_half_angle + math.pi / one.teeth
        return 2.0 * one.base_radius * gap + 2.0 * two.base_radius * (
            involute(angle) - two.base_half_angle
        )

    @property
    def swapped(self) -> GearPair:
        """This pair with driver and driven gear exchanged."""
        return GearPair(self.driven, self.driver, self.center_distance)


def require_common_pitch(pair: GearPair) -> None:
    one, two = pair.driver.base_pitch, pair.driven.base_pitch
    if abs(one - two) > 1e-9 * one:
        raise GeometryError(
            "gears",
            f"base pitches {1e3 * one:.6g} mm, {1e3 * two:.6g} mm; they must be equal",
        )


def require_path(pair: GearPair) -> None:
    bases = pair.driver.base_radius + pair.driven.base_radius
    a = pair.center_distance
    if not bases < a < math.inf:
        raise GeometryError(
            "center_distance",
            f"{1e3 * a:.9g} mm; must exceed the sum of base radii "
            f"{ceiled(1e3 * bases)} mm",
        )
    if not pair.contact_ratio >= 1.0:
        raise GeometryError(
            "contact_ratio",
            f"{floored(pair.contact_ratio)}; at least 1 is needed for continuous motion"
            f", {_remedy(pair)}",
        )


def _remedy(pair: GearPair) -> str:
    """What brings the contact ratio to 1."""
    one, two = pair.driver, pair.driven
    path = one.tip_roll_length + two.tip_roll_length - one.base_pitch
    if not path > 0.0:
        return "the teeth are too short at any centre distance"
    largest = math.hypot(path, one.base_radius + two.base_radius)
    return f"centre distance at most {floored(1e3 * largest)} mm, or larger tips"


def require_clearances(pair: GearPair) -> None:
    length = pair.line_of_action
    roles = [("driver", pair.driver, pair.driven), ("driven", pair.driven, pair.driver)]
    other = {"driver": "driven", "driven": "driver"}
    for name, gear, mate in roles:
        start = length - mate.tip_roll_length
        if start < gear.form_roll_length:
            allowed = math.hypot(mate.base_radius, length - gear.form_roll_length)
            raise GeometryError(
                "tip_radius",
                f"{1e3 * mate.tip_radius:.9g} mm of the mate digs below the form "
                f"circle of the {name} gear ({gear.teeth} teeth), trochoid "
                f"interference; at most {floored(1e3 * allowed)} mm",
                other[name],
            )
        clearance = pair.center_distance - mate.tip_radius - gear.root_radius
        if clearance <= 0.0:
            raise GeometryError(
                "tip_radius",
                f"{1e3 * mate.tip_radius:.9g} mm of the mate meets the root circle of "
                f"the {name} gear ({gear.teeth} teeth), clearance "
                f"{1e3 * clearance:.6g} mm; it must be positive",
                other[name],
            )
    if pair.backlash < -1e-9 * pair.base_pitch:  # rounding is no jam
        raise GeometryError(
            "backlash",
            f"{1e6 * pair.backlash:.6g} um; teeth would jam, it must not be negative: "
            f"centre distance at least {ceiled(1e3 * tight_center_distance(pair))} mm",
        )


def tight_center_distance(pair: GearPair) -> float:
    """Centre distance [m] of these gears without backlash."""
    one, two = pair.driver, pair.driven
    bases = one.base_radius + two.base_radius
    filled = one.base_radius * (one.base_half_angle - math.pi / one.teeth)
    value = (filled + two.base_radius * two.base_half_angle) / bases
    return bases / math.cos(inverse_involute(value))
