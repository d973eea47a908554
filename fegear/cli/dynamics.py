"""fegear dynamics: the finite-element gears in motion."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import edit_entries, parsed_edits
from fegear.cli.lumped_options import (
    Damping,
    LoadCases,
    MaxPeriods,
    Physics,
    SolvedPlane,
    SolvedResolution,
    Speeds,
    Tolerance,
    Translations,
    chosen_torques,
    settings_of,
    speeds_of,
)
from fegear.cli.options import (
    AsJson,
    Edits,
    Output,
    Plot,
    SetName,
    progress_bar,
    refuse_idle,
    require,
    require_friction,
    require_outputs,
)
from fegear.cli.screen import complain, say
from fegear.cli.sweep import DirectionChoice, SweepDirection, at_torques
from fegear.cli.sweep_report import SweepOutputs, SweepResult, tell_sweep
from fegear.cli.systems import (
    file_header,
    most_in_words,
    solved_excitations,
    system_at,
    usual_speeds,
)

if TYPE_CHECKING:
    from fegear.dynamics.build import FiniteElements, Prepared
    from fegear.dynamics.journal import Journal
    from fegear.dynamics.respond import DynamicSettings, Motion
    from fegear.dynamics.root_stress import RootInfluence
    from fegear.gearset.model import GearSet
    from fegear.statics import StaticsSettings
    from lumped.sweep import Branch, Direction
    from lumped.system import LumpedSystem

    # (number of the torque, direction, frequency [Hz], motion there)
    Keeper = Callable[[int, Direction, float, Motion], None]

REFRESH = 0.2  # s between two words on a running speed
WORKERS = 2  # sweeps at a time; each holds its own models


EXAMPLE = "fegear dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv"
ELASTIC_DAMPING = 0.01  # where the option is not given


class FidelityChoice(StrEnum):
    auto = "auto"
    full = "full"
    reduced = "reduced"
    quasistatic = "quasistatic"


def dynamics_command(
    set_name: SetName,
    fidelity: Annotated[
        FidelityChoice,
        typer.Option(
            "--fidelity",
            help="What moves. full: all degrees of freedom of the finite elements; "
            "reduced: hubs and elastic modes of the gears; quasistatic: hubs alone, "
            "without elastic inertia; auto: reduced where elastic inertia matters, "
            "else quasistatic.",
        ),
    ] = FidelityChoice.auto,
    speeds: Speeds = None,
    direction: SweepDirection = DirectionChoice.both,
    torque: LoadCases = None,
    edits: Edits = None,
    friction: Annotated[
        float, typer.Option("--friction", help="Coulomb friction coefficient.")
    ] = 0.0,
    damping: Damping = None,
    elastic_damping: Annotated[
        float | None,
        typer.Option(
            "--elastic-damping",
            help="Damping ratio of the first elastic modes of the gears. [default: "
            f"{ELASTIC_DAMPING:g}]",
        ),
    ] = None,
    translations: Translations = False,
    cutoff: Annotated[
        float | None,
        typer.Option(
            "--cutoff",
            help="Natural frequency [Hz] up to which elastic modes are considered. "
            "[default: 7 times the highest speed, or more]",
        ),
    ] = None,
    plane: SolvedPlane = None,
    resolution: SolvedResolution = None,
    steps: Annotated[
        int,
        typer.Option(
            "--steps", help="Least number of time steps per period of the fastest mesh."
        ),
    ] = 128,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    model_1: Annotated[
        bool,
        typer.Option(
            "--model-1", help="Run lumped model 1 as well and show both results."
        ),
    ] = False,
    output: Output = None,
    plot: Plot = None,
    history: Annotated[
        Path | None,
        typer.Option(
            "--history",
            metavar="DIR",
            help="Write a CSV file for each speed into this directory: load and "
            "contact pressure of every tooth pair and motion of the hubs over one "
            "period.",
        ),
    ] = None,
    root_stress: Annotated[
        str | None,
        typer.Option(
            "--root-stress",
            metavar="GEAR",
            help="Add the root stress of this gear's teeth to the files of --history.",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with an interrupted run to the same --output.",
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Vibration of finite-element gears over speed.

    The CSV columns are those of `fegear sweep`. With --output each finished speed is
    kept in FILE.partial until the file is written; --resume goes on from there.
    """
    from fegear.errors import InputError
    from fegear.gearset import load_gear_set

    require_outputs([output], [set_name], plot)
    if resume and output is None:
        raise InputError("--resume needs the --output of the run to go on with")
    if root_stress is not None and history is None:
        raise InputError("--root-stress needs --history")
    changes = parsed_edits(edits, torque=torque, damping=damping)
    gear_set = load_gear_set(set_name, changes)
    physics = Physics(
        translations=translations, damping=damping, plane=plane, resolution=resolution
    )
    elements = _checked_elements(fidelity, friction, elastic_damping, cutoff)
    settings = _checked_settings(steps, tolerance, max_periods)
    frequencies = None if speeds is None else speeds_of(speeds)
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    with progress_bar(enabled=not as_json) as report:
        report("stiffness", 0, 1)
        excitations = solved_excitations(physics)
        systems = [system_at(gear_set, each, physics, excitations) for each in torques]
        frequencies = frequencies or usual_speeds(systems[0])
        run = Run(gear_set, torques, systems, frequencies, direction.directions)
        report("pair laws and modes", 0, 1)
        prepared = _prepare(run, elements, settings, excitations)
        header = _header(run, physics, settings, elements, prepared)
        header |= edit_entries(changes)
        records = f"{history}, root stress of {root_stress}" if history else "none"
        roots = _root_influences(gear_set, root_stress, excitations.source.statics)
        keep = _history_keeper(run, prepared, settings, header, history, roots)
        branches = _sweep(
            *(run, prepared, settings, header, output, records, resume, keep, report)
        )
        beside = _model_1(run, report) if model_1 else []
    if not as_json:
        _print_choice(torques, prepared)
    if output is not None and not all(branch.complete for branch in branches):
        complain(f"{output}.partial is kept, --resume goes on there")
    result = SweepResult(
        gear_set=gear_set,
        model=prepared[0].fidelity,
        header=header,
        frequencies=frequencies,
        found=at_torques(torques, direction, branches),
        beside=at_torques(torques, direction, beside) if model_1 else (),
    )
    tell_sweep(result, SweepOutputs(csv=output, plot=plot, as_json=as_json), begin)


