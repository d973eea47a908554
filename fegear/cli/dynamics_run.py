"""Sweeps of the finite-element gears: threads, checkpoint, files of single motions."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from fegear.cli.options import counted
from fegear.cli.screen import complain
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.dynamics.build import Prepared
    from fegear.dynamics.respond import DynamicSettings, Motion
    from fegear.dynamics.root_stress import RootInfluence
    from fegear.gearset.model import GearSet
    from fegear.statics import StaticsSettings
    from fegear.store import Checkpoint
    from lumped.sweep import Branch, Direction
    from lumped.system import LumpedSystem

    # (number of the torque, direction, frequency [Hz], motion there)
    Keeper = Callable[[int, Direction, float, Motion], None]

DERIVED = "elastic freedoms"  # of a header, from the gear set and the speeds
REFRESH = 0.2  # s between two words on a running speed
WORKERS = 2  # sweeps at a time; each holds its own models


@dataclass(frozen=True, eq=False)
class Run:
    """What is to be run: torques on the input gear [N m], speeds [Hz], directions."""

    gear_set: GearSet
    torques: Sequence[float]
    systems: Sequence[LumpedSystem]
    frequencies: list[float]
    directions: tuple[Direction, ...]


def run_sweeps(
    run: Run,
    prepared: Sequence[Prepared],
    settings: DynamicSettings,
    header: dict[str, str],
    output: Path | None,
    records: str,
    resume: bool,
    keep: Keeper,
    report: Callable[[str, int, int], None],
) -> list[Branch]:
    """All branches; after Ctrl-C or a failure the checkpoint keeps what is finished."""
    checkpoint = _open_checkpoint(run, header, output, records, resume)
    if checkpoint is not None and resume:
        _tell_resumed(run, checkpoint)
    try:
        branches = _run_branches(run, prepared, settings, checkpoint, keep, report)
    except BaseException:
        if checkpoint is not None:
            checkpoint.close(keep=True)
        raise
    if checkpoint is not None:
        checkpoint.close(keep=not all(branch.complete for branch in branches))
    return branches


def _open_checkpoint(
    run: Run,
    header: dict[str, str],
    output: Path | None,
    records: str,
    resume: bool,
) -> Checkpoint | None:
    from fegear.store import open_checkpoint

    if output is None:
        return None
    # what is derived comes last, so that a message names what was asked for
    inputs = {
        "torques_Nm": ", ".join(map(repr, run.torques)),
        "speeds_Hz": ", ".join(map(repr, run.frequencies)),
        "directions": ", ".join(run.directions),
        "histories": records,
        **{name: text for name, text in header.items() if name != DERIVED},
        "figures of the gear set": sha256(repr(run.gear_set).encode()).hexdigest(),
        DERIVED: header[DERIVED],
    }
    path = Path(f"{output}.partial")
    if resume and not path.exists():
        done = f"{output} is finished and" if output.exists() else "it"
        complain(f"--resume: there is no {path}, {done} is computed from the start")
    return open_checkpoint(path, inputs, resume)


def _tell_resumed(run: Run, checkpoint: Checkpoint) -> None:
    """How much was found, so that nothing is computed again without a word."""
    names = [
        _branch_name(torque, direction)
        for torque in run.torques
        for direction in run.directions
    ]
    finished = sum(len(checkpoint.finished(name)) for name in names)
    total = len(names) * len(run.frequencies)
    complain(f"{checkpoint.path}: {finished} of {total} speeds are finished")
    if checkpoint.damaged:
        damaged = counted(checkpoint.damaged, "speed is", "speeds are")
        complain(f"{checkpoint.path}: {damaged} damaged and computed again")


def _branch_name(torque: float, direction: Direction) -> str:
    return f"{torque!r}-{direction}"


def _run_branches(
    run: Run,
    prepared: Sequence[Prepared],
    settings: DynamicSettings,
    checkpoint: Checkpoint | None,
    keep: Keeper,
    report: Callable[[str, int, int], None],
) -> list[Branch]:
    from fegear.dynamics.sweep import sweep_branch

    tasks = [
        (number, torque, each, direction)
        for number, (torque, each) in enumerate(zip(run.torques, prepared, strict=True))
        for direction in run.directions
    ]
    total, done = len(tasks) * len(run.frequencies), 0
    stop, lock, shown = threading.Event(), threading.Lock(), 0.0

    def passed() -> None:
        nonlocal done
        with lock:
            done += 1
            report("sweep", done, total)

    def watch(frequency: float, period: int) -> None:
        nonlocal shown
        now = time.perf_counter()
        if now - shown > REFRESH:
            shown = now
            report(f"{frequency:g} Hz, period {period}", done, total)

    with ThreadPoolExecutor(WORKERS) as pool:
        futures = [
            pool.submit(
                sweep_branch,
                *(each.stepper, run.frequencies, direction, settings),
                checkpoint=checkpoint,
                name=_branch_name(torque, direction),
                keep=partial(keep, number, direction),
                passed=passed,
                watch=watch,
                stop=stop,
            )
            for number, torque, each, direction in tasks
        ]
        try:
            return [future.result() for future in futures]
        except KeyboardInterrupt:
            stop.set()
            return [future.result() for future in futures]
        except BaseException:
            stop.set()
            raise


def history_keeper(
    run: Run,
    prepared: Sequence[Prepared],
    settings: DynamicSettings,
    header: dict[str, str],
    directory: Path | None,
    roots: dict[int, RootInfluence],
) -> Keeper:
    """Writes the motion of a speed as a file of the directory, if there is one."""
    if directory is None:
        return lambda number, direction, frequency, motion: None
    from fegear.dynamics.history import format_history, history_name, history_table
    from fegear.dynamics.respond import steps_per_cycle
    from fegear.output import make_directory, write_text

    make_directory(directory)

    def keep(
        number: int, direction: Direction, frequency: float, motion: Motion
    ) -> None:
        model, torque = prepared[number].stepper.model, run.torques[number]
        entries = header | {
            "torque_Nm": f"{torque:g}",
            "direction": direction,
            "mesh_frequency_Hz": f"{frequency:g}",
        }
        steps = steps_per_cycle(model, frequency, settings)
        text = format_history(history_table(model, motion, steps, entries, roots))
        path = directory / history_name(torque, direction, frequency)
        write_text(path, text)

    return keep


def root_influences(
    gear_set: GearSet, name: str | None, statics: StaticsSettings
) -> dict[int, RootInfluence]:
    from fegear.dynamics.root_stress import root_influence
    from fegear.elasticity.sector import cyclic_sector

    if name is None:
        return {}
    names = [gear.name for gear in gear_set.gears]
    if name not in names:
        raise InputError(f"--root-stress {name}; allowed are {', '.join(names)}")
    gear = gear_set.gears[names.index(name)]
    sector = cyclic_sector(gear.geometry, statics.material(gear), statics.size)
    return {names.index(name): root_influence(sector)}
