"""Random gear sets, machines, gearboxes, tables and options: no traceback, no hang, no
wrong exit code.

All degrees of freedom take minutes by their nature: such a case is interrupted after a
while, as a user would, and must then end by itself.

As a script: `PYTHONPATH=. python tests/fuzz_gear_sets.py 3000 --seed 1`; it prints what
failed with the arguments and the file that did it; `--kind planetary` has such sets
alone, `--faults show` shows gears with random faults, and `--faults stiffness` solves
them. Tests run a few of the same cases.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import io
import json
import math
import os
import random
import shlex
import signal
import sys
import tempfile
import threading
import time
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from cli_commands import commands
from fuzz_faults import fault_command, meshing_pair, with_faults
from option_cases import cases_of, choices, settings_by_option
from short_uses import FLAG, SHORT_USES, text_of, words_of

from fegear.cli import run
from fegear.files.printable import HARMFUL
from fegear.gearset.problems import known_keys

HANG = 120.0  # s of a case, on a busy machine
PATIENCE = 20.0  # s, with the full degrees of freedom
ALLOWED = {0, 1, 2}
INTERRUPTED = 130
FAILED = (
    "diverged at",
    "contact not solved",
    "no branch can begin",
)  # what code 1 may say here
NASTY = [0, -1, 1e-300, 5e-324, 1e300, math.nan, math.inf, -math.inf, 10**30, 2.5]
WRONG = ["text", "", True, [], [1, "a"], {"a": 1}, "\x1b[31m", "\u202e", "a\nb", "$x$"]
Value = Callable[[random.Random], Any]


def between(low: float, high: float) -> Value:
    return lambda r: round(r.uniform(low, high), 4)


def any_of(*values: Any) -> Value:
    return lambda r: r.choice(values)


GEAR: dict[str, Value] = {
    "teeth": lambda r: r.randint(17, 48),
    "module_mm": any_of(2.0, 2.0, 2.0, 3.0),
    "pressure_angle_deg": any_of(20.0, 20.0, 20.0, 25.0),
    "profile_shift": between(-0.1, 0.2),
    "tip_radius_mm": between(10.0, 60.0),
    "addendum_mm": between(1.8, 2.4),
    "dedendum_mm": between(2.4, 3.0),
    "rack_tip_radius_mm": between(0.05, 1.2),
    "face_width_mm": between(5.0, 40.0),
    "hub_radius_mm": between(2.0, 12.0),
    "tooth_thinning_um": between(0.0, 300.0),
    "young_modulus_GPa": any_of(206.0, 3.0, 70.0),
    "poisson_ratio": between(0.0, 0.49),
    "density_kg_per_m3": any_of(7850.0, 1200.0),
    "inertia_kg_m2": lambda r: 10.0 ** r.uniform(-6, -2),
    "mass_kg": between(0.01, 5.0),
    "bearing_kx_N_per_m": lambda r: 10.0 ** r.uniform(6, 9),
    "coupling_stiffness_Nm_per_rad": any_of(0.0, 100.0, 1e6),
    "ball_bearing": lambda r: {
        "balls": r.randint(3, 20),
        "ball_diameter_mm": round(r.uniform(3.0, 12.0), 2),
        "pitch_diameter_mm": round(r.uniform(20.0, 60.0), 2),
        "clearance_um": r.choice([0.0, 10.0, -5.0, 80.0]),
    },
    "roller_bearing": lambda r: {
        "rollers": r.randint(3, 20),
        "roller_diameter_mm": round(r.uniform(3.0, 12.0), 2),
        "roller_length_mm": round(r.uniform(3.0, 20.0), 2),
        "pitch_diameter_mm": round(r.uniform(20.0, 60.0), 2),
        "inner_waviness_um": [0.0, 0.3],
    },
}
RELIEF: dict[str, Value] = {
    "magnitude_um": between(1.0, 40.0),
    "length_pitches": between(0.05, 0.6),
    "start_roll_angle_deg": between(5.0, 40.0),
    "start": any_of("HPSTC", "LPSTC"),
    "shape": any_of("linear", "parabolic"),
}
MESH: dict[str, Value] = {
    "center_distance_mm": between(30.0, 110.0),
    "operating_pressure_angle_deg": between(20.0, 24.0),
    "contact_ratio": between(1.2, 1.7),
    "phase": between(-1.0, 1.0),
    "center_line_deg": between(-180.0, 180.0),
    "backlash_um": any_of(0.0, 1.0, 200.0),
    "mean_stiffness_N_per_m": lambda r: 10.0 ** r.uniform(7, 9),
    "stiffness_variation": between(0.0, 0.9),
    "load_share": between(0.05, 0.95),
}
RING = {key: GEAR[key] for key in GEAR if key not in ("teeth", "hub_radius_mm")} | {
    "rim_radial_stiffness_N_per_mm3": lambda r: 10.0 ** r.uniform(0, 5),
    "cutter_teeth": lambda r: r.randint(8, 60),
    "tip_radius_mm": between(40.0, 130.0),
}
PLANETARY: dict[str, Value] = {
    "center_distance_mm": between(30.0, 110.0),
    "positions_deg": lambda r: [
        round(60.0 * place + r.choice([0.0, 0.0, 3.0]), 3) for place in range(9)
    ],
    "position_errors_um": lambda r: [
        r.choice([0.0, 0.0, 5.0, -30.0]) for _ in range(9)
    ],
    "carrier_inertia_kg_m2": lambda r: 10.0 ** r.uniform(-6, 0),
    "carrier_mass_kg": between(0.01, 5.0),
    "carrier_bearing_kx_N_per_m": lambda r: 10.0 ** r.uniform(6, 9),
    "carrier_coupling_stiffness_Nm_per_rad": any_of(0.0, 100.0, 1e6),
}
# keys of a mesh that follow from the set
NOT_OF_SIDES = {
    "driver",
    "driven",
    "operating_pressure_angle_deg",
    "center_distance_mm",
    "center_line_deg",
    "phase",
}
RELIEFS = [key for key in known_keys(["mesh"]) if key.endswith("relief")]
NAMES = ["a", "b", "c", "pinion 1", "日本", "wheel-2"]


def shaft_body(r: random.Random) -> dict[str, Any]:
    """Keys of a shaft that bends, most of which fit each other."""
    lengths = [
        round(10.0 ** r.uniform(0.5, 2.5), 3) for _ in range(r.choice([1, 2, 3]))
    ]
    total = sum(lengths)
    bearings = r.choice([2, 2, 2, 3, 1])
    body: dict[str, Any] = {
        "lengths_mm": lengths,
        "diameters_mm": [round(r.uniform(5, 60), 2) for _ in lengths],
        "positions_mm": [round(r.uniform(0, 0.99 * total), 4)],
        "bearing_positions_mm": [
            round(r.uniform(0, 0.999 * total), 4) for _ in range(bearings)
        ],
        "bearing_kx_N_per_m": [10.0 ** r.uniform(4, 10) for _ in range(bearings)],
        "bearing_ky_N_per_m": [10.0 ** r.uniform(4, 10) for _ in range(bearings)],
    }
    for key in ("bearing_kxy_N_per_m", "bearing_kyx_N_per_m"):
        if r.random() < 0.2:
            body[key] = [r.choice([-1, 1]) * 10.0 ** r.uniform(4, 9)] * bearings
    for key in ("bearing_kz_N_per_m", "bearing_tilt_stiffness_Nm_per_rad"):
        if r.random() < 0.2:
            body[key] = [r.choice([0.0, 10.0 ** r.uniform(2, 9)])] * bearings
    if r.random() < 0.2:
        body["driven_from"] = r.choice(["start", "end"])
    if r.random() < 0.3:
        body["bearing_cx_Ns_per_m"] = [10.0 ** r.uniform(0, 6)] * bearings
    if r.random() < 0.3:
        body |= {
            "disk_positions_mm": [r.choice([0.0, total, body["positions_mm"][0]])],
            "disk_masses_kg": [10.0 ** r.uniform(-3, 2)],
            "disk_inertias_kg_m2": [10.0 ** r.uniform(-6, 0)],
        }
    return body


def train(r: random.Random) -> dict[str, Any]:
    """A train in a row with plausible figures, most of which fit each other."""
    count = r.choice([2, 2, 2, 3, 4])
    names = r.sample(NAMES, count)
    tables: dict[str, Any] = {
        "name": "fuzz",
        "defaults": {"module_mm": 2.0, "face_width_mm": 10.0, "hub_radius_mm": 5.0},
        "gear": [gear(r, name) for name in names],
        "mesh": [mesh(r, names[i], names[i + 1]) for i in range(count - 1)],
    }
    if r.random() < 0.9:
        torques = [round(10.0 ** r.uniform(0, 3), 2) for _ in range(r.choice([1, 2]))]
        tables["load"] = {"gear": names[0], "torques_Nm": torques}
    if r.random() < 0.3:
        tables["dynamics"] = {"damping_ratio": r.choice([0.0, 0.01, 0.1])}
    if count > 2 and r.random() < 0.2:
        shaft = {"gears": r.sample(names, 2)}
        tables["shaft"] = [shaft | {"stiffness_Nm_per_rad": 10.0 ** r.uniform(2, 6)}]
    elif r.random() < 0.3:
        tables["shaft"] = [{"gears": [name]} | shaft_body(r) for name in names]
    return tables


def ring_pair(r: random.Random) -> dict[str, Any]:
    """A planet and a ring, either of which drives."""
    tables = train(r)
    planet, ring = gear(r, "planet"), ring_gear(r)
    if r.random() < 0.8:
        ring |= ring_of(r, planet["teeth"] + r.randint(12, 60))
    driver, driven = r.sample(["planet", "ring"], 2)
    entry = mesh(r, driver, driven)
    if "operating_pressure_angle_deg" in entry and r.random() < 0.7:
        del entry["operating_pressure_angle_deg"]
        entry["center_distance_mm"] = ring["teeth"] - planet["teeth"] + 0.0
    tables |= {"gear": [planet, ring], "mesh": [entry]}
    tables.pop("shaft", None)
    if "load" in tables:
        tables["load"]["gear"] = driver
    return tables


def planetary_set(r: random.Random) -> dict[str, Any]:
    """A planetary set, most of which can be assembled."""
    tables = train(r)
    sun, planet, ring = gear(r, "sun"), gear(r, "planet"), ring_gear(r)
    if r.random() < 0.9:
        ring |= ring_of(r, sun["teeth"] + 2 * planet["teeth"])
    fitting = [n for n in range(2, 7) if (sun["teeth"] + ring["teeth"]) % n == 0]
    roles = r.sample(["sun", "carrier", "ring"], 3)
    members = dict(zip(["input", "output", "held"], roles, strict=True))
    entry = {"sun": "sun", "planet": "planet", "ring": "ring", **members}
    entry["planets"] = r.choice(fitting or [3]) if r.random() < 0.8 else r.randint(1, 9)
    for side in ("sun_mesh", "ring_mesh"):
        keys = mesh(r, "a", "b")
        keys = {key: keys[key] for key in keys if key not in NOT_OF_SIDES}
        if r.random() < 0.7:
            entry[side] = keys
    for key in r.sample(list(PLANETARY), r.choice([0, 0, 1, 2])):
        entry[key] = PLANETARY[key](r)
    for key in ("positions_deg", "position_errors_um"):
        if key in entry:
            entry[key] = entry[key][: entry["planets"]]
    if "carrier_bearing_kx_N_per_m" in entry:
        entry["carrier_bearing_ky_N_per_m"] = 2e8
    tables |= {"gear": [sun, planet, ring], "planetary": [entry]}
    for name in ("mesh", "shaft"):
        tables.pop(name, None)
    if "load" in tables:
        tables["load"]["gear"] = members["input"]
    return tables


KINDS = {"train": train, "ring": ring_pair, "planetary": planetary_set}


def ring_of(r: random.Random, teeth: int) -> dict[str, Any]:
    """Teeth of a ring, and a rim that is large enough for them at module 2 mm."""
    return {"teeth": teeth, "rim_radius_mm": round(teeth + r.uniform(4.0, 20.0), 3)}


def ring_gear(r: random.Random) -> dict[str, Any]:
    entry = {"name": "ring", "internal": True, **ring_of(r, r.randint(50, 130))}
    for key in r.sample(list(RING), r.choice([0, 0, 1, 2])):
        entry[key] = RING[key](r)
    if "bearing_kx_N_per_m" in entry:
        entry["bearing_ky_N_per_m"] = 2e8
    if "rim_radial_stiffness_N_per_mm3" in entry:
        entry["rim_tangential_stiffness_N_per_mm3"] = 100.0
    return entry


def gear(r: random.Random, name: str) -> dict[str, Any]:
    entry = {"name": name, "teeth": GEAR["teeth"](r)}
    for key in r.sample(list(GEAR), r.choice([0, 0, 1, 2])):
        entry[key] = GEAR[key](r)
    if "bearing_kx_N_per_m" in entry:
        entry["bearing_ky_N_per_m"] = 2e8
    if r.random() < 0.05:
        entry["pitch_errors_um"] = [r.choice([0.0, 5.0]) for _ in range(entry["teeth"])]
    return entry


def mesh(r: random.Random, driver: str, driven: str) -> dict[str, Any]:
    entry = {
        "driver": driver,
        "driven": driven,
        "operating_pressure_angle_deg": r.choice([21.0, 22.0]),
        "mean_stiffness_N_per_m": 2e8,
        "stiffness_variation": 0.3,
    }
    for key in r.sample(list(MESH), r.choice([0, 0, 1, 2])):
        entry[key] = MESH[key](r)
    if "center_distance_mm" in entry:
        del entry["operating_pressure_angle_deg"]
    if r.random() < 0.4:
        keys = ["magnitude_um", r.choice(["length_pitches", "start"]), "shape"]
        place = r.choice(RELIEFS)
        entry[place] = {key: RELIEF[key](r) for key in keys}
        if "start" in keys:
            entry[place]["start"] = "HPSTC" if "tip" in place else "LPSTC"
    return entry


def broken(r: random.Random, tables: dict[str, Any]) -> dict[str, Any]:
    """The tables with one thing that does not belong there."""
    place: Any = tables
    while True:
        key = r.choice(list(place) if isinstance(place, dict) else range(len(place)))
        inner = place[key]
        if isinstance(inner, dict | list) and inner and r.random() < 0.85:
            place = inner
            continue
        kind = r.random()
        if kind < 0.5:
            place[key] = r.choice(NASTY)
        elif kind < 0.8:
            place[key] = r.choice(WRONG)
        elif kind < 0.9 and isinstance(place, dict):
            place[r.choice(["helix_angle_deg", "teth", "\x1b", "", "a.b"])] = 1
        else:
            del place[key]
        return tables


def validation_case(r: random.Random) -> dict[str, Any]:
    """A small comparison of a lumped model with the finite elements."""
    metric = {"name": "rms_distance", "allowed": 9.0, "reason": "for a test"}
    return {
        "name": "fuzz",
        "title": "Fuzz",
        "gear_set": "set.toml",
        "torques_Nm": [round(10.0 ** r.uniform(0, 2), 2)],
        "speeds_Hz": r.choice(["2000", "2000,2500", "3000:2000:500"]),
        "fidelity": "quasistatic",
        "model": [{"number": r.choice([1, 2, 3]), "excitation": "rectangular"}],
        "metric": [metric],
    }


def toml(value: Any) -> str:
    if isinstance(value, dict):
        inner = (f"{toml(str(k))} = {toml(v)}" for k, v in value.items())
        return "{" + ", ".join(inner) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, float):
        return repr(value).replace("'", "")
    return json.dumps(value)


def text(r: random.Random, tables: dict[str, Any]) -> bytes:
    data = "".join(f"{toml(str(k))} = {toml(v)}\n" for k, v in tables.items()).encode()
    if r.random() < 0.03:  # cut off, or with a byte that does not belong there
        at = r.randrange(len(data))
        return r.choice([data[:at], data[:at] + b"\xff" + data[at:]])
    return data


FILES = ["out.csv", "out.png", "out.vtu", "none/out.csv", "", "x" * 300, "\x1b.csv"]
NUMBERS = ["0", "-1", "1e300", "1e-300", "nan", "x"]
OWN_WORDS = {  # besides another value of the option
    "--along": ["nobody"],
    "--band": ["x"],
    "--history": ["set.toml", ""],
    "--orbit": ["P(9,9,9)", "x"],
    "--over": ["torque_Nm=10,20", "mesh.1.phase=0:1:2", "gear.1.teeth=20:22:3", "a=1"],
    "--root-stress": ["nobody"],
    "--rpm": ["1000:1100", "-5"],
    "--runs": ["kept", "set.toml"],
    "--set": ["mesh.1.phase=0", "gear.9.teeth=3", "\x1b=1", "a"],
    "--speeds": ["900", "500,3000", "1000:3000:1000", "1:9e8:1", "0", "x", "1:2"],
    "--table": ["set.toml", "none.csv", "table.csv"],
    "--time-history": ["set.toml", "none"],
    "--velocity": ["0:1", "7:0", "nan:1", "0:1e300", "x"],
    "--wheel": ["nobody"],
}
OF_MACHINES = {"--over": ["delta=0.55:0.65", "epsilon=0.05:0.1", "beta=0:1", "x=1:2"]}
LONG = {"--cluster"}  # starts processes
WEIGHTS = {name: use.often for name, use in SHORT_USES.items() if use.often}
# without options that take a value, or minutes for one run
NOT_FUZZED = {"explain", "keys", "new", "reproduce", "warmup"}
MACHINES = "roots-scaled", "roots-a", "roots-a-sprung", "roots-a-absorber"


def option_lists() -> dict[str, list[str]]:
    """Names of the options of every command, from typer."""
    params = {name: command.params for name, command in commands()}
    return {
        name: [
            option
            for param in params[name]
            if (option := max(param.opts, key=len)) not in LONG
        ]
        for name in WEIGHTS
    }


@cache
def values_of(name: str, option: str) -> list[str]:
    """Values of an option, allowed ones and others; none where it is a flag."""
    case = dict(cases_of(name))[option]
    value = words_of(case.changed.removeprefix(name)).get(option, FLAG)
    setting = settings_by_option(name).get(option)
    if value == FLAG:
        return []
    if option in OWN_WORDS:
        return [value, *OWN_WORDS[option]]
    if setting is None:  # a file
        return [value, *FILES]
    return [value, *map(str, choices(setting.kind)), *NUMBERS]


def command(r: random.Random, options: dict[str, list[str]]) -> list[str]:
    name = r.choices(list(WEIGHTS), list(WEIGHTS.values()))[0]
    use = SHORT_USES[name]
    arguments = text_of(words_of(use.text) | words_of(use.fuzzed)).split()
    for option in r.sample(
        options[name], min(len(options[name]), r.choice([0, 0, 1, 1, 2]))
    ):
        if not option.startswith("--"):
            continue
        of_machines = OF_MACHINES.get(option) if name.startswith("rattle") else None
        values = of_machines or values_of(name, option)
        value = [r.choice(values)] if values else []
        if option in arguments and r.random() < 0.9:  # another value, not a second one
            at = arguments.index(option)
            arguments[at : at + 2] = [option, *value]
        else:
            arguments += [option, *value]
    if r.random() < 0.03:
        arguments.insert(
            r.randrange(len(arguments) + 1), r.choice(["--tork", "\x1b", "-x", "y"])
        )
    return [*name.split(), *(NAMED.get(word, word) for word in arguments)]


# files of a case in place of those of a short use
NAMED = {
    **dict.fromkeys(("SET", "OTHER", "liu-pair", "liu-idler"), "set.toml"),
    **dict.fromkeys(("roots-scaled", "roots-a"), "machine.toml"),
    **dict.fromkeys(("seed-five-speed", "SPURRED"), "box.toml"),
    "CASE": "case.toml",
    "FALLING": "run.csv",
    "RECORDING": "run.csv",
    "TABLE": "table.csv",
    "RUNS": "kept",
    "HISTORY": "none",
}


def builtin(folder: str, name: str) -> dict[str, Any]:
    place = resources.files("fegear") / folder / f"{name}.toml"
    return tomllib.loads(place.read_text("utf-8"))


def varied(r: random.Random, tables: dict[str, Any]) -> dict[str, Any]:
    """With some numbers a few times larger or smaller."""
    for key, value in tables.items():
        if isinstance(value, dict):
            varied(r, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for row in value:
                varied(r, row)
        elif isinstance(value, float) and r.random() < 0.3:
            tables[key] = float(f"{value * 10.0 ** r.uniform(-0.5, 0.3):.4g}")
    return tables


def table(r: random.Random, names: str, rows: list[list[float]]) -> bytes:
    """A table as it should be, of a spreadsheet, or spoilt."""
    between, comma = r.choice([(",", False), (";", True), ("\t", False), (";", False)])
    lines = [names.replace(",", between)]
    for row in rows:
        cells = [repr(value) for value in row]
        if r.random() < 0.06:
            cells[r.randrange(len(cells))] = r.choice(
                ["nan", "", "inf", "x", "1e999", "9" * 200_000, "\x00", '"', "0x1p3"]
            )
        if comma:
            cells = [cell.replace(".", ",") for cell in cells]
        lines.append(between.join(cells))
    if r.random() < 0.1:
        del lines[r.randrange(len(lines))]
    if r.random() < 0.05:
        r.shuffle(lines)
    return "\n".join(lines).encode()


@dataclass(frozen=True)
class Case:
    """Arguments of a command, and by name the files in the folder where it runs."""

    arguments: list[str]
    files: dict[str, bytes]

    @property
    def data(self) -> bytes:
        return self.files["set.toml"]


def cases(count: int, seed: int, kind: str = "", faults: str = "") -> Iterator[Case]:
    """Cases of one kind of gear set, or of all, most of them trains.

    faults : command, of `fault_command`, that all run on gears with faults; a few gears
        have faults without it
    """
    options = option_lists()
    for number in range(count):
        r = random.Random(f"{seed} {number}")
        drawn = r.choices(list(KINDS), [8, 1, 1])[0]
        tables = KINDS[kind or drawn](r)
        of_faults = random.Random(f"faults {seed} {number}")
        if faults and of_faults.random() < 0.7:
            tables = meshing_pair(of_faults)
        if faults or of_faults.random() < 0.04:
            tables = with_faults(of_faults, tables)
        if r.random() < 0.2:
            tables = broken(r, tables)
        comparison = validation_case(r)
        if r.random() < 0.5:
            comparison = broken(r, comparison)
        machine = varied(r, builtin("commands/rattle/machines", r.choice(MACHINES)))
        box = varied(r, builtin("commands/clatter/gearboxes", "seed-five-speed"))
        if r.random() < 0.2:
            machine, box = broken(r, machine), broken(r, box)
        files = {
            "set.toml": text(r, tables),
            "case.toml": text(r, comparison),
            "machine.toml": text(r, machine),
            "box.toml": text(r, box),
            "table.csv": table(
                r,
                "torque_Nm,position,stiffness_N_per_m",
                [[100.0, i / 8, 3e8 + 4e7 * (i < 4)] for i in range(8)],
            ),
            "run.csv": table(
                r,
                "time_s,speed_rpm",
                [[10.0 * i, 3000.0 * math.exp(-0.1 * i)] for i in range(8)],
            ),
        }
        arguments = command(r, options)
        if faults:
            arguments = fault_command(of_faults, faults)
        yield Case(arguments, files)


@contextlib.contextmanager
def patience(arguments: list[str]) -> Iterator[None]:
    """Ctrl-C after a while where all degrees of freedom may be asked for.

    The signal goes to the main thread, as from a keyboard, so that waiting ends.
    """
    main_thread = threading.main_thread().ident
    timer = threading.Timer(PATIENCE, signal.pthread_kill, (main_thread, signal.SIGINT))
    if "full" in arguments:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


def complaint(code: int, out: str, err: str) -> str | None:
    """What is wrong with the end of a command, if anything."""
    # warnings of the gear set are said before anything is computed
    lines = [line for line in err.splitlines() if not line.startswith("warning: ")]
    if code not in ALLOWED:
        return f"exit code {code}"
    if "--debug for a traceback" in err or "Traceback" in err + out:
        return "a raw error"
    outside = "Outside" in out or '"within": false' in out
    if code == 1 and not any(why in err for why in FAILED) and not outside:
        return "exit code 1 without a reason"
    if code == 2 and len(lines) != 1:
        return f"{len(lines)} lines for wrong input"
    if any(not line.startswith(("fegear: ", "warning: ")) for line in lines):
        return "an error line that is not ours"
    harmful = {c for c in out + err if unicodedata.category(c) in HARMFUL} - {"\n"}
    if harmful:
        return f"letters that steer a terminal: {harmful!r}"
    return None


def tried(case: Case, folder: Path) -> tuple[int, str | None, str]:
    """Exit code, complaint and error line of a case, run in a folder."""
    for name, content in case.files.items():
        (folder / name).write_bytes(content)
    before, out, err = Path.cwd(), io.StringIO(), io.StringIO()
    os.chdir(folder)
    faulthandler.dump_traceback_later(HANG, exit=True)
    try:
        with (
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            patience(case.arguments),
        ):
            code = run(case.arguments)
    finally:
        faulthandler.cancel_dump_traceback_later()
        os.chdir(before)
    if code == INTERRUPTED and "full" in case.arguments:
        return code, None, err.getvalue()
    return code, complaint(code, out.getvalue(), err.getvalue()), err.getvalue()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="number of the one case to run")
    parser.add_argument("--kind", choices=list(KINDS), default="")
    parser.add_argument(
        "--faults",
        choices=("show", "stiffness", "signals"),
        default="",
        help="run this command on gears with faults",
    )
    options = parser.parse_args()
    drawn = cases(options.count, options.seed, options.kind, options.faults)
    # a shell starts what runs in the background with Ctrl-C switched off
    signal.signal(signal.SIGINT, signal.default_int_handler)
    codes: Counter[tuple[str, int]] = Counter()
    slowest, failed = (0.0, ""), 0
    for number, case in enumerate(drawn):
        if options.only not in (None, number):
            continue
        sys.stderr.write(f"\r{number} {shlex.join(case.arguments)[:70]!a:<74}")
        begin = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            code, wrong, line = tried(case, Path(folder))
        seconds = time.perf_counter() - begin
        slowest = max(slowest, (seconds, f"{number} {shlex.join(case.arguments)!a}"))
        codes[case.arguments[0], code] += 1
        if wrong:
            failed += 1
            sys.stdout.write(
                f"\n{number}: {wrong}\n{shlex.join(case.arguments)!a}\n{line}\n"
                f"{ {name: text[:2000] for name, text in case.files.items()}!a}\n"
            )
    for (name, code), times in sorted(codes.items()):
        sys.stdout.write(f"{name:10} exit code {code}: {times}\n")
    sys.stdout.write(f"slowest {slowest[0]:.1f} s: {slowest[1]}\n{failed} failed\n")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
