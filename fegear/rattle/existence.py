"""Where orbits of a machine exist over two of its figures: found, kept and written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.rattle.bifurcation import (
    Search,
    followed,
    kept_tasks,
    orbit_rows,
    require_possible,
)
from fegear.rattle.machines import NamedMachine, figures_of, header_of, unit_name
from fegear.result import Result
from fegear.store import Keeping
from lumped.branches.continuation import NoSolution
from lumped.csv_text import format_csv
from lumped.progress import Progress, silent
from lumped.rattle.branch_figure import draw_curves
from lumped.rattle.branches import machine_with
from lumped.rattle.curves import Curve, curve_of, is_on
from lumped.rattle.figure import words_of
from lumped.rattle.machine import Machine

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Array = NDArray[np.float64]
LEGEND = {
    "curve, index": "counted from 1, points in the order of the curve",
    "bifurcation": "fold, period doubling or grazing, of the motion of that name",
    "kind": "grazing fold, or grazing, where the curve meets another; else empty",
}


@dataclass(frozen=True, kw_only=True)
class Plane:
    """How curves are found: bifurcations of branches over the first figure, at values
    of the second, and the curves through them.

    slices : those values; names : of motions whose curves are followed, all if empty
    """

    first: Search
    second: str
    limits: tuple[float, float]
    slices: tuple[float, ...]
    names: tuple[str, ...] = ()


def plane_of(first: Search, second: str, limits: tuple[float, float]) -> Plane:
    """With as many slices as there are values of the first figure."""
    slices = replace(first, limits=limits).values(first.starts)
    return Plane(first=first, second=second, limits=limits, slices=tuple(slices))


@dataclass(frozen=True, eq=False, repr=False)
class ExistenceResult(Result):
    """Curves of bifurcations of a named machine."""

    named: NamedMachine
    plane: Plane
    curves: tuple[Curve, ...]

    @property
    def columns(self) -> tuple[str, str]:
        """Both figures with their units."""
        return unit_name(self.plane.first.figure), unit_name(self.plane.second)

    @property
    def _fixed(self) -> dict[str, Any]:
        """Figures but for those that vary."""
        figures = figures_of(self.named.machine)
        for column in self.columns:
            figures.pop(column)
        return figures

    def csv(self) -> str:
        """A row for each point of each curve."""
        names = [
            *("curve", "name", "bifurcation", "index", *self.columns),
            *("time_turns", "speed_rad_per_turn", "kind"),
        ]
        header = {"machine": self.named.name, **header_of(self._fixed), **LEGEND}
        return format_csv(names, self._rows(), header)

    def _rows(self) -> Iterator[list[object]]:
        for number, curve in enumerate(self.curves, start=1):
            for index, point in enumerate(curve.points, start=1):
                yield [
                    *(number, curve.itinerary.name, curve.kind, index),
                    *(point.first, point.second, *point.departure, point.kind),
                ]

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            **self.named.heading,
            **self._fixed,
            "over": list(self.columns),
            "curves": [
                {
                    "name": curve.itinerary.name,
                    "bifurcation": curve.kind,
                    "points": len(curve.points),
                    "from": [curve.points[0].first, curve.points[0].second],
                    "to": [curve.points[-1].first, curve.points[-1].second],
                    "end": curve.reason,
                    "meetings": [
                        {"kind": point.kind, "at": [point.first, point.second]}
                        for point in curve.points
                        if point.kind
                    ],
                }
                for curve in self.curves
            ],
        }

    def draw(self) -> Figure:
        figures = self.plane.first.figure, self.plane.second
        words = words_of(self.named.machine, *figures)
        labels = [
            figure.replace("_", " ") + (" [rad]" if column.endswith("_rad") else "")
            for figure, column in zip(figures, self.columns, strict=True)
        ]
        return draw_curves(self.curves, labels, f"{self.named.name}: {words}")


def find_existence(
    named: NamedMachine,
    plane: Plane,
    keeping: Keeping,
    report: Progress = silent,
) -> ExistenceResult:
    """Curves of bifurcations over two figures.

    keeping : where orbits are kept as they are found
    Raises InputError where a figure cannot have the values.
    """
    machine, search = named.machine, plane.first
    require_possible(machine, search.figure, search.limits)
    require_possible(machine, plane.second, plane.limits)
    tasks = {
        f"orbits {i} {k}": partial(
            orbit_rows,
            machine_with(machine_with(machine, plane.second, other), search.figure, v),
            *(search.departures, search.velocity),
        )
        for i, other in enumerate(plane.slices)
        for k, v in enumerate(search.seeds)
    }
    inputs = {"plane": repr(plane)}
    with kept_tasks(machine, inputs, keeping, report) as compute:
        found = compute(tasks)
        curves: list[Curve] = []
        for i, other in enumerate(plane.slices):
            report("curves", i, len(plane.slices))
            rows = _slice(found, i, search)
            _add_curves(curves, machine_with(machine, plane.second, other), plane, rows)
    return ExistenceResult(named, plane, tuple(curves))


def _slice(
    found: Mapping[str, Array], number: int, search: Search
) -> list[tuple[float, Array]]:
    """Orbits at values of the first figure, of one of the second."""
    values = search.seeds
    return [(v, found[f"orbits {number} {k}"]) for k, v in enumerate(values)]


def _add_curves(
    curves: list[Curve], machine: Machine, plane: Plane, rows: list[tuple[float, Array]]
) -> None:
    """Those through bifurcations at a value of the second figure."""
    limits = plane.first.limits, plane.limits
    branches = followed(machine, plane.first, rows)
    for branch in branches:
        if plane.names and branch.itinerary.name not in plane.names:
            continue
        for point in branch.bifurcations:
            if any(is_on(curve, branch, point, plane.second) for curve in curves):
                continue
            try:
                curves.append(curve_of(branch, point, plane.second, limits))
            except NoSolution:
                continue
