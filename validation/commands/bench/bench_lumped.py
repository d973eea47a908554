"""Run time against error of the lumped models' integrators, and how it grows."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fegear.gearset.model import GearSet
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.steady.integration_settings import SPRING_STEPS, Settings
from lumped.steady.respond import respond
from lumped.steady.response import Response
from lumped.steady.sweep import sweep_all
from lumped.train.bodies import Gear
from lumped.train.system import LumpedSystem
from lumped.train.train import Shaft
from validation.commands.bench import benchmark as bench
from validation.oracles.scipy_train import ScipyTrain, scipy_rms
from validation.study.from_rest import leading_frequency

REFERENCE = Settings(
    method="dopri5", accuracy=1e-11, tolerance=1e-8, max_periods=20_000
)
SCIPY = "SciPy "  # before the name of its method
OFF_JUMPS = 0.02  # change of the RMS, up against down, beyond which a speed is left out


@dataclass(frozen=True)
class Sizes:
    """rk4 : steps, the default among them; dopri5 : accuracy; dop853, lsoda : rtol

    speeds : over the leading frequency; sweep : speeds of the sweep that is timed
    sweeps, coordinates : speeds, and degrees of freedom, over which time grows
    """

    rk4: tuple[int, ...] = (16, 24, 32, 48, 64, 96, 128, 256)
    dopri5: tuple[float, ...] = (1e-3, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9)
    dop853: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5)
    lsoda: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    speeds: tuple[float, ...] = (0.55, 0.62, 0.8, 1.18, 1.35, 1.62, 2.2)
    sweep: int = 171
    sweeps: tuple[int, ...] = (43, 86, 171, 342)
    coordinates: tuple[int, ...] = (3, 8, 20, 50)

    @property
    def studies(self) -> Mapping[str, tuple[float, ...]]:
        """Settings of every integrator."""
        return {
            "rk4": self.rk4,
            "dopri5": self.dopri5,
            f"{SCIPY}DOP853": self.dop853,
            f"{SCIPY}LSODA": self.lsoda,
        }


FULL = Sizes()
QUICK = Sizes(
    rk4=(16, SPRING_STEPS),
    dopri5=FULL.dopri5[:2],
    dop853=FULL.dop853[:1],
    lsoda=FULL.lsoda[:1],
    speeds=FULL.speeds[-1:],
    sweep=4,
    sweeps=(2, 4),
    coordinates=FULL.coordinates[:2],
)


@dataclass(frozen=True)
class StepCost:
    """A study at one setting; times are per speed, errors of the RMS of the DTE.

    setting : steps per period, accuracy, or relative tolerance
    """

    study: str
    setting: float
    ms_per_speed: float
    us_per_period: float
    error_median: float
    error_largest: float


def measure(
    gear_set: GearSet,
    torque: float,
    damping: float | None,
    report: Progress,
    sizes: Sizes = FULL,
) -> bench.Benchmark:
    """Model 1 of a gear set at a torque on the input gear [N m].

    damping : ratio of every mode, None for the gear set's
    """
    report("stiffness", 0, 1)
    system = lumped_system(
        gear_set, torque, LumpedModel(number=1, damping_ratio=damping)
    )
    timed: dict[str, Any] = {}
    studies = _cost_rows(system, report, timed, sizes)
    rows, interrupted = bench.collect(studies, "races", "growth")
    points = rows[bench.POINTS]
    if {p.study for p in points} >= {"rk4", f"{SCIPY}DOP853", f"{SCIPY}LSODA"}:
        rows["races"] = races(points)
    findings = []
    if timed:
        findings.append(
            f"sweep of {timed['sweep_speeds']} speeds, up and down, warm: "
            f"{timed['sweep_warm_s']:.2f} s"
        )
    return bench.Benchmark(
        name="lumped",
        title=f"Lumped model 1 of {gear_set.name}, {torque:g} N m",
        about="Settled vibration of the lumped train by own integrators and SciPy's, "
        "against the tightest tolerances.",
        tables=bench.plain(rows),
        panels=[figure_panel(points)],
        facts=timed,
        findings=findings,
        interrupted=interrupted,
    )


def _cost_rows(
    system: LumpedSystem, report: Progress, timed: dict[str, Any], sizes: Sizes
) -> Iterator[tuple[str, Any]]:
    """Rows one by one, so that those finished are kept; a sweep's time at last."""
    points = measure_points(system, report, sizes)
    yield from ((bench.POINTS, point) for point in points)
    report("growth", 0, 1)
    yield from (("growth", row) for row in growth(system, sizes))
    speeds = leading_frequency(system) * np.linspace(0.5, 2.62, sizes.sweep)
    timed["sweep_warm_s"] = bench.fastest(lambda: sweep_all([system], speeds))
    timed["sweep_speeds"] = 2 * speeds.size


