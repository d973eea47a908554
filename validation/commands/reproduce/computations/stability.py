"""Intervals of speed in which vibration grows, over friction or another figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

import numpy as np

from lumped.common.progress import Progress
from lumped.stability.combinations import combinations
from lumped.stability.intervals import StabilityScan, scan_stability
from lumped.stability.periodic_system import PeriodicSystem, periodic_system
from validation.commands.reproduce.computations.parameter_studies import Over
from validation.commands.reproduce.parts import Curve, Part, PartResult, Style
from validation.commands.reproduce.scene import CONTACT_RATIO, Scene
from validation.study.data_files import Flag, Speeds, few_speeds, parsed_speeds

COMBINATION = r"[^.]+\.(expected_)?(low|high|width)"


@dataclass(frozen=True, kw_only=True)
class StabilityPart(Part):
    """Edges of unstable intervals, traced and by perturbation, over one figure.

    over : a key of the gear set, friction, friction_bending or contact_ratio
    speeds : `A:B:STEP` in the unit of the figure
    traced : whether multipliers are found, else perturbation alone
    only : names of combinations that are drawn, each in a panel; all in one if empty
    """

    keys: ClassVar = (
        rf"value\d+\.{COMBINATION}",
        r"[^.]+\.(expected_)?widest_at",
    )

    kind: Literal["stability"] = "stability"
    over: Over
    speeds: Speeds
    traced: Flag = True
    only: tuple[str, ...] = ()

    def quick(self) -> Self:
        speeds = few_speeds(self.speeds, 30)
        return replace(self, over=self.over.quick(), speeds=speeds)

    def command(self, scene: Scene) -> Sequence[str]:
        low, high, step = (scene.unit_Hz * float(v) for v in self.speeds.split(":"))
        argv = ["stability", *scene.argv, *scene.friction_words([self.over.key])]
        speeds = f"{low:.6g}:{high:.6g}:{step:.6g}"
        return [*argv, "--over", self._over_words(scene), "--speeds", speeds]

    def _over_words(self, scene: Scene) -> str:
        over = self.over
        if over.key != CONTACT_RATIO:
            return f"{over.key}={over.low:g}:{over.high:g}:{over.count}"
        edits = [scene.with_contact_ratio(ratio) for ratio in over.values]
        tips = ",".join(f"{tip:.10g}" for edit in edits for tip in edit.values())
        return f"{next(iter(edits[0]))}={tips}"


def stability(part: StabilityPart, scene: Scene, report: Progress) -> PartResult:
    """Values of valueN.COMBINATION., values counted from 1, in the unit of the figure:

    low, high, width : of the widest interval of that name
    expected_low, expected_high, expected_width : of perturbation
    COMBINATION.widest_at, expected_widest_at : values of the figure
    """
    unit = scene.unit_Hz
    speeds = [unit * value for value in parsed_speeds(part.speeds)]
    columns = []
    for done, value in enumerate(part.over.values):
        report("values", done, part.over.count)
        system = scene.changed({part.over.key: value}).system
        columns.append(_stability_column(part, periodic_system(system), speeds))
    values: dict[str, tuple[float, ...]] = {
        f"value{number}.{name}": (frequency / unit,)
        for number, column in enumerate(columns, start=1)
        for name, frequency in _values_of_column(column)
    }
    values |= _widest_values(part.over.values, columns)
    return PartResult(tuple(_curves(part, columns, unit)), values)


def _stability_column(
    part: StabilityPart, varying: PeriodicSystem, speeds: Sequence[float]
) -> StabilityScan:
    if part.traced:
        return scan_stability(varying, speeds)
    expected = combinations(varying, (speeds[0], speeds[-1]))
    return StabilityScan(np.empty(0), (), tuple(expected))


def _values_of_column(column: StabilityScan) -> Iterator[tuple[str, float]]:
    for kind in {interval.kind for interval in column.intervals}:
        intervals = [interval for interval in column.intervals if interval.kind == kind]
        widest = max(intervals, key=lambda interval: interval.high - interval.low)
        yield f"{kind}.low", widest.low
        yield f"{kind}.high", widest.high
        yield f"{kind}.width", widest.high - widest.low
    for combination in column.expected:
        if combination.unstable:
            yield f"{combination.name}.expected_low", combination.low
            yield f"{combination.name}.expected_high", combination.high
            yield (
                f"{combination.name}.expected_width",
                combination.high - combination.low,
            )


def _widest_values(
    values: Sequence[float], columns: Sequence[StabilityScan]
) -> dict[str, tuple[float, ...]]:
    """Values of the parameter at which the intervals of a name are widest."""
    widest: dict[str, tuple[float, float]] = {}
    for value, column in zip(values, columns, strict=True):
        intervals = [
            (interval.kind, interval.low, interval.high)
            for interval in column.intervals
        ]
        near = [c for c in column.expected if c.unstable]
        intervals += [(f"{c.name}.expected", c.low, c.high) for c in near]
        for name, low, high in intervals:
            key = f"{name}_widest_at" if "." in name else f"{name}.widest_at"
            widest[key] = max(widest.get(key, (0.0, value)), (high - low, value))
    return {key: (value,) for key, (_, value) in widest.items()}


def _curves(
    part: StabilityPart, columns: Sequence[StabilityScan], unit: float
) -> Iterator[Curve]:
    """Traced edges as dots; those of perturbation on lines, for each combination."""
    names = {c.name for column in columns for c in column.expected}
    for panel in part.only or ("",):
        panel_names = [panel] if panel else sorted(names)
        dots = [
            (value, edge / unit)
            for value, column in zip(part.over.values, columns, strict=True)
            for interval in column.intervals
            if not panel or interval.kind == panel
            for edge in (interval.low, interval.high)
        ]
        if part.traced:
            yield Curve("dots", tuple(dots), panel=panel, label="multipliers")
        lines = tuple(_expected_lines(part.over.values, columns, panel_names, unit))
        style: Style = "line" if part.traced else "dotted"
        yield Curve(style, lines, panel=panel, label="perturbation")


def _expected_lines(
    values: Sequence[float],
    columns: Sequence[StabilityScan],
    names: Sequence[str],
    unit: float,
) -> Iterator[tuple[float, float]]:
    for name in names:
        for edge in ("low", "high"):
            way = [_edge_of_interval(column, name, edge) / unit for column in columns]
            yield from zip(values, way, strict=True)
            yield np.nan, np.nan


def _edge_of_interval(column: StabilityScan, name: str, edge: str) -> float:
    edges = [
        getattr(combination, edge)
        for combination in column.expected
        if combination.name == name
    ]
    return float(edges[0]) if edges else np.nan
