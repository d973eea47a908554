"""The benchmark of growth: chains of gears that are all different."""

from __future__ import annotations

from dataclasses import replace

import pytest

from validation.commands.bench import bench_growth
from validation.commands.bench import benchmark as bench
from validation.commands.bench.bench_growth import chain, chain_teeth


def no_progress(stage: str, done: int, total: int) -> None: ...


def test_gears_of_a_chain_differ():
    assert len(set(chain_teeth(27))) == 27
    gears = chain(5)
    assert [(m.driver, m.driven) for m in gears.meshes] == [
        (0, 1),
        (1, 2),
        (2, 3),
        (3, 4),
    ]
    assert len({g.geometry.teeth for g in gears.gears}) == 5


@pytest.mark.slow
def test_set_up_and_sweep_are_measured_apart():
    sizes = replace(bench_growth.FULL, gears=(2, 3))
    points = bench_growth.measure(no_progress, sizes).tables[bench.POINTS]
    assert [(p["study"], p["gears"]) for p in points] == [
        (study, gears) for gears in (2, 3) for study in bench_growth.MODELS
    ]
    for point in points:
        assert point["setup_s"] > 0.0
        assert point["sweep_s"] > 0.0
