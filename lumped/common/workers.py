"""Work on several cores, in threads: compiled kernels release the interpreter's lock.

Tasks that are module-level functions with plain arguments may also be sent to processes
of dask.distributed, on this or other machines, with the same results.
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
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from numpy.typing import NDArray

K = TypeVar("K")
R = TypeVar("R")
Arrays = Mapping[str, NDArray[Any]]
Parts = Mapping[str, Callable[[], Arrays]]
Compute = Callable[[Parts], Mapping[str, Arrays]]
TASKS_PER_WORKER = 4  # tasks prepared ahead of each worker
SCHEDULER_TIMEOUT = 20  # seconds for a scheduler to answer


@dataclass(frozen=True)
class Cluster:
    """Worker processes of dask.distributed.

    scheduler : address of a running scheduler; if absent, one worker per core is
        started on this machine
    """

    scheduler: str = ""


class Stop(Protocol):
    """Event that tasks check in order to end early."""

    def is_set(self) -> bool: ...


class NeverStop:
    """Event that is never set, for tasks of other processes."""

    def is_set(self) -> bool:
        return False


class Stopped(Exception):
    """Raised by a task that was asked to end."""


_stop: ContextVar[Stop] = ContextVar("stop")


def set_stop(stop: Stop) -> None:
    """The event of the task that this context runs, for `require_running`."""
    _stop.set(stop)


def require_running() -> None:
    """Raise Stopped where the task of this context is to end.

    For long computations that know of no task, between their parts.
    """
    stop = _stop.get(None)
    if stop is not None and stop.is_set():
        raise Stopped


class NoClusterError(Exception):
    """Raised with the reason if a cluster cannot be used."""


def run_tasks(
    tasks: Iterable[tuple[K, Callable[[], R]]],
    store_result: Callable[[K, R], None],
    stop: threading.Event,
    workers: int | Cluster | None = None,
) -> None:
    """Run tasks and pass each result to `store_result`, in this thread, when finished.

    tasks : names and tasks, prepared in this thread, a few at a time
    store_result : function called with the name and the result of each task
    stop : event that tasks may check; if it is set from elsewhere, the work ends as
        after Ctrl-C, by Stopped
    workers : number of threads, one per core if None, or a cluster

    Ctrl-C ends the work after the tasks in progress and is raised again. Raises
    NoClusterError if a cluster cannot be used.
    """
    running: dict[Future[R], K] = {}

    def collect(max_running: int) -> None:
        while len(running) > max_running:
            if stop.is_set():
                raise Stopped
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                store_result(running.pop(future), future.result())

    with _executor(workers) as (pool, count):
        try:
            for name, task in tasks:
                running[pool.submit(task)] = name
                collect(TASKS_PER_WORKER * count)
            collect(0)
        except BaseException as error:
            stop.set()
            is_interrupt = isinstance(error, KeyboardInterrupt | Stopped)
            unfinished = [f for f in list(running) if not f.cancel() and is_interrupt]
            for future in unfinished:
                with suppress(Stopped):
                    store_result(running[future], future.result())
            raise


def compute_in_threads(
    parts: Parts, report: Callable[[int, int], None] = lambda done, total: None
) -> Mapping[str, Arrays]:
    """Compute arrays of parts by name, on all cores.

    report : function called with the number of parts done and their total number
    """
    results = dict[str, Arrays]()

    def store_result(name: str, arrays: Arrays) -> None:
        results[name] = arrays
        report(len(results), len(parts))

    run_tasks(parts.items(), store_result, threading.Event())
    return results


@contextmanager
def _executor(workers: int | Cluster | None) -> Iterator[tuple[Executor, int]]:
    """Executor of the tasks, and how many tasks it runs at a time."""
    if not isinstance(workers, Cluster):
        count = workers or os.cpu_count() or 1
        with ThreadPoolExecutor(count) as threads:
            yield threads, count
        return
    try:
        from distributed import Client, LocalCluster
    except ModuleNotFoundError:
        message = "a cluster needs dask.distributed: pip install 'fegear[cluster]'"
        raise NoClusterError(message) from None
    if workers.scheduler:
        try:
            client = Client(workers.scheduler, timeout=SCHEDULER_TIMEOUT)
        except Exception as error:  # whatever dask makes of what is no scheduler
            reason = next(iter(str(error).splitlines()), type(error).__name__)
            raise NoClusterError(f"scheduler {workers.scheduler}: {reason}") from None
        with client:
            yield client.get_executor(), sum(client.ncores().values()) or 1
        return
    settings = {"threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with (
        LocalCluster(os.cpu_count() or 1, **settings) as local_cluster,
        Client(local_cluster, set_as_default=False) as client,
    ):
        yield client.get_executor(), os.cpu_count() or 1


def run_in_threads(
    tasks: Sequence[Callable[[], R]], stop: threading.Event, workers: int | None = None
) -> list[R]:
    """Results of tasks, in their order; Ctrl-C and failures stop all.

    stop : event that the tasks check; after Ctrl-C each returns its partial result
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
