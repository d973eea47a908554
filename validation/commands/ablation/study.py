"""Contribution of each part of the coupled model for a gear set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from fegear.files.errors import InputError
from fegear.files.output import make_directory
from fegear.files.speed_ranges import written_speeds
from fegear.gearset.model import GearSet
from fegear.studies.columns import meanings
from fegear.studies.page import ColumnTable, Page, number
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.headings import edits_in_words
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.speeds import (
    refuse_both,
    rpms_setting,
    speeds_setting,
    with_frequencies,
)
from fegear.studies.trains.train_problem import refuse_edits
from lumped.common.options import Range
from lumped.figures.drawing import draw_title
from validation.study.budget import Budget, budget, budget_case, budget_values
from validation.study.budget_figure import draw_budget
from validation.study.cases import Case
from validation.study.tasks import tasks_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CORNER = "largest error against finite\nelements (change to coupled)"


@dataclass(frozen=True, kw_only=True)
class Ablation(
    Study,
    command="ablation",
    example="ablation liu-idler --torque 100 --speeds 800:4200:100",
):
    """Contribution of each part of the coupled model.

    It compares sweeps up and down by finite elements, model 1, the coupled model and
    the coupled model without each of its parts.
    """

    gear_set: GearSetRef
    speeds: tuple[float, ...] = speeds_setting(
        (),
        "Mesh frequencies of the first mesh [Hz]; a number, or several with commas, as "
        "well; this or --rpm. [default: none]",
    )
    rpm: tuple[float, ...] = rpms_setting("--speeds")
    torque: float | None = torque_setting()
    tolerance: float = setting(
        0.05,
        "Relative tolerance of peaks, forces, curves and contact loss: the "
        "cheapest model within it, with the same peaks and jumps, is recommended.",
        Range(above=0.0, most=1.0),
    )
    runs: str | None = setting(
        None,
        "Directory in which runs are stored, so that the same command resumes "
        "them. [default: none]",
        metavar="DIR",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_both(self, "speeds", "rpm")
        if not (self.speeds or self.rpm):
            speeds, rpm = display_name(self, "speeds"), display_name(self, "rpm")
            raise InputError(f"{speeds} A:B:STEP or {rpm} A:B:STEP is needed")

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError for an edit that changes nothing."""
        refuse_edits(self, {"torque": self.torque}, translations=False)
        return self.gear_set.healthy("the ablation")

    @property
    def load(self) -> float:
        """Torque on the input gear [N m]."""
        return chosen_torque(self.gears, self.torque)

    def tasks(self) -> Iterator[Task]:
        case = self._case()
        list(tasks_of(case))  # refuses a gear set that cannot be used
        yield Task("runs", partial(self._compare_models, case))

    def _case(self) -> Case:
        """The comparison of the models; InputError where there is none."""
        in_hertz: Any = with_frequencies(self, {"speeds": self.rpm})
        speeds, name = written_speeds(in_hertz.speeds), self.gear_set.name
        if self.gear_set.preloaded is not None:
            raise InputError(f"gear_set = {name}; must be a name or a path")
        load = self.load
        try:
            return budget_case(name, load, speeds, self.gear_set.edits)
        except ValueError as error:
            raise InputError(f"speeds = {speeds}; {error}") from None

    def _compare_models(self, case: Case, job: Job) -> AblationResult:
        with TemporaryDirectory() as temporary:
            store = Path(temporary) if self.runs is None else make_directory(self.runs)
            costs = budget(case, store, job.report)
        return AblationResult(self, self.gears.name, self.load, costs)


@dataclass(frozen=True, eq=False)
class AblationResult(StudyResult):
    """Errors and costs of the models against the finite elements.

    torque : on the input gear [N m]
    """

    study: Ablation
    gear_set: str
    torque: float
    budget: Budget

    @cached_property
    def summary(self) -> dict[str, Any]:
        best = self.budget.recommended(self.study.tolerance)
        return {
            "gear_set": self.gear_set,
            "torque_Nm": self.torque,
            **self.study.gear_set.entries,
            "tolerance": self.study.tolerance,
            "fe_per_speed_s": self.budget.fe_per_speed_s,
            **budget_values(self.budget),
            "recommended": None if best is None else best.label,
            "recommended_largest_error": None if best is None else best.worst,
            "warnings": list(self.budget.warnings),
        }

    @property
    def table(self) -> Table:
        """A row for every quantity and model."""
        names = (
            "quantity",
            "unit",
            "model",
            "places",
            "largest_error",
            "change_to_coupled",
        )
        rows = [
            (
                quantity["quantity"],
                quantity["unit"],
                *(model[name] for name in names[2:]),
            )
            for quantity in self.summary["quantities"]
            for model in quantity["models"]
        ]
        header = {
            "gear set": self.gear_set,
            "torque_Nm": repr(self.torque),
            **self.study.gear_set.entries,
            **meanings("ablation", "largest_error", "change_to_coupled"),
        }
        return Table(names, lambda: rows, header)

    @property
    def _title(self) -> str:
        at = f"{self.gear_set}, {self.torque:g} N m"
        changes = edits_in_words(self.study.gear_set.entries)
        return ", ".join(filter(None, [at, changes]))

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._draw_costs}

    def _draw_costs(self) -> Figure:
        figure = draw_budget(self.budget)
        draw_title(figure, f"{self._title}\ndifferences from the finite elements")
        return figure

    def page(self) -> Page:
        values = self.summary
        columns = {}
        for i, model in enumerate(values["models"]):
            cells = [_cell(quantity["models"][i]) for quantity in values["quantities"]]
            cells += [str(model["unmatched"]), number(1e3 * model["per_speed_s"], 2)]
            columns[model["model"].replace(" ", "\n")] = cells
        labels = [
            f"{quantity['quantity']} [{quantity['unit']}]"
            for quantity in values["quantities"]
        ]
        labels += ["peaks, jumps unmatched", "cost [ms a speed]"]
        yield ColumnTable(labels, columns, CORNER, self._title)
        yield f"finite elements take {1e3 * values['fe_per_speed_s']:.1f} ms a speed"
        best, allowed = values["recommended"], f"{100.0 * values['tolerance']:g} %"
        if best is None:
            yield f"no lumped model is within {allowed}: use fegear dynamics"
        else:
            error = 100.0 * values["recommended_largest_error"]
            yield (
                f"{best} is the cheapest within {allowed}: its largest error is "
                f"{error:.1f} %"
            )


def _cell(model: Mapping[str, Any]) -> str:
    """`3.1 (-2.5)`: the largest error, and what the model lacks would change."""
    if not model["places"]:
        return "-"
    error = f"{model['largest_error']:.1f}"
    if model["model"] == "coupled" or not isfinite(model["change_to_coupled"]):
        return error
    change = round(model["change_to_coupled"], 1) + 0.0  # -0 is 0
    return f"{error} ({change:+.1f})"
