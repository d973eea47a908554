"""Helical gear: its transverse section, cut by a rack that is known in the normal one.

The section across the axis is that of a spur gear with the transverse module and
pressure angle. The rack's tip is rounded by a circle in the normal section, hence by an
ellipse across the axis, wider by 1 / cos(helix angle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from meshes.gear import SpurGear, apart_from, require

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
        degrees = math.degrees(self.helix_angle)
        ok = 0.0 < abs(self.helix_angle) <= MAX_HELIX_ANGLE
        most = f"{math.degrees(MAX_HELIX_ANGLE):g}"
        allowed = f"must be above 0, at most {most} deg"
        require("helix_angle", ok, f"{apart_from(degrees, most)} deg", allowed)
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
