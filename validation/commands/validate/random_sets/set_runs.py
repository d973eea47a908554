"""Runs of the random gear sets, stored and found again by hash, as `run_store` does.

A run's directory below the store holds a table, result.json and inputs.json. For every
set there is one with speeds.csv, the vibration by every source; for the smallest one
and full.csv, all elastic freedoms against their modes.
"""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from fegear.files.errors import InputError
from fegear.files.kept import directory_of_inputs, write_verified_files
from fegear.files.version import package_version
from fegear.gearset.model import GearSet
from lumped.common.csv_text import format_records
from lumped.common.progress import Progress, silent
from lumped.common.workers import Cluster, NoClusterError, run_tasks
from validation.commands.validate.random_sets.full_dynamics import SETS as FULL_SETS
from validation.commands.validate.random_sets.full_dynamics import SPEEDS as FULL_SPEEDS
from validation.commands.validate.random_sets.full_dynamics import (
    FullPoint,
    measure_full,
    smallest_sets,
)
from validation.commands.validate.random_sets.generator import COUNT, random_gear_set
from validation.commands.validate.random_sets.measuring import (
    REFERENCE,
    Measured,
    measure,
)
from validation.commands.validate.random_sets.measuring import SPEEDS as SPEED_COUNT
from validation.study.provenance import machine
from validation.study.run_store import (
    RESULT,
    read_or_compute,
    read_texts,
    run_contents,
)
from validation.study.sources import digest_of

FORMAT = "fegear random gear set 3"  # of the files and of their content
SPEEDS, FULL = "speeds.csv", "full.csv"
POLL = 0.5  # seconds between looks at whether the run is to end
Rows = list[dict[str, Any]]
Result = tuple[dict[str, Any], Rows]  # of result.json and of the table
Measure = Callable[[GearSet, int, Progress, int], Measured]


@dataclass(frozen=True)
class Extent:
    """sets : how many of the random gear sets; speeds : of each

    full_sets, full_speeds : the same with all elastic freedoms
    """

    sets: int = COUNT
    speeds: int = SPEED_COUNT
    full_sets: int = FULL_SETS
    full_speeds: int = FULL_SPEEDS


FULL_EXTENT = Extent()
QUICK = Extent(sets=1, speeds=2, full_sets=1, full_speeds=1)


@dataclass(frozen=True)
class SetRun:
    """A set with what it gave, or why it gave nothing.

    table : its CSV file; reused : whether nothing was computed
    machine : on which it was made
    full : all freedoms against modes, of the smallest sets
    """

    name: str
    table: Path
    reused: bool
    machine: str
    failure: str
    measured: Measured | None = None
    full: tuple[FullPoint, ...] = ()


def run_random_sets(
    store: Path,
    report: Progress = silent,
    workers: int | Cluster | None = None,
    extent: Extent = FULL_EXTENT,
) -> tuple[list[SetRun], bool]:
    """Run what is not in the store yet; also whether all was finished before Ctrl-C.

    workers : processes, one a core if None, or a cluster
    """
    runs: list[SetRun] = []
    with suppress(KeyboardInterrupt):
        numbers = range(extent.sets)
        new_sets = make_sets(store, workers, report, numbers, extent=extent)
        for run in compared_sets(store, report, numbers, extent=extent):
            runs.append(replace(run, reused=run.reused and run.name not in new_sets))
        runs.extend(full_sets(store, report, extent))
        return runs, True
    return runs, False


def make_sets(
    store: Path,
    workers: int | Cluster | None = None,
    report: Progress = silent,
    numbers: Iterable[int] = range(COUNT),
    measuring: Measure = measure,
    extent: Extent = FULL_EXTENT,
) -> set[str]:
    """Make the sets that are not in the store yet, several at once; their names.

    Each is stored as it is finished. They are made in processes, since meshes are not
    made in threads; `compared_sets` then reads them. Of a single worker it makes none.

    measuring : a function of a module
    """
    missing = [n for n in numbers if not _is_made(random_gear_set(n), store, extent)]
    if not isinstance(workers, Cluster):
        workers = min(workers or os.cpu_count() or 1, len(missing))
        if workers < 2:
            return set()
    made: set[str] = set()

    def take(number: int, contents: Mapping[str, bytes]) -> None:
        gear_set = random_gear_set(number)
        directory, inputs = _directory_and_inputs(gear_set, store, SPEEDS, extent)
        write_verified_files(directory, contents)
        if read_set(gear_set.name, directory / SPEEDS, inputs, False) is None:
            raise InputError(
                f"{directory}: made by workers whose program is not the one of here"
            )
        made.add(gear_set.name)
        report("random sets of workers", len(made), len(missing))

    report("random sets of workers", 0, len(missing))
    tasks = [(n, partial(contents_of_set, n, measuring, extent)) for n in missing]
    if isinstance(workers, Cluster):
        try:
            run_tasks(tasks, take, threading.Event(), workers)
        except NoClusterError as error:
            raise InputError(str(error)) from None
        return made
    with ProcessPoolExecutor(
        workers, get_context("spawn"), initializer=_leave_interrupts_to_the_parent
    ) as pool:
        running = {pool.submit(task): number for number, task in tasks}
        try:
            while running:
                ended = wait(running, POLL, return_when=FIRST_COMPLETED).done
                for future in ended:
                    take(running.pop(future), future.result())
                report("random sets of workers", len(made), len(missing))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            for future, number in running.items():  # those that were in progress
                if not future.cancelled() and future.exception() is None:
                    take(number, future.result())
            raise
    return made


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def contents_of_set(
    number: int, measuring: Measure, extent: Extent = FULL_EXTENT
) -> dict[str, bytes]:
    """The files of a set by name."""
    gear_set = random_gear_set(number)
    make = partial(_compare_set, gear_set, number, measuring, silent, extent)
    return _contents(inputs_of(gear_set, SPEEDS, extent), SPEEDS, make)


