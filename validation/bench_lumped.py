"""Run time against error of the lumped models' integrators, and how it grows."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lumped.response import respond
from lumped.settings import Settings
from lumped.sweep import sweep_all
from lumped.system import LumpedSystem
from lumped.train import Gear, Shaft
from validation.scipy_train import Method, ScipyTrain, scipy_rms

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Report = Callable[[str, int, int], None]
REFERENCE = Settings(
    method="dopri5", accuracy=1e-11, tolerance=1e-8, max_periods=20_000
)
STEPS = (16, 24, 32, 48, 64, 96, 128, 256)
ACCURACIES = (1e-3, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9)
RTOLS: dict[Method, tuple[float, ...]] = {
    "DOP853": (1e-2, 1e-3, 1e-4, 1e-5),
    "LSODA": (1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
}
SPEEDS = (0.55, 0.62, 0.8, 1.18, 1.35, 1.62, 2.2)  # over the leading frequency
OFF_JUMPS = 0.02  # change of the RMS, up against down, beyond which a speed is left out
REPEATS = 3


@dataclass(frozen=True)
class Point:
    """A study at one setting; times are per speed, errors of the RMS of the DTE.

    setting : steps per period, accuracy, relative tolerance, or a size
    """

    study: str
    setting: float
    ms_per_speed: float
    us_per_period: float
    error_median: float
    error_largest: float


def run_benchmark(
    system: LumpedSystem, report: Report = lambda what, done, total: None
) -> Iterator[Point]:
    """Points one by one, so that those finished are kept."""
    frequencies = [f * leading_frequency(system) for f in SPEEDS]
    report("reference", 0, 1)
    references = {f: respond(system, f, REFERENCE) for f in frequencies}
    frequencies = [f for f in frequencies if _single_branch(system, f, references[f])]
    known = {f: references[f].dte_rms for f in frequencies}
    studies = [("rk4", n) for n in STEPS] + [("dopri5", a) for a in ACCURACIES]
    total = len(studies) + sum(map(len, RTOLS.values()))
    for done, (study, setting) in enumerate(studies):
        report(study, done, total)
        yield _compiled_point(system, known, study, setting)
    done = len(studies)
    for method, rtols in RTOLS.items():
        for rtol in rtols:
            report(f"SciPy {method}", done, total)
            yield _scipy_point(system, known, method, rtol)
            done += 1


def leading_frequency(system: LumpedSystem) -> float:
    """The lowest natural frequency that strains the meshes most [Hz]."""
    energy = system.modes.mesh_energy.sum(axis=0)
    return float(system.modes.frequency_Hz[np.flatnonzero(energy > 0.5)[0]])


def _single_branch(system: LumpedSystem, frequency: float, reference: object) -> bool:
    """Whether the speed is settled and the default finds the same response."""
    from lumped.response import Response

    assert isinstance(reference, Response)
    other = respond(system, frequency).dte_rms
    change = np.abs(other / reference.dte_rms - 1.0).max()
    return reference.multiple > 0 and bool(change < OFF_JUMPS)


def _settings(study: str, setting: float) -> Settings:
    if study == "rk4":
        return Settings(steps=int(setting), step_angle=2.0)
    return Settings(method="dopri5", accuracy=setting)


def _compiled_point(
    system: LumpedSystem, known: dict[float, Array], study: str, setting: float
) -> Point:
    settings = _settings(study, setting)
    for frequency in known:  # compile, and lay out the excitation
        respond(system, frequency, settings)
    errors, seconds, periods = [], 0.0, 0.0
    for frequency, expected in known.items():
        best = math.inf
        for _ in range(REPEATS):
            start = time.perf_counter()
            response = respond(system, frequency, settings)
            best = min(best, time.perf_counter() - start)
        seconds += best
        periods += response.settling_time * frequency + max(response.multiple, 1)
        errors.append(float(np.abs(response.dte_rms / expected - 1.0).max()))
    return _point(study, setting, seconds, periods, errors)


def _scipy_point(
    system: LumpedSystem, known: dict[float, Array], method: Method, rtol: float
) -> Point:
    """SciPy over the very span that the default settings needed."""
    train = ScipyTrain(system)
    errors, seconds, periods = [], 0.0, 0.0
    for frequency, expected in known.items():
        ours = respond(system, frequency)
        settle, measure = ours.settling_time * frequency, int(ours.period_multiple[0])
        start = time.perf_counter()
        rms = scipy_rms(train, frequency, settle, max(measure, 1), method, rtol)
        seconds += time.perf_counter() - start
        periods += settle + max(measure, 1)
        errors.append(float(np.abs(rms / expected - 1.0).max()))
    return _point(f"SciPy {method}", rtol, seconds, periods, errors)


def _point(
    study: str, setting: float, seconds: float, periods: float, errors: list[float]
) -> Point:
    return Point(
        study=study,
        setting=float(setting),
        ms_per_speed=1e3 * seconds / len(errors),
        us_per_period=1e6 * seconds / periods,
        error_median=float(np.median(errors)),
        error_largest=max(errors),
    )


@dataclass(frozen=True)
class Race:
    """A SciPy run beside the fastest compiled one that is no less accurate.

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


