"""Motions of a machine that repeat over one figure of it, or over two."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import MISSING, dataclass
from functools import cached_property, partial
from typing import Any

from fegear.commands.rattle.existence import Plane, find_existence, plane_of
from fegear.commands.rattle.machine_studies import MachineStudy
from fegear.commands.rattle.machines import (
    NamedMachine,
    header_of,
    parameters,
    unit_name,
)
from fegear.commands.rattle.orbit_search import (
    BifurcationDiagram,
    OrbitSearch,
    find_bifurcations,
)
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.speed_ranges import limits_of
from fegear.studies.columns import meanings
from fegear.studies.page import Page, heading, pluralize
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from lumped.common.options import Range
from lumped.figures.rattle import axis_labels
from lumped.figures.rattle_branches import draw_curves, draw_orbit_branches
from lumped.rattle.branches import OrbitBranch, machine_with
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


@dataclass(frozen=True, kw_only=True)
class OrbitBifurcations(
    MachineStudy,
    Study,
    command="rattle bifurcation",
    example="rattle bifurcation roots-scaled --over delta=0.5:0.75 --plot b.png",
):
    """Periodic motions over a parameter: where they begin, double and graze.

    Branches of P(m, n+, n-), stable or not, are followed by arc length from the motions
    at some values, with folds, period doublings and grazes, and drawn together with the
    attractors of long runs. With --output results are stored in FILE.partial until the
    file is written; --resume continues from there.

    Over two parameters, the curves of these bifurcations, which bound where motions
    exist.
    """

    resumes = True
    unit = "value"

    over: tuple[str, ...] = setting(
        MISSING,
        "Parameter of the machine that varies, and its range: "
        f"{', '.join(FIGURES)}. Give it twice for the bifurcations over two.",
        metavar="KEY=A:B",
    )
    max_liftoffs: int = setting(
        2,
        "Largest number of lift-offs from the upper flank in a period of the "
        "motions from which branches are followed.",
        Range(1, 12),
    )
    starts: int = setting(
        5,
        "Number of values of the parameter, besides both ends, at which motions "
        "are searched as starts of branches.",
        Range(1, 1000),
    )
    doublings: int = setting(
        1,
        "Largest number of period doublings from one branch to others.",
        Range(0, 6),
    )
    runs: int | None = setting(
        None,
        "Number of values of the parameter at which long runs from a grid of "
        "lift-offs are drawn with the branches. [default: 200 over one "
        "parameter]",
        Range(0, 100_000),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.over) not in (1, 2):
            raise InputError(f"over = {len(self.over)}; one or two are allowed")
        if len(self.axes) < len(self.over):
            raise InputError(f"over {next(iter(self.axes))}; is given twice")

    def unused_options(self, outputs: Collection[str]) -> Iterator[tuple[str, str]]:
        if len(self.over) > 1:
            yield "runs", "belongs to one {over}"

    @property
    def axes(self) -> dict[str, tuple[float, float]]:
        """Limits by the names of one or two figures."""
        limits = {}
        for text in self.over:
            name, _, values = text.partition("=")
            wrong = f"over = {text}; must be KEY=A:B"
            if name not in FIGURES:
                raise InputError(f"{wrong}, KEY one of {', '.join(FIGURES)}")
            limits[name] = limits_of(wrong, values)
        return limits

    @property
    def plane(self) -> Plane | None:
        """How curves over two figures are found."""
        others = [(FIGURES[name], limits) for name, limits in self.axes.items()][1:]
        return plane_of(self.search, *others[0]) if others else None

    @property
    def search(self) -> OrbitSearch:
        """How branches over the first figure are found."""
        name, limits = next(iter(self.axes.items()))
        return OrbitSearch(
            figure=FIGURES[name],
            limits=limits,
            max_liftoffs=self.max_liftoffs,
            velocity=self.speeds,
            starts=self.starts,
            runs=OrbitSearch.runs if self.runs is None else self.runs,
            doublings=self.doublings,
        )

    def tasks(self) -> Iterator[Task]:
        for name, limits in self.axes.items():
            self._require(name, limits)
        yield Task("values", self._found)

    def _require(self, name: str, limits: tuple[float, float]) -> None:
        """Refuse to vary what changes nothing, is given as well, or is impossible."""
        named, figure, overrides = self.named, FIGURES[name], self.machine.overrides
        over = f"{display_name(self, 'over')} {name}"
        fixed = partial(refusal, self.machine)
        if overrides.get(figure) is not None:
            raise fixed(name, f"{over} replaces it, leave it out")
        if figure == "restitution" and not named.machine.is_impact:
            raise InputError(f"{over}; belongs to impacts, {named.name} has none")
        if name == "kappa" and self.machine.restitution is not None:
            reason = f"belongs to impacts, {over} gives flanks a stiffness"
            raise fixed("restitution", reason)
        if figure == "ripple_phase" and not named.machine.ripple:
            raise InputError(f"{over}; {named.name} has no torque ripple")
        for limit in limits:
            try:
                machine_with(named.machine, figure, limit)
            except ValueError as error:
                raise InputError(f"{over}; {error}") from None

    def _found(self, job: Job) -> BifurcationResult | ExistenceResult:
        machine, plane = self.named.machine, self.plane
        how = partial(job.compute, "orbits and long runs"), job.report
        if plane is None:
            diagram = find_bifurcations(machine, self.search, *how)
            return BifurcationResult(self, self.named, diagram)
        curves = find_existence(machine, plane, *how)
        return ExistenceResult(self, self.named, plane, curves)


class OverFigures(StudyResult):
    """What is found over figures of a machine."""

    study: OrbitBifurcations
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


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationResult(OverFigures):
    """Branches of a named machine over a parameter, with long runs."""

    study: OrbitBifurcations
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
            "branches": [_of_branch(branch) for branch in diagram.branches],
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
            yield _none_found(self.study)
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


@dataclass(frozen=True, eq=False, repr=False)
class ExistenceResult(OverFigures):
    """Curves of bifurcations of a named machine over two figures."""

    study: OrbitBifurcations
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
            "curves": [_of_curve(curve) for curve in self.curves],
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
            yield _none_found(self.study)
        for place, curve in enumerate(curves, start=1):
            both = ("({:.6g}, {:.6g})".format(*curve[key]) for key in ("from", "to"))
            yield (
                f"curve {place}: {curve['bifurcation']} of {curve['name']}, "
                f"{pluralize(curve['points'], 'point', 'points')}, "
                f"{' to '.join(both)}; {curve['end']}"
            )
            for meeting in curve["meetings"]:
                yield "  {} at ({:.7g}, {:.7g})".format(meeting["kind"], *meeting["at"])


def _none_found(study: OrbitBifurcations) -> str:
    starts = display_name(study, "starts")
    return f"nothing was found at the values looked at; {starts} looks at more"


def _of_branch(branch: OrbitBranch) -> dict[str, Any]:
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


def _of_curve(curve: BifurcationCurve) -> dict[str, Any]:
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
