"""Work on several cores, in threads: compiled kernels let go of the interpreter."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TypeVar

K = TypeVar("K")
R = TypeVar("R")
QUEUE = 4  # tasks prepared ahead of each worker


def run_tasks(
    tasks: Iterable[tuple[K, Callable[[], R]]],
    take: Callable[[K, R], None],
    stop: threading.Event,
    workers: int | None = None,
) -> None:
    """Run tasks and hand over what each gives, in this thread, as it is finished.

    tasks : with the name of each, prepared in this thread, a few at a time
    stop : an event that tasks may heed

    Ctrl-C ends the work after the tasks that are under way and is raised again.
    """
    count = workers or os.cpu_count() or 1
    running: dict[Future[R], K] = {}

    def collect(most: int) -> None:
        while len(running) > most:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                take(running.pop(future), future.result())

    with ThreadPoolExecutor(count) as pool:
        try:
            for name, task in tasks:
                running[pool.submit(task)] = name
                collect(QUEUE * count)
            collect(0)
        except BaseException as error:
            stop.set()
            for future, name in list(running.items()):
                if not future.cancel() and isinstance(error, KeyboardInterrupt):
                    take(name, future.result())
            raise


def run_together(
    tasks: Sequence[Callable[[], R]], stop: threading.Event, workers: int | None = None
) -> list[R]:
    """What tasks give, in their order; Ctrl-C and failures stop all.

    stop : an event that the tasks heed: after Ctrl-C each gives what it has
    """
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        futures = [pool.submit(task) for task in tasks]
        try:
            return [future.result() for future in futures]
        except KeyboardInterrupt:
            stop.set()
            return [future.result() for future in futures]
        except BaseException:
            stop.set()
            raise
