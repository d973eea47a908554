"""The result of `fegear rattle bifurcation`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from fegear.commands.rattle.existence import Plane
from fegear.commands.rattle.machines import (
    NamedMachine,
    header_of,
    parameters,
    unit_name,
)
from fegear.commands.rattle.orbit_search import (
    BifurcationDiagram,
)
from fegear.files.codes import with_code
from fegear.studies.columns import meanings
from fegear.studies.page import Page, heading, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name
from fegear.studies.table import Table
from lumped.figures.rattle import axis_labels
from lumped.figures.rattle_branches import draw_curves, draw_orbit_branches
from lumped.rattle.branches import OrbitBranch
from lumped.rattle.curves import BifurcationCurve

FIGURES = {  # by the names of options, and of those that have none
    "delta": "damping",
    "epsilon": "eccentricity",
    "beta": "half_backlash",
    "kappa": "stiffness",
    "restitution": "restitution",
    "ripple": "ripple",
    "phase": "ripple_phase",
}

BRANCHES = "branch", "index", "liftoff", "stable", "largest_multiplier", "kind"

CURVES = "curve", "index", "bifurcation", "kind"


class OverFigures(StudyResult):
    """What is found over figures of a machine."""

    study: Any
    named: NamedMachine

    @property
    def columns(self) -> list[str]:
        """The figures with their units."""
        return [unit_name(FIGURES[name]) for name in self.study.axes]

    @property
    def labels(self) -> list[str]:
        """The figures in words."""
        return [
            FIGURES[name].replace("_", " ") + (" [rad]" if "_rad" in column else "")
            for name, column in zip(self.study.axes, self.columns, strict=True)
        ]

    @property
    def title(self) -> str:
        named, figures = self.named, [FIGURES[name] for name in self.study.axes]
        return f"{named.name}: {axis_labels(named.machine, *figures)}"

    @property
    def fixed(self) -> dict[str, Any]:
        """Figures but for those that vary."""
        figures = parameters(self.named.machine)
        return {k: v for k, v in figures.items() if k not in self.columns}

    @property
    def header(self) -> dict[str, str]:
        return {"machine": self.named.name, **header_of(self.fixed)}

    def legend(self, columns: Sequence[str]) -> dict[str, str]:
        return meanings("rattle bifurcation", *columns)


@dataclass(frozen=True, eq=False)
class BifurcationResult(OverFigures):
    """Branches of a named machine over a parameter, with long runs."""

    study: Any
    named: NamedMachine
    diagram: BifurcationDiagram

    @property
    def table(self) -> Table:
        """A row for each lift-off of each point of each branch, then of long runs."""
        names = (
            *("branch", "name", "index", *self.columns, "liftoff", "time_turns"),
            *("speed_rad_per_turn", "stable", "largest_multiplier", "kind"),
        )
        return Table(names, self._rows, self.header | self.legend(BRANCHES))

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for number, branch in enumerate(self.diagram.branches, start=1):
            name = branch.itinerary.name
            for index, point in enumerate(branch.points, start=1):
                for place, (time, speed) in enumerate(point.departures, start=1):
                    yield (
                        *(number, name, index, point.parameter, place, time, speed),
                        *(int(point.stable), point.largest, point.kind),
                    )
        settled = self.diagram.settled.tolist()
        for index, (value, time, speed) in enumerate(settled, start=1):
            yield 0, "long run", index, value, 1, time, speed, "", float("nan"), ""

    @cached_property
    def summary(self) -> dict[str, Any]:
        search, diagram = self.study.search, self.diagram
        low, high = search.limits
        return {
            **self.named.heading,
            **self.fixed,
            "over": self.columns[0],
            "from": low,
            "to": high,
            "branches": [_branch_entry(branch) for branch in diagram.branches],
            "long_runs": search.runs,
            "liftoffs_of_long_runs": len(diagram.settled),
            "undecided_long_runs": len(diagram.not_converged),
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        undecided = self.diagram.not_converged
        if undecided.size:
            yield with_code(
                "W24",
                f"{undecided.size} long runs that reached no attractor are left out, "
                f"at {self.columns[0]} from {undecided.min():.6g} to "
                f"{undecided.max():.6g}",
            )

    @property
    def figures(self) -> dict[str, Draw]:
        runs, limits = self.diagram.settled[:, [0, 2]], self.study.search.limits
        how = self.diagram.branches, runs, limits, self.labels[0], self.title
        return {"plot": partial(draw_orbit_branches, *how)}

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        yield (
            f"{values['over']} from {values['from']:g} to {values['to']:g}, "
            f"{pluralize(len(values['branches']), 'branch', 'branches')}"
        )
        if not values["branches"]:
            yield _no_orbit_text(self.study)
        for place, branch in enumerate(values["branches"], start=1):
            yield (
                f"branch {place}: {branch['name']}, "
                f"{pluralize(branch['points'], 'point', 'points')}, "
                f"{branch['stable_points']} of them stable, {branch['from']:.6g} to "
                f"{branch['to']:.6g}\n"
                f"  {branch['origin']}; ends: {branch['end']}"
            )
            for bifurcation in branch["bifurcations"]:
                time, speed = bifurcation["liftoffs"][0]
                yield (
                    f"  {bifurcation['value']:12.7g}  {bifurcation['kind']:<15} "
                    f"first lift-off at {time:.4f} turns, {speed:.4g} rad per turn"
                )


@dataclass(frozen=True, eq=False)
class ExistenceResult(OverFigures):
    """Curves of bifurcations of a named machine over two figures."""

    study: Any
    named: NamedMachine
    plane: Plane
    curves: tuple[BifurcationCurve, ...]

    @property
    def table(self) -> Table:
        """A row for each point of each curve."""
        names = (
            *("curve", "name", "bifurcation", "index", *self.columns),
            *("time_turns", "speed_rad_per_turn", "kind"),
        )
        return Table(names, self._rows, self.header | self.legend(CURVES))

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for number, curve in enumerate(self.curves, start=1):
            for index, point in enumerate(curve.points, start=1):
                yield (
                    *(number, curve.itinerary.name, curve.kind, index),
                    *(point.first, point.second, *point.departure, point.kind),
                )

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            **self.named.heading,
            **self.fixed,
            "over": self.columns,
            "curves": [_curve_entry(curve) for curve in self.curves],
        }

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": partial(draw_curves, self.curves, self.labels, self.title)}

    def page(self) -> Page:
        yield from heading(self.named)
        curves = self.summary["curves"]
        first, second = self.columns
        yield f"{first} and {second}, {pluralize(len(curves), 'curve', 'curves')}"
        if not curves:
            yield _no_orbit_text(self.study)
        for place, curve in enumerate(curves, start=1):
            both = ("({:.6g}, {:.6g})".format(*curve[key]) for key in ("from", "to"))
            yield (
                f"curve {place}: {curve['bifurcation']} of {curve['name']}, "
                f"{pluralize(curve['points'], 'point', 'points')}, "
                f"{' to '.join(both)}; {curve['end']}"
            )
            for meeting in curve["meetings"]:
                yield "  {} at ({:.7g}, {:.7g})".format(meeting["kind"], *meeting["at"])


def _no_orbit_text(study: Any) -> str:
    starts = display_name(study, "starts")
    return f"nothing was found at the values looked at; {starts} looks at more"


def _branch_entry(branch: OrbitBranch) -> dict[str, Any]:
    values = [point.parameter for point in branch.points]
    return {
        "name": branch.itinerary.name,
        "points": len(values),
        "stable_points": sum(point.stable for point in branch.points),
        "from": min(values),
        "to": max(values),
        "origin": branch.origin,
        "end": branch.reason,
        "bifurcations": [
            {
                "kind": p.kind,
                "value": p.parameter,
                "liftoffs": [*map(list, p.departures)],
            }
            for p in branch.bifurcations
        ],
    }


def _curve_entry(curve: BifurcationCurve) -> dict[str, Any]:
    first, last = curve.points[0], curve.points[-1]
    return {
        "name": curve.itinerary.name,
        "bifurcation": curve.kind,
        "points": len(curve.points),
        "from": [first.first, first.second],
        "to": [last.first, last.second],
        "end": curve.reason,
        "meetings": [
            {"kind": point.kind, "at": [point.first, point.second]}
            for point in curve.points
            if point.kind
        ],
    }
