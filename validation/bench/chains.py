"""Chains of different gears, each of which drives the next: trains of any size."""

from __future__ import annotations

import math
from typing import Any

from fegear.gearset.model import GearSet
from fegear.gearset.read import make_gear_set

MODULE_MM = 2.5
FACE_WIDTH_MM = 20.0
FIRST_TEETH, TEETH_STEP, TEETH_RANGE = 23, 10, 27  # 10 and 27 share no factor
HUB_RATIO = 0.5  # of the pitch radius
CENTER_LINES_DEG = 0.0, 40.0  # of odd and of even meshes
DISTANCE_RATIO = 1.002  # of the sum of pitch radii, for some backlash
TORQUE_NM = 100.0


def chain_teeth(gears: int) -> list[int]:
    """Numbers of teeth of a chain, all different up to 27 gears."""
    return [FIRST_TEETH + TEETH_STEP * k % TEETH_RANGE for k in range(gears)]


def chain(gears: int) -> GearSet:
    """A chain of different gears; phases follow from the directions of its centres."""
    teeth = chain_teeth(gears)
    return make_gear_set(
        {
            "name": f"chain-{gears}",
            "description": f"Chain of {gears} different gears",
            "defaults": {"module_mm": MODULE_MM, "face_width_mm": FACE_WIDTH_MM},
            "gear": [_gear(k, z) for k, z in enumerate(teeth)],
            "mesh": [_mesh(k, teeth) for k in range(gears - 1)],
            "load": {"gear": _name(0), "torques_Nm": [TORQUE_NM]},
        }
    )


def _name(number: int) -> str:
    return f"gear-{number + 1}"


def _gear(number: int, teeth: int) -> dict[str, Any]:
    hub_radius = HUB_RATIO * 0.5 * MODULE_MM * teeth
    return {"name": _name(number), "teeth": teeth, "hub_radius_mm": hub_radius}


def _mesh(number: int, teeth: list[int]) -> dict[str, Any]:
    radii = 0.5 * MODULE_MM * (teeth[number] + teeth[number + 1])
    return {
        "driver": _name(number),
        "driven": _name(number + 1),
        "center_distance_mm": math.floor(1e3 * DISTANCE_RATIO * radii) / 1e3,
        "center_line_deg": CENTER_LINES_DEG[number % 2],
    }
