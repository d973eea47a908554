"""The runs of a labelled set of signals of gears with faults."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from hashlib import sha256
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.commands.faults.axes import (
    FAULTS,
    SETTINGS,
    WHOLE_NUMBERS,
    GearSetEdits,
    column_of,
)
from fegear.commands.faults.fault_runs import FaultRuns, run_warnings
from fegear.commands.faults.like import RecordedConditions
from fegear.commands.faults.result import NO_TOOTH, FaultSignalsResult
from fegear.files.contents import exact_repr
from fegear.files.errors import InputError, NoResultError
from fegear.gearset.model import CARRIER
from fegear.gearset.read import load_tables
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.settings import display_name
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.model_texts import (
    file_header,
    integration_in_words,
    static_entries,
)
from fegear.studies.trains.sampled_signals import SampledProblem, SignalsStudy
from fegear.studies.trains.train_problem import TrainFacts
from fegear.train.model_settings import LumpedModel
from lumped.common.workers import Arrays
from lumped.signals.added_deflections import GearContacts
from lumped.signals.sampling import (
    Sampling,
    SignalEngagements,
    residual_indicators,
    sample_signals,
)
from lumped.signals.sensors import signal_names
from lumped.signals.tooth_verdict import tooth_of_run
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond_confirmed
from lumped.train.system import LumpedSystem

MAX_SAMPLES = 125_000_000  # samples of all runs and signals, 1 GB
MAX_CACHED_GEAR_SETS = 32  # gear sets that are not read again for further runs


def noise_seed(number: int, seed: int) -> int:
    """Seed of the noise of a run, by its number from 1 and the seed of the set."""
    digest = sha256(f"run {number} of seed {seed}".encode()).digest()
    return int.from_bytes(digest[:4], "big")


@dataclass(frozen=True, eq=False)
class FaultSignalsProblem(Problem):
    """The runs of a set.

    reference : signals of the gear set without changes by the axes, at the first speed
        and torque
    edits : changes of the gear set by the values of axes
    recorded : conditions of a recording that runs have, None without one
    """

    study: Any
    reference: SampledProblem = field(kw_only=True)
    edits: GearSetEdits = field(kw_only=True)
    recorded: RecordedConditions | None = field(default=None, kw_only=True)

    @cached_property
    def points(self) -> tuple[tuple[float, ...], ...]:
        """Values of the axes for each run."""
        return self.study.points()

    @classmethod
    def of(cls, study: Any) -> FaultSignalsProblem:
        """The problem of a study; InputError for what no run can be."""
        recorded = None
        if study.like is not None:
            recorded = RecordedConditions.of(study, study.gear_set.loaded)
        settings, _ = split_point(study, study.points()[0], recorded)
        signals = signals_study_of_run(study, settings, study.gear_set, study.model)
        excitations = study.model.excitations
        rate = None if recorded is None else recorded.rate
        reference = SampledProblem.of_study(signals, excitations, rate)
        index = reference.turning.index
        teeth = reference.gears.gears[index].geometry.teeth
        _require_gear_of_faults(study, reference.gears.gears[index].name)
        for setting_name, tooth in _faulty_teeth(study):
            if tooth > teeth:
                name = reference.gears.gears[index].name
                raise InputError(
                    f"{setting_name} = {tooth}; gear {name} has {teeth} teeth"
                )
        gear_set, tables = study.gear_set, dict[str, Any]()
        if gear_set.preloaded is None:
            tables = load_tables(gear_set.name, gear_set.overrides)
        edits = GearSetEdits(tables, gear_set.overrides, 1 + index, teeth)
        _require_editable_axes(study, edits)
        return cls(study, reference=reference, edits=edits, recorded=recorded)

    @property
    def inputs(self) -> Mapping[str, str]:
        inputs: Mapping[str, str] = self.study.inputs
        if self.recorded is None:
            return inputs
        return {**inputs, "recorded": exact_repr(self.recorded.entries)}

    @property
    def announcements(self) -> Iterator[str]:
        yield from super().announcements
        teeth = self.reference.turning.teeth
        yield from self.reference.duration(self.study.run_count, teeth)

    def tasks(self) -> Iterator[Task]:
        self._require_room()
        yield Task("runs", self._compute_runs)

    def _require_room(self) -> None:
        """Refuse sets whose samples exceed the memory allowed."""
        study, sampling = self.study, self.reference.sampling
        samples = sampling.points if study.averages else len(sampling.time)
        signals = len(signal_names(self.reference.system))
        sample_count = study.run_count * samples * signals
        if sample_count > MAX_SAMPLES:
            cure = "fewer runs" if study.averages else display_name(study, "averages")
            raise InputError(
                f"runs = {study.run_count}; {samples} samples of {signals} signals "
                f"each make {sample_count}, at most {MAX_SAMPLES} are allowed; "
                f"use {cure}"
            )

    def _compute_runs(self, job: Job) -> FaultSignalsResult:
        runs = RunComputations(self)
        arrays = job.compute("runs", runs)
        fault_runs = FaultRuns.of(
            [arrays[name] for name in runs], self.reference.sampling
        )
        study = self.study
        if not fault_runs.settled.any():
            reason = min(set(fault_runs.statuses))
            raise NoResultError(f"no run has signals: {reason}")
        warnings = run_warnings(fault_runs)
        return FaultSignalsResult(
            study=study,
            facts=self._facts(tuple(warnings)),
            gear=self.reference.turning.name,
            labels=self._labels(),
            runs=fault_runs,
            tooth=self.reference.tooth_at_pitch_point,
        )

    def _labels(self) -> dict[str, NDArray[Any]]:
        """Values of axes and settings for every run."""
        study, reference = self.study, self.reference
        points = np.array(self.points)
        labels = {
            column_of(name): points[:, column]
            for column, name in enumerate(study.axis_names)
        }
        count = len(points)
        settings, _ = split_point(study, self.points[0], self.recorded)
        constant_labels = {
            "speed_rpm": settings["rpm"],
            "torque_Nm": reference.single_torque,
            "noise_percent": settings["noise_percent"],
            "seed": study.seed,
        }
        if study.has_faulty_tooth:
            constant_labels["faulty_tooth"] = study.tooth
        for name, value in constant_labels.items():
            labels.setdefault(name, np.full(count, value, float))
        for name in {"seed", "faulty_tooth"} & labels.keys():
            labels[name] = labels[name].astype(np.int64)
        if study.has_faulty_tooth:
            labels["faulty_tooth"][~self._is_faulty] = NO_TOOTH
        seeds = [noise_seed(n, int(s)) for n, s in enumerate(labels["seed"], start=1)]
        rate_per_rpm = self.reference.sampling.rate / settings["rpm"]
        return {
            "run": np.arange(1, count + 1),
            **labels,
            "noise_seed": np.array(seeds, np.int64),
            "sampling_rate_Hz": rate_per_rpm * labels["speed_rpm"],
        }

    @property
    def _is_faulty(self) -> NDArray[np.bool_]:
        """Whether each run has a tooth with a fault by the axes."""
        is_tooth_fault = [
            name in FAULTS and not FAULTS[name].is_of_gear
            for name in self.study.axis_names
        ]
        sizes = np.array(self.points)[:, is_tooth_fault]
        return np.asarray((sizes != 0.0).any(axis=1))

    def _facts(self, warnings: tuple[str, ...]) -> TrainFacts:
        """Facts about the train before any axis changes it."""
        reference, model = self.reference, self.reference.model
        system = reference.system
        ratio, torque = system.train.damping_ratio, reference.single_torque
        method = integration_in_words(reference.integration, model.number == "coupled")
        systems = {torque: system}
        rest_warnings = reference.warnings_at_rest(
            systems, (reference.study.frequency,)
        )
        notes, header = list[str](), dict[str, str]()
        if self.recorded is not None:
            notes = [*self.recorded.notes, self.recorded.sentence]
            header = {"like": f"{self.recorded.path}, noise of {self.recorded.channel}"}
            warnings = (*self.recorded.warnings(reference.turning.name), *warnings)
        return TrainFacts(
            summary=reference.summary_head(ratio)
            | {"translations": model.translations}
            | static_entries(systems, len(reference.gears.meshes))
            | {"recorded": self.recorded and self.recorded.entries},
            header={
                **file_header(reference.gears, model, ratio, method),
                "model": model.name,
                **header,
                **self.study.gear_set.entries,
            },
            notes=(*reference.notes, *notes),
            warnings=(*rest_warnings, *warnings),
        )


def split_point(
    study: Any,
    axis_values: tuple[float, ...],
    recorded: RecordedConditions | None,
) -> tuple[dict[str, Any], dict[str, float]]:
    """Settings of a run, and values by the names of faults and keys.

    recorded : conditions that the run has of a recording
    """
    settings: dict[str, Any] = {
        name: getattr(study, name) for name, _ in SETTINGS.values()
    }
    if recorded is not None:
        settings |= {"rpm": recorded.rpm, "noise_percent": recorded.noise_percent}
    changes = {}
    for name, value in zip(study.axis_names, axis_values, strict=True):
        if name in SETTINGS:
            is_whole_number = name in WHOLE_NUMBERS
            settings[SETTINGS[name][0]] = int(value) if is_whole_number else value
        else:
            changes[name] = value
    return settings, changes


def _require_gear_of_faults(study: Any, ring: str) -> None:
    """Refuse faults of the carrier, which has the turns of the ring but no teeth."""
    faults = [name for name in study.axis_names if name in FAULTS]
    if study.gear_name == CARRIER and ring != CARRIER and faults:
        raise InputError(
            f"{display_name(study, 'gear_name')} = {CARRIER}; has no teeth for "
            f"{display_name(study, 'over')} {faults[0]}, take {ring}, which has the "
            "same turns"
        )


def _faulty_teeth(study: Any) -> Iterator[tuple[str, int]]:
    """Teeth that have faults in some run, and the setting that says so."""
    axes = [axis for axis in study.over if axis.name == "tooth"]
    for axis in axes:
        over = f"{display_name(study, 'over')} tooth"
        yield from ((over, int(value)) for value in axis.values)
    if not axes:
        yield display_name(study, "tooth"), study.tooth


def _require_editable_axes(study: Any, edits: GearSetEdits) -> None:
    """Refuse an axis if the gear-set file cannot hold one of its values."""
    for axis in study.over:
        if axis.name in SETTINGS:
            continue
        for (_, tooth), value in product(_faulty_teeth(study), axis.values):
            edits.texts({axis.name: value}, tooth)


def signals_study_of_run(
    study: Any,
    settings: Mapping[str, Any],
    gear_set: GearSetRef,
    model: LumpedModel,
) -> SignalsStudy:
    """The study that computes the signals of one run."""
    return SignalsStudy(
        gear_set=gear_set,
        rpm=settings["rpm"],
        torque=settings["torque"],
        gear_name=study.gear_name,
        turns=study.turns,
        samples=study.samples,
        noise_percent=settings["noise_percent"],
        seed=settings["seed"],
        model=model,
        integration=study.integration,
    )


@dataclass(frozen=True, eq=False)
class RunComputations(Mapping[str, Callable[[], Arrays]]):
    """Computation of each run by its number, prepared on access."""

    problem: FaultSignalsProblem

    def __iter__(self) -> Iterator[str]:
        return map(str, range(1, len(self) + 1))

    def __len__(self) -> int:
        return self.problem.study.run_count

    def __getitem__(self, name: str) -> Callable[[], Arrays]:
        try:
            run = self._signals_problem(int(name))
            system, sampling = run.system, run.sampling
        except ValueError as error:
            return partial(status_arrays, f"impossible: {error}")
        noise = 0.01 * run.study.noise_percent
        contacts = ToothContacts(run.engagements, run.contacts, run.other_contacts)
        frequency = run.study.frequency
        options = noise, run.study.seed, contacts, self.problem.study.averages
        settings = run.integration
        return partial(evaluate_run, system, frequency, settings, sampling, *options)

    def _signals_problem(self, number: int) -> SampledProblem:
        """The signals of a run; InputError where there is no such gear set."""
        study = self.problem.study
        recorded = self.problem.recorded
        settings, changes = split_point(
            study, self.problem.points[number - 1], recorded
        )
        settings["seed"] = noise_seed(number, settings["seed"])
        gear_set = study.gear_set
        if changes:
            texts = self.problem.edits.texts(changes, settings["tooth"])
            gear_set = self._cached_gear_set(texts)
        reference = self.problem.reference
        signals = signals_study_of_run(study, settings, gear_set, reference.model)
        rate = None if recorded is None else recorded.rate
        return SampledProblem.of_study(signals, reference.excitations, rate)

    @cached_property
    def _cached_gear_set(self) -> Callable[[tuple[str, ...]], GearSetRef]:
        """Gear sets by their changes, read once each."""
        study = self.problem.study

        def edited_gear_set(texts: tuple[str, ...]) -> GearSetRef:
            return replace(study.gear_set, edits=texts)

        return lru_cache(maxsize=MAX_CACHED_GEAR_SETS)(edited_gear_set)


def status_arrays(status: str) -> Arrays:
    """Arrays of a run whose motion has no signals, and why."""
    return {"status": np.frombuffer(status.encode(), np.uint8)}


class ToothContacts(NamedTuple):
    """Contact of a gear's teeth over its turn.

    by_signal : see `residual_indicators`; gear, others : see `tooth_of_run`
    """

    by_signal: SignalEngagements
    gear: GearContacts
    others: Sequence[GearContacts]


def evaluate_run(
    system: LumpedSystem,
    frequency: float,
    settings: Settings,
    sampling: Sampling,
    noise: float,
    seed: int,
    contacts: ToothContacts,
    averages: bool,
) -> Arrays:
    """Signals and indicators of a run; its status alone where it does not repeat.

    frequency : of the first mesh [Hz]
    noise : standard deviation over that of each signal; seed : of it
    contacts : of the gear's teeth
    averages : whether signals are left out
    """
    try:
        response, _, settings = respond_confirmed(system, frequency, settings)
    except ValueError as error:
        return status_arrays(f"impossible: {error}")
    if not response.multiple:
        return status_arrays(str(response.status))
    sampled = sample_signals(system, response, settings, sampling, noise, seed)
    all_contacts = contacts.gear, contacts.others
    tooth = tooth_of_run(system, sampled, sampling, *all_contacts).tooth
    indicators = {
        "rms": sampled.values.std(axis=0),
        **residual_indicators(sampled.average, sampled.names, contacts.by_signal),
    }
    arrays = {
        **status_arrays(str(response.status)),
        "named_tooth": np.array([np.nan if tooth is None else float(tooth)]),
        "names": np.frombuffer("\n".join(sampled.names).encode(), np.uint8),
        "average": sampled.average.values.T,
        **indicators,
    }
    return arrays if averages else {**arrays, "values": sampled.values.T}
