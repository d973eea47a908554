"""No key changes nothing: each moves the answer of a command or is refused.

The list of keys comes from the schema of gear-set files, so that a new one fails here
until it has an entry.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest
from pydantic import BaseModel
from short_uses import SHORT_USES
from small_sets import (
    BALLS,
    BENT,
    PAIR,
    PLANETARY,
    ROLLED,
    ROLLERS,
    ROLLING,
    SHAFT,
    STIFF_BEARING,
    TRAIN,
    Tables,
)

from fegear import ExcitationSettings, LumpedModel, Map
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set
from fegear.gearset.edit import LISTS, edited
from fegear.gearset.problems import lists_tables, model_of
from fegear.gearset.schema import Document, GearDefaults, MeshKeys, replaced_keys
from fegear.train.lumped_models import lumped_system
from lumped.steady.maps import Axis

STIFF, COMPARE, MODES, BEARING, CAMPBELL, MOVING = (
    f"{command} {SHORT_USES[command].text} --json"
    for command in ("stiffness", "compare", "modes", "bearing", "campbell", "dynamics")
)
SHARING = "sharing SET --excitation rectangular --model 1 --json"
GIVEN_MODES = "modes SET --stiffness given --json"


class Key(NamedTuple):
    """Another value of a key, and the commands whose answer it moves; none: refused.

    tables : to start from; entry : its number in a list, from 1; all if 0
    """

    value: Any
    commands: tuple[str, ...] = ()
    tables: Tables = PAIR
    entry: int = 1


ONE_SWEEP = "sweep SET --speeds 4000 --excitation rectangular --json"
HARD = "sweep SET --speeds 3600 --excitation rectangular --damping-ratio 0.005 --json"
FINITE = "sweep SET --speeds 4000 --json"
PLANE = "modes SET --translations --json"
ELASTIC = MOVING.replace("quasistatic", "reduced")
SHOWN = "show SET --json"
TEETH = (STIFF, COMPARE, FINITE, MOVING)
SPAN = {"span_mm": 15.4, "span_teeth": 3}
PINS = {"pin_dimension_mm": 43.05, "pin_diameter_mm": 3.5}
MEASURED = PAIR | {"gear": [PAIR["gear"][0] | SPAN, PAIR["gear"][1]]}
PINNED = PAIR | {"gear": [PAIR["gear"][0] | PINS, PAIR["gear"][1]]}
OTHER_BEARING = {
    "pitch_diameter_mm": 40.0,
    "clearance_um": 10.0,
    "film_thickness_um": 0.5,
    "runout_um": 2.0,
    "inner_waviness_um": [0.0, 0.0, 0.5],
    "outer_waviness_um": [0.0, 0.0, 0.5],
    "contact_stiffness_N_per_m_n": 1e10,
}
# of the cage; that of a line contact has no part in its stiffness
KINEMATIC = {"pitch_diameter_mm", "roller_diameter_mm"}
# a runout turns with the shaft, and leaves the stiffness of the bearing as it is
RUNNING = "motion SET --speed 2000 --translations --model 1 --excitation rectangular"
ROLLED_PLANE = {"runout_um": f"{RUNNING} --json"}
OTHER_BALLS = OTHER_BEARING | {
    "balls": 8,
    "ball_diameter_mm": 7.5,
    "race_conformity": 0.53,
}
OTHER_ROLLERS = OTHER_BEARING | {
    "rollers": 13,
    "roller_diameter_mm": 7.0,
    "roller_length_mm": 7.0,
}
COMPANIONS = {  # keys that a key needs beside it
    **dict.fromkeys(STIFF_BEARING, STIFF_BEARING),
    **dict.fromkeys(SPAN, SPAN),
    **dict.fromkeys(PINS, PINS),
    "ball_bearing": {"ball_bearing": BALLS},
    "roller_bearing": {"roller_bearing": ROLLERS},
}
HELICAL = PAIR | {"defaults": PAIR["defaults"] | {"helix_angle_deg": 12.0}}
DOUBLE = HELICAL | {
    "gear": [gear | {"hand": "double", "gap_mm": 2.0} for gear in PAIR["gear"]]
}
HELICAL_BENT = HELICAL | {"shaft": BENT["shaft"]}
GEAR_KEYS = {
    "name": Key("z"),
    "teeth": Key(20, (*TEETH, ONE_SWEEP)),
    "module_mm": Key(2.1, (*TEETH, ONE_SWEEP), entry=0),
    "transverse_module_mm": Key(2.1, (SHOWN, STIFF), entry=0),
    "diametral_pitch_per_in": Key(12.0, (SHOWN, STIFF), entry=0),
    "transverse_diametral_pitch_per_in": Key(12.0, (SHOWN, STIFF), entry=0),
    "pressure_angle_deg": Key(21.0, (*TEETH, ONE_SWEEP), entry=0),
    "transverse_pressure_angle_deg": Key(21.0, (SHOWN, STIFF), entry=0),
    "profile_shift": Key(0.15, TEETH),
    "tip_radius_mm": Key(21.3, TEETH),
    "tip_diameter_mm": Key(42.6, TEETH),
    "addendum_mm": Key(2.3, TEETH),
    "dedendum_mm": Key(2.55, TEETH),
    "rack_tip_radius_mm": Key(0.5, (STIFF, FINITE, MOVING)),
    "helix_angle_deg": Key(15.0, (SHOWN, STIFF), entry=0),
    "hand": Key("left", (SHOWN,), HELICAL, entry=1),
    "gap_mm": Key(3.0, (SHOWN,), DOUBLE, entry=1),
    "face_width_mm": Key(9.0, TEETH),
    "hub_radius_mm": Key(9.0, TEETH),
    "hub_diameter_mm": Key(18.0, TEETH),
    "span_mm": Key(15.37, TEETH, MEASURED),
    "span_teeth": Key(2, (), MEASURED),
    "pin_dimension_mm": Key(42.97, TEETH, PINNED),
    "pin_diameter_mm": Key(3.48, TEETH, PINNED),
    "material": Key("ductile iron", (*TEETH, ELASTIC)),
    "tooth_thinning_um": Key(50.0, TEETH),
    "young_modulus_GPa": Key(150.0, (*TEETH, ELASTIC)),
    "poisson_ratio": Key(0.25, (*TEETH, ELASTIC)),
    "density_kg_per_m3": Key(8000.0, (ELASTIC,)),
    "inertia_kg_m2": Key(3e-4, (MODES, ONE_SWEEP, MOVING)),
    "mass_kg": Key(0.4, (PLANE,), TRAIN, entry=2),
    "pitch_errors_um": Key([5.0, *[0.0] * 18], (STIFF,)),
    "bearing_kx_N_per_m": Key(5e8, (PLANE,), TRAIN, entry=2),
    "bearing_ky_N_per_m": Key(5e8, (PLANE,), TRAIN, entry=2),
    **{
        f"{kind}.{name}": Key(
            other,
            (BEARING,)
            if name in KINEMATIC
            else (BEARING, ROLLED_PLANE.get(name, PLANE)),
            tables,
        )
        for kind, tables, values in (
            ("ball_bearing", ROLLING, OTHER_BALLS),
            ("roller_bearing", ROLLED, OTHER_ROLLERS),
        )
        for name, other in values.items()
    },
    "coupling_stiffness_Nm_per_rad": Key(1e4, (MODES, ONE_SWEEP, MOVING)),
}
CRACK = {"tooth": 3, "depth_mm": 1.0}
SPALL = {
    "tooth": 4,
    "start_roll_angle_deg": 20.0,
    "end_roll_angle_deg": 25.0,
    "width_share": 0.5,
}
WEAR = {"tooth": 5, "roll_angle_deg": [16.0, 35.0], "depth_um": [0.0, 4.0]}
FAULTS: Tables = {
    "cracks": [CRACK],
    "spalls": [SPALL],
    "broken_tips": [{"tooth": 6, "height_mm": 0.1}],
    "worn_teeth": [WEAR],
    "eccentricity_um": 4.0,
    "eccentricity_angle_deg": 20.0,
}
FAULTY = PAIR | {"gear": [PAIR["gear"][0] | FAULTS, PAIR["gear"][1]]}
FAULT_VALUES: Tables = {
    **{f"{name}.tooth": 8 for name in ("cracks", "spalls", "broken_tips")},
    "cracks.depth_mm": 1.5,
    "cracks.tangent_angle_deg": 40.0,
    "cracks.direction_deg": 70.0,
    "cracks.root": "back",
    "spalls.start_roll_angle_deg": 21.0,
    "spalls.end_roll_angle_deg": 24.0,
    "spalls.width_share": 0.4,
    "broken_tips.height_mm": 0.05,
    "worn_teeth.tooth": 8,
    "worn_teeth.depth_um": [0.0, 5.0],
    "worn_teeth.roll_angle_deg": [17.0, 36.0],
    "worn_teeth.diameter_mm": [37.5, 42.0],
    "worn_teeth.interpolation": "linear",
    "missing_teeth": [7],
    "eccentricity_um": 5.0,
    "eccentricity_angle_deg": 30.0,
}
FAULT_KEYS = {name: Key(v, (SHOWN,), FAULTY) for name, v in FAULT_VALUES.items()}
FAULT_KEYS["spalls.place_mm"] = Key(0.5, (SHOWN,), FAULTY)
LONG = {name: value for name, value in SPALL.items() if name != "width_share"}
CORNERED = PAIR | {
    "gear": [
        PAIR["gear"][0]
        | {
            "spalls": [LONG | {"length_mm": 2.0}],
            "broken_tips": [
                {"tooth": 6, "height_mm": 0.1, "length_mm": 3.0, "end": "near"}
            ],
        },
        PAIR["gear"][1],
    ]
}
FAULT_KEYS["spalls.length_mm"] = Key(3.0, (SHOWN,), CORNERED)
FAULT_KEYS["broken_tips.length_mm"] = Key(4.0, (SHOWN,), CORNERED)
FAULT_KEYS["broken_tips.end"] = Key("far", (SHOWN,), CORNERED)
RELIEF = {"magnitude_um": 8.0, "length_pitches": 0.3}
RELIEVED = PAIR | {"mesh": [PAIR["mesh"][0] | {"tip_relief": RELIEF}]}
HOLLOWED = PAIR | {"mesh": [PAIR["mesh"][0] | {"root_relief": RELIEF}]}
GEAR_RELIEFS = {
    f"{role}_{end}_relief": PAIR
    | {"mesh": [PAIR["mesh"][0] | {f"{role}_{end}_relief": RELIEF}]}
    for role in ("driver", "driven")
    for end in ("tip", "root")
}
RELIEFS = {"tip_relief": RELIEVED, "root_relief": HOLLOWED} | GEAR_RELIEFS


def relief_keys(relief: str, tables: Tables) -> dict[str, Key]:
    start = "HPSTC" if "tip" in relief else "LPSTC"
    angle = 31.0 if "tip" in relief else 20.0
    values = {
        "magnitude_um": 12.0,
        "length_pitches": 0.4,
        "start_roll_angle_deg": angle,
        "start": start,
        "shape": "parabolic",
    }
    return {
        f"mesh.{relief}.{name}": Key(setting, (STIFF, ONE_SWEEP), tables)
        for name, setting in values.items()
    }


POINTS = {"roll_angle_deg": [21.0, 25.0, 30.0], "deviation_um": [0.0, 3.0, -1.0]}
DIAMETERS = {
    "driver_profile": [37.0, 39.0, 42.0],
    "driven_profile": [44.5, 47.0, 50.0],
}
PROFILES = {
    name: PAIR | {"mesh": [PAIR["mesh"][0] | {name: POINTS}]}
    for name in ("profile", "driver_profile", "driven_profile")
}


def profile_keys(profile: str, tables: Tables) -> dict[str, Key]:
    values = {
        "crowning_um": 5.0,
        "slope_um": 3.0,
        "roll_angle_deg": [21.0, 26.0, 30.0],
        "deviation_um": [0.0, 2.0, -1.0],
        "interpolation": "linear",
    }
    cases = {
        name: Key(setting, (STIFF, ONE_SWEEP), tables)
        for name, setting in values.items()
    }
    cases["file"] = Key("none.csv", (), tables)
    # no diameters lie on the flanks of both gears
    commands = (STIFF, ONE_SWEEP) if profile in DIAMETERS else ()
    diameters = DIAMETERS.get(profile, DIAMETERS["driver_profile"])
    cases["diameter_mm"] = Key(diameters, commands, tables)
    return {f"mesh.{profile}.{name}": case for name, case in cases.items()}


def lead_keys(lead: str) -> dict[str, Key]:
    relieved = edited(PAIR, {f"mesh.1.{lead}": {"end_relief_um": 4.0}})
    relieved = edited(relieved, {f"mesh.1.{lead}.end_relief_length_mm": 2.0})
    values = {
        "crowning_um": Key(6.0, (SHOWN, STIFF)),
        "slope_um": Key(-5.0, (SHOWN, STIFF)),
        "end_relief_um": Key(5.0, (SHOWN, STIFF), relieved),
        "end_relief_length_mm": Key(3.0, (SHOWN, STIFF), relieved),
    }
    return {f"mesh.{lead}.{name}": case for name, case in values.items()}


GRIDS = {
    # roll angles of the flanks of each gear
    "driver_topography": [15.0, 22.0, 28.0],
    "driven_topography": [17.0, 22.0, 27.0],
}


def topography_keys(topography: str) -> dict[str, Key]:
    grid = {
        "roll_angle_deg": GRIDS[topography],
        "place_mm": [-4.0, 3.0],
        "depth_um": [[0.0, 2.0], [1.0, 0.0], [3.0, 4.0]],
    }
    tables = edited(PAIR, {f"mesh.1.{topography}": grid})
    values = {
        "roll_angle_deg": [angle + 0.5 for angle in GRIDS[topography]],
        "place_mm": [-3.0, 2.0],
        "depth_um": [[0.0, 3.0], [1.0, 0.0], [3.0, 2.0]],
        "bias_um": 4.0,
    }
    cases = {name: Key(setting, (STIFF,), tables) for name, setting in values.items()}
    cases["file"] = Key("none.csv", (), PAIR)
    return {f"mesh.{topography}.{name}": case for name, case in cases.items()}


RING: Tables = {
    "name": "ring",
    "defaults": {"module_mm": 2.0, "face_width_mm": 10.0},
    "gear": [
        {"name": "p", "teeth": 36, "hub_radius_mm": 20.0},
        {"name": "r", "teeth": 96, "internal": True, "rim_radius_mm": 112.0},
    ],
    "mesh": [{"driver": "p", "driven": "r", "center_distance_mm": 60.0}],
    "load": {"gear": "p", "torques_Nm": [20.0]},
}
RIM_SPRINGS = {
    "rim_radial_stiffness_N_per_mm3": 1e3,
    "rim_tangential_stiffness_N_per_mm3": 1e3,
}
SPRUNG_RING = RING | {"gear": [RING["gear"][0], RING["gear"][1] | RIM_SPRINGS]}
RING_KEYS = {
    "internal": Key(False, (), RING, entry=2),
    "rim_radius_mm": Key(115.0, (STIFF, MOVING), RING, entry=2),
    "rim_radial_stiffness_N_per_mm3": Key(2e3, (STIFF, SHOWN), SPRUNG_RING, entry=2),
    "rim_tangential_stiffness_N_per_mm3": Key(
        2e3, (STIFF, SHOWN), SPRUNG_RING, entry=2
    ),
    "cutter_teeth": Key(24, (STIFF, MOVING), RING, entry=2),
}
PLANETARY_KEYS = {
    **dict.fromkeys(("sun", "planet"), Key("r", (), PLANETARY)),
    "ring": Key("s", (), PLANETARY),
    **dict.fromkeys(("input", "output", "held"), Key("planet", (), PLANETARY)),
    "planets": Key(4, (PLANE, SHOWN), PLANETARY),
    "center_distance_mm": Key(60.1, (PLANE, SHOWN), PLANETARY),
    "positions_deg": Key([0.0, 99.0, 240.0], (PLANE, SHOWN), PLANETARY),
    "position_errors_um": Key([0.0, 2.0, 0.0], (SHARING, SHOWN), PLANETARY),
    "carrier_inertia_kg_m2": Key(0.01, (PLANE, SHOWN), PLANETARY),
    "carrier_mass_kg": Key(3.0, (PLANE, SHOWN), PLANETARY),
    "carrier_bearing_kx_N_per_m": Key(3e8, (PLANE, SHOWN), PLANETARY),
    "carrier_bearing_ky_N_per_m": Key(3e8, (PLANE, SHOWN), PLANETARY),
    "carrier_coupling_stiffness_Nm_per_rad": Key(1e4, (PLANE, SHOWN), PLANETARY),
}
SHAFT_VALUES: Tables = {
    "positions_mm": [65.0],
    "lengths_mm": [90.0, 90.0],
    "diameters_mm": [17.0, 20.0],
    "bores_mm": [2.0, 6.0],
    "material": "aluminium",
    "bearing_positions_mm": [12.0, 150.0],
    "bearing_kx_N_per_m": [7e7, 4e7],
    "bearing_ky_N_per_m": [7e7, 3e7],
    "bearing_kxy_N_per_m": [2e6, 1e6],
    "bearing_kyx_N_per_m": [-2e6, -1e6],
    "bearing_tilt_stiffness_Nm_per_rad": [4e3, 1e3],
    "bearing_cx_Ns_per_m": [300.0, 50.0],
    "bearing_cy_Ns_per_m": [300.0, 50.0],
    "disk_positions_mm": [175.0],
    "disk_masses_kg": [0.7],
    "disk_inertias_kg_m2": [5e-4],
    "disk_transverse_inertias_kg_m2": [2e-4],
}
MOUNTED = {
    kind: BENT
    | {
        "shaft": [
            {
                "gears": [name],
                "positions_mm": [60.0],
                "lengths_mm": [180.0],
                "diameters_mm": [20.0],
                "bearing_positions_mm": [10.0, 150.0],
                "rolling_bearings": [{kind: first}, {"ball_bearing": BALLS}],
            }
            for name in ("a", "b")
        ]
    }
    for kind, first in (("ball_bearing", BALLS), ("roller_bearing", ROLLERS))
}
SHAFTS = f"shafts {SHORT_USES['shafts'].text} --json"
MOVING_RACES = {"runout_um", "inner_waviness_um", "outer_waviness_um"}
MOUNTED_KEYS = {
    f"rolling_bearings.{kind}.{name}": Key(
        other, () if name in MOVING_RACES else (SHOWN,), MOUNTED[kind]
    )
    for kind, values in (
        ("ball_bearing", OTHER_BALLS),
        ("roller_bearing", OTHER_ROLLERS),
    )
    for name, other in values.items()
} | {
    "rolling_bearings.contact_angle_deg": Key(
        15.0, (SHOWN, SHAFTS), MOUNTED["ball_bearing"]
    ),
    "rolling_bearings.axial_preload_um": Key(
        9.0, (SHOWN, SHAFTS), MOUNTED["ball_bearing"]
    ),
}
SHAFT_KEYS = {
    **{name: Key(value, (CAMPBELL,), BENT) for name, value in SHAFT_VALUES.items()},
    "bearing_kz_N_per_m": Key([0.0, 3e7], (SHOWN, CAMPBELL), HELICAL_BENT),
    "driven_from": Key("start", (SHOWN, SHAFTS), BENT),
    **MOUNTED_KEYS,
}
LONE = {"name": "z", "teeth": 31, "inertia_kg_m2": 5e-4, "mass_kg": 0.5}
SHIFTED = PAIR | {
    "defaults": PAIR["defaults"] | {"profile_shift": 0.5},
    "mesh": [{"driver": "a", "driven": "b"}],
}
SPARE = {k: v for k, v in PAIR.items() if k != "load"} | {"gear": [*PAIR["gear"], LONE]}
JOINED = SHAFT | {"gear": [*SHAFT["gear"], LONE]}
KEYS: dict[str, Key] = {
    "name": Key("other", (SHOWN,)),
    "description": Key("words", (SHOWN,)),
    "inferences": Key(["a word"], (SHOWN,)),
    **{
        f"gear.{name}": key
        for name, key in (GEAR_KEYS | RING_KEYS | FAULT_KEYS).items()
    },
    "mesh.driver": Key("z", (GIVEN_MODES,), SPARE),
    "mesh.driven": Key("z", (GIVEN_MODES,), SPARE),
    "mesh.center_distance_mm": Key(43.3, TEETH),
    "mesh.operating_pressure_angle_deg": Key(23.8, TEETH),
    "mesh.contact_ratio": Key(1.2, (*TEETH, ONE_SWEEP)),
    "mesh.tip_shortening": Key(True, TEETH, SHIFTED),
    "mesh.phase": Key(0.3, (ONE_SWEEP, MOVING), TRAIN, entry=2),
    "mesh.center_line_deg": Key(70.0, (PLANE, ONE_SWEEP, MOVING), TRAIN, entry=2),
    "mesh.backlash_um": Key(1.0, (HARD,)),
    "mesh.mean_stiffness_N_per_m": Key(1.1e8, (GIVEN_MODES, ONE_SWEEP)),
    "mesh.stiffness_variation": Key(0.2, (ONE_SWEEP,)),
    "mesh.load_share": Key(0.6, (ONE_SWEEP,), RELIEVED),
    **{
        key: case
        for relief, tables in RELIEFS.items()
        for key, case in relief_keys(relief, tables).items()
    },
    **{
        key: case
        for profile, tables in PROFILES.items()
        for key, case in profile_keys(profile, tables).items()
    },
    **{
        key: case
        for lead in ("lead", "driver_lead", "driven_lead")
        for key, case in lead_keys(lead).items()
    },
    **{key: case for grid in GRIDS for key, case in topography_keys(grid).items()},
    "mesh.misalignment_um": Key(6.0, (SHOWN, STIFF)),
    "mesh.offset_mm": Key(2.0, (SHOWN, STIFF)),
    "plane": Key("strain", (STIFF, FINITE)),
    "shaft.gears": Key(["b", "c", "z"], (MODES,), JOINED),
    "shaft.stiffness_Nm_per_rad": Key(2e4, (MODES, ONE_SWEEP), SHAFT),
    **{f"shaft.{name}": key for name, key in SHAFT_KEYS.items()},
    **{f"planetary.{name}": key for name, key in PLANETARY_KEYS.items()},
    "housing.file": Key("none.mat", (), BENT),
    "load.gear": Key("b", (SHOWN,)),
    "load.torques_Nm": Key([30.0], TEETH),
    "dynamics.damping_ratio": Key(0.1, (ONE_SWEEP, MOVING)),
}


def leaves(model: type[BaseModel], path: str = "") -> Iterator[str]:
    """Dotted names of all keys of the schema but [defaults]', which are a gear's, and
    those of both meshes of planets, which are a mesh's."""
    for name, field in model.model_fields.items():
        table, key = model_of(field.annotation), f"{path}{name}"
        if key == "defaults":
            assert table is GearDefaults
        elif table is MeshKeys:
            assert key.startswith("planetary.")
        elif table is None:
            yield key
        else:
            yield from leaves(table, f"{key}.")


