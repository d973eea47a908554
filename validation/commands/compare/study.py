"""Finite elements and closed forms of the same teeth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from fegear.boundary import mesh_index
from fegear.files.codes import with_code
from fegear.gearset.model import GearSet
from fegear.statics.settings import StaticsSettings
from fegear.studies.page import Columns, Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torque
from fegear.studies.trains.train_problem import refuse_edits
from validation.commands.compare.closed_form_comparison import (
    MeshComparison,
    compare_mesh,
)

WORDS = "quantity", "closed form"


def _number(value: float | None, form: str) -> str:
    return "none" if value is None else format(value, form)


COLUMNS: Columns = {
    "quantity": lambda row: (
        row["quantity"]
        + ("" if row["slope"] == "-" else f", {row['slope']} slope")
        + f", plane {row['plane']}"
        + ("" if row["unit"] == "-" else f" [{row['unit']}]")
    ),
    "closed form": lambda row: ": ".join(filter(None, (row["oracle"], row["note"]))),
    "finite\nelements": lambda row: _number(row["finite_elements"], ".4g"),
    "closed\nform": lambda row: _number(row["expected"], ".4g"),
    "closed form\n- FE [%]": lambda row: _number(row["per_cent"], "+.1f"),
}


@dataclass(frozen=True, kw_only=True)
class ClosedForms(Study, command="compare", example="compare liu-pair --torque 100"):
    """Finite elements compared with ISO 6336 and other closed forms.

    The others are the potential-energy method, Hertz and the twist of a ring. The
    closed forms assume teeth without profile modification or pitch error. A row
    names the plane of the finite elements, and why its closed form does not apply to
    the teeth or is reduced.
    """

    pictures = NO_PICTURES

    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    torque: float | None = setting(
        None,
        "Torque on the driving gear of the mesh [N\u00a0m]. [default: middle load case "
        "of the gear set]",
    )
    elements: StaticsSettings = group(
        SettingsGroup(kind=StaticsSettings, exposed=expose("plane"))
    )

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError for an edit that changes nothing."""
        refuse_edits(self, {"torque": self.torque}, translations=False)
        return self.gear_set.healthy("closed forms")

    @property
    def load(self) -> float:
        """Torque on the driver [N m]."""
        return chosen_torque(self.gears, self.torque, self.mesh)

    def tasks(self) -> Iterator[Task]:
        yield Task("mesh", self._compare_with_closed_forms)

    def _compare_with_closed_forms(self, job: Job) -> ClosedFormsResult:
        plane = self.elements.plane
        settings = StaticsSettings(plane=plane, estimate_error=False, root_stress=False)
        mesh = mesh_index(self.gears, self.mesh)
        comparison = compare_mesh(self.gears, mesh, self.load, settings)
        plane = settings.plane_of(self.gears)
        name = self.gears.name
        return ClosedFormsResult(self, name, self.load, plane, comparison)


@dataclass(frozen=True, eq=False)
class ClosedFormsResult(StudyResult):
    """Quantities by finite elements and by closed forms.

    torque : on the driver [N m]
    plane : state of the finite elements
    """

    study: ClosedForms
    gear_set: str
    torque: float
    plane: str
    comparison: MeshComparison

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            "gear_set": self.gear_set,
            "torque_Nm": self.torque,
            "comparisons": [
                asdict(row) | {"per_cent": row.per_cent} for row in self.comparison.rows
            ],
            "warnings": list(self.comparison.warnings),
        }

    @property
    def table(self) -> Table:
        """A row for every quantity and closed form."""
        rows = self.summary["comparisons"]
        header = {
            "gear set": self.gear_set,
            "mesh": str(self.study.mesh),
            "torque_Nm": repr(self.torque),
            "plane": self.plane,
            **self.study.gear_set.entries,
        }
        return Table.of_rows(rows, header)

    def page(self) -> Page:
        study = self.study
        title = with_code(
            "E12",
            f"{self.gear_set} mesh {study.mesh}, {self.torque:g} N m, plane "
            f"{self.plane}",
        )
        yield RowTable(self.summary["comparisons"], COLUMNS, title, WORDS)
