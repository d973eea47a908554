"""Attempts to break a model: what is promised, and what was measured.

Every attempt returns one number and the bound that it must keep; NaN keeps none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass

from lumped.common.csv_text import format_csv
from lumped.common.progress import Progress, silent


@dataclass(frozen=True)
class Trial:
    """One attempt: a promise, the figure that was measured, and its bound."""

    name: str
    expectation: str
    measured: float
    bound: float

    @property
    def passed(self) -> bool:
        return self.measured <= self.bound


Trials = Iterator[Trial]
Family = Callable[[], Trials]


def run_trials(
    families: Sequence[Family],
    report: Progress = silent,
) -> Trials:
    """All attempts, one by one."""
    for done, family in enumerate(families):
        report(family.__name__.replace("_", " "), done, len(families))
        yield from family()


def trials_csv(trials: Sequence[Trial]) -> str:
    names = ("attempt", "expectation", "measured", "bound", "passed")
    rows = ([*astuple(trial), "yes" if trial.passed else "no"] for trial in trials)
    return format_csv(names, rows)
