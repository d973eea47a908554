"""Error budgets: what is recommended, and a small one from the gear set to the rows."""

from __future__ import annotations

import math

import pytest

from validation.budget import RELATIVE, SHOWN, Budget, BudgetRow, budget, budget_case


def row(model, error, cost):
    return BudgetRow(model, dict.fromkeys(SHOWN, error), 0, cost)


@pytest.mark.parametrize(
    ("tolerance", "expected"),
    [(0.2, "cheap"), (0.05, "dear"), (0.001, None)],
)
def test_the_cheapest_inside_the_tolerance_is_recommended(tolerance, expected):
    rows = row("cheap", 0.1, 1e-3), row("dear", 0.01, 5e-3), row("dearest", 0.0, 1e-2)
    best = Budget(rows[:2], 0.1, tolerance).recommended
    assert (None if best is None else best.model) == expected
    assert Budget(rows, 0.1, 0.001).recommended == rows[2]


def test_peaks_and_jumps_must_be_matched():
    only = BudgetRow("one", dict.fromkeys(SHOWN, 0.0), 1, 1.0)
    assert Budget((only,), 0.1, 0.05).recommended is None


def test_a_model_that_failed_is_never_recommended():
    assert Budget((row("failed", math.inf, 1e-6),), 0.1, 1.0).recommended is None


def test_only_relative_errors_are_held_against_the_tolerance():
    errors = dict.fromkeys(SHOWN, 0.01) | {"jump_frequency": 60.0}
    assert BudgetRow("one", errors, 0, 1.0).worst == 0.01
    assert set(RELATIVE) < set(SHOWN)


def test_coupled_contacts_come_nearest_to_the_elements(tmp_path):
    case = budget_case("liu-pair", 100.0, "1500:2100:100")
    found = budget(case, tmp_path, 0.05)
    by_model = {each.model: each for each in found.rows}
    names = {f"model-coupled-without-{n}" for n in ("hardening", "pairs", "body")}
    assert {*names, "model-1", "model-coupled"} == set(by_model)
    curve = {name: each.errors["off_jump_distance"] for name, each in by_model.items()}
    assert curve["model-coupled"] < 0.05
    assert curve["model-coupled"] < curve["model-1"]
    # nothing shares a gear, so that there is nothing to leave out
    assert "model-coupled-without-meshes" not in by_model
    assert budget(case, tmp_path, 0.05).rows == found.rows, "taken from the store"
