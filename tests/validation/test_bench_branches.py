"""The benchmark of branches on one fast train."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from validation.commands.bench.bench_branches import (
    FULL,
    branch_point,
    comparisons_with_sweeps,
    convergence_orders,
    followed_branches,
    stability,
    sweep_point,
    time_panel,
)
from validation.commands.bench.stress.stress_lumped import Idler

LIMITS = 1250.0, 1750.0


@pytest.fixture(scope="module")
def system():
    return Idler(damping=0.05).system()


@pytest.fixture(scope="module")
def finder(system):
    return followed_branches(system, LIMITS, 12)


@pytest.mark.slow
def test_stable_motions_are_those_of_sweeps_and_jumps_are_bifurcations(finder):
    rows = list(comparisons_with_sweeps(finder, replace(FULL, speeds=60)))
    assert [row.direction for row in rows] == ["up", "down"]
    for row in rows:
        assert row.compared > 50
        assert row.error_largest < 1e-3
        assert row.at_bifurcations == row.jumps
    assert sum(row.jumps for row in rows) >= 2


def test_disturbances_do_what_multipliers_say(finder):
    counts = stability(finder, np.random.default_rng(2), replace(FULL, drawn=12))
    assert counts.decided == counts.agree == 12
    assert 0 < counts.stable < 12


def test_harmonics_cost_time_and_bring_accuracy(system):
    sizes = replace(FULL, sampled=10)
    few, many = (branch_point(system, LIMITS, h, sizes) for h in (6, 24))
    assert many.error_median < 0.02 * few.error_median
    swept = sweep_point(system, LIMITS, 64, sizes)
    assert 0.0 < swept.error_median < 5e-3
    panel = time_panel([few, many, swept])
    assert [curve.label for curve in panel.curves] == ["branches", "sweep, rk4"]


def test_lost_contact_lowers_the_order(system):
    rows = {
        row.contact: row
        for row in convergence_orders("three harmonics", system, LIMITS)
    }
    assert rows["lost"].order > 2.0
    assert all(row.error_at_40 < 1e-5 for row in rows.values())
