"""Motions of a machine that repeat over one figure of it, or over two."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import MISSING, dataclass
from functools import partial

from fegear.commands.rattle.bifurcation_result import (
    FIGURES,
    BifurcationResult,
    ExistenceResult,
)
from fegear.commands.rattle.existence import Plane, find_existence, plane_of
from fegear.commands.rattle.machine_studies import MachineStudy
from fegear.commands.rattle.orbit_search import (
    OrbitSearch,
    find_bifurcations,
)
from fegear.files.errors import InputError
from fegear.files.speed_ranges import parsed_limits
from fegear.studies.problem import Job, Task
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.study import Study
from lumped.common.options import Range
from lumped.rattle.branches import machine_with


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
            refusal_text = f"over = {text}; must be KEY=A:B"
            if name not in FIGURES:
                raise InputError(f"{refusal_text}, KEY one of {', '.join(FIGURES)}")
            limits[name] = parsed_limits(refusal_text, values)
        return limits

    @property
    def plane(self) -> Plane | None:
        """How curves over two figures are found."""
        figures_and_limits = [
            (FIGURES[name], limits) for name, limits in self.axes.items()
        ][1:]
        return (
            plane_of(self.search, *figures_and_limits[0])
            if figures_and_limits
            else None
        )

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
            self._require_varied_figure(name, limits)
        yield Task("values", self._find_bifurcations)

    def _require_varied_figure(self, name: str, limits: tuple[float, float]) -> None:
        """Refuse to vary what changes nothing, is given as well, or is impossible."""
        named, figure, overrides = self.named, FIGURES[name], self.machine.overrides
        over = f"{display_name(self, 'over')} {name}"
        fixed_refusal = partial(refusal, self.machine)
        if overrides.get(figure) is not None:
            raise fixed_refusal(name, f"{over} replaces it, leave it out")
        if figure == "restitution" and not named.machine.is_impact:
            raise InputError(f"{over}; belongs to impacts, {named.name} has none")
        if name == "kappa" and self.machine.restitution is not None:
            reason = f"belongs to impacts, {over} gives flanks a stiffness"
            raise fixed_refusal("restitution", reason)
        if figure == "ripple_phase" and not named.machine.ripple:
            raise InputError(f"{over}; {named.name} has no torque ripple")
        for limit in limits:
            try:
                machine_with(named.machine, figure, limit)
            except ValueError as error:
                raise InputError(f"{over}; {error}") from None

    def _find_bifurcations(self, job: Job) -> BifurcationResult | ExistenceResult:
        machine, plane = self.named.machine, self.plane
        computing = partial(job.compute, "orbits and long runs"), job.report
        if plane is None:
            diagram = find_bifurcations(machine, self.search, *computing)
            return BifurcationResult(self, self.named, diagram)
        curves = find_existence(machine, plane, *computing)
        return ExistenceResult(self, self.named, plane, curves)
