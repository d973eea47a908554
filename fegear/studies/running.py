"""Running a study: tasks on all cores, kept as they go on, taken up again."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from fegear.errors import file_error
from fegear.store import NOTHING, Checkpoint, Keeping
from fegear.studies.study import Stopped, Study, Task
from lumped.workers import run_tasks

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
    After Ctrl-C, which is raised again, records are kept where `keeping` says.
    Raises InputError for what cannot be computed or kept.
    """
    tasks, found = list(study.tasks()), dict[str, Any]()
    checkpoint = keeping.open(study.inputs) if study.resumes else None
    stop, done = threading.Event(), False
    guarded = _one_at_a_time(progress)
    try:
        work = (
            (task.key, partial(_work, task, Job(task.key, checkpoint, guarded, stop)))
            for task in tasks
        )
        run_tasks(work, found.__setitem__, stop, workers)
        done = True
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=not done)
    return study.gather({task.key: found[task.key] for task in tasks})


def _one_at_a_time(progress: Progress) -> Progress:
    lock = threading.Lock()

    def report(what: str, done: int, total: int) -> None:
        with lock:
            progress(what, done, total)

    return report


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
    progress: Progress
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
        self.progress(what, done, total)
