"""Boundaries of a machine's basins: manifolds of saddles, and curves of grazing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from operator import itemgetter
from typing import Any

from fegear.commands.rattle.machine_studies import MachineStudy
from fegear.commands.rattle.machines import NamedMachine, header_of, parameters
from fegear.files.errors import InputError
from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, cell, heading
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from lumped.common.options import Range
from lumped.figures.rattle import axis_labels, draw_curves
from lumped.rattle.basins import BasinMap, basins_of, settle_grid
from lumped.rattle.basins import InitialGrid as Cells
from lumped.rattle.manifolds import (
    Fineness,
    Manifold,
    PlaneCurve,
    grazing_curve,
    grow_manifolds,
    saddles,
)
from lumped.rattle.orbits import Orbit, find_orbits
from lumped.rattle.return_map import DEFAULT_RETURNS

SADDLE = "saddle"  # of the keys of tasks
LEGEND = "curve", "motion", "returns_before", "branch", "length"


@dataclass(frozen=True, kw_only=True)
class Manifolds(
    MachineStudy,
    Study,
    command="rattle manifold",
    example="rattle manifold roots-scaled --grid 300 --plot manifolds.png",
):
    """Boundaries of basins: stable manifolds of saddles, and curves of grazing.

    Motions that start on a stable manifold lead to its saddle; its two sides lead to
    different motions. Lift-offs on the grazing curve just touch the lower flank next,
    and those of its pre-images some returns later. Motions that stick to a flank have
    neither.
    """

    orbit: str = setting(
        "",
        "Saddles of this motion only, such as P(1,1,0). [default: all]",
        parse=lambda text: text.replace(" ", ""),
    )
    max_liftoffs: int = setting(
        1,
        "Largest number of lift-offs from the upper flank in a period of the saddles.",
        Range(1, 12),
    )
    length: float = setting(
        20.0,
        "Length of each branch of a manifold [turns]; speeds are divided by 2 pi "
        "damping.",
        Range(above=0.0, most=10_000.0),
    )
    spacing: float = setting(
        0.01,
        "Largest distance between its points, in the same measure [turns].",
        Range(1e-5, 1.0),
    )
    preimages: int = setting(
        2,
        "Number of pre-images of the curve of lift-offs that graze the lower flank.",
        Range(0, 20),
    )
    unstable: bool = setting(False, "Also compute unstable manifolds.")
    grid: int | None = setting(
        None,
        "Cells per side of the basins in the background of the plot. [default: none]",
        Range(5, 6000),
    )

    def unused_options(self, outputs: Collection[str]) -> Iterator[tuple[str, str]]:
        if "plot" not in outputs:
            yield "grid", "needs the {plot} that shows the basins"

    def tasks(self) -> Iterator[Task]:
        machine = self.named.machine
        if machine.is_impact and machine.restitution == 0.0:
            raise InputError(
                f"{self.named.name}: restitution = 0; lift-offs have no pre-images "
                "where impacts lose all speed, manifolds and grazing curves need more"
            )
        all_orbits = find_orbits(machine, self.max_liftoffs, self.speeds)
        orbits = [o for o in saddles(all_orbits) if self.orbit in ("", o.name)]
        if self.orbit and not orbits:
            names = (
                ", ".join(sorted({saddle.name for saddle in saddles(all_orbits)}))
                or "none"
            )
            raise InputError(f"orbit = {self.orbit}; saddles that are found: {names}")
        for number, orbit in enumerate(orbits):
            yield Task(f"{SADDLE} {number}", partial(self._grow_manifolds, orbit))
        yield Task("grazing", self._grazing_curves)
        if self.grid is not None:
            yield Task("basins", partial(self._compute_basins, self.grid))

    @property
    def _fineness(self) -> Fineness:
        return Fineness(spacing=self.spacing)

    def _grow_manifolds(self, orbit: Orbit, job: Job) -> list[Manifold]:
        grown_manifolds: list[Manifold] = []
        for number, is_stable in enumerate((True, False)[: 1 + self.unstable]):
            job.report(f"manifolds of {orbit.name}", number, 1 + self.unstable)
            curve_arguments = orbit, is_stable, self.length, self._fineness
            grown_manifolds += grow_manifolds(self.named.machine, *curve_arguments)
        return grown_manifolds

    def _grazing_curves(self, job: Job) -> list[PlaneCurve]:
        machine, numbers = self.named.machine, range(self.preimages + 1)
        return [grazing_curve(machine, before, self._fineness) for before in numbers]

    def _compute_basins(self, side: int, job: Job) -> BasinMap:
        cells = Cells(side=side, velocity=self.speeds)
        compute = partial(job.compute, "tiles of cells")
        settled = settle_grid(self.named.machine, cells, DEFAULT_RETURNS, compute)
        return basins_of(self.named.machine, cells, DEFAULT_RETURNS, settled)

    def gather(self, results: Mapping[str, Any]) -> ManifoldsResult:
        grazing, basins = results["grazing"], results.get("basins")
        grown_manifolds = (results[key] for key in results if key.startswith(SADDLE))
        manifolds = [*chain.from_iterable(grown_manifolds)]
        return ManifoldsResult(self, self.named, manifolds, grazing, basins)


@dataclass(frozen=True, eq=False)
class ManifoldsResult(StudyResult):
    """Curves of a machine; grazing : the grazing curve and its pre-images."""

    study: Manifolds
    named: NamedMachine
    manifolds: list[Manifold]
    grazing: list[PlaneCurve]
    basins: BasinMap | None

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            **self.named.heading,
            **parameters(self.named.machine),
            "manifolds": [
                {
                    "motion": manifold.orbit.name,
                    "kind": _stability_name(manifold),
                    "liftoff": list(manifold.departure),
                    "branch": manifold.side,
                    "length": manifold.curve.length,
                    "points": len(manifold.curve.points),
                }
                for manifold in self.manifolds
            ],
            "grazing_curves": [
                {
                    "returns_before": before,
                    "length": curve.length,
                    "points": len(curve.points),
                }
                for before, curve in enumerate(self.grazing)
            ],
        }

    @property
    def table(self) -> Table:
        """A row for each point of each curve."""
        names = (
            *("curve", "motion", "kind", "returns_before", "branch", "length"),
            *("time_turns", "speed_rad_per_turn"),
        )
        named = self.named
        machine_header = header_of(parameters(named.machine))
        legend = meanings("rattle manifold", *LEGEND)
        return Table(
            names, self._rows, {"machine": named.name, **machine_header, **legend}
        )

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        curves = [
            (curve, "grazing", "grazing", before, 0)
            for before, curve in enumerate(self.grazing)
        ]
        curves += [
            (m.curve, m.orbit.name, _stability_name(m), 0, m.side)
            for m in self.manifolds
        ]
        for number, (curve, *labels) in enumerate(curves, 1):
            points = zip(curve.lengths.tolist(), curve.points.tolist(), strict=True)
            for length, (time, speed) in points:
                yield number, *labels, length, time, speed

    @property
    def figures(self) -> dict[str, Draw]:
        """Curves over basins where they are asked for."""
        curves = [
            (
                f"pre-image {before} of grazing" if before else "grazing",
                curve,
            )
            for before, curve in enumerate(self.grazing)
        ]
        curves += [
            (_manifold_name(_stability_name(m), m.orbit.name), m.curve)
            for m in self.manifolds
        ]
        marks = [manifold.departure for manifold in self.manifolds]
        title = f"{self.named.name}: {axis_labels(self.named.machine)}"
        curve_arguments = curves, marks, self.study.speeds, title, self.basins
        return {"plot": partial(draw_curves, *curve_arguments)}

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        rows = [
            {
                "curve": _manifold_name(manifold["kind"], manifold["motion"]),
                **dict(zip(("time", "speed"), manifold["liftoff"], strict=True)),
                **manifold,
            }
            for manifold in values["manifolds"]
        ]
        no_liftoff = {"time": None, "speed": None, "branch": None}
        for curve in values["grazing_curves"]:
            before = curve["returns_before"]
            name = f"pre-image {before} of it" if before else "grazing curve"
            rows.append({"curve": name, **no_liftoff, **curve})
        columns: Columns = {
            "curve": itemgetter("curve"),
            "at time\n[turns]": cell("time"),
            "speed\n[rad per turn]": cell("speed"),
            "branch": lambda row: (
                "" if row["branch"] is None else f"{row['branch']:+d}"
            ),
            "length": cell("length"),
            "points": lambda row: str(row["points"]),
        }
        yield RowTable(rows, columns)
        if not values["manifolds"]:
            yield "no saddle was found"


def _stability_name(manifold: Manifold) -> str:
    return "stable" if manifold.is_stable else "unstable"


def _manifold_name(kind: str, motion: str) -> str:
    return f"{kind} manifold of {motion}"
