"""Parameter maps: the grid, its file, and what an interruption leaves."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from lumped.maps import (
    Axis,
    Cell,
    MapError,
    ParameterMap,
    cell_of,
    format_cell,
    format_header,
    format_map,
    read_cells,
    run_map,
)
from lumped.respond import respond
from validation.stress_lumped import Idler

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


def solved(**options) -> ParameterMap:
    return run_map(GRID, sum, lambda system, stop: cell(system), **options)


def test_figures_lie_on_the_grid():
    rms = solved().on_grid("dte_rms_m", mesh=1)
    assert rms.tolist() == [[22.0, 42.0], [24.0, 44.0], [26.0, 46.0]]


def test_file_reads_back(tmp_path):
    path = tmp_path / "m.csv"
    whole = solved()
    path.write_text(format_map(whole))
    assert read_cells(path, GRID) == whole.cells


def test_points_that_are_there_are_not_computed_again():
    asked = []
    first = ParameterMap(GRID.axes, 2, GRID.header, {(1.0, 20.0): cell(0.0)})

    def build(point):
        asked.append(point)
        return sum(point)

    found = run_map(first, build, lambda system, stop: cell(system))
    assert len(asked) == 5
    assert (1.0, 20.0) not in asked
    assert found.complete
    assert found.cells[1.0, 20.0] == cell(0.0)


@pytest.mark.parametrize("lost", range(1, 200, 7))
def test_torn_file_keeps_its_whole_points(tmp_path, lost):
    path = tmp_path / "m.csv"
    whole = solved()
    path.write_text(format_map(whole)[:-lost])
    kept = read_cells(path, GRID)
    assert len(kept) >= len(whole.cells) - 1 - lost // 80
    assert all(whole.cells[point] == found for point, found in kept.items())


def test_file_cut_within_the_header_starts_anew(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text(format_header(GRID)[:-20])
    assert read_cells(path, GRID) == {}


def test_order_of_points_in_the_file_does_not_matter(tmp_path):
    path = tmp_path / "m.csv"
    rows = [format_cell(point, c) for point, c in solved().cells.items()]
    path.write_text(format_header(GRID) + "".join(reversed(rows)))
    again = ParameterMap(GRID.axes, 2, GRID.header, read_cells(path, GRID))
    assert format_map(again) == format_map(solved())


def test_another_map_is_refused(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text(format_map(solved()))
    other = ParameterMap(GRID.axes, 2, {**GRID.header, "response": "at 2 Hz"})
    with pytest.raises(MapError, match=r"another map.*at 1 Hz.*at 2 Hz"):
        read_cells(path, other)


def test_impossible_points_say_why():
    def build(point):
        if point[0] == 2.0:
            raise ValueError("no such gear")
        return sum(point)

    found = run_map(GRID, build, lambda system, stop: cell(system))
    assert found.cells[2.0, 10.0].status == "impossible: no such gear"
    assert np.isnan(found.on_grid("dte_rms_m", 0)[1]).all()
    assert found.complete


def test_ctrl_c_keeps_what_was_finished():
    kept = {}
    release = threading.Event()

    def report(done, total):
        if done == 2:
            release.set()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solved(keep=kept.__setitem__, report=report, workers=1)
    assert release.is_set()
    assert len(kept) >= 2
    assert all(found == cell(sum(point)) for point, found in kept.items())


def test_workers_do_not_change_the_file():
    assert format_map(solved(workers=1)) == format_map(solved(workers=4))


def test_largest_response_of_each_mesh_is_kept():
    system = Idler().system()
    responses = [respond(system, f) for f in (2000.0, 3040.0)]
    found = cell_of(responses)
    assert found.values[0][0] == 3040.0  # the second mode shakes mesh 1
    assert found.values[1][0] == 2000.0
    assert found.values[1][1] == responses[0].dte_rms[1]


@pytest.mark.parametrize("values", [(), (1.0, 1.0), (float("nan"),)])
def test_axes_need_values(values):
    with pytest.raises(MapError):
        Axis("a", values)
