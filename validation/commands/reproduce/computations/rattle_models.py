"""Quiet motion of machines over a figure of theirs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from fegear.commands.rattle.machines import load_machine
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.common.progress import Progress
from lumped.rattle.assembly import Assembly
from lumped.rattle.permanent_contact import quiet_motion
from lumped.rattle.receptances import critical_by_receptances
from validation.commands.reproduce.machine_scene import MachineScene
from validation.commands.reproduce.parts import (
    Curve,
    Part,
    PartResult,
    Style,
    first_largest,
)
from validation.study.data_files import STRICT, Flag, Number, Text


@dataclass(frozen=True, kw_only=True)
class Over:
    """A figure of the machine's file that is varied; logarithm : to base 10, shown."""

    __pydantic_config__ = STRICT

    key: Text
    low: Number
    high: Number
    count: Annotated[int, Field(strict=True, ge=2, le=100_000)]
    logarithm: Flag = False

    @property
    def values(self) -> Iterator[tuple[float, float]]:
        """Places on the axis, and the figure."""
        ends = np.array([self.low, self.high])
        if self.logarithm:
            ends = np.log10(ends)
        for coordinate in np.linspace(ends[0], ends[1], self.count):
            yield (
                float(coordinate),
                float(10.0**coordinate if self.logarithm else coordinate),
            )


@dataclass(frozen=True, kw_only=True)
class QuietPart(Part):
    """Quiet motion: the critical eccentricity or a rotation over a parameter.

    shows : critical eccentricity [rad], or the largest rotation [rad] of the part that
        is named, or of one against another; with_error : the transmission error on top
    scale : of the curve; percent are those by which the absorber changes it
    bound : a machine whose critical eccentricity is drawn as a line, by eq. 2.36
    tuned : place on the axis where the absorber is tuned to the turn, drawn as a line
    """

    keys: ClassVar = (
        *("own", "closed", "trend"),
        *("least", "largest", "least_at", "largest_at"),
    )
    of_machine: ClassVar = True

    kind: Literal["quiet"] = "quiet"
    over: Over
    shows: Annotated[tuple[Text, ...], Field(min_length=1, max_length=2)]
    with_error: Flag = False
    scale: Literal["rad", "log10", "percent"] = "rad"
    style: Style = "line"
    bound: str = ""
    tuned: Number | None = None

    def quick(self) -> Self:
        return replace(self, over=replace(self.over, count=min(self.over.count, 3)))

    def command(self, scene: MachineScene) -> Sequence[str]:
        return () if scene.overrides else ("rattle", "critical", scene.name)


def quiet(part: QuietPart, scene: MachineScene, report: Progress) -> PartResult:
    """Extremes, where they are, and what the machine itself has.

    closed : the critical eccentricity of the machine itself in closed form
    trend : 1 where it rises throughout, -1 where it falls, 0 where it does neither
    """
    points, drawn = [], []
    for done, (place, value) in enumerate(part.over.values):
        report("quiet motion", done, part.over.count)
        assembly = scene.changed({part.over.key: value}).assembly
        points.append((place, _shown_quantity(part, assembly)))
        drawn.append((place, _scaled_quantity(part, assembly, points[-1][1])))
    x, y = np.array(points).T
    values: Mapping[str, float] = {
        "own": _shown_quantity(part, scene.assembly),
        "closed": critical_by_receptances(scene.assembly),
        "least": float(y.min()),
        "largest": float(y.max()),
        "least_at": float(x[first_largest(-y)]),
        "largest_at": float(x[first_largest(y)]),
        "trend": float((np.diff(y) > 0.0).all()) - float((np.diff(y) < 0.0).all()),
    }
    lines = tuple(_lines(part, scene, np.array(drawn)))
    label = "with the absorber" if lines else ""
    curves = Curve(part.style, tuple(drawn), label=label), *lines
    return PartResult(curves, {name: (value,) for name, value in values.items()})


def _lines(part: QuietPart, scene: MachineScene, drawn: Array) -> Iterator[Curve]:
    """Lines across the panel, over all points (n, 2) that are drawn."""
    (left, low), (right, high) = drawn.min(axis=0), drawn.max(axis=0)
    if part.bound:
        bound = critical_by_receptances(load_machine(part.bound).assembly)
        y = _scaled_quantity(part, scene.assembly, bound)
        ends = (float(left), y), (float(right), y)
        yield Curve("dotted", ends, label="one degree of freedom, eq. 2.36")
    if part.tuned is not None:
        ends = (part.tuned, float(low)), (part.tuned, float(high))
        yield Curve("dotted", ends, label="absorber tuned to the turn, r1 = r2")


def _shown_quantity(part: QuietPart, assembly: Assembly) -> float:
    motion = quiet_motion(assembly)
    if part.shows == ("critical",):
        return motion.critical_eccentricity
    one, other = (*part.shows, None)[:2]
    return motion.largest_rotation(
        require_present(one, "shows"), other, part.with_error
    )


def _scaled_quantity(part: QuietPart, assembly: Assembly, value: float) -> float:
    if part.scale == "log10":
        return math.log10(value)
    if part.scale == "percent":
        return 100.0 * (
            value / _shown_quantity(part, replace(assembly, absorber=None)) - 1.0
        )
    return value
