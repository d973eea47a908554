"""The benchmark of stability: errors, orders and the chart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fegear.commands.stability import study as stability
from validation.commands.bench import benchmark as bench
from validation.commands.bench.bench_stability import (
    FULL,
    edge_rows,
    measure,
    multiplier_rows,
    sawtooth_points,
)

SMALL_CHART = replace(FULL, speeds=20, values=3)


def no_progress(stage: str, done: int, total: int) -> None: ...


@pytest.fixture(scope="module")
def points():
    by_study = {}
    for point in sawtooth_points():
        by_study.setdefault(point.study, []).append(point)
    return by_study


def test_series_and_recursion_reach_round_off(points):
    assert points["series"][-1].error < 1e-13
    assert points["eq. 4.55, NumPy"][-1].error < 1e-14


@pytest.mark.parametrize("study", ["exponentials", "eq. 4.56, SciPy"])
def test_exponentials_are_of_second_order(points, study):
    """The compiled ones are those of SciPy."""
    study_points = points[study]
    rate = bench.slope(
        [p.setting for p in study_points], [p.error for p in study_points]
    )
    assert rate == pytest.approx(-2.0, abs=0.05)
    errors = [p.error for p in points["exponentials"]]
    np.testing.assert_allclose([p.error for p in study_points], errors, rtol=1e-3)


def test_perturbation_agrees_to_second_order():
    rows = list(edge_rows("liu-friction", 100.0))
    names = list(dict.fromkeys(row.combination for row in rows))
    assert names[0] == "2 f3"
    assert any(" + " in name for name in names)
    for name in names:
        edges = [row for row in rows if row.combination == name]
        assert [row.variation for row in edges] == list(FULL.variations)
        orders = [row.order for row in edges[1:]]
        assert orders == pytest.approx([2.0] * 3, abs=0.25)


def test_multipliers_are_right_to_a_millionth():
    for row in multiplier_rows("liu-friction", 100.0):
        assert row.error_largest < 1e-6
        assert row.us_per_speed > 0.0


def test_a_benchmark_has_all_tables():
    benchmark = measure("liu-friction", 100.0, no_progress, SMALL_CHART)
    assert [name for name, rows in benchmark.tables.items() if rows] == [
        *("points", "multipliers", "edges", "chart")
    ]
    (chart,) = benchmark.tables["chart"]
    assert (chart["speeds"], chart["values"]) == (20, 3)
    assert len(benchmark.panels) == 2


def test_a_chart_that_was_interrupted_has_no_time(monkeypatch):
    """What was finished before is there."""
    original, seen = stability.scan_stability, []

    def stopped(*args):
        seen.append(args)
        if len(seen) > 3:  # two of the chart that compiles, one of the other
            raise KeyboardInterrupt
        return original(*args)

    monkeypatch.setattr(stability, "scan_stability", stopped)
    benchmark = measure("liu-friction", 100.0, no_progress, SMALL_CHART)
    assert benchmark.interrupted
    assert not benchmark.tables["chart"]
    assert benchmark.tables["edges"]
