"""Benchmarks that answer at once with what reaches them."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from fegear.files.contents import exact_repr
from validation.commands.bench import benchmark as bench
from validation.commands.bench.study import AllBenchmarks

MODULES = [path.stem for path in Path(bench.__file__).parent.glob("bench_*.py")]


def answer_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the measurements of all benchmarks, and let `bench all` run two."""
    for name in MODULES:
        module = import_module(f"validation.commands.bench.{name}")
        monkeypatch.setattr(module, "measure", _instead(name.removeprefix("bench_")))
    of_study = AllBenchmarks.benchmarks.fget
    two = property(lambda study: of_study(study)[:2])
    monkeypatch.setattr(AllBenchmarks, "benchmarks", two)


def _instead(name: str) -> Any:
    def measure(*args: Any, sizes: Any) -> Any:
        asked = (*args[:-1], sizes)  # without the report of progress
        row = {"asked": exact_repr(asked)}
        panel = bench.Panel("x", "y", [bench.CostCurve(name, "o", [(1.0, 1.0)])])
        tables = {"points": [row]}
        return bench.Benchmark(name, name, name, tables=tables, panels=[panel])

    return measure
