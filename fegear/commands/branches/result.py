"""The result of `fegear branches`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isnan
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.files.codes import with_code
from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, number, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.train_problem import TrainFacts
from lumped.branches.cascades import Cascade
from lumped.branches.motions import SpeedFamily
from lumped.branches.points import BranchPoint, PeriodicBranch
from lumped.figures.branches import draw_branches

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BALANCE_SCHEME = "harmonic balance"
INTEGRATION_SCHEME = "fixed points of the map over a period"

COLUMNS = (
    *(MESH_FREQUENCY, "mesh", "dte_rms_m", "dte_peak_m"),
    *("stable", "floquet_max", "kind", "period_multiple"),
)

LEGEND = (
    *("branch", "index", MESH_FREQUENCY, "mesh", "dte_rms_m"),
    *("stable", "floquet_max", "kind", "period_multiple"),
)


@dataclass(frozen=True, eq=False)
class BranchesResult(StudyResult):
    """Branches of a gear set.

    natural_Hz : natural frequencies of modes that strain a mesh [Hz]
    natural : which these are, in words
    cascades : of period doublings, from branch to branch
    is_integrated : whether motions are fixed points of the map over their period, not
        of harmonic balance
    """

    study: Any
    facts: TrainFacts
    branches: tuple[PeriodicBranch, ...]
    natural_Hz: tuple[float, ...]
    natural: str
    cascades: tuple[Cascade, ...] = ()
    complete: bool = True
    is_integrated: bool = False

    @property
    def empty(self) -> bool:
        return not self.branches

    @property
    def _is_over_speed(self) -> bool:
        return self.study.over is None

    @property
    def table(self) -> Table:
        """A row for each point and mesh."""
        over = () if self._is_over_speed else (self.study.parameter,)
        names = "branch", "index", *over, *COLUMNS
        legend = meanings("branches", *LEGEND)
        table = Table(names, self._rows, {**self.facts.header, **legend})
        return self.facts.with_driver_speed(table)

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for place, branch in enumerate(self.branches, start=1):
            for index, point in enumerate(branch.points, start=1):
                over = () if self._is_over_speed else (point.best_parameter,)
                speed = point.best_parameter if self._is_over_speed else point.frequency
                for m in range(point.figures["dte_rms"].size):
                    sizes = (
                        float(point.figures[n][m]) for n in ("dte_rms", "dte_peak")
                    )
                    stability = int(point.stable), point.largest, point.kind
                    row = place, index, *over, speed, m + 1, *sizes, *stability
                    yield *row, branch.multiple

    @cached_property
    def summary(self) -> dict[str, Any]:
        """None for what varies."""
        study = self.study
        return {
            **self.facts.summary,
            "harmonics": None if self.is_integrated else study.numerics.harmonics,
            "natural_frequencies": self.natural,
            "natural_frequencies_Hz": list(self.natural_Hz),
            "interrupted": not self.complete,
            "branches": [
                _branch_values(branch, study.parameter, self.is_integrated)
                for branch in self.branches
            ],
            "cascades": [
                _cascade_values(cascade, self._is_over_speed)
                for cascade in self.cascades
            ],
            "warnings": list(self.facts.warnings),
        }

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._draw_diagram}

    def _draw_diagram(self) -> Figure:
        label = SpeedFamily.label if self._is_over_speed else self.study.parameter
        return draw_branches(self.branches, label, self.facts.title)

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self.facts.title
        over_speed = self._is_over_speed
        name, unit = ("frequency_Hz", " Hz") if over_speed else ("value", "")
        ends = ("from_Hz", "to_Hz") if over_speed else ("from", "to")
        for place, branch in enumerate(values["branches"], start=1):
            repeats = pluralize(branch["period_multiple"], "period")
            largest = _micrometres_text(branch["largest_dte_rms_m"])
            error = branch["relative_error_of_rms"]
            finer = "more harmonics" if values["harmonics"] else "finer steps"
            checked = f", which shooting does not confirm: {finer} may be needed"
            if error is not None:
                checked = f", {100.0 * error:.2g} % off by shooting"
            largest_rms = with_code(
                "E06",
                f"largest RMS of dynamic transmission error of the meshes {largest} "
                f"um{checked}",
            )
            yield (
                f"branch {place}: {pluralize(branch['points'], 'point')}, "
                f"{branch['stable_points']} of them stable, {branch[ends[0]]:.6g} to "
                f"{branch[ends[1]]:.6g}{unit}, repeats after {repeats}\n"
                f"  {largest_rms}\n"
                f"  begins {branch['origin']}; ends: {branch['end']}"
            )
            for bifurcation in branch["bifurcations"]:
                levels = _micrometres_text(bifurcation["dte_rms_m"])
                place_text = _place_text(bifurcation[name], bifurcation["located_by"])
                at = f"{place_text:>10}{unit}"
                yield f"  {at}  {bifurcation['kind']:<15} RMS {levels} um"
        for cascade in self.cascades:
            rows = _cascade_rows(cascade)
            title = "period doublings, from branch to branch"
            yield RowTable(rows, CASCADE_COLUMNS, title, ("period multiple",))
            yield f"they end near {cascade.limit:#.7g}{unit}"


CASCADE_COLUMNS: Columns = {
    "period multiple": lambda row: f"{row['multiple']} to {2 * row['multiple']}",
    "at": lambda row: f"{row['at']:#.7g}",
    "ratio": lambda row: "" if row["ratio"] is None else f"{row['ratio']:.3g}",
}


def _cascade_rows(cascade: Cascade) -> list[dict[str, Any]]:
    """Each doubling, with the ratio of the interval before it to that after it."""
    ratios = None, *cascade.ratios, None
    doublings = zip(cascade.multiples, cascade.parameters, ratios, strict=True)
    return [{"multiple": m, "at": p, "ratio": r} for m, p, r in doublings]


def _cascade_values(cascade: Cascade, over_speed: bool) -> dict[str, Any]:
    at, limit = ("frequencies_Hz", "limit_Hz") if over_speed else ("values", "limit")
    return {
        "period_multiples": list(cascade.multiples),
        at: list(cascade.parameters),
        "ratios": list(cascade.ratios),
        limit: cascade.limit,
    }


def _place_text(value: float, located_by: str) -> str:
    """A parameter in as many digits as it is right to."""
    return f"{value:#.6g}" if located_by == "shooting" else f"~{value:.4g}"


def _micrometres_text(lengths: list[float]) -> str:
    return ", ".join(number(1e6 * length, 4) for length in lengths)


def _branch_values(
    branch: PeriodicBranch, over: str, is_integrated: bool
) -> dict[str, Any]:
    values = [point.parameter for point in branch.points]
    levels = np.array([point.figures["dte_rms"] for point in branch.points])
    low, high = ("from_Hz", "to_Hz") if over == MESH_FREQUENCY else ("from", "to")
    return {
        "period_multiple": branch.multiple,
        "points": len(branch.points),
        "stable_points": sum(point.stable for point in branch.points),
        low: min(values),
        high: max(values),
        "largest_dte_rms_m": levels.max(axis=0).tolist(),
        "relative_error_of_rms": None if isnan(branch.error) else branch.error,
        "origin": branch.origin,
        "end": branch.reason,
        "closed": branch.closed,
        "bifurcations": [
            _bifurcation_entry(point, over, is_integrated)
            for point in branch.bifurcations
        ],
    }


def _bifurcation_entry(
    point: BranchPoint, over: str, is_integrated: bool
) -> dict[str, Any]:
    rms = point.figures["dte_rms"].tolist()
    name = "frequency_Hz" if over == MESH_FREQUENCY else "value"
    location_method = INTEGRATION_SCHEME if is_integrated else BALANCE_SCHEME
    location_method = location_method if isnan(point.refined_parameter) else "shooting"
    place = {name: point.best_parameter, "located_by": location_method}
    return {"kind": point.kind, **place, "dte_rms_m": rms}
