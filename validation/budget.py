"""What each part of the coupled model brings: an error budget of a gear set.

The gears are swept by finite elements, by Model-1, by the coupled model and by the
coupled model without each of its parts, and compared as a case of `validation.cases`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

from fegear.gearset import load_gear_set
from fegear.lumped_system import shares_a_gear
from fegear.statics import Progress
from validation.cases import Case, Model, Tolerance
from validation.metrics import METRICS
from validation.runs import CaseResult, run_case

# what a tolerance is asked of
RELATIVE = (
    *("peak_frequency", "peak_amplitude", "off_jump_distance", "peak_force"),
    "contact_loss",
)
SHOWN = (*RELATIVE, "jump_frequency", "static_deflection")
MODELS = (
    Model(number=1),
    Model(number="coupled", without=("hardening",)),
    Model(number="coupled", without=("pairs",)),
    Model(number="coupled", without=("body",)),
    Model(number="coupled", without=("meshes",)),
    Model(number="coupled"),
)


@dataclass(frozen=True)
class BudgetRow:
    """A model: the largest size of each metric against finite elements, and its cost.

    errors : by name of SHOWN, in the metric's unit; 0 where nothing is to be compared
    unmatched : peaks and jumps that only one of both has
    per_speed_s : seconds for a speed
    """

    model: str
    errors: dict[str, float]
    unmatched: int
    per_speed_s: float

    @property
    def worst(self) -> float:
        """Largest error of what a tolerance is asked of."""
        return max(self.errors[name] for name in RELATIVE)


@dataclass(frozen=True)
class Budget:
    """Rows of the models, and the cheapest that is inside the tolerance, if any.

    Inside is a model without peaks or jumps that only one of both has.
    """

    rows: tuple[BudgetRow, ...]
    fe_per_speed_s: float
    tolerance: float

    @property
    def recommended(self) -> BudgetRow | None:
        inside = [
            row
            for row in self.rows
            if row.worst <= self.tolerance and not row.unmatched
        ]
        return min(inside, key=lambda row: row.per_speed_s, default=None)


def budget(
    case: Case,
    store: Path,
    tolerance: float,
    report: Progress = lambda what, done, total: None,
) -> Budget:
    """Run what the store does not hold yet, and compare.

    case : as of `budget_case`; tolerance : relative, of peaks and curves
    """
    result = run_case(case, store, report)
    rows = tuple(_row(result, model.name) for model in case.model)
    return Budget(rows, result.per_speed_s("fe"), tolerance)


def budget_case(
    gear_set: str, torque: float, speeds: str, edits: Sequence[str] = ()
) -> Case:
    """The comparison of a gear set at a torque on the input gear [N m].

    speeds : of the first mesh [Hz], `A:B:STEP` and numbers with commas
    """
    alone = not shares_a_gear(load_gear_set(gear_set))
    models = [m for m in MODELS if not (alone and "meshes" in m.without)]
    reason = "the tolerance is judged by the budget itself"
    names = [*SHOWN, "peaks_unmatched", "jumps_unmatched"]
    return Case(
        name="budget",
        title=f"Error budget of {gear_set}",
        gear_set=gear_set,
        torques_Nm=(torque,),
        speeds_Hz=speeds,
        edits=tuple(edits),
        model=tuple(models),
        metric=tuple(Tolerance(name=n, allowed=0.0, reason=reason) for n in names),
    )


def _row(result: CaseResult, model: str) -> BudgetRow:
    own = [each for each in result.verdicts if each.model == model]

    def largest(metric: str) -> float:
        sizes = [abs(each.measured) for each in own if each.metric == metric]
        return max((size if size == size else inf for size in sizes), default=0.0)

    unmatched = sum(
        int(each.measured) for each in own if each.metric.endswith("_unmatched")
    )
    errors = {name: largest(name) for name in SHOWN}
    return BudgetRow(model, errors, unmatched, result.per_speed_s(model))


def units() -> dict[str, str]:
    """Of the metrics shown."""
    return {name: METRICS[name].unit for name in SHOWN}
