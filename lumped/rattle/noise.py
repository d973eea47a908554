"""How loud a machine is, over random departures: squared speeds of impacts per time.

Section 6.3 of the source, table 6.1.
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
from numpy.typing import NDArray

from lumped.common.workers import run_tasks
from lumped.rattle.assembly import Assembly
from lumped.rattle.attractors import QUIET as QUIET_NAME
from lumped.rattle.attractors import Attractor, sort_departures
from lumped.rattle.departures import Settled, settle_departures
from lumped.rattle.kernels import noise as kernel
from lumped.rattle.kernels.settle import QUIET, UNKNOWN
from lumped.rattle.machine import Machine
from lumped.rattle.motions import Motion, Motions

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
Result = TypeVar("Result")
KINDS = QUIET_NAME, "single-sided rattle", "double-sided rattle"
NOWHERE = math.nan, math.nan
FADED = 1e-3  # of a transient: what is left of it is not heard
STILL = 1e-12  # of the fastest rate: rotation of all parts together
SHARE = 250  # runs that a worker takes at a time


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of n runs on their attractors.

    starts : their departures (n, 2)
    motion : by number among `attractors` (n,), -1 where it is not clear, or not settled
    level : squared speeds at which flanks meet, per turn (n,) [rad^2 per turn^3]
    impacts : meetings of flanks per turn (n,)
    """

    machine: Machine
    starts: Array
    attractors: tuple[Attractor, ...]
    motion: Numbers
    level: Array
    impacts: Array


def random_departures(count: int, velocity: tuple[float, float], seed: int) -> Array:
    """Times of a turn and speeds (n, 2), uniformly distributed."""
    random = np.random.default_rng(seed)
    return random.uniform((0.0, velocity[0]), (1.0, velocity[1]), (count, 2))


def measure_noise(
    machine: Machine,
    starts: Array,
    iterations: int,
    turns: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Noise:
    """Noise of runs from departures (n, 2) once they have settled.

    iterations : returns to the upper flank before it is measured; runs that change
        still and are not chaotic are followed on until they repeat
    turns : over which it is measured, at least, whole periods of runs that repeat;
        quiet runs have none
    """
    limits = list(pairwise([*range(0, len(starts), SHARE), len(starts)]))

    def compute(done: int, task: Callable[[slice], Result]) -> list[Result]:
        found: dict[int, Result] = {}

        def take(number: int, result: Result) -> None:
            found[number] = result
            report(done + len(found), 2 * len(limits))

        tasks = ((i, partial(task, slice(*each))) for i, each in enumerate(limits))
        run_tasks(tasks, take, threading.Event())
        return [found[i] for i in range(len(limits))]

    shares = compute(0, lambda own: settle_departures(machine, starts[own], iterations))
    settled = Settled(*map(np.concatenate, zip(*shares, strict=True)))
    attractors, motion, settled = sort_departures(machine, iterations, settled)
    period = np.where(motion < 0, UNKNOWN, settled.period)
    meetings = compute(
        len(limits),
        lambda own: _meetings(machine, period[own], settled.end[own], turns),
    )
    level, impacts = np.concatenate(meetings).T
    return Noise(machine, starts, attractors, motion, level, impacts)


def measure_noise_of_parts(
    assembly: Assembly,
    starts: Array,
    settling: int,
    turns: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Noise:
    """Noise of a machine whose relative motion has more than one equation.

    At the departures (n, 2) all but the driving side is in steady rotation. Runs are
    told apart by the flanks that meet.

    settling : turns before noise is measured
    Raises ValueError for parts without inertia.
    """
    ready = Motions(assembly)
    machine = assembly.machine
    found: dict[int, Motion] = {}

    def run(time: float, speed: float) -> Motion:
        state = ready.settled(machine.half_backlash, -speed, time)
        begin = time + settling
        return ready.run(state, begin, begin + turns, start=time)

    def take(number: int, motion: Motion) -> None:
        found[number] = motion
        report(len(found), len(starts))

    tasks = (
        (number, partial(run, float(time), float(speed)))
        for number, (time, speed) in enumerate(starts)
    )
    run_tasks(tasks, take, threading.Event())
    motions = [found[number] for number in range(len(starts))]
    level = np.array([each.noise for each in motions])
    clear = np.isfinite(level)
    kind = np.array([(each.upper > 0) + (each.lower > 0) for each in motions])
    impacts = np.array([each.upper + each.lower for each in motions])
    motion = np.full(len(starts), -1)
    seen, motion[clear] = np.unique(kind[clear], return_inverse=True)
    names = [Attractor(KINDS[i], 0, NOWHERE, math.nan) for i in seen]
    return Noise(
        *(machine, starts, tuple(names), motion, level),
        impacts=np.where(clear, impacts / turns, math.nan),
    )


def settling_turns(assembly: Assembly) -> float:
    """In which transients of all parts fade to `FADED`; inf where one never does.

    Losses in impacts may end them sooner.
    """
    regimes = Motions(assembly).system.regimes
    rates = np.concatenate([each.rates for each in regimes])
    scale = np.abs(rates).max()
    slowest = np.min(-rates.real[np.abs(rates) > STILL * scale])
    return math.log(1.0 / FADED) / slowest if slowest > STILL * scale else math.inf


def _meetings(machine: Machine, periods: Numbers, ends: Array, turns: int) -> Array:
    """Noise level and impacts per turn (n, 2) of runs that have settled, see `Settled`;
    NaN of those that are UNKNOWN."""
    found = np.where((periods == QUIET)[:, None], np.zeros(2), math.nan)
    loud = np.flatnonzero((periods != QUIET) & (periods != UNKNOWN))
    meetings = np.empty((loud.size, 2))
    departures = np.ascontiguousarray(ends[loud])
    kernel.sum_impacts(
        machine.arrays, departures, periods[loud], float(turns), meetings
    )
    found[loud] = meetings
    return found
