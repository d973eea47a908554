"""No input changes nothing: each option and each key moves the answer or is refused.

The lists of options and keys come from typer and from the schema of gear-set files, so
that a new one fails here until it has an entry. An answer is what a command computes,
without what it only repeats of its input.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from cli_commands import ROOT_COMMAND, commands
from history_files import written
from pydantic import BaseModel
from quick_benchmarks import answer_at_once
from rexs_files import RexsWriter, as_xml
from slow_tests import in_tier_of

from fegear.cli import run
from fegear.gearset import read_gear_set
from fegear.gearset.edit import LISTS, edited
from fegear.gearset.problems import lists_tables, model_of
from fegear.gearset.schema import Document, GearDefaults, MeshKeys, replaced_keys

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
# what a command only repeats of its input, and what differs from run to run
REPEATED = {
    "center_distance_mm",
    "damping_ratio",
    "excitation",
    "face_width_mm",
    "fidelity",
    "friction_coefficient",
    "gear_set",
    "load_share",
    "mean_std",
    "model",
    "origin",
    "peak_memory_MB",
    "plane",
    "positions",
    "resolution",
    "seconds",
    "sliding",
    "speeds",
    "stiffness_variation",
    "teeth",
    "torque_Nm",
    "torque_of",
    "translations",
    "variation_std",
    "wall_time_s",
    "warnings",
    "corner_contact",
    "driver_torque_Nm",
}


def toml(tables: Tables) -> str:
    """Enough of TOML for the tables above."""
    top = [f"{key} = {value(v)}" for key, v in tables.items() if not nested(v)]
    for key, v in tables.items():
        for entry in v if isinstance(v, list) and nested(v) else [v]:
            if nested(v):
                top.append(f"[[{key}]]" if isinstance(v, list) else f"[{key}]")
                top += [f"{k} = {value(field)}" for k, field in entry.items()]
    return "\n".join(top) + "\n"


def nested(v: Any) -> bool:
    return isinstance(v, dict) or (isinstance(v, list) and isinstance(v[0], dict))


def value(v: Any) -> str:
    if isinstance(v, dict):
        return "{" + ", ".join(f"{k} = {value(field)}" for k, field in v.items()) + "}"
    if isinstance(v, list):
        return f"[{', '.join(map(value, v))}]"
    return json.dumps(v)


class Outcome(NamedTuple):
    code: int
    answer: Any


def outcome(folder: Path, arguments: list[str]) -> Outcome:
    """Exit code, what was printed and what was written, in a folder of its own."""
    before, out = Path.cwd(), io.StringIO()
    folder.mkdir(parents=True)
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            code = run(arguments)
    finally:
        os.chdir(before)
    files = {
        str(path.relative_to(folder)): content(path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    text = out.getvalue()
    with contextlib.suppress(ValueError):
        return Outcome(code, (without_repeated(json.loads(text)), files))
    return Outcome(code, (text, files))


def without_repeated(values: Any) -> Any:
    """Numbers that differ by less than what a solver leaves open are equal."""
    if isinstance(values, dict):
        return {k: without_repeated(v) for k, v in values.items() if k not in REPEATED}
    if isinstance(values, list):
        return [without_repeated(v) for v in values]
    return float(f"{values:.9g}") if isinstance(values, float) else values


def content(data: bytes) -> bytes:
    """A file without the header that repeats the input."""
    if data.startswith(b"# "):
        return b"\n".join(li for li in data.splitlines() if not li.startswith(b"# "))
    return data


class Case(NamedTuple):
    """A command, and the same with another value of an option.

    refused : whether the option is refused; tables : of the gear set
    """

    base: str
    changed: str
    tables: Tables = PAIR
    refused: bool = False


def plus(base: str, options: str, tables: Tables = PAIR, refused: bool = False) -> Case:
    return Case(base, f"{base} {options}", tables, refused)


def less(base: str, options: str) -> Case:
    return Case(base.replace(f" {options}", ""), base)


def swap(base: str, old: str, new: str) -> Case:
    assert old in base
    return Case(base, base.replace(old, new))


COARSE = "--resolution coarse"
STIFF = f"stiffness SET {COARSE} --positions 8 --json"
COMPARE = "compare SET --json"
RELIEF = f"relief SET {COARSE} --torque 20,30 --positions 8 --starts 1 --json"
TOLERANCES = f"tolerances SET {COARSE} --positions 8 --samples 10 --json"
WEAR = f"wear SET {COARSE} --positions 8 --json"
VIBRATION = (
    f"relief SET {COARSE} --torque 20 --positions 8 --starts 1 --json "
    "--objective vibration --designs 3 --speeds 900"
)
IDENTIFY = f"identify SET {COARSE} --json"
MODES = "modes SET --json"
GIVEN_MODES = "modes SET --stiffness given --json"
CAMPBELL = "campbell SET --points 3 --elements 2 --json"
EXPORT = "export SET -o m.json --json"
MESH = f"mesh SET {COARSE} -o m.vtu --json"
SWEEP = "sweep SET --speeds 2000,4000 --excitation rectangular --json"
COUPLED = f"sweep SET {COARSE} --speeds 2000 --model coupled --json"
COUPLED_WAVE = f"motion SET {COARSE} --speed 2000 --model coupled --json"
WAVE = "motion SET --speed 2100 --excitation rectangular --json"
SIGNALS = (
    "signals SET --speed 2100 --excitation rectangular --turns 2 --samples 8 --json"
)
FAULTS = (
    "faults SET --rpm 7000 --over pitch_error=0,1 --excitation rectangular --turns 2 "
    "--samples 8 --json"
)
COUPLED_FAULTS = (
    f"faults SET {COARSE} --rpm 7000 --over pitch_error=1 --model coupled --turns 1 "
    "--samples 8 --json"
)
RAMP = (
    "signals SET --speed 1500:2100 --seconds 0.1 --excitation rectangular --samples 8 "
    "--json"
)
COUPLED_SIGNALS = (
    f"signals SET {COARSE} --speed 2000 --turns 1 --samples 8 --model coupled --json"
)
MAP = "map SET --at 3000 --over gear.a.mass_kg=0.1,0.2 --excitation rectangular --json"
QUASI = f"dynamics SET {COARSE} --fidelity quasistatic --speeds 3000 --direction up"
COUPLED_MAP = (
    f"map SET {COARSE} --at 3000 --over gear.a.inertia_kg_m2=1e-3,2e-3 "
    "--model coupled --json"
)
RENDER = f"render SET {COARSE} --width 480 -o p.png --json"
BRANCHES = "branches SET --speeds 2000:2200 --excitation rectangular --json"
BRANCHES_OF_ELEMENTS = "branches SET --speeds 2000:2200 --model 3 --json"
COUPLED_BRANCHES = f"branches SET {COARSE} --speeds 2000:2200 --model coupled --json"
DOUBLING = (
    "branches SET --speeds 7200:7800 --excitation rectangular --damping 0.02 "
    "--harmonics 6 --json"
)
BRANCHES_OVER = (
    "branches SET --over dynamics.damping_ratio=0.05:0.06 --at 2100 "
    "--excitation rectangular --harmonics 4 --json"
)
SWEPT = (  # a second branch, which sweeps reach
    "branches liu-idler --torque 100 --excitation rectangular --harmonics 4 "
    "--period-multiple 1 --speeds 1300:1700 --json"
)
ISOLATED = (
    "branches liu-pair --excitation rectangular --damping 0.03 --harmonics 4 "
    "--period-multiple 3 --speeds 4600:7200 --json"
)
RATTLE = "rattle basin roots-scaled --grid 12 --delta 0.575 --json"
ORBITS = "rattle periodic roots-scaled --max-liftoffs 1 --json"
CRITICAL = "rattle critical roots-a --json"
GEARS = (
    f"rattle gears SET {COARSE} --speed-rpm 900 --drag-Nm 1 --eccentricity-um 9 --json"
)
MANIFOLD = "rattle manifold roots-scaled --length 1 --preimages 0 --json"
NOISE = "rattle noise roots-scaled --starts 40 --delta 0.575 --json"
CLATTER = "clatter seed-five-speed --seconds 1 --json"
MAPPED = "clatter SPURRED --seconds 1 --json"
RUN_DOWN = "rattle run-down FALLING --json"
FIGURES = {
    "MACHINE": "roots-scaled",
    "--delta": "--delta 0.55",
    "--epsilon": "--epsilon 0.09",
    "--beta": "--beta 0.5",
    "--kappa": "--kappa 1000",
    "--restitution": "--restitution 0.9",
}
RUBBED = (
    "stability SET --over friction=0.1 --speeds 2000:20000:1000 --damping 0.002 --json"
)
BUILT = f"{RUBBED} --excitation rectangular --bending 0.4"
HOLDING = "stability SET --over damping_ratio=0.002 --speeds 2000:20000:1000 --json"
OVER_DELTA = (
    "rattle bifurcation roots-scaled --over epsilon=0.09:0.1 --max-liftoffs 1 "
    "--starts 2 --runs 2 --json"
)
DOUBLED_ORBITS = (
    "rattle bifurcation roots-scaled --over epsilon=0.06:0.09 --max-liftoffs 1 "
    "--starts 5 --runs 0 --json"
)
SECTIONS = (
    "bifurcations SET --over gear.a.inertia_kg_m2=1e-4,2e-4 --at 3000 "
    "--excitation rectangular -o b.csv --json"
)
COUPLED_SECTIONS = (
    f"bifurcations SET {COARSE} --over torque_Nm=20 --at 3000 --direction up "
    "--model coupled --json"
)
DOUBLED = (
    "bifurcations SET --over mesh_frequency_Hz=7500 --excitation rectangular "
    "--damping 0.02 --direction up -o b.csv --json"
)
BEARING = "bearing SET --json"
THEORY = "theory SET --excitation rectangular --json"
SHARING = "sharing SET --excitation rectangular --model 1 --json"
ABLATION = "ablation SET --speeds 2000 --runs RUNS --json"  # each run is made once
VALIDATE = "validate CASE -o out --json"
ECCENTRIC = "eccentric --radius 20 --eccentricity 5 --json"
TURN = f"{ECCENTRIC} --teeth 24 --torque 5 --positions 2"
REPRODUCE = "reproduce table-2.1 --json"


def lumped(base: str) -> dict[str, Case]:
    """Options that sweep, wave and map share."""
    tables = base.replace(" --excitation rectangular", "")
    return {
        "SET": swap(base, "SET", "OTHER"),
        "--model": plus(base, "--model 2"),
        "--torque": plus(base, "--torque 30"),
        "--set": plus(base, "--set mesh.1.stiffness_variation=0.4"),
        "--damping": plus(base, "--damping 0.1"),
        "--translations": plus(base, "--translations", TRAIN),
        "--excitation": plus(tables, "--excitation trapezoid"),
        "--ramp": plus(f"{tables} --excitation trapezoid", "--ramp 0.05"),
        "--excitation-harmonics": plus(
            f"{tables} --excitation fourier", "--excitation-harmonics 1"
        ),
        "--plane": plus(tables, "--plane strain"),
        "--resolution": plus(tables, COARSE),
        "--relief-stiffness": unmodified(tables),
        "--steps": plus(base, "--steps 8"),
        "--method": plus(base, "--method dopri5"),
        "--tolerance": plus(base, "--tolerance 0.1"),
        "--max-periods": plus(f"{base} --damping 1e-4", "--max-periods 40"),
        "--plot": plus(base, "--plot p.png"),
        "--json": less(base, "--json"),
    }


def moving(base: str) -> dict[str, Case]:
    """Those of `lumped`, and that of rolling bearings."""
    plane = f"{base} --translations"
    return lumped(base) | {"--bearings": plus(plane, "--bearings linear", ROLLING)}


def unmodified(base: str) -> Case:
    """Pairs with relief that have the stiffness of teeth without."""
    relieved = "--model 1 --set mesh.1.tip_relief.magnitude_um=10"
    return plus(f"{base} {COARSE} {relieved}", "--relief-stiffness unmodified")


def sharing() -> dict[str, Case]:
    """Options of load sharing, of planets one of which is off its place."""
    key = "--set planetary.1.position_errors_um"
    springs = f"{SHARING} {key}=[0,2,0]"
    trapezoid, fourier = (
        springs.replace("rectangular", kind) for kind in ("trapezoid", "fourier")
    )
    elements = springs.replace("--excitation rectangular", COARSE)
    relieved = f"{elements} --set planetary.1.sun_mesh.tip_relief.magnitude_um=10"
    plain = {
        "--model": springs.replace("--model 1", "--model 2"),
        "--set": springs.replace("[0,2,0]", "[0,1,0]"),
        "--excitation": trapezoid,
        "--resolution": elements.replace(f" {COARSE}", ""),
        "--json": springs.replace(" --json", ""),
    }
    added = {
        "--torque": (springs, "--torque 30"),
        "--ramp": (trapezoid, "--ramp 0.05"),
        "--excitation-harmonics": (fourier, "--excitation-harmonics 1"),
        "--plane": (elements, "--plane strain"),
        "--relief-stiffness": (relieved, "--relief-stiffness unmodified"),
        "--output": (springs, "-o s.csv"),
    }
    return {
        **{name: Case(springs, text, PLANETARY) for name, text in plain.items()},
        **{name: plus(*texts, PLANETARY) for name, texts in added.items()},
        "--resolution": Case(elements, plain["--resolution"], PLANETARY),
        "SET": Case(springs, springs.replace("SET", "OTHER"), PLANETARY, refused=True),
        "--table": plus(springs, "--table TABLE", PLANETARY, refused=True),
    }


def rubbed(base: str) -> dict[str, Case]:
    """Options of friction, of finite elements that give its bending."""
    base = base.replace(" --excitation rectangular", f" {COARSE}")
    friction = f"{base} --friction 0.2"
    return {
        "--friction": plus(base, "--friction 0.2"),
        "--bending": plus(friction, "--bending 0.2"),
        "--varying-bending": plus(friction, "--varying-bending"),
        "--no-bending": plus(friction, "--no-bending"),
        "--sliding": plus(friction, "--sliding instantaneous"),
        "--torque-of": plus(friction, "--torque-of input"),
        "--transition-speed": plus(
            f"{friction} --sliding instantaneous", "--transition-speed 0.05"
        ),
    }


def stable() -> dict[str, Case]:
    """Those of `stability`, which integrates nothing."""
    cases = {
        name: case
        for name, case in lumped(BUILT).items()
        if name not in ("--steps", "--method", "--tolerance", "--max-periods")
    }
    return cases | {
        "--model": plus(BUILT, "--model 2", refused=True),
        "--excitation-harmonics": plus(
            f"{HOLDING} --excitation fourier", "--excitation-harmonics 1", TRAIN
        ),
        "--damping": swap(BUILT, "0.002", "0.01"),
        "--torque": plus(f"{RUBBED} {COARSE}", "--torque 60"),
        "--plane": plus(RUBBED, "--plane strain"),
        "--resolution": plus(RUBBED, COARSE),
        "--relief-stiffness": unmodified(RUBBED),
        "--excitation": plus(f"{RUBBED} --bending 0.4", "--excitation trapezoid"),
        "--ramp": plus(f"{RUBBED} --bending 0.4 --excitation trapezoid", "--ramp 0.05"),
        "--translations": plus(BUILT, "--translations", TRAIN),
        "--over": swap(BUILT, "friction=0.1", "friction=0.1,0.2"),
        "--speeds": swap(BUILT, "20000", "21000"),
        "--rpm": swap(BUILT, "--speeds 2000:20000:1000", "--rpm 5000:50000:2500"),
        "--method": plus(BUILT, "--method exponential"),
        "--friction": plus(
            f"{HOLDING} --excitation rectangular", "--friction 0.2 --bending 0.4"
        ),
        "--bending": swap(BUILT, "--bending 0.4", "--bending 0.2"),
        "--varying-bending": plus(f"{RUBBED} {COARSE}", "--varying-bending"),
        "--no-bending": plus(f"{RUBBED} {COARSE}", "--no-bending"),
        "--table": plus(RUBBED, "--table TABLE", refused=True),
        "--output": plus(BUILT, "-o s.csv"),
        "--plot": plus(BUILT, "--plot s.png"),
        "--resume": plus(BUILT, "--resume", refused=True),
        "--overwrite": plus(BUILT, "--overwrite", refused=True),
    }


def figures_of_machine(base: str) -> dict[str, Case]:
    """Another machine, and other figures of it."""
    cases = {
        name: plus(base.replace(" --delta 0.575", ""), option)
        for name, option in FIGURES.items()
        if name != "MACHINE"
    }
    return cases | {"MACHINE": swap(base, "roots-scaled", "SOFT")}


OPTIONS: dict[str, dict[str, Case]] = {
    "warmup": {
        "--only": plus("warmup --only rattle --json", "--only statics"),
        "--output": plus("warmup --only rattle --json", "-o k.csv"),
        "--json": plus("warmup --only rattle", "--json"),
    },
    "new": {
        "KIND": swap("new pair -o f.toml", "pair", "idler"),
        "--from": swap("new --from BOX1 -o f.toml --json", "BOX1", "BOX2"),
        "--output": swap("new pair -o f.toml", "f.toml", "g.toml"),
        "--json": plus("new pair -o f.toml", "--json"),
    },
    "keys": {
        "KIND": plus("keys --json", "machine"),
        "--output": plus("keys machine --json", "-o k.csv"),
        "--json": plus("keys machine", "--json"),
    },
    "explain": {
        "CODE": plus("explain W01 --json", "E02"),
        "--output": plus("explain E02 --json", "-o e.csv"),
        "--json": plus("explain E02", "--json"),
    },
    "sets": {
        "--output": plus("sets --json", "-o s.csv"),
        "--json": plus("sets", "--json"),
    },
    "show": {
        "SET": swap("show SET", "SET", "OTHER"),
        "--plot": plus("show SET", "--plot p.svg"),
        "--set": plus("show SET --json", "--set gear.1.young_modulus_GPa=150"),
        "--json": plus("show SET", "--json"),
    },
    "mesh": {
        "SET": swap(MESH, "SET", "OTHER"),
        "--output": swap(MESH, "m.vtu", "m.msh"),
        "--gear": plus(MESH, "--gear 2"),
        "--resolution": less(MESH, COARSE),
        "--whole": plus(MESH, "--whole"),
        "--set": plus(MESH, "--set gear.1.hub_radius_mm=9"),
        "--json": less(MESH, "--json"),
    },
    "stiffness": {
        "SET": swap(STIFF, "SET", "OTHER"),
        "--mesh": plus(STIFF, "--mesh 2", TRAIN),
        "--torque": plus(STIFF, "--torque 30"),
        "--positions": swap(STIFF, "8", "16"),
        "--friction": plus(STIFF, "--friction 0.1"),
        "--plane": plus(STIFF, "--plane strain"),
        "--resolution": less(STIFF, COARSE),
        "--corner-contact": plus(STIFF, "--no-corner-contact"),
        "--body": plus(STIFF, "--body free"),
        "--harmonic-count": plus(STIFF, "--harmonic-count 2"),
        "--harmonics": plus(STIFF, "--harmonics h.csv"),
        "--cracks": plus(
            f"{STIFF} --set gear.1.cracks=[{{tooth=2,depth_mm=0.5}}]", "--cracks c.csv"
        ),
        "--path": plus(STIFF, "--path p.png"),
        "--harris": plus(f"{STIFF} --torque 20:40:20", "--harris p.png"),
        "--set": plus(STIFF, "--set gear.1.young_modulus_GPa=150"),
        "--output": plus(STIFF, "-o t.csv"),
        "--plot": plus(STIFF, "--plot p.png"),
        "--json": less(STIFF, "--json"),
    },
    "compare": {
        "SET": swap(COMPARE, "SET", "OTHER"),
        "--mesh": plus(COMPARE, "--mesh 2", TRAIN),
        "--torque": plus(COMPARE, "--torque 30"),
        "--plane": plus(COMPARE, "--plane strain"),
        "--set": plus(COMPARE, "--set gear.1.teeth=21"),
        "--output": plus(COMPARE, "-o c.csv"),
        "--json": less(COMPARE, "--json"),
    },
    "relief": {
        "SET": swap(RELIEF, "SET", "OTHER"),
        "--mesh": plus(RELIEF, "--mesh 2", TRAIN),
        "--torque": swap(RELIEF, "20,30", "20,40"),
        "--objective": plus(RELIEF, "--objective mean"),
        "--harmonics": plus(f"{RELIEF} --objective harmonics", "--harmonics 1,3"),
        "--speeds": swap(VIBRATION, "--speeds 900", "--speeds 1200"),
        "--rpm": swap(VIBRATION, "--speeds 900", "--rpm 1500"),
        "--designs": swap(VIBRATION, "--designs 3", "--designs 1"),
        "--compromises": plus(RELIEF, "--compromises 3"),
        "--relief-tolerance-um": plus(RELIEF, "--relief-tolerance-um 1"),
        "--length-tolerance": plus(RELIEF, "--length-tolerance 0.05"),
        "--pareto": plus(f"{RELIEF} --compromises 3", "--pareto t.csv"),
        "--front": plus(f"{RELIEF} --compromises 3", "--front p.png"),
        "--shape": plus(RELIEF, "--shape parabolic"),
        "--root": plus(RELIEF, "--root"),
        "--symmetric": plus(RELIEF, "--symmetric"),
        "--max-relief-um": plus(RELIEF, "--max-relief-um 1"),
        "--starts": swap(RELIEF, "--starts 1", "--starts 2"),
        "--friction": plus(RELIEF, "--friction 0.1"),
        "--positions": swap(RELIEF, "--positions 8", "--positions 12"),
        "--plane": plus(RELIEF, "--plane strain"),
        "--resolution": less(RELIEF, COARSE),
        "--set": plus(RELIEF, "--set gear.1.young_modulus_GPa=150"),
        "--output": plus(RELIEF, "-o r.toml"),
        "--plot": plus(RELIEF, "--plot p.png"),
        "--torques": plus(RELIEF, "--torques t.csv"),
        "--json": less(RELIEF, "--json"),
    },
    "wear": {
        "SET": swap(WEAR, "SET", "OTHER"),
        "--mesh": plus(WEAR, "--mesh 2", TRAIN),
        "--torque": plus(WEAR, "--torque 30"),
        "--cycles": plus(WEAR, "--cycles 1e7"),
        "--wear-coefficient": plus(WEAR, "--wear-coefficient 1e-17"),
        "--depth-step-um": plus(WEAR, "--depth-step-um 0.001"),
        "--steps": plus(WEAR, "--steps 5"),
        "--friction": plus(WEAR, "--friction 0.1"),
        "--positions": swap(WEAR, "--positions 8", "--positions 12"),
        "--plane": plus(WEAR, "--plane strain"),
        "--resolution": less(WEAR, COARSE),
        "--corner-contact": plus(WEAR, "--no-corner-contact"),
        "--set": plus(WEAR, "--set gear.1.young_modulus_GPa=150"),
        "--output": plus(WEAR, "-o w.csv"),
        "--plot": plus(WEAR, "--plot p.png"),
        "--gears": plus(WEAR, "--gears w.toml"),
        "--json": less(WEAR, "--json"),
    },
    "tolerances": {
        "SET": swap(TOLERANCES, "SET", "OTHER"),
        "--mesh": plus(TOLERANCES, "--mesh 2", TRAIN),
        "--torque": plus(TOLERANCES, "--torque 30"),
        "--grade": plus(TOLERANCES, "--grade 5"),
        "--driver-grade": plus(TOLERANCES, "--driver-grade 5"),
        "--driven-grade": plus(TOLERANCES, "--driven-grade 5"),
        "--single-pitch-um": plus(TOLERANCES, "--single-pitch-um 1"),
        "--profile-slope-um": plus(TOLERANCES, "--profile-slope-um 1"),
        "--profile-form-um": plus(TOLERANCES, "--profile-form-um 1"),
        "--center-distance-um": plus(TOLERANCES, "--center-distance-um 1"),
        "--distribution": plus(TOLERANCES, "--distribution uniform"),
        "--samples": swap(TOLERANCES, "--samples 10", "--samples 12"),
        "--seed": plus(TOLERANCES, "--seed 2"),
        "--positions": swap(TOLERANCES, "--positions 8", "--positions 12"),
        "--plane": plus(TOLERANCES, "--plane strain"),
        "--resolution": less(TOLERANCES, COARSE),
        "--corner-contact": plus(TOLERANCES, "--no-corner-contact"),
        "--set": plus(TOLERANCES, "--set gear.1.young_modulus_GPa=150"),
        "--output": plus(TOLERANCES, "-o t.csv"),
        "--plot": plus(TOLERANCES, "--plot p.png"),
        "--samples-table": plus(TOLERANCES, "--samples-table s.csv"),
        "--cycle": plus(TOLERANCES, "--cycle c.csv"),
        "--resume": plus(TOLERANCES, "--resume", refused=True),
        "--overwrite": plus(TOLERANCES, "--overwrite", refused=True),
        "--json": less(TOLERANCES, "--json"),
    },
    "identify": {
        "SET": swap(IDENTIFY, "SET", "OTHER"),
        "--mean": plus(IDENTIFY, "--mean 1.1e8"),
        "--variation": plus(IDENTIFY, "--variation 0.35"),
        "--mean-std": plus(IDENTIFY, "--mean-std 0.1"),
        "--variation-std": plus(IDENTIFY, "--variation-std 0.1"),
        "--hold-width": plus(IDENTIFY, "--hold-width"),
        "--along": plus(IDENTIFY, "--along b"),
        "--torque": plus(IDENTIFY, "--torque 200"),
        "--set": plus(IDENTIFY, "--set gear.1.young_modulus_GPa=150"),
        "--plane": plus(IDENTIFY, "--plane strain"),
        "--resolution": less(IDENTIFY, COARSE),
        "--output": plus(IDENTIFY, "-o i.csv"),
        "--plot": plus(IDENTIFY, "--plot p.png"),
        "--json": less(IDENTIFY, "--json"),
    },
    "modes": {
        "--output": plus(MODES, "-o m.csv"),
        "SET": swap(MODES, "SET", "OTHER"),
        "--torque": plus(f"{MODES} --stiffness fe", "--torque 200"),
        "--set": plus(MODES, "--set gear.1.inertia_kg_m2=1e-3"),
        "--translations": plus(MODES, "--translations", TRAIN),
        "--rpm": plus(f"{MODES} --translations", "--rpm 3000", PLANETARY),
        "--stiffness": plus(MODES, "--stiffness fe"),
        "--plane": plus(f"{MODES} --stiffness fe", "--plane strain"),
        "--resolution": plus(f"{MODES} --stiffness fe", COARSE),
        "--json": less(MODES, "--json"),
    },
    "bearing": {
        "SET": swap(BEARING, "SET", "OTHER")._replace(tables=ROLLING, refused=True),
        "--gear": plus(BEARING, "--gear b", TWO_BEARINGS),
        "--load": plus(BEARING, "--load 500", ROLLING),
        "--torque": plus(BEARING, "--torque 30", ROLLING),
        "--set": plus(BEARING, "--set gear.1.ball_bearing.balls=8", ROLLING),
        "--output": plus(BEARING, "-o b.csv", ROLLING),
        "--over-load": plus(BEARING, "--over-load l.csv", ROLLING),
        "--plot": plus(BEARING, "--plot p.png", ROLLING),
        "--json": less(BEARING, "--json")._replace(tables=ROLLING),
    },
    "campbell": {
        "--output": plus(CAMPBELL, "-o c.csv", BENT),
        "--critical": plus(CAMPBELL, "--critical c.csv", BENT),
        "--plot": plus(CAMPBELL, "--plot p.png", BENT),
        "SET": Case(CAMPBELL, CAMPBELL.replace("SET", "turbo-pair"), BENT),
        "--torque": plus(f"{CAMPBELL} --stiffness fe", "--torque 200", BENT),
        "--set": plus(CAMPBELL, "--set gear.1.inertia_kg_m2=1e-3", BENT),
        "--max-rpm": plus(CAMPBELL, "--max-rpm 9000", BENT),
        "--points": plus(CAMPBELL.replace("--points 3 ", ""), "--points 4", BENT),
        "--modes": plus(CAMPBELL, "--modes 2", BENT),
        "--elements": plus(CAMPBELL.replace("--elements 2 ", ""), "--elements 3", BENT),
        "--stiffness": plus(CAMPBELL, f"--stiffness fe {COARSE}", BENT),
        "--plane": plus(f"{CAMPBELL} --stiffness fe", "--plane strain", BENT),
        "--resolution": plus(f"{CAMPBELL} --stiffness fe", COARSE, BENT),
        "--json": Case(CAMPBELL.replace(" --json", ""), CAMPBELL, BENT),
    },
    "export": {
        "--output": swap(EXPORT, "m.json", "m.npz"),
        "SET": swap(EXPORT, "SET", "OTHER"),
        "--torque": plus(EXPORT, "--torque 200"),
        "--mesh": plus(EXPORT, "--mesh 1", refused=True),  # m.json has all meshes
        "--set": plus(EXPORT, "--set gear.1.inertia_kg_m2=1e-3"),
        "--translations": plus(EXPORT, "--translations", TRAIN),
        "--damping": plus(EXPORT, "--damping 0.1"),
        "--stiffness": plus(EXPORT, "--stiffness fe"),
        "--plane": plus(f"{EXPORT} --stiffness fe", "--plane strain"),
        "--resolution": plus(f"{EXPORT} --stiffness fe", COARSE),
        "--json": less(EXPORT, "--json"),
    },
    "stability": stable(),
    "sweep": moving(SWEEP)
    | rubbed(SWEEP)
    | {
        "--speeds": swap(SWEEP, "4000", "4100"),
        "--rpm": swap(SWEEP, "--speeds 2000,4000", "--rpm 3000"),
        "--direction": plus(SWEEP, "--direction up"),
        "--table": plus("sweep SET --speeds 2000 --model 3 --json", "--table TABLE"),
        "--output": plus(SWEEP, "-o s.csv"),
        "--spectra": plus(SWEEP, "--spectra l.csv"),
        "--waterfall": plus(SWEEP, "--waterfall w.png"),
        "--without": plus(f"{COUPLED} --direction up", "--without body"),
    },
    "motion": moving(WAVE)
    | rubbed(WAVE)
    | {
        "--speed": swap(WAVE, "2100", "4000"),
        "--from-speed": plus(WAVE, "--from-speed 2101"),
        "--rpm": swap(WAVE, "--speed 2100", "--rpm 7000"),
        "--from-rpm": plus(WAVE, "--from-rpm 7010"),
        "--table": plus("motion SET --speed 2000 --model 3 --json", "--table TABLE"),
        "--output": plus(WAVE, "-o w.csv"),
        "--without": plus(COUPLED_WAVE, "--without body"),
    },
    "signals": lumped(SIGNALS)
    | {
        "--speed": swap(SIGNALS, "2100", "4000"),
        "--from-speed": plus(SIGNALS, "--from-speed 2101"),
        "--rpm": swap(SIGNALS, "--speed 2100", "--rpm 7000"),
        "--from-rpm": plus(SIGNALS, "--from-rpm 7010"),
        "--max-periods": plus(
            f"{SIGNALS} --damping 1e-4", "--max-periods 40", refused=True
        ),  # the motion does not repeat
        "--gear": plus(SIGNALS, "--gear b"),
        "--turns": swap(SIGNALS, "--turns 2", "--turns 3"),
        "--samples": swap(SIGNALS, "--samples 8", "--samples 9"),
        "--noise-percent": plus(SIGNALS, "--noise-percent 1"),
        "--seed": plus(f"{SIGNALS} --noise-percent 1", "--seed 1"),
        "--table": plus(
            "signals SET --speed 2000 --turns 1 --model 3 --json", "--table TABLE"
        ),
        "--output": plus(SIGNALS, "-o s.csv"),
        "--average": plus(SIGNALS, "--average a.csv"),
        "--spectrum": plus(SIGNALS, "--spectrum l.csv"),
        "--seconds": swap(RAMP, "--seconds 0.1", "--seconds 0.2"),
        "--pulses": plus(SIGNALS, "--pulses 8"),
        "--window": plus(SIGNALS, "--window 1"),
        "--orders": plus(SIGNALS, "--orders o.csv"),
        "--order-map": plus(RAMP, "--order-map o.png"),
        "--without": plus(COUPLED_SIGNALS, "--without body"),
    },
    "faults": lumped(FAULTS)
    | {
        "--max-periods": plus(
            f"{FAULTS} --damping 1e-4", "--max-periods 40", refused=True
        ),  # the motion does not repeat
        "--over": swap(FAULTS, "0,1", "0,2"),
        "--rpm": swap(FAULTS, "7000", "7100"),
        "--random": plus(FAULTS, "--random 3"),
        "--random-seed": plus(f"{FAULTS} --random 3", "--random-seed 1"),
        "--gear": plus(FAULTS, "--gear b"),
        "--tooth": plus(f"{FAULTS} -o s.csv", "--tooth 2"),
        "--turns": swap(FAULTS, "--turns 2", "--turns 3"),
        "--samples": swap(FAULTS, "--samples 8", "--samples 9"),
        "--noise-percent": plus(FAULTS, "--noise-percent 1"),
        "--seed": plus(f"{FAULTS} --noise-percent 1", "--seed 1"),
        "--averages": plus(f"{FAULTS} -o s.mat", "--averages"),
        "--without": plus(COUPLED_FAULTS, "--without body"),
        "--output": plus(FAULTS, "-o s.csv"),
        "--labels": plus(FAULTS, "--labels l.csv"),
        "--overwrite": plus(FAULTS, "--overwrite", refused=True),
        "--resume": plus(FAULTS, "--resume", refused=True),
        "--cluster": plus(FAULTS, "--cluster --scheduler tcp://no:1", refused=True),
        "--scheduler": plus(FAULTS, "--scheduler nowhere", refused=True),
    },
    "branches": {
        name: case
        for name, case in lumped(BRANCHES).items()
        if name not in ("--steps", "--method", "--tolerance", "--max-periods")
    }
    | {
        "--speeds": swap(BRANCHES, "2000:2200", "2000:2300"),
        "--rpm": swap(BRANCHES, "--speeds 2000:2200", "--rpm 5000:5400"),
        "--over": swap(BRANCHES_OVER, "0.05:0.06", "0.05:0.07"),
        "--at": swap(BRANCHES_OVER, "2100", "2200"),
        "--starts": plus(ISOLATED, "--starts 40"),
        "--steepness": plus(BRANCHES, "--steepness 1"),
        "--resume": plus(BRANCHES, "--resume", refused=True),
        "--overwrite": plus(BRANCHES, "--overwrite", refused=True),
        "--period-multiple": plus(DOUBLING, "--period-multiple 1"),
        "--harmonics": plus(BRANCHES, "--harmonics 2"),
        "--solver": plus(BRANCHES, "--solver shooting"),
        "--sweep-points": plus(SWEPT, "--sweep-points 2"),
        "--excitation-harmonics": plus(
            BRANCHES.replace("rectangular", "fourier"), "--excitation-harmonics 1"
        ),
        "--table": plus(BRANCHES_OF_ELEMENTS, "--table TABLE"),
        "--without": plus(COUPLED_BRANCHES, "--without body"),
        "--output": plus(BRANCHES, "-o b.csv"),
    },
    "theory": {
        name: case
        for name, case in lumped(THEORY).items()
        if name not in ("--steps", "--method", "--tolerance", "--max-periods")
    }
    | {
        "--table": plus("theory SET --model 3 --json", "--table TABLE"),
        "--output": plus(THEORY, "-o t.csv"),
    },
    "sharing": sharing(),
    "map": moving(MAP)
    | rubbed(MAP)
    | {
        "--over": plus(MAP, "--over mesh.1.stiffness_variation=0.3,0.4"),
        "--at": swap(MAP, "3000", "4000"),
        "--band": swap(MAP, "--at 3000", "--band 3000,4000"),
        "--exponents": plus(MAP, "--exponents"),
        "--rpm": swap(MAP, "--at 3000", "--rpm 7000"),
        "--without": plus(COUPLED_MAP, "--without body"),
        "--output": plus(MAP, "-o m.csv"),
        "--overwrite": plus(MAP, "--overwrite", refused=True),
        "--resume": plus(MAP, "--resume", refused=True),
        "--cluster": plus(MAP, "--cluster --scheduler tcp://nowhere:1", refused=True),
        "--scheduler": plus(MAP, "--scheduler nowhere", refused=True),
    },
    "bifurcations": lumped(SECTIONS)
    | {
        "--over": swap(SECTIONS, "2e-4", "3e-4"),
        "--at": swap(SECTIONS, "3000", "4000"),
        "--rpm": swap(SECTIONS, "--at 3000", "--rpm 7000"),
        "--direction": plus(SECTIONS, "--direction up"),
        "--sections": plus(f"{DOUBLED} --period-multiple 1", "--sections 7"),
        "--period-multiple": plus(DOUBLED, "--period-multiple 1"),
        "--without": plus(COUPLED_SECTIONS, "--without body"),
        "--output": less(SECTIONS, "-o b.csv"),
        "--resume": plus(less(SECTIONS, "-o b.csv").base, "--resume", refused=True),
        "--overwrite": plus(
            less(SECTIONS, "-o b.csv").base, "--overwrite", refused=True
        ),
    },
    "dynamics": {
        "SET": swap(f"{QUASI} --json", "SET", "OTHER"),
        "--fidelity": swap(f"{QUASI} --json", "quasistatic", "reduced"),
        "--speeds": swap(f"{QUASI} --json", "3000", "4000"),
        "--rpm": swap(f"{QUASI} --json", "--speeds 3000", "--rpm 7000"),
        "--direction": swap(f"{QUASI} --json", "up", "both"),
        "--torque": plus(f"{QUASI} --json", "--torque 30"),
        "--set": plus(f"{QUASI} --json", "--set gear.1.inertia_kg_m2=2e-4"),
        "--friction": plus(f"{QUASI} --json", "--friction 0.1"),
        "--torque-of": plus(f"{QUASI} --json --friction 0.1", "--torque-of input"),
        "--damping": plus(f"{QUASI} --json", "--damping 0.1"),
        "--elastic-damping": plus(
            f"{QUASI} --json".replace("quasistatic", "reduced"), "--elastic-damping 0.5"
        ),
        "--cutoff": plus(
            f"{QUASI} --json".replace("quasistatic", "reduced"), "--cutoff 30000"
        ),
        "--translations": plus(f"{QUASI} --json", "--translations", TRAIN),
        "--plane": plus(f"{QUASI} --json", "--plane strain"),
        "--resolution": less(f"{QUASI} --json", COARSE),
        "--steps": plus(f"{QUASI} --json", "--steps 16"),
        "--tolerance": plus(f"{QUASI} --json", "--tolerance 0.1"),
        "--max-periods": plus(f"{QUASI} --damping 1e-4 --json", "--max-periods 1"),
        "--model-1": plus(QUASI, "--model-1"),
        "--output": plus(QUASI, "-o d.csv"),
        "--plot": plus(QUASI, "--plot p.png"),
        "--history": plus(QUASI, "--history h"),
        "--root-stress": plus(f"{QUASI} --history h", "--root-stress a"),
        "--resume": plus(QUASI, "--resume", refused=True),
        "--overwrite": plus(QUASI, "--overwrite", refused=True),
        "--json": plus(QUASI, "--json"),
    },
    "render": {
        "SET": swap(RENDER, "SET", "OTHER"),
        "--output": swap(RENDER, "p.png", "q.png"),
        "--mesh": plus(RENDER, "--mesh 2", TRAIN),
        "--position": plus(RENDER, "--position 0.5"),
        "--torque": plus(RENDER, "--torque 30"),
        "--friction": plus(RENDER, "--friction 0.1"),
        "--time-history": Case(
            RENDER.replace("SET", "liu-pair"),
            RENDER.replace("SET", "liu-pair") + " --time-history HISTORY",
        ),
        "--field": plus(RENDER, "--field pressure"),
        "--scale": plus(RENDER, "--scale 100"),
        "--zoom": plus(RENDER, "--zoom gear"),
        "--plane": plus(RENDER, "--plane strain"),
        "--resolution": less(RENDER, COARSE),
        "--width": swap(RENDER, "480", "640"),
        "--frames": plus(RENDER, "--frames 4", refused=True),
        "--turns": plus(RENDER, "--turns 1", refused=True),
        "--set": plus(RENDER, "--set gear.1.young_modulus_GPa=150"),
        "--json": less(RENDER, "--json"),
    },
    "ablation": {
        "SET": swap(ABLATION, "SET", "OTHER"),
        "--output": plus(ABLATION, "-o b.csv"),
        "--speeds": swap(ABLATION, "2000", "2100"),
        "--rpm": swap(ABLATION, "--speeds 2000", "--rpm 6000"),
        "--torque": plus(ABLATION, "--torque 30"),
        "--tolerance": plus(ABLATION, "--tolerance 0.9"),
        "--set": plus(ABLATION, "--set gear.a.inertia_kg_m2=1e-3"),
        "--runs": swap(ABLATION, "--runs RUNS", "--runs kept"),
        "--plot": plus(ABLATION, "--plot p.png"),
        "--json": less(ABLATION, "--json"),
    },
    "validate": {
        "CASE": swap(VALIDATE, "CASE", "THIRD"),
        "--output": swap(VALIDATE, "out", "there"),
        "--all": plus(VALIDATE, "--all", refused=True),
        "--fidelity": plus(VALIDATE, "--fidelity reduced"),
        "--quick": plus(VALIDATE, "--quick"),
        "--cluster": plus(
            VALIDATE, "--cluster --scheduler tcp://nowhere:1", refused=True
        ),
        "--scheduler": plus(VALIDATE, "--scheduler nowhere", refused=True),
        "--json": less(VALIDATE, "--json"),
    },
    "reproduce": {
        "NUMBER": swap(REPRODUCE, "table-2.1", "table-2.2"),
        "--all": plus(REPRODUCE, "--all", refused=True),
        "--list": Case(f"{REPRODUCE} -o out", "reproduce --list --json"),
        "--quick": plus(REPRODUCE, "--quick"),
        "--output": swap(f"{REPRODUCE} -o out", "out", "there"),
        "--json": less(REPRODUCE, "--json"),
    },
    "eccentric": {
        "--radius": swap(ECCENTRIC, "--radius 20", "--radius 21"),
        "--eccentricity": swap(ECCENTRIC, "--eccentricity 5", "--eccentricity 4"),
        "--ratio": plus(ECCENTRIC, "--ratio 2"),
        "--pressure-angle": plus(ECCENTRIC, "--pressure-angle 22"),
        "--teeth": plus(ECCENTRIC, "--teeth 30"),
        "--addendum": plus(f"{ECCENTRIC} --teeth 30", "--addendum 0.9"),
        "--dedendum": plus(f"{ECCENTRIC} --teeth 30", "--dedendum 1.2"),
        "--bore": plus(f"{ECCENTRIC} --teeth 30 -o w.msh", "--bore 3"),
        "--torque": swap(TURN, "--torque 5", "--torque 10"),
        "--face-width": plus(TURN, "--face-width 12"),
        "--positions": swap(TURN, "--positions 2", "--positions 3"),
        "--contact": plus(TURN, "--contact t.csv"),
        "--resume": plus(TURN, "--resume", refused=True),
        "--overwrite": plus(TURN, "--overwrite", refused=True),
        "--resolution": plus(f"{ECCENTRIC} --teeth 30 -o w.msh", "--resolution coarse"),
        "--output": plus(ECCENTRIC, "-o w.csv"),
        "--animate": plus(ECCENTRIC, "--animate w.gif"),
        "--plot": plus(ECCENTRIC, "--plot w.png"),
        "--json": less(ECCENTRIC, "--json"),
    },
    "clatter": {
        "GEARBOX": swap(CLATTER, "seed-five-speed", "SPURRED"),
        "--seconds": swap(CLATTER, "--seconds 1", "--seconds 2"),
        "--impacts": plus(CLATTER, "--impacts 20"),
        "--seed": plus(CLATTER, "--seed 3"),
        "--map": swap(f"{MAPPED} --map implicit", "implicit", "fermi"),
        "--chaos": plus(CLATTER, "--chaos"),
        "--wheel": plus(f"{MAPPED} --map implicit", "--wheel second"),
        "--attractor": plus(CLATTER, "--attractor a.png"),
        "--output": plus(CLATTER, "-o i.csv"),
        "--plot": plus(CLATTER, "--plot m.png"),
        "--resume": plus(f"{MAPPED} --map fermi -o i.csv", "--resume", refused=True),
        "--overwrite": plus(
            f"{MAPPED} --map fermi -o i.csv", "--overwrite", refused=True
        ),
        "--json": less(CLATTER, "--json"),
    },
    "bench stiffness": {
        "SET": plus("bench stiffness --json", "SET"),
        "--torque": plus("bench stiffness --json", "--torque 50"),
        "--quick": plus("bench stiffness --json", "--quick"),
        "--output": plus("bench stiffness --json", "-o there"),
        "--json": plus("bench stiffness", "--json"),
    },
    "bench dynamics": {
        "SET": plus("bench dynamics --json", "SET"),
        "--torque": plus("bench dynamics --json", "--torque 50"),
        "--quick": plus("bench dynamics --json", "--quick"),
        "--output": plus("bench dynamics --json", "-o there"),
        "--json": plus("bench dynamics", "--json"),
    },
    "bench lumped": {
        "SET": plus("bench lumped --json", "SET"),
        "--stress": plus("bench lumped --torque 50 --json", "--stress", refused=True),
        "--torque": plus("bench lumped --json", "--torque 50"),
        "--damping": plus("bench lumped --json", "--damping 0.1"),
        "--quick": plus("bench lumped --json", "--quick"),
        "--output": plus("bench lumped --json", "-o there"),
        "--json": plus("bench lumped", "--json"),
    },
    "bench branches": {
        "SET": plus("bench branches --json", "SET"),
        "--torque": plus("bench branches --json", "--torque 50"),
        "--damping": plus("bench branches --json", "--damping 0.1"),
        "--quick": plus("bench branches --json", "--quick"),
        "--output": plus("bench branches --json", "-o there"),
        "--json": plus("bench branches", "--json"),
    },
    "bench stability": {
        "SET": plus("bench stability --json", "SET"),
        "--torque": plus("bench stability --json", "--torque 50"),
        "--quick": plus("bench stability --json", "--quick"),
        "--output": plus("bench stability --json", "-o there"),
        "--json": plus("bench stability", "--json"),
    },
    "bench clatter": {
        "--quick": plus("bench clatter --json", "--quick"),
        "--output": plus("bench clatter --json", "-o there"),
        "--json": plus("bench clatter", "--json"),
    },
    "bench growth": {
        "--quick": plus("bench growth --json", "--quick"),
        "--output": plus("bench growth --json", "-o there"),
        "--json": plus("bench growth", "--json"),
    },
    "bench commands": {
        "--quick": plus("bench commands --json", "--quick"),
        "--output": plus("bench commands --json", "-o there"),
        "--json": plus("bench commands", "--json"),
    },
    "bench eccentric": {
        "--quick": plus("bench eccentric --json", "--quick"),
        "--output": plus("bench eccentric --json", "-o there"),
        "--json": plus("bench eccentric", "--json"),
    },
    "rattle critical": {
        "MACHINE": swap(CRITICAL, "roots-a", "roots-scaled"),
        "--delta": plus(CRITICAL, "--delta 4e-4"),
        "--epsilon": plus(CRITICAL, "--epsilon 9e-5"),
        "--kappa": plus(CRITICAL, "--kappa 2000"),
        "--output": plus(CRITICAL, "-o t.csv"),
        "--json": less(CRITICAL, "--json"),
    },
    "rattle gears": {
        "SET": swap(GEARS, "SET", "OTHER"),
        "--mesh": plus(GEARS, "--mesh 2", TRAIN),
        "--speed-rpm": swap(GEARS, "900", "800"),
        "--drag-Nm": swap(GEARS, "--drag-Nm 1", "--drag-Nm 2"),
        "--eccentricity-um": swap(GEARS, "--eccentricity-um 9", "--eccentricity-um 8"),
        "--driven-share": plus(GEARS, "--driven-share 0.3"),
        "--driving-inertia-kgm2": plus(GEARS, "--driving-inertia-kgm2 0.1"),
        "--driven-inertia-kgm2": plus(GEARS, "--driven-inertia-kgm2 0.1"),
        "--plane": plus(GEARS, "--plane strain"),
        "--resolution": less(GEARS, COARSE),
        "--output": plus(GEARS, "-o m.toml"),
        "--json": less(GEARS, "--json"),
    },
    "rattle run-down": {
        "FILE": swap(RUN_DOWN, "FALLING", "SLOWER"),
        "--speed-rpm": plus(RUN_DOWN, "--speed-rpm 1500"),
        "--inertia-kgm2": plus(RUN_DOWN, "--inertia-kgm2 0.1"),
        "--output": plus(RUN_DOWN, "-o t.csv"),
        "--json": less(RUN_DOWN, "--json"),
    },
    "rattle periodic": figures_of_machine(ORBITS)
    | {
        "--max-liftoffs": swap(ORBITS, "--max-liftoffs 1", "--max-liftoffs 2"),
        "--velocity": plus(ORBITS, "--velocity 0:4"),
        "--output": plus(ORBITS, "-o t.csv"),
        "--json": less(ORBITS, "--json"),
    },
    "rattle bifurcation": figures_of_machine(OVER_DELTA)
    | {
        "--epsilon": plus(OVER_DELTA.replace("epsilon", "delta"), "--epsilon 0.09"),
        "--over": swap(OVER_DELTA, "0.09:0.1", "0.09:0.11"),
        "--max-liftoffs": swap(OVER_DELTA, "--max-liftoffs 1", "--max-liftoffs 2"),
        "--starts": swap(DOUBLED_ORBITS, "--starts 5", "--starts 1"),
        "--doublings": plus(DOUBLED_ORBITS, "--doublings 0"),
        "--runs": swap(OVER_DELTA, "--runs 2", "--runs 3"),
        "--velocity": plus(OVER_DELTA, "--velocity 0:4"),
        "--output": plus(OVER_DELTA, "-o b.csv"),
        "--plot": plus(OVER_DELTA, "--plot b.png"),
        "--resume": plus(OVER_DELTA, "--resume", refused=True),
        "--overwrite": plus(OVER_DELTA, "--overwrite", refused=True),
        "--json": less(OVER_DELTA, "--json"),
    },
    "rattle basin": figures_of_machine(RATTLE)
    | {
        "--velocity": plus(RATTLE, "--velocity 0:6"),
        "--grid": swap(RATTLE, "--grid 12", "--grid 14"),
        "--iterations": plus(RATTLE, "--iterations 100"),
        "--cluster": plus(
            RATTLE, "--cluster --scheduler tcp://nowhere:1", refused=True
        ),
        "--scheduler": plus(RATTLE, "--scheduler nowhere", refused=True),
        "--output": plus(RATTLE, "-o r.npz"),
        "--plot": plus(RATTLE, "--plot r.png"),
        "--resume": plus(RATTLE, "--resume", refused=True),
        "--overwrite": plus(RATTLE, "--overwrite", refused=True),
        "--json": less(RATTLE, "--json"),
    },
    "rattle manifold": figures_of_machine(MANIFOLD)
    | {
        "--velocity": plus(MANIFOLD, "--velocity 0:4"),
        "--orbit": plus(MANIFOLD, "--orbit P(1,1,0)"),
        "--max-liftoffs": plus(MANIFOLD, "--max-liftoffs 2"),
        "--length": swap(MANIFOLD, "--length 1", "--length 2"),
        "--spacing": plus(MANIFOLD, "--spacing 0.02"),
        "--preimages": swap(MANIFOLD, "--preimages 0", "--preimages 1"),
        "--unstable": plus(MANIFOLD, "--unstable"),
        "--grid": swap(f"{MANIFOLD} --plot m.png", "--json", "--grid 10 --json"),
        "--output": plus(MANIFOLD, "-o m.csv"),
        "--plot": plus(MANIFOLD, "--plot m.png"),
        "--json": less(MANIFOLD, "--json"),
    },
    "rattle noise": figures_of_machine(NOISE)
    | {
        "--velocity": plus(NOISE, "--velocity 0:6"),
        "--starts": swap(NOISE, "--starts 40", "--starts 50"),
        "--seed": plus(NOISE, "--seed 2"),
        "--iterations": plus(NOISE, "--iterations 100"),
        "--turns": plus(NOISE, "--turns 100"),
        "--output": plus(NOISE, "-o n.csv"),
        "--plot": plus(NOISE, "--plot n.png"),
        "--json": less(NOISE, "--json"),
    },
    "bench all": {
        "--quick": plus("bench all --json", "--quick"),
        "--output": plus("bench all --json", "-o there"),
        "--json": plus("bench all", "--json"),
    },
}
ROOT_OPTIONS = {"--debug", "--version", "--install-completion", "--show-completion"}


def option_name(param: Any) -> str:
    """`--torque` of an option, `SET` of an argument."""
    long_names = [name for name in param.opts if name.startswith("--")]
    return long_names[0] if long_names else param.metavar


def test_every_option_of_every_command_has_a_case():
    options = {
        name: {option_name(param) for param in command.params}
        for name, command in commands()
    }
    assert {name: set(cases) for name, cases in OPTIONS.items()} == options
    assert {option_name(param) for param in ROOT_COMMAND.params} == ROOT_OPTIONS


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, str]:
    """Paths for the words in capitals."""
    folder = tmp_path_factory.mktemp("inputs")
    wider = {"face_width_mm": 12.0, "profile_shift": 0.15}
    other = PAIR | {"defaults": PAIR["defaults"] | wider}
    other |= {"mesh": [PAIR["mesh"][0] | {"mean_stiffness_N_per_m": 1.2e8}]}
    (folder / "other.toml").write_text(toml(other))
    names = ["torque_Nm", "position", "stiffness_N_per_m"]
    rows = [f"20,{i / 8},{1e8 + 3e7 * (i < 4)}" for i in range(8)]
    (folder / "soft.toml").write_text(
        'name = "soft"\n[machine]\ndamping = 0.6\neccentricity_rad = 0.08\n'
        "half_backlash_rad = 0.6\n"
    )
    (folder / "table.csv").write_text("\n".join([",".join(names), *rows]))
    for name, speed in (("falling", 2000), ("slower", 1900)):
        rows = [f"{t},{speed - 50 * t}" for t in range(6)]
        (folder / f"{name}.csv").write_text("\n".join(["time_s,speed_rpm", *rows]))
    for name, speeds in (("case", "3000"), ("third", "4000")):
        (folder / f"{name}.toml").write_text(
            f'name = "{name}"\ntitle = "{name}"\ngear_set = "{folder}/pair.toml"\n'
            f'torques_Nm = [20]\nspeeds_Hz = "{speeds}"\nfidelity = "quasistatic"\n'
            "[[model]]\nnumber = 1\n[[metric]]\n"
            'name = "rms_distance"\nallowed = 9\nreason = "for a test"\n'
        )
    (folder / "pair.toml").write_text(toml(PAIR))
    for name, tables in (("box1", PAIR), ("box2", other)):
        tree = RexsWriter(read_gear_set(toml(tables))).tree()
        (folder / f"{name}.rexs").write_text(as_xml(tree))
    written(folder / "history.csv")
    wheel = (
        'name = "{}"\nbase_radius_mm = 40\ninertia_kg_m2 = {}\ntooth_play_mm = 0.1\n'
        "tooth_restitution = 0.8\ndrag_Nm = -0.05\n"
    )
    (folder / "spurred.toml").write_text(
        'name = "spurred"\n[excitation]\nfrequency_Hz = 25\namplitude_mm = 0.15\n'
        f"[[wheel]]\n{wheel.format('first', 1e-3)}"
        f"[[wheel]]\n{wheel.format('second', 2e-3)}"
    )
    inputs = (
        "other.toml",
        "spurred.toml",
        "soft.toml",
        "table.csv",
        "case.toml",
        "third.toml",
    )
    file_names = (
        *inputs,
        "box1.rexs",
        "box2.rexs",
        "history.csv",
        "falling.csv",
        "slower.csv",
    )
    paths = {Path(name).stem.upper(): str(folder / name) for name in file_names}
    return paths | {"RUNS": str(folder / "runs")}


@pytest.fixture(scope="module")
def answers(tmp_path_factory, files):
    """Outcomes of a command on the tables of a gear set, each computed once."""
    folder, outcomes = tmp_path_factory.mktemp("answers"), {}

    def answer(command: str, tables: Tables) -> Outcome:
        text = toml(tables)
        if (command, text) not in outcomes:
            gear_set = folder / f"{len(outcomes)}.toml"
            gear_set.write_text(text)
            paths = files | {"SET": str(gear_set)}
            arguments = [paths.get(word, word) for word in command.split()]
            outcomes[command, text] = outcome(folder / str(len(outcomes)), arguments)
        return outcomes[command, text]

    return answer


@pytest.fixture
def quick_benchmarks(monkeypatch):
    answer_at_once(monkeypatch)


def cases_of(command: str) -> Iterator[Any]:
    """An option each."""
    for name in OPTIONS[command]:
        case = f"{command} {name}".replace(" ", "-")
        yield in_tier_of(command, name, id=case)


@pytest.mark.parametrize(
    ("command", "name"), [case for command in OPTIONS for case in cases_of(command)]
)
def test_an_option_moves_the_answer_or_is_refused(
    answers, quick_benchmarks, command, name
):
    case = OPTIONS[command][name]
    base, changed = (answers(w, case.tables) for w in (case.base, case.changed))
    assert base.code == 0
    assert changed.code == (2 if case.refused else 0)
    assert case.refused or changed.answer != base.answer


class Key(NamedTuple):
    """Another value of a key, and the commands whose answer it moves; none: refused.

    tables : to start from; entry : its number in a list, from 1; all if 0
    """

    value: Any
    commands: tuple[str, ...] = ()
    tables: Tables = PAIR
    entry: int = 1


ONE_SWEEP = "sweep SET --speeds 4000 --excitation rectangular --json"
HARD = "sweep SET --speeds 3600 --excitation rectangular --damping 0.005 --json"
FINITE = "sweep SET --speeds 4000 --json"
PLANE = "modes SET --translations --json"
MOVING = f"{QUASI} --json"
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
GEAR_KEYS = {
    "name": Key("z"),
    "teeth": Key(20, (*TEETH, ONE_SWEEP)),
    "module_mm": Key(2.1, (*TEETH, ONE_SWEEP), entry=0),
    "pressure_angle_deg": Key(21.0, (*TEETH, ONE_SWEEP), entry=0),
    "profile_shift": Key(0.15, TEETH),
    "tip_radius_mm": Key(21.3, TEETH),
    "tip_diameter_mm": Key(42.6, TEETH),
    "addendum_mm": Key(2.3, TEETH),
    "dedendum_mm": Key(2.55, TEETH),
    "rack_tip_radius_mm": Key(0.5, (STIFF, FINITE, MOVING)),
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
            other, (BEARING,) if name in KINEMATIC else (BEARING, PLANE), tables
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
    "eccentricity_um": 5.0,
    "eccentricity_angle_deg": 30.0,
}
FAULT_KEYS = {name: Key(v, (SHOWN,), FAULTY) for name, v in FAULT_VALUES.items()}
# the contact ratio does not bridge a missing tooth
FAULT_KEYS["missing_teeth"] = Key([7], (), FAULTY)
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
    "bearing_cx_Ns_per_m": [300.0, 50.0],
    "bearing_cy_Ns_per_m": [300.0, 50.0],
    "disk_positions_mm": [175.0],
    "disk_masses_kg": [0.7],
    "disk_inertias_kg_m2": [5e-4],
    "disk_transverse_inertias_kg_m2": [2e-4],
}
SHAFT_KEYS = {
    name: Key(value, (CAMPBELL,), BENT) for name, value in SHAFT_VALUES.items()
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
    "shaft.gears": Key(["b", "c", "z"], (MODES,), JOINED),
    "shaft.stiffness_Nm_per_rad": Key(2e4, (MODES, ONE_SWEEP), SHAFT),
    **{f"shaft.{name}": key for name, key in SHAFT_KEYS.items()},
    **{f"planetary.{name}": key for name, key in PLANETARY_KEYS.items()},
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


def changed_tables(name: str, key: Key) -> Tables:
    table, _, rest = name.partition(".")
    if not rest:
        return key.tables | {name: key.value}
    if table not in LISTS:
        return edited(key.tables, {name: key.value})
    if lists_tables([table, *rest.split(".")[:-1]]):
        rest = rest.replace(".", ".1.")
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
    assert read_gear_set(toml(by_default)) == read_gear_set(toml(by_gear))
    assert read_gear_set(toml(by_default)) != read_gear_set(toml(base))


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
    assert read_gear_set(toml(by_default)) == read_gear_set(toml(by_gear))
