"""Floquet multipliers: run time against error, and what a chart of stability takes.

Errors of state transitions are against the exact solution of Hill's equation with
a sawtooth, figure 5.4 of the multi-mesh source; those of the multipliers of a gear set
are against integration. Edges by perturbation are compared with traced ones.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fegear.commands.stability.study import Stability
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.running import run
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.parametric import FRICTION
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.stability.combinations import Combination, combinations
from lumped.stability.intervals import scan_stability
from lumped.stability.kernels.transition import set_transitions
from lumped.stability.multipliers import MAX_STEP_ANGLE, integrated, largest_multiplier
from lumped.stability.periodic_system import PeriodicSystem, periodic_system
from lumped.steady.maps import Axis
from validation.commands.bench import benchmark as bench
from validation.oracles.hill import (
    exact_transition,
    exponentials,
    first_order_form,
    recursion,
)

SLOPE, START, STEP = -1.0, -1.0, 0.5  # a, b and h of figure 5.4
BATCH = 500  # transitions that are timed at once, of compiled methods
COEFFICIENT, DAMPING = 0.1, 0.001
MODEL = LumpedModel(
    number=1,
    excitation=ExcitationSettings(kind="rectangular"),
    translations=True,
    damping_ratio=DAMPING,
    bending=0.4,
)
VARIATION = 0.2  # of the stiffness, with this damping and coefficient
RANGE = 0.2, 2.2  # of the chart's speeds, over the highest natural frequency


@dataclass(frozen=True)
class Sizes:
    """terms, divisions : of a step of the sawtooth; left_out : of a series

    checked : speeds whose multipliers are compared with integration
    variations : of the stiffness
    widest : combinations of modes whose edges are compared
    speeds, values : of the chart
    """

    terms: tuple[int, ...] = (2, 4, 6, 8, 10, 12, 16, 20)
    divisions: tuple[int, ...] = (1, 2, 5, 10, 20, 50, 100, 200)
    left_out: tuple[float, ...] = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
    checked: int = 24
    variations: tuple[float, ...] = (VARIATION, 0.1, 0.05, 0.025)
    widest: int = 3
    speeds: int = 400
    values: int = 100


FULL = Sizes()
QUICK = Sizes(
    terms=FULL.terms[:2],
    divisions=FULL.divisions[:2],
    left_out=FULL.left_out[:2],
    checked=2,
    variations=FULL.variations[:2],
    widest=1,
    speeds=20,
    values=3,
)


@dataclass(frozen=True)
class MultiplierCost:
    """State transitions of the sawtooth over one step.

    setting : terms, divisions, or what a series may leave out
    """

    study: str
    setting: float
    us_per_transition: float
    error: float


@dataclass(frozen=True)
class Multipliers:
    """Largest multipliers of the gear set at some speeds, against integration."""

    method: str
    us_per_speed: float
    error_median: float
    error_largest: float


@dataclass(frozen=True)
class Edge:
    """Ends of an interval by perturbation and traced ones, over their middle.

    order : of the error over the variation, from the row before
    """

    combination: str
    variation: float
    error: float
    order: float


@dataclass(frozen=True)
class Chart:
    """Largest multipliers over speed and friction, with edges traced."""

    speeds: int
    values: int
    seconds: float
    us_per_cell: float


def measure(
    set_name: str, torque: float, report: Progress, sizes: Sizes = FULL
) -> bench.Benchmark:
    """Benchmark of a gear set at a torque on its input gear [N m], rectangular
    stiffness.
    """
    studies = _cost_rows(set_name, torque, report, sizes)
    tables = "multipliers", "edges", "chart"
    rows, interrupted = bench.collect(studies, *tables)
    panels = [_transition_panel(rows[bench.POINTS])]
    panels += [_edge_panel(rows["edges"])] if rows["edges"] else []
    findings = [
        f"chart of {chart.speeds} speeds and {chart.values} coefficients of friction: "
        f"{chart.seconds:.1f} s"
        for chart in rows["chart"]
    ]
    return bench.Benchmark(
        name="stability",
        title=f"Stability: sawtooth Hill equation, and {set_name} at {torque:g} N m",
        about="State transitions by series and by exponentials against the exact "
        "solution, and edges of instability by perturbation against traced ones.",
        tables=bench.plain(rows),
        panels=panels,
        findings=findings,
        interrupted=interrupted,
    )


def _cost_rows(
    set_name: str, torque: float, report: Progress, sizes: Sizes
) -> Iterator[tuple[str, Any]]:
    report("sawtooth", 0, 4)
    yield from ((bench.POINTS, point) for point in sawtooth_points(sizes))
    report("multipliers", 1, 4)
    yield from (
        ("multipliers", row) for row in multiplier_rows(set_name, torque, sizes)
    )
    report("perturbation", 2, 4)
    yield from (("edges", row) for row in edge_rows(set_name, torque, sizes))
    report("chart", 3, 4)
    yield "chart", timed_chart(set_name, torque, sizes)


def sawtooth_points(sizes: Sizes = FULL) -> Iterator[MultiplierCost]:
    """Compiled methods, and those of the source as they are written, in NumPy."""
    exact = exact_transition(SLOPE, START, STEP)
    form = first_order_form(SLOPE, START)

    def point(
        study: str, setting: float, work: Callable[[], Array], count: int
    ) -> MultiplierCost:
        seconds = bench.fastest(work)
        error = float(np.abs(work() - exact).max() / np.abs(exact).max())
        return MultiplierCost(study, setting, 1e6 * seconds / count, error)

    for left_out in sizes.left_out:
        work = _compiled_arguments(_sawtooth_stiffness(), left_out)
        yield point("series", left_out, work, BATCH)
    for count in sizes.divisions:
        work = _compiled_arguments(
            _sawtooth_stiffness().averaged(count), sizes.left_out[-1]
        )
        yield point("exponentials", count, work, BATCH)
    for count in sizes.terms:
        yield point(
            "eq. 4.55, NumPy", count, _transition_matrix_by(recursion, form, count), 1
        )
    for count in sizes.divisions:
        yield point(
            "eq. 4.56, SciPy",
            count,
            _transition_matrix_by(exponentials, form, count),
            1,
        )


def _transition_matrix_by(
    way: Callable[[Sequence[Array], float, int], Array],
    form: Sequence[Array],
    count: int,
) -> Callable[[], Array]:
    return lambda: way(form, STEP, count)


def _sawtooth_stiffness() -> PeriodicSystem:
    stiffness = np.array([[[[START]], [[SLOPE]]]])
    edges = np.array([0.0, STEP])
    return PeriodicSystem(np.ones(1), np.zeros(1), edges, stiffness)


def _compiled_arguments(system: PeriodicSystem, left_out: float) -> Callable[[], Array]:
    """One transition of a batch, by a series that may leave so much out."""
    out = np.empty((BATCH, 2, 2))
    arguments = np.diff(system.edges), system.stiffness, system.damping, np.ones(BATCH)

    def work() -> Array:
        set_transitions(*arguments, MAX_STEP_ANGLE, left_out, out, np.empty(BATCH))
        return np.asarray(out[0])

    return work


def _system(
    set_name: str, torque: float, variation: float | None = None
) -> PeriodicSystem:
    """The gear set with friction.

    variation : of the stiffness of all meshes, with which friction and damping change
        in proportion; None for the gear set's
    """
    scale, edits = 1.0, {}
    if variation is not None:
        scale = variation / VARIATION
        meshes = range(1, len(load_gear_set(set_name).meshes) + 1)
        edits = {f"mesh.{m}.stiffness_variation": variation for m in meshes}
    model = replace(MODEL, damping_ratio=scale * DAMPING, friction=scale * COEFFICIENT)
    gear_set = load_gear_set(set_name, edits)
    try:
        return periodic_system(lumped_system(gear_set, torque, model))
    except ValueError as error:
        raise InputError(f"{gear_set.name}: {error}") from None


def _speeds(system: PeriodicSystem, count: int) -> Array:
    low, high = (float(system.frequency_Hz.max()) * part for part in RANGE)
    return np.linspace(low, high, count)


def multiplier_rows(
    set_name: str, torque: float, sizes: Sizes = FULL
) -> Iterator[Multipliers]:
    """Rows of the compiled methods, with their defaults."""
    system = _system(set_name, torque)
    speeds = _speeds(system, sizes.checked)
    exact = np.array(
        [
            np.abs(np.linalg.eigvals(integrated(system, speed, system.edges[-1:])))
            for speed in speeds.tolist()
        ]
    ).max(axis=(1, 2))
    for method in ("peano-baker", "exponential"):
        work = _multipliers(system, speeds, method)
        errors = np.abs(work() - exact)
        yield Multipliers(
            method=method,
            us_per_speed=1e6 * bench.fastest(work) / speeds.size,
            error_median=float(np.median(errors)),
            error_largest=float(errors.max()),
        )


def _multipliers(
    system: PeriodicSystem, speeds: Array, method: Any
) -> Callable[[], Array]:
    return lambda: largest_multiplier(system, speeds, method)


def edge_rows(set_name: str, torque: float, sizes: Sizes = FULL) -> Iterator[Edge]:
    """Rows of the widest intervals of first order, as the variation falls."""
    variations = sizes.variations
    systems = [_system(set_name, torque, variation) for variation in variations]
    widest = sorted(_of_first_order(systems[0]), key=lambda c: c.low - c.high)
    for name in [combination.name for combination in widest[: sizes.widest]]:
        before = math.nan
        for variation, system in zip(variations, systems, strict=True):
            error = edge_error(system, name)
            order = math.log2(before / error) if before > 0.0 < error else math.nan
            yield Edge(name, variation, error, order)
            before = error


def _of_first_order(system: PeriodicSystem) -> list[Combination]:
    unstable = combinations(system)
    return [
        combination
        for combination in unstable
        if combination.order == 1.0 and combination.unstable
    ]


def edge_error(system: PeriodicSystem, name: str) -> float:
    """Error of the ends by perturbation, relative to the middle; NaN where nothing is
    unstable.
    """
    near = next((c for c in _of_first_order(system) if c.name == name), None)
    if near is None:
        return math.nan
    margin = 2.0 * (near.high - near.low)
    speeds = np.linspace(near.low - margin, near.high + margin, 101)
    intervals = [
        interval
        for interval in scan_stability(system, speeds).intervals
        if interval.kind == name
    ]
    if not intervals:
        return math.nan
    traced = max(intervals, key=lambda interval: interval.high - interval.low)
    return max(abs(near.low - traced.low), abs(near.high - traced.high)) / near.at


def timed_chart(set_name: str, torque: float, sizes: Sizes) -> Chart:
    """Largest multipliers and traced edges, compiled before."""
    coefficients = tuple(np.linspace(0.0, 0.2, sizes.values).tolist())
    axis = Axis(FRICTION, coefficients)
    study = Stability(
        gear_set=GearSetRef(name=set_name),
        over=axis,
        torque=torque,
        model=MODEL,
        speeds=tuple(_speeds(_system(set_name, torque), sizes.speeds).tolist()),
    )
    run(replace(study, over=Axis(FRICTION, coefficients[:2])))
    begin = time.perf_counter()
    if not run(study).complete:
        raise KeyboardInterrupt
    seconds = time.perf_counter() - begin
    cells = sizes.speeds * sizes.values
    return Chart(sizes.speeds, sizes.values, seconds, 1e6 * seconds / cells)


def _transition_panel(points: Sequence[MultiplierCost]) -> bench.Panel:
    curves = bench.curves_of(
        points,
        lambda p: p.study,
        lambda p: (max(p.error, 1e-16), p.us_per_transition),
        lambda p: p.setting,
    )
    return bench.Panel(
        "relative error of a state transition", "time per transition [us]", curves
    )


def _edge_panel(rows: Sequence[Edge]) -> bench.Panel:
    positive = [row for row in rows if row.error > 0.0]
    curves = bench.curves_of(
        positive, lambda r: r.combination, lambda r: (r.variation, r.error)
    )
    return bench.Panel(
        "stiffness variation; friction and damping in proportion",
        "error of edges by perturbation",
        curves,
    )