def _contents(
    inputs: dict[str, str], table: str, make: Callable[[], Result]
) -> dict[str, bytes]:
    """The files of a run; one that fails is a result."""
    try:
        result, rows = make()
    except (InputError, ArithmeticError) as error:
        result, rows = {"failure": str(error)}, []
    result = {"machine": machine(), "failure": ""} | result
    return run_contents(inputs, {table: format_records(rows)}, result)


def _directory_and_inputs(
    gear_set: GearSet, store: Path, table: str, extent: Extent
) -> tuple[Path, dict[str, str]]:
    """Directory of a run, and its inputs."""
    inputs = inputs_of(gear_set, table, extent)
    kind = "random-full" if table == FULL else "random"
    return directory_of_inputs(store, f"{kind}-{gear_set.name}", inputs), inputs


def _is_made(gear_set: GearSet, store: Path, extent: Extent) -> bool:
    directory, inputs = _directory_and_inputs(gear_set, store, SPEEDS, extent)
    return read_set(gear_set.name, directory / SPEEDS, inputs, True) is not None


def compared_sets(
    store: Path,
    report: Progress = silent,
    numbers: Iterable[int] = range(COUNT),
    measuring: Measure = measure,
    extent: Extent = FULL_EXTENT,
) -> Iterator[SetRun]:
    """The coupled model against finite elements, set by set."""
    for number in numbers:
        gear_set = random_gear_set(number)
        report_set = partial(_report_of, report, number)
        make = partial(_compare_set, gear_set, number, measuring, report_set, extent)
        yield _read_or_make(gear_set, store, SPEEDS, extent, make)


def full_sets(
    store: Path, report: Progress = silent, extent: Extent = FULL_EXTENT
) -> Iterator[SetRun]:
    """All elastic freedoms against their modes, for the smallest sets."""
    for number in smallest_sets(extent.full_sets):
        gear_set = random_gear_set(number)
        make = partial(
            _compare_full_set, gear_set, partial(_report_of, report, number), extent
        )
        yield _read_or_make(gear_set, store, FULL, extent, make)


def _report_of(
    report: Progress, number: int, stage: str, done: int, total: int
) -> None:
    report(f"random set {number + 1}: {stage}", number, COUNT)


def _compare_set(
    gear_set: GearSet,
    number: int,
    measuring: Measure,
    report: Progress,
    extent: Extent,
) -> Result:
    measured = measuring(gear_set, number, report, extent.speeds)
    return {"measured": asdict(measured)}, speed_rows(measured)


def _compare_full_set(gear_set: GearSet, report: Progress, extent: Extent) -> Result:
    points = measure_full(gear_set, report, count=extent.full_speeds)
    rows = [asdict(point) for point in points]
    return {"full": rows}, rows


def _read_or_make(
    gear_set: GearSet,
    store: Path,
    table: str,
    extent: Extent,
    make: Callable[[], Result],
) -> SetRun:
    """A run with its table; one that fails is a result."""
    directory, inputs = _directory_and_inputs(gear_set, store, table, extent)
    read = partial(read_set, gear_set.name, directory / table, inputs)
    compute = partial(_contents, inputs, table, make)
    return read_or_compute(directory, [table], read, compute)


def inputs_of(
    gear_set: GearSet, table: str, extent: Extent = FULL_EXTENT
) -> dict[str, str]:
    """All that determines the results."""
    return {
        "format": FORMAT,
        "fegear version": package_version(),
        "sources": digest_of(__name__),
        "gear set": repr(gear_set),
        "table": table,
        "speeds": repr(extent.full_speeds if table == FULL else extent.speeds),
    }


def read_set(
    name: str, table: Path, inputs: dict[str, str], reused: bool
) -> SetRun | None:
    """None where a file is missing, damaged, or belongs to something else."""
    texts = read_texts(table.parent, inputs, [table.name])
    if texts is None:
        return None
    result = json.loads(texts[RESULT])
    measured = result.get("measured")
    return SetRun(
        name=name,
        table=table,
        reused=reused,
        machine=result["machine"],
        failure=result["failure"],
        measured=None if measured is None else Measured(**measured),
        full=tuple(FullPoint(**point) for point in result.get("full", ())),
    )


def speed_rows(measured: Measured) -> list[dict[str, Any]]:
    """A row for each speed and mesh."""
    return [
        {"mesh_frequency_Hz": speed, "mesh": mesh + 1}
        | {f"{s}_rms_m": rows[i][mesh] for s, rows in measured.rms_m.items()}
        | {f"{s}_periods": rows[i][mesh] for s, rows in measured.multiples.items()}
        for i, speed in enumerate(measured.speeds_Hz)
        for mesh in range(len(measured.rms_m[REFERENCE][i]))
    ]
