"""Natural frequencies of a train about its mean mesh stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from fegear.statics import Progress
from validation.reproduce.parts import Curve, Part, PartResult
from validation.reproduce.scene import Scene


@dataclass(frozen=True, kw_only=True)
class ModesPart(Part):
    """Frequencies by the number of their mode."""

    keys: ClassVar = ("natural",)

    kind: Literal["modes"] = "modes"

    def command(self, scene: Scene) -> Sequence[str]:
        return ["modes", scene.set_name, *scene.train_words]


def modes(part: ModesPart, scene: Scene, report: Progress) -> PartResult:
    """Found are those of all modes, in the unit of the figure."""
    report("modes", 0, 1)
    system = scene.system
    found = tuple(float(f) / scene.unit_Hz for f in system.modes.frequency_Hz)
    points = tuple((float(i), f) for i, f in enumerate(found, start=1))
    curve = Curve("dots", points)
    return PartResult((curve,), {"natural": found})
