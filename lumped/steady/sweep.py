"""Frequency responses: settling from speed to speed, up and down, in parallel."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from lumped.common.checks import checked
from lumped.common.progress import Progress, silent
from lumped.common.workers import Stop, Stopped, run_together
from lumped.steady.response import Response, Status
from lumped.steady.settings import Settings, SteadySettings
from lumped.steady.steady_state import Stepper, Watch, confirmed
from lumped.steady.steppers import stepper_of
from lumped.train.system import LumpedSystem

Array = NDArray[np.float64]
Direction = Literal["up", "down"]
BOTH: tuple[Direction, ...] = ("up", "down")
Keep = Callable[[float, Any], None]  # (frequency [Hz], what was recorded there)
Station = tuple[Stepper, float]  # and the frequency of the first mesh [Hz]
Settle = Callable[..., tuple[Response, Any, Any]]  # as `confirmed`
REFRESH = 0.2  # s between reports from within a speed


@dataclass(frozen=True, eq=False)
class Branch:
    """Responses in the order in which the speeds were passed.

    complete : whether all speeds were reached; a divergence ends a branch
    """

    system: LumpedSystem
    direction: Direction
    responses: tuple[Response, ...]
    complete: bool

    @property
    def frequency_Hz(self) -> Array:
        return np.array([response.frequency for response in self.responses])

    def column(self, name: str) -> Array:
        """A figure of all responses (speeds, m), such as dte_rms."""
        return np.array([getattr(response, name) for response in self.responses])


@dataclass(frozen=True)
class Observer:
    """Is told how a sweep goes on: `passed` after each speed, `watch` within it.

    watch : with frequency [Hz] and period, see `steady_state`
    """

    passed: Callable[[], None] = lambda: None
    watch: Watch = lambda frequency, period: None


SILENT = Observer()


def reporting(report: Progress, total: int) -> Observer:
    """Reports the speeds that are done, of `total`, and how one goes on that lasts."""
    lock, done, shown = threading.Lock(), 0, time.perf_counter()

    def passed() -> None:
        nonlocal done
        with lock:
            done += 1
            report("sweep", done, total)

    def watch(frequency: float, period: int) -> None:
        nonlocal shown
        now = time.perf_counter()
        if now - shown > REFRESH:
            shown = now
            report(f"{frequency:g} Hz, period {period}", done, total)

    return Observer(passed, watch)


class BranchStore(Protocol):
    """Storage of the finished speeds of a branch."""

    def finished(self) -> list[Response]:
        """In the order in which they were passed; the last with its state."""

    def add(self, response: Response) -> None:
        """Keep a response with its state."""


def sweep_branch(
    stepper: Stepper,
    frequencies: Sequence[float] | Array,
    direction: Direction,
    settings: SteadySettings,
    *,
    store: BranchStore | None = None,
    keep: Keep = lambda frequency, motion: None,
    observer: Observer = SILENT,
    stop: Stop | None = None,
) -> Branch:
    """Pass through mesh frequencies [Hz], each from where the one before settled.

    The frequencies are sorted by the direction. For the rest see `settle_in_turn`.
    """
    ordered = in_order(frequencies, direction)
    responses, complete = settle_in_turn(
        *(ordered, lambda frequency: (stepper, frequency), settings),
        store=store,
        keep=keep,
        observer=observer,
        stop=stop,
    )
    return Branch(stepper.system, direction, responses, complete)


def in_order(values: Sequence[float] | Array, direction: Direction) -> list[float]:
    """Values as they are passed."""
    if direction not in ("up", "down"):
        raise ValueError(f"direction must be up or down, got {direction}")
    return sorted(values, reverse=direction == "down")


def settle_in_turn(
    values: Sequence[float],
    station: Callable[[float], Station],
    settings: SteadySettings,
    *,
    settle: Settle | None = None,
    store: BranchStore | None = None,
    keep: Keep = lambda frequency, motion: None,
    observer: Observer = SILENT,
    stop: Stop | None = None,
) -> tuple[tuple[Response, ...], bool]:
    """Settle at stations, each from where the one before did; a divergence ends it.

    station : of a value, called in turn; that of the last value in the store once more
    settle : from one to the next, as `confirmed` where it is None
    keep : called with the motion of a value before it counts as finished
    stop : ends the sweep as soon as the motion is watched
    Also returns whether all values were reached.
    """

    def watched(frequency: float, period: int) -> None:
        if stop is not None and stop.is_set():
            raise Stopped
        observer.watch(frequency, period)

    responses = [] if store is None else store.finished()
    for _ in responses:
        observer.passed()
    last = station(values[len(responses) - 1])[0] if responses else None
    while len(responses) < len(values) and not _diverged(responses):
        if stop is not None and stop.is_set():
            break
        stepper, frequency = station(values[len(responses)])
        before, state = responses[-1] if responses else None, None
        if before is not None and last is not None:
            state = _passed_on(before.state, last.system, stepper.system)
        try:
            response, motion, _ = (settle or confirmed)(
                stepper, frequency, settings, state, before, watched
            )
            if response.status != Status.DIVERGED:
                keep(frequency, motion)
            if store is not None:
                store.add(response)
            responses.append(response)
            last = stepper
            observer.passed()
        except Stopped:
            break
    complete = len(responses) == len(values) and not _diverged(responses)
    return tuple(responses), complete


def _passed_on(state: Any, before: LumpedSystem, after: LumpedSystem) -> Any:
    """A state to go on from, that of a stepper's own system as it is."""
    return state if before is after else after.state_from(before, state)


def _diverged(responses: Sequence[Response]) -> bool:
    return bool(responses) and responses[-1].status == Status.DIVERGED


@checked
def sweep(
    system: LumpedSystem,
    frequencies: Sequence[float] | Array,
    direction: Direction = "up",
    settings: Settings | None = None,
    *,
    observer: Observer = SILENT,
    stop: Stop | None = None,
) -> Branch:
    """Sweep a lumped system as `sweep_branch` does."""
    settings = settings or Settings()
    stepper = stepper_of(system, settings)
    return sweep_branch(
        stepper, frequencies, direction, settings, observer=observer, stop=stop
    )


@checked
def sweep_all(
    systems: Sequence[LumpedSystem],
    frequencies: Sequence[float] | Array,
    directions: Sequence[Direction] = BOTH,
    settings: Settings | None = None,
    report: Progress = silent,
    workers: int | None = None,
) -> list[Branch]:
    """A branch for every system and direction, in this order, on all cores.

    No result depends on the number of workers. After Ctrl-C the branches hold the
    speeds that were finished and are not complete.
    """
    tasks = [(system, direction) for system in systems for direction in directions]
    observer = reporting(report, len(tasks) * len(frequencies))
    stop = threading.Event()
    return run_together(
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
