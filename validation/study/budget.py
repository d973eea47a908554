"""What each part of the coupled model contributes: an error budget of a gear set.

From Model-1 over the coupled model without each of its parts to the coupled model, all
against the finite elements, with the metrics of `validation.study.metrics`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from typing import Any

from lumped.common.checks import require_present
from lumped.common.progress import Progress, silent
from validation.study.cases import LADDER, Case, Model
from validation.study.metrics import FE
from validation.study.run_files import Run
from validation.study.runs import CaseResult, measures, run_case, warnings_of

MODEL_1, COUPLED_MODEL = LADDER
WITHOUT_PREFIX = f"{COUPLED_MODEL}-without-"


@dataclass(frozen=True)
class Quantity:
    """A metric as a budget shows it: what it is called, unit, and factor to the unit.

    relative : whether a tolerance is asked of it
    """

    label: str
    unit: str = "%"
    factor: float = 100.0
    relative: bool = True


QUANTITIES: Mapping[str, Quantity] = {
    "peak_frequency": Quantity("peak frequency"),
    "peak_amplitude": Quantity("peak amplitude"),
    "off_jump_distance": Quantity("curve off jumps"),
    "peak_force": Quantity("peak force"),
    "contact_loss": Quantity("contact loss", "% of time"),
    "jump_frequency": Quantity("jump", "Hz", 1.0, relative=False),
    "static_deflection": Quantity("static vibration", relative=False),
}
PER_FEATURE_METRICS = (
    "peak_frequency",
    "peak_amplitude",
    "jump_frequency",
)  # of each one


@dataclass(frozen=True)
class BudgetRow:
    """A model against the finite elements, and its cost.

    measured : by name of QUANTITIES and place, in the metric's unit
    unmatched : peaks and jumps that only one of both has
    per_speed_s : seconds for a speed
    """

    model: str
    measured: Mapping[str, Mapping[str, float]]
    unmatched: int
    per_speed_s: float

    @property
    def label(self) -> str:
        """Such as `model 1`, `without body` or `coupled`."""
        if self.model.startswith(WITHOUT_PREFIX):
            return f"without {self.model.removeprefix(WITHOUT_PREFIX)}"
        return "coupled" if self.model == COUPLED_MODEL else "model 1"

    def largest(self, name: str) -> float:
        """Largest size of a metric; NaN where there is none, inf where one is NaN."""
        sizes = [abs(value) for value in self.measured[name].values()]
        return max((s if s == s else inf for s in sizes), default=nan)

    @property
    def worst(self) -> float:
        """Largest relative error, of those that are there."""
        relative_names = [
            name for name, quantity in QUANTITIES.items() if quantity.relative
        ]
        errors = [self.largest(name) for name in relative_names if self.measured[name]]
        return max(errors, default=nan)


@dataclass(frozen=True)
class Budget:
    """Rows of the models from Model-1 to the coupled one.

    warnings : where the coupled model leaves out too much, or values cannot be physical
    """

    rows: tuple[BudgetRow, ...]
    fe_per_speed_s: float
    warnings: tuple[str, ...] = ()

    def recommended(self, tolerance: float) -> BudgetRow | None:
        """The cheapest model inside a relative tolerance, if any.

        Inside is a model without peaks or jumps that only one of both has.
        """
        inside = [r for r in self.rows if r.worst <= tolerance and not r.unmatched]
        return min(inside, key=lambda row: row.per_speed_s, default=None)

    def change_to_coupled(self, row: BudgetRow) -> dict[str, float]:
        """Mean change of the measured values when the part that the row lacks is added.

        From the row to the coupled model, on the mean of the places that both have; NaN
        where there is none. Distances that fall are negative.
        """
        coupled_row = next(
            candidate for candidate in self.rows if candidate.model == COUPLED_MODEL
        )
        mean_changes = {}
        for name, row_values in row.measured.items():
            coupled_values = coupled_row.measured[name]
            changes = [
                coupled_values[at] - row_values[at]
                for at in row_values
                if at in coupled_values
            ]
            mean_changes[name] = sum(changes) / len(changes) if changes else nan
        return mean_changes


def budget_of(result: CaseResult) -> Budget | None:
    """That of a case, None where it lacks Model-1, the coupled model, or speeds."""
    if not (set(LADDER) <= set(result.models) and result.case.speeds):
        return None
    parts = [run.source for run in result.runs if run.source.startswith(WITHOUT_PREFIX)]
    models = (MODEL_1, *dict.fromkeys(parts), COUPLED_MODEL)
    return Budget(
        rows=tuple(_row(result, model) for model in models),
        fe_per_speed_s=result.per_speed_s(FE),
        warnings=tuple(warnings_of(result)),
    )


def budget(case: Case, store: Path, report: Progress = silent) -> Budget:
    """Run what the store does not hold yet, and compare; case : of `budget_case`."""
    return require_present(budget_of(run_case(case, store, report)), "error budget")


def budget_case(
    gear_set: str, torque: float, speeds: str, edits: Sequence[str] = ()
) -> Case:
    """The comparison of a gear set at a torque on the input gear [N m].

    speeds : of the first mesh [Hz], `A:B:STEP` and numbers with commas
    edits : of the gear set, KEY=VALUE
    """
    return Case(
        name="budget",
        title=f"Error budget of {gear_set}",
        gear_set=gear_set,
        torques_Nm=(torque,),
        speeds_Hz=speeds,
        edits=tuple(edits),
        model=(Model(number=1), Model(number="coupled")),
        metric=(),
        ablation=True,
    )


def budget_values(budget: Budget | None) -> dict[str, Any]:
    """Models and quantities of a budget as plain values.

    change_to_coupled : what changes on the mean from the model to the coupled one
    """
    if budget is None:
        return {}
    changes = [budget.change_to_coupled(row) for row in budget.rows]
    return {
        "models": [
            {
                "model": row.label,
                "unmatched": row.unmatched,
                "per_speed_s": row.per_speed_s,
            }
            for row in budget.rows
        ],
        "quantities": [
            {
                "quantity": quantity.label,
                "unit": quantity.unit,
                "models": [
                    {
                        "model": row.label,
                        "places": len(row.measured[name]),
                        "largest_error": quantity.factor * row.largest(name),
                        "change_to_coupled": round(quantity.factor * change[name], 9),
                    }
                    for row, change in zip(budget.rows, changes, strict=True)
                ],
            }
            for name, quantity in QUANTITIES.items()
        ],
    }


def _row(result: CaseResult, model: str) -> BudgetRow:
    references = {run.torque: run for run in result.of(FE)}
    measured: dict[str, dict[str, float]] = {name: {} for name in QUANTITIES}
    unmatched = 0
    for run in result.of(model):
        for name, place, value in _metrics_by_place(references[run.torque], run):
            if name in measured:
                measured[name][place] = value
            elif name.endswith("_unmatched"):
                unmatched += int(value)
    return BudgetRow(model, measured, unmatched, result.per_speed_s(model))


def _metrics_by_place(
    reference: Run, model_run: Run
) -> Iterator[tuple[str, str, float]]:
    """Metrics with places that all models share: each peak and jump has its own."""
    for where, (name, place, value) in measures(reference, model_run):
        yield name, f"{where}, {place}" if name in PER_FEATURE_METRICS else where, value
