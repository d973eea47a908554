"""Eccentric gearing: curves of its wheels, their torque, and where they exist.

Lengths are those of the driver's pitch radius.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from fegear.commands.eccentric.gearing import Gearing
from fegear.commands.eccentric.gearing_figure import assembled, turned
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from meshes.eccentric import EccentricPair
from meshes.eccentric.base import largest_eccentricity
from validation.commands.reproduce.parts import Curve, Part, PartResult, Style, Value
from validation.commands.reproduce.scene import NoScene
from validation.study.data_files import STRICT, Flag

Share = Annotated[float, Field(ge=0.0, lt=1.0)]
Degrees = Annotated[float, Field(ge=5.0, le=35.0)]
Lobes = Annotated[int, Field(strict=True, ge=1, le=100)]
RADIUS_MM = 1000.0  # so that millimetres are thousandths of it
POINTS = 361


@dataclass(frozen=True, kw_only=True)
class EccentricPart(Part):
    """eccentricity : over the driver's radius; ratio : lobes of the driven wheel"""

    __pydantic_config__ = STRICT

    of_equation: ClassVar = True

    eccentricity: Share
    ratio: Lobes = 1
    pressure_angle_deg: Degrees = 20.0

    @property
    def argv(self) -> list[str]:
        """Words of the command."""
        sizes = {
            "radius": RADIUS_MM,
            "eccentricity": RADIUS_MM * self.eccentricity,
            "ratio": self.ratio,
            "pressure-angle": self.pressure_angle_deg,
        }
        return [
            "eccentric",
            *(w for k, v in sizes.items() for w in (f"--{k}", f"{v:g}")),
        ]


@dataclass(frozen=True, kw_only=True)
class WheelsPart(EccentricPart):
    """Both wheels.

    teeth : of the driver, none for pitch and base curves; base : whether these are
        drawn; distance : of the bearings, in place of that which closes the curve
    around : (x, y, size) that alone is shown
    """

    keys: ClassVar = (
        "center_distance|burmester|open_angle_deg|largest_angle_deg|feasible|module"
        "|(least|largest)_contact_ratio",
    )

    kind: Literal["eccentric_wheels"] = "eccentric_wheels"
    teeth: Annotated[int, Field(strict=True, ge=5)] | None = None
    base: Flag = False
    distance: Annotated[float, Field(gt=0.0)] | None = None
    around: tuple[float, float, float] | None = None

    def command(self, scene: NoScene) -> Sequence[str]:
        if self.distance is not None:
            return ()
        teeth = [] if self.teeth is None else ["--teeth", str(self.teeth)]
        return [*self.argv, *teeth, "-o", "wheels.csv"]


def wheels(part: WheelsPart, scene: NoScene, report: Progress) -> PartResult:
    """Values: distances over the radius, the angle by which the driven curve stays
    open, the largest pressure angle, and of teeth their module and contact ratio."""
    report("wheels", 0, 1)
    sizes = RADIUS_MM, RADIUS_MM * part.eccentricity, part.ratio
    gearing = Gearing(*sizes, part.pressure_angle_deg, part.teeth)
    pair, summary = gearing.pair, gearing.summary
    distance = part.distance or pair.center_distance
    values = {
        "center_distance": distance,
        "burmester": summary["burmester_center_distance_mm"] / RADIUS_MM,
        "open_angle_deg": abs(math.degrees(pair.closing_error(distance))),
        "largest_angle_deg": summary["largest_pressure_angle_deg"],
        "feasible": float(summary["feasible"]),
    }
    for name in ("least_contact_ratio", "largest_contact_ratio"):
        if name in summary:
            values[name] = summary[name]
    if part.teeth is not None:
        values["module"] = summary["module_mm"] / RADIUS_MM
    curves = tuple(_curves(part, gearing, distance))
    return PartResult(curves, {name: (value,) for name, value in values.items()})