@dataclass(frozen=True, eq=False)
class Run:
    """What is to be run: torques on the input gear [N m], speeds [Hz], directions."""

    gear_set: GearSet
    torques: Sequence[float]
    systems: Sequence[LumpedSystem]
    frequencies: list[float]
    directions: tuple[Direction, ...]


def _checked_elements(
    fidelity: FidelityChoice,
    friction: float,
    elastic_damping: float | None,
    cutoff: float | None,
) -> FiniteElements:
    from fegear.dynamics.build import FiniteElements

    if fidelity == FidelityChoice.quasistatic:
        without = "--fidelity quasistatic has no elastic modes"
        refuse_idle(without, elastic_damping=elastic_damping, cutoff=cutoff)
    if fidelity == FidelityChoice.full:
        refuse_idle("--fidelity full keeps all elastic modes", cutoff=cutoff)
    require_friction(friction)
    ratio = ELASTIC_DAMPING if elastic_damping is None else elastic_damping
    require(0.0 <= ratio < 1.0, "--elastic-damping", ratio, "allowed 0 to below 1")
    if cutoff is not None:
        require(0.0 < cutoff <= 3e5, "--cutoff", cutoff, "allowed above 0 to 3e5 Hz")
    return FiniteElements(
        fidelity=fidelity.value,
        friction=friction,
        elastic_damping=ratio,
        cutoff_Hz=cutoff,
    )


