"""Mesh forces over a cycle of the motion at one speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fegear.studies.motion import Motion
from fegear.studies.running import run
from fegear.studies.trains import NamedSet
from lumped.common.progress import Progress
from validation.reproduce.computations.frequency_response import Frequency
from validation.reproduce.parts import Curve, Part, PartResult
from validation.reproduce.scene import Scene
from validation.study.metrics import CYCLE_POINTS, force_cycle

CYCLE = np.arange(CYCLE_POINTS) / CYCLE_POINTS  # of a mesh


@dataclass(frozen=True, kw_only=True)
class ForcesPart(Part):
    """Forces [N] of the settled motion over the cycle of each mesh.

    at, from_speed : frequencies, in the unit of the figure; from rest without the last
    """

    keys: ClassVar = (r"mesh[12]\.(force_peak|force_mean|contact_loss)",)

    kind: Literal["forces"] = "forces"
    at: Frequency
    from_speed: Frequency | None = None

    def command(self, scene: Scene) -> Sequence[str]:
        unit = scene.unit_Hz
        waves = scene.kept_harmonics("--harmonics")
        how = [*scene.friction_words(), *waves]
        words = ["motion", *scene.words, *how, "--speed", f"{unit * self.at:.6g}"]
        if self.from_speed is not None:
            words += ["--from-speed", f"{unit * self.from_speed:.6g}"]
        return words


def forces(part: ForcesPart, scene: Scene, report: Progress) -> PartResult:
    """Found are the largest and the mean force, and the time without contact."""
    unit, start = scene.unit_Hz, part.from_speed
    came = None if start is None else unit * start
    asked = Motion(
        gear_set=NamedSet.of(scene.gear_set),
        torque=scene.torque,
        speed=unit * part.at,
        from_speed=came,
        model=scene.model,
    )
    settled = run(asked, progress=report)
    history, response = settled.motion.history, settled.motion.response
    curves, found = [], {}
    for mesh, rate in zip(scene.meshes, scene.system.train.mesh_rates, strict=True):
        force = history.force[:, mesh - 1]
        shown = force_cycle(history, mesh - 1, 1.0 / (response.frequency * float(rate)))
        points = zip(CYCLE.tolist(), shown.tolist(), strict=True)
        curves.append(Curve("line", tuple(points), mesh))
        mean = np.trapezoid(force, history.time) / np.ptp(history.time)
        found[f"mesh{mesh}.force_peak"] = (float(force.max()),)
        found[f"mesh{mesh}.force_mean"] = (float(mean),)
        found[f"mesh{mesh}.contact_loss"] = (float(response.contact_loss[mesh - 1]),)
    return PartResult(tuple(curves), found)
