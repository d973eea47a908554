"""The gear sets that come with the program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from fegear.gearset import GearSet, builtin_names, load_gear_set
from fegear.studies.page import Columns, Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table

NAMES = "name", "gears", "meshes", "description"


@dataclass(frozen=True, kw_only=True)
class BuiltinSets(Study, command="sets", example="sets"):
    """List the built-in gear sets."""

    pictures = NO_PICTURES

    def tasks(self) -> Iterator[Task]:
        yield Task("sets", self._describe_sets)

    def _describe_sets(self, job: Job) -> BuiltinSetsResult:
        return BuiltinSetsResult(
            self, [load_gear_set(name) for name in builtin_names()]
        )


@dataclass(frozen=True, eq=False)
class BuiltinSetsResult(StudyResult):
    """The sets in the order of their names."""

    study: BuiltinSets
    gear_sets: list[GearSet]

    @cached_property
    def summary(self) -> dict[str, Any]:
        rows = [
            (g.name, len(g.gears), len(g.meshes), g.description) for g in self.gear_sets
        ]
        return {"gear_sets": [dict(zip(NAMES, row, strict=True)) for row in rows]}

    @property
    def table(self) -> Table:
        rows = [list(row.values()) for row in self.summary["gear_sets"]]
        return Table(NAMES, lambda: rows)

    def page(self) -> Page:
        columns: Columns = {name: partial(_shown_value, name) for name in NAMES}
        yield RowTable(
            self.summary["gear_sets"], columns, text_columns=("name", "description")
        )


def _shown_value(name: str, row: Mapping[str, Any]) -> str:
    return str(row[name])
