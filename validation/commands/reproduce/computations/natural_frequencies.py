"""Natural frequencies of a train about its mean mesh stiffness, and its modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from lumped.common.progress import Progress
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import Scene
from validation.study.data_files import Positive, Text

MODES = 3  # the highest, that strain two meshes and what is between them


@dataclass(frozen=True, kw_only=True)
class ModesPart(Part):
    """Frequencies by the number of their mode."""

    keys: ClassVar = ("natural",)

    kind: Literal["modes"] = "modes"

    def command(self, scene: Scene) -> Sequence[str]:
        return ["modes", scene.set_name, *scene.train_words, "--stiffness", "given"]


def modes(part: ModesPart, scene: Scene, report: Progress) -> PartResult:
    """Natural frequencies of all modes, in the unit of the figure."""
    report("modes", 0, 1)
    system = scene.system
    frequencies = tuple(float(f) / scene.unit_Hz for f in system.modes.frequency_Hz)
    points = tuple((float(i), f) for i, f in enumerate(frequencies, start=1))
    curve = Curve("dots", points)
    return PartResult((curve,), {"natural": frequencies})


@dataclass(frozen=True, kw_only=True)
class ModeEnergiesPart(Part):
    """Distribution of the strain energy of the modes of a train with two meshes, over a
    stiffness by its logarithm.

    key : of the gear set, a stiffness between the meshes; low, high : its range
    """

    keys: ClassVar = ("most_coupled",)

    kind: Literal["mode_energies"] = "mode_energies"
    key: Text
    low: Positive
    high: Positive
    count: Annotated[int, Field(strict=True, ge=2, le=1000)] = 121

    def quick(self) -> Self:
        return replace(self, count=5)


def mode_energies(part: ModeEnergiesPart, scene: Scene, report: Progress) -> PartResult:
    """Logarithm of the stiffness at which modes are least of one place.

    That is where the largest shares of the modes have the smallest mean.
    """
    exponents = np.linspace(np.log10(part.low), np.log10(part.high), part.count)
    shares = []
    for done, exponent in enumerate(exponents):
        report("modes", done, part.count)
        modes = scene.changed({part.key: float(10.0**exponent)}).system.modes
        meshes = modes.mesh_energy[:, modes.frequency_Hz > 0.0][:, -MODES:]
        shares.append(np.vstack([meshes, 1.0 - meshes.sum(axis=0)]))
    table = np.array(shares)  # (count, springs, modes)
    names = *(f"mesh {m}" for m in scene.meshes), "shaft"
    curves = tuple(
        Curve(
            "line",
            tuple(zip(exponents.tolist(), table[:, i, k].tolist(), strict=True)),
            panel=f"strain energy in {name}",
            label=f"mode {k + 1}",
        )
        for i, name in enumerate(names)
        for k in range(MODES)
    )
    least = exponents[table.max(axis=1).mean(axis=1).argmin()]
    return PartResult(curves, {"most_coupled": (float(least),)})
