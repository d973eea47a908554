"""Work on several cores, in threads: compiled kernels let go of the interpreter.

Tasks that are functions of modules with plain arguments may also go to the processes of
dask.distributed, here or on other machines, with the same results.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from numpy.typing import NDArray

K = TypeVar("K")
R = TypeVar("R")
Arrays = Mapping[str, NDArray[Any]]
Parts = Mapping[str, Callable[[], Arrays]]
Compute = Callable[[Parts], Mapping[str, Arrays]]
QUEUE = 4  # tasks prepared ahead of each worker
PATIENCE = 20  # seconds for a scheduler to answer


@dataclass(frozen=True)
class Cluster:
    """Worker processes of dask.distributed.

    scheduler : address of one that runs; else one worker a core is started here
    """

    scheduler: str = ""


class Stop(Protocol):
    """What tasks look at to end early."""

    def is_set(self) -> bool: ...


class Never:
    """An event that is never set: what tasks of other processes heed."""

    def is_set(self) -> bool:
        return False


class Stopped(Exception):
    """A task that was asked to end."""


class NoClusterError(Exception):
    """A cluster that cannot be used, and why."""


def run_tasks(
    tasks: Iterable[tuple[K, Callable[[], R]]],
    take: Callable[[K, R], None],
    stop: threading.Event,
    workers: int | Cluster | None = None,
) -> None:
    """Run tasks and hand over what each gives, in this thread, as it is finished.

    tasks : with the name of each, prepared in this thread, a few at a time
    stop : an event that tasks may heed; where it is set from elsewhere the work ends
        as after Ctrl-C, by Stopped
    workers : threads, one a core if None, or a cluster

    Ctrl-C ends the work after the tasks that are under way and is raised again.
    Raises NoClusterError where a cluster cannot be used.
    """
    running: dict[Future[R], K] = {}

    def collect(most: int) -> None:
        while len(running) > most:
            if stop.is_set():
                raise Stopped
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                take(running.pop(future), future.result())

    with _executor(workers) as (pool, count):
        try:
            for name, task in tasks:
                running[pool.submit(task)] = name
                collect(QUEUE * count)
            collect(0)
        except BaseException as error:
            stop.set()
            kept = isinstance(error, KeyboardInterrupt | Stopped)
            unfinished = [f for f in list(running) if not f.cancel() and kept]
            for future in unfinished:
                with suppress(Stopped):
                    take(running[future], future.result())
            raise


def in_threads(
    parts: Parts, report: Callable[[int, int], None] = lambda done, total: None
) -> Mapping[str, Arrays]:
    """Compute arrays of parts by name, on all cores; report : parts done, of all."""
    found = dict[str, Arrays]()

    def take(name: str, arrays: Arrays) -> None:
        found[name] = arrays
        report(len(found), len(parts))

    run_tasks(parts.items(), take, threading.Event())
    return found


@contextmanager
def _executor(workers: int | Cluster | None) -> Iterator[tuple[Executor, int]]:
    """What runs tasks, and how many at a time."""
    if not isinstance(workers, Cluster):
        count = workers or os.cpu_count() or 1
        with ThreadPoolExecutor(count) as threads:
            yield threads, count
        return
    try:
        from distributed import Client, LocalCluster
    except ModuleNotFoundError:
        words = "a cluster needs dask.distributed: pip install 'fegear[cluster]'"
        raise NoClusterError(words) from None
    if workers.scheduler:
        try:
            client = Client(workers.scheduler, timeout=PATIENCE)
        except (OSError, ValueError, TypeError) as error:
            reason = str(error).splitlines()[0]
            raise NoClusterError(f"scheduler {workers.scheduler}: {reason}") from None
        with client:
            yield client.get_executor(), sum(client.ncores().values()) or 1
        return
    settings = {"threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with (
        LocalCluster(os.cpu_count() or 1, **settings) as here,
        Client(here, set_as_default=False) as client,
    ):
        yield client.get_executor(), os.cpu_count() or 1


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