def _checked_settings(
    steps: int, tolerance: float, max_periods: int | None
) -> DynamicSettings:
    from fegear.dynamics.respond import DynamicSettings

    values = {"steps": steps, "tolerance": tolerance, "max_periods": max_periods}
    return settings_of(DynamicSettings, **values)


def _prepare(
    run: Run, elements: FiniteElements, settings: DynamicSettings, excitations: Any
) -> list[Prepared]:
    """A stepper for every torque, all of the same fidelity."""
    from fegear.dynamics.build import prepare

    def prepared(elements: FiniteElements) -> list[Prepared]:
        given = run.frequencies, elements, settings, excitations
        return [
            prepare(run.gear_set, torque, system, *given)
            for torque, system in zip(run.torques, run.systems, strict=True)
        ]

    found = prepared(elements)
    if len({each.fidelity for each in found}) > 1:
        found = prepared(replace(elements, fidelity="reduced"))
    return found


def _header(
    run: Run,
    physics: Physics,
    settings: DynamicSettings,
    elements: FiniteElements,
    prepared: Sequence[Prepared],
) -> dict[str, str]:
    ratio = run.systems[0].train.damping_ratio
    words = (
        f"generalised-alpha, {settings.steps} steps per period or more, tolerance "
        f"{settings.tolerance:g}, up to {most_in_words(settings.max_periods)}"
    )
    header = file_header(run.gear_set, physics, words, ratio)
    kept = "; ".join(" + ".join(map(str, each.elastic)) or "0" for each in prepared)
    return header | {
        "fidelity": prepared[0].fidelity,
        "elastic freedoms": kept,
        "elastic damping ratio": f"{elements.elastic_damping:g}",
        "friction coefficient": f"{elements.friction:g}",
    }


def _sweep(
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
    """All branches; finished speeds stay in the journal after Ctrl-C or a failure."""
    journal = _open_journal(run, header, output, records, resume)
    try:
        branches = _run_branches(run, prepared, settings, journal, keep, report)
    except BaseException:
        if journal is not None:
            journal.close(keep=True)
        raise
    if journal is not None:
        journal.close(keep=not all(branch.complete for branch in branches))
    return branches


def _open_journal(
    run: Run,
    header: dict[str, str],
    output: Path | None,
    records: str,
    resume: bool,
) -> Journal | None:
    from fegear.dynamics.journal import open_journal

    if output is None:
        return None
    inputs = header | {
        "figures of the gear set": sha256(repr(run.gear_set).encode()).hexdigest(),
        "histories": records,
        "torques_Nm": ", ".join(map(repr, run.torques)),
        "speeds_Hz": ", ".join(map(repr, run.frequencies)),
        "directions": ", ".join(run.directions),
    }
    return open_journal(Path(f"{output}.partial"), inputs, resume)


def _run_branches(
    run: Run,
    prepared: Sequence[Prepared],
    settings: DynamicSettings,
    journal: Journal | None,
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
                journal=journal,
                name=f"{torque!r}-{direction}",
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


def _history_keeper(
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


def _root_influences(
    gear_set: GearSet, name: str | None, statics: StaticsSettings
) -> dict[int, RootInfluence]:
    from fegear.dynamics.root_stress import root_influence
    from fegear.errors import InputError

    if name is None:
        return {}
    names = [gear.name for gear in gear_set.gears]
    if name not in names:
        raise InputError(f"--root-stress {name}; allowed are {', '.join(names)}")
    gear = gear_set.gears[names.index(name)]
    given = gear.geometry, statics.material(gear), statics.size
    return {names.index(name): root_influence(*given)}


def _model_1(run: Run, report: Callable[[str, int, int], None]) -> list[Branch]:
    from lumped.sweep import sweep_all

    return sweep_all(
        run.systems,
        run.frequencies,
        run.directions,
        report=lambda done, total: report("Model-1", done, total),
    )


def _print_choice(torques: Sequence[float], prepared: Sequence[Prepared]) -> None:
    for torque, each in zip(torques, prepared, strict=True):
        say(f"{torque:g} N m, {each.reason}")
