"""Two gears on shafts with rolling bearings, which tests share."""

from __future__ import annotations

TORQUE = 30.0
BALLS = {"balls": 9, "ball_diameter_mm": 7.94, "pitch_diameter_mm": 38.5}
ROLLERS = {
    "rollers": 13,
    "roller_diameter_mm": 7.5,
    "roller_length_mm": 7.5,
    "pitch_diameter_mm": 39.0,
    "clearance_um": 5.0,
}
PRELOADED = [
    {"ball_bearing": BALLS, "contact_angle_deg": angle, "axial_preload_um": 5.0}
    for angle in (25.0, -25.0)
]
FLOATING = [
    {"ball_bearing": BALLS | {"clearance_um": 10.0}},
    {"roller_bearing": ROLLERS},
]


def machine_tables(bearings, helix_angle_deg=17.0):
    """Two gears, each on a shaft of its own."""
    return {
        "name": "rolling",
        "defaults": {
            "module_mm": 2.0,
            "face_width_mm": 16.0,
            "helix_angle_deg": helix_angle_deg,
        },
        "gear": [
            {"name": "a", "teeth": 19, "hub_radius_mm": 10.0}
            | ({"hand": "right"} if helix_angle_deg else {}),
            {"name": "b", "teeth": 25, "hub_radius_mm": 12.0},
        ],
        "mesh": [{"driver": "a", "driven": "b", "backlash_um": 50.0}],
        "shaft": [
            {
                "gears": [name],
                "positions_mm": [45.0],
                "lengths_mm": [150.0],
                "diameters_mm": [25.0],
                "bearing_positions_mm": [5.0, 145.0],
                "rolling_bearings": entries,
            }
            for name, entries in zip("ab", bearings, strict=True)
        ],
        "load": {"gear": "a", "torques_Nm": [TORQUE]},
    }
