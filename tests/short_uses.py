"""A short run of each command on small gears, as the folder of its tests says.

    [sweep]
    use = "SET --speeds 2000,4000 --excitation rectangular"

Words in capitals are files that tests write: SET is the gear set `set` of
`small_sets.py`, a pair unless it is named; the others are those of `written_inputs`.
`often` is how often the fuzzer draws the command, `fuzzed` what keeps it short on any
machine; `longer` are words of a run of several parts, to be interrupted; `options`, see
`option_cases.py`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from case_files import case_text
from history_files import written
from recorded_signals import recording_text
from rexs_files import RexsWriter, as_xml
from small_sets import PAIR, SETS

from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set

TESTS = Path(__file__).parent
FLAG = ""  # the value of an option that takes none
Words = dict[str, str]  # values by option; arguments by their place


class ShortUse(NamedTuple):
    """Words after the name of a command, and exceptions by option."""

    text: str
    set: str = "pair"
    often: int = 0
    fuzzed: str = ""
    longer: str = ""
    options: Mapping[str, Any] = {}


def _read() -> dict[str, ShortUse]:
    return {
        command: ShortUse(values.pop("use"), **values)
        for path in sorted(TESTS.rglob("short_use.toml"))
        for command, values in tomllib.loads(path.read_text("utf-8")).items()
    }


SHORT_USES = _read()


def words_of(text: str) -> Words:
    """Values of options by their long names, and arguments as `0`, `1`."""
    values, name = Words(), ""
    for word in text.split():
        if re.match("-[a-z-]", word):
            name = {"-o": "--output"}.get(word, word)
            values[name] = f"{values[name]} {name}" if name in values else FLAG
        elif name and not values[name]:
            values[name] = word
        elif name and values[name].endswith(f" {name}"):  # given twice
            values[name] += f" {word}"
        else:
            values[str(len([key for key in values if key.isdigit()]))] = word
    return values


def text_of(values: Words) -> str:
    return " ".join(
        value if name.isdigit() else f"{name} {value}".strip()
        for name, value in values.items()
    )


OTHER = PAIR | {
    "defaults": PAIR["defaults"] | {"face_width_mm": 12.0, "profile_shift": 0.15},
    "mesh": [PAIR["mesh"][0] | {"mean_stiffness_N_per_m": 1.2e8}],
}
SOFT_MACHINE = """\
name = "soft"
[machine]
damping = 0.6
eccentricity_rad = 0.08
half_backlash_rad = 0.6
"""
SPUR_GEARBOX = """\
name = "spurred"
[excitation]
frequency_Hz = 25
amplitude_mm = 0.15
"""
SPUR_WHEEL = """\
[[wheel]]
name = "{}"
base_radius_mm = 40
inertia_kg_m2 = {}
tooth_play_mm = 0.1
tooth_restitution = 0.8
drag_Nm = -0.05
"""


@cache
def input_texts() -> Mapping[str, str]:
    """Contents of the files that short uses read, by name."""
    wheels = [SPUR_WHEEL.format(*row) for row in (("first", 1e-3), ("second", 2e-3))]
    texts = {
        "other.toml": toml_text(OTHER),
        "soft.toml": SOFT_MACHINE,
        "spurred.toml": "".join([SPUR_GEARBOX, *wheels]),
        "table.csv": "torque_Nm,position,stiffness_N_per_m\n"
        + "\n".join(f"20,{i / 8},{1e8 + 3e7 * (i < 4)}" for i in range(8)),
    }
    for name, speed in (("falling", 2000), ("slower", 1900)):
        rows = [f"{time},{speed - 50 * time}" for time in range(6)]
        texts[f"{name}.csv"] = "\n".join(["time_s,speed_rpm", *rows])
    for name, tables in (("box1", PAIR), ("box2", OTHER)):
        tree = RexsWriter(read_gear_set(toml_text(tables))).tree()
        texts[f"{name}.rexs"] = as_xml(tree)
    for name, speeds in (("case", "3000"), ("third", "4000")):
        texts[f"{name}.toml"] = case_text(name, speeds, allowed=9)
    return texts


def written_inputs(folder: Path) -> dict[str, str]:
    """Paths of the files that words in capitals stand for, which are written."""
    for name, text in input_texts().items():
        (folder / name).write_text(text)
    written(folder / "history.csv")
    (folder / "recording.csv").write_text(recording_text())
    names = *input_texts(), "history.csv", "recording.csv"
    paths = {Path(name).stem.upper(): str(folder / name) for name in names}
    return paths | {"RUNS": str(folder / "runs")}


def written_use(command: str, folder: Path, longer: bool = False) -> list[str]:
    """Words of a short use, or of a longer one, whose files are written to a folder."""
    use, inputs = SHORT_USES[command], written_inputs(folder)
    path = folder / "set.toml"
    path.write_text(toml_text(SETS[use.set]))
    paths = inputs | {"SET": str(path)}
    values = words_of(use.text) | words_of(use.longer if longer else "")
    text = f"{command} {text_of(values)}"
    return [paths.get(word, word) for word in text.split()]
