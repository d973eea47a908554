"""Mesh forces over a cycle of the motion at one speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from fegear.commands.motion.result import MotionResult
from fegear.commands.motion.study import Motion
from fegear.studies.running import run
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.common.progress import Progress
from lumped.steady.motion import TimeHistory, sweep_to_speed, time_history
from lumped.steady.respond import respond
from validation.commands.reproduce.computations.frequency_response import Frequency
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import Scene
from validation.study.cycle_metrics import force_cycle
from validation.study.metrics import CYCLE_POINTS

DAMPING_STEPS = 40  # from one damping ratio to another
CYCLE = np.arange(CYCLE_POINTS) / CYCLE_POINTS  # of a mesh


@dataclass(frozen=True, kw_only=True)
class ForcesPart(Part):
    """Forces [N] of the settled motion over the cycle of each mesh.

    at, from_speed : frequencies, in the unit of the figure; from rest without the last
    from_damping : damping ratio at which the speed is reached, before it is raised to
        the figure's: a branch is followed that a passage from other speeds misses
    """

    keys: ClassVar = (r"mesh[12]\.(force_peak|force_mean|contact_loss)",)

    kind: Literal["forces"] = "forces"
    at: Frequency
    from_speed: Frequency | None = None
    from_damping: Annotated[float, Field(strict=True, gt=0.0, lt=1.0)] | None = None
    no_command: ClassVar = "no command follows a motion over the damping ratio"

    def command(self, scene: Scene) -> Sequence[str]:
        if self.from_damping is not None:
            return ()
        unit = scene.unit_Hz
        waves = scene.harmonics_argv
        options = [*scene.friction_words(), *waves]
        argv = ["motion", *scene.argv, *options, "--speed", f"{unit * self.at:.6g}"]
        if self.from_speed is not None:
            argv += ["--from-speed", f"{unit * self.from_speed:.6g}"]
        return argv


def forces(part: ForcesPart, scene: Scene, report: Progress) -> PartResult:
    """Largest and mean force, and the time without contact."""
    motion = _motion(part, scene, report)
    history, response = motion.history, motion.response
    curves, values = [], {}
    for mesh, rate in zip(scene.meshes, scene.system.train.mesh_rates, strict=True):
        force = history.force[:, mesh - 1]
        shown = force_cycle(history, mesh - 1, 1.0 / (response.frequency * float(rate)))
        points = zip(CYCLE.tolist(), shown.tolist(), strict=True)
        curves.append(Curve("line", tuple(points), mesh))
        mean = np.trapezoid(force, history.time) / np.ptp(history.time)
        values[f"mesh{mesh}.force_peak"] = (float(force.max()),)
        values[f"mesh{mesh}.force_mean"] = (float(mean),)
        values[f"mesh{mesh}.contact_loss"] = (float(response.contact_loss[mesh - 1]),)
    return PartResult(tuple(curves), values)


def _motion(part: ForcesPart, scene: Scene, report: Progress) -> TimeHistory:
    unit, start = scene.unit_Hz, part.from_speed
    speed, first = unit * part.at, None if start is None else unit * start
    if part.from_damping is not None:
        return _over_damping(part.from_damping, scene, first or speed, speed)
    study = Motion(
        gear_set=GearSetRef.of(scene.gear_set),
        torque=scene.torque,
        speed=speed,
        from_speed=first,
        model=scene.model,
    )
    result: MotionResult = run(study, progress=report)
    return result.motion


def _over_damping(
    from_damping: float, scene: Scene, start: float, speed: float
) -> TimeHistory:
    """Motion at a speed [Hz], reached from another one at a damping ratio that is then
    raised, or lowered, to the scene's.
    """
    system = scene.system
    ratios = np.linspace(from_damping, system.train.damping_ratio, DAMPING_STEPS + 1)
    state = None
    for ratio in ratios[:-1]:
        train = replace(system.train, damping_ratio=float(ratio))
        other = replace(system, train=train)
        if state is None:
            state = sweep_to_speed(other, start, speed)
        state = respond(other, speed, state=state).state
    return time_history(system, speed, state=state)
