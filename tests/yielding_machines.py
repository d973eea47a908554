"""Gear sets of small helical teeth on shafts that yield, which tests share."""

from __future__ import annotations

from typing import Any

from fegear.gearset import make_gear_set
from fegear.statics.settings import StaticsSettings

SETTINGS = StaticsSettings(
    resolution="coarse",
    positions=4,
    estimate_error=False,
    root_stress=False,
    corner_contact=False,  # forces of corners leave the line of action
)
TEETH, HUBS = (19, 30), (9.0, 16.0)
TORQUE = 120.0


def shaft_of(names: tuple[str, ...]) -> dict[str, Any]:
    """Keys of a shaft on two bearings that carries one gear or two."""
    stiffnesses = {"kx": 2e8, "ky": 3e8, "kz": 1e8}
    return {
        "gears": list(names),
        "positions_mm": [45.0, 95.0][-len(names) :],
        "lengths_mm": [150.0],
        "diameters_mm": [25.0],
        "bearing_positions_mm": [5.0, 145.0],
        **{f"bearing_{k}_N_per_m": [v, v] for k, v in stiffnesses.items()},
    }


def one_stage(**shaft) -> Any:
    """One mesh of these teeth, gears off the middle of their shafts."""
    return make_gear_set(
        {
            "name": "one stage",
            "defaults": {
                "module_mm": 2.0,
                "face_width_mm": 16.0,
                "helix_angle_deg": 17.0,
            },
            "gear": [
                {"name": name, "teeth": teeth, "hub_radius_mm": hub}
                for name, teeth, hub in zip("ab", TEETH, HUBS, strict=True)
            ],
            "mesh": [{"driver": "a", "driven": "b", "backlash_um": 50.0}],
            "shaft": [shaft_of((name,)) | shaft for name in "ab"],
            "load": {"gear": "a", "torques_Nm": [TORQUE]},
        }
    )


def two_stages(**shaft) -> Any:
    """Two meshes of the same teeth on three shafts."""
    return make_gear_set(tables_of_two_stages(**shaft))


def tables_of_two_stages(**shaft) -> dict[str, Any]:
    """Tables of `two_stages`, with keys of all shafts."""
    shafts = [("a",), ("b", "c"), ("d",)]
    mesh = {"backlash_um": 50.0}
    gears = [("a", 0), ("b", 1), ("c", 0), ("d", 1)]
    tables = {
        "name": "two stages",
        "defaults": {
            "module_mm": 2.0,
            "face_width_mm": 16.0,
            "helix_angle_deg": 17.0,
        },
        "gear": [
            {"name": name, "teeth": TEETH[size], "hub_radius_mm": HUBS[size]}
            for name, size in gears
        ],
        "mesh": [
            {"driver": "a", "driven": "b", **mesh},
            {"driver": "c", "driven": "d", "center_line_deg": 70.0, **mesh},
        ],
        "shaft": [shaft_of(names) | shaft for names in shafts],
        "load": {"gear": "a", "torques_Nm": [TORQUE]},
    }
    tables["gear"][0]["hand"], tables["gear"][2]["hand"] = "right", "left"
    return tables
