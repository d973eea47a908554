"""Manifolds of a machine's saddles and grazing curves: computed, summed up, written."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fegear.errors import InputError
from fegear.rattle.machines import NamedMachine, figures_of, header_of
from fegear.result import Result
from lumped.csv_text import format_csv
from lumped.rattle.basins import Basins
from lumped.rattle.figure import draw_curves, words_of
from lumped.rattle.manifolds import (
    Curve,
    Fineness,
    Manifold,
    grazing_curve,
    grow_manifolds,
    saddles,
)
from lumped.rattle.orbits import find_orbits

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fegear.statics import Progress

LEGEND = {
    "curve": "from 1; motion: of the saddle, or the grazing curve",
    "returns_before": "of a grazing curve to the departure that grazes",
    "branch": "+1 or -1, on which side of the saddle it starts",
    "length": "speeds over 2 pi damping, times in turns; NaN parts pieces at jumps",
}


@dataclass(frozen=True, kw_only=True)
class CurveSearch:
    """Which curves are asked for.

    orbit : name of the saddles' motion, all if empty
    departures : of a period of the saddles, at most
    velocity : lowest and highest speed at which saddles are looked for
    length : of a branch, in the distances of `Fineness`
    preimages : of the grazing curve
    """

    orbit: str = ""
    departures: int = 1
    velocity: tuple[float, float]
    length: float = 20.0
    preimages: int = 2
    unstable: bool = False
    fineness: Fineness = field(default_factory=Fineness)


@dataclass(frozen=True, eq=False, repr=False)
class ManifoldsResult(Result):
    """Curves of a named machine; grazing : the grazing curve and its pre-images."""

    named: NamedMachine
    search: CurveSearch
    manifolds: tuple[Manifold, ...]
    grazing: tuple[Curve, ...]

    def csv(self) -> str:
        """A row for each point of each curve."""
        names = [
            *("curve", "motion", "kind", "returns_before", "branch", "length"),
            *("time_turns", "speed_rad_per_turn"),
        ]
        fixed = header_of(figures_of(self.named.machine))
        header = {"machine": self.named.name, **fixed, **LEGEND}
        return format_csv(names, self._rows(), header)

    def _rows(self) -> Iterator[list[object]]:
        number = 0
        for before, curve in enumerate(self.grazing):
            number += 1
            yield from _rows(curve, number, "grazing", "grazing", before, 0)
        for each in self.manifolds:
            number += 1
            kind = _kind(each)
            yield from _rows(each.curve, number, each.orbit.name, kind, 0, each.side)

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            **self.named.heading,
            **figures_of(self.named.machine),
            "manifolds": [
                {
                    "motion": each.orbit.name,
                    "kind": _kind(each),
                    "departure": list(each.departure),
                    "branch": each.side,
                    "length": each.curve.length,
                    "points": len(each.curve.points),
                }
                for each in self.manifolds
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

    def draw(self, basins: Basins | None = None) -> Figure:
        """Over basins where they are given."""
        curves = [
            (f"pre-image {before} of grazing" if before else "grazing", curve)
            for before, curve in enumerate(self.grazing)
        ]
        curves += [
            (f"{_kind(each)} manifold of {each.orbit.name}", each.curve)
            for each in self.manifolds
        ]
        marks = [each.departure for each in self.manifolds]
        title = f"{self.named.name}: {words_of(self.named.machine)}"
        return draw_curves(curves, marks, self.search.velocity, title, basins)


def _kind(manifold: Manifold) -> str:
    return "stable" if manifold.is_stable else "unstable"


def _rows(
    curve: Curve, number: int, motion: str, kind: str, before: int, branch: int
) -> Iterator[list[object]]:
    points = zip(curve.lengths.tolist(), curve.points.tolist(), strict=True)
    for length, (time, speed) in points:
        yield [number, motion, kind, before, branch, length, time, speed]


def find_manifolds(
    named: NamedMachine,
    search: CurveSearch,
    report: Progress = lambda what, done, total: None,
) -> ManifoldsResult:
    """Manifolds of the saddles that are found, and the grazing curve's pre-images.

    Raises InputError where no saddle has the name that is asked for, and where impacts
    lose all speed: then the return map has no inverse.
    """
    machine = named.machine
    if machine.is_impact and machine.restitution == 0.0:
        raise InputError(
            f"{named.name}: restitution = 0; departures have no pre-images where "
            "impacts lose all speed, manifolds and grazing curves need more"
        )
    orbits = saddles(find_orbits(machine, search.departures, search.velocity))
    names = sorted({orbit.name for orbit in orbits})
    if search.orbit and search.orbit not in names:
        raise InputError(
            f"--orbit = {search.orbit}; saddles that are found: "
            f"{', '.join(names) or 'none'}"
        )
    asked = [o for o in orbits if search.orbit in ("", o.name)]
    kinds = (True, False) if search.unstable else (True,)
    tasks = [(orbit, is_stable) for orbit in asked for is_stable in kinds]
    grown: list[Manifold] = []
    for done, (orbit, is_stable) in enumerate(tasks):
        report(f"manifolds of {orbit.name}", done, len(tasks))
        grown += grow_manifolds(
            machine, orbit, is_stable, search.length, search.fineness
        )
    grazing = tuple(
        grazing_curve(machine, before, search.fineness)
        for before in range(search.preimages + 1)
    )
    return ManifoldsResult(named, search, tuple(grown), grazing)
