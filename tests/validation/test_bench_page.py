"""The page of all benchmarks, from values made up for it."""

from __future__ import annotations

import csv
import math
from typing import Any

from validation.commands.bench.benchmark import (
    Benchmark,
    CostCurve,
    Panel,
    write_benchmark,
    write_page,
)

TABLES: dict[str, Any] = {
    "points": [
        {"study": "split", "flank_edges": 12, "on": True, "error": 1.25e-3},
        {"study": "plain", "flank_edges": 24, "on": False, "error": math.nan},
    ],
    "growth": [{"gears": 2, "us_per_step": 2.4}],
    "races": [],
}


CURVE = CostCurve("split", "o", [(1e-3, 1.0), (1e-2, 2.0)])


def measured(name: str = "stiffness", tables: dict[str, Any] = TABLES) -> Benchmark:
    return Benchmark(
        name=name,
        title="a <pair>: run time against error",
        about="what is shown",
        tables=tables,
        panels=[Panel("error", "time", [CURVE])],
        facts={"peak_memory_MB": 290},
    )


def test_page_shows_figures_points_and_what_else_was_measured(tmp_path):
    page = write_page([measured(), measured("lumped")], tmp_path, "fegear bench")
    text = page.read_text(encoding="utf-8")
    assert "a &lt;pair&gt;: run time against error" in text
    assert text.count("<svg ") == 2
    for snippet in (
        "us per step",
        "0.00125",
        "peak memory MB",
        ">290<",
        ">yes<",
        ">-<",
    ):
        assert snippet in text
    assert "Races" not in text
    for name in ("stiffness.csv", "stiffness-growth.csv", "figures/lumped.svg"):
        assert f'href="{name}"' in text
        assert (tmp_path / name).is_file()


def test_points_stand_in_one_file_whoever_writes_them(tmp_path):
    benchmark = measured(tables={"points": [{"study": "split", "error": 0.1}]})
    write_page([benchmark], tmp_path, "fegear bench all")
    points_file = tmp_path / "stiffness.csv"
    text = points_file.read_text()
    write_benchmark(benchmark, tmp_path)
    assert points_file.read_text() == text
    assert list(csv.DictReader(points_file.open())) == [
        {"study": "split", "error": "0.1"}
    ]
