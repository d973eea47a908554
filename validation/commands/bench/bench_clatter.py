"""Clattering wheels: impacts per second against the tolerance of event times."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from fegear.commands.clatter.gearboxes import load_gearbox
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import Impacts, centred_state, join_impacts, simulate
from lumped.common.progress import Progress
from validation.commands.bench import benchmark as bench

GEARBOX = "seed-five-speed"
REFERENCE_RTOL = 1e-15
COMPARED = 8  # first impacts: later ones are driven apart by chaos


@dataclass(frozen=True)
class Sizes:
    """tolerances : of event times, in periods; timed : impacts"""

    tolerances: tuple[float, ...] = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
    timed: int = 200_000


FULL = Sizes()
QUICK = Sizes(tolerances=(1e-3, 1e-6), timed=1000)


@dataclass(frozen=True)
class ImpactCost:
    """error : largest of the times of the first impacts, in periods"""

    study: str
    tolerance: float
    impacts_per_s: float
    us_per_impact: float
    error: float


def measure(report: Progress, sizes: Sizes = FULL) -> bench.Benchmark:
    rows, interrupted = bench.collect(_cost_rows(report, sizes), bench.POINTS)
    return bench.Benchmark(
        name="clatter",
        title=f"Clattering wheel of {GEARBOX}: time of an impact",
        about="Events of the teeth alone and of all three plays; errors of the times "
        f"of the first {COMPARED} impacts beside those of round-off.",
        tables=bench.plain(rows),
        panels=[_panel(rows[bench.POINTS])],
        interrupted=interrupted,
    )


def _cost_rows(report: Progress, sizes: Sizes) -> Iterator[tuple[str, Any]]:
    gearbox = load_gearbox(GEARBOX).gearbox
    (wheel,) = gearbox.wheels
    studies = {
        "teeth alone": replace(wheel, axial=None, radial=None),
        "three plays": wheel,
    }
    done, total = 0, len(studies) * len(sizes.tolerances)
    for name, studied_wheel in studies.items():
        exact = _first_impacts(
            WheelGroup((studied_wheel,), gearbox.excitation, REFERENCE_RTOL)
        )
        for tolerance in sizes.tolerances:
            report(name, done, total)
            group = WheelGroup((studied_wheel,), gearbox.excitation, tolerance)
            yield bench.POINTS, _point(name, group, exact, sizes.timed)
            done += 1


def _first_impacts(group: WheelGroup) -> Impacts:
    """Impacts one after another, until there are enough."""
    alone = simulate(group, centred_state(group), math.inf, max_impacts=0)
    return join_impacts(list(islice(alone, COMPARED)))


def _point(study: str, group: WheelGroup, exact: Impacts, timed: int) -> ImpactCost:
    impacts = _first_impacts(group)
    few = min(len(impacts), len(exact))
    time_error = np.abs(impacts.time[:few] - exact.time[:few]).max()
    begin = time.perf_counter()
    count = 0
    for part in simulate(group, centred_state(group), math.inf):
        count += len(part)
        if count >= timed:
            break
    seconds = time.perf_counter() - begin
    error = float(time_error) / group.excitation.period
    speed = count / seconds
    return ImpactCost(study, group.tolerance, speed, 1e6 / speed, error)


def _panel(points: list[ImpactCost]) -> bench.Panel:
    curves = bench.curves_of(
        points,
        lambda p: p.study,
        lambda p: (max(p.error, 1e-17), p.us_per_impact),
        lambda p: p.tolerance,
    )
    return bench.Panel(
        "error of event times [periods]", "time of an impact [us]", curves
    )
