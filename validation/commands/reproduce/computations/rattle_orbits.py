"""Orbits of machines that rattle: branches, curves over two figures, histories."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from fegear.commands.rattle.existence import Plane, find_existence
from fegear.commands.rattle.orbit_search import OrbitSearch, find_bifurcations
from lumped.common.progress import Progress
from lumped.continuation.bifurcations import stability_segments
from lumped.rattle.arcs import arcs_of, history_of
from lumped.rattle.attractors import CHAOTIC, QUIET, AttractorClassifier
from lumped.rattle.branches import GRAZING, OrbitBranch, machine_with
from lumped.rattle.curves import BifurcationCurve
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.orbits import find_orbits
from lumped.rattle.return_map import follow, iterate_map_points
from validation.commands.reproduce.machine_scene import MachineScene
from validation.commands.reproduce.parts import Curve, Part, PartResult, Style
from validation.study.data_files import STRICT, Number, Text

NAME = r"P\(\d+,\d+,\d+\)"
KIND = r"(fold|period doubling|grazing)"
Figure = Literal["damping", "eccentricity", "half_backlash", "stiffness", "restitution"]
TOUCH_TOLERANCE = 1e-3  # of the half backlash, from a flank that is grazed
BARELY = 1e-3  # of the speed of a start that may run quietly
GAP = math.nan, math.nan  # between stretches of one label
Count = Annotated[int, Field(strict=True, ge=0, le=10_000)]
Names = tuple[Text, ...]


@dataclass(frozen=True, kw_only=True)
class ParameterRange:
    """A figure of the machine that varies, from low to high."""

    __pydantic_config__ = STRICT

    figure: Figure
    low: Number
    high: Number

    @property
    def limits(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True, kw_only=True)
class OrbitSearchPart(Part):
    """Which orbits are looked for, see `OrbitSearch` of `rattle bifurcation`.

    names : of those that are drawn, all if left out
    """

    of_machine: ClassVar = True

    over: ParameterRange
    max_liftoffs: Count = 1
    starts: Count = 5
    doublings: Count = 0
    lowest: Number = 0.0
    highest: Number = 7.0
    names: Names = ()

    def quick(self) -> Self:
        return replace(self, starts=1, doublings=min(self.doublings, 1))

    def search(self, runs: int = 0) -> OrbitSearch:
        return OrbitSearch(
            figure=self.over.figure,
            limits=self.over.limits,
            max_liftoffs=self.max_liftoffs,
            velocity=(self.lowest, self.highest),
            starts=self.starts,
            runs=runs,
            doublings=self.doublings,
        )


@dataclass(frozen=True, kw_only=True)
class OrbitBranchesPart(OrbitSearchPart):
    """Branches of orbits by the speeds of their departures, and long runs."""

    keys: ClassVar = (f"{KIND} of {NAME}",)

    kind: Literal["orbit_branches"] = "orbit_branches"
    runs: Count = 0

    def quick(self) -> Self:
        return replace(super().quick(), runs=min(self.runs, 3))


@dataclass(frozen=True, kw_only=True)
class ExistencePart(OrbitSearchPart):
    """Curves of bifurcations over two figures; found are meetings of curves.

    slices : values of the second figure at which branches are followed over the first
    """

    keys: ClassVar = (rf"grazing fold of {NAME}\.(first|second)",)

    kind: Literal["existence"] = "existence"
    against: ParameterRange
    slices: Annotated[tuple[Number, ...], Field(min_length=1)]

    def quick(self) -> Self:
        return replace(super().quick(), slices=self.slices[:1])


@dataclass(frozen=True, kw_only=True)
class OrbitMotionsPart(Part):
    """Histories of motions that repeat, by name, the stable one of several."""

    keys: ClassVar = (f"{NAME} is (there|stable)",)
    of_machine: ClassVar = True

    kind: Literal["orbit_motions"] = "orbit_motions"
    names: Annotated[Names, Field(min_length=1)]
    highest: Number = 7.0
    turns: Count = 4

    def quick(self) -> Self:
        return replace(self, turns=1)


@dataclass(frozen=True, kw_only=True)
class SettledRattlePart(Part):
    """Histories of what departures at random settle to, each kind in its panel.

    The first of them barely departs, so that quiet motion is seen where it exists.
    """

    keys: ClassVar = ("kinds", QUIET, CHAOTIC, NAME)
    of_machine: ClassVar = True

    kind: Literal["settled_rattle"] = "settled_rattle"
    starts: Count = 40
    highest: Number = 7.0
    iterations: Annotated[int, Field(strict=True, ge=100, le=1_000_000)] = 20_000
    turns: Count = 20

    def quick(self) -> Self:
        return replace(self, starts=min(self.starts, 4), iterations=1000, turns=2)


def orbit_branches(
    part: OrbitBranchesPart, scene: MachineScene, report: Progress
) -> PartResult:
    """Stable stretches in full, unstable ones dashed; the values are bifurcations."""
    search = part.search(part.runs)
    result = find_bifurcations(scene.machine, search, report=report)
    parameters: dict[str, list[float]] = defaultdict(list)
    curves = []
    if len(result.settled):
        points = tuple((value, speed) for value, _, speed in result.settled.tolist())
        curves.append(Curve("points", points, label="long runs"))
    for branch in result.branches:
        name = branch.itinerary.name
        for point in branch.bifurcations:
            parameters[f"{point.kind} of {name}"].append(point.parameter)
        if not part.names or name in part.names:
            curves += _speeds(branch)
    return PartResult(tuple(curves), {k: tuple(v) for k, v in parameters.items()})


def _speeds(branch: OrbitBranch) -> Iterator[Curve]:
    for stable, points in stability_segments(branch.points):
        for flight in range(branch.itinerary.upper):
            yield Curve(
                "line" if stable else "dashed",
                (
                    *((p.parameter, p.departures[flight][1]) for p in points),
                    GAP,
                ),
                label=branch.itinerary.name,
            )


def existence(part: ExistencePart, scene: MachineScene, report: Progress) -> PartResult:
    plane = Plane(
        first=part.search(),
        second=part.against.figure,
        limits=part.against.limits,
        slices=part.slices,
        names=part.names,
    )
    every = find_existence(scene.machine, plane, report=report)
    coordinates: dict[str, list[float]] = defaultdict(list)
    curves, grazing = [], {c.itinerary.name for c in every if c.kind == GRAZING}
    for curve in every:
        name, flank = curve.itinerary.name, ""
        style: Style = "line"
        if curve.kind == GRAZING:
            flank = f", {_flank(scene.machine, plane, curve)}"
            # motions graze together, so that their curves lie on each other
            style = "line" if name == max(grazing) else "wide"
        points = (
            *((point.first, point.second) for point in curve.points),
            GAP,
        )
        curves.append(Curve(style, points, label=f"{curve.kind} of {name}{flank}"))
        for point in curve.points:
            if point.kind == "grazing fold":
                coordinates[f"{point.kind} of {name}.first"].append(point.first)
                coordinates[f"{point.kind} of {name}.second"].append(point.second)
    return PartResult(tuple(curves), {k: tuple(v) for k, v in coordinates.items()})


def _flank(machine: Machine, plane: Plane, grazing: BifurcationCurve) -> str:
    """Which flank a motion grazes, seen in the middle of the curve."""
    point = grazing.points[len(grazing.points) // 2]
    machine = machine_with(machine, plane.first.figure, point.first)
    machine = machine_with(machine, plane.second, point.second)
    path = follow(machine, point.departure, 2)
    lowest = history_of(machine, arcs_of(machine, path))[:, 1].min()
    lower = lowest < (TOUCH_TOLERANCE - 1.0) * machine.half_backlash
    return "lower flank" if lower else "upper flank"


def orbit_motions(
    part: OrbitMotionsPart, scene: MachineScene, report: Progress
) -> PartResult:
    """Values are 1 where a motion is there, and where it is stable, else 0."""
    machine = scene.machine
    orbits = find_orbits(machine, 1, (0.0, part.highest))
    curves: list[Curve] = []
    values: dict[str, tuple[float, ...]] = {}
    for name in part.names:
        named_orbits = sorted(
            (o for o in orbits if o.name == name), key=lambda o: not o.stable
        )
        values[f"{name} is there"] = (float(bool(named_orbits)),)
        values[f"{name} is stable"] = (
            float(bool(named_orbits) and named_orbits[0].stable),
        )
        if named_orbits:
            curves += _history(machine, named_orbits[0].departures[0], part.turns, name)
    return PartResult(tuple(curves), values)


def _history(
    machine: Machine, departure: Sequence[float], turns: int, name: str
) -> Iterator[Curve]:
    """Relative rotations from a departure on, and both flanks, in a panel."""
    count = 2
    path = follow(machine, departure, count)
    while np.isfinite(path).all() and path[-1, 0] - path[0, 0] < turns:
        count *= 2
        path = follow(machine, departure, count)
    history = history_of(machine, arcs_of(machine, path))
    history[:, 0] -= np.floor(history[0, 0])
    history = history[history[:, 0] <= turns]
    yield Curve("line", tuple(map(tuple, history.tolist())), panel=name)
    yield _flanks(machine, turns, name)


def settled_rattle(
    part: SettledRattlePart, scene: MachineScene, report: Progress
) -> PartResult:
    """Count the starts that settle to each kind, and the kinds."""
    machine = scene.machine
    random = np.random.default_rng(0)
    starts = random.uniform((0.0, 0.0), (1.0, part.highest), (part.starts, 2))
    starts[0, 1] *= BARELY
    report("settled motions", 0, 1)
    settled = iterate_map_points(machine, starts, part.iterations)
    naming = AttractorClassifier(machine, part.iterations)
    numbers = naming.sort(settled)[0].tolist()
    curves: list[Curve] = []
    counts: dict[str, float] = {QUIET: 0.0, CHAOTIC: 0.0}
    for number, attractor in enumerate(naming.attractors):
        name = attractor.name
        panel = name if name not in counts or not counts[name] else f"{name}, another"
        counts[name] = counts.get(name, 0.0) + numbers.count(number)
        if name == QUIET:
            curves += _quiet_path(machine, part.turns)
        else:
            curves += _history(machine, attractor.point, part.turns, panel)
    counts["kinds"] = float(len(naming.attractors))
    return PartResult(tuple(curves), {k: (v,) for k, v in counts.items()})


def _quiet_path(machine: Machine, turns: int) -> Iterator[Curve]:
    """Flanks that stay together."""
    t = np.linspace(0.0, turns, 100 * turns)
    x = machine.half_backlash + 0.0 * t
    if not machine.is_impact:
        x += machine.arrays.offset
        for wave, order in zip(
            machine.forced(2.0 * machine.stiffness),
            (1, machine.ripple_order),
            strict=True,
        ):
            x += (wave * np.exp(1j * TURN * order * t)).real
    yield Curve("line", tuple(zip(t.tolist(), x.tolist(), strict=True)), panel=QUIET)
    yield _flanks(machine, turns, QUIET)


def _flanks(machine: Machine, turns: int, name: str) -> Curve:
    """Curve of the edges of the play."""
    play, end = machine.half_backlash, float(turns)
    points = (0.0, play), (end, play), GAP, (0.0, -play), (end, -play)
    return Curve("dotted", points, panel=name)
