"""Small gear sets: of few teeth, of one of each kind of body and bearing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

Tables = dict[str, Any]
PAIR: Tables = {
    "name": "small",
    "defaults": {
        "module_mm": 2.0,
        "face_width_mm": 10.0,
        "hub_radius_mm": 8.0,
        "profile_shift": 0.1,
    },
    "gear": [
        {"name": "a", "teeth": 19, "inertia_kg_m2": 1e-4, "mass_kg": 0.2},
        {"name": "b", "teeth": 23, "inertia_kg_m2": 2e-4, "mass_kg": 0.3},
    ],
    "mesh": [
        {
            "driver": "a",
            "driven": "b",
            "operating_pressure_angle_deg": 24.0,
            "mean_stiffness_N_per_m": 1e8,
            "stiffness_variation": 0.3,
        }
    ],
    "load": {"gear": "a", "torques_Nm": [20.0]},
}
TRAIN = PAIR | {
    "gear": [
        PAIR["gear"][0],
        PAIR["gear"][1] | {"bearing_kx_N_per_m": 2e8, "bearing_ky_N_per_m": 3e8},
        {"name": "c", "teeth": 29, "inertia_kg_m2": 5e-4, "mass_kg": 0.5},
    ],
    "mesh": [
        PAIR["mesh"][0],
        PAIR["mesh"][0] | {"driver": "b", "driven": "c"},
    ],
}
BALLS = {"balls": 9, "ball_diameter_mm": 7.94, "pitch_diameter_mm": 38.5}
ROLLERS = {
    "rollers": 12,
    "roller_diameter_mm": 7.5,
    "roller_length_mm": 8.0,
    "pitch_diameter_mm": 39.0,
}
ROLLING, ROLLED = (
    PAIR | {"gear": [PAIR["gear"][0] | {key: bearing}, PAIR["gear"][1]]}
    for key, bearing in (("ball_bearing", BALLS), ("roller_bearing", ROLLERS))
)
TWO_BEARINGS = PAIR | {
    "gear": [
        PAIR["gear"][0] | {"ball_bearing": BALLS},
        PAIR["gear"][1] | {"roller_bearing": ROLLERS},
    ]
}
SHAFT = TRAIN | {
    "mesh": [
        PAIR["mesh"][0],
        PAIR["mesh"][0] | {"driver": "c", "driven": "d"},
    ],
    "gear": [*TRAIN["gear"], TRAIN["gear"][2] | {"name": "d"}],
    "shaft": [{"gears": ["b", "c"], "stiffness_Nm_per_rad": 1e4}],
}
STIFF_BEARING = {"bearing_kx_N_per_m": 1e8, "bearing_ky_N_per_m": 1e8}
STATED = {"mean_stiffness_N_per_m": 1e8, "stiffness_variation": 0.3, "load_share": 0.5}
PLANETARY: Tables = {
    "name": "planetary",
    "defaults": {
        "module_mm": 2.0,
        "face_width_mm": 10.0,
        "tooth_thinning_um": 40.0,
        **STIFF_BEARING,
    },
    "gear": [
        {"name": "s", "teeth": 24, "hub_radius_mm": 12.0},
        {"name": "p", "teeth": 36, "hub_radius_mm": 20.0},
        {"name": "r", "teeth": 96, "internal": True, "rim_radius_mm": 112.0},
    ],
    "planetary": [
        {
            "sun": "s",
            "planet": "p",
            "ring": "r",
            "planets": 3,
            **{f"carrier_{key}": value for key, value in STIFF_BEARING.items()},
            "sun_mesh": STATED,
            "ring_mesh": STATED,
        }
    ],
    "load": {"gear": "s", "torques_Nm": [20.0]},
}
BENT = PAIR | {
    "shaft": [
        {
            "gears": [name],
            "positions_mm": [60.0],
            "lengths_mm": [100.0, 80.0],
            "diameters_mm": [16.0, 20.0],
            "bores_mm": [2.0, 4.0],
            "bearing_positions_mm": [10.0, 150.0],
            "bearing_kx_N_per_m": [5e7, 4e7],
            "bearing_ky_N_per_m": [6e7, 3e7],
            "bearing_kxy_N_per_m": [0.0, 1e6],
            "bearing_kyx_N_per_m": [0.0, -1e6],
            "bearing_kz_N_per_m": [2e7, 0.0],
            "bearing_tilt_stiffness_Nm_per_rad": [3e3, 0.0],
            "bearing_cx_Ns_per_m": [100.0, 50.0],
            "bearing_cy_Ns_per_m": [100.0, 50.0],
            "disk_positions_mm": [180.0],
            "disk_masses_kg": [0.5],
            "disk_inertias_kg_m2": [4e-4],
            "disk_transverse_inertias_kg_m2": [3e-4],
        }
        for name in ("a", "b")
    ]
}
HOUSED = BENT | {
    "defaults": BENT["defaults"] | {"helix_angle_deg": 18.0},
    "housing": {"file": str(Path(__file__).parent / "housings/two-shafts.mat")},
}
SETS = {
    "pair": PAIR,
    "train": TRAIN,
    "rolling": ROLLING,
    "two-bearings": TWO_BEARINGS,
    "bent": BENT,
    "housed": HOUSED,
    "planetary": PLANETARY,
}
