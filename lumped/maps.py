"""Parameter maps: a response figure over a grid, kept point by point in a file.

The file is a CSV with a header of comment lines that define the map, and a row for
each point and mesh. Points are appended as they are finished, in any order; the
finished map is written anew in the order of the grid. A file that was cut off, even
within a line, is taken up again at the points that are missing.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lumped.checks import require_fields
from lumped.csv_text import format_csv, format_rows, parse_csv
from lumped.response import FIGURES as MEASURED
from lumped.response import Response
from lumped.sweep_table import COLUMNS
from lumped.system import LumpedSystem
from lumped.workers import Cluster, Never, Stop, run_tasks

T = TypeVar("T")
Array = NDArray[np.float64]
Point = tuple[float, ...]
Report = Callable[[int, int], None]  # (points done, of how many)
FORMAT = "lumped parameter map 2"
QUANTITIES = ("mesh_frequency_Hz", *COLUMNS[COLUMNS.index("dte_rms_m") : -1])


class MapError(ValueError):
    """A map or its file that cannot be used; the message names what is wrong."""


@dataclass(frozen=True)
class Axis:
    """A parameter by its name, and the values that it takes."""

    name: str
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        require_fields(self)
        if not self.values or not np.isfinite(self.values).all():
            raise MapError(f"{self.name}: one or more finite values are needed")
        if len(set(self.values)) < len(self.values):
            raise MapError(f"{self.name}: a value is given twice")


@dataclass(frozen=True)
class Cell:
    """What was found at a point: for each mesh its figures, or why there are none.

    values : (m, 8), columns as in QUANTITIES; NaN where the run diverged
    multiples : (m,) response period in mesh periods, 0 if aperiodic
    status : periodic, aperiodic, diverged, or impossible and the reason
    """

    values: tuple[tuple[float, ...], ...]
    multiples: tuple[int, ...]
    status: str


@dataclass(frozen=True)
class ParameterMap:
    """Axes, what is held fixed (free text by key), and the points found so far."""

    axes: tuple[Axis, ...]
    meshes: int
    header: Mapping[str, str]
    cells: Mapping[Point, Cell] = field(default_factory=dict)

    @property
    def points(self) -> list[Point]:
        """All points in the order of the grid, the last axis changing fastest."""
        return list(itertools.product(*(axis.values for axis in self.axes)))

    @property
    def complete(self) -> bool:
        return len(self.cells) == len(self.points)

    def on_grid(self, name: str, mesh: int) -> Array:
        """A quantity of one mesh (from 0) on the grid; NaN where there is none."""
        column = QUANTITIES.index(name)
        values = [
            cell.values[mesh][column] if (cell := self.cells.get(point)) else np.nan
            for point in self.points
        ]
        return np.reshape(values, [len(axis.values) for axis in self.axes])


def cell_of(responses: Sequence[Response]) -> Cell:
    """For each mesh the figures where its vibration is largest."""
    sizes = np.array([response.dte_rms for response in responses])
    sizes = np.where(np.isnan(sizes), np.inf, sizes)  # a divergence is to be seen
    best = [responses[i] for i in sizes.argmax(axis=0)]
    figures = tuple(
        (
            r.frequency,
            *(float(getattr(r, name)[m]) for name in MEASURED),
        )
        for m, r in enumerate(best)
    )
    multiples = tuple(int(r.period_multiple[m]) for m, r in enumerate(best))
    worst = max((r.status for r in responses), key=_severity)
    return Cell(figures, multiples, str(worst))


def _severity(status: str) -> int:
    return ("periodic", "aperiodic", "diverged").index(status)


def impossible(meshes: int, reason: str) -> Cell:
    """A point at which there is no such train."""
    empty = (np.nan,) * len(QUANTITIES)
    return Cell((empty,) * meshes, (0,) * meshes, f"impossible: {reason}")


def _possible(meshes: int, attempt: Callable[[], T]) -> T | Cell:
    """What an attempt returns, or why the point is impossible."""
    try:
        return attempt()
    except ValueError as error:
        return impossible(meshes, str(error))


def run_map(
    parameter_map: ParameterMap,
    build: Callable[[Point], LumpedSystem],
    evaluate: Callable[[LumpedSystem, Stop], Cell | None],
    keep: Callable[[Point, Cell], None] = lambda point, cell: None,
    report: Report = lambda done, total: None,
    workers: int | Cluster | None = None,
) -> ParameterMap:
    """The map with all points; those that it holds already are not computed again.

    build : the system at a point, called in this thread; a ValueError makes the
        point impossible
    evaluate : called by the workers; where the event is set it may give up: None. For
        a cluster it must be a function of a module, or a `partial` of one
    keep : called in this thread with every point as it is finished

    Ctrl-C ends the work after the points that are under way and is raised again.
    """
    points, cells = parameter_map.points, dict(parameter_map.cells)
    stop = threading.Event()
    heeded: Stop = Never() if isinstance(workers, Cluster) else stop
    possible = partial(_possible, parameter_map.meshes)

    def take(point: Point, cell: Cell | None) -> None:
        if cell is None:
            return
        cells[point] = cell
        keep(point, cell)
        report(len(cells), len(points))

    def tasks() -> Iterator[tuple[Point, Callable[[], Cell | None]]]:
        for point in points:
            if point in cells:
                continue
            system = possible(partial(build, point))
            if isinstance(system, Cell):
                take(point, system)
            else:
                yield point, partial(possible, partial(evaluate, system, heeded))

    run_tasks(tasks(), take, stop, workers)
    return ParameterMap(
        parameter_map.axes, parameter_map.meshes, parameter_map.header, cells
    )


def format_header(parameter_map: ParameterMap) -> str:
    """The comment lines and the line of column names."""
    header = {"format": FORMAT} | dict(parameter_map.header)
    for axis in parameter_map.axes:
        header[f"axis {axis.name}"] = " ".join(repr(float(v)) for v in axis.values)
    names = [axis.name for axis in parameter_map.axes]
    columns = [*names, "mesh", *QUANTITIES, "period_multiple", "status"]
    return format_csv(columns, [], header)


def format_cell(point: Point, cell: Cell) -> str:
    """The rows of one point, a line for each mesh."""
    each = zip(cell.values, cell.multiples, strict=True)
    return format_rows(
        [*map(float, point), mesh, *figures, multiple, cell.status]
        for mesh, (figures, multiple) in enumerate(each, start=1)
    )


def format_map(parameter_map: ParameterMap) -> str:
    """The whole file, points in the order of the grid."""
    found = parameter_map.cells
    rows = (format_cell(p, found[p]) for p in parameter_map.points if p in found)
    return format_header(parameter_map) + "".join(rows)


def read_cells(path: str | os.PathLike[str], empty: ParameterMap) -> dict[Point, Cell]:
    """Points that a file of the very same map holds; a torn last line is left out.

    Raises MapError if the file belongs to another map, OSError if it is not read.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise MapError(f"{path}: holds no text, so no map") from None
    expected = format_header(empty)
    if not text.startswith(expected):
        if expected.startswith(text):
            return {}  # cut off within the header
        raise MapError(f"{path}: {_difference(text, expected)}")
    whole = text[: text.rindex("\n") + 1]
    try:
        return dict(_cells(list(parse_csv(whole, str(path)).rows.values()), empty))
    except (ValueError, IndexError) as error:
        raise MapError(f"{path}: a damaged row, {error}") from None


def _difference(text: str, expected: str) -> str:
    for line, wanted in zip(text.splitlines(), expected.splitlines(), strict=False):
        if line != wanted:
            return f"holds another map, `{line}` instead of `{wanted}`"
    return "holds another map"


def _cells(
    rows: list[Sequence[str]], empty: ParameterMap
) -> Iterator[tuple[Point, Cell]]:
    """Points of which the rows of all meshes are there."""
    width, known = len(empty.axes), set(empty.points)
    for i in range(0, len(rows) - empty.meshes + 1, empty.meshes):
        group = rows[i : i + empty.meshes]
        point = tuple(float(value) for value in group[0][:width])
        if point not in known:
            raise MapError(f"{point} is not on the grid")
        figures = tuple(
            tuple(float(v) if v else np.nan for v in row[width + 1 : -2])
            for row in group
        )
        multiples = tuple(int(row[-2]) for row in group)
        yield point, Cell(figures, multiples, group[0][-1])