def test_every_key_of_a_gear_set_file_has_a_case():
    assert set(KEYS) == set(leaves(Document))


@pytest.mark.parametrize("side", ["sun_mesh", "ring_mesh"])
@pytest.mark.parametrize("name", ["backlash_um", "load_share", "contact_ratio"])
def test_keys_of_planets_meshes_are_those_of_every_mesh(name, side):
    key = KEYS[f"mesh.{name}"]
    at_once = edited(PLANETARY, {f"planetary.1.{side}.{name}": key.value})
    first = 1 if side == "sun_mesh" else 2
    meshes = {f"mesh.{n}.{name}": key.value for n in range(first, 7, 2)}
    assert at_once["mesh"] == edited(PLANETARY, meshes)["mesh"]


def in_first_table(table: str, rest: str) -> str:
    """The rest of a name with the number of a table where there is a list of them."""
    head = rest.partition(".")[0]
    return rest.replace(".", ".1.", 1) if lists_tables([table, head]) else rest


def changed_tables(name: str, key: Key) -> Tables:
    table, _, rest = name.partition(".")
    if not rest:
        return key.tables | {name: key.value}
    if table not in LISTS:
        return edited(key.tables, {name: key.value})
    rest = in_first_table(table, rest)
    indices = [key.entry] if key.entry else range(1, len(key.tables[table]) + 1)
    return edited(key.tables, {f"{table}.{i}.{rest}": key.value for i in indices})


