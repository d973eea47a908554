"""Loose wheels of a gearbox: their motion in the plays of teeth and bearings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from fegear.commands.clatter.gearboxes import load_gearbox
from lumped.clatter.chaos import lyapunov_exponent
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import centred_state, simulate
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.figures.clatter import sample_plays
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import NoScene
from validation.study.data_files import STRICT

Count = Annotated[int, Field(strict=True, ge=1, le=10_000)]
POINTS = 200  # of a period


@dataclass(frozen=True, kw_only=True)
class ClatterPart(Part):
    """A play of a gearbox's first wheel over time.

    settle : periods before it is shown; periods : that are shown
    exponent_over : periods for the largest Lyapunov exponent
    """

    __pydantic_config__ = STRICT

    of_equation: ClassVar = True
    keys: ClassVar = ("range_um|impacts|exponent_per_period",)

    kind: Literal["clatter"] = "clatter"
    gearbox: str
    play: Literal["teeth", "axial", "radial"]
    settle: Count = 20
    periods: Count = 12
    exponent_over: Count = 1000

    def quick(self) -> Self:
        return replace(self, settle=2, periods=2, exponent_over=20)

    def command(self, scene: NoScene) -> Sequence[str]:
        return ["clatter", self.gearbox, "--chaos", "--plot", "motion.png"]


def _points(x: Array, y: Array) -> tuple[tuple[float, float], ...]:
    return tuple(zip(x.tolist(), y.tolist(), strict=True))


def clatter(part: ClatterPart, scene: NoScene, report: Progress) -> PartResult:
    """Values: the range of the play that is used, impacts on both of its edges, and
    the largest Lyapunov exponent of the wheel."""
    report("clatter", 0, 1)
    gearbox = load_gearbox(part.gearbox).gearbox
    group = WheelGroup(gearbox.groups[0], gearbox.excitation)
    number = [name for _, name in group.plays].index(part.play)
    state, period = centred_state(group), gearbox.excitation.period
    begin = part.settle * period
    for _ in simulate(group, state, begin):
        pass
    times = np.linspace(begin, begin + part.periods * period, POINTS * part.periods)
    shifts = 1e3 * sample_plays(group, state, times)[:, number]
    impacts = 0
    for struck in simulate(group, state, float(times[-1])):
        impacts += int(np.sum(struck.play == number))
    exponent = lyapunov_exponent(group, state, part.exponent_over) * period
    shown = times - begin
    lower = -1e3 * group.widths(times)[:, number]
    last = float(shown[-1])
    edges = [(0.0, 0.0), (last, 0.0), (math.nan, math.nan), *_points(shown, lower)]
    curves = [
        Curve("line", _points(shown, shifts)),
        Curve("dotted", tuple(edges), label="edges of the play"),
    ]
    return PartResult(
        tuple(curves),
        {
            "range_um": (1e3 * float(np.ptp(shifts)),),
            "impacts": (float(impacts),),
            "exponent_per_period": (exponent,),
        },
    )
