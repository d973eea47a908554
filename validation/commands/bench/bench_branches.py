"""Branches of periodic motions: run time against error, compared with sweeps.

Errors are of the RMS of the dynamic transmission error against shooting, which
leaves no harmonics out.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fegear.gearset.model import GearSet
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from fegear.train.resonances import default_speeds
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.branches.points import BranchPoint, PeriodicBranch
from lumped.branches.shooting import ADAPTIVE, shoot
from lumped.common.progress import Progress
from lumped.continuation.arc_length import NoSolution
from lumped.steady.integration_settings import Settings
from lumped.steady.jumps import find_jumps
from lumped.steady.response import Response, Status
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from lumped.steady.sweep import Branch, sweep_all
from lumped.train.system import LumpedSystem
from validation.commands.bench import benchmark as bench

REFERENCE_RTOL = Settings(steps=512, tolerance=1e-6)
MARGIN = 0.005  # of a multiplier from the unit circle, of those
DISTURBED, DECAYED, GROWN = 1e-5, 1e-2, 1e2  # of the state, and of that
MAX_PERIODS = 4000
FEW, MANY = 10, 40  # harmonics whose errors are shown


@dataclass(frozen=True)
class Sizes:
    """harmonics : of the branches, FEW and MANY among them; steps : of the sweeps

    span : part of the range of speeds; speeds : of a sweep over it
    order_speeds : of the sweep whose motions give orders
    sampled : motions that are compared with shooting
    drawn : motions whose stability is determined by integration
    """

    harmonics: tuple[int, ...] = (5, FEW, 15, 20, 30, MANY)
    steps: tuple[int, ...] = (32, 64, 128, 256)
    span: float = 1.0
    speeds: int = 170
    order_speeds: int = 25
    sampled: int = 60
    drawn: int = 50


FULL = Sizes()
QUICK = Sizes(
    harmonics=(FEW, MANY),
    steps=FULL.steps[:1],
    span=0.1,
    speeds=10,
    order_speeds=3,
    sampled=5,
    drawn=3,
)


@dataclass(frozen=True)
class BranchCost:
    """A study at one setting: branches of so many harmonics, sweeps of so many steps.

    seconds : in all, for `motions` stable and unstable, or speeds of a sweep
    """

    study: str
    setting: int
    seconds: float
    motions: int
    ms_per_motion: float
    error_median: float
    error_largest: float


@dataclass(frozen=True)
class SweepComparison:
    """Branches compared with sweeps up and down.

    compared : motions of the sweeps that repeat soon enough; error of their RMS
    jumps : between such motions; at_bifurcations : that have one within their step
    """

    direction: str
    compared: int
    error_median: float
    error_largest: float
    jumps: int
    at_bifurcations: int


@dataclass(frozen=True)
class StabilityAgreement:
    """What small disturbances of random motions do, and what multipliers say.

    sampled : motions, until it is known for so many `decided` whether a disturbance
        decays
    stable : of these, by their multipliers; agree : of both
    """

    sampled: int
    decided: int
    stable: int
    agree: int


@dataclass(frozen=True)
class Order:
    """Convergence with harmonics: error over their number to the power -order."""

    waves: str
    contact: str
    motions: int
    error_at_10: float
    error_at_40: float
    order: float


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
    smooth = ExcitationSettings(kind="fourier", harmonics=3)
    waves = {
        "finite elements": system,
        "three harmonics": lumped_system(
            gear_set,
            torque,
            LumpedModel(number=1, damping_ratio=damping, excitation=smooth),
        ),
    }
    speeds = default_speeds(system)
    limits = speeds[0], speeds[0] + sizes.span * (speeds[-1] - speeds[0])
    tables = "sweeps", "stability", "orders"
    rows, interrupted = bench.collect(
        _benchmark_rows(waves, limits, report, sizes), *tables
    )
    return bench.Benchmark(
        name="branches",
        title=f"Periodic motions of {gear_set.name}, {torque:g} N m, "
        f"{limits[0]:g} to {limits[1]:g} Hz",
        about="Branches by harmonic balance beside sweeps by time integration, errors "
        "beside shooting.",
        tables=bench.plain(rows),
        panels=[time_panel(rows[bench.POINTS])],
        interrupted=interrupted,
    )


def _benchmark_rows(
    waves: dict[str, LumpedSystem],
    limits: tuple[float, float],
    report: Progress,
    sizes: Sizes,
) -> Iterator[tuple[str, Any]]:
    """Rows one by one, so that those finished are kept."""
    system = waves["finite elements"]
    finder = followed_branches(system, limits, 20)  # compiles
    for done, harmonics in enumerate(sizes.harmonics):
        report(f"{harmonics} harmonics", done, len(sizes.harmonics))
        yield bench.POINTS, branch_point(system, limits, harmonics, sizes)
    for done, steps in enumerate(sizes.steps):
        report(f"sweep, {steps} steps", done, len(sizes.steps))
        yield bench.POINTS, sweep_point(system, limits, steps, sizes)
    report("branches beside sweeps", 0, 1)
    yield from (("sweeps", row) for row in comparisons_with_sweeps(finder, sizes))
    report("stability", 0, 1)
    yield "stability", stability(finder, np.random.default_rng(1), sizes)
    for name, wave_system in waves.items():
        report(f"orders, {name}", 0, 1)
        yield from (
            ("orders", row)
            for row in convergence_orders(name, wave_system, limits, sizes)
        )


def followed_branches(
    system: LumpedSystem, limits: tuple[float, float], harmonics: int
) -> BranchFinder:
    """All branches, followed."""
    finder = BranchFinder(
        SpeedFamily(system), limits, BranchSettings(harmonics=harmonics)
    )
    finder.find(limits[0])
    return finder


def branch_point(
    system: LumpedSystem,
    limits: tuple[float, float],
    harmonics: int,
    sizes: Sizes = FULL,
) -> BranchCost:
    start = time.perf_counter()
    finder = followed_branches(system, limits, harmonics)
    seconds = time.perf_counter() - start
    all_motions = [
        (branch, point) for branch in finder.branches for point in branch.points
    ]
    errors = [
        error
        for branch, point in all_motions[:: max(1, len(all_motions) // sizes.sampled)]
        if (error := _rms_error(finder, branch, point)) is not None
    ]
    return BranchCost(
        study="branches",
        setting=harmonics,
        seconds=seconds,
        motions=len(all_motions),
        ms_per_motion=1e3 * seconds / len(all_motions),
        error_median=float(np.median(errors)),
        error_largest=max(errors),
    )


def _rms_error(
    finder: BranchFinder, branch: PeriodicBranch, point: BranchPoint
) -> float | None:
    """Relative error of the RMS of a motion; None where shooting finds another."""
    balance, frequency = finder.balance(branch.multiple, point.parameter)
    try:
        exact = shoot(balance, point.x, frequency)
    except NoSolution:
        return None
    return exact.error_of(point.figures["dte_rms"])


def sweep_point(
    system: LumpedSystem,
    limits: tuple[float, float],
    steps: int,
    sizes: Sizes = FULL,
) -> BranchCost:
    speeds = np.linspace(*limits, sizes.speeds)
    settings = Settings(steps=steps)
    start = time.perf_counter()
    branches = sweep_all([system], speeds, settings=settings)
    seconds = time.perf_counter() - start
    count = sum(len(branch.responses) for branch in branches)
    finder = BranchFinder(SpeedFamily(system), limits)
    settled = [r for branch in branches for r in branch.responses if r.multiple == 1]
    errors = []
    for response in settled[:: max(1, len(settled) // sizes.sampled)]:
        balance, frequency = finder.balance(1, response.frequency)
        x = balance.of_response(response, settings)
        try:
            exact = shoot(balance, x, frequency)
        except NoSolution:
            continue
        errors.append(exact.error_of(response.dte_rms))
    return BranchCost(
        study="sweep, rk4",
        setting=steps,
        seconds=seconds,
        motions=count,
        ms_per_motion=1e3 * seconds / count,
        error_median=float(np.median(errors)),
        error_largest=max(errors),
    )


def comparisons_with_sweeps(
    finder: BranchFinder, sizes: Sizes = FULL
) -> Iterator[SweepComparison]:
    """A row for each direction."""
    (system, _) = finder.family.at(finder.limits[0])
    speeds = np.linspace(*finder.limits, sizes.speeds)
    up, down = sweep_all([system], speeds, settings=REFERENCE_RTOL)
    for branch, other in ((up, down), (down, up)):
        yield _comparison_with_sweep(finder, branch, other)


def _comparison_with_sweep(
    finder: BranchFinder, branch: Branch, other: Branch
) -> SweepComparison:
    errors: list[float] = []
    for response in branch.responses:
        if _is_followed(finder, response):
            errors += _distance_to_stable(finder, response)
    followed_at = {r.frequency: _is_followed(finder, r) for r in branch.responses}
    bifurcation_frequencies = [
        p.frequency
        for followed_branch in finder.branches
        for p in followed_branch.bifurcations
    ]
    steps = {
        tuple(sorted((jump.frequency_from, jump.frequency_to)))
        for jump in find_jumps(branch, other)
        if followed_at[jump.frequency_from] and followed_at[jump.frequency_to]
    }
    is_at_bifurcation = [
        any(low <= at <= high for at in bifurcation_frequencies) for low, high in steps
    ]
    return SweepComparison(
        direction=branch.direction,
        compared=len(errors),
        error_median=float(np.median(errors)),
        error_largest=max(errors),
        jumps=len(steps),
        at_bifurcations=sum(is_at_bifurcation),
    )


def _is_followed(finder: BranchFinder, response: Response) -> bool:
    largest_multiple = finder.settings.period_multiple
    return response.status == Status.PERIODIC and response.multiple <= largest_multiple


def _distance_to_stable(finder: BranchFinder, response: Response) -> list[float]:
    """How far the nearest stable motion of the branches is; empty without one."""
    distances = [
        float(np.abs(point.figures["dte_rms"] / response.dte_rms - 1.0).max())
        for branch in finder.branches
        if branch.multiple == response.multiple
        for point in finder.motions_at(branch, response.frequency)
        if point.stable
    ]
    return [min(distances)] if distances else []


def stability(
    finder: BranchFinder, random: np.random.Generator, sizes: Sizes = FULL
) -> StabilityAgreement:
    """Random motions are disturbed a little and integrated."""
    motions = [
        (branch, point)
        for branch in finder.branches
        for point in branch.points
        if abs(point.largest - 1.0) > MARGIN
    ]
    decided_motions: list[tuple[bool, bool]] = []
    drawn = 0
    for i in random.permutation(len(motions)):
        if len(decided_motions) == sizes.drawn:
            break
        branch, point = motions[i]
        decays, drawn = _disturbance_decays(finder, branch, point, random), drawn + 1
        if decays is not None:
            decided_motions.append((point.stable, decays))
    return StabilityAgreement(
        sampled=drawn,
        decided=len(decided_motions),
        stable=sum(stable for stable, _ in decided_motions),
        agree=sum(stable == decays for stable, decays in decided_motions),
    )


def _disturbance_decays(
    finder: BranchFinder,
    branch: PeriodicBranch,
    point: BranchPoint,
    random: np.random.Generator,
) -> bool | None:
    """Whether a small disturbance decays; None where this cannot be decided."""
    balance, frequency = finder.balance(branch.multiple, point.parameter)
    stepper, speed_settings = (
        stepper_of(balance.system, ADAPTIVE),
        Speed(frequency, ADAPTIVE),
    )
    try:
        state = shoot(balance, point.x, frequency).state
    except NoSolution:
        return None
    size = np.abs(state).max(axis=1, keepdims=True)
    disturbed = state + DISTURBED * size * random.standard_normal(state.shape)
    first = largest = float(np.linalg.norm((disturbed - state) / size))
    for _ in range(MAX_PERIODS // branch.multiple):
        # from the same motion each time, or its own errors would grow as well
        disturbed, _ = stepper.record(disturbed, speed_settings, branch.multiple)
        distance = float(np.linalg.norm((disturbed - state) / size))
        largest = max(largest, distance)
        if distance > GROWN * first:
            return False
        if distance < DECAYED * largest:
            return True
    return None


def convergence_orders(
    waves: str,
    system: LumpedSystem,
    limits: tuple[float, float],
    sizes: Sizes = FULL,
) -> Iterator[Order]:
    """Orders with contact kept and lost, of motions at speeds that rest leads to."""
    errors = {
        h: _errors_at_speeds(system, limits, h, sizes.order_speeds)
        for h in sizes.harmonics
    }
    shared = set.intersection(*(set(speed_errors) for speed_errors in errors.values()))
    for contact, lost in (("kept", False), ("lost", True)):
        chosen = [speed for speed in shared if errors[FEW][speed][1] == lost]
        if not chosen:
            continue
        medians = [
            float(np.median([errors[h][speed][0] for speed in chosen]))
            for h in sizes.harmonics
        ]
        yield Order(
            waves=waves,
            contact=contact,
            motions=len(chosen),
            error_at_10=medians[sizes.harmonics.index(FEW)],
            error_at_40=medians[sizes.harmonics.index(MANY)],
            order=-bench.slope(sizes.harmonics, medians),
        )


def _errors_at_speeds(
    system: LumpedSystem,
    limits: tuple[float, float],
    harmonics: int,
    speed_count: int,
) -> dict[float, tuple[float, bool]]:
    """Relative error of the RMS, and whether contact is lost, by speed."""
    errors = {}
    finder = BranchFinder(
        SpeedFamily(system), limits, BranchSettings(harmonics=harmonics)
    )
    speeds = np.linspace(*limits, speed_count)
    for response in sweep_all([system], speeds, ("up",))[0].responses:
        if response.multiple != 1:
            continue
        balance, frequency = finder.balance(1, response.frequency)
        x = balance.of_response(response, Settings())
        try:
            x = finder.solved(1, x, frequency)
            exact = shoot(balance, x, frequency)
        except NoSolution:
            continue
        rms = balance.figures(x, frequency)["dte_rms"]
        lost = bool(response.contact_loss.max() > 0.0)
        errors[response.frequency] = exact.error_of(rms), lost
    return errors


def time_panel(points: Sequence[BranchCost]) -> bench.Panel:
    """Time of a motion over its error."""
    curves = bench.curves_of(
        points,
        lambda p: p.study,
        lambda p: (max(p.error_median, 1e-12), p.ms_per_motion),
        lambda p: p.setting,
    )
    return bench.Panel(
        "relative error of the RMS of the DTE, median over motions",
        "time per motion [ms]",
        curves,
    )