@pytest.mark.slow
@pytest.mark.parametrize("name", KEYS)
def test_a_key_moves_the_answer_or_is_refused(answers, name):
    key = KEYS[name]
    tables = changed_tables(name, key)
    for command in key.commands or (SHOWN,):
        base, changed = answers(command, key.tables), answers(command, tables)
        assert base.code == 0
        if key.commands:
            assert changed.code == 0, command
            assert changed.answer != base.answer, command
        else:
            assert changed.code == 2


@pytest.mark.parametrize("name", sorted(GearDefaults.model_fields.keys() - RING_KEYS))
def test_a_default_is_the_same_as_the_key_in_every_gear(name):
    base = PAIR | {"gear": [gear | {"teeth": 19} for gear in PAIR["gear"]]}
    extra = COMPANIONS.get(name) or {name: GEAR_KEYS[name].value}
    bare = [{k: v for k, v in g.items() if k != name} for g in base["gear"]]
    replaced = {name, *replaced_keys(name)}
    shared = {k: v for k, v in base["defaults"].items() if k not in replaced}
    by_default = base | {"gear": bare, "defaults": shared | extra}
    by_gear = base | {"gear": [g | extra for g in bare], "defaults": shared}
    assert read_gear_set(toml_text(by_default)) == read_gear_set(toml_text(by_gear))
    assert read_gear_set(toml_text(by_default)) != read_gear_set(toml_text(base))


