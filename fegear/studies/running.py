"""Running a study: tasks on all cores, kept as they go on, taken up again."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from fegear.errors import file_error
from fegear.store import NOTHING, Checkpoint, Keeping
from fegear.studies.study import Study, Task
from lumped.workers import Stopped, run_tasks

if TYPE_CHECKING:
    from fegear.studies.study import Arrays

Progress = Callable[[str, int, int], None]  # (what, done, of how many)


def silent(what: str, done: int, total: int) -> None:
    """Progress that is not shown."""


def run(
    study: Study,
    keeping: Keeping = NOTHING,
    progress: Progress = silent,
    workers: int | None = None,
) -> Any:
    """The result of a study.

    keeping : where tasks keep their records, and whether kept ones are taken up
    workers : threads, one a core by default
    After Ctrl-C the result of some studies holds what was finished and is not
    complete; of others it is raised again. Records are kept where `keeping` says.
    Raises InputError for what cannot be computed or kept.
    """
    progress("preparation", 0, 1)
    tasks, found = list(study.tasks()), dict[str, Any]()
    checkpoint = keeping.open(study.inputs) if study.resumes else None
    stop, done = threading.Event(), False
    board = Board(progress, {task.key: task.size for task in tasks})
    try:
        work = (
            (task.key, partial(_work, task, Job(task.key, checkpoint, board, stop)))
            for task in tasks
        )
        with suppress(KeyboardInterrupt) if study.partial else nullcontext():
            run_tasks(work, found.__setitem__, stop, workers)
        result = study.gather({task.key: found.get(task.key) for task in tasks})
        done = result.complete
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=not done)
    return result


@dataclass
class Board:
    """Progress of all tasks; those that have a size are counted together."""

    show: Progress
    sizes: Mapping[str, int]
    done: dict[str, int] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def report(self, key: str, what: str, done: int, total: int) -> None:
        with self.lock:
            if self.sizes[key]:
                self.done[key] = done
                done, total = sum(self.done.values()), sum(self.sizes.values())
            self.show(what, done, total)


def _work(task: Task, job: Job) -> Any:
    try:
        return task.work(job)
    except Stopped:
        return None


@dataclass
class Job:
    """Of one task, see `fegear.studies.study.Job`."""

    key: str
    checkpoint: Checkpoint | None
    board: Board
    stop: threading.Event

    def __post_init__(self) -> None:
        kept = self.checkpoint
        self.kept: list[Any] = [] if kept is None else kept.finished(self.key)
        self.state: Arrays | None = None if kept is None else kept.state(self.key)

    def keep(self, record: Mapping[str, Any], state: Arrays) -> None:
        if self.checkpoint is None:
            return
        try:
            self.checkpoint.add(self.key, record, state)
        except OSError as error:
            raise file_error(self.checkpoint.path, "written", error) from None

    def report(self, what: str, done: int, total: int) -> None:
        if self.stop.is_set():
            raise Stopped
        self.board.report(self.key, what, done, total)
