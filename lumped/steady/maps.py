"""Parameter maps: responses over a grid of parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_fields
from lumped.common.workers import Arrays, Compute, compute_in_threads
from lumped.steady.response import RESPONSE_QUANTITIES, Response
from lumped.steady.sweep_table import COLUMNS
from lumped.train.system import LumpedSystem

Point = tuple[float, ...]
QUANTITIES = ("mesh_frequency_Hz", *COLUMNS[COLUMNS.index("dte_rms_m") : -1])
EXPONENT = "lyapunov_per_period"  # column of maps with exponents


class MapError(ValueError):
    """Invalid map or map file; the message names the fault."""


@dataclass(frozen=True)
class Axis:
    """Name of a parameter and the values that it takes."""

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
    """Result at a point: quantities of each mesh, or the reason why there are none.

    values : (m, 8), columns as in QUANTITIES; NaN if the run diverged
    multiples : (m,) response period in mesh periods, 0 if aperiodic
    status : periodic, aperiodic, diverged, or impossible and the reason
    exponent : largest Lyapunov exponent per period of the first mesh; NaN where the
        motion diverged, None where the map has no exponents or the point is impossible
    """

    values: tuple[tuple[float, ...], ...]
    multiples: tuple[int, ...]
    status: str
    exponent: float | None = None


@dataclass(frozen=True)
class ParameterMap:
    """Axes, fixed parameters (free text by key), and the points computed so far.

    with_exponents : whether cells have largest Lyapunov exponents
    """

    axes: tuple[Axis, ...]
    meshes: int
    header: Mapping[str, str]
    cells: Mapping[Point, Cell] = field(default_factory=dict)
    with_exponents: bool = False

    @property
    def points(self) -> list[Point]:
        """All points in the order of the grid, the last axis changing fastest."""
        return list(itertools.product(*(axis.values for axis in self.axes)))

    @property
    def complete(self) -> bool:
        return len(self.cells) == len(self.points)

    def on_grid(self, name: str, mesh: int) -> Array:
        """Quantity of one mesh (from 0) on the grid; NaN where it is missing."""
        column = QUANTITIES.index(name)
        return self._arranged(lambda cell: cell.values[mesh][column])

    @property
    def exponents(self) -> Array:
        """Largest Lyapunov exponents on the grid, per period of the first mesh."""
        return self._arranged(exponent_of)

    def _arranged(self, quantity: Callable[[Cell], float]) -> Array:
        """A quantity of the cells on the grid; NaN where there is none."""
        values = [
            quantity(cell) if (cell := self.cells.get(point)) else np.nan
            for point in self.points
        ]
        return np.reshape(values, [len(axis.values) for axis in self.axes])


def exponent_of(cell: Cell) -> float:
    """Exponent of a cell, NaN where there is none."""
    return math.nan if cell.exponent is None else cell.exponent


def cell_of(responses: Sequence[Response], exponents: Sequence[float] = ()) -> Cell:
    """Quantities of each mesh at the response with its largest vibration.

    exponents : largest Lyapunov exponent of each response, or none
    """
    rms = np.array([response.dte_rms for response in responses])
    rms = np.where(np.isnan(rms), np.inf, rms)  # a divergence must remain visible
    largest = [responses[i] for i in rms.argmax(axis=0)]
    values = tuple(
        (
            r.frequency,
            *(float(getattr(r, name)[m]) for name in RESPONSE_QUANTITIES),
        )
        for m, r in enumerate(largest)
    )
    multiples = tuple(int(r.period_multiple[m]) for m, r in enumerate(largest))
    status = max((r.status for r in responses), key=_severity)
    exponent = float(np.max(exponents)) if exponents else None
    return Cell(values, multiples, str(status), exponent)


def _severity(status: str) -> int:
    return ("periodic", "aperiodic", "diverged").index(status)


def impossible_cell(meshes: int, reason: str) -> Cell:
    """Cell of a point at which no such train exists."""
    empty = (np.nan,) * len(QUANTITIES)
    return Cell((empty,) * meshes, (0,) * meshes, f"impossible: {reason}")


@dataclass(frozen=True, eq=False)
class Points(Mapping[str, Callable[[], Arrays]]):
    """Computation of each point by its name, prepared on access.

    build : function that returns the system at a point; a ValueError makes the point
        impossible
    evaluate : function that returns the cell of a system; for a cluster a module-level
        function, or a `partial` of one
    """

    parameter_map: ParameterMap
    build: Callable[[Point], LumpedSystem]
    evaluate: Callable[[LumpedSystem], Cell]

    @cached_property
    def points(self) -> dict[str, Point]:
        return {
            " ".join(map(repr, point)): point for point in self.parameter_map.points
        }

    def __getitem__(self, name: str) -> Callable[[], Arrays]:
        try:
            system = self.build(self.points[name])
        except ValueError as error:
            return partial(
                _cell_to_arrays, impossible_cell(self.parameter_map.meshes, str(error))
            )
        return partial(_evaluate_cell, self.evaluate, system, self.parameter_map.meshes)

    def __iter__(self) -> Iterator[str]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)


def run_map(
    parameter_map: ParameterMap,
    build: Callable[[Point], LumpedSystem],
    evaluate: Callable[[LumpedSystem], Cell],
    compute: Compute = compute_in_threads,
) -> ParameterMap:
    """Compute a map with all points; see `Points`."""
    parts = Points(parameter_map, build, evaluate)
    arrays = compute(parts)
    cells = {
        point: _cell_from_arrays(arrays[name]) for name, point in parts.points.items()
    }
    return replace(parameter_map, cells=cells)


def _evaluate_cell(
    evaluate: Callable[[LumpedSystem], Cell], system: LumpedSystem, meshes: int
) -> Arrays:
    try:
        return _cell_to_arrays(evaluate(system))
    except ValueError as error:
        return _cell_to_arrays(impossible_cell(meshes, str(error)))


def _cell_to_arrays(cell: Cell) -> Arrays:
    exponent = () if cell.exponent is None else (cell.exponent,)
    return {
        "exponent": np.array(exponent, float),
        "values": np.array(cell.values),
        "multiples": np.array(cell.multiples),
        "status": np.frombuffer(cell.status.encode(), np.uint8),
    }


def _cell_from_arrays(arrays: Arrays) -> Cell:
    values, multiples = (arrays[name].tolist() for name in ("values", "multiples"))
    status = arrays["status"].tobytes().decode()
    (exponent,) = arrays["exponent"].tolist() or (None,)
    return Cell(tuple(map(tuple, values)), tuple(multiples), status, exponent)


def map_columns(parameter_map: ParameterMap) -> tuple[str, ...]:
    """Names of the columns of `map_rows`."""
    names = (axis.name for axis in parameter_map.axes)
    exponent = (EXPONENT,) if parameter_map.with_exponents else ()
    return *names, "mesh", *QUANTITIES, "period_multiple", *exponent, "status"


def map_rows(parameter_map: ParameterMap) -> Iterator[tuple[Any, ...]]:
    """Rows, one for each point and mesh, with the points in the order of the grid."""
    for point in parameter_map.points:
        cell = parameter_map.cells[point]
        meshes = zip(cell.values, cell.multiples, strict=True)
        for mesh, (values, multiple) in enumerate(meshes, start=1):
            exponent = (exponent_of(cell),) if parameter_map.with_exponents else ()
            row = *map(float, point), mesh, *values, multiple, *exponent
            yield *row, cell.status
