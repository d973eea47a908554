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
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from cli_commands import ROOT_COMMAND, commands
from history_files import written
from pydantic import BaseModel
from quick_benchmarks import answer_at_once
from rexs_files import RexsWriter, as_xml
from slow_tests import in_tier_of

from fegear import ExcitationSettings, LumpedModel, Map
from fegear.cli import run
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set
from fegear.gearset.edit import LISTS, edited
from fegear.gearset.problems import lists_tables, model_of
from fegear.gearset.schema import Document, GearDefaults, MeshKeys, replaced_keys
from fegear.train.lumped_models import lumped_system
from lumped.steady.maps import Axis

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


Cases = dict[str, Case]
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
    "branches SET --speeds 7200:7800 --excitation rectangular --damping-ratio 0.02 "
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
    "branches liu-pair --excitation rectangular --damping-ratio 0.03 --harmonics 4 "
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
    "stability SET --over friction=0.1 --damping-ratio 0.002 "
    "--speeds 2000:20000:1000 --json"
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
    "--damping-ratio 0.02 --direction up -o b.csv --json"
)
BEARING = "bearing SET --json"
THEORY = "theory SET --excitation rectangular --json"
SHARING = "sharing SET --excitation rectangular --model 1 --json"
ABLATION = "ablation SET --speeds 2000 --runs RUNS --json"  # each run is made once
VALIDATE = "validate CASE -o out --json"
ECCENTRIC = "eccentric --radius 20 --eccentricity 5 --json"
TURN = f"{ECCENTRIC} --teeth 24 --torque 5 --positions 2"
REPRODUCE = "reproduce table-2.1 --json"


def options_in(text: str) -> dict[str, str]:
    """Words of each option of a text by its name."""
    options = re.split(r" (?=-)", text)
    return {re.sub("^-o$", "--output", option.split()[0]): option for option in options}


def added(base: str, text: str, tables: Tables = PAIR, refused: bool = False) -> Cases:
    """Each option of a text is added alone."""
    options = options_in(text).items() if text else ()
    return {name: plus(base, option, tables, refused) for name, option in options}


def replaced(base: str, text: str, tables: Tables = PAIR) -> Cases:
    """Each option of a text takes the place of its value in the base."""
    before = options_in(base)
    return {
        name: swap(base, before[name], option)._replace(tables=tables)
        for name, option in options_in(text).items()
    }


def usual(base: str, text: str, refused: str = "", tables: Tables = PAIR) -> Cases:
    """Another gear set, neither --json nor coarse teeth, and options that are added.

    refused : options that are refused
    """
    cases = {"SET": swap(base, "SET", "OTHER")} if "SET" in base.split() else {}
    for name, option in (("--resolution", COARSE), ("--json", "--json")):
        if option in base:
            cases[name] = less(base, option)
    cases = {name: case._replace(tables=tables) for name, case in cases.items()}
    return (
        cases | added(base, text, tables) | added(base, refused, tables, refused=True)
    )


def lumped(base: str) -> Cases:
    """Options that sweep, wave and map share."""
    tables = base.replace(" --excitation rectangular", "")
    return {
        **usual(
            base,
            "--model 2 --torque 30 --set mesh.1.stiffness_variation=0.4 "
            "--damping-ratio 0.1 --steps 8 --method dopri5 --tolerance 0.1 "
            "--plot p.png",
        ),
        **added(tables, f"--excitation trapezoid --plane strain {COARSE}"),
        **added(f"{tables} --excitation trapezoid", "--ramp 0.05"),
        **added(f"{tables} --excitation fourier", "--excitation-harmonics 1"),
        **added(f"{base} --damping-ratio 1e-4", "--max-periods 40"),
        "--translations": plus(base, "--translations", TRAIN),
        "--relief-stiffness": unmodified(tables),
    }


def not_integrated(base: str) -> Cases:
    """Those of `lumped` without options of integration."""
    left_out = ("--steps", "--method", "--tolerance", "--max-periods")
    return {name: case for name, case in lumped(base).items() if name not in left_out}


def moving(base: str) -> Cases:
    """Those of `lumped`, and that of rolling bearings."""
    plane = f"{base} --translations"
    return lumped(base) | {"--bearings": plus(plane, "--bearings linear", ROLLING)}


