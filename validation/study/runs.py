"""Runs of a case: finite elements and lumped models, kept and found again by hash.

A run is one source at one torque. Its directory below the store is named after a
digest of all that determines it, the program's sources among it, and holds

    sweep.csv     the sweep table
    statics.csv   static deflections over the mesh cycle
    waves.csv     mesh forces over a cycle at single speeds
    result.json   jumps, peaks and cost
    inputs.json   what it was made of, with digests of the other files; written last
    checkpoint    finished speeds of the finite elements, until the run is done

A run whose files do not fit its inputs and digests is made again. Every
run is returned as read from these files, so that a reused one is the same.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path

from fegear.files.errors import InputError
from fegear.files.kept import write_verified_files
from fegear.files.output import make_directory
from fegear.files.store import Checkpoint, open_checkpoint
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from lumped.common.progress import Progress, silent
from lumped.common.workers import Cluster, NoClusterError, run_tasks
from validation.study.cases import Case
from validation.study.cycle_metrics import ForceCycle, cycle_measures
from validation.study.metrics import (
    FRICTION_EFFECT,
    Measured,
    MeasuredCurve,
    Verdict,
    curve_measures,
    friction_effect,
    static_measures,
    verdict,
)
from validation.study.other_branches import (
    MAX_SHARE,
    advice,
    speeds_on_other_branches,
    without_speeds,
)
from validation.study.run_files import FILE_NAMES, Run, contents, read_run
from validation.study.run_store import read_or_compute
from validation.study.solving import solve_task
from validation.study.tasks import FE, FE_FRICTIONLESS, RunSpec, tasks_of

CHECKPOINT = "checkpoint"  # file in the directory of a run
MODEL_IS_OFF = "the model is off"
CURVE_METRICS = {  # metrics of vibration over speed
    *("rms_distance", "off_jump_distance", "peak_amplitude", "peak_frequency"),
    *("peaks_unmatched", "jump_frequency", "jumps_unmatched", "contact_loss"),
    "peak_force",
}
CYCLE_METRICS = (  # metrics of mesh forces at a single speed
    *("wave_correlation", "wave_phase", "wave_peak_force", "wave_contact_loss"),
)


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Runs of a case, one of each source at each torque, and the verdicts on them.

    Sources are the finite elements, the models that are judged, and where the case asks
    for an error budget the coupled model without each of its parts.
    """

    case: Case
    runs: tuple[Run, ...]
    verdicts: tuple[Verdict, ...]

    @property
    def models(self) -> tuple[str, ...]:
        return tuple(model.name for model in self.case.model)

    @property
    def judged(self) -> tuple[Run, ...]:
        """Runs without those that only the error budget needs."""
        sources = FE, FE_FRICTIONLESS, *self.models
        return tuple(run for run in self.runs if run.source in sources)

    def of(self, source: str) -> list[Run]:
        return [run for run in self.runs if run.source == source]

    def cost_ratio(self, model: str) -> float:
        """Seconds per speed of the finite elements over those of a model.

        NaN where nothing moved.
        """
        return self.per_speed_s(FE) / self.per_speed_s(model)

    def per_speed_s(self, source: str) -> float:
        """Seconds that a source takes for a speed, NaN where nothing moved."""
        costs = [run.cost for run in self.of(source)]
        speeds = sum(cost.timed_speeds for cost in costs)
        return sum(cost.march_s for cost in costs) / speeds if speeds else nan


def run_case(case: Case, store: Path, report: Progress = silent) -> CaseResult:
    """Run what is not in the store yet, and judge.

    Raises InputError for a gear set or a store that cannot be used, and where another
    process is at the same finite elements; after KeyboardInterrupt the finished runs
    and the finished speeds of the finite elements stay in the store.
    """
    tasks = list(tasks_of(case))
    excitations: dict[str, Excitations] = {}
    runs = []
    for task in tasks:
        kind = "fe" if task.model is None else task.model.excitation
        kind_excitations = excitations.setdefault(
            kind, Excitations(ExcitationSettings(kind=kind))
        )
        runs.append(_read_or_run(task, store, kind_excitations, report))
    return CaseResult(case, tuple(runs), tuple(case_verdicts(case, runs)))


