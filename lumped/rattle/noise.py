"""Noise of a machine over random departures: squared speeds of impacts per time.

See section 6.3 of the source, table 6.1.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TypeVar

import numpy as np

from lumped.common.array_types import Array, Indices
from lumped.common.workers import run_tasks
from lumped.rattle.assembly import Assembly
from lumped.rattle.attractors import QUIET as QUIET_NAME
from lumped.rattle.attractors import RattleAttractor, classify_attractors
from lumped.rattle.kernels import meetings as kernel
from lumped.rattle.kernels.settle import PERMANENT_CONTACT, UNKNOWN
from lumped.rattle.machine import Machine
from lumped.rattle.motions import AssemblyIntegrator, AssemblyRun
from lumped.rattle.return_map import Settled, iterate_map_points

Result = TypeVar("Result")
KINDS = QUIET_NAME, "single-sided rattle", "double-sided rattle"
NO_DEPARTURE = math.nan, math.nan
INAUDIBLE = 1e-3  # part of a transient that is inaudible
RIGID_RTOL = 1e-12  # part of the fastest rate below which all parts rotate together
RUNS_PER_TASK = 250  # runs that a worker takes at a time


@dataclass(frozen=True, eq=False)
class NoiseSample:
    """Noise of n runs in steady state.

    starts : (n, 2) departures of the runs
    motion : (n,) index among `attractors`, -1 if undecided or not settled
    level : (n,) squared impact speeds per turn [rad^2 per turn^3]
    impacts : (n,) number of impacts per turn
    """

    machine: Machine
    starts: Array
    attractors: tuple[RattleAttractor, ...]
    motion: Indices
    level: Array
    impacts: Array


def random_initial_conditions(
    count: int, velocity: tuple[float, float], seed: int
) -> Array:
    """Times in a turn and speeds (n, 2), uniformly distributed."""
    random = np.random.default_rng(seed)
    return random.uniform((0.0, velocity[0]), (1.0, velocity[1]), (count, 2))


def measure_noise(
    machine: Machine,
    starts: Array,
    iterations: int,
    turns: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> NoiseSample:
    """Noise of runs from departures (n, 2) in steady state.

    iterations : returns to the upper flank before the measurement; runs that still
        change and are not chaotic are followed until they repeat
    turns : least number of turns of the measurement, rounded up to whole periods of
        periodic runs; quiet runs have no noise
    """
    limits = list(pairwise([*range(0, len(starts), RUNS_PER_TASK), len(starts)]))

    def compute(done: int, task: Callable[[slice], Result]) -> list[Result]:
        results: dict[int, Result] = {}

        def store_result(number: int, result: Result) -> None:
            results[number] = result
            report(done + len(results), 2 * len(limits))

        tasks = ((i, partial(task, slice(*bounds))) for i, bounds in enumerate(limits))
        run_tasks(tasks, store_result, threading.Event())
        return [results[i] for i in range(len(limits))]

    shares = compute(
        0, lambda part: iterate_map_points(machine, starts[part], iterations)
    )
    settled = Settled(*map(np.concatenate, zip(*shares, strict=True)))
    attractors, motion, settled = classify_attractors(machine, iterations, settled)
    period = np.where(motion < 0, UNKNOWN, settled.period)
    meetings = compute(
        len(limits),
        lambda part: _impact_noise(machine, period[part], settled.end[part], turns),
    )
    level, impacts = np.concatenate(meetings).T
    return NoiseSample(machine, starts, attractors, motion, level, impacts)


def measure_noise_of_parts(
    assembly: Assembly,
    starts: Array,
    settling: int,
    turns: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> NoiseSample:
    """Noise of a machine whose relative motion has more than one equation.

    At the departures (n, 2) all parts except the driving side are in steady rotation.
    Runs are distinguished by the flanks that meet.

    settling : turns before noise is measured

    Raises ValueError for parts without inertia.
    """
    integrator = AssemblyIntegrator(assembly)
    machine = assembly.machine
    runs: dict[int, AssemblyRun] = {}

    def run(time: float, speed: float) -> AssemblyRun:
        state = integrator.settled(machine.half_backlash, -speed, time)
        begin = time + settling
        return integrator.run(state, begin, begin + turns, start=time)

    def store_result(number: int, motion: AssemblyRun) -> None:
        runs[number] = motion
        report(len(runs), len(starts))

    tasks = (
        (number, partial(run, float(time), float(speed)))
        for number, (time, speed) in enumerate(starts)
    )
    run_tasks(tasks, store_result, threading.Event())
    motions = [runs[number] for number in range(len(starts))]
    level = np.array([assembly_run.noise for assembly_run in motions])
    is_finite = np.isfinite(level)
    kind = np.array(
        [
            (assembly_run.upper > 0) + (assembly_run.lower > 0)
            for assembly_run in motions
        ]
    )
    impacts = np.array(
        [assembly_run.upper + assembly_run.lower for assembly_run in motions]
    )
    motion = np.full(len(starts), -1)
    kinds, motion[is_finite] = np.unique(kind[is_finite], return_inverse=True)
    names = [RattleAttractor(KINDS[i], 0, NO_DEPARTURE, math.nan) for i in kinds]
    return NoiseSample(
        *(machine, starts, tuple(names), motion, level),
        impacts=np.where(is_finite, impacts / turns, math.nan),
    )


def settling_turns(assembly: Assembly) -> float:
    """Turns in which all transients decay to `INAUDIBLE`; inf if one never does.

    Losses in impacts may end them sooner.
    """
    regimes = AssemblyIntegrator(assembly).system.regimes
    rates = np.concatenate([regime.rates for regime in regimes])
    scale = np.abs(rates).max()
    slowest = np.min(-rates.real[np.abs(rates) > RIGID_RTOL * scale])
    return (
        math.log(1.0 / INAUDIBLE) / slowest
        if slowest > RIGID_RTOL * scale
        else math.inf
    )


def _impact_noise(machine: Machine, periods: Indices, ends: Array, turns: int) -> Array:
    """Noise level and impacts per turn (n, 2) of runs in steady state, see `Settled`;
    NaN for runs that are UNKNOWN."""
    noise = np.where((periods == PERMANENT_CONTACT)[:, None], np.zeros(2), math.nan)
    rattling = np.flatnonzero((periods != PERMANENT_CONTACT) & (periods != UNKNOWN))
    meetings = np.empty((rattling.size, 2))
    departures = np.ascontiguousarray(ends[rattling])
    kernel.sum_impacts(
        machine.arrays, departures, periods[rattling], float(turns), meetings
    )
    noise[rattling] = meetings
    return noise