def unmodified(base: str) -> Case:
    """Pairs with relief that have the stiffness of teeth without."""
    relieved = "--model 1 --set mesh.1.tip_relief.magnitude_um=10"
    return plus(f"{base} {COARSE} {relieved}", "--relief-stiffness unmodified")


def sharing() -> Cases:
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


def rubbed(base: str) -> Cases:
    """Options of friction, of finite elements that give its bending."""
    base = base.replace(" --excitation rectangular", f" {COARSE}")
    friction = f"{base} --friction 0.2"
    return {
        **added(base, "--friction 0.2"),
        **added(
            friction,
            "--bending 0.2 --sliding instantaneous --torque-of input",
        ),
        **added(f"{friction} --sliding instantaneous", "--transition-speed 0.05"),
    }


def stable() -> Cases:
    """Those of `stability`, which integrates nothing."""
    trapezoid = f"{RUBBED} --bending 0.4 --excitation trapezoid"
    return not_integrated(BUILT) | {
        **added(BUILT, "--method exponential -o s.csv --plot s.png"),
        **added(BUILT, "--model 2 --resume --overwrite", refused=True),
        **replaced(
            BUILT,
            "--damping-ratio 0.01 --over friction=0.1,0.2 --speeds 2000:21000:1000 "
            "--bending 0.2",
        ),
        **added(RUBBED, f"--plane strain {COARSE}"),
        **added(f"{RUBBED} {COARSE}", "--torque 60"),
        "--excitation-harmonics": plus(
            f"{HOLDING} --excitation fourier", "--excitation-harmonics 1", TRAIN
        ),
        "--relief-stiffness": unmodified(RUBBED),
        "--excitation": plus(f"{RUBBED} --bending 0.4", "--excitation trapezoid"),
        "--ramp": plus(trapezoid, "--ramp 0.05"),
        "--rpm": swap(BUILT, "--speeds 2000:20000:1000", "--rpm 5000:50000:2500"),
        "--friction": plus(
            f"{HOLDING} --excitation rectangular", "--friction 0.2 --bending 0.4"
        ),
        "--table": plus(RUBBED, "--table TABLE", refused=True),
    }


def figures_of_machine(base: str) -> Cases:
    """Another machine, and other figures of it."""
    cases = {
        name: plus(base.replace(" --delta 0.575", ""), option)
        for name, option in FIGURES.items()
        if name != "MACHINE"
    }
    return cases | {"MACHINE": swap(base, "roots-scaled", "SOFT")}


