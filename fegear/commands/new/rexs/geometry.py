"""Sizes and places of parts of a REXS model, in mm and degrees."""

from __future__ import annotations

import math

from fegear.commands.new.rexs.components import Component
from fegear.commands.new.rexs.stages import Stage

MAX_MISPLACED = 0.01  # of the centre distance: positions say the same


def root_of_tool(tool: Component, module: float) -> dict[str, float]:
    """Dedendum of a gear, the addendum of its tool, and the rounding of its tip."""
    result = {}
    for key, length, factor in (
        (
            "dedendum_mm",
            "addendum_reference_profile",
            "addendum_coefficient_reference_profile",
        ),
        ("rack_tip_radius_mm", "tip_radius", "tip_radius_factor"),
    ):
        value = tool.quantity(length, "length")
        relative = tool.quantity(factor, "ratio")
        if value is None and relative is not None:
            value = relative * module
        if value is not None and value > 0.0:
            result[key] = value
    return result


def diameter_at(section: Component, position: float) -> float | None:
    """Outer diameter of a section of a shaft, None beside it."""
    start = section.quantity("u_coordinate_on_shaft", "length")
    length = section.quantity("length", "length")
    first = section.quantity("outer_diameter_begin", "length")
    if start is None or not length or first is None:
        return None
    part = (position - start) / length
    if not 0.0 <= part <= 1.0:
        return None
    last = section.quantity("outer_diameter_end", "length")
    return first if last is None else first + part * (last - first)


def center_line(stage: Stage, distance: float) -> float | None:
    """Direction from driver to driven gear, by their places across the u axis."""
    places = [gear.vector("support_vector") for gear in stage.gears]
    if places[0] is None or places[1] is None:
        return None
    across, up = (places[1][n] - places[0][n] for n in (1, 2))
    if abs(math.hypot(across, up) - distance) > MAX_MISPLACED * distance:
        return None
    return math.degrees(math.atan2(up, across))
