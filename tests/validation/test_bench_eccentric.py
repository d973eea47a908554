"""The benchmark of eccentric gearing: orders and errors."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from validation.commands.bench import bench_eccentric
from validation.commands.bench import benchmark as bench
from validation.commands.bench.bench_eccentric import (
    FULL,
    contact_rows,
    distance_points,
    measure,
)


def no_progress(stage: str, done: int, total: int) -> None: ...


@pytest.fixture(scope="module")
def points():
    by_study = {}
    for point in distance_points():
        by_study.setdefault(point.study, []).append(point)
    return by_study


def test_the_integral_converges_faster_than_any_power(points):
    errors = [p.error for p in points["rolling integral"]]
    assert errors[-1] < 1e-14
    drops = [one / two for one, two in pairwise(errors[:-1:2])]
    assert drops == sorted(drops)  # twice the samples, the square of the error


def test_shooting_is_of_order_four_and_slower(points):
    shooting = points["shooting, Runge-Kutta"][2:]
    rate = bench.slope([p.setting for p in shooting], [p.error for p in shooting])
    assert rate == pytest.approx(-4.0, abs=0.3)
    assert shooting[-1].ms > 10.0 * points["rolling integral"][-1].ms


@pytest.mark.slow
def test_contact_converges():
    sizes = replace(FULL, fineness=(0.4, 0.8, 1.2), positions=2)
    rows = contact_rows(no_progress, sizes)
    assert rows[0].error > rows[1].error > rows[2].error == 0.0
    assert rows[0].freedoms < rows[1].freedoms


def test_ctrl_c_keeps_what_is_finished(monkeypatch):
    def stopped(report, sizes):
        raise KeyboardInterrupt

    monkeypatch.setattr(bench_eccentric, "contact_rows", stopped)
    measured = measure(no_progress)
    assert measured.interrupted
    assert measured.tables[bench.POINTS]
    assert measured.tables["contact"] == []