def measure_points(
    system: LumpedSystem, report: Progress, sizes: Sizes
) -> Iterator[StepCost]:
    """Every study at all its settings, over the speeds that one response has."""
    frequencies = [f * leading_frequency(system) for f in sizes.speeds]
    report("reference", 0, 1)
    references = {f: respond(system, f, REFERENCE) for f in frequencies}
    reference_rms = {
        frequency: response.dte_rms
        for frequency, response in references.items()
        if _has_one_response(system, response)
    }
    todo = [
        (study, setting)
        for study, settings in sizes.studies.items()
        for setting in settings
    ]
    for done, (study, setting) in enumerate(todo):
        report(study, done, len(todo))
        yield _point(system, reference_rms, study, float(setting))


def _has_one_response(system: LumpedSystem, reference: Response) -> bool:
    """Whether the speed is settled and the default finds the same response."""
    other = respond(system, reference.frequency).dte_rms
    change = np.abs(other / reference.dte_rms - 1.0).max()
    return reference.multiple > 0 and bool(change < OFF_JUMPS)


def _point(
    system: LumpedSystem,
    reference_rms: Mapping[float, Array],
    study: str,
    setting: float,
) -> StepCost:
    errors, seconds, periods = [], 0.0, 0.0
    for frequency, expected in reference_rms.items():
        if study.startswith(SCIPY):
            method = study.removeprefix(SCIPY)
            solution = _solve_by_scipy(system, frequency, method, setting)
        else:
            solution = _solve(system, frequency, study, setting)
        errors.append(float(np.abs(solution[0] / expected - 1.0).max()))
        seconds, periods = seconds + solution[1], periods + solution[2]
    return StepCost(
        study=study,
        setting=setting,
        ms_per_speed=1e3 * seconds / len(errors),
        us_per_period=1e6 * seconds / periods,
        error_median=float(np.median(errors)),
        error_largest=max(errors),
    )


def _solve(
    system: LumpedSystem, frequency: float, study: str, setting: float
) -> tuple[Array, float, float]:
    """RMS of the DTE (m,) [m], seconds, and periods passed."""
    if study == "rk4":
        settings = Settings(steps=int(setting), step_angle=2.0)
    else:
        settings = Settings(method="dopri5", accuracy=setting)
    response = respond(system, frequency, settings)
    seconds = bench.fastest(lambda: respond(system, frequency, settings))
    periods = response.settling_time * frequency + max(response.multiple, 1)
    return response.dte_rms, seconds, periods


def _solve_by_scipy(
    system: LumpedSystem, frequency: float, method: Any, rtol: float
) -> tuple[Array, float, float]:
    """Solution by SciPy, over the span that the default settings needed."""
    ours, train = respond(system, frequency), ScipyTrain(system)
    settle, measured = ours.settling_time * frequency, int(ours.period_multiple[0])
    start = time.perf_counter()
    rms = scipy_rms(train, frequency, settle, max(measured, 1), method, rtol)
    return rms, time.perf_counter() - start, settle + max(measured, 1)


