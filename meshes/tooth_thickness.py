"""Tooth thickness by what a drawing states of it: span and dimension over pins.

Lengths are in metres. Thickness is the arc on the reference circle, across the axis.
Tools touch helical teeth along normals, which are inclined by the base helix angle, and
pins are balls there. Formulas are those of Dudley, Handbook of Practical Gear Design,
and of DIN 3960.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from meshes.gear import GeometryError, SpurGear, ceiled, floored
from meshes.involute import Involute, inverse_involute, involute

DEFAULT_PIN_MODULES = 1.728  # of external gears, Van Keuren's series


def span(gear: Involute, thickness: float, teeth: int) -> float:
    """Base tangent length over a number of teeth: base pitches and a base thickness."""
    base_thickness = math.cos(gear.pressure_angle) * (
        thickness + 2.0 * gear.reference_radius * involute(gear.pressure_angle)
    )
    across = (teeth - 1) * gear.base_pitch + base_thickness
    return across * gear.base_helix_cosine


def thickness_of_span(gear: Involute, length: float, teeth: int) -> float:
    """Thickness whose base tangent length over some teeth is `length`."""
    across = length / gear.base_helix_cosine
    base_thickness = across - (teeth - 1) * gear.base_pitch
    angle = gear.pressure_angle
    return base_thickness / math.cos(angle) - 2.0 * gear.reference_radius * involute(
        angle
    )


def pin_circle_radius(gear: Involute, thickness: float, pin: float) -> float:
    """Radius at which the centre of a pin of diameter `pin` in a space is.

    Raises ValueError where the pin is too small to touch both flanks.
    """
    value = 0.5 * thickness / gear.reference_radius + involute(gear.pressure_angle)
    value += _half_pin_angle(gear, pin) - math.pi / gear.teeth
    if not value > 0.0:
        raise ValueError("the pin touches no flanks")
    return gear.base_radius / math.cos(inverse_involute(value))


def pin_dimension(gear: Involute, thickness: float, pin: float) -> float:
    """Dimension over two pins in spaces that are opposite, or nearly if z is odd."""
    centers = 2.0 * pin_circle_radius(gear, thickness, pin)
    return centers * _across(gear.teeth) + pin


def thickness_of_pins(gear: Involute, dimension: float, pin: float) -> float:
    """Thickness with a dimension over two pins of diameter `pin`.

    Raises ValueError where the centres of the pins are not outside the base circle.
    """
    radius = 0.5 * (dimension - pin) / _across(gear.teeth)
    if not radius > gear.base_radius:
        raise ValueError("the pins are not outside the base circle")
    center = involute(math.acos(gear.base_radius / radius))
    half = center - involute(gear.pressure_angle) - _half_pin_angle(gear, pin)
    return 2.0 * gear.reference_radius * (half + math.pi / gear.teeth)


def _half_pin_angle(gear: Involute, pin: float) -> float:
    """Half of the angle that a pin takes up on the base circle, across the axis."""
    return 0.5 * pin / (gear.base_radius * gear.base_helix_cosine)


def least_pin_dimension(gear: Involute, pin: float) -> float:
    """Dimension over pins whose centres are on the base circle."""
    return 2.0 * gear.base_radius * _across(gear.teeth) + pin


def _across(teeth: int) -> float:
    """Distance of two pins over the diameter of their circle."""
    return math.cos(0.5 * math.pi / teeth) if teeth % 2 else 1.0


@dataclass(frozen=True)
class Contact:
    """Where a measuring tool touches the flank, as a roll length."""

    roll_length: float

    def is_on_flank(self, gear: SpurGear) -> bool:
        """Whether that is on the involute, between form circle and tip circle."""
        return gear.form_roll_length < self.roll_length < gear.tip_roll_length

    def radius(self, gear: Involute) -> float:
        return math.hypot(gear.base_radius, self.roll_length)


def span_contact(gear: Involute, length: float) -> Contact:
    """The planes touch both flanks at equal radii."""
    return Contact(0.5 * length * gear.base_helix_cosine)


def pin_contact(gear: Involute, thickness: float, pin: float) -> Contact:
    """The line of contact goes through the centre of the pin."""
    radius = pin_circle_radius(gear, thickness, pin)
    along = 0.5 * pin * gear.base_helix_cosine
    return Contact(math.sqrt(radius**2 - gear.base_radius**2) - along)


def require_on_flank(gear: SpurGear, contact: Contact, field: str) -> None:
    """Raise GeometryError where a tool does not touch the involute."""
    if not contact.is_on_flank(gear):
        radius = 1e3 * contact.radius(gear) if contact.roll_length > 0.0 else math.nan
        at = f"at radius {radius:.6g} mm" if radius == radius else "inside the base"
        raise GeometryError(
            field,
            f"the flanks are touched {at}; the involute is from "
            f"{ceiled(1e3 * gear.form_radius)} to {floored(1e3 * gear.tip_radius)} mm",
        )


def require_seated(gear: SpurGear, pin: float) -> None:
    """Raise GeometryError where a pin does not protrude, or touches the root."""
    center = pin_circle_radius(gear, gear.tooth_thickness, pin)
    if not center + 0.5 * pin > gear.tip_radius:
        raise GeometryError("pin", "the pin is below the tip circle")
    if not center - 0.5 * pin > gear.root_radius:
        raise GeometryError("pin", "the pin touches the root")


def default_span_teeth(gear: SpurGear, width: float = math.inf) -> int | None:
    """Number of teeth whose span touches flanks nearest to radius r + x m.

    None where no span touches the involute, or both flanks of helical teeth within the
    face width. All spans that do differ by base pitches along the normal.
    """
    radius = gear.reference_radius + gear.profile_shift * gear.module
    roll = math.sqrt(max(0.0, radius**2 - gear.base_radius**2))
    first = span(gear, gear.tooth_thickness, 1)
    cosine = gear.base_helix_cosine
    usual = max(
        1, 1 + round((2.0 * roll / cosine - first) / (gear.base_pitch * cosine))
    )
    numbers = sorted(range(max(1, usual - 2), usual + 3), key=lambda k: abs(k - usual))
    return next((k for k in numbers if _span_fits(gear, k, width)), None)


def _span_fits(gear: SpurGear, teeth: int, width: float) -> bool:
    length = span(gear, gear.tooth_thickness, teeth)
    if length * math.sin(abs(gear.base_helix_angle)) >= width:
        return False
    return 2 * teeth <= gear.teeth and span_contact(gear, length).is_on_flank(gear)


def default_pin_diameter(gear: SpurGear) -> float | None:
    """1.728 normal modules, else the pin that touches flanks near radius r + x m.

    None where neither touches the involute and protrudes over the tip circle.
    """
    pins = DEFAULT_PIN_MODULES * gear.normal_module, _pin_at_shifted_circle(gear)
    return next((pin for pin in pins if pin and _pin_fits(gear, pin)), None)


def _pin_at_shifted_circle(gear: SpurGear) -> float | None:
    """The pin centre is where the normal of the flank meets the axis of the space."""
    radius = gear.reference_radius + gear.profile_shift * gear.module
    if radius <= gear.base_radius:
        return None
    angle = math.acos(gear.base_radius / radius)
    space = math.pi / gear.teeth - gear.half_angle(radius)
    across = 2.0 * gear.base_radius * (math.tan(angle + space) - math.tan(angle))
    return across * gear.base_helix_cosine


def _pin_fits(gear: SpurGear, pin: float) -> bool:
    try:
        require_seated(gear, pin)
        contact = pin_contact(gear, gear.tooth_thickness, pin)
    except ValueError:  # GeometryError is one
        return False
    return contact.is_on_flank(gear)
