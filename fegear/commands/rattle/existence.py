"""Curves of bifurcations of a machine's orbits over two of its figures."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fegear.commands.rattle.orbit_search import OrbitSearch, follow_branches, orbits_of
from lumped.common.array_types import Array
from lumped.common.progress import Progress, silent
from lumped.common.workers import Compute, compute_in_threads
from lumped.continuation.arc_length import NoSolution
from lumped.rattle.branches import machine_with
from lumped.rattle.curves import BifurcationCurve, curve_of, is_on
from lumped.rattle.machine import Machine


@dataclass(frozen=True, kw_only=True)
class Plane:
    """How curves are found: bifurcations of branches over the first figure, at values
    of the second, and the curves through them.

    slices : those values; names : of motions whose curves are followed, all if empty
    """

    first: OrbitSearch
    second: str
    limits: tuple[float, float]
    slices: tuple[float, ...]
    names: tuple[str, ...] = ()


def plane_of(first: OrbitSearch, second: str, limits: tuple[float, float]) -> Plane:
    """The plane with as many slices as there are values of the first parameter."""
    slices = replace(first, limits=limits).values(first.starts)
    return Plane(first=first, second=second, limits=limits, slices=tuple(slices))


def find_existence(
    machine: Machine,
    plane: Plane,
    compute: Compute = compute_in_threads,
    report: Progress = silent,
) -> tuple[BifurcationCurve, ...]:
    """Curves of bifurcations over two figures."""
    search = plane.first
    slices = [machine_with(machine, plane.second, other) for other in plane.slices]
    orbits = compute(
        {
            f"orbits {i} {k}": orbits_of(machine_with(at, search.figure, value), search)
            for i, at in enumerate(slices)
            for k, value in enumerate(search.seeds)
        }
    )
    curves: list[BifurcationCurve] = []
    for i, at in enumerate(slices):
        report("curves", i, len(slices))
        rows = (orbits[f"orbits {i} {k}"]["rows"] for k in range(len(search.seeds)))
        _add_curves(curves, at, plane, list(zip(search.seeds, rows, strict=True)))
    return tuple(curves)


def _add_curves(
    curves: list[BifurcationCurve],
    machine: Machine,
    plane: Plane,
    rows: list[tuple[float, Array]],
) -> None:
    """Add the curves through bifurcations at a value of the second parameter."""
    limits = plane.first.limits, plane.limits
    branches = follow_branches(machine, plane.first, rows)
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
