"""Runs of the random gear sets, kept and found again by hash; see `validation.kept`.

A set's directory below the store holds inputs.json, speeds.csv with the vibration by
every source, and result.json.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import validation
from fegear.errors import InputError
from fegear.gearset.model import GearSet
from fegear.output import make_directory
from fegear.statics import Progress
from fegear.store import digest
from fegear.version import package_version
from lumped.csv_text import format_records
from validation.kept import RESULT, begin_run, sealed, whole_texts, write_texts
from validation.provenance import machine
from validation.random_sets.generator import COUNT, random_gear_set
from validation.random_sets.measuring import Measured, measure
from validation.sources import PACKAGES, digest_of

FORMAT = "fegear random gear set 1"  # of the files and of what stands in them
SPEEDS = "speeds.csv"
SOURCES = {
    **PACKAGES,
    validation: (
        *("kept.py", "oracles/loaded_modes.py"),
        *(f"random_sets/{n}.py" for n in ("generator", "measuring", "reduced_gears")),
    ),
}
Measure = Callable[[GearSet, int, Progress], Measured]


@dataclass(frozen=True)
class SetRun:
    """A set with what it gave, or why it gave nothing.

    reused : whether nothing was computed; machine : on which it was made
    """

    name: str
    directory: Path
    reused: bool
    machine: str
    measured: Measured | None
    failure: str


def run_random_sets(
    store: Path,
    report: Progress = lambda what, done, total: None,
    numbers: Iterable[int] = range(COUNT),
    measuring: Measure = measure,
) -> Iterator[SetRun]:
    """Run what is not in the store yet, set by set."""
    for number in numbers:

        def told(what: str, done: int, total: int, number: int = number) -> None:
            report(f"random set {number + 1}: {what}", number, COUNT)

        yield found_or_made(number, store, measuring, told)


def found_or_made(
    number: int, store: Path, measuring: Measure, report: Progress
) -> SetRun:
    gear_set = random_gear_set(number)
    inputs = inputs_of(gear_set)
    name = f"random-{gear_set.name}-{digest(inputs)[:16]}"
    directory = make_directory(store / name)
    found = read_set(gear_set.name, directory, inputs, reused=True)
    if found is not None:
        return found
    begin_run(directory, inputs, [SPEEDS])
    result, rows = result_of(gear_set, number, measuring, report)
    write_texts(directory, sealed(inputs, {SPEEDS: format_records(rows)}, result))
    made = read_set(gear_set.name, directory, inputs, reused=False)
    if made is None:
        raise InputError(f"{directory}: was changed while the run was made; run again")
    return made


def result_of(
    gear_set: GearSet, number: int, measuring: Measure, report: Progress
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """What result.json and speeds.csv say; a set that fails is a result."""
    common = {"machine": machine()}
    try:
        measured = measuring(gear_set, number, report)
    except (InputError, ArithmeticError) as error:
        return common | {"failure": str(error), "measured": None}, []
    return common | {"failure": "", "measured": asdict(measured)}, speed_rows(measured)


def inputs_of(gear_set: GearSet) -> dict[str, str]:
    """All that determines the results."""
    return {
        "format": FORMAT,
        "fegear version": package_version(),
        "sources": digest_of(tuple(SOURCES.items())),
        "gear set": repr(gear_set),
    }


def read_set(
    name: str, directory: Path, inputs: Mapping[str, str], reused: bool
) -> SetRun | None:
    """None where a file is missing, damaged, or belongs to something else."""
    texts = whole_texts(directory, inputs, [SPEEDS])
    if texts is None:
        return None
    result = json.loads(texts[RESULT])
    given = result["measured"]
    return SetRun(
        name=name,
        directory=directory,
        reused=reused,
        machine=result["machine"],
        measured=None if given is None else Measured(**given),
        failure=result["failure"],
    )


def speed_rows(measured: Measured) -> list[dict[str, Any]]:
    """A row for each speed and mesh."""
    return [
        {"mesh_frequency_Hz": speed, "mesh": mesh + 1}
        | {f"{s}_rms_m": rows[i][mesh] for s, rows in measured.rms_m.items()}
        | {f"{s}_periods": rows[i][mesh] for s, rows in measured.multiples.items()}
        for i, speed in enumerate(measured.speeds_Hz)
        for mesh in range(len(measured.rms_m["reference"][i]))
    ]
