"""The benchmark of clatter: errors fall with the tolerance of event times."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from validation.commands.bench import benchmark as bench
from validation.commands.bench.bench_clatter import FULL, measure


def no_progress(stage: str, done: int, total: int) -> None: ...


def test_errors_fall_with_the_tolerance():
    points = measure(no_progress, replace(FULL, timed=1000)).tables[bench.POINTS]
    for _, study_points in groupby(points, key=lambda p: p["study"]):
        rows = list(study_points)
        assert rows[-1]["error"] < 1e-12 < rows[0]["error"]
        for row in rows:
            assert row["error"] < max(100.0 * row["tolerance"], 1e-12)
            assert row["impacts_per_s"] > 0.0