OPTIONS: dict[str, Cases] = {
    "warmup": usual("warmup --only rattle --json", "--only statics -o k.csv"),
    "new": {
        **usual("new pair -o f.toml", "--json"),
        **replaced("new pair -o f.toml", "-o g.toml"),
        "KIND": swap("new pair -o f.toml", "pair", "idler"),
        "--from": swap("new --from BOX1 -o f.toml --json", "BOX1", "BOX2"),
    },
    "keys": {
        **usual("keys machine --json", "-o k.csv"),
        "KIND": plus("keys --json", "machine"),
    },
    "explain": {
        **usual("explain E02 --json", "-o e.csv"),
        "CODE": plus("explain W01 --json", "E02"),
    },
    "sets": usual("sets --json", "-o s.csv"),
    "show": {
        **usual("show SET", "--plot p.svg --json"),
        "--set": plus("show SET --json", "--set gear.1.young_modulus_GPa=150"),
    },
    "mesh": {
        **usual(MESH, "--gear 2 --whole --set gear.1.hub_radius_mm=9"),
        **replaced(MESH, "-o m.msh"),
    },
    "stiffness": {
        **usual(
            STIFF,
            "--torque 30 --friction 0.1 --plane strain --body free --harmonic-count 2 "
            "--harmonics h.csv --path p.png --set gear.1.young_modulus_GPa=150 "
            "-o t.csv --plot p.png",
        ),
        **replaced(STIFF, "--positions 16"),
        "--corner-contact": plus(STIFF, "--no-corner-contact"),
        "--mesh": plus(STIFF, "--mesh 2", TRAIN),
        "--cracks": plus(
            f"{STIFF} --set gear.1.cracks=[{{tooth=2,depth_mm=0.5}}]", "--cracks c.csv"
        ),
        "--face": plus(f"{STIFF} --set mesh.1.lead.slope_um=5", "--face f.png"),
        "--face-loads": plus(
            f"{STIFF} --set mesh.1.lead.slope_um=5", "--face-loads f.csv"
        ),
        "--harris": plus(f"{STIFF} --torque 20:40:20", "--harris p.png"),
    },
    "compare": {
        **usual(COMPARE, "--torque 30 --plane strain --set gear.1.teeth=21 -o c.csv"),
        "--mesh": plus(COMPARE, "--mesh 2", TRAIN),
    },
    "relief": {
        **usual(
            RELIEF,
            "--objective mean --compromises 3 --relief-tolerance-um 1 "
            "--length-tolerance 0.05 --shape parabolic --root --symmetric "
            "--max-relief-um 1 --friction 0.1 --plane strain "
            "--set gear.1.young_modulus_GPa=150 -o r.toml --plot p.png "
            "--torques t.csv",
        ),
        **replaced(RELIEF, "--torque 20,40 --starts 2 --positions 12"),
        "--rpm": swap(VIBRATION, "--speeds 900", "--rpm 1500"),
        "--mesh": plus(RELIEF, "--mesh 2", TRAIN),
        "--harmonics": plus(f"{RELIEF} --objective harmonics", "--harmonics 1,3"),
        "--speeds": swap(VIBRATION, "--speeds 900", "--speeds 1200"),
        "--designs": swap(VIBRATION, "--designs 3", "--designs 1"),
        "--pareto": plus(f"{RELIEF} --compromises 3", "--pareto t.csv"),
        "--front": plus(f"{RELIEF} --compromises 3", "--front p.png"),
    },
    "wear": {
        **usual(
            WEAR,
            "--torque 30 --cycles 1e7 --wear-coefficient 1e-17 --depth-step-um 0.001 "
            "--steps 5 --friction 0.1 --plane strain "
            "--set gear.1.young_modulus_GPa=150 -o w.csv --plot p.png --gears w.toml",
        ),
        **replaced(WEAR, "--positions 12"),
        "--corner-contact": plus(WEAR, "--no-corner-contact"),
        "--mesh": plus(WEAR, "--mesh 2", TRAIN),
    },
    "tolerances": {
        **usual(
            TOLERANCES,
            "--torque 30 --grade 5 --driver-grade 5 --driven-grade 5 "
            "--single-pitch-um 1 --profile-slope-um 1 --profile-form-um 1 "
            "--center-distance-um 1 --distribution uniform --seed 2 --plane strain "
            "--set gear.1.young_modulus_GPa=150 -o t.csv --plot p.png "
            "--samples-table s.csv --cycle c.csv",
            refused="--resume --overwrite",
        ),
        **replaced(TOLERANCES, "--samples 12 --positions 12"),
        "--corner-contact": plus(TOLERANCES, "--no-corner-contact"),
        "--mesh": plus(TOLERANCES, "--mesh 2", TRAIN),
    },
    "identify": usual(
        IDENTIFY,
        "--mean 1.1e8 --variation 0.35 --mean-std 0.1 --variation-std 0.1 "
        "--hold-width --along b --torque 200 --set gear.1.young_modulus_GPa=150 "
        "--plane strain -o i.csv --plot p.png",
    ),
    "modes": {
        **usual(MODES, "-o m.csv --set gear.1.inertia_kg_m2=1e-3 --stiffness fe"),
        **added(
            f"{MODES} --stiffness fe", "--torque 200 --plane strain --resolution coarse"
        ),
        "--translations": plus(MODES, "--translations", TRAIN),
        "--rpm": plus(f"{MODES} --translations", "--rpm 3000", PLANETARY),
    },
    "bearing": {
        **usual(
            BEARING,
            "--load 500 --torque 30 --set gear.1.ball_bearing.balls=8 -o b.csv "
            "--over-load l.csv --plot p.png",
            tables=ROLLING,
        ),
        "SET": swap(BEARING, "SET", "OTHER")._replace(tables=ROLLING, refused=True),
        "--gear": plus(BEARING, "--gear b", TWO_BEARINGS),
    },
    "campbell": {
        **usual(
            CAMPBELL,
            "-o c.csv --critical c.csv --plot p.png --set gear.1.inertia_kg_m2=1e-3 "
            "--max-rpm 9000 --modes 2",
            tables=BENT,
        ),
        **added(
            f"{CAMPBELL} --stiffness fe",
            "--torque 200 --plane strain --resolution coarse",
            tables=BENT,
        ),
        "SET": Case(CAMPBELL, CAMPBELL.replace("SET", "turbo-pair"), BENT),
        "--stiffness": plus(CAMPBELL, f"--stiffness fe {COARSE}", BENT),
        "--points": plus(CAMPBELL.replace("--points 3 ", ""), "--points 4", BENT),
        "--elements": plus(CAMPBELL.replace("--elements 2 ", ""), "--elements 3", BENT),
    },
    "export": {
        **usual(
            EXPORT,
            "--torque 200 --set gear.1.inertia_kg_m2=1e-3 --damping-ratio 0.1 "
            "--stiffness fe",
            refused="--mesh 1",  # m.json has all meshes
        ),
        **replaced(EXPORT, "-o m.npz"),
        "--translations": plus(EXPORT, "--translations", TRAIN),
        "--plane": plus(f"{EXPORT} --stiffness fe", "--plane strain"),
        "--resolution": plus(f"{EXPORT} --stiffness fe", COARSE),
    },
    "stability": stable(),
    "sweep": moving(SWEEP)
    | rubbed(SWEEP)
    | {
        **added(SWEEP, "--direction up -o s.csv --spectra l.csv --waterfall w.png"),
        **replaced(SWEEP, "--speeds 2000,4100"),
        "--rpm": swap(SWEEP, "--speeds 2000,4000", "--rpm 3000"),
        "--table": plus("sweep SET --speeds 2000 --model 3 --json", "--table TABLE"),
        "--without": plus(f"{COUPLED} --direction up", "--without body"),
    },
    "motion": moving(WAVE)
    | rubbed(WAVE)
    | {
        **added(WAVE, "--from-speed 2101 --from-rpm 7010 -o w.csv"),
        **replaced(WAVE, "--speed 4000"),
        "--rpm": swap(WAVE, "--speed 2100", "--rpm 7000"),
        "--table": plus("motion SET --speed 2000 --model 3 --json", "--table TABLE"),
        "--without": plus(COUPLED_WAVE, "--without body"),
    },
    "signals": lumped(SIGNALS)
    | {
        **added(
            SIGNALS,
            "--from-speed 2101 --from-rpm 7010 --gear b --noise-percent 1 -o s.csv "
            "--average a.csv --spectrum l.csv --pulses 8 --window 1 --orders o.csv",
        ),
        **replaced(SIGNALS, "--speed 4000 --turns 3 --samples 9"),
        "--rpm": swap(SIGNALS, "--speed 2100", "--rpm 7000"),
        "--max-periods": plus(
            f"{SIGNALS} --damping-ratio 1e-4", "--max-periods 40", refused=True
        ),  # the motion does not repeat
        "--seed": plus(f"{SIGNALS} --noise-percent 1", "--seed 1"),
        "--table": plus(
            "signals SET --speed 2000 --turns 1 --model 3 --json", "--table TABLE"
        ),
        "--seconds": swap(RAMP, "--seconds 0.1", "--seconds 0.2"),
        "--order-map": plus(RAMP, "--order-map o.png"),
        "--without": plus(COUPLED_SIGNALS, "--without body"),
    },
    "faults": lumped(FAULTS)
    | {
        **added(
            FAULTS, "--random 3 --gear b --noise-percent 1 -o s.csv --labels l.csv"
        ),
        **added(FAULTS, "--overwrite --resume --scheduler nowhere", refused=True),
        **replaced(FAULTS, "--over pitch_error=0,2 --rpm 7100 --turns 3 --samples 9"),
        "--cluster": plus(FAULTS, "--cluster --scheduler tcp://no:1", refused=True),
        "--max-periods": plus(
            f"{FAULTS} --damping-ratio 1e-4", "--max-periods 40", refused=True
        ),  # the motion does not repeat
        "--random-seed": plus(f"{FAULTS} --random 3", "--random-seed 1"),
        "--tooth": plus(f"{FAULTS} -o s.csv", "--tooth 2"),
        "--seed": plus(f"{FAULTS} --noise-percent 1", "--seed 1"),
        "--averages": plus(f"{FAULTS} -o s.mat", "--averages"),
        "--without": plus(COUPLED_FAULTS, "--without body"),
    },
    "branches": not_integrated(BRANCHES)
    | {
        **added(BRANCHES, "--steepness 1 --harmonics 2 --solver shooting -o b.csv"),
        **added(BRANCHES, "--resume --overwrite", refused=True),
        **replaced(BRANCHES, "--speeds 2000:2300"),
        "--rpm": swap(BRANCHES, "--speeds 2000:2200", "--rpm 5000:5400"),
        "--over": swap(BRANCHES_OVER, "0.05:0.06", "0.05:0.07"),
        "--at": swap(BRANCHES_OVER, "2100", "2200"),
        "--starts": plus(ISOLATED, "--starts 40"),
        "--period-multiple": plus(DOUBLING, "--period-multiple 1"),
        "--sweep-points": plus(SWEPT, "--sweep-points 2"),
        "--excitation-harmonics": plus(
            BRANCHES.replace("rectangular", "fourier"), "--excitation-harmonics 1"
        ),
        "--table": plus(BRANCHES_OF_ELEMENTS, "--table TABLE"),
        "--without": plus(COUPLED_BRANCHES, "--without body"),
    },
    "theory": not_integrated(THEORY)
    | {
        **added("theory SET --model 3 --json", "--table TABLE"),
        "--output": plus(THEORY, "-o t.csv"),
    },
    "sharing": sharing(),
    "map": moving(MAP)
    | rubbed(MAP)
    | {
        **added(MAP, "--over mesh.1.stiffness_variation=0.3,0.4 --exponents -o m.csv"),
        **added(MAP, "--overwrite --resume --scheduler nowhere", refused=True),
        **replaced(MAP, "--at 4000"),
        "--band": swap(MAP, "--at 3000", "--band 3000,4000"),
        "--rpm": swap(MAP, "--at 3000", "--rpm 7000"),
        "--cluster": plus(MAP, "--cluster --scheduler tcp://nowhere:1", refused=True),
        "--without": plus(COUPLED_MAP, "--without body"),
    },
    "bifurcations": lumped(SECTIONS)
    | {
        **added(SECTIONS, "--direction up"),
        **replaced(SECTIONS, "--over gear.a.inertia_kg_m2=1e-4,3e-4 --at 4000"),
        "--rpm": swap(SECTIONS, "--at 3000", "--rpm 7000"),
        "--output": less(SECTIONS, "-o b.csv"),
        "--sections": plus(f"{DOUBLED} --period-multiple 1", "--sections 7"),
        "--period-multiple": plus(DOUBLED, "--period-multiple 1"),
        "--without": plus(COUPLED_SECTIONS, "--without body"),
        "--resume": plus(less(SECTIONS, "-o b.csv").base, "--resume", refused=True),
        "--overwrite": plus(
            less(SECTIONS, "-o b.csv").base, "--overwrite", refused=True
        ),
    },
    "dynamics": {
        **usual(
            f"{QUASI} --json",
            "--torque 30 --set gear.1.inertia_kg_m2=2e-4 --friction 0.1 "
            "--damping-ratio 0.1 --plane strain --steps 16 --tolerance 0.1",
        ),
        **replaced(
            f"{QUASI} --json", "--fidelity reduced --speeds 4000 --direction both"
        ),
        **added(QUASI, "--model-1 -o d.csv --plot p.png --history h --json"),
        **added(QUASI, "--resume --overwrite", refused=True),
        "--rpm": swap(f"{QUASI} --json", "--speeds 3000", "--rpm 7000"),
        "--torque-of": plus(f"{QUASI} --json --friction 0.1", "--torque-of input"),
        "--elastic-damping": plus(
            f"{QUASI} --json".replace("quasistatic", "reduced"), "--elastic-damping 0.5"
        ),
        "--cutoff": plus(
            f"{QUASI} --json".replace("quasistatic", "reduced"), "--cutoff 30000"
        ),
        "--translations": plus(f"{QUASI} --json", "--translations", TRAIN),
        "--max-periods": plus(
            f"{QUASI} --damping-ratio 1e-4 --json", "--max-periods 1"
        ),
        "--root-stress": plus(f"{QUASI} --history h", "--root-stress a"),
    },
    "render": {
        **usual(
            RENDER,
            "--position 0.5 --torque 30 --friction 0.1 --field pressure --scale 100 "
            "--zoom gear --plane strain --set gear.1.young_modulus_GPa=150",
            refused="--frames 4 --turns 1",
        ),
        **replaced(RENDER, "-o q.png --width 640"),
        "--time-history": Case(
            RENDER.replace("SET", "liu-pair"),
            RENDER.replace("SET", "liu-pair") + " --time-history HISTORY",
        ),
        "--mesh": plus(RENDER, "--mesh 2", TRAIN),
    },
    "ablation": {
        **usual(
            ABLATION,
            "-o b.csv --torque 30 --tolerance 0.9 --set gear.a.inertia_kg_m2=1e-3 "
            "--plot p.png",
        ),
        **replaced(ABLATION, "--speeds 2100 --runs kept"),
        "--rpm": swap(ABLATION, "--speeds 2000", "--rpm 6000"),
    },
    "validate": {
        **usual(
            VALIDATE, "--fidelity reduced --quick", refused="--all --scheduler nowhere"
        ),
        **replaced(VALIDATE, "-o there"),
        "CASE": swap(VALIDATE, "CASE", "THIRD"),
        "--cluster": plus(
            VALIDATE, "--cluster --scheduler tcp://nowhere:1", refused=True
        ),
    },
    "reproduce": {
        **usual(REPRODUCE, "--quick", refused="--all"),
        "NUMBER": swap(REPRODUCE, "table-2.1", "table-2.2"),
        "--list": Case(f"{REPRODUCE} -o out", "reproduce --list --json"),
        "--output": swap(f"{REPRODUCE} -o out", "out", "there"),
    },
    "eccentric": {
        **usual(
            ECCENTRIC,
            "--ratio 2 --pressure-angle 22 --teeth 30 -o w.csv --animate w.gif "
            "--plot w.png",
        ),
        **replaced(ECCENTRIC, "--radius 21 --eccentricity 4"),
        **added(TURN, "--face-width 12 --contact t.csv"),
        **added(TURN, "--resume --overwrite", refused=True),
        **replaced(TURN, "--torque 10 --positions 3"),
        "--addendum": plus(f"{ECCENTRIC} --teeth 30", "--addendum 0.9"),
        "--dedendum": plus(f"{ECCENTRIC} --teeth 30", "--dedendum 1.2"),
        "--bore": plus(f"{ECCENTRIC} --teeth 30 -o w.msh", "--bore 3"),
        "--resolution": plus(f"{ECCENTRIC} --teeth 30 -o w.msh", "--resolution coarse"),
    },
    "clatter": {
        **usual(
            CLATTER,
            "--impacts 20 --seed 3 --chaos --attractor a.png -o i.csv --plot m.png",
        ),
        **replaced(CLATTER, "--seconds 2"),
        "GEARBOX": swap(CLATTER, "seed-five-speed", "SPURRED"),
        "--map": swap(f"{MAPPED} --map implicit", "implicit", "fermi"),
        "--wheel": plus(f"{MAPPED} --map implicit", "--wheel second"),
        "--resume": plus(f"{MAPPED} --map fermi -o i.csv", "--resume", refused=True),
        "--overwrite": plus(
            f"{MAPPED} --map fermi -o i.csv", "--overwrite", refused=True
        ),
    },
    **{
        f"bench {name}": usual(
            f"bench {name} --json", "SET --torque 50 --quick -o there"
        )
        for name in ("stiffness", "dynamics", "stability")
    },
    **{
        f"bench {name}": usual(f"bench {name} --json", "--quick -o there")
        for name in ("clatter", "growth", "commands", "eccentric", "width", "all")
    },
    "bench branches": usual(
        "bench branches --json", "SET --torque 50 --damping-ratio 0.1 --quick -o there"
    ),
    "bench lumped": {
        **usual(
            "bench lumped --json",
            "SET --torque 50 --damping-ratio 0.1 --quick -o there",
        ),
        "--stress": plus("bench lumped --torque 50 --json", "--stress", refused=True),
    },
    "rattle critical": {
        **usual(CRITICAL, "--delta 4e-4 --epsilon 9e-5 --kappa 2000 -o t.csv"),
        "MACHINE": swap(CRITICAL, "roots-a", "roots-scaled"),
    },
    "rattle gears": {
        **usual(
            GEARS,
            "--driven-share 0.3 --driving-inertia-kgm2 0.1 --driven-inertia-kgm2 0.1 "
            "--plane strain -o m.toml",
        ),
        **replaced(GEARS, "--speed-rpm 800 --drag-Nm 2 --eccentricity-um 8"),
        "--mesh": plus(GEARS, "--mesh 2", TRAIN),
    },
    "rattle run-down": {
        **usual(RUN_DOWN, "--speed-rpm 1500 --inertia-kgm2 0.1 -o t.csv"),
        "FILE": swap(RUN_DOWN, "FALLING", "SLOWER"),
    },
    "rattle periodic": figures_of_machine(ORBITS)
    | {
        **added(ORBITS, "--velocity 0:4 -o t.csv"),
        **replaced(ORBITS, "--max-liftoffs 2"),
        "--json": less(ORBITS, "--json"),
    },
    "rattle bifurcation": figures_of_machine(OVER_DELTA)
    | {
        **added(OVER_DELTA, "--velocity 0:4 -o b.csv --plot b.png"),
        **added(OVER_DELTA, "--resume --overwrite", refused=True),
        **replaced(OVER_DELTA, "--over epsilon=0.09:0.11 --max-liftoffs 2 --runs 3"),
        "--json": less(OVER_DELTA, "--json"),
        "--epsilon": plus(OVER_DELTA.replace("epsilon", "delta"), "--epsilon 0.09"),
        "--starts": swap(DOUBLED_ORBITS, "--starts 5", "--starts 1"),
        "--doublings": plus(DOUBLED_ORBITS, "--doublings 0"),
    },
    "rattle basin": figures_of_machine(RATTLE)
    | {
        **added(RATTLE, "--velocity 0:6 --iterations 100 -o r.npz --plot r.png"),
        **added(RATTLE, "--scheduler nowhere --resume --overwrite", refused=True),
        **replaced(RATTLE, "--grid 14"),
        "--cluster": plus(
            RATTLE, "--cluster --scheduler tcp://nowhere:1", refused=True
        ),
        "--json": less(RATTLE, "--json"),
    },
    "rattle manifold": figures_of_machine(MANIFOLD)
    | {
        **added(
            MANIFOLD,
            "--velocity 0:4 --orbit P(1,1,0) --max-liftoffs 2 --spacing 0.02 "
            "--unstable -o m.csv --plot m.png",
        ),
        **replaced(MANIFOLD, "--length 2 --preimages 1"),
        "--grid": swap(f"{MANIFOLD} --plot m.png", "--json", "--grid 10 --json"),
        "--json": less(MANIFOLD, "--json"),
    },
    "rattle noise": figures_of_machine(NOISE)
    | {
        **added(
            NOISE,
            "--velocity 0:6 --seed 2 --iterations 100 --turns 100 -o n.csv "
            "--plot n.png",
        ),
        **replaced(NOISE, "--starts 50"),
        "--json": less(NOISE, "--json"),
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
    (folder / "other.toml").write_text(toml_text(other))
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
    (folder / "pair.toml").write_text(toml_text(PAIR))
    for name, tables in (("box1", PAIR), ("box2", other)):
        tree = RexsWriter(read_gear_set(toml_text(tables))).tree()
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
        text = toml_text(tables)
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
HARD = "sweep SET --speeds 3600 --excitation rectangular --damping-ratio 0.005 --json"
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
    "helix_angle_deg": Key(15.0, (SHOWN, STIFF), entry=0),
    "hand": Key("left", (SHOWN,), HELICAL, entry=1),
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
    **{
        key: case
        for lead in ("lead", "driver_lead", "driven_lead")
        for key, case in lead_keys(lead).items()
    },
    "mesh.misalignment_um": Key(6.0, (SHOWN, STIFF)),
    "mesh.offset_mm": Key(2.0, (SHOWN, STIFF)),
    "plane": Key("strain", (STIFF, FINITE)),
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
    if lists_tables([table, *rest.split(".")[:-1]]):
        rest = rest.replace(".", ".1.")
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