@dataclass(frozen=True)
class Race:
    """A SciPy run and the fastest compiled one that is no less accurate.

    rtol, error : of SciPy; study, setting, own_error : of the compiled run
    ratio : of the times per speed
    """

    method: str
    rtol: float
    error: float
    study: str
    setting: float
    own_error: float
    ratio: float


def races(points: Sequence[StepCost]) -> list[Race]:
    """One race for each method of SciPy, at its error nearest to rk4's default."""
    ours = [p for p in points if not p.study.startswith(SCIPY)]
    default = next(p for p in ours if p.study == "rk4" and p.setting == SPRING_STEPS)

    def off_default(point: StepCost) -> float:
        return abs(math.log(point.error_median / default.error_median))

    race_list = []
    studies = dict.fromkeys(p.study for p in points)
    for study in (name for name in studies if name.startswith(SCIPY)):
        rival = min((p for p in points if p.study == study), key=off_default)
        good = [p for p in ours if p.error_median <= rival.error_median]
        if good:
            best = min(good, key=lambda p: p.ms_per_speed)
            race_list.append(
                Race(
                    method=study.removeprefix(SCIPY),
                    rtol=rival.setting,
                    error=rival.error_median,
                    study=best.study,
                    setting=best.setting,
                    own_error=best.error_median,
                    ratio=rival.ms_per_speed / best.ms_per_speed,
                )
            )
    return race_list


@dataclass(frozen=True)
class Growth:
    """Run time over a size: speeds of a sweep or degrees of freedom."""

    study: str
    size: int
    seconds: float
    per_item_us: float


def growth(system: LumpedSystem, sizes: Sizes = FULL) -> Iterator[Growth]:
    """Sweeps of more speeds, and trains with more degrees of freedom."""
    highest = float(system.modes.frequency_Hz.max())
    for count in sizes.sweeps:
        speeds = np.linspace(1.05 * highest, 1.3 * highest, count)
        work = partial(sweep_all, [system], speeds, ("up",), workers=1)
        seconds = bench.fastest(work)
        yield Growth("speeds", count, seconds, 1e6 * seconds / count)
    for size in sizes.coordinates:
        larger = with_disks(system, size)
        settings = Settings(step_angle=2.0, tolerance=1e-12, max_periods=300)
        settle = partial(respond, larger, 1.1 * highest, settings)
        periods = settle().settling_time * 1.1 * highest
        seconds = bench.fastest(settle)
        moving = larger.moving.size
        yield Growth("degrees of freedom", moving, seconds, 1e6 * seconds / periods)


def with_disks(system: LumpedSystem, size: int) -> LumpedSystem:
    """The train with disks on elastic shafts, up to a number of moving modes."""
    train = system.train
    gears, shafts = list(train.gears), list(train.shafts)
    first = len(gears)
    for i in range(size - first):
        host = gears[i] if i < first else gears[first + i - first]
        number = len(gears)
        gears.append(
            Gear(
                name=f"disk {number}",
                teeth=host.teeth,
                base_radius=host.base_radius,
                inertia=host.inertia * (1.1 + 0.01 * i),
            )
        )
        stiffness = 5e4 * (1.0 + 0.03 * i)
        shafts.append(Shaft(gears=(i, number), stiffness=stiffness))
    larger = replace(train, gears=tuple(gears), shafts=tuple(shafts))
    return LumpedSystem(larger, system.excitations)


def figure_panel(points: Sequence[StepCost]) -> bench.Panel:
    """Time per speed over the median error, a line for each integrator."""
    curves = []
    studies = dict.fromkeys(point.study for point in points)
    for study, marker in zip(studies, "osD^v", strict=False):
        study_points = [p for p in points if p.study == study]
        places = [(max(p.error_median, 1e-12), p.ms_per_speed) for p in study_points]
        curves.append(
            bench.CostCurve(study, marker, places, [p.setting for p in study_points])
        )
    return bench.Panel(
        "relative error of the RMS of the DTE, median over speeds and meshes",
        "time per settled speed [ms]",
        curves,
    )