def make_runs(
    cases: Sequence[Case],
    store: Path,
    workers: int | Cluster | None,
    report: Progress = silent,
) -> None:
    """Make the runs of cases that are not in the store yet by workers, several at once.

    Each is kept as it is finished; `run_case` then finds them. Raises InputError where
    the cluster cannot be used, or its workers have another program.
    """
    missing = {
        task.directory(store): task
        for case in cases
        for task in tasks_of(case)
        if read_run(task, task.directory(store), reused=True) is None
    }
    finished: list[Path] = []

    def take(directory: Path, made: Mapping[str, bytes]) -> None:
        write_verified_files(directory, made)
        if read_run(missing[directory], directory, reused=False) is None:
            raise InputError(
                f"{directory}: made by workers whose program is not the one of here"
            )
        finished.append(directory)
        report("runs of workers", len(finished), len(missing))

    report("runs of workers", 0, len(missing))
    tasks = [(place, partial(contents_of, task)) for place, task in missing.items()]
    if not tasks:
        return
    try:
        run_tasks(tasks, take, threading.Event(), workers)
    except NoClusterError as error:
        raise InputError(str(error)) from None


def contents_of(task: RunSpec) -> dict[str, bytes]:
    """The files of a run by name, made without a checkpoint."""
    kind = "fe" if task.model is None else task.model.excitation
    excitations = Excitations(ExcitationSettings(kind=kind))
    solution = solve_task(task, None, excitations, silent)
    return contents(task, solution)


def warnings_of(result: CaseResult) -> Iterator[str]:
    """Each once, those that one source alone has with its name."""
    sources: dict[str, dict[str, None]] = {}
    for run in result.runs:
        for warning in run.warnings:
            sources.setdefault(warning, {})[run.source] = None
    for warning, names in sources.items():
        yield f"{next(iter(names))}: {warning}" if len(names) == 1 else warning


def case_verdicts(case: Case, runs: Sequence[Run]) -> Iterator[Verdict]:
    """Every metric that the case has a tolerance for, for each model and torque."""
    tolerances = {entry.name: entry for entry in case.metric}
    references = {run.torque: run for run in runs if run.source == FE}
    judged_models = {model.name for model in case.model}
    for run in (run for run in runs if run.source in judged_models):
        measured = list(measures(references[run.torque], run))
        measured += (
            _friction_measures(case, runs, run) if FRICTION_EFFECT in tolerances else []
        )
        for where, (name, place, value) in measured:
            if name in tolerances:
                entry = tolerances[name]
                full_place = ", ".join(filter(None, (where, place)))
                arguments = (
                    name,
                    run.source,
                    full_place,
                    value,
                    entry.allowed,
                    entry.reason,
                )
                yield with_cause(
                    verdict(*arguments), references[run.torque], run, where
                )


def with_cause(
    metric_verdict: Verdict, reference: Run, run: Run, where: str
) -> Verdict:
    """The verdict, outside of what is allowed with its cause.

    Over speed, the model is on another branch if the value is within without the speeds
    at which it is, and off otherwise; at a single speed, if its motion is of another
    kind. The verdict itself stays.

    where : of the curve or cycle, `100 N m, up, mesh 1`
    """
    if metric_verdict.within:
        return metric_verdict
    if metric_verdict.metric in CYCLE_METRICS:
        for fe_cycle, cycle in zip(reference.cycles, run.cycles, strict=True):
            if where == f"{run.torque:g} N m, {cycle.label}, mesh {cycle.mesh}":
                return replace(metric_verdict, cause=cycle_cause(fe_cycle, cycle))
    if metric_verdict.metric not in CURVE_METRICS:
        return metric_verdict
    for fe_curve, model_curve in zip(reference.curves, run.curves, strict=True):
        if (
            where
            == f"{run.torque:g} N m, {model_curve.direction}, mesh {model_curve.mesh}"
        ):
            cause_of_verdict = cause_of_difference(
                metric_verdict, (fe_curve, model_curve), reference.curves, run.curves
            )
            return replace(metric_verdict, cause=cause_of_verdict)
    return metric_verdict


def cycle_cause(reference: ForceCycle, model: ForceCycle) -> str:
    """Why a metric of two motions at one speed is outside, in words."""
    if reference.period_multiple != model.period_multiple:
        difference = "repeat after different numbers of cycles"
    elif (reference.contact_loss > 0.0) != (model.contact_loss > 0.0):
        difference = "differ in whether contact is lost"
    else:
        return MODEL_IS_OFF
    return f"another branch, perhaps: model and finite elements {difference}"


