"""Runs of a case: finite elements and lumped models, kept and found again by hash.

A run is one source at one torque. Its directory below the store is named after a
digest of all that determines it, the program's sources among it, and holds

    inputs.json   what it was made of
    sweep.csv     the sweep table
    statics.csv   static deflections over the mesh cycle
    waves.csv     mesh forces over a cycle at single speeds
    result.json   jumps, peaks and cost; written last, a run without it is not done
    journal/      finished speeds of the finite elements, until the run is done

Every run is handed on as read from these files, so that a reused one is the same.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np

from fegear.excitation import Excitations, Source
from fegear.output import make_directory, write_whole
from validation.cases import Case
from validation.marching import Report, march
from validation.metrics import (
    Curve,
    ForceWave,
    Measured,
    Statics,
    Verdict,
    curve_measures,
    static_measures,
    verdict,
    wave_measures,
)
from validation.run_files import RESULT, Run, contents, read_run
from validation.tasks import FE, Task, tasks_of

NEAR = 1.0 / 3.0  # of the frequency: what is further from a printed one is another


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Runs of a case, one of each source at each torque, and the verdicts on them."""

    case: Case
    runs: tuple[Run, ...]
    verdicts: tuple[Verdict, ...]

    @property
    def models(self) -> tuple[str, ...]:
        return tuple(model.name for model in self.case.model)

    def of(self, source: str) -> list[Run]:
        return [run for run in self.runs if run.source == source]

    def cost_ratio(self, model: str) -> float:
        """Seconds per speed of the finite elements over those of a model.

        NaN where nothing moved.
        """
        return self._per_speed(FE) / self._per_speed(model)

    def _per_speed(self, source: str) -> float:
        costs = [run.cost for run in self.of(source)]
        speeds = sum(cost.timed_speeds for cost in costs)
        return sum(cost.march_s for cost in costs) / speeds if speeds else nan


def run_case(
    case: Case, store: Path, report: Report = lambda what, done, total: None
) -> CaseResult:
    """Run what is not in the store yet, and judge.

    Raises InputError for a gear set that cannot be used; after KeyboardInterrupt the
    finished runs and the finished speeds of the finite elements stay in the store.
    """
    tasks = list(tasks_of(case))
    excitations: dict[str, Excitations] = {}
    runs = []
    for task in tasks:
        kind = "fe" if task.model is None else task.model.excitation
        own = excitations.setdefault(kind, Excitations(Source(kind=kind)))
        runs.append(_found_or_made(task, store, own, report))
    return CaseResult(case, tuple(runs), tuple(case_verdicts(case, runs)))


def case_verdicts(case: Case, runs: Sequence[Run]) -> Iterator[Verdict]:
    """Every metric that the case has a tolerance for, for each model and torque."""
    tolerances = {entry.name: entry for entry in case.metric}
    references = {run.torque: run for run in runs if run.source == FE}
    for run in runs:
        if run.source == FE:
            continue
        for where, (name, place, value) in _measures(references[run.torque], run):
            if name in tolerances:
                entry = tolerances[name]
                at = ", ".join(filter(None, (f"{run.torque:g} N m", where, place)))
                yield verdict(name, run.source, at, value, entry.allowed, entry.reason)


def _measures(reference: Run, found: Run) -> Iterator[tuple[str, Measured]]:
    for fe_curve, curve in zip(reference.curves, found.curves, strict=True):
        where = f"{curve.direction}, mesh {curve.mesh}"
        yield from ((where, each) for each in curve_measures(fe_curve, curve))
    for fe_wave, wave in zip(reference.waves, found.waves, strict=True):
        where = f"{wave.label}, mesh {wave.mesh}"
        yield from ((where, each) for each in wave_measures(fe_wave, wave))
    for fe_statics, statics in zip(reference.statics, found.statics, strict=True):
        where = f"mesh {statics.mesh}"
        yield from ((where, each) for each in static_measures(fe_statics, statics))


def printed_figure(run: Run, key: str, near: float) -> float:
    """A figure of a run by the key of `validation.cases.Printed`; NaN if it has none.

    near : of jumps, peaks and natural frequencies the nearest to it counts [Hz], but
        none that is off by more than NEAR; the finite elements have no natural ones
    """
    if key == "natural":
        return _nearest(() if run.source == FE else run.natural_Hz, near)
    where, *words = key.split(".")
    mesh = int(where.removeprefix("mesh"))
    if words[0] in ("up", "down"):
        curves = [c for c in run.curves if (c.mesh, c.direction) == (mesh, words[0])]
        return _nearest((f for c in curves for f in _features(c, words[1])), near)
    if words[0].startswith("wave"):
        waves = [wave for wave in run.waves if wave.mesh == mesh]
        number = int(words[0].removeprefix("wave"))
        return _of_wave(waves[number - 1], words[1]) if number <= len(waves) else nan
    statics = [each for each in run.statics if each.mesh == mesh]
    return _of_statics(statics[0], words[0]) if statics else nan


def _nearest(values: Iterable[float], near: float) -> float:
    close = (v for v in values if abs(v - near) <= NEAR * max(v, near))
    return min(close, key=lambda value: abs(value - near), default=nan)


def _features(curve: Curve, kind: str) -> list[float]:
    """Frequencies of a curve's peaks, or of the last speeds before its jumps [Hz]."""
    if kind == "peak":
        return [peak.frequency for peak in curve.peaks]
    return [jump.frequency_from for jump in curve.jumps]


def _of_wave(wave: ForceWave, name: str) -> float:
    if name == "contact_loss":
        return wave.contact_loss
    return float(np.abs(wave.force).max())


def _of_statics(statics: Statics, name: str) -> float:
    values = {
        "mean_stiffness": statics.mean_stiffness,
        "stiffness_variation": statics.variation,
        "friction_recess": statics.friction_change(0.0, 0.5),
        "friction_approach": statics.friction_change(0.5, 1.0),
    }
    return values[name]


def _found_or_made(
    task: Task, store: Path, excitations: Excitations, report: Report
) -> Run:
    directory = make_directory(store / task.directory_name)
    done = (directory / RESULT).exists()
    if not done:
        text = json.dumps(task.inputs, indent=2, sort_keys=True) + "\n"
        _write(directory / "inputs.json", text)
        marched = march(task, directory / "journal", excitations, report)
        for name, content in contents(task, marched).items():
            _write(directory / name, content)
    return read_run(task, directory, reused=done)


def _write(path: Path, text: str) -> None:
    write_whole(path, lambda place: place.write_text(text, encoding="utf-8"))
