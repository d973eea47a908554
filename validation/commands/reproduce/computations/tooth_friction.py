"""Teeth with friction, at rest: arms of friction, stiffness of pairs, deflection."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from fegear.statics.solving import solve_mesh
from lumped.closed_forms.parametric import excitation_harmonics
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.train.friction import base_pitch, torque_shares
from validation.commands.reproduce.computations.parameter_studies import Over
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import Scene, excitations_of

POSITIONS = 256  # of a base pitch
IN_WORDS = {0: "pair in recess", -1: "pair in approach"}


@dataclass(frozen=True, kw_only=True)
class ToothPairsPart(Part):
    """Pairs of mesh 1 in contact over the mesh cycle: arms of their friction about the
    driver [mm], or stiffness over its mean without friction.
    """

    keys: ClassVar = (r"(recess|approach)\.(first|last|double_first|double_last)",)
    no_command: ClassVar = "fegear stiffness has pairs of finite elements"

    kind: Literal["tooth_pairs"] = "tooth_pairs"
    shows: Literal["arm", "stiffness"]


def tooth_pairs(part: ToothPairsPart, scene: Scene, report: Progress) -> PartResult:
    """Values of the pair in recess or approach:

    first, last : values where it comes into its half of the path and leaves it
    double_first, double_last : where double contact starts and ends
    """
    report("pairs", 0, 1)
    x = (np.arange(POSITIONS) + 0.5) / POSITIONS
    (stiffness, arm), ahead = _pairs(scene, x)
    values = 1e3 * arm
    if part.shows == "stiffness":
        values = stiffness / scene.system.excitations[0].mean_stiffness
    touching = stiffness > 0.0
    double = touching.all(axis=0)
    curves, quantities = [], {}
    for number, side in enumerate(ahead):
        in_contact = np.where(touching[number], values[number], np.nan)
        points = tuple(zip(x.tolist(), in_contact.tolist(), strict=True))
        curves.append(Curve("line", points, mesh=1, label=IN_WORDS[side]))
        here, both = values[number, touching[number]], values[number, double]
        name = "approach" if side < 0 else "recess"
        for key, value in (
            *(("first", here[0]), ("last", here[-1])),
            *(("double_first", both[0]), ("double_last", both[-1])),
        ):
            quantities[f"{name}.{key}"] = (float(value),)
    return PartResult(tuple(curves), quantities)


def _pairs(scene: Scene, x: Array) -> tuple[tuple[Array, Array], Sequence[int]]:
    """Stiffness [N/m] and friction arm about the driver [m] (p, n) of the pairs of
    mesh 1 at positions (n,), and by how many base pitches each is ahead."""
    system = scene.system
    pitch, train = base_pitch(system.train, 0), system.train
    mesh, pairs = train.meshes[0], system.excitations[0].pairs
    at_pitch = train.gears[mesh.driver].base_radius * np.tan(mesh.pressure_angle)
    ahead = [pair.ahead or 0 for pair in pairs]
    stiffness = np.array([pair.stiffness(x) for pair in pairs])
    return (stiffness, at_pitch + pitch * (x + np.array(ahead)[:, None])), ahead


@dataclass(frozen=True, kw_only=True)
class FrictionDeflectionPart(Part):
    """What friction changes of the static deflection of mesh 1 over its cycle [um].

    elements : by finite elements, else by the tooth pairs of model 1, for which
        moments hold the torque: T = sum k_i (r - mu sgn l_i) W
    """

    keys: ClassVar = (r"single\.(recess|approach)|double",)
    no_command: ClassVar = (
        "fegear stiffness has finite elements alone, of a gear set as it is"
    )

    kind: Literal["friction_deflection"] = "friction_deflection"
    elements: bool = False

    def command(self, scene: Scene) -> Sequence[str]:
        if not self.elements or scene.edits:
            return ()
        options = ["--torque", f"{scene.torque:g}", "--friction", f"{scene.friction:g}"]
        positions = ["--positions", str(scene.source.positions)]
        return ["stiffness", scene.set_name, *options, *positions]


def friction_deflection(
    part: FrictionDeflectionPart, scene: Scene, report: Progress
) -> PartResult:
    """Means over single contact in recess and approach, and the RMS over
    double contact [um]."""
    report("deflection", 0, 1)
    x, change, single = (_by_elements if part.elements else _by_pairs)(scene)
    points = tuple(zip(x.tolist(), (1e6 * change).tolist(), strict=True))
    values = {}
    for name, half in (("recess", x < 0.5), ("approach", x > 0.5)):
        values[f"single.{name}"] = (1e6 * float(change[single & half].mean()),)
    values["double"] = (1e6 * float(np.sqrt((change[~single] ** 2).mean())),)
    return PartResult((Curve("line", points, mesh=1),), values)


def _by_elements(scene: Scene) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Positions, change of deflection [m] and whether one pair is in contact, (n,)."""
    excitations = excitations_of(scene.source)
    free = excitations.table(scene.gear_set, 0, scene.torque)
    settings = replace(scene.source.statics_of(scene.gear_set), friction=scene.friction)
    rubbed = solve_mesh(scene.gear_set, 1, [scene.torque], settings).table
    change = rubbed["ste_m"][0] - free["ste_m"][0]
    return free.position, change, free["n_pairs"][0] == 1


