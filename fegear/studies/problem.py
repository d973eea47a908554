"""What a study solves: a problem, its tasks, and what serves them while they run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from lumped.common.short_repr import ShortRepr

if TYPE_CHECKING:
    from lumped.common.workers import Arrays, Cluster, Parts, Stop


class Job(Protocol):
    """Services that a task may use while it runs."""

    @property
    def records(self) -> list[Any]:
        """Values of an earlier run, in order."""

    @property
    def state(self) -> Arrays | None:
        """State at the end of the last record."""

    def add_record(self, record: Any, state: Arrays) -> None:
        """Store a value that `Encoder` can write, and the state to go on from."""

    def compute(self, stage: str, parts: Parts) -> Mapping[str, Arrays]:
        """Arrays of parts by name, on all workers; those kept are not computed again.

        With a cluster their functions are those of modules, with plain arguments.
        """

    @property
    def workers(self) -> int | Cluster | None:
        """Threads, one a core if None, or the cluster that computes parts."""

    @property
    def stop(self) -> Stop:
        """Event after which `report` raises Stopped."""

    @property
    def stop_event(self) -> Stop:
        """Event that asks parts to stop; they raise Stopped."""

    def report(self, stage: str, done: int, total: int) -> None:
        """Progress. Raises Stopped where the run is to end."""


@dataclass(frozen=True)
class Task:
    """A part of a study that depends on no other.

    key : its name in checkpoints, unique in the study
    work : computes what it gives, in any thread
    size : steps that it reports, for a bar over all tasks; 0 for a bar of its own
    n_records : records that it keeps, None for one in each step
    """

    key: str
    work: Callable[[Job], Any]
    size: int = 0
    n_records: int | None = None


class Solvable(Protocol):
    """A study, or the problem that its settings pose."""

    @property
    def inputs(self) -> Mapping[str, str]:
        """All that determines the records of a checkpoint."""

    @property
    def announcements(self) -> Iterable[str]:
        """Lines that are said before anything is computed."""

    def tasks(self) -> Iterable[Task]:
        """All parts; InputError for what cannot be computed."""

    def gather(self, results: Mapping[str, Any]) -> Any:
        """Make the result from the results of the tasks, by key."""


@dataclass(frozen=True, eq=False)
class Problem(ShortRepr):
    """Base of problems: what a study solves, with what follows from its settings."""

    study: Any

    @property
    def inputs(self) -> Mapping[str, str]:
        """All that determines the records of a checkpoint."""
        inputs: Mapping[str, str] = self.study.inputs
        return inputs

    @property
    def announcements(self) -> Iterable[str]:
        """Lines that are said before anything is computed."""
        lines: Iterable[str] = self.study.announcements
        return lines

    def tasks(self) -> Iterable[Task]:
        """All parts; InputError for what cannot be computed."""
        raise NotImplementedError

    def gather(self, results: Mapping[str, Any]) -> Any:
        """Make the result from the results of the tasks, by key."""
        (result,) = results.values()
        return result
