"""Held-out random gear sets with fixed seeds.

Ten pairs, ten idlers and ten counter-shafts in turn. A set is what its number draws
first that the program accepts and that fits the ranges below; which sets these are
does not depend on any result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset import GearSet, make_gear_set
from fegear.gearset.inertia import body_inertia
from meshes.involute import inverse_involute, involute

NAME = "random-sets"  # of all together, as a case has one
SEED = 602214076, 1380649  # of all sets, before the number of each
COUNT = 30
TEETH = 17, 120
MODULES_MM = 1.5, 5.0
HUBS = 0.2, 0.8  # over the root radius
WIDTHS = 8.0, 14.0  # over the module
SHIFTS = -0.2, 0.5
MIN_SHIFTED_IN = 25  # fewer teeth get no negative shift
THINNING = 5.0, 15.0  # um for each mm of the module
RELIEF_UM, RELIEF_PITCHES = (5.0, 30.0), (0.15, 0.45)
# parts of meshes, gears and shafts
RELIEVED_SHARE, HEAVY_SHARE, SPRUNG_SHARE = 0.5, 0.3, 0.5
INERTIA = 1.0, 3.0  # given ones over the body's
LINE_LOAD = 50e3, 300e3  # N/m
DAMPING = 0.02, 0.06
CENTER_LINE_DEG = -60.0, 60.0
SHAFT = 1e4, 1e6  # N m/rad
RATIOS = (1, 2), (1, 3), (2, 3), (3, 4), (2, 5), (3, 5)  # teeth on a counter-shaft
ROOT, PRESSURE_ANGLE_DEG = 1.25, 20.0  # dedendum over the module
Tables = dict[str, Any]
Range = tuple[float, float]


def random_gear_set(number: int) -> GearSet:
    """One of the sets, numbered from 0, with one torque; the same on every machine.

    Raises ValueError for a number that no set has.
    """
    if not 0 <= number < COUNT:
        raise ValueError(f"number = {number}; must be from 0 to {COUNT - 1}")
    rng = np.random.default_rng([*SEED, number])
    kind = kind_of(number)
    while True:
        tables = KINDS[kind](rng) | {"name": f"{kind}-{number + 1}"}
        try:
            plain = make_gear_set(tables)
            give_inertias(tables, plain, rng)
            torque = draw_torque(plain, rng)
            tables["load"] = {"gear": "a", "torques_Nm": [torque]}
            return make_gear_set(tables)
        except InputError:
            continue  # the next that this number draws


def kind_of(number: int) -> str:
    return list(KINDS)[number % len(KINDS)]


def draw_pair(rng: np.random.Generator) -> Tables:
    return _random_tables(
        rng,
        [
            _random_gears(
                rng, _random_module(rng), _random_teeth(rng), _random_teeth(rng)
            )
        ],
    )


def draw_idler(rng: np.random.Generator) -> Tables:
    teeth = _random_teeth(rng), _random_teeth(rng), _random_teeth(rng)
    return _random_tables(rng, [_random_gears(rng, _random_module(rng), *teeth)])


def draw_counter_shaft(rng: np.random.Generator) -> Tables:
    """Teeth on the shaft in a small ratio: both meshes repeat together soon."""
    p, q = RATIOS[rng.integers(len(RATIOS))]
    lowest, highest = math.ceil(TEETH[0] / p), TEETH[1] // q
    common = int(rng.integers(lowest, highest + 1))
    stages = [(_random_teeth(rng), q * common), (p * common, _random_teeth(rng))]
    tables = _random_tables(
        rng,
        [_random_gears(rng, _random_module(rng), *teeth_pair) for teeth_pair in stages],
    )
    shaft: Tables = {"gears": ["b", "c"]}
    if rng.random() < SPRUNG_SHARE:
        shaft["stiffness_Nm_per_rad"] = float(np.exp(rng.uniform(*np.log(SHAFT))))
    return tables | {"shaft": [shaft]}


KINDS: dict[str, Callable[[np.random.Generator], Tables]] = {
    "pair": draw_pair,
    "idler": draw_idler,
    "counter-shaft": draw_counter_shaft,
}


def give_inertias(tables: Tables, plain: GearSet, rng: np.random.Generator) -> None:
    """Give some gears of the tables an inertia; plain : the gear set without."""
    for entry, gear in zip(tables["gear"], plain.gears, strict=True):
        if rng.random() < HEAVY_SHARE:
            entry["inertia_kg_m2"] = body_inertia(gear) * rng.uniform(*INERTIA)


def draw_torque(plain: GearSet, rng: np.random.Generator) -> float:
    """On the input gear [N m], so that the line load of every mesh is in its range.

    Raises InputError where none is.
    """
    per_torque = line_loads(plain)
    low, high = LINE_LOAD[0] / min(per_torque), LINE_LOAD[1] / max(per_torque)
    if low > high:
        raise InputError(
            f"{plain.name}: line loads over torque are {per_torque}; "
            f"allowed are ratios up to {LINE_LOAD[1] / LINE_LOAD[0]:g}"
        )
    return float(f"{rng.uniform(low, high):.4g}")


def line_loads(gear_set: GearSet) -> list[float]:
    """Load of each mesh over its face width, per torque on the input gear [1/m2]."""
    loads, torque = [], 1.0
    for number, mesh in enumerate(gear_set.meshes):
        driver, driven = mesh.pair.driver, mesh.pair.driven
        loads.append(torque / driver.base_radius / gear_set.common_width(number))
        torque *= driven.teeth / driver.teeth
    return loads


def _random_tables(rng: np.random.Generator, stages: list[list[Tables]]) -> Tables:
    """Tables of gears that mesh in a row, stage by stage."""
    gears = [gear for stage in stages for gear in stage]
    for name, gear in zip("abcd", gears, strict=False):
        gear["name"] = name
    meshes = [
        _random_mesh(rng, one, two) for stage in stages for one, two in pairwise(stage)
    ]
    if len(stages) > 1:
        meshes[-1]["phase"] = rng.uniform(0.0, 1.0)
    damping = {"damping_ratio": rng.uniform(*DAMPING)}
    return {"gear": gears, "mesh": meshes, "dynamics": damping}


def _random_gears(rng: np.random.Generator, module: float, *teeth: int) -> list[Tables]:
    return [_random_gear(rng, module, tooth_count) for tooth_count in teeth]


def _random_gear(rng: np.random.Generator, module: float, teeth: int) -> Tables:
    lowest = 0.0 if teeth < MIN_SHIFTED_IN else SHIFTS[0]
    shift = rng.uniform(lowest, SHIFTS[1])
    root = module * (0.5 * teeth + shift - ROOT)
    return {
        "teeth": teeth,
        "module_mm": module,
        "pressure_angle_deg": PRESSURE_ANGLE_DEG,
        "profile_shift": shift,
        "face_width_mm": module * rng.uniform(*WIDTHS),
        "hub_radius_mm": root * rng.uniform(*HUBS),
        "tooth_thinning_um": module * rng.uniform(*THINNING),
    }


def _random_mesh(rng: np.random.Generator, one: Tables, two: Tables) -> Tables:
    """At the centre distance without backlash but for the thinning of the teeth."""
    angle = math.radians(PRESSURE_ANGLE_DEG)
    shifts, teeth = (one[k] + two[k] for k in ("profile_shift", "teeth"))
    working = involute(angle) + 2.0 * shifts / teeth * math.tan(angle)
    mesh = {
        "driver": one["name"],
        "driven": two["name"],
        "operating_pressure_angle_deg": math.degrees(inverse_involute(working)),
        "center_line_deg": rng.uniform(*CENTER_LINE_DEG),
    }
    if rng.random() < RELIEVED_SHARE:
        mesh["tip_relief"] = {
            "magnitude_um": rng.uniform(*RELIEF_UM),
            "length_pitches": rng.uniform(*RELIEF_PITCHES),
            "shape": str(rng.choice(["linear", "parabolic"])),
        }
    return mesh


def _random_teeth(rng: np.random.Generator) -> int:
    return int(rng.integers(TEETH[0], TEETH[1] + 1))


def _random_module(rng: np.random.Generator) -> float:
    return round(float(rng.uniform(*MODULES_MM)), 2)
