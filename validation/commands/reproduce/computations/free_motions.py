"""Free motion of a train in contact, its stiffness varying: bounded or growing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.stability.multipliers import integrated, largest_multiplier
from lumped.stability.periodic_system import PeriodicSystem, periodic_system
from lumped.train.system import LumpedSystem
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import Scene
from validation.study.data_files import Speeds, few_speeds, parsed_speeds

SAMPLES = 16  # of a common period


@dataclass(frozen=True, kw_only=True)
class FreeMotionsPart(Part):
    """Mesh deflection from a unit one at rest, a panel a speed.

    speeds : in the unit of the figure
    periods : of the first mesh
    """

    keys: ClassVar = (r"speed\d+\.(largest|growth|multiplier)",)
    no_command: ClassVar = "fegear motion has the static load and loss of contact"

    kind: Literal["free_motions"] = "free_motions"
    speeds: Speeds
    periods: Annotated[int, Field(strict=True, ge=8, le=10_000)] = 200

    def quick(self) -> Self:
        return replace(self, speeds=few_speeds(self.speeds, 2), periods=20)


def free_motions(part: FreeMotionsPart, scene: Scene, report: Progress) -> PartResult:
    """Values of speedN., speeds counted from 1:

    largest : deflection, over the one at the start
    growth : of the largest deflection over the second half, per common period
    multiplier : largest one of Floquet, by the series of Peano and Baker
    """
    varying = periodic_system(scene.system)
    curves, quantities = [], {}
    values = parsed_speeds(part.speeds)
    for number, value in enumerate(values, start=1):
        report("motions", number - 1, len(values))
        speed = scene.unit_Hz * value
        time, deflection = _motion(scene.system, varying, speed, part.periods)
        label = f"mesh frequency {value:.4g}"
        points = tuple(zip(time.tolist(), deflection.tolist(), strict=True))
        curves.append(Curve("line", points, mesh=1, panel=label))
        start = f"speed{number}."
        quantities[f"{start}largest"] = (float(np.abs(deflection).max()),)
        quantities[f"{start}growth"] = (_growth(deflection),)
        multiplier = float(largest_multiplier(varying, speed)[0])
        quantities[f"{start}multiplier"] = (multiplier,)
    return PartResult(tuple(curves), quantities)


def _motion(
    system: LumpedSystem, varying: PeriodicSystem, speed: float, periods: int
) -> tuple[Array, Array]:
    """Times (t,) in periods of the first mesh and deflections (t,) of that mesh."""
    length = varying.length
    parts = length * np.arange(1, SAMPLES + 1) / SAMPLES
    through = integrated(varying, speed, parts)
    row = np.concatenate([system.arrays.shapes[0], np.zeros(varying.modes)])
    state = np.concatenate([system.static_state[0], np.zeros(varying.modes)])
    state /= row @ state
    values = [row @ state]
    count = math.ceil(periods / length)
    for _ in range(count):
        values.extend((through @ state @ row).tolist())
        state = through[-1] @ state
    time = np.append(0.0, (length * np.arange(count)[:, None] + parts).ravel())
    return time, np.array(values)


def _growth(deflection: Array) -> float:
    """Per common period, by the largest of the last quarter and the one before."""
    quarter = (deflection.size - 1) // 4 // SAMPLES
    last = np.abs(deflection[-quarter * SAMPLES :]).max()
    before = np.abs(deflection[-2 * quarter * SAMPLES : -quarter * SAMPLES]).max()
    return float((last / before) ** (1.0 / quarter))
