"""From the keys of a gear to its teeth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from fegear.files.errors import InputError
from fegear.gearset.problems import shown
from fegear.gearset.schema import GearEntry
from fegear.gearset.thickness import (
    MM,
    UM,
    ToothThickness,
    require_measurable,
    thickness_of_rack,
    tooth_thickness,
)
from lumped.common.checks import require_present
from meshes.gear import GeometryError, SpurGear, floored
from meshes.internal import MIN_CUTTER_TEETH, Foundation, InternalGear
from meshes.involute import Involute, involute
from meshes.shaper import ShaperCutter, shaper_cutter

__all__ = ["MM", "UM", "Blank", "Tip", "blank_of"]

GEAR_KEYS = {
    "teeth": "teeth",
    "module": "module_mm",
    "pressure_angle": "pressure_angle_deg",
    "profile_shift": "profile_shift",
    "dedendum": "dedendum_mm",
    "rack_tip_radius": "rack_tip_radius_mm",
    "hub_radius": "hub_radius_mm",
    "tooth_thinning": "tooth_thinning_um",
    "cutter_teeth": "cutter_teeth",
}
N_PER_MM3 = 1e9  # N/m3
MIN_DEFAULT_CUTTER_TEETH = 10


@dataclass(frozen=True)
class Tip:
    """Tip radius [m] and the key, with its value, that it comes from."""

    radius: float
    origin: str

    def complaint(self, error: GeometryError) -> str:
        """The error on this tip, without its radius where the origin states it."""
        if self.origin.startswith("tip_radius_mm"):
            return error.message.partition("; ")[2]
        return f"tip radius {error.message}"


@dataclass(frozen=True, kw_only=True)
class Blank(Involute):
    """A gear before its tip is known; lengths in metres, angle in radians."""

    entry: GearEntry

    @property
    def sign(self) -> int:
        return -1 if self.entry.internal else 1

    @cached_property
    def thickness(self) -> ToothThickness:
        """Profile shift and thinning; InputError where they cannot be had."""
        return tooth_thickness(self.entry, self)

    @property
    def hub_radius(self) -> float:
        """Radius of the bore, or of the outside of an internal gear, negative."""
        if self.entry.internal:
            return -require_present(self.entry.rim_radius_mm, "rim_radius_mm") * MM
        diameter, radius = self.entry.hub_diameter_mm, self.entry.hub_radius_mm
        length = 0.5 * diameter if diameter is not None else radius
        return require_present(length, "hub_radius_mm") * MM

    @property
    def dedendum(self) -> float:
        dedendum_mm = self.entry.dedendum_mm
        return 1.25 * self.module if dedendum_mm is None else dedendum_mm * MM

    @property
    def widest_rack_tip(self) -> float:
        """Rounding at which the tool's tip has no flat left; below 0 none fits."""
        if self.entry.internal:
            return self.cutter.widest_rounding if self.cutter else 0.0
        alpha, tooth = self.pressure_angle, self.thickness
        shift = tooth.profile_shift * self.module
        shift_width = 2.0 * shift * math.tan(alpha)
        half_space = 0.5 * (0.5 * math.pi * self.module - shift_width + tooth.thinning)
        flat = half_space - (self.dedendum - shift) * math.tan(alpha)
        return flat / (1.0 / math.cos(alpha) - math.tan(alpha))

    @property
    def cutter(self) -> ShaperCutter | None:
        """Cutter of an internal gear with sharp tips, None where there is none."""
        tooth = self.thickness
        standard, by_shift = thickness_of_rack(self)
        thickness = standard + by_shift * tooth.profile_shift - tooth.thinning
        half = 0.5 * thickness / self.reference_radius + involute(self.pressure_angle)
        root = self.reference_radius + tooth.profile_shift * self.module - self.dedendum
        try:
            return shaper_cutter(self, half, root, self.cutter_teeth)
        except ValueError:
            return None

    @property
    def cutter_teeth(self) -> int:
        """Number of teeth of the cutter: a third of the ring's by default."""
        if self.entry.cutter_teeth is not None:
            return self.entry.cutter_teeth
        fewest = min(MIN_DEFAULT_CUTTER_TEETH, self.teeth - MIN_CUTTER_TEETH)
        return max(fewest, self.teeth // 3)

    @property
    def foundation(self) -> Foundation | None:
        """Springs that carry a ring, None where its outside is held."""
        radial = self.entry.rim_radial_stiffness_N_per_mm3
        tangential = self.entry.rim_tangential_stiffness_N_per_mm3
        if radial is None or tangential is None:
            return None
        return Foundation(radial=radial * N_PER_MM3, tangential=tangential * N_PER_MM3)

    @property
    def rack_tip_radius(self) -> float:
        radius_mm = self.entry.rack_tip_radius_mm
        if radius_mm is not None:
            return radius_mm * MM
        return min(0.3 * self.module, self.widest_rack_tip)

    @property
    def given_tip(self) -> Tip | None:
        entry = self.entry
        if entry.tip_radius_mm is not None:
            origin = f"tip_radius_mm = {shown(entry.tip_radius_mm)}"
            return Tip(self.sign * entry.tip_radius_mm * MM, origin)
        if entry.tip_diameter_mm is not None:
            origin = f"tip_diameter_mm = {shown(entry.tip_diameter_mm)}"
            return Tip(0.5 * self.sign * entry.tip_diameter_mm * MM, origin)
        if entry.addendum_mm is not None:
            radius = self.reference_radius + entry.addendum_mm * MM
            return Tip(radius, f"addendum_mm = {shown(entry.addendum_mm)}")
        return None

    @property
    def default_tip(self) -> Tip:
        addendum = (1.0 + self.thickness.profile_shift) * self.module
        origin = f"addendum_mm = {shown(addendum / MM)} by default"
        return Tip(self.reference_radius + addendum, origin)

    def cut(self, tip: Tip) -> SpurGear:
        """The gear; raises InputError with the key that prevents it."""
        sizes: dict[str, Any] = {
            "teeth": self.entry.teeth,
            "module": self.module,
            "pressure_angle": self.pressure_angle,
            "profile_shift": self.thickness.profile_shift,
            "tip_radius": tip.radius,
            "dedendum": self.dedendum,
            "rack_tip_radius": self.rack_tip_radius,
            "hub_radius": self.hub_radius,
            "tooth_thinning": self.thickness.thinning,
        }
        try:
            gear = self._gear(sizes)
        except GeometryError as error:
            raise InputError(self._complaint(error, tip)) from None
        require_measurable(self.entry, gear)
        return gear

    def _gear(self, sizes: dict[str, Any]) -> SpurGear:
        if self.entry.internal:
            return InternalGear(
                **sizes, cutter_teeth=self.cutter_teeth, foundation=self.foundation
            )
        return SpurGear(**sizes)

    def _complaint(self, error: GeometryError, tip: Tip) -> str:
        where = f'gear "{self.entry.name}"'
        if error.field == "tip_radius":
            return f"{where}: {tip.origin}; {tip.complaint(error)}"
        if error.field in ("profile_shift", "tooth_thinning") and (
            origin := self.thickness.origin
        ):
            quantity = error.field.replace("_", " ")
            return f"{where}: {origin}; {quantity} {error.message}"
        if error.field == "hub_radius" and self.entry.internal:
            return f"{where}: {self._stated('rim_radius_mm')}; {_allowed(error)}"
        if error.field == "hub_radius" and self.entry.hub_diameter_mm is not None:
            return f"{where}: {self._stated('hub_diameter_mm')}; radius {error.message}"
        field, allowed = error.field, _allowed(error)
        if field == "rack_tip_radius" and self.rack_tip_radius <= 0.0:
            field = "dedendum"
            allowed = f"at most {self._deepest}, the space has no room for the rack tip"
        measured = self.thickness.origin if error.field == "rack_tip_radius" else ""
        cause = f"; {measured}" if measured else ""
        return f"{where}: {self._stated(GEAR_KEYS[field])}; {allowed}{cause}"

    @property
    def _deepest(self) -> str:
        """Dedendum at which the rack tip is a sharp point."""
        alpha = self.pressure_angle
        slack = self.widest_rack_tip * (1.0 / math.cos(alpha) - math.tan(alpha))
        return f"{floored((self.dedendum + slack / math.tan(alpha)) / MM)} mm"

    def _stated(self, key: str) -> str:
        """'key = value' as given, or as it was filled in."""
        if key in self.entry.model_fields_set:
            return f"{key} = {shown(getattr(self.entry, key))}"
        filled = {
            "dedendum_mm": self.dedendum / MM,
            "rack_tip_radius_mm": self.rack_tip_radius / MM,
            "profile_shift": self.thickness.profile_shift,
            "tooth_thinning_um": self.thickness.thinning / UM,
            "cutter_teeth": self.cutter_teeth,
        }
        return f"{key} = {shown(filled.get(key, getattr(self.entry, key)))} by default"


def _allowed(error: GeometryError) -> str:
    """The part of a message that says what is allowed."""
    return error.message.partition("; ")[2]


def blank_of(entry: GearEntry) -> Blank:
    return Blank(
        teeth=entry.teeth,
        module=entry.module_mm * MM,
        pressure_angle=math.radians(entry.pressure_angle_deg),
        entry=entry,
    )
