"""Basins of attraction of machines, their boundaries, and how they change."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from lumped.common.array_types import Array, Indices
from lumped.common.progress import Progress
from lumped.rattle.attractors import (
    CHAOTIC,
    QUIET,
    RattleAttractor,
    classify_attractors,
)
from lumped.rattle.machine import Machine
from lumped.rattle.manifolds import Fineness, grazing_curve, grow_manifolds, saddles
from lumped.rattle.orbits import Orbit, find_orbits
from lumped.rattle.return_map import follow, iterate_map_points
from validation.commands.reproduce.machine_scene import MachineScene
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.study.data_files import Flag, Number, Positive

COUNT_OF_NAME = re.compile(r" [b-z]$| \d+$")  # of motions of one name
Side = Annotated[int, Field(strict=True, ge=5, le=2000)]
Speeds = tuple[Number, Number]


@dataclass(frozen=True, kw_only=True)
class BasinsPart(Part):
    """Which motion departures lead to, over their time and speed.

    grid : cells a side; iterations : returns after which a motion counts as chaotic
    marks : whether departures of the motions are marked
    """

    keys: ClassVar = (r"(fraction|number)\.(quiet|chaotic|P\(\d+,\d+,\d+\))",)
    of_machine: ClassVar = True

    kind: Literal["basins"] = "basins"
    grid: Side = 80
    velocity: Speeds = (0.0, 7.0)
    times: Speeds = (0.0, 1.0)
    iterations: Annotated[int, Field(strict=True, ge=100, le=1_000_000)] = 1499
    marks: Flag = True

    def quick(self) -> Self:
        return replace(self, grid=8, iterations=min(self.iterations, 500))

    def command(self, scene: MachineScene) -> Sequence[str]:
        low, high = self.velocity
        options = (
            *("--grid", str(self.grid), "--velocity", f"{low:g}:{high:g}"),
            *("--iterations", str(self.iterations)),
        )
        return ("rattle", "basin", scene.name, *_machine_options(scene), *options)


def _machine_options(scene: MachineScene) -> list[str]:
    """Options of the figures that are edited."""
    names = {
        "machine.damping": "--delta",
        "machine.eccentricity_rad": "--epsilon",
        "machine.half_backlash_rad": "--beta",
        "machine.stiffness": "--kappa",
        "machine.restitution": "--restitution",
    }
    options = [(names[key], value) for key, value in scene.overrides.items()]
    return [word for name, value in options for word in (name, f"{value:g}")]


def _cell_centres(part: BasinsPart) -> Array:
    """Times and speeds at the centres of cells (c, 2)."""
    fraction = (np.arange(part.grid) + 0.5) / part.grid
    times, speeds = (
        low + fraction * (high - low) for low, high in (part.times, part.velocity)
    )
    return np.stack(np.meshgrid(times, speeds), axis=-1).reshape(-1, 2)


def _settled_attractors(
    machine: Machine, part: BasinsPart, cells: Array
) -> tuple[tuple[RattleAttractor, ...], Indices]:
    settled = iterate_map_points(machine, cells, part.iterations)
    classification = classify_attractors(
        machine, part.iterations, settled, only_settled=False
    )
    return classification[:2]


def basins(part: BasinsPart, scene: MachineScene, report: Progress) -> PartResult:
    """Parts of the cells that lead to motions of a name, and their number."""
    report("basins", 0, 1)
    cells = _cell_centres(part)
    attractors, which = _settled_attractors(scene.machine, part, cells)
    curves, values = [], dict[str, tuple[float, ...]]()
    for number in range(-1, len(attractors)):
        basin_cells = cells[which == number]
        name = attractors[number].name if number >= 0 else "not clear"
        if len(basin_cells):
            curves.append(Curve("cells", _points(basin_cells), label=name))
    for name in {COUNT_OF_NAME.sub("", attractor.name) for attractor in attractors}:
        numbers = [
            i
            for i, attractor in enumerate(attractors)
            if COUNT_OF_NAME.sub("", attractor.name) == name
        ]
        values[f"fraction.{name}"] = (float(np.mean(np.isin(which, numbers))),)
        values[f"number.{name}"] = (float(len(numbers)),)
    if part.marks:
        curves += _attractor_marks(scene.machine, attractors)
    return PartResult(tuple(curves), values)


def _attractor_marks(
    machine: Machine, attractors: Sequence[RattleAttractor]
) -> list[Curve]:
    """Departures of periodic motions, and a chaotic one followed for a while."""
    marks, chaos = [], []
    for attractor in attractors:
        if attractor.period:
            if attractor.name != QUIET:
                marks.append(np.array([attractor.point]))
        elif attractor.name.startswith(CHAOTIC):
            path = follow(machine, attractor.point, 1500)[:, :2]
            chaos.append(np.stack([path[:, 0] % 1.0, path[:, 1]], axis=1))
    curves = (
        [Curve("points", _points(np.vstack(chaos)), label="chaos")] if chaos else []
    )
    if marks:
        curves.append(Curve("crosses", _points(np.vstack(marks)), label="attractors"))
    return curves


def _points(points: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple((float(t), float(v)) for t, v in points)


@dataclass(frozen=True, kw_only=True)
class BoundariesPart(Part):
    """Stable manifolds of saddles, and the grazing curve with its pre-images.

    orbits : names of the saddles; length : of each branch, see `Fineness`
    preimages : of the grazing curve, none if negative; velocity : that is looked at
    locate : whether all orbits are marked, with what is found of them
    """

    keys: ClassVar = (
        r"(time|speed|largest)\.P\(\d+,\d+,\d+\)",
        *("boundary", "graze_highest"),
    )
    of_machine: ClassVar = True

    kind: Literal["boundaries"] = "boundaries"
    orbits: tuple[str, ...] = ()
    length: Positive = 20.0
    preimages: Annotated[int, Field(ge=-1, le=9)] = -1
    velocity: Speeds = (0.0, 7.0)
    times: Speeds = (0.0, 1.0)
    locate: Flag = False

    def quick(self) -> Self:
        return replace(self, length=1.0, preimages=min(self.preimages, 1))

    def command(self, scene: MachineScene) -> Sequence[str]:
        return (
            *("rattle", "manifold", scene.name, *_machine_options(scene)),
            *("--length", f"{self.length:g}"),
        )


def boundaries(
    part: BoundariesPart, scene: MachineScene, report: Progress
) -> PartResult:
    """Times and speeds of orbits, and the highest speed of grazing.

    boundary : part of points on the manifolds next to which departures settle to
        different motions on both sides
    """
    machine, curves = scene.machine, []
    values: dict[str, tuple[float, ...]] = {}
    for returns_before in range(part.preimages + 1):
        curve = grazing_curve(machine, returns_before, Fineness())
        label = (
            f"pre-image {returns_before} of grazing" if returns_before else "grazing"
        )
        if returns_before == 0:
            values["graze_highest"] = (float(np.nanmax(curve.points[:, 1])),)
        curves.append(_curve_in_picture(part, curve.points, label))
    orbits = find_orbits(machine, 1, (0.0, 7.0)) if part.orbits or part.locate else []
    parts_of_boundary: list[float] = []
    for orbit in saddles(orbits):
        if orbit.name not in part.orbits:
            continue
        report(f"manifolds of {orbit.name}", 0, 1)
        for manifold in grow_manifolds(machine, orbit, True, part.length, Fineness()):
            label = f"stable manifold of {orbit.name}"
            curves.append(_curve_in_picture(part, manifold.curve.points, label))
            parts_of_boundary += _parts_basins(machine, manifold.curve.points)
    if parts_of_boundary:
        values["boundary"] = (float(np.mean(parts_of_boundary)),)
    if part.locate:
        curves += _orbit_marks(orbits, values)
    return PartResult(tuple(curves), values)


def _orbit_marks(
    orbits: Sequence[Orbit], values: dict[str, tuple[float, ...]]
) -> list[Curve]:
    curves = []
    for kind in ("stable", "unstable"):
        group = [o for o in orbits if o.stable == (kind == "stable")]
        if group:
            points = np.array([orbit.departures[0] for orbit in group])
            style: Literal["crosses", "circles"] = (
                "crosses" if kind == "stable" else "circles"
            )
            curves.append(Curve(style, _points(points), label=f"{kind} orbits"))
    for name in {orbit.name for orbit in orbits}:
        group = [orbit for orbit in orbits if orbit.name == name]
        values[f"time.{name}"] = tuple(o.departures[0][0] for o in group)
        values[f"speed.{name}"] = tuple(o.departures[0][1] for o in group)
        sizes = (max(map(abs, o.multipliers)) for o in group)
        values[f"largest.{name}"] = tuple(float(size) for size in sizes)
    return curves


def _curve_in_picture(part: BoundariesPart, points: np.ndarray, label: str) -> Curve:
    """Inside the picture, parted where it leaves it or goes round the turn."""
    (first, last), (low, high) = part.times, part.velocity
    is_inside = (points[:, 0] >= first) & (points[:, 0] <= last)
    is_inside &= (points[:, 1] >= low) & (points[:, 1] <= high)
    shown = np.where(is_inside[:, None], points, np.nan)
    jump_indices = np.flatnonzero(np.abs(np.diff(shown[:, 0])) > 0.5) + 1
    shown = np.insert(shown, jump_indices, np.nan, axis=0)
    shown = np.vstack([shown, [[np.nan, np.nan]]])  # apart from the next of its name
    is_gap = np.isnan(shown[:, 0])
    is_repeated_gap = np.concatenate([[False], is_gap[1:] & is_gap[:-1]])
    return Curve("line", _points(shown[~is_repeated_gap]), label=label)


def _parts_basins(machine: Machine, points: np.ndarray) -> list[float]:
    """Whether departures 1e-6 from points of a manifold, on both of its sides,
    settle to different motions."""
    points_of_manifold = points[5:-5:40]
    tangents = points[6:-4:40] - points_of_manifold
    normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    lengths = np.hypot(*normals.T)
    is_regular = (lengths > 0.0) & (lengths < 0.5) & (points_of_manifold[:, 1] > 0.1)
    normals, points_of_manifold = (
        1e-6 * normals[is_regular] / lengths[is_regular][:, None],
        points_of_manifold[is_regular],
    )
    periods_above, periods_below = (
        iterate_map_points(machine, points_of_manifold + sign * normals, 1499).period
        for sign in (1, -1)
    )
    return [float(a != b) for a, b in zip(periods_above, periods_below, strict=True)]


@dataclass(frozen=True, kw_only=True)
class LimitPart(Part):
    """Part of the cells that lead elsewhere with a stiffness than in the impact limit,
    quiet or not, over the logarithm of the stiffness."""

    keys: ClassVar = ("last", "falls", "order")
    of_machine: ClassVar = True

    kind: Literal["limit"] = "limit"
    exponents: tuple[Number, ...]
    grid: Side = 60
    velocity: Speeds = (0.0, 7.0)

    def quick(self) -> Self:
        return replace(self, exponents=self.exponents[:2], grid=8)


def limit(part: LimitPart, scene: MachineScene, report: Progress) -> PartResult:
    """The last part, whether parts fall throughout, and the power of the
    stiffness by which they do."""
    basins_part = BasinsPart(grid=part.grid, velocity=part.velocity)
    cells = _cell_centres(basins_part)
    impact = _is_quiet(*_settled_attractors(scene.machine, basins_part, cells))
    points = []
    for done, exponent in enumerate(part.exponents):
        report("stiffness", done, len(part.exponents))
        machine = replace(scene.machine, stiffness=10.0**exponent)
        disagreement = float(
            np.mean(
                _is_quiet(*_settled_attractors(machine, basins_part, cells)) != impact
            )
        )
        points.append((float(exponent), disagreement))
    x, y = np.array(points).T
    slope = np.polyfit(x, np.log10(np.maximum(y, 1e-12)), 1)[0]
    values: Mapping[str, tuple[float, ...]] = {
        "last": (float(y[-1]),),
        "falls": (float((np.diff(y) < 0.0).all()),),
        "order": (float(slope),),
    }
    shown = tuple((a, float(np.log10(max(b, 1e-12)))) for a, b in points)
    return PartResult((Curve("line", shown), Curve("dots", shown)), values)


def _is_quiet(
    attractors: Sequence[RattleAttractor], which: Indices
) -> NDArray[np.bool_]:
    quiet = [i for i, attractor in enumerate(attractors) if attractor.name == QUIET]
    return np.isin(which, quiet)
