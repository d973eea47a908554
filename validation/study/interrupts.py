"""Ctrl-C in work that was written to end by KeyboardInterrupt."""

from __future__ import annotations

from fegear.studies.problem import Job
from lumped.common.progress import Progress
from lumped.common.workers import Stopped


def interrupted_by(job: Job) -> Progress:
    """Progress of a task that raises KeyboardInterrupt where the run is to end."""

    def report(stage: str, done: int, total: int) -> None:
        try:
            job.report(stage, done, total)
        except Stopped:
            raise KeyboardInterrupt from None

    return report