def _by_pairs(scene: Scene) -> tuple[Array, Array, NDArray[np.bool_]]:
    x = (np.arange(POSITIONS) + 0.5) / POSITIONS
    (stiffness, _), ahead = _pairs(scene, x)
    (plain, _), _ = _pairs(replace(scene, friction=0.0), x)
    train = scene.system.train
    shares = torque_shares(train, 0, scene.friction, ahead, x)
    force = scene.torque / train.gears[train.meshes[0].driver].base_radius
    with_friction = force / (stiffness * shares).sum(axis=0)
    without = force / plain.sum(axis=0)
    return x, with_friction - without, (plain > 0.0).sum(axis=0) == 1


@dataclass(frozen=True, kw_only=True)
class HarmonicsPart(Part):
    """Fourier amplitudes of the stiffness of mesh 1 over its mean, over one figure.

    orders : how many, from the first
    """

    keys: ClassVar = (r"order\d+\.(first|last|largest|least)",)
    no_command: ClassVar = "fegear stability uses them, none shows them"

    kind: Literal["harmonics"] = "harmonics"
    over: Over
    orders: Annotated[int, Field(strict=True, ge=1, le=50)] = 6

    def quick(self) -> Self:
        return replace(self, over=self.over.quick())


def harmonics(part: HarmonicsPart, scene: Scene, report: Progress) -> PartResult:
    """Values of orderN.: amplitudes at the first and last value, and extremes."""
    values = part.over.values
    sizes = np.array(list(_amplitudes(part, scene, report)))
    curves, quantities = [], {}
    for number, amplitudes in enumerate(sizes.T, start=1):
        points = tuple(zip(values, amplitudes.tolist(), strict=True))
        curves.append(Curve("line", points, mesh=1, label=f"s = {number}"))
        for name, value in (
            *(("first", amplitudes[0]), ("last", amplitudes[-1])),
            *(("largest", amplitudes.max()), ("least", amplitudes.min())),
        ):
            quantities[f"order{number}.{name}"] = (float(value),)
    return PartResult(tuple(curves), quantities)


def _amplitudes(part: HarmonicsPart, scene: Scene, report: Progress) -> Iterator[Array]:
    """|Theta_s| eps of eq. 4.61, (orders,) of each value."""
    for done, value in enumerate(part.over.values):
        report("values", done, part.over.count)
        excitation = scene.changed({part.over.key: value}).system.excitations[0]
        waves, _ = excitation_harmonics(excitation, 0.0, part.orders)
        yield np.abs(waves[1:]) / excitation.mean_stiffness
