"""A helical pair whose compliances over the width several files of tests share."""

from __future__ import annotations

HELICAL = {
    "name": "helical",
    "defaults": {"module_mm": 3.0, "helix_angle_deg": 18.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "one", "teeth": 18, "hub_radius_mm": 14.0, "tooth_thinning_um": 60.0},
        {"name": "two", "teeth": 25, "hub_radius_mm": 18.0},
    ],
    "mesh": [{"driver": "one", "driven": "two", "backlash_um": 60.0}],
    "load": {"gear": "one", "torques_Nm": [60.0, 120.0]},
    "dynamics": {"damping_ratio": 0.05},
}
