"""Attractors over a parameter, each from where the motion before has settled.

Over the parameter they show where periods double, where chaos begins and where it ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from lumped.attractors.attractors import (
    MAX_NEUTRAL_EXPONENT,
    Attractor,
    Kind,
    SectionSettings,
    find_attractor,
    fine_settings,
)
from lumped.common.checks import check_arguments
from lumped.common.short_repr import ShortRepr
from lumped.common.workers import Stop
from lumped.steady.integration_settings import Settings
from lumped.steady.response import Response, Status
from lumped.steady.steady_state import (
    Callback,
    Stepper,
    confirm_steady_state,
    steady_state,
)
from lumped.steady.steppers import stepper_of
from lumped.steady.sweep import (
    NO_OBSERVER,
    Direction,
    Observer,
    SweepPoint,
    continue_sweep,
    sort_values,
)
from lumped.train.system import LumpedSystem

JUMP = "jump"
# Of the largest deflection; of the changes beside: a jump
MIN_JUMP, MIN_JUMP_MISS = 0.1, 2.5
# Periods of the first mesh in which chaos that passes should end
CHAOTIC_TRANSIENT_PERIODS = 16_000
SystemAt = Callable[[float], tuple[LumpedSystem, float]]  # and the mesh frequency [Hz]


@dataclass(frozen=True)
class AttractorInterval(ShortRepr):
    """Values of a parameter, in the order of the sweep, with motions of one name.

    Attributes
    ----------
    first : float
        First value.
    last : float
        Last value.
    name : str
        Name of the motions, see `Attractor.name`.
    transition : str
        ``period doubling``, ``chaos begins``, ``jump`` or what else came with the first
        value; empty where that has no name.
    exponent : float
        Largest Lyapunov exponent of the motions, per period of the first mesh; NaN
        where they diverged.
    """

    first: float
    last: float
    name: str
    transition: str
    exponent: float


@dataclass(frozen=True, eq=False)
class AttractorBranch(ShortRepr):
    """Attractors in the order in which values of a parameter were passed.

    Attributes
    ----------
    direction : {'up', 'down'}
        Whether the values rise or fall.
    values : tuple of float
        Values that were reached.
    attractors : tuple of Attractor
        Attractor at each value.
    complete : bool
        Whether all values were reached; a divergence ends a branch.
    """

    direction: Direction
    values: tuple[float, ...]
    attractors: tuple[Attractor, ...]
    complete: bool

    @property
    def intervals(self) -> tuple[AttractorInterval, ...]:
        """Successive values at which the motion has one name."""
        intervals: list[AttractorInterval] = []
        before: Attractor | None = None
        jumps = find_jumps(self.attractors)
        for value, attractor, jump in zip(
            self.values, self.attractors, jumps, strict=True
        ):
            transition = "" if before is None else named_change(before, attractor)
            transition = JUMP if jump else transition
            continues = before is not None and before.name == attractor.name
            if continues and not jump:
                largest = float(np.fmax(intervals[-1].exponent, attractor.exponent))
                intervals[-1] = replace(intervals[-1], last=value, exponent=largest)
            else:
                name, exponent = attractor.name, attractor.exponent
                intervals.append(
                    AttractorInterval(value, value, name, transition, exponent)
                )
            before = attractor
        return tuple(intervals)


def find_jumps(attractors: Sequence[Attractor]) -> list[bool]:
    """Whether each motion is another one than that before it.

    Means of the sections are far apart, and much further than those of the neighbours
    on both sides, which there must be. Where a period doubles, points part from each
    other but not from their mean.
    """
    distances = [_distance(*pair) for pair in pairwise(attractors)]
    padded = [math.nan, *distances, math.nan]
    return [False] * len(attractors[:1]) + [
        distance > MIN_JUMP
        and distance > MIN_JUMP_MISS * previous
        and distance > MIN_JUMP_MISS * following
        for previous, distance, following in zip(
            padded, distances, padded[2:], strict=False
        )
    ]


def _distance(before: Attractor, after: Attractor) -> float:
    """Between means of sections, over the largest deflection; NaN without a period."""
    if not (before.multiple and after.multiple) or not before.deflection.size:
        return math.nan
    means = [attractor.deflection.mean(axis=0) for attractor in (before, after)]
    deflections = np.concatenate([before.deflection, after.deflection])
    return float(np.abs(means[0] - means[1]).max() / np.abs(deflections).max())


def named_change(before: Attractor, after: Attractor) -> str:
    """What happens from one motion to another."""
    if before.name == after.name:
        return ""
    if after.kind == Kind.CHAOTIC:
        return "chaos begins"
    if before.kind == Kind.CHAOTIC:
        return "chaos ends"
    if before.multiple and after.multiple == 2 * before.multiple:
        return "period doubling"
    if after.multiple and before.multiple == 2 * after.multiple:
        return "period halving"
    if after.kind == Kind.QUASI_PERIODIC:
        return "torus"
    return ""


def unstable(attractor: Attractor) -> bool:
    """Whether a motion that seems to repeat leaves what it repeats."""
    return attractor.multiple > 0 and attractor.exponent > MAX_NEUTRAL_EXPONENT


def aperiodic(response: Response) -> Response:
    """The response as that of a motion which does not repeat."""
    none = np.zeros_like(response.period_multiple)
    return replace(response, status=Status.APERIODIC, multiple=0, period_multiple=none)


class AttractorStore(Protocol):
    """Storage of the finished values of a branch."""

    def finished(self) -> list[tuple[Response, Attractor]]:
        """In the order in which they were passed; the last with its state."""

    def add(self, response: Response, attractor: Attractor) -> None:
        """Keep both, with the response's state."""


