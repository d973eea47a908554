"""Run the tasks of a study in parallel, with checkpoints."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext, suppress
from contextvars import copy_context
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from fegear.boundary import public
from fegear.files.errors import InputError, NoResultError
from fegear.files.store import (
    NO_CHECKPOINT,
    RECORDS_FORMAT,
    Checkpoint,
    CheckpointOptions,
    Records,
)
from fegear.files.version import package_version
from fegear.studies.problem import Solvable, Task
from fegear.studies.study import Study
from lumped.common.checks import require_between
from lumped.common.progress import Progress, silent
from lumped.common.workers import (
    Cluster,
    NeverStop,
    NoClusterError,
    Stop,
    Stopped,
    run_tasks,
    set_stop,
)

if TYPE_CHECKING:
    from lumped.common.workers import Arrays, Parts

MAX_THREADS = 1000


@public
def run(
    study: Study,
    checkpoint_options: CheckpointOptions = NO_CHECKPOINT,
    progress: Progress = silent,
    workers: int | Cluster | None = None,
    deliver: Callable[[Any], None] | None = None,
    notify: Callable[[str], None] = lambda message: None,
) -> Any:
    """The result of a study.

    Parameters
    ----------
    study : Study
        Study to run, such as `fegear.Sweep`.
    checkpoint_options : CheckpointOptions, optional
        Where records of tasks are stored, and whether stored ones of an earlier run are
        used; nothing is stored unless it says so.
    progress : callable, optional
        Function of (stage, done, total), called during the run.
    workers : int or Cluster, optional
        Number of threads, one a core unless given, or a cluster for the parts of tasks.
    deliver : callable, optional
        Function called with the result, to write its files. Records in a checkpoint are
        removed after it, and stay if it fails.
    notify : callable, optional
        Function called with each line that is said before anything is computed:
        warnings of the gear set, what takes long, and what a checkpoint holds.

    Returns
    -------
    StudyResult
        Result of the study. After Ctrl-C it holds what is finished, if the study allows
        that.

    Raises
    ------
    InputError
        If something cannot be computed or stored.
    ValueError
        If `workers` is not an allowed number or another argument is not of its type.
    KeyboardInterrupt
        After Ctrl-C, if the study cannot return a part of its result.
    """
    if not isinstance(workers, Cluster | None):
        require_between("workers", workers, 1, MAX_THREADS)
    progress("preparation", 0, 1)
    problem = study.prepare()
    tasks, results = list(problem.tasks()), dict[str, Any]()
    for line in problem.announcements:
        notify(line)
    checkpoint = None
    if study.resumes:
        checkpoint = _opened_checkpoint(
            problem, tasks, checkpoint_options, study.unit, notify
        )
    stop, done = threading.Event(), False
    board = TaskProgress(progress, {task.key: task.size for task in tasks})
    threads = None if isinstance(workers, Cluster) else workers
    try:
        arguments = board, stop, workers
        work = (
            (task.key, _in_context(_work, task, Job(checkpoint, task.key, *arguments)))
            for task in tasks
        )

        def store_result(key: str, value: Any) -> None:
            results[key] = value
            board.finish(key, f"{study.unit}s")

        with suppress(KeyboardInterrupt) if study.partial else nullcontext():
            run_tasks(work, store_result, stop, threads)
        result = problem.gather({task.key: results.get(task.key) for task in tasks})
        if result is None:  # of a task that had not begun
            raise KeyboardInterrupt
        if deliver is not None:
            deliver(result)
        done = result.complete
    except NoResultError:
        done = True  # another command with the same output is not held up
        raise
    except NoClusterError as error:
        raise InputError(str(error)) from None
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=not done and checkpoint.has_records)
    return result


def _opened_checkpoint(
    problem: Solvable,
    tasks: Sequence[Task],
    checkpoint_options: CheckpointOptions,
    unit: str,
    notify: Callable[[str], None],
) -> Checkpoint | None:
    """The checkpoint of a problem; says what was finished where it is taken up."""
    checkpoint = checkpoint_options.open(
        {
            **problem.inputs,
            "version": package_version(),
            "format of records": RECORDS_FORMAT,
        },
        notify,
    )
    if (
        checkpoint is not None
        and checkpoint_options.resume
        and checkpoint.has_previous_run
    ):
        checkpoint.report_resumed(
            [task.key for task in tasks],
            sum(t.size if t.n_records is None else t.n_records for t in tasks),
            notify,
            unit,
        )
    return checkpoint


@dataclass
class TaskProgress:
    """Progress of all tasks; those that have a size are counted together."""

    show: Progress
    sizes: Mapping[str, int]
    done: dict[str, int] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def report(self, key: str, stage: str, done: int, total: int) -> None:
        with self.lock:
            if self.sizes[key]:
                self.done[key] = done
                done, total = sum(self.done.values()), sum(self.sizes.values())
            self.show(stage, done, total)

    def finish(self, key: str, stage: str) -> None:
        """A task with a size is done."""
        if self.sizes[key]:
            self.report(key, stage, self.sizes[key], 0)


def _in_context(function: Callable[..., Any], *args: Any) -> Callable[[], Any]:
    """A call in another thread that names settings in messages as this one does."""
    return partial(copy_context().run, function, *args)


def _work(task: Task, job: Job) -> Any:
    set_stop(job.stop)
    try:
        return task.work(job)
    except Stopped:
        return None


@dataclass
class Job(Records):
    """What a task may use, see `fegear.studies.problem.Job`."""

    board: TaskProgress
    stop: threading.Event
    workers: int | Cluster | None

    @property
    def stop_event(self) -> Stop:
        """Event that asks parts to stop; those of a cluster cannot."""
        return NeverStop() if isinstance(self.workers, Cluster) else self.stop

    @cached_property
    def parts(self) -> dict[str, Arrays]:
        """Finished parts, by name."""
        return {} if self.checkpoint is None else {**self.checkpoint.parts(self.key)}

    def compute(self, stage: str, parts: Parts) -> Mapping[str, Arrays]:
        left = ((name, parts[name]) for name in parts if name not in self.parts)
        total = len(self.parts.keys() | parts.keys())

        def store_result(name: str, arrays: Arrays) -> None:
            self.parts[name] = arrays
            Records(self.checkpoint, f"{self.key}/{name}").add_record({}, arrays)
            self.board.report(self.key, stage, len(self.parts), total)

        run_tasks(left, store_result, self.stop, self.workers)
        return {name: self.parts[name] for name in parts}

    def report(self, stage: str, done: int, total: int) -> None:
        if self.stop.is_set():
            raise Stopped
        self.board.report(self.key, stage, done, total)
