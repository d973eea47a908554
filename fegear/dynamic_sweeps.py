"""Frequency responses of a gear set's finite elements, and what a run keeps."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path

from fegear.boundary import public, require_frequencies
from fegear.dynamics.build import FiniteElements, Prepared, prepare
from fegear.dynamics.checkpoint import StoredBranch
from fegear.dynamics.history import format_history, history_name, history_table
from fegear.dynamics.root_stress import RootInfluence, root_influence
from fegear.dynamics.stepper import DynamicSettings, Motion, steps_per_cycle
from fegear.errors import InputError
from fegear.excitation import Excitations, Source
from fegear.gearset.model import GearSet
from fegear.lumped_models import (
    LumpedModel,
    TorqueOf,
    cap_in_words,
    file_header,
    lumped_system,
    torque_entry,
    usual_speeds,
)
from fegear.output import make_directory, write_text
from fegear.statics import StaticsSettings
from fegear.store import Checkpoint, Keeping
from fegear.sweeps import BOTH, Progress, SweepResult, at_torques, required_torques
from lumped.checks import require_between, require_fields
from lumped.csv_text import exact
from lumped.sweep import (
    Branch,
    Direction,
    reporting,
    sweep_all,
    sweep_branch,
)
from lumped.system import LumpedSystem
from lumped.workers import run_together

Keep = Callable[[int, Direction, float, Motion], None]
DERIVED = "elastic freedoms"  # of a header, from the gear set and the speeds
WORKERS = 2  # sweeps at a time; each holds its own models


@dataclass(frozen=True, kw_only=True)
class DynamicsSettings:
    """How the finite elements of a gear set are swept over speed.

    elements : what moves, friction and elastic damping
    translations, damping_ratio : of the train, as of a `LumpedModel`
    source : plane state, resolution and corner contact of the finite elements
    integration : time steps and settling
    directions : of the speed, in this order
    model_1 : whether the lumped model 1 is swept beside them
    torque_of : see `LumpedModel`; "input" needs friction of the elements
    """

    elements: FiniteElements = field(default_factory=FiniteElements)
    translations: bool = False
    damping_ratio: float | None = None
    source: Source = field(default_factory=Source)
    integration: DynamicSettings = field(default_factory=DynamicSettings)
    directions: tuple[Direction, ...] = BOTH
    model_1: bool = False
    torque_of: TorqueOf = "nominal"

    def __post_init__(self) -> None:
        if self.damping_ratio is not None:
            require_between("damping_ratio", self.damping_ratio, 0, 1, below=True)
        require_fields(self)
        if self.torque_of == "input" and not self.elements.friction:
            raise ValueError("torque_of must be nominal without friction, got 'input'")

    @property
    def reference(self) -> LumpedModel:
        """The lumped model 1, whose modes and tables the finite elements share."""
        return LumpedModel(
            translations=self.translations,
            damping_ratio=self.damping_ratio,
            stiffness=self.source,
        )


@dataclass(frozen=True, kw_only=True)
class Records(Keeping):
    """What a run keeps beside its result.

    histories : directory of a file for each speed, root stress of one gear among it
    entries : added to the header of every file
    """

    histories: Path | None = None
    root_stress: str | None = None
    entries: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def words(self) -> str:
        """Of the histories, part of what a checkpoint must agree with."""
        if self.histories is None:
            return "none"
        return f"{self.histories}, root stress of {self.root_stress}"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DynamicsResult(SweepResult):
    """Branches of the finite elements.

    reasons : of the fidelity at each torque, in a sentence that begins with it
    """

    reasons: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, eq=False)
class Run:
    """All that is swept, ready to be integrated.

    torques : on the input gear [N m]; systems, prepared : at each of them
    frequencies : of the first mesh [Hz]; header : of every file
    """

    gear_set: GearSet
    settings: DynamicsSettings
    torques: Sequence[float]
    systems: Sequence[LumpedSystem]
    frequencies: Sequence[float]
    prepared: Sequence[Prepared]
    header: dict[str, str]

    @property
    def branches(self) -> list[tuple[int, Direction, str]]:
        """Index of the torque, direction and name of each."""
        return [
            (number, direction, f"{torque!r}-{direction}")
            for number, torque in enumerate(self.torques)
            for direction in self.settings.directions
        ]


@public
def sweep_elements(
    gear_set: GearSet,
    torques: Sequence[float] = (),
    frequencies: Sequence[float] = (),
    settings: DynamicsSettings | None = None,
    records: Records | None = None,
    progress: Progress = lambda what, done, total: None,
) -> DynamicsResult:
    """Pass the gears through mesh frequencies [Hz], from where they have settled.

    torques : on the input gear [N m]; the gear set's load cases if there are none
    frequencies : of the first mesh [Hz]; around the resonances if there are none

    After Ctrl-C branches hold the speeds that were finished and are not complete.
    """
    settings, records = settings or DynamicsSettings(), records or Records()
    require_frequencies("frequencies", frequencies)
    torques = required_torques(gear_set, torques)
    progress("stiffness", 0, 1)
    excitations = Excitations(settings.source)
    systems = [
        lumped_system(gear_set, torque, settings.reference, excitations)
        for torque in torques
    ]
    frequencies = list(frequencies) or usual_speeds(systems[0])
    progress("pair laws and modes", 0, 1)
    run = _prepared(gear_set, torques, systems, frequencies, settings, excitations)
    run = replace(run, header=run.header | records.entries)
    found = _sweep_kept(run, records, progress)
    beside = _sweep_model_1(run, progress) if settings.model_1 else []
    return DynamicsResult(
        gear_set=gear_set,
        model=run.prepared[0].fidelity,
        header=run.header,
        frequencies=frequencies,
        found=at_torques(torques, settings.directions, found),
        beside=at_torques(torques, settings.directions, beside) if beside else (),
        reasons=tuple(
            (torque, each.reason)
            for torque, each in zip(torques, run.prepared, strict=True)
        ),
    )


def under_friction(
    gear_set: GearSet,
    torque: float,
    system: LumpedSystem,
    settings: DynamicsSettings,
    excitations: Excitations,
) -> LumpedSystem:
    """The lumped model 1 under the torques that the finite elements have."""
    if settings.torque_of == "nominal":
        return system
    friction, of = settings.elements.friction, settings.torque_of
    model = replace(settings.reference, friction=friction, torque_of=of)
    found = lumped_system(gear_set, torque, model, excitations)
    return replace(system, train=found.train, losses=found.losses)


def _prepared(
    gear_set: GearSet,
    torques: Sequence[float],
    systems: Sequence[LumpedSystem],
    frequencies: Sequence[float],
    settings: DynamicsSettings,
    excitations: Excitations,
) -> Run:
    """With a stepper for every torque, all of the same fidelity."""

    def steppers(elements: FiniteElements) -> list[Prepared]:
        given = frequencies, elements, settings.integration, excitations
        return [
            prepare(gear_set, torque, system, *given)
            for torque, system in zip(torques, loaded, strict=True)
        ]

    loaded = [
        under_friction(gear_set, torque, system, settings, excitations)
        for torque, system in zip(torques, systems, strict=True)
    ]
    found = steppers(settings.elements)
    if len({each.fidelity for each in found}) > 1:
        found = steppers(replace(settings.elements, fidelity="reduced"))
    header = _header(gear_set, settings, systems[0].train.damping_ratio, found)
    return Run(gear_set, settings, torques, systems, frequencies, found, header)


def _header(
    gear_set: GearSet,
    settings: DynamicsSettings,
    damping_ratio: float,
    prepared: Sequence[Prepared],
) -> dict[str, str]:
    steps = settings.integration
    words = (
        f"generalised-alpha, {steps.steps} steps per period or more, tolerance "
        f"{exact(steps.tolerance)}, up to {cap_in_words(steps.max_periods)}"
    )
    header = file_header(gear_set, settings.reference, damping_ratio, words)
    kept = "; ".join(" + ".join(map(str, each.elastic)) or "0" for each in prepared)
    return header | {
        "fidelity": prepared[0].fidelity,
        DERIVED: kept,
        "elastic damping ratio": exact(settings.elements.elastic_damping),
        "friction coefficient": exact(settings.elements.friction),
        **torque_entry(settings.torque_of),
    }


def _sweep_model_1(run: Run, progress: Progress) -> list[Branch]:
    return sweep_all(
        run.systems,
        run.frequencies,
        run.settings.directions,
        report=lambda what, done, total: progress(f"Model-1, {what}", done, total),
    )


def _sweep_kept(run: Run, records: Records, progress: Progress) -> list[Branch]:
    """All branches; after Ctrl-C or a failure the checkpoint keeps what is finished."""
    keep = _history_keeper(run, records)
    checkpoint = _open_checkpoint(run, records)
    if checkpoint is not None and records.resume:
        names = [name for _, _, name in run.branches]
        checkpoint.tell_finished(names, len(run.frequencies), records.tell)
    try:
        branches = _sweep_branches(run, checkpoint, keep, progress)
    except BaseException:
        if checkpoint is not None:
            checkpoint.close(keep=True)
        raise
    if checkpoint is not None:
        checkpoint.close(keep=not all(branch.complete for branch in branches))
    return branches


def _open_checkpoint(run: Run, records: Records) -> Checkpoint | None:
    # what is derived comes last, so that a message names what was asked for
    inputs = {
        "torques_Nm": ", ".join(map(repr, run.torques)),
        "speeds_Hz": ", ".join(map(repr, run.frequencies)),
        "directions": ", ".join(run.settings.directions),
        "histories": records.words,
        **{name: text for name, text in run.header.items() if name != DERIVED},
        "figures of the gear set": sha256(repr(run.gear_set).encode()).hexdigest(),
        DERIVED: run.header[DERIVED],
    }
    return records.open(inputs)


def _sweep_branches(
    run: Run, checkpoint: Checkpoint | None, keep: Keep, progress: Progress
) -> list[Branch]:
    """Branches side by side; on Ctrl-C each ends after the period that runs."""
    observer = reporting(progress, len(run.branches) * len(run.frequencies))
    stop = threading.Event()

    def sweep(number: int, direction: Direction, name: str) -> Branch:
        return sweep_branch(
            run.prepared[number].stepper,
            run.frequencies,
            direction,
            run.settings.integration,
            store=None if checkpoint is None else StoredBranch(checkpoint, name),
            keep=partial(keep, number, direction),
            observer=observer,
            stop=stop,
        )

    tasks = [partial(sweep, *branch) for branch in run.branches]
    return run_together(tasks, stop, WORKERS)


def _history_keeper(run: Run, records: Records) -> Keep:
    """Writes the motion of a speed as a file of the directory, if there is one."""
    directory = records.histories
    roots = _root_influences(
        run.gear_set, records.root_stress, run.settings.source.statics
    )
    if directory is None:
        return lambda number, direction, frequency, motion: None
    make_directory(directory)

    def keep(
        number: int, direction: Direction, frequency: float, motion: Motion
    ) -> None:
        model, torque = run.prepared[number].stepper.model, run.torques[number]
        entries = run.header | {
            "torque_Nm": exact(torque),
            "direction": direction,
            "mesh_frequency_Hz": exact(frequency),
        }
        steps = steps_per_cycle(model, frequency, run.settings.integration)
        text = format_history(history_table(model, motion, steps, entries, roots))
        path = directory / history_name(torque, direction, frequency)
        write_text(path, text)

    return keep


def _root_influences(
    gear_set: GearSet, name: str | None, statics: StaticsSettings
) -> dict[int, RootInfluence]:
    if name is None:
        return {}
    names = [gear.name for gear in gear_set.gears]
    if name not in names:
        raise InputError(f"root_stress = {name}; allowed are {', '.join(names)}")
    gear = gear_set.gears[names.index(name)]
    sector = statics.sector(gear)
    return {names.index(name): root_influence(sector)}
