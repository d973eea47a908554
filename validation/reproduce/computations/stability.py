"""Intervals of speed in which vibration grows, over friction or another figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from fegear.parameter_maps import BENDING, FRICTION
from fegear.statics import Progress
from lumped.friction import ToothFriction, with_bending
from lumped.stability.intervals import Column, examined
from lumped.stability.periodic import periodic_system
from lumped.system import LumpedSystem
from validation.data_files import Speeds, parsed_speeds
from validation.reproduce.computations.parameter_studies import Over
from validation.reproduce.parts import Curve, Part, PartResult
from validation.reproduce.scene import Scene

Ratio = Annotated[float, Field(ge=0.0, lt=1.0)]
COMBINATION = r"[^.]+\.(low|high|width|expected_low|expected_high)"


@dataclass(frozen=True, kw_only=True)
class StabilityPart(Part):
    """Edges of unstable intervals, traced and by perturbation, over one figure.

    over : a key of the gear set, friction or friction_bending
    speeds : `A:B:STEP` in the unit of the figure
    friction, bending : coefficient and friction-bending ratio of the teeth
    """

    keys: ClassVar = (rf"value\d+\.{COMBINATION}",)

    kind: Literal["stability"] = "stability"
    over: Over
    speeds: Speeds
    friction: Ratio = 0.0
    bending: Ratio = 0.0

    def command(self, scene: Scene) -> Sequence[str]:
        low, high, step = (scene.unit_Hz * float(v) for v in self.speeds.split(":"))
        over = f"{self.over.key}={self.over.low:g}:{self.over.high:g}:{self.over.count}"
        words = ["stability", *scene.words, "--over", over]
        if self.over.key != FRICTION and self.friction:
            words += ["--friction", f"{self.friction:g}"]
        if self.over.key != BENDING and self.friction:
            words += ["--bending", f"{self.bending:g}"]
        return [*words, "--speeds", f"{low:.6g}:{high:.6g}:{step:.6g}"]


def stability(part: StabilityPart, scene: Scene, report: Progress) -> PartResult:
    """Found of valueN.COMBINATION., values counted from 1, in the unit of the figure:

    low, high, width : of the widest interval of that name
    expected_low, expected_high : of perturbation
    """
    unit = scene.unit_Hz
    speeds = [unit * value for value in parsed_speeds(part.speeds)]
    columns = []
    for done, value in enumerate(part.over.values):
        report("values", done, part.over.count)
        varying = periodic_system(_system_at(part, scene, value))
        columns.append(examined(varying, speeds))
    found = {
        f"value{number}.{name}": (frequency / unit,)
        for number, column in enumerate(columns, start=1)
        for name, frequency in _figures(column)
    }
    return PartResult(tuple(_curves(part, columns, unit)), found)


def _system_at(part: StabilityPart, scene: Scene, value: float) -> LumpedSystem:
    key, friction, bending = part.over.key, part.friction, part.bending
    if key in (FRICTION, BENDING):
        friction = value if key == FRICTION else friction
        bending = value if key == BENDING else bending
        system = scene.system
    else:
        system = scene.changed({key: value}).system
    rub = ToothFriction(friction, bending)
    bent = tuple(with_bending(each, rub) for each in system.excitations)
    return replace(system, excitations=bent, friction=(rub,) * len(bent))


def _figures(column: Column) -> Iterator[tuple[str, float]]:
    for kind in {each.kind for each in column.intervals}:
        own = [each for each in column.intervals if each.kind == kind]
        widest = max(own, key=lambda each: each.high - each.low)
        yield f"{kind}.low", widest.low
        yield f"{kind}.high", widest.high
        yield f"{kind}.width", widest.high - widest.low
    for each in column.expected:
        if each.unstable:
            yield f"{each.name}.expected_low", each.low
            yield f"{each.name}.expected_high", each.high


def _curves(
    part: StabilityPart, columns: Sequence[Column], unit: float
) -> Iterator[Curve]:
    """Traced edges as dots; those of perturbation on lines, for each combination."""
    values = part.over.values
    dots = [
        (value, edge / unit)
        for value, column in zip(values, columns, strict=True)
        for each in column.intervals
        for edge in (each.low, each.high)
    ]
    yield Curve("dots", tuple(dots), label="multipliers")
    names = sorted({c.name for column in columns for c in column.expected})
    lines: list[tuple[float, float]] = []
    for name in names:
        for edge in ("low", "high"):
            way = [_edge(column, name, edge) / unit for column in columns]
            lines += [*zip(values, way, strict=True), (np.nan, np.nan)]
    yield Curve("line", tuple(lines), label="perturbation")


def _edge(column: Column, name: str, edge: str) -> float:
    own = [getattr(each, edge) for each in column.expected if each.name == name]
    return float(own[0]) if own else np.nan