def races(points: Sequence[Point]) -> list[Race]:
    """One race for each method of SciPy, at its error nearest to rk4's default."""
    ours = [p for p in points if p.study in ("rk4", "dopri5")]
    default = next(
        p for p in ours if p.study == "rk4" and p.setting == Settings().steps
    )
    found = []
    for method in RTOLS:
        own = [p for p in points if p.study == f"SciPy {method}"]
        rival = min(
            own, key=lambda p: abs(math.log(p.error_median / default.error_median))
        )
        good = [p for p in ours if p.error_median <= rival.error_median]
        if not good:
            continue
        best = min(good, key=lambda p: p.ms_per_speed)
        found.append(
            Race(
                method,
                rival.setting,
                rival.error_median,
                best.study,
                best.setting,
                best.error_median,
                rival.ms_per_speed / best.ms_per_speed,
            )
        )
    return found


@dataclass(frozen=True)
class Growth:
    """Run time over a size: speeds of a sweep or degrees of freedom."""

    study: str
    size: int
    seconds: float
    per_item_us: float


def growth(system: LumpedSystem) -> Iterator[Growth]:
    """Sweeps of more speeds, and trains with more degrees of freedom."""
    highest = float(system.modes.frequency_Hz.max())
    for count in (43, 86, 171, 342):
        speeds = np.linspace(1.05 * highest, 1.3 * highest, count)
        seconds = _best_of(partial(sweep_all, [system], speeds, ("up",), workers=1))
        yield Growth("speeds", count, seconds, 1e6 * seconds / count)
    for size in (3, 8, 20, 50):
        larger = with_disks(system, size)
        periods = 0.0

        def run(larger: LumpedSystem = larger) -> None:
            nonlocal periods
            settings = Settings(step_angle=2.0, tolerance=1e-12, max_periods=300)
            response = respond(larger, 1.1 * highest, settings)
            periods = response.settling_time * 1.1 * highest

        seconds = _best_of(run)
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


def _best_of(work: Callable[[], object]) -> float:
    work()
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def sweep_seconds(system: LumpedSystem) -> tuple[float, int]:
    """Warm seconds and speeds of 171 frequencies up and down on all cores."""
    leading = leading_frequency(system)
    speeds = np.linspace(0.5 * leading, 2.62 * leading, 171)
    return _best_of(lambda: sweep_all([system], speeds)), 342


def draw_points(points: Sequence[Point], title: str) -> Figure:
    """Time per speed over the median error, a line for each integrator."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 5.0), layout="constrained")
    axes = figure.subplots()
    markers = iter("osD^v")
    for study in dict.fromkeys(point.study for point in points):
        own = [point for point in points if point.study == study]
        x = [max(point.error_median, 1e-12) for point in own]
        axes.loglog(x, [p.ms_per_speed for p in own], f"{next(markers)}-", label=study)
        for point, error in zip(own, x, strict=True):
            axes.annotate(
                f"{point.setting:g}",
                (error, point.ms_per_speed),
                textcoords="offset points",
                xytext=(4, 4),
                fontsize=7,
            )
    axes.set_xlabel(
        "relative error of the RMS of the DTE, median over speeds and meshes"
    )
    axes.set_ylabel("time per settled speed [ms]")
    axes.grid(alpha=0.25, which="both")
    axes.legend()
    axes.set_title(title, fontsize=11)
    return figure
