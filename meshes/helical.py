"""Helical gears: their transverse section, cut by a tool known in the normal one.

The section across the axis is that of a spur gear with the transverse module and
pressure angle. The rack's tip is rounded by a circle in the normal section, hence by an
ellipse across the axis, wider by 1 / cos(helix angle). The tips of a shaper cutter are
rounded by a circle across the axis, in which it turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from meshes.gear import SpurGear, apart_from, require
from meshes.internal import InternalGear

MAX_HELIX_ANGLE = math.radians(45.0)


@dataclass(frozen=True, kw_only=True)
class HelicalGear(SpurGear):
    """External helical gear.

    Module, pressure angle, profile shift (in modules) and tooth thinning are those of
    the transverse section.

    rack_tip_radius : rounding of the rack tip in the normal section
    helix_angle : on the reference cylinder [rad], positive right-handed

    Raises GeometryError if no such gear can be cut.
    """

    helix_angle: float

    def __post_init__(self) -> None:
        _require_helix(self.helix_angle)
        super().__post_init__()

    @property
    def twist(self) -> float:
        return math.tan(self.helix_angle) / self.reference_radius

    @property
    def rack_tip_half_width(self) -> float:
        slope = math.tan(self.pressure_angle)
        return self.rack_tip_radius * math.hypot(
            1.0 / math.cos(self.helix_angle), slope
        )

    @property
    def rack_tip_rounding(self) -> float:
        alpha = self.pressure_angle
        _, down, _ = self.rack_tip_offset(math.cos(alpha), math.sin(alpha))
        return self.rack_tip_radius - float(down)

    def rack_tip_offset(self, sin: Any, cos: Any) -> tuple[Any, Any, Any]:
        squared = 1.0 / math.cos(self.helix_angle) ** 2
        scale = self.rack_tip_radius / np.sqrt(squared * sin**2 + cos**2)
        across, down = scale * squared * sin, scale * cos
        return across, down, across - down * (sin / cos)


@dataclass(frozen=True, kw_only=True)
class HelicalInternalGear(InternalGear):
    """Internal helical gear.

    Module, pressure angle, profile shift (in modules) and tooth thinning are those of
    the transverse section, and so is the rounding of the cutter's tips.

    helix_angle : on the reference cylinder [rad], which has a negative radius: positive
        left-handed. A gear that has the same hand as an internal one, its mate, thus
        has the opposite angle, as two external gears in mesh have.

    Raises GeometryError if no such gear can be cut.
    """

    helix_angle: float

    def __post_init__(self) -> None:
        _require_helix(self.helix_angle)
        super().__post_init__()

    @property
    def twist(self) -> float:
        return math.tan(self.helix_angle) / self.reference_radius


def _require_helix(angle: float) -> None:
    degrees = math.degrees(angle)
    ok = 0.0 < abs(angle) <= MAX_HELIX_ANGLE
    most = f"{math.degrees(MAX_HELIX_ANGLE):g}"
    allowed = f"must be above 0, at most {most} deg"
    require("helix_angle", ok, f"{apart_from(degrees, most)} deg", allowed)
