"""Eccentric gearing: run time against error of the centre distance and of contact.

Centre distances are compared with the rolling integral in closed form, contact with
that of the finest mesh.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fegear.commands.eccentric.elastic_wheel import ElasticWheel
from fegear.commands.eccentric.turn import STEEL
from fegear.commands.eccentric.wheel_contact import solve_contact_cycle
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from meshes.eccentric import EccentricPair
from meshes.eccentric.outline import WheelEdges
from meshes.eccentric.teeth import ToothedPair
from meshes.eccentric.wheel_mesh import default_bore, wheel_mesh
from validation.commands.bench import benchmark as bench
from validation.oracles.rolling import (
    closing_residual_dop853,
    closing_residual_rk4,
    shoot,
)

ECCENTRICITY = 0.627  # over the radius, figure 4 of the source
RADIUS, TEETH, PART = 0.02, 24, 0.2  # of the wheels in contact, [m] and over the radius
LOAD = 2e3  # torque per width [N]


@dataclass(frozen=True)
class Sizes:
    """samples, steps, tolerances : of the centre distance

    fineness : of both wheels' meshes; positions : of a tooth
    """

    samples: tuple[int, ...] = (8, 12, 16, 24, 32, 48, 64)
    steps: tuple[int, ...] = (8, 16, 32, 64, 128, 256)
    tolerances: tuple[float, ...] = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
    fineness: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0)
    positions: int = 6


FULL = Sizes()
QUICK = Sizes(
    samples=FULL.samples[:2],
    steps=FULL.steps[:2],
    tolerances=FULL.tolerances[:2],
    fineness=(0.35, 0.5),
    positions=1,
)


@dataclass(frozen=True)
class EccentricCost:
    """Centre distance. setting : samples, steps or the tolerance"""

    study: str
    setting: float
    ms: float
    error: float


@dataclass(frozen=True)
class ContactCost:
    """Transmission errors of a mesh and of the finest. freedoms : of the driver"""

    fineness: float
    freedoms: int
    seconds: float
    ms_per_position: float
    error: float


def measure(report: Progress, sizes: Sizes = FULL) -> bench.Benchmark:
    """Benchmark of both, in this order."""
    rows, interrupted = bench.collect(_cost_rows(report, sizes), "contact")
    return bench.Benchmark(
        name="eccentric",
        title=f"Eccentric gearing: centre distance at e/r = {ECCENTRICITY}",
        about="Centre distance by the periodic integral of rolling and by shooting, "
        "and transmission errors over the fineness of both wheels' meshes.",
        tables=bench.plain(rows),
        panels=[
            _distance_panel(rows[bench.POINTS]),
            *_contact_panels(rows["contact"], sizes.positions),
        ],
        interrupted=interrupted,
    )


def _cost_rows(report: Progress, sizes: Sizes) -> Iterator[tuple[str, Any]]:
    report("centre distance", 0, 1 + len(sizes.fineness))
    yield from ((bench.POINTS, point) for point in distance_points(sizes))
    yield from (("contact", row) for row in contact_rows(report, sizes))


def distance_points(sizes: Sizes = FULL) -> Iterator[EccentricCost]:
    exact = EccentricPair(1.0, ECCENTRICITY).center_distance

    def point(study: str, setting: float, work: Callable[[], float]) -> EccentricCost:
        return EccentricCost(
            study, setting, 1e3 * bench.fastest(work), abs(work() / exact - 1.0)
        )

    for samples in sizes.samples:
        yield point("rolling integral", samples, _distance_by_integral(samples))
    for steps in sizes.steps:
        end = closing_residual_rk4(ECCENTRICITY, steps)
        yield point("shooting, Runge-Kutta", steps, _shooting_error(end))
    for tolerance in sizes.tolerances:
        end = closing_residual_dop853(ECCENTRICITY, tolerance)
        yield point("shooting, DOP853", tolerance, _shooting_error(end))
    pair = EccentricPair(1.0, ECCENTRICITY)
    yield point("Burmester", 0.0, lambda: pair.approximate_center_distance)


def _shooting_error(end: Callable[[float], float]) -> Callable[[], float]:
    return lambda: shoot(end, ECCENTRICITY)


def _distance_by_integral(samples: int) -> Callable[[], float]:
    """The trapezoidal rule over a turn, of which no higher one is better."""
    e, angle = ECCENTRICITY, 2.0 * math.pi * np.arange(samples) / samples
    rho = np.sqrt(1.0 + e * e - 2.0 * e * np.cos(angle))
    ahead = (1.0 - e * np.cos(angle)) / rho

    def excess(distance: float) -> float:
        return float(np.mean(ahead / (distance - rho))) - 1.0

    return lambda: float(brentq(excess, 1.8, 3.0, xtol=1e-15))


def contact_rows(report: Progress, sizes: Sizes = FULL) -> list[ContactCost]:
    """Over the fineness, each compared with the finest."""
    toothed = ToothedPair(
        EccentricPair(RADIUS, PART * RADIUS), math.radians(20.0), TEETH
    )
    arcs = toothed.rack.pitch * (np.arange(sizes.positions) + 0.5) / sizes.positions
    measurements: list[tuple[int, float, float, Array]] = []
    for done, fineness in enumerate(sizes.fineness, start=1):
        report("contact", done, 1 + len(sizes.fineness))
        start = time.perf_counter()
        edges = WheelEdges().refined(fineness)
        driver, driven = (
            ElasticWheel(wheel_mesh(wheel, default_bore(wheel), edges), STEEL)
            for wheel in (toothed.driver, toothed.driven)
        )
        _ = driver.factor, driven.factor
        prepared = time.perf_counter()
        errors = solve_contact_cycle(toothed, driver, driven, LOAD, arcs).error
        end = time.perf_counter()
        position_ms = 1e3 * (end - prepared) / sizes.positions
        measurements.append((int(driver.basis.N), end - start, position_ms, errors))
    finest = measurements[-1][3]
    return [
        ContactCost(fineness, *row[:3], float(np.abs(row[3] / finest - 1.0).max()))
        for fineness, row in zip(sizes.fineness, measurements, strict=True)
    ]


def _distance_panel(points: Sequence[EccentricCost]) -> bench.Panel:
    curves = bench.curves_of(
        points,
        lambda p: p.study,
        lambda p: (max(p.error, 1e-16), p.ms),
        lambda p: p.setting,
    )
    return bench.Panel("relative error of the centre distance", "time [ms]", curves)


def _contact_panels(
    rows: Sequence[ContactCost], positions: int
) -> Iterator[bench.Panel]:
    inexact = [row for row in rows if row.error > 0.0]
    if inexact:
        places = [(row.error, row.seconds) for row in inexact]
        curve = bench.CostCurve(
            "contact", "o", places, [row.fineness for row in inexact]
        )
        label = "relative error of the transmission error, beside the finest mesh"
        yield bench.Panel(label, f"time of {positions} positions [s]", [curve])
