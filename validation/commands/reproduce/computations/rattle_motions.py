"""Motions of machines in parts from a grid of starts, and the noise that they make."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from lumped.common.progress import Progress
from lumped.rattle.assembly import Assembly
from lumped.rattle.motions import AssemblyIntegrator, AssemblyRun
from validation.commands.reproduce.machine_scene import MachineScene
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.study.data_files import Flag, Positive

SIDE = 5  # starts a side: 25 panels of the source
POINTS = 100  # of a turn that is drawn


@dataclass(frozen=True, kw_only=True)
class MotionsPart(Part):
    """Relative rotation over the last turns of motions from 25 starts.

    machine : in place of the figure's; impacts : whether its flanks are rigid
    speed : of the driving side relative to steady rotation at the starts, at most
        [rad per turn]; rotations are spread over the play
    turns, last : of a motion, and those over which its noise counts and it is drawn
    panels : starts that are drawn, counted from 0; none draws noise levels
    """

    keys: ClassVar = ("least", "median", "largest", "quiet")
    of_machine: ClassVar = True

    kind: Literal["motions"] = "motions"
    machine: str = ""
    impacts: Flag = False
    speed: Positive
    turns: Positive = 2000.0
    last: Positive = 20.0
    panels: tuple[Annotated[int, Field(ge=0, lt=SIDE * SIDE)], ...] = ()

    def quick(self) -> Self:
        return replace(self, turns=12.0, last=6.0)


def motions(part: MotionsPart, scene: MachineScene, report: Progress) -> PartResult:
    """Noise levels [rad^2 per turn^3] of motions that rattle; how many are quiet."""
    report("motions", 0, 1)
    scene = replace(scene, name=part.machine or scene.name)
    runs, times = _run(part, scene.assembly)
    if part.panels:
        curves = _histories(part, runs, times, scene.assembly)
    else:
        levels = [(float(i), run.noise) for i, run in enumerate(runs)]
        curves = (Curve("dots", tuple(levels)),)
    loud = np.array([run.noise for run in runs if not run.is_quiet])
    values: Mapping[str, float] = {
        "least": float(loud.min()),
        "median": float(np.median(loud)),
        "largest": float(loud.max()),
        "quiet": float(sum(run.is_quiet for run in runs)),
    }
    return PartResult(curves, {name: (value,) for name, value in values.items()})


def _run(part: MotionsPart, assembly: Assembly) -> tuple[list[AssemblyRun], np.ndarray]:
    machine = assembly.machine
    if part.impacts:
        machine = replace(machine, stiffness=np.inf)
    settled_machine = AssemblyIntegrator(replace(assembly, machine=machine))
    play = machine.half_backlash
    states = [
        settled_machine.settled(rotation, speed)
        for rotation in np.linspace(-0.8 * play, 0.8 * play, SIDE)
        for speed in np.linspace(-part.speed, part.speed, SIDE)
    ]
    count = round(POINTS * part.last)
    times = part.turns - part.last + np.arange(count) / POINTS
    begin = part.turns - part.last
    return settled_machine.run_all(np.array(states), begin, part.turns, times), times


def _histories(
    part: MotionsPart,
    runs: Sequence[AssemblyRun],
    times: np.ndarray,
    assembly: Assembly,
) -> tuple[Curve, ...]:
    play = assembly.machine.half_backlash
    curves = []
    for panel in part.panels:
        motion, letter = runs[panel], chr(ord("a") + panel)
        name = f"({letter}) noise {motion.noise:.3g}"
        points = np.stack([times - times[0], motion.rotation], axis=1)
        shown = tuple((float(t), float(x)) for t, x in points)
        curves.append(Curve("line", shown, panel=name))
        end, gap = float(times[-1] - times[0]), (math.nan, math.nan)
        flanks = ((0.0, -play), (end, -play), gap, (0.0, play), (end, play))
        curves.append(Curve("dotted", flanks, panel=name, label="flanks"))
    return tuple(curves)
