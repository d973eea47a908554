"""Settled motions over speed and their Poincare sections: periods, chaos."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field

from lumped.attractors.attractor_sweeps import AttractorBranch, sweep_attractors
from lumped.attractors.attractors import Kind, SectionSettings
from lumped.branches.motions import SpeedFamily
from lumped.common.progress import Progress
from lumped.steady.integration_settings import Settings
from lumped.steady.sweep import Direction, reporting_observer
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import Scene
from validation.study.data_files import Flag, Speeds, few_speeds, parsed_speeds


@dataclass(frozen=True, kw_only=True)
class AttractorsPart(Part):
    """Deflections at the start of periods over speed, or the map of the last speed.

    speeds : in the unit of the figure, passed in one direction
    sections : points of a motion that does not repeat
    last_map : rate [mm/s] over deflection [um] at the last speed instead
    """

    keys: ClassVar = ("chaotic|doubled|exponent",)

    kind: Literal["attractors"] = "attractors"
    speeds: Speeds
    direction: Direction = "down"
    sections: Annotated[int, Field(strict=True, ge=1, le=10_000)] = 100
    last_map: Flag = False

    def quick(self) -> Self:
        return replace(self, speeds=few_speeds(self.speeds, 2), sections=10)

    def command(self, scene: Scene) -> Sequence[str]:
        if scene.friction:  # fegear bifurcations has none
            return ()
        values = (scene.unit_Hz * value for value in parsed_speeds(self.speeds))
        over = "mesh_frequency_Hz=" + ",".join(f"{value:.6g}" for value in values)
        argv = ["bifurcations", *scene.argv, *scene.harmonics_argv]
        options = ["--direction", self.direction, "--sections", str(self.sections)]
        return [*argv, "--over", over, *options]


def attractors(part: AttractorsPart, scene: Scene, report: Progress) -> PartResult:
    """First and last speed of chaos and of motions of two periods.

    exponent : largest of Lyapunov per period of the first mesh, of all speeds
    """
    unit = scene.unit_Hz
    speeds = [unit * value for value in parsed_speeds(part.speeds)]
    branch = sweep_attractors(
        *(speeds, SpeedFamily(scene.system).at, part.direction),
        *(Settings(multiples=32), SectionSettings(sections=part.sections)),
        observer=reporting_observer(report, len(speeds)),
    )
    pairs = list(zip(branch.values, branch.attractors, strict=True))
    values = {
        "chaotic": _span(
            v / unit for v, attractor in pairs if attractor.kind == Kind.CHAOTIC
        ),
        "doubled": _span(v / unit for v, attractor in pairs if attractor.multiple == 2),
        "exponent": (max(attractor.exponent for _, attractor in pairs),),
    }
    curves = [
        Curve("points", tuple(_points(part, branch, unit, mesh - 1)), mesh)
        for mesh in scene.meshes
    ]
    return PartResult(tuple(curves), values)


def _span(speeds: Iterator[float]) -> tuple[float, ...]:
    values = list(speeds)
    return (min(values), max(values)) if values else ()


def _points(
    part: AttractorsPart, branch: AttractorBranch, unit: float, mesh: int
) -> Iterator[tuple[float, float]]:
    if part.last_map:
        last = branch.attractors[-1]
        for deflection, rate in zip(
            last.deflection[:, mesh], last.rate[:, mesh], strict=True
        ):
            yield 1e6 * float(deflection), 1e3 * float(rate)
        return
    for value, attractor in zip(branch.values, branch.attractors, strict=True):
        for deflection in attractor.deflection[:, mesh]:
            yield value / unit, 1e6 * float(deflection)
