"""The finite elements in motion, passed from speed to speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

from fegear.commands.dynamics.study import Dynamics, DynamicsResult
from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.stepper import DynamicSettings, ImplicitStepper
from fegear.studies.running import run
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.common.progress import Progress
from lumped.steady.sweep import Direction
from validation.commands.reproduce.computations.frequency_response import (
    SWEPT,
    require_finished,
    speeds_in_Hz,
    swept_result,
)
from validation.commands.reproduce.parts import Part, PartResult
from validation.commands.reproduce.scene import Scene, excitations_of
from validation.study.data_files import Speeds, few_speeds, parsed_speeds


@dataclass(frozen=True, kw_only=True)
class ElementsPart(Part):
    """A sweep at the fidelity that the program chooses; dots up, circles down.

    speeds : `A:B:STEP` in the unit of the figure
    """

    keys: ClassVar = SWEPT

    kind: Literal["elements"] = "elements"
    speeds: Speeds
    directions: tuple[Direction, ...] = ("up", "down")

    def quick(self) -> Self:
        return replace(self, speeds=few_speeds(self.speeds, 2))

    def command(self, scene: Scene) -> Sequence[str]:
        one = ["--direction", *self.directions] if len(self.directions) == 1 else []
        speeds = speeds_in_Hz(self.speeds, scene.unit_Hz)
        argv = ["dynamics", *scene.element_words, *scene.coefficient_words]
        return [*argv, "--speeds", speeds, *one]


def elements(part: ElementsPart, scene: Scene, report: Progress) -> PartResult:
    """Values as of a sweep of a lumped model."""
    speeds = [scene.unit_Hz * value for value in parsed_speeds(part.speeds)]
    study = Dynamics(
        gear_set=GearSetRef.of(scene.gear_set),
        torque=(scene.torque,),
        speeds=tuple(speeds),
        elements=FiniteElements(friction=scene.friction),
        translations=scene.translations,
        direction=part.directions[0] if len(part.directions) == 1 else "both",
    )
    result: DynamicsResult = run(study, progress=report)
    swept = [branch for _, branch in result.branches]
    require_finished(swept)
    return swept_result(scene, swept)


def element_stepper(
    scene: Scene, speeds: Sequence[float], settings: DynamicSettings
) -> ImplicitStepper:
    """Stepper of the fidelity that the program selects for speeds [Hz]."""
    reference = replace(scene, friction=0.0).system
    elements = FiniteElements(friction=scene.friction)
    inputs = reference, speeds, elements, settings, excitations_of(scene.source)
    return prepare(scene.gear_set, scene.torque, *inputs).stepper