@dataclass
class _AttractorRecorder:
    """The attractors of a sweep, which keeps responses."""

    sections: SectionSettings
    store: AttractorStore | None
    attractors: list[Attractor] = field(default_factory=list)

    def finished(self) -> list[Response]:
        if self.store is None:
            return []
        records = self.store.finished()
        self.attractors = [attractor for _, attractor in records]
        return [response for response, _ in records]

    def settle(
        self,
        stepper: Stepper,
        frequency: float,
        settings: Settings,
        state: Any,
        before: Response | None,
        callback: Callback,
    ) -> tuple[Response, Any, Settings]:
        """Response of `confirm_steady_state` on the attractor of the motion.

        One that seems to repeat but is unstable on finer steps leaves there; one that
        does not repeat though changes shrink may have been chaotic for a while.
        """
        solution = confirm_steady_state(
            stepper, frequency, settings, state, before, callback
        )
        attractor = self._attractor(stepper, solution, callback)
        if attractor.kind == Kind.NOT_CONVERGED or unstable(attractor):
            response, _, steps = solution
            longer = replace(
                fine_settings(stepper.system, steps, stepper.system.common_period[0]),
                max_periods=steps.max_periods or CHAOTIC_TRANSIENT_PERIODS,
            )
            rerun = steady_state(
                *(stepper, frequency, longer, response.state, frequency, callback)
            )
            solution = *rerun, longer
            attractor = self._attractor(stepper, solution, callback)
        if unstable(attractor):
            solution = aperiodic(solution[0]), *solution[1:]
            attractor = self._attractor(stepper, solution, callback)
        self.attractors.append(attractor)
        return solution

    def _attractor(
        self, stepper: Stepper, solution: tuple[Response, Any, Any], callback: Callback
    ) -> Attractor:
        response, _, steps = solution
        return find_attractor(
            *(stepper.system, response, steps, self.sections),
            partial(callback, response.frequency),
        )

    def add(self, response: Response) -> None:
        if self.store is not None:
            self.store.add(response, self.attractors[-1])


@check_arguments
def sweep_attractors(
    values: Sequence[float],
    system_at: SystemAt,
    direction: Direction,
    settings: Settings | None = None,
    sections: SectionSettings | None = None,
    *,
    store: AttractorStore | None = None,
    observer: Observer = NO_OBSERVER,
    stop: Stop | None = None,
) -> AttractorBranch:
    """Pass through values of a parameter, which rise or fall by the direction.

    Every value starts from the motion of the one before.

    Parameters
    ----------
    values : sequence of float
        Values of the parameter, in any order.
    system_at : callable
        Function that returns the system at a value and the frequency of its first mesh
        [Hz], such as `at` of a `lumped.branches.motions.Family`; all systems have the
        same coordinates.
    direction : {'up', 'down'}
        Whether the values rise or fall.
    settings : Settings, optional
        Settings of the integration; a motion that does not repeat is measured over one
        window, whatever they say.
    sections : SectionSettings, optional
        Number of points of the Poincaré section of an aperiodic motion.
    store : AttractorStore, optional
        Storage of the finished values, from which the sweep continues.
    observer : Observer, optional
        Functions called after each value and within it.
    stop : Stop, optional
        Event that ends the sweep at the next call of the observer's callback.

    Returns
    -------
    AttractorBranch
        Attractors at the values that were reached.

    Raises
    ------
    TrainError
        If teeth have friction, or a common period exceeds the memory allowed.
    ValueError
        If an argument is not of its type, the direction is not allowed or the method
        does not fit the system.
    """
    # no figures are shown that more windows would measure
    settings = replace(settings or Settings(), windows=1)
    ordered = sort_values(values, direction)
    recorder = _AttractorRecorder(sections or SectionSettings(), store)

    def station(value: float) -> SweepPoint:
        system, frequency = system_at(value)
        return stepper_of(system, settings), frequency

    responses, complete = continue_sweep(
        *(ordered, station, settings),
        settle=recorder.settle,
        store=recorder,
        observer=observer,
        stop=stop,
    )
    visited = tuple(ordered[: len(responses)])
    return AttractorBranch(direction, visited, tuple(recorder.attractors), complete)