def cause_of_difference(
    metric_verdict: Verdict,
    curves: tuple[MeasuredCurve, MeasuredCurve],
    reference: Sequence[MeasuredCurve],
    model: Sequence[MeasuredCurve],
) -> str:
    """Why a metric of two curves, reference and model, is outside, in words.

    reference, model : curves of all meshes and directions of both
    """
    common, others = speeds_on_other_branches(reference, model, curves[1].direction)
    if not others.size:
        return MODEL_IS_OFF
    summary = advice(common, others)
    if others.size > MAX_SHARE * common.size:
        return f"not known: {summary}"
    remaining = curve_measures(*(without_speeds(curve, others) for curve in curves))
    values = [value for name, _, value in remaining if name == metric_verdict.metric]
    if all(abs(value) <= metric_verdict.allowed for value in values):
        return f"another branch: {summary}"
    return f"{MODEL_IS_OFF}; besides, {summary}"


def _friction_measures(
    case: Case, runs: Sequence[Run], model_run: Run
) -> Iterator[tuple[str, Measured]]:
    """What friction does to a model less what it does to the finite elements."""
    (model,) = (
        candidate for candidate in case.model if candidate.name == model_run.source
    )
    if not model.friction:
        return
    names = FE, FE_FRICTIONLESS, model.frictionless.name
    runs_by_source = {run.source: run for run in runs if run.torque == model_run.torque}
    others = (runs_by_source[name].curves for name in names)
    for fe, fe_without_friction, without_friction, model_curve in zip(
        *others, model_run.curves, strict=True
    ):
        curve = f"{model_curve.direction}, mesh {model_curve.mesh}"
        where = f"{model_run.torque:g} N m, {curve}"
        effect = friction_effect(model_curve, without_friction) - friction_effect(
            fe, fe_without_friction
        )
        yield where, (FRICTION_EFFECT, "", effect)


def measures(reference: Run, model_run: Run) -> Iterator[tuple[str, Measured]]:
    """All metrics of a run, each with where it was taken, `100 N m, up, mesh 1`."""
    for where, metric in _measures(reference, model_run):
        yield f"{model_run.torque:g} N m, {where}", metric


def _measures(reference: Run, model_run: Run) -> Iterator[tuple[str, Measured]]:
    for fe_curve, curve in zip(reference.curves, model_run.curves, strict=True):
        where = f"{curve.direction}, mesh {curve.mesh}"
        yield from ((where, metric) for metric in curve_measures(fe_curve, curve))
    for fe_cycle, cycle in zip(reference.cycles, model_run.cycles, strict=True):
        where = f"{cycle.label}, mesh {cycle.mesh}"
        yield from ((where, metric) for metric in cycle_measures(fe_cycle, cycle))
    for fe_statics, statics in zip(reference.statics, model_run.statics, strict=True):
        where = f"mesh {statics.mesh}"
        yield from ((where, metric) for metric in static_measures(fe_statics, statics))


def _read_or_run(
    task: RunSpec, store: Path, excitations: Excitations, report: Progress
) -> Run:
    directory = make_directory(task.directory(store))
    read = partial(read_run, task, directory)

    def compute(checkpoint: Checkpoint | None = None) -> Mapping[str, bytes]:
        return contents(task, solve_task(task, checkpoint, excitations, report))

    if task.model is not None:  # soon made, at worst by two processes alike
        return read_or_compute(directory, FILE_NAMES, read, compute)
    stored = read(reused=True)
    if stored is not None:
        if (directory / CHECKPOINT).exists():
            _remove_checkpoint(task, directory)
        return stored
    with _checkpoint(task, directory) as checkpoint:
        # the process that had the checkpoint until now may have made the run
        return read_or_compute(
            directory, FILE_NAMES, read, partial(compute, checkpoint)
        )


@contextmanager
def _checkpoint(task: RunSpec, directory: Path) -> Iterator[Checkpoint]:
    """The checkpoint of a task, which stays unless what it is for is written."""
    checkpoint = open_checkpoint(directory / CHECKPOINT, task.inputs, resume=True)
    complete = False
    try:
        yield checkpoint
        complete = True
    finally:
        checkpoint.close(keep=not complete)


def _remove_checkpoint(task: RunSpec, directory: Path) -> None:
    """What is left where a process was ended after its last file."""
    with suppress(InputError, OSError), _checkpoint(task, directory):
        pass
