"""Profile shift and thinning of a gear, as given or from a measured thickness."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fegear.files.errors import InputError
from fegear.gearset.problems import shown
from fegear.gearset.schema import GearEntry
from lumped.common.units import MM, UM
from meshes.gear import GeometryError, SpurGear, ceiled
from meshes.involute import Involute
from meshes.tooth_thickness import (
    least_pin_dimension,
    pin_contact,
    require_on_flank,
    require_seated,
    span_contact,
    thickness_of_pins,
    thickness_of_span,
)


@dataclass(frozen=True, kw_only=True)
class ToothThickness:
    """What gives the tooth its thickness.

    thinning : [m]
    origin : key and value that were measured; empty where none was
    inference : a sentence on what followed from them, or empty
    """

    profile_shift: float
    thinning: float
    origin: str = ""
    inference: str = ""


def tooth_thickness(entry: GearEntry, gear: Involute) -> ToothThickness:
    """Shift and thinning; InputError where no tooth has the measured thickness."""
    shift, thinning_um = entry.profile_shift, entry.tooth_thinning_um
    origin, measured = measured_thickness(entry, gear)
    # a shift in normal modules, of sizes in the section across the axis
    cosine = math.cos(math.radians(entry.helix_angle_deg))
    if measured is None:
        thinning = (thinning_um or 0.0) * UM
        return ToothThickness(profile_shift=(shift or 0.0) * cosine, thinning=thinning)
    rack_thickness, thickness_per_shift = thickness_of_rack(gear)
    thickness_per_shift *= cosine
    if shift is not None:
        thinning = rack_thickness + shift * thickness_per_shift - measured
        result = f"tooth_thinning_um = {thinning / UM:.6g}"
        given_value = f"profile_shift = {shown(shift)}"
    else:
        thinning = (thinning_um or 0.0) * UM
        shift = (measured + thinning - rack_thickness) / thickness_per_shift
        result = f"profile_shift = {shift:.6g}"
        given_value = f"tooth_thinning_um = {shown(thinning_um or 0.0)}"
        given_value += "" if thinning_um is not None else " by default"
    return ToothThickness(
        profile_shift=shift * cosine,
        thinning=thinning,
        origin=origin,
        inference=f'gear "{entry.name}": {result}, from {origin} with {given_value}',
    )


def measured_thickness(entry: GearEntry, gear: Involute) -> tuple[str, float | None]:
    """The key with its value and the thickness by it [m], None where there is none."""
    if entry.span_mm is not None and entry.span_teeth is not None:
        _require_span_teeth(entry, entry.span_teeth)
        origin = f"span_mm = {shown(entry.span_mm)} over {entry.span_teeth} teeth"
        return origin, thickness_of_span(gear, entry.span_mm * MM, entry.span_teeth)
    if entry.pin_dimension_mm is not None and entry.pin_diameter_mm is not None:
        dimension, pin = entry.pin_dimension_mm, entry.pin_diameter_mm
        origin = f"pin_dimension_mm = {shown(dimension)} over pins of {shown(pin)} mm"
        try:
            return origin, thickness_of_pins(gear, dimension * MM, pin * MM)
        except ValueError:
            least_dimension = ceiled(least_pin_dimension(gear, pin * MM) / MM)
            raise InputError(
                f'gear "{entry.name}": {origin}; must be above {least_dimension} mm'
            ) from None
    return "", None


def _require_span_teeth(entry: GearEntry, count: int) -> None:
    """Require a span over half of the teeth at most; no tooth has flanks for more."""
    most_teeth = max(1, entry.teeth // 2)
    if count > most_teeth:
        raise InputError(
            f'gear "{entry.name}": span_teeth = {count} of {entry.teeth} teeth; '
            f"must be 1 to {most_teeth}"
        )


def require_measurable(entry: GearEntry, gear: SpurGear) -> None:
    """Require that what was measured touches the involute flanks of the gear."""
    try:
        if entry.span_mm is not None:
            contact = span_contact(gear, entry.span_mm * MM)
            require_on_flank(gear, contact, "span")
        if entry.pin_diameter_mm is not None:
            pin = entry.pin_diameter_mm * MM
            contact = pin_contact(gear, gear.tooth_thickness, pin)
            require_on_flank(gear, contact, "pin")
            require_seated(gear, pin)
    except GeometryError as error:
        origin, _ = measured_thickness(entry, gear)
        raise InputError(f'gear "{entry.name}": {origin}; {error.message}') from None


def thickness_of_rack(gear: Involute) -> tuple[float, float]:
    """Thickness [m] without shift and thinning, and what a shift of 1 adds."""
    tangent = math.tan(gear.pressure_angle)
    return 0.5 * math.pi * gear.module, 2.0 * gear.module * tangent
