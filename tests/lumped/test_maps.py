"""Parameter maps: the grid, its file, and what an interruption leaves."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from lumped.common.workers import compute_in_threads
from lumped.steady.maps import (
    Axis,
    Cell,
    ParameterMap,
    cell_of,
    map_columns,
    map_rows,
    run_map,
)
from lumped.steady.respond import respond
from validation.commands.bench.stress.stress_lumped import Idler

GRID = ParameterMap(
    axes=(Axis("a", (1.0, 2.0, 3.0)), Axis("b", (10.0, 20.0))),
    meshes=2,
    header={"gear set": "none", "response": "at 1 Hz"},
)


def cell(value: float) -> Cell:
    figures = tuple(
        (1.0, value * mesh, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6) for mesh in (1, 2)
    )
    return Cell(figures, (1, 2), "periodic")


def solved(compute=compute_in_threads) -> ParameterMap:
    return run_map(GRID, sum, cell, compute)


def test_figures_lie_on_the_grid():
    rms = solved().on_grid("dte_rms_m", mesh=1)
    assert rms.tolist() == [[22.0, 42.0], [24.0, 44.0], [26.0, 46.0]]


def test_rows_are_in_the_order_of_the_grid():
    """As many cells as there are columns; the last axis changes fastest."""
    response_map = solved()
    rows = list(map_rows(response_map))
    assert {len(row) for row in rows} == {len(map_columns(response_map))}
    assert [row[:3] for row in rows[:4]] == [
        (1.0, 10.0, 1),
        (1.0, 10.0, 2),
        (1.0, 20.0, 1),
        (1.0, 20.0, 2),
    ]


def test_points_that_are_there_are_not_prepared():
    points, stored = [], {}

    def build(point):
        points.append(point)
        return sum(point)

    def compute(parts):
        for name in parts:
            if name not in stored:
                stored[name] = parts[name]()
        return stored

    response_map = run_map(GRID, build, cell, compute)
    assert len(points) == 6
    assert run_map(GRID, build, cell, compute).cells == response_map.cells
    assert len(points) == 6


def test_impossible_points_say_why():
    def build(point):
        if point[0] == 2.0:
            raise ValueError("no such gear")
        return sum(point)

    response_map = run_map(GRID, build, cell)
    assert response_map.cells[2.0, 10.0].status == "impossible: no such gear"
    assert np.isnan(response_map.on_grid("dte_rms_m", 0)[1]).all()
    assert response_map.complete


def test_ctrl_c_is_raised_again():
    def report(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solved(partial(compute_in_threads, report=report))


def test_largest_response_of_each_mesh_is_kept():
    system = Idler().system()
    responses = [respond(system, f) for f in (2000.0, 3040.0)]
    map_cell = cell_of(responses)
    assert map_cell.values[0][0] == 3040.0  # the second mode shakes mesh 1
    assert map_cell.values[1][0] == 2000.0
    assert map_cell.values[1][1] == responses[0].dte_rms[1]


@pytest.mark.parametrize("values", [(), (1.0, 1.0), (float("nan"),)])
def test_axes_need_values(values):
    with pytest.raises(ValueError, match=r"^(a: |values = .*; must)"):
        Axis("a", values)
