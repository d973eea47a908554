"""Vibration over speed: branches of periodic motions, sweeps, and closed forms."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field

from fegear.commands.branches.result import BranchesResult
from fegear.commands.branches.study import Branches
from fegear.commands.sweep.study import Sweep, SweepResult
from fegear.commands.theory.figure import response_points
from fegear.commands.theory.result import TheoryResult
from fegear.commands.theory.study import Theory
from fegear.studies.running import run
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.points import PeriodicBranch
from lumped.closed_forms import separation_angle
from lumped.closed_forms.predictions import Prediction
from lumped.common.progress import Progress
from lumped.continuation.bifurcations import (
    CROSSING,
    DOUBLING,
    FOLD,
    TORUS,
    stability_segments,
)
from lumped.steady.jumps import find_jumps, find_peaks, opposite_branches
from lumped.steady.response import Status
from lumped.steady.sweep import Branch, Direction
from validation.commands.reproduce.parts import (
    Curve,
    Harmonics,
    Part,
    PartResult,
    Style,
)
from validation.commands.reproduce.scene import Scene
from validation.study.data_files import Number, Speeds, few_speeds, parsed_speeds

Frequency = Annotated[Number, Field(gt=0.0, lt=1e6)]
PartValues = dict[str, tuple[float, ...]]
NAMES = {FOLD: "fold", DOUBLING: "doubling", CROSSING: "crossing", TORUS: "torus"}
GAP = (math.nan, math.nan)
SWEPT = (  # what sweeps find
    r"(up|down)\.mesh[12]\.(jump|peak|largest|contact_loss)",
    r"(up|down)\.(aperiodic|subharmonic)",
)


@dataclass(frozen=True, kw_only=True)
class BranchesPart(Part):
    """Periodic motions by harmonic balance, stable in full and unstable dashed.

    between : frequencies, in the unit of the figure
    starts : random states from which isolated branches are searched
    """

    keys: ClassVar = (
        "fold|doubling|crossing|torus",
        r"mesh[12]\.largest",
        r"period\d+\.(mesh[12]\.largest|span)",
    )

    kind: Literal["branches"] = "branches"
    between: tuple[Frequency, Frequency]
    harmonics: Harmonics = 20
    period_multiple: Annotated[int, Field(strict=True, ge=1, le=64)] = 2
    starts: Annotated[int, Field(strict=True, ge=0, le=1000)] = 0

    def quick(self) -> Self:
        low, high = self.between
        middle, part = 0.5 * (low + high), 0.05 * (high - low)
        return replace(
            self,
            between=(middle - part, middle + part),
            harmonics=min(self.harmonics, 5),
            starts=min(self.starts, 1),
        )

    def command(self, scene: Scene) -> Sequence[str]:
        low, high = (f"{scene.unit_Hz * value:.6g}" for value in self.between)
        more = ["--harmonics", str(self.harmonics)] if self.harmonics != 20 else []
        if self.period_multiple != 2:
            more += ["--period-multiple", str(self.period_multiple)]
        if self.starts:
            more += ["--starts", str(self.starts)]
        waves = scene.harmonics_argv
        return ["branches", *scene.argv, *waves, "--speeds", f"{low}:{high}", *more]


def branches(part: BranchesPart, scene: Scene, report: Progress) -> PartResult:
    """Frequencies of bifurcations and the largest motions.

    periodN counts the branches alone whose motions repeat after N common periods.
    """
    unit = scene.unit_Hz
    low, high = (unit * value for value in part.between)
    study = Branches(
        gear_set=GearSetRef.of(scene.gear_set),
        torque=scene.torque,
        speeds=(low, high),
        model=scene.model,
        finding=BranchSettings(
            harmonics=part.harmonics,
            period_multiple=part.period_multiple,
            starts=part.starts,
        ),
    )
    result: BranchesResult = run(study, progress=report)
    if not result.complete:
        raise KeyboardInterrupt
    curves = [
        Curve(
            "line" if stable else "dashed",
            tuple(_stable_stretches(result.branches, stable, scene, mesh)),
            mesh,
        )
        for mesh in scene.meshes
        for stable in (True, False)
    ]
    values: PartValues = dict.fromkeys(NAMES.values(), ())
    for branch in result.branches:
        for point in branch.bifurcations:
            values[NAMES[point.kind]] += (point.best_parameter / unit,)
    values |= _largest_rms(result.branches, scene, "")
    for multiple in {branch.multiple for branch in result.branches}:
        same_period = [
            branch for branch in result.branches if branch.multiple == multiple
        ]
        values |= _largest_rms(same_period, scene, f"period{multiple}.")
        speeds = [point.frequency / unit for b in same_period for point in b.points]
        values[f"period{multiple}.span"] = (min(speeds), max(speeds))
    return PartResult(tuple(curve for curve in curves if curve.points), values)


def _largest_rms(
    branches: Sequence[PeriodicBranch], scene: Scene, start: str
) -> PartValues:
    return {
        f"{start}mesh{mesh}.largest": (
            max(scene.shown(p.figures, mesh) for b in branches for p in b.points),
        )
        for mesh in scene.meshes
    }


def _stable_stretches(
    branches: Iterable[PeriodicBranch], stable: bool, scene: Scene, mesh: int
) -> Iterator[tuple[float, float]]:
    """Points of all stretches, each up to the first point of the next."""
    for branch in branches:
        for is_stable, points in stability_segments(branch.points):
            if is_stable != stable:
                continue
            for point in points:
                at = point.frequency / scene.unit_Hz
                yield at, scene.shown(point.figures, mesh)
            yield GAP


@dataclass(frozen=True, kw_only=True)
class SweepPart(Part):
    """Numerical integration from speed to speed; dots up, circles down.

    speeds : `A:B:STEP` in the unit of the figure
    """

    keys: ClassVar = SWEPT

    kind: Literal["sweep"] = "sweep"
    speeds: Speeds
    directions: tuple[Direction, ...] = ("up", "down")
    style: Style | None = None

    def quick(self) -> Self:
        return replace(self, speeds=few_speeds(self.speeds))

    @property
    def direction(self) -> Literal["up", "down", "both"]:
        return self.directions[0] if len(self.directions) == 1 else "both"

    def command(self, scene: Scene) -> Sequence[str]:
        speeds = speeds_in_Hz(self.speeds, scene.unit_Hz)
        waves = scene.harmonics_argv
        one = ["--direction", *self.directions] if len(self.directions) == 1 else []
        options = [*scene.friction_words(), *waves, "--speeds", speeds, *one]
        return ["sweep", *scene.argv, *options]


def sweep(part: SweepPart, scene: Scene, report: Progress) -> PartResult:
    """Values are frequencies, of jumps the last one before them, and largest values.

    aperiodic, subharmonic : first and last speed at which a motion does not repeat, or
        repeats after more than one common period
    """
    unit = scene.unit_Hz
    speeds = [unit * value for value in parsed_speeds(part.speeds)]
    study = Sweep(
        gear_set=GearSetRef.of(scene.gear_set),
        torque=(scene.torque,),
        speeds=tuple(speeds),
        model=scene.model,
        direction=part.direction,
    )
    result: SweepResult = run(study, progress=report)
    swept = [branch for _, branch in result.branches]
    require_finished(swept)
    return swept_result(scene, swept, part.style)


def speeds_in_Hz(text: str, unit: float) -> str:
    """`A:B:STEP` and numbers in a unit [Hz], as a command takes them."""
    return ",".join(
        ":".join(f"{unit * float(value):.6g}" for value in span.split(":"))
        for span in text.split(",")
    )


def require_finished(swept: Sequence[Branch]) -> None:
    """Sweeps end early where they were interrupted, or where the motion diverges."""
    for branch in swept:
        if branch.interrupted:
            raise KeyboardInterrupt


def swept_result(
    scene: Scene, swept: Sequence[Branch], style: Style | None = None
) -> PartResult:
    """Curves and figures of branches of responses, one for each direction."""
    values: PartValues = {}
    curves = []
    for branch, other in zip(swept, opposite_branches(list(swept)), strict=True):
        direction = branch.direction
        look: Style = style or ("dots" if direction == "up" else "circles")
        jumps, peaks = find_jumps(branch, other), find_peaks(branch)
        for mesh in scene.meshes:
            points = [
                (response.frequency / scene.unit_Hz, scene.shown(response, mesh))
                for response in branch.responses
            ]
            label = direction if len(swept) > 1 else ""
            curves.append(Curve(look, tuple(points), mesh, label=label))
            start = f"{direction}.mesh{mesh}"
            values[f"{start}.largest"] = (max(value for _, value in points),)
            lost = max(float(r.contact_loss[mesh - 1]) for r in branch.responses)
            values[f"{start}.contact_loss"] = (lost,)
            values[f"{start}.jump"] = tuple(
                j.frequency_from / scene.unit_Hz for j in jumps if j.mesh == mesh
            )
            values[f"{start}.peak"] = tuple(
                p.frequency / scene.unit_Hz for p in peaks if p.mesh == mesh
            )
        values |= _other_motions(branch, scene.unit_Hz)
    return PartResult(tuple(curves), values)


def _other_motions(branch: Branch, unit: float) -> PartValues:
    """Spans of speeds with motions that do not repeat after one common period."""
    kinds: Mapping[str, list[float]] = {
        "aperiodic": [
            r.frequency for r in branch.responses if r.status == Status.APERIODIC
        ],
        "subharmonic": [r.frequency for r in branch.responses if r.multiple > 1],
    }
    return {
        f"{branch.direction}.{name}": (min(speeds) / unit, max(speeds) / unit)
        if speeds
        else ()
        for name, speeds in kinds.items()
    }


@dataclass(frozen=True, kw_only=True)
class TheoryPart(Part):
    """Closed forms; stable vibrations as points, unstable ones as pale ones.

    between : frequencies, in the unit of the figure; resonances in it are drawn
    """

    ORDER: ClassVar = r"mode[1-9]\.\d(/\d)?\."
    keys: ClassVar = (
        ORDER + r"(at|peak|unstable|critical_damping)",
        ORDER + r"mesh[12]\.(contact_lost|largest|separation)",
        r"mesh[12]\.optimal_relief",
    )

    kind: Literal["theory"] = "theory"
    between: tuple[Frequency, Frequency]

    def command(self, scene: Scene) -> Sequence[str]:
        return ["theory", *scene.argv, *scene.harmonics_argv]


def theory(part: TheoryPart, scene: Scene, report: Progress) -> PartResult:
    """Values of modeN.ORDER., order of its frequency over that of the first mesh.

    contact_lost, unstable : both ends; optimal_relief : of each tip, eq. 2.28 [um]
    """
    report("closed forms", 0, 1)
    study = Theory(
        gear_set=GearSetRef.of(scene.gear_set), torque=scene.torque, model=scene.model
    )
    result: TheoryResult = run(study)
    unit = scene.unit_Hz
    low, high = part.between
    shown = [p for p in result.predictions if low <= p.resonance.at / unit <= high]
    curves, values = [], PartValues()
    for mesh in scene.meshes:
        looks: tuple[tuple[bool, Style], ...] = ((True, "points"), (False, "pale"))
        for stable, style in looks:
            points = [
                point
                for prediction in shown
                for point in _vibration_curves(prediction, scene, mesh, stable)
                if low <= point[0] <= high
            ]
            curves.append(Curve(style, tuple(points), mesh))
    for prediction in result.predictions:
        values |= _resonance_values(prediction, scene)
    for mesh_summary in result.summary["meshes"]:
        if mesh_summary["optimal_tip_relief_m"] is not None:
            relief = 1e6 * mesh_summary["optimal_tip_relief_m"]
            values[f"mesh{mesh_summary['mesh']}.optimal_relief"] = (relief,)
    return PartResult(tuple(curve for curve in curves if curve.points), values)


def _vibration_curves(
    prediction: Prediction, scene: Scene, mesh: int, stable: bool
) -> Iterator[tuple[float, float]]:
    amplitudes, frequencies, flags = response_points(prediction)
    near = prediction.resonance
    for amplitude, frequency, flag in zip(
        *(amplitudes, frequencies, flags), strict=True
    ):
        if flag == stable:
            value = float(near.amplitudes(amplitude)[mesh - 1])
            shown = 1e6 * value / math.sqrt(2.0)
            if scene.quantity == "separation":
                shown = float(separation_angle(near, amplitude)[mesh - 1])
            yield float(frequency) / scene.unit_Hz, shown


def _resonance_values(
    prediction: Prediction, scene: Scene
) -> Iterable[tuple[str, tuple[float, ...]]]:
    near, top, unit = prediction.resonance, prediction.top, scene.unit_Hz
    start = f"mode{scene.modes.index(near.mode) + 1}.{near.order}."
    yield f"{start}at", (near.at / unit,)
    yield f"{start}critical_damping", (prediction.critical_damping,)
    unstable = prediction.unstable or ()
    yield f"{start}unstable", tuple(f / unit for f in unstable)
    if top is not None:
        yield f"{start}peak", (top.frequency / unit,)
    for mesh in scene.meshes:
        ends = prediction.transitions[mesh - 1] or ()
        yield f"{start}mesh{mesh}.contact_lost", tuple(f / unit for f in ends)
        if top is not None:
            rms = near.amplitudes(top.amplitude)[mesh - 1] / math.sqrt(2.0)
            yield f"{start}mesh{mesh}.largest", (1e6 * float(rms),)
            yield f"{start}mesh{mesh}.separation", (float(top.separation[mesh - 1]),)
