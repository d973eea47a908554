"""Frequency responses: settling from speed to speed, up and down, in parallel."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lumped.confirmed import respond_confirmed
from lumped.response import Response
from lumped.settings import Settings
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Direction = Literal["up", "down"]
Report = Callable[[int, int], None]  # (speeds done, of how many)


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


def sweep(
    system: LumpedSystem,
    frequencies: Sequence[float] | Array,
    direction: Direction = "up",
    settings: Settings | None = None,
    *,
    passed: Callable[[], None] = lambda: None,
    stop: threading.Event | None = None,
) -> Branch:
    """Pass through mesh frequencies [Hz], each from where the one before settled.

    The frequencies are sorted by the direction. `passed` is called after each of
    them; `stop` ends the sweep before the next.
    """
    if direction not in ("up", "down"):
        raise ValueError(f"direction must be up or down, got {direction}")
    ordered = sorted(frequencies, reverse=direction == "down")
    responses: list[Response] = []
    state = None
    for frequency in ordered:
        if stop is not None and stop.is_set():
            break
        before = responses[-1] if responses else None
        response = respond_confirmed(system, frequency, settings, state, before)[0]
        responses.append(response)
        passed()
        if response.status == "diverged":
            break
        state = response.state
    done = len(responses) == len(ordered)
    finite = all(response.status != "diverged" for response in responses)
    return Branch(system, direction, tuple(responses), done and finite)


def sweep_all(
    systems: Sequence[LumpedSystem],
    frequencies: Sequence[float] | Array,
    directions: Sequence[Direction] = ("up", "down"),
    settings: Settings | None = None,
    report: Report = lambda done, total: None,
    workers: int | None = None,
) -> list[Branch]:
    """A branch for every system and direction, in this order, on all cores.

    No result depends on the number of workers. After Ctrl-C the branches hold the
    speeds that were finished and are not complete.
    """
    tasks = [(system, direction) for system in systems for direction in directions]
    total = len(tasks) * len(frequencies)
    stop, lock, done = threading.Event(), threading.Lock(), 0

    def passed() -> None:
        nonlocal done
        with lock:
            done += 1
            report(done, total)

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        futures = [
            pool.submit(
                sweep,
                *(system, frequencies, direction, settings),
                passed=passed,
                stop=stop,
            )
            for system, direction in tasks
        ]
        try:
            return [future.result() for future in futures]
        except KeyboardInterrupt:
            stop.set()
            return [future.result() for future in futures]
