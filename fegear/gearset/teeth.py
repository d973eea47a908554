"""From the keys of a gear to its teeth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from fegear.files.errors import InputError
from fegear.gearset.problems import shown
from fegear.gearset.rack_keys import angle_across, module_across, value_of_angle
from fegear.gearset.refusals import Key, Refusal, in_unit
from fegear.gearset.schema import GearEntry
from fegear.gearset.thickness import (
    ToothThickness,
    require_measurable,
    thickness_of_rack,
    tooth_thickness,
)
from lumped.common.checks import require_present
from lumped.common.units import MM, UM
from meshes.gear import Bound, GeometryError, SpurGear
from meshes.helical import HelicalGear, HelicalInternalGear
from meshes.internal import MIN_CUTTER_TEETH, Foundation, InternalGear
from meshes.involute import Involute, involute
from meshes.shaper import ShaperCutter, ThickTooth, shaper_cutter

__all__ = ["Blank", "Tip", "blank_of"]

GEAR_KEYS = {
    "teeth": "teeth",
    "profile_shift": "profile_shift",
    "dedendum": "dedendum_mm",
    "rack_tip_radius": "rack_tip_radius_mm",
    "hub_radius": "hub_radius_mm",
    "helix_angle": "helix_angle_deg",
    "tooth_thinning": "tooth_thinning_um",
    "cutter_teeth": "cutter_teeth",
}
N_PER_MM3 = 1e9  # N/m3
MIN_DEFAULT_CUTTER_TEETH = 10


@dataclass(frozen=True)
class Tip:
    """Tip radius [m] and the key, with its value, that it comes from.

    of_radius : the key's value by the magnitude of the radius [m]; unit : of the key
    inference : sentence on what was inferred, empty where nothing was
    """

    radius: float
    origin: str
    key: Key
    of_radius: Callable[[float], float]
    unit: str = "mm"
    inference: str = ""

    def refusal(self, where: str, error: GeometryError) -> InputError:
        """The error on this tip, with the limit of its key."""
        if error.bound is None:
            return InputError(f"{where}; tip radius {error.message}")
        return Refusal(self.key, where, error.bound.mapped(self.of_radius), self.unit)


@dataclass(frozen=True, kw_only=True)
class Blank(Involute):
    """A gear before its tip is known; lengths in metres, angles in radians.

    Module and pressure angle are those of the section across the axis.

    helix_angle : on the reference cylinder, right-handed positive, of an internal gear
        left-handed
    """

    entry: GearEntry
    helix_angle: float = 0.0

    @property
    def sign(self) -> int:
        return -1 if self.entry.internal else 1

    @property
    def twist(self) -> float:
        return math.tan(self.helix_angle) / self.reference_radius

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
        return 1.25 * self.normal_module if dedendum_mm is None else dedendum_mm * MM

    @property
    def widest_rack_tip(self) -> float:
        """Rounding at which the tool's tip has no flat left; below 0 none fits."""
        if self.entry.internal:
            # a tooth that no cutter cuts is refused for its thickness
            return self.cutter.widest_rounding if self.cutter else math.inf
        alpha, tooth = self.pressure_angle, self.thickness
        shift = tooth.profile_shift * self.module
        shift_width = 2.0 * shift * math.tan(alpha)
        half_space = 0.5 * (0.5 * math.pi * self.module - shift_width + tooth.thinning)
        flat_width = half_space - (self.dedendum - shift) * math.tan(alpha)
        return flat_width / self._rack_tip_slope

    @property
    def _rack_tip_slope(self) -> float:
        """What a rack tip takes of the flat over its rounding."""
        alpha = self.pressure_angle
        if self.helix_angle == 0.0:
            return 1.0 / math.cos(alpha) - math.tan(alpha)
        stretch = 1.0 / math.cos(self.helix_angle)
        return math.hypot(stretch, math.tan(alpha)) - math.tan(alpha)

    @property
    def cutter(self) -> ShaperCutter | None:
        """Cutter of an internal gear with sharp tips, None where there is none."""
        if self.cutter_teeth > self.teeth - MIN_CUTTER_TEETH:
            return None  # refused with the tooth
        tooth = self.thickness
        rack_thickness, thickness_per_shift = thickness_of_rack(self)
        thickness = (
            rack_thickness + thickness_per_shift * tooth.profile_shift - tooth.thinning
        )
        half_angle = 0.5 * thickness / self.reference_radius + involute(
            self.pressure_angle
        )
        root_radius = (
            self.reference_radius + tooth.profile_shift * self.module - self.dedendum
        )
        try:
            return shaper_cutter(self, half_angle, root_radius, self.cutter_teeth)
        except ThickTooth:
            return None

    @property
    def cutter_teeth(self) -> int:
        """Number of teeth of the cutter: a third of the ring's by default."""
        if self.entry.cutter_teeth is not None:
            return self.entry.cutter_teeth
        fewest_teeth = min(MIN_DEFAULT_CUTTER_TEETH, self.teeth - MIN_CUTTER_TEETH)
        return max(fewest_teeth, self.teeth // 3)

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
        return min(0.3 * self.normal_module, self.widest_rack_tip)

    @property
    def given_tip(self) -> Tip | None:
        entry = self.entry
        if entry.tip_radius_mm is not None:
            origin = f"tip_radius_mm = {shown(entry.tip_radius_mm)}"
            return self.tip_of_radius(self.sign * entry.tip_radius_mm * MM, origin)
        if entry.tip_diameter_mm is not None:
            origin = f"tip_diameter_mm = {shown(entry.tip_diameter_mm)}"
            radius = 0.5 * self.sign * entry.tip_diameter_mm * MM
            key = self.key("tip_diameter_mm")
            return Tip(radius, origin, key, lambda radius: 2.0 * radius / MM)
        if entry.addendum_mm is not None:
            return self._tip_of_addendum(entry.addendum_mm * MM)
        return None

    def key(self, name: str) -> Key:
        return Key("gear", self.entry.name, (name,))

    def tip_of_radius(self, radius: float, origin: str) -> Tip:
        key = self.key("tip_radius_mm")
        return Tip(radius, origin, key, lambda radius: radius / MM)

    def _tip_of_addendum(self, addendum: float, by_default: str = "") -> Tip:
        origin = f"addendum_mm = {shown(addendum / MM)}{by_default}"
        key, radius = self.key("addendum_mm"), self.reference_radius + addendum

        def of_radius(radius: float) -> float:
            return (self.sign * radius - self.reference_radius) / MM

        return Tip(radius, origin, key, of_radius)

    def default_tip(self, shortening: float = 0.0) -> Tip:
        """The tip without keys; shortening : of the addendum [m]."""
        shifted = self.normal_module + self.thickness.profile_shift * self.module
        addendum = shifted - shortening
        return self._tip_of_addendum(addendum, " by default")

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
            raise self._refusal(error, tip) from None
        require_measurable(self.entry, gear)
        return gear

    def _gear(self, sizes: dict[str, Any]) -> SpurGear:
        if self.entry.internal:
            sizes |= {"cutter_teeth": self.cutter_teeth, "foundation": self.foundation}
            if self.helix_angle:
                return HelicalInternalGear(**sizes, helix_angle=self.helix_angle)
            return InternalGear(**sizes)
        if self.helix_angle:
            return HelicalGear(**sizes, helix_angle=self.helix_angle)
        return SpurGear(**sizes)

    def _refusal(self, error: GeometryError, tip: Tip) -> InputError:
        where = f'gear "{self.entry.name}"'
        if error.field == "tip_radius":
            return tip.refusal(f"{where}: {tip.origin}", error)
        if error.field in ("profile_shift", "tooth_thinning") and (
            origin := self.thickness.origin
        ):
            quantity = error.field.replace("_", " ")
            return InputError(f"{where}: {origin}; {quantity} {error.message}")
        field, bound = error.field, error.bound
        if field == "pressure_angle" and bound is not None:
            return self._refusal_of_angle(where, bound)
        if field == "rack_tip_radius" and self.rack_tip_radius <= 0.0:
            field, bound = "dedendum", self._dedendum_bound
        key, factor, unit = self._key_and_unit(field)
        stated_value = f"{where}: {self._stated_value(key)}"
        if bound is None:
            return InputError(f"{stated_value}; {error.message.partition('; ')[2]}")
        if field == "rack_tip_radius" and self.thickness.origin:
            reason = f"{bound.reason}; {self.thickness.origin}"
            bound = replace(bound, reason=reason)
        return Refusal(self.key(key), stated_value, in_unit(bound, factor), unit)

    def _refusal_of_angle(self, where: str, bound: Bound) -> InputError:
        """The error on a pressure angle across the axis, in the key that states it."""
        key = self.entry.pressure_angle_key

        def of_angle(angle: float) -> float:
            return value_of_angle(key, angle, self.helix_angle)

        stated_value = f"{where}: {self._stated_value(key)}"
        return Refusal(self.key(key), stated_value, bound.mapped(of_angle), "deg")

    def _key_and_unit(self, field: str) -> tuple[str, float, str]:
        """Key of a field of the gear as the file has it, its unit [SI] and name."""
        if field == "hub_radius" and self.entry.internal:
            return "rim_radius_mm", MM, "mm"
        if field == "hub_radius" and self.entry.hub_diameter_mm is not None:
            return "hub_diameter_mm", 0.5 * MM, "mm"
        if field == "module":
            return self.entry.module_key, MM, "mm"
        key = GEAR_KEYS[field]
        return (key, MM, "mm") if key.endswith("_mm") else (key, 1.0, "")

    @property
    def _dedendum_bound(self) -> Bound:
        """Dedendum at which the tool's tip is a sharp point."""
        if self.entry.internal:
            cutter = require_present(self.cutter, "cutter")
            reach = cutter.pointed_tip_radius + cutter.center_distance
            shifted = self.reference_radius + self.thickness.profile_shift * self.module
            reason = f"the tip of a cutter of {self.cutter_teeth} teeth is pointed"
            return Bound("must be below", shifted + reach, reason)
        alpha = self.pressure_angle
        slack = self.widest_rack_tip * self._rack_tip_slope
        reason = "the space has no room for the rack tip"
        largest = self.dedendum + slack / math.tan(alpha)
        return Bound("must be below", largest, reason)

    def _stated_value(self, key: str) -> str:
        """'key = value' as given, or as it was filled in."""
        if key in self.entry.model_fields_set:
            return f"{key} = {shown(getattr(self.entry, key))}"
        default_values = {
            "pressure_angle_deg": self.entry.rack_value("pressure_angle_deg"),
            "dedendum_mm": self.dedendum / MM,
            "rack_tip_radius_mm": self.rack_tip_radius / MM,
            "profile_shift": self.thickness.profile_shift / self.helix_cosine,
            "tooth_thinning_um": self.thickness.thinning / UM,
            "cutter_teeth": self.cutter_teeth,
        }
        value = default_values.get(key, getattr(self.entry, key))
        return f"{key} = {shown(value)} by default"


def blank_of(entry: GearEntry, hand: int = 1) -> Blank:
    """The gear before its tip is known; hand : of its helix, 1 right or -1 left."""
    module_key, angle_key = entry.module_key, entry.pressure_angle_key
    helix = math.radians(entry.helix_angle_deg)
    return Blank(
        teeth=entry.teeth,
        module=module_across(module_key, entry.rack_value(module_key), helix),
        pressure_angle=angle_across(angle_key, entry.rack_value(angle_key), helix),
        entry=entry,
        helix_angle=hand * helix * (-1 if entry.internal else 1),
    )
