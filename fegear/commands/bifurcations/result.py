"""The result of `fegear bifurcations`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, cell, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.headings import edits_in_words
from fegear.studies.trains.train_problem import TrainFacts
from lumped.attractors.attractor_sweeps import AttractorBranch, AttractorInterval
from lumped.branches.motions import SpeedFamily
from lumped.figures.attractor_plots import draw_attractors
from lumped.figures.map_plots import axis_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    *("direction", "mesh", "section", "dte_m", "dte_rate_m_per_s", "motion"),
    *("period_multiple", "lyapunov_per_period", "lyapunov_stderr_per_period"),
)


@dataclass(frozen=True, eq=False)
class BifurcationsResult(StudyResult):
    """Attractors over a parameter."""

    study: Any
    facts: TrainFacts
    branches: tuple[AttractorBranch, ...]

    @property
    def complete(self) -> bool:
        return all(branch.complete for branch in self.branches)

    @property
    def empty(self) -> bool:
        return not any(branch.values for branch in self.branches)

    @property
    def failure(self) -> str:
        """Message with the values at which motions diverged."""
        name = self.study.over.name
        return "; ".join(
            f"the motion diverged at {name} = {b.values[-1]:.12g}, {b.direction}"
            for b in self.branches
            if b.attractors and b.attractors[-1].kind == "diverged"
        )

    @property
    def table(self) -> Table:
        """A row for each value, mesh and point of its section."""
        names = (self.study.over.name, *COLUMNS)
        legend = meanings("bifurcations", *COLUMNS)
        table = Table(names, self._rows, {**self.facts.header, **legend})
        return self.facts.with_driver_speed(table)

    def _rows(self) -> Iterator[list[object]]:
        for branch in self.branches:
            for value, attractor in zip(branch.values, branch.attractors, strict=True):
                last = (
                    attractor.kind,
                    attractor.multiple,
                    attractor.exponent,
                    attractor.stderr,
                )
                for (k, m), error in np.ndenumerate(attractor.deflection):
                    rate = float(attractor.rate[k, m])
                    point = branch.direction, m + 1, k + 1, float(error), rate
                    yield [value, *point, *last]

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            **self.facts.summary,
            "values": len(self.study.over.values),
            "branches": [_branch_values(branch) for branch in self.branches],
            "warnings": list(self.facts.warnings),
        }

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._diagram}

    def _diagram(self) -> Figure:
        study = self.study
        label = SpeedFamily.label if study.over_speed else axis_label(study.over.name)
        changes = edits_in_words(self.facts.header)
        title = f"{self.facts.title}\n{changes}".strip()
        return draw_attractors(self.branches, label, title)

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self.facts.title
        for branch in values["branches"]:
            done = pluralize(branch["finished_values"], "value")
            trend = "rising" if branch["direction"] == "up" else "falling"
            title = f"{values['over']}, {done}, {trend}"
            columns = ("motion", "begins by")
            yield RowTable(branch["stretches"], STRETCH, title, columns)
            if not branch["complete"]:
                yield f"ended after {done} of {values['values']}"


STRETCH: Columns = {
    "from": lambda row: f"{row['first']:.6g}",
    "to": lambda row: f"{row['last']:.6g}",
    "motion": lambda row: str(row["motion"]),
    "largest exponent\n[1/period]": cell("largest_lyapunov_per_period", 3),
    "begins by": lambda row: str(row["begins_by"]),
}


def _branch_values(branch: AttractorBranch) -> dict[str, Any]:
    return {
        "direction": branch.direction,
        "complete": branch.complete,
        "finished_values": len(branch.values),
        "stretches": [_plain_stretch(interval) for interval in branch.intervals],
    }


def _plain_stretch(stretch: AttractorInterval) -> dict[str, Any]:
    return {
        "first": stretch.first,
        "last": stretch.last,
        "motion": stretch.name,
        "begins_by": stretch.transition,
        "largest_lyapunov_per_period": stretch.exponent,
    }
