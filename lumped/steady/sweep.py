"""Frequency responses: steady motions from speed to speed, up and down, in parallel."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Protocol

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import check_arguments
from lumped.common.progress import Progress, silent
from lumped.common.short_repr import ShortRepr
from lumped.common.workers import Stop, Stopped, run_in_threads
from lumped.steady.integration_settings import Settings, SteadySettings
from lumped.steady.response import Response, Status
from lumped.steady.steady_state import Callback, Stepper, confirm_steady_state
from lumped.steady.steppers import stepper_of
from lumped.steady.truncation_check import TruncationCheck
from lumped.train.system import LumpedSystem

Direction = Literal["up", "down"]
DIRECTIONS: tuple[Direction, ...] = ("up", "down")
StoreMotion = Callable[[float, Any], None]  # (frequency [Hz], record at that frequency)
SweepPoint = tuple[Stepper, float]  # (stepper, frequency of the first mesh [Hz])
Settle = Callable[
    ..., tuple[Response, Any, Any]
]  # same signature as `confirm_steady_state`
REPORT_INTERVAL = 0.2  # s between reports from within a speed


@dataclass(frozen=True, eq=False)
class Branch(ShortRepr):
    """Responses in the order in which the speeds were passed.

    Attributes
    ----------
    system : LumpedSystem
        System that was solved.
    direction : {'up', 'down'}
        Whether the speeds rise or fall.
    responses : tuple of Response
        Response at each speed that was reached.
    complete : bool
        Whether all speeds were reached; a divergence ends a branch.
    checks : tuple of TruncationCheck
        Checks of body modes that are left out, at some of the speeds.
    """

    system: LumpedSystem
    direction: Direction
    responses: tuple[Response, ...]
    complete: bool
    checks: tuple[TruncationCheck, ...] = ()

    @property
    def frequency_Hz(self) -> Array:
        """Frequencies (speeds,) of the first mesh [Hz]."""
        return np.array([response.frequency for response in self.responses])

    @property
    def interrupted(self) -> bool:
        """Whether speeds are left that no divergence keeps from being reached."""
        return not self.complete and not _diverged(self.responses)

    def column(self, name: str) -> Array:
        """One quantity of all responses.

        Parameters
        ----------
        name : str
            Attribute of `Response`, such as ``dte_rms``.

        Returns
        -------
        (speeds, m) or (speeds,) array
            The quantity at each speed, of m meshes where the attribute is of meshes.
        """
        return np.array([getattr(response, name) for response in self.responses])


@dataclass(frozen=True)
class Observer:
    """Observer of a sweep: `passed` is called after each speed, `callback` within it.

    callback : function of frequency [Hz] and period, see `steady_state`
    """

    passed: Callable[[], None] = lambda: None
    callback: Callback = lambda frequency, period: None


NO_OBSERVER = Observer()


def reporting_observer(report: Progress, total: int) -> Observer:
    """Observer that reports the speeds done, of `total`, and progress in slow ones."""
    lock, done, last_report = threading.Lock(), 0, time.perf_counter()

    def passed() -> None:
        nonlocal done
        with lock:
            done += 1
            report("sweep", done, total)

    def callback(frequency: float, period: int) -> None:
        nonlocal last_report
        now = time.perf_counter()
        if now - last_report > REPORT_INTERVAL:
            last_report = now
            report(f"{frequency:g} Hz, period {period}", done, total)

    return Observer(passed, callback)


class BranchStore(Protocol):
    """Storage of the finished speeds of a branch."""

    def finished(self) -> list[Response]:
        """Responses in the order in which they were passed, the last with its state."""

    def add(self, response: Response) -> None:
        """Store a response with its state."""


def sweep_branch(
    stepper: Stepper,
    frequencies: Sequence[float] | Array,
    direction: Direction,
    settings: SteadySettings,
    *,
    store: BranchStore | None = None,
    store_motion: StoreMotion = lambda frequency, motion: None,
    observer: Observer = NO_OBSERVER,
    stop: Stop | None = None,
) -> Branch:
    """Pass through mesh frequencies [Hz], each from the steady state of the previous.

    The frequencies are sorted by the direction. For the other arguments see
    `continue_sweep`.
    """
    ordered = sort_values(frequencies, direction)
    responses, complete = continue_sweep(
        *(ordered, lambda frequency: (stepper, frequency), settings),
        store=store,
        store_motion=store_motion,
        observer=observer,
        stop=stop,
    )
    return Branch(stepper.system, direction, responses, complete)


def sort_values(values: Sequence[float] | Array, direction: Direction) -> list[float]:
    """Values in the order in which they are passed."""
    if direction not in ("up", "down"):
        raise ValueError(f"direction = {direction}; must be up or down")
    return sorted(values, reverse=direction == "down")


def continue_sweep(
    values: Sequence[float],
    point_at: Callable[[float], SweepPoint],
    settings: SteadySettings,
    *,
    settle: Settle | None = None,
    store: BranchStore | None = None,
    store_motion: StoreMotion = lambda frequency, motion: None,
    observer: Observer = NO_OBSERVER,
    stop: Stop | None = None,
) -> tuple[tuple[Response, ...], bool]:
    """Settle at stations, each from the state of the previous, until one diverges.

    point_at : function that returns the station of a value, called in turn, and again
        for the last value in the store
    settle : function that settles from one point to the next; None for
        `confirm_steady_state`
    store_motion : function called with the motion of a value that is finished
    stop : event that ends the sweep at the next call of callback; without it Stopped,
        raised by the observer, leaves no responses
    Also returns whether all values were reached.
    """

    def stoppable_callback(frequency: float, period: int) -> None:
        if stop is not None and stop.is_set():
            raise Stopped
        observer.callback(frequency, period)

    responses = [] if store is None else store.finished()
    for _ in responses:
        observer.passed()
    last_stepper = point_at(values[len(responses) - 1])[0] if responses else None
    while len(responses) < len(values) and not _diverged(responses):
        if stop is not None and stop.is_set():
            break
        stepper, frequency = point_at(values[len(responses)])
        previous_response, state = responses[-1] if responses else None, None
        if previous_response is not None and last_stepper is not None:
            state = _transfer_state(
                previous_response.state, last_stepper.system, stepper.system
            )
        try:
            response, motion, _ = (settle or confirm_steady_state)(
                stepper,
                frequency,
                settings,
                state,
                previous_response,
                stoppable_callback,
            )
            if response.status != Status.DIVERGED:
                store_motion(frequency, motion)
            if store is not None:
                store.add(response)
            responses.append(response)
            last_stepper = stepper
            observer.passed()
        except Stopped:  # of others it is no end of a branch
            if stop is None or not stop.is_set():
                raise
            break
    complete = len(responses) == len(values) and not _diverged(responses)
    return tuple(responses), complete


def _transfer_state(
    state: Any, previous_system: LumpedSystem, system: LumpedSystem
) -> Any:
    """State to continue from, unchanged if the system is the same."""
    return (
        state
        if previous_system is system
        else system.state_from(previous_system, state)
    )


def _diverged(responses: Sequence[Response]) -> bool:
    return bool(responses) and responses[-1].status == Status.DIVERGED


@check_arguments
def sweep(
    system: LumpedSystem,
    frequencies: Sequence[float] | Array,
    direction: Direction = "up",
    settings: Settings | None = None,
    *,
    observer: Observer = NO_OBSERVER,
    stop: Stop | None = None,
) -> Branch:
    """Pass through mesh frequencies [Hz] with a lumped system.

    Every speed starts from the steady state of the one before.

    Parameters
    ----------
    system : LumpedSystem
        System to solve.
    frequencies : sequence of float or (speeds,) array
        Frequencies of the first mesh [Hz], in any order.
    direction : {'up', 'down'}, optional
        Whether the speed rises or falls.
    settings : Settings, optional
        Numerical settings.
    observer : Observer, optional
        Functions called after each speed and within it.
    stop : Stop, optional
        Event that ends the sweep at the next call of the observer's callback.

    Returns
    -------
    Branch
        Responses at the speeds that were reached.

    Raises
    ------
    TrainError
        If a common period exceeds the memory allowed.
    ValueError
        If an argument is not of its type, a frequency is not positive, the direction is
        not allowed or the method does not fit the system.
    """
    settings = settings or Settings()
    stepper = stepper_of(system, settings)
    return sweep_branch(
        stepper, frequencies, direction, settings, observer=observer, stop=stop
    )


@check_arguments
def sweep_all(
    systems: Sequence[LumpedSystem],
    frequencies: Sequence[float] | Array,
    directions: Sequence[Direction] = DIRECTIONS,
    settings: Settings | None = None,
    report: Progress = silent,
    workers: int | None = None,
) -> list[Branch]:
    """Branches of every system and direction, computed on all cores.

    No result depends on the number of workers. After Ctrl-C the branches contain the
    finished speeds and are not complete.

    Parameters
    ----------
    systems : sequence of LumpedSystem
        Systems to solve.
    frequencies : sequence of float or (speeds,) array
        Frequencies of the first mesh [Hz], in any order.
    directions : sequence of {'up', 'down'}, optional
        Directions of the speed.
    settings : Settings, optional
        Numerical settings.
    report : callable, optional
        Function of (stage, done, total), called during the computation.
    workers : int, optional
        Number of threads; one a core unless given.

    Returns
    -------
    list of Branch
        A branch for every direction of the first system, then of the second, and so on.

    Raises
    ------
    TrainError
        If a common period exceeds the memory allowed.
    ValueError
        If an argument is not of its type, a frequency is not positive, a direction is
        not allowed or the method does not fit a system.
    """
    tasks = [(system, direction) for system in systems for direction in directions]
    observer = reporting_observer(report, len(tasks) * len(frequencies))
    stop = threading.Event()
    return run_in_threads(
        [
            partial(
                sweep,
                *(system, frequencies, direction, settings),
                observer=observer,
                stop=stop,
            )
            for system, direction in tasks
        ],
        stop,
        workers,
    )
