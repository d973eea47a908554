"""Run time against error of the finite-element dynamics, and how it grows.

Runs are those of `validation.study.from_rest`. An error is the RMS of the
difference of the dynamic transmission error over the RMS of its vibration.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fegear.dynamics.build import FiniteElements
from fegear.dynamics.stepper import ImplicitStepper
from fegear.files.memory import memory_level
from fegear.gearset.model import GearSet
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from validation.commands.bench import benchmark as bench
from validation.study.from_rest import (
    COMMON_STEPS,
    PERIODS,
    SPEEDS,
    Subject,
    run,
    subject,
    waveform_error,
)

REPEATS = 3
STUDIES = {  # by name: what is drawn, a marker, and the unit of the setting
    "steps": ("reduced: steps per period", "o", 1.0),
    "modes": ("reduced: cut-off [kHz], 0 is quasistatic", "s", 1e3),
    "mesh": ("full: refinement of the mesh", "D", 1.0),
}
Study = tuple[str, float, FiniteElements]  # name, setting, finite elements


@dataclass(frozen=True)
class Sizes:
    """periods : of the first mesh, that every run passes

    speeds : over the leading natural frequency; steps : of a period
    cutoffs : of the elastic modes [Hz]; meshes : their refinement
    rows : gears in a row
    """

    periods: int = PERIODS
    speeds: tuple[float, ...] = SPEEDS
    steps: tuple[int, ...] = (32, 64, 128, 256, 512)
    finest_steps: int = 2048
    cutoffs: tuple[float, ...] = (10e3, 15e3, 20e3, 30e3, 50e3, 100e3)
    meshes: tuple[float, ...] = (0.25, 0.35, 0.5)
    finest_mesh: float = 0.7
    rows: tuple[int, ...] = (2, 4, 8)

    @property
    def others(self) -> tuple[Study, ...]:
        """Studies but that of the steps."""
        return (
            *(("mesh", m, _full_elements(m)) for m in self.meshes),
            ("modes", 0.0, FiniteElements(fidelity="quasistatic")),
            *(("modes", c, _reduced_elements(c)) for c in self.cutoffs),
        )


def _full_elements(mesh: float) -> FiniteElements:
    return FiniteElements(fidelity="full", mesh=mesh)


def _reduced_elements(cutoff_Hz: float) -> FiniteElements:
    return FiniteElements(fidelity="reduced", cutoff_Hz=cutoff_Hz)


FULL = Sizes()
QUICK = Sizes(
    periods=2,
    speeds=FULL.speeds[:1],
    steps=FULL.steps[:2],
    finest_steps=128,
    cutoffs=FULL.cutoffs[2:4],
    meshes=FULL.meshes[:1],
    finest_mesh=0.35,
    rows=FULL.rows[:1],
)


@dataclass(frozen=True)
class DynamicsCost:
    """A study at one setting.

    setting : steps per period, cut-off of the elastic modes [Hz], or refinement of
        the mesh; freedoms : elastic ones of all gears
    us_per_step : largest over the speeds; prepare_s : from the gear set to the stepper
    error_median, error_largest : over speeds and meshes
    """

    study: str
    setting: float
    freedoms: int
    prepare_s: float
    us_per_step: float
    error_median: float
    error_largest: float


def measure(
    gear_set: GearSet, torque: float, report: Progress, sizes: Sizes = FULL
) -> bench.Benchmark:
    """At a torque on the input gear [N m]."""
    level = memory_level()
    report("stiffness", 0, 1)
    case = subject(gear_set, torque, periods=sizes.periods, parts=sizes.speeds)
    rows, interrupted = bench.collect(_cost_rows(case, report, sizes), "growth")
    points, findings = rows[bench.POINTS], []
    if sum(p.study == "steps" for p in points) > 1:
        findings.append(f"observed order over the steps: {observed_order(points):.2f}")
    if math.isfinite(peak := level.peak_MB):
        findings.append(f"largest memory: {peak:.0f} MB")
    return bench.Benchmark(
        name="dynamics",
        title=f"Finite-element dynamics of {gear_set.name}, {torque:g} N m",
        about="Finite-element dynamics from rest over steps, elastic modes and mesh, "
        "against finer steps or all freedoms on a finer mesh.",
        tables=bench.plain(rows),
        panels=[figure_panel(points)],
        facts={"peak_memory_MB": peak},
        findings=findings,
        interrupted=interrupted,
    )


def _cost_rows(
    case: Subject, report: Progress, sizes: Sizes
) -> Iterator[tuple[str, Any]]:
    """Rows one by one, so that those finished are kept."""
    yield from ((bench.POINTS, point) for point in measure_points(case, report, sizes))
    report("growth", 0, 1)
    for gears in sizes.rows:
        row = row_of_gears(case.gear_set, gears)
        row_case = subject(row, case.torque, periods=case.periods, parts=case.parts)
        yield "growth", growth(row_case)


def measure_points(
    case: Subject, report: Progress, sizes: Sizes
) -> Iterator[DynamicsCost]:
    """Over the steps against finer ones; all else against whole gears."""
    report("steps", 0, 1)
    timed_stepper = case.stepper(FiniteElements(fidelity="reduced"))
    others = others_with_modes(timed_stepper[0], sizes)
    total = len(sizes.steps) + len(others) + 2
    fine = case.runs(timed_stepper[0], sizes.finest_steps)
    for done, steps in enumerate(sizes.steps, start=1):
        yield _point(
            "steps", steps, timed_stepper, case.runs(timed_stepper[0], steps), fine
        )
        report("steps", done, total)
    report("whole gears", len(sizes.steps), total)
    timed_stepper = case.stepper(_full_elements(sizes.finest_mesh))
    fine = case.runs(timed_stepper[0], COMMON_STEPS)
    yield _point("mesh", sizes.finest_mesh, timed_stepper, fine)
    for done, (study, setting, elements) in enumerate(
        others, start=len(sizes.steps) + 1
    ):
        report(f"{study} {setting:g}", done, total)
        timed_stepper = case.stepper(elements)
        yield _point(
            study,
            setting,
            timed_stepper,
            case.runs(timed_stepper[0], COMMON_STEPS),
            fine,
        )


def others_with_modes(stepper: ImplicitStepper, sizes: Sizes = FULL) -> list[Study]:
    """All but that of the steps, without cut-offs that no elastic mode lies below."""
    lowest = math.sqrt(stepper.model.modal.rigidity.min()) / (2.0 * math.pi)
    return [
        study for study in sizes.others if (study[2].cutoff_Hz or math.inf) > lowest
    ]


def _point(
    study: str,
    setting: float,
    timed_stepper: tuple[ImplicitStepper, int, float],
    runs: Sequence[tuple[Array, float]],
    fine: Sequence[tuple[Array, float]] | None = None,
) -> DynamicsCost:
    """timed_stepper : by `Subject.stepper`; runs, fine : by `Subject.runs`"""
    pairs = zip(runs, fine or (), strict=False)
    errors = [waveform_error(waveform, wanted) for (waveform, _), (wanted, _) in pairs]
    return DynamicsCost(
        study=study,
        setting=setting,
        freedoms=timed_stepper[1],
        prepare_s=timed_stepper[2],
        us_per_step=max(us for _, us in runs),
        error_median=float(np.median(errors)) if errors else math.nan,
        error_largest=float(np.max(errors)) if errors else math.nan,
    )


@dataclass(frozen=True)
class RowGrowth:
    """Microseconds per step over the gears in a row, and all coordinates."""

    gears: int
    coordinates: int
    us_per_step: float


def growth(row: Subject) -> RowGrowth:
    """Growth of the cost with the subject of a row of gears, in the reduced
    fidelity.
    """
    stepper, _, _ = row.stepper(FiniteElements(fidelity="reduced", cutoff_Hz=30e3))
    best = min(
        run(stepper, row.speeds[-1], COMMON_STEPS, row.periods)[1]
        for _ in range(REPEATS)
    )
    return RowGrowth(len(row.gear_set.gears), stepper.model.size, best)


def row_of_gears(gear_set: GearSet, count: int) -> GearSet:
    """The first mesh's gears in turns, each driving the next."""
    mesh = gear_set.meshes[0]
    kinds = [gear_set.gears[g] for g in (mesh.driver, mesh.driven)]
    gears = [replace(kinds[i % 2], name=f"gear {i + 1}") for i in range(count)]
    turns = mesh, replace(mesh, pair=mesh.pair.swapped, torques=())
    meshes = [
        replace(turns[i % 2], driver=i, driven=i + 1, phase=0.0, center_line=0.0)
        for i in range(count - 1)
    ]
    meshes[1:] = [replace(mesh, torques=()) for mesh in meshes[1:]]
    return replace(gear_set, gears=tuple(gears), meshes=tuple(meshes), shafts=())


def observed_order(points: Sequence[DynamicsCost]) -> float:
    """Observed order of the median error over the steps."""
    step_points = [p for p in points if p.study == "steps"]
    return -bench.slope(
        [p.setting for p in step_points], [p.error_median for p in step_points]
    )


def figure_panel(points: Sequence[DynamicsCost]) -> bench.Panel:
    """Time per mesh period over the median error, a line for each study."""
    curves = []
    for study, (label, marker, unit) in STUDIES.items():
        study_points = [p for p in points if p.study == study and p.error_median > 0.0]
        steps = [p.setting if study == "steps" else COMMON_STEPS for p in study_points]
        places = [
            (p.error_median, 1e-3 * p.us_per_step * n)
            for p, n in zip(study_points, steps, strict=True)
        ]
        names = [p.setting / unit for p in study_points]
        curves.append(bench.CostCurve(label, marker, places, names))
    return bench.Panel(
        "relative error of the dynamic transmission error, median",
        "time per mesh period [ms]",
        curves,
    )
