"""Error budgets: what is recommended, and a small one from the gear set to the rows."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from fegear.files.errors import InputError
from lumped.train.coupled import COMPONENTS
from validation.study.budget import (
    QUANTITIES,
    Budget,
    BudgetRow,
    budget,
    budget_case,
    budget_of,
    budget_values,
)
from validation.study.budget_figure import draw_budget
from validation.study.cases import Part, load_case, read_case
from validation.study.runs import run_case
from validation.study.tasks import parts_of, tasks_of

pytestmark = pytest.mark.slow

PARTS = "hardening", "pairs", "body", "modes"  # of gears without an idler


def row(model, error, cost, unmatched=0):
    measured = {name: {"here": error} for name in QUANTITIES}
    return BudgetRow(model, measured, unmatched, cost)


def recommended(tolerance, *rows):
    best = Budget(rows, 0.1).recommended(tolerance)
    return None if best is None else best.model


@pytest.mark.parametrize(
    ("tolerance", "expected"),
    [(0.2, "cheap"), (0.05, "dear"), (0.001, None)],
)
def test_the_cheapest_inside_the_tolerance_is_recommended(tolerance, expected):
    rows = row("cheap", -0.1, 1e-3), row("dear", 0.01, 5e-3), row("dearest", 0.0, 1e-2)
    assert recommended(tolerance, *rows[:2]) == expected
    assert recommended(0.001, *rows) == "dearest"


def test_peaks_and_jumps_must_be_matched():
    assert recommended(0.05, row("one", 0.0, 1.0, unmatched=1)) is None


def test_a_model_that_failed_is_never_recommended():
    assert recommended(1.0, row("failed", math.nan, 1e-6)) is None
    assert row("failed", math.nan, 1.0).largest("peak_force") == math.inf


def test_only_relative_errors_are_held_against_the_tolerance():
    one = row("one", 0.01, 1.0)
    one = replace(one, measured={**one.measured, "jump_frequency": {"here": 60.0}})
    assert one.worst == 0.01
    assert math.isnan(BudgetRow("none", {n: {} for n in QUANTITIES}, 0, 1.0).worst)


def test_what_a_part_brings_is_told_on_places_that_both_have():
    measured = {name: {} for name in QUANTITIES}
    less = {"up": -0.05, "down": -0.03, "elsewhere": 9.0}
    part = BudgetRow(
        "model-coupled-without-body", {**measured, "peak_frequency": less}, 0, 1.0
    )
    ends = {"up": 0.01, "down": 0.0, "nowhere": 7.0}
    coupled = BudgetRow("model-coupled", {**measured, "peak_frequency": ends}, 0, 1.0)
    changes = Budget((part, coupled), 1.0).change_to_coupled(part)
    assert changes["peak_frequency"] == pytest.approx(0.045)
    assert math.isnan(changes["peak_force"])
    assert (part.label, coupled.label) == ("without body", "coupled")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    case = budget_case("liu-pair", 100.0, "1600:2200:100")
    store = tmp_path_factory.mktemp("runs")
    return case, store, run_case(case, store)


def test_coupled_contacts_come_nearest_to_the_elements(small):
    case, store, result = small
    small_budget = budget_of(result)
    names = [row.model for row in small_budget.rows]
    # nothing shares a gear, so that there are no meshes to leave out
    parts = [f"model-coupled-without-{n}" for n in PARTS]
    assert names == ["model-1", *parts, "model-coupled"]
    curve = [row.largest("off_jump_distance") for row in small_budget.rows]
    assert curve[-1] < 0.05
    assert curve[-1] < 0.1 * curve[0]
    assert curve[-1] < 0.1 * curve[parts.index("model-coupled-without-body") + 1]
    assert budget(case, store).rows == small_budget.rows, "taken from the store"


def test_parts_are_run_and_not_judged(small):
    case, _, result = small
    assert [model.name for model in parts_of(case)] == [
        row.model for row in budget_of(result).rows[1:-1]
    ]
    assert not result.verdicts
    assert {run.source for run in result.judged} == {"fe", *result.models}
    assert len(result.runs) == len(list(tasks_of(case))) == 7
    assert budget_of(replace(result, case=replace(case, model=case.model[:1]))) is None


def test_values_of_a_budget_are_in_the_units_that_stand_beside(small):
    small_budget = budget_of(small[2])
    values = budget_values(small_budget)
    assert values["models"][0]["model"] == "model 1"
    (frequency,) = (q for q in values["quantities"] if q["quantity"] == "peak force")
    assert frequency["unit"] == "%"
    first = frequency["models"][0]
    assert first["largest_error"] == 100.0 * small_budget.rows[0].largest("peak_force")
    assert first["places"] == 2
    assert budget_values(None) == {}


def test_the_figure_has_a_panel_for_what_was_measured(small):
    small_budget = budget_of(small[2])
    figure = draw_budget(small_budget)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    titles = [axes.get_title() for axes in shown]
    assert "jump [Hz]" not in titles, "there are no jumps"
    force = next(axes for axes in shown if axes.get_title() == "peak force [%]")
    labels = [text.get_text() for text in shown[0].get_yticklabels()]
    assert labels == [row.label for row in small_budget.rows]
    dots = np.concatenate(
        [line.get_xdata() for line in force.lines if line.get_marker() == "o"]
    )
    measured = [
        v for row in small_budget.rows for v in row.measured["peak_force"].values()
    ]
    np.testing.assert_allclose(dots, 100.0 * np.array(measured))


def test_parts_have_one_name_everywhere():
    assert get_args(Part) == COMPONENTS


def test_a_case_asks_for_its_budget():
    case = load_case("idler")
    assert case.ablation
    parts = [model.name.removeprefix("model-coupled-") for model in parts_of(case)]
    assert parts == [f"without-{n}" for n in COMPONENTS]
    assert not parts_of(replace(case, ablation=False))
    judged = replace(case.model[-1], without=("body",))
    changed = replace(case, model=(*case.model, judged))
    assert judged not in parts_of(changed)
    assert len(parts_of(changed)) == 4


def test_a_budget_leads_from_model_1_to_the_coupled_model():
    text = """
name = "own"
title = "Own"
gear_set = "liu-pair"
torques_Nm = [100]
speeds_Hz = "1000:1100:50"
ablation = true

[[model]]
number = 1

[[metric]]
name = "static_deflection"
allowed = 0.2
reason = "for a test"
"""
    with pytest.raises(
        InputError, match="own: ablation = true; needs models 1 and coup"
    ):
        read_case(text, "own")
    whole = text + '\n[[model]]\nnumber = "coupled"\n'
    assert read_case(whole).ablation
    with pytest.raises(InputError, match="ablation = true; needs speeds_Hz"):
        read_case(whole.replace('speeds_Hz = "1000:1100:50"\n', ""))