@pytest.mark.parametrize("name", ["rim_radius_mm", "cutter_teeth", *RIM_SPRINGS])
def test_a_default_of_rings_is_that_of_the_ring_alone(name):
    value, gears = RING_KEYS[name].value, RING["gear"]
    extra = (RIM_SPRINGS if name in RIM_SPRINGS else {}) | {name: value}
    bare = {key: value for key, value in gears[1].items() if key != name}
    by_default = RING | {
        "gear": [gears[0], bare],
        "defaults": RING["defaults"] | extra | {"hub_radius_mm": 21.0},
    }
    by_gear = RING | {"gear": [gears[0], bare | extra]}
    assert read_gear_set(toml_text(by_default)) == read_gear_set(toml_text(by_gear))


# single numbers of gears, meshes and shafts, but for those of whole sets of planets
NUMBERS = [
    name
    for name, key in KEYS.items()
    if isinstance(key.value, int | float)
    and not isinstance(key.value, bool)
    and name.partition(".")[0] in ("gear", "mesh", "shaft")
    and (key.commands or name in FAULT_VALUES)
]
FE_AXIS = ExcitationSettings(positions=8, resolution="coarse")
GIVEN_AXIS = ExcitationSettings(kind="rectangular")


def numbers_in(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and arrays of a value and of the values in it, by their places."""
    if is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in fields(value)}
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from numbers_in(inner, f"{path}.{name}")
    elif isinstance(value, list | tuple):
        for number, inner in enumerate(value):
            yield from numbers_in(inner, f"{path}.{number}")
    elif isinstance(value, int | float | np.ndarray):
        yield path, np.asarray(value)


@pytest.mark.slow
@pytest.mark.parametrize("excitation", [FE_AXIS, GIVEN_AXIS], ids=lambda e: e.kind)
@pytest.mark.parametrize("name", NUMBERS)
def test_a_value_of_an_axis_is_that_of_the_key(tmp_path, name, excitation):
    """Tables of the other value of the axis are in the memory then."""
    key = KEYS[name]
    table, _, rest = name.partition(".")
    rest = in_first_table(table, rest)
    axis_name = f"{table}.{key.entry}.{rest}" if key.entry else f"defaults.{rest}"
    if excitation.kind != "fe" and key.tables is FAULTY:
        pytest.skip("faults are not known of given stiffness waves")
    tables = edited(key.tables, {"load.torques_Nm": [20.0]})
    single = edited(tables, {axis_name: key.value})
    path = tmp_path / "set.toml"
    path.write_text(toml_text(tables))
    model = LumpedModel(number=1, excitation=excitation)
    values = (1.02 * key.value, float(key.value))
    if isinstance(key.value, int):
        values = (key.value + 1.0, float(key.value))
    study = Map(
        gear_set=str(path), over=(Axis(axis_name, values),), at=2000.0, model=model
    )
    try:
        expected = lumped_system(read_gear_set(toml_text(single)), 20.0, model)
    except InputError as error:
        reason = str(error).partition(": ")[2]
        with pytest.raises(InputError, match=re.escape(reason)):
            study.prepare().system(values[1:])
        return
    problem = study.prepare()
    with contextlib.suppress(InputError):  # the value itself is what counts
        problem.system(values[:1])
    system = problem.system(values[1:])
    assert [p for p, _ in numbers_in(system)] == [p for p, _ in numbers_in(expected)]
    for (place, value), (_, other) in zip(
        numbers_in(system), numbers_in(expected), strict=True
    ):
        np.testing.assert_array_equal(value, other, err_msg=place)