def _curves(part: WheelsPart, gearing: Gearing, distance: float) -> Iterator[Curve]:
    for name, points in assembled(gearing).items():
        wheel, kind = name.split("_")
        if kind == "base" and not part.base:
            continue
        if name == "driven_pitch" and part.distance is not None:
            angle = np.linspace(0.0, 2.0 * math.pi * part.ratio, POINTS * part.ratio)
            points = 1e3 * turned(gearing.pair.rolled(angle, distance), 0.0, distance)
        shown = _clip_to_square(points / RADIUS_MM, part.around)
        curve_label = {"tooth": "teeth"}.get(kind, f"{kind} curve")
        label = f"{'driver' if wheel == 'driver' else 'driven wheel'}, {curve_label}"
        style: Style = "broken outline" if kind == "pitch" else "outline"
        yield Curve(style, tuple(map(tuple, shown.tolist())), label=label)


def _clip_to_square(points: Array, around: tuple[float, float, float] | None) -> Array:
    """NaN outside of a square."""
    if around is None:
        return points
    x, y, size = around
    outside = np.abs(points - [x, y]).max(axis=1) > 0.5 * size
    return np.where(outside[:, None], np.nan, points)


@dataclass(frozen=True, kw_only=True)
class TorquePart(EccentricPart):
    """Output torque over input torque over a turn of the driver [degrees]."""

    keys: ClassVar = ("largest|least|mean_power",)

    kind: Literal["eccentric_torque"] = "eccentric_torque"

    def command(self, scene: NoScene) -> Sequence[str]:
        return [*self.argv, "--plot", "wheels.png"]


def torque(part: TorquePart, scene: NoScene, report: Progress) -> PartResult:
    """Values: the largest and the least; the mean of torque times speed."""
    report("torque", 0, 1)
    pair = EccentricPair(1.0, part.eccentricity, part.ratio)
    angle = np.linspace(0.0, 2.0 * math.pi, POINTS)
    ratio, turn = pair.torque_ratio(angle), pair.driver_turn(angle)
    rows = zip(np.degrees(turn).tolist(), ratio.tolist(), strict=True)
    middle = 0.5 * (ratio[1:] + ratio[:-1])
    power = float(middle @ np.diff(pair.driven_turn(angle))) / (2.0 * math.pi)
    label = f"eccentricity {part.eccentricity:g}"
    values = {"largest": float(ratio.max()), "least": float(ratio.min())}
    values["mean_power"] = power
    curve = Curve("line", tuple(rows), label=label)
    return PartResult((curve,), {name: (value,) for name, value in values.items()})


@dataclass(frozen=True, kw_only=True)
class LimitsPart(Part):
    """Largest eccentricity over the pressure angle, a curve for each ratio."""

    of_equation: ClassVar = True
    keys: ClassVar = (r"ratio\d+\.at\d+",)
    no_command: ClassVar = "fegear eccentric prints both limits of one gearing"

    kind: Literal["eccentric_limits"] = "eccentric_limits"
    ratios: Annotated[tuple[Lobes, ...], Field(min_length=1)] = (1, 2, 3)
    angles_deg: Annotated[tuple[Degrees, ...], Field(min_length=1)]

    def quick(self) -> Self:
        return replace(self, angles_deg=self.angles_deg[::7])


def limits(part: LimitsPart, scene: NoScene, report: Progress) -> PartResult:
    """Values of ratioN.atANGLE, in pitch radii."""
    curves: list[Curve] = []
    values: dict[str, tuple[Value, ...]] = {}
    for done, ratio in enumerate(part.ratios):
        report("ratios", done, len(part.ratios))
        rows = [
            (angle, largest_eccentricity(1.0, ratio, math.radians(angle)))
            for angle in part.angles_deg
        ]
        curves.append(Curve("line", tuple(rows), label=f"ratio {ratio}"))
        values |= {f"ratio{ratio}.at{angle:g}": (e,) for angle, e in rows}
    return PartResult(tuple(curves), values)
