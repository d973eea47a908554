"""Keys of a gear's faults in a gear-set file, and the checks that need no mesh."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, Literal, Protocol, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, model_validator

from fegear.gearset.faults.tooth_faults import MAX_SPALLS, MAX_WIDTH_SHARE
from fegear.gearset.modifications import Interpolation
from lumped.common.checks import format_number
from meshes.gear import apart_from

Item = TypeVar("Item")
MAX_TEETH = 10000
Listed = Annotated[tuple[Item, ...], Strict(False)]
ToothNumber = Annotated[int, Field(ge=1, le=MAX_TEETH)]
Length = Annotated[float, Field(gt=0.0, le=1e5)]
RollAngle = Annotated[float, Field(ge=0.0, le=1e5)]
Depth = Annotated[float, Field(ge=0.0, le=1e5)]
Root = Literal["loaded", "back"]
TOOTH = (
    "Number of the tooth from 1, in the order in which teeth come into contact in the "
    "gear's first mesh, that of the reference pair first."
)


class FaultEntry(BaseModel):
    """A table of a fault."""

    model_config = ConfigDict(
        defer_build=True, extra="forbid", frozen=True, strict=True, allow_inf_nan=False
    )


class CrackEntry(FaultEntry):
    """cracks of a gear."""

    tooth: ToothNumber = Field(description=TOOTH)
    depth_mm: Length = Field(description="Depth of the crack along its path.")
    tangent_angle_deg: Annotated[float, Field(ge=5.0, le=85.0)] = Field(
        default=30.0,
        description="Angle between the tooth's axis and the tangent of the fillet "
        "where the crack starts.",
    )
    direction_deg: Annotated[float, Field(ge=0.0, le=180.0)] | None = Field(
        default=None,
        description="Angle between the straight path and the tooth's axis: at 0 it "
        "leads to the gear's centre, at 90 straight across the tooth. [default: normal "
        "to the fillet]",
    )
    root: Root = Field(
        default="loaded",
        description="Fillet of the flank that carries load in the gear's first mesh, "
        "where there is tension, or of the back flank.",
    )


class SpallEntry(FaultEntry):
    """spalls of a gear; several may be on one tooth, also side by side."""

    tooth: ToothNumber = Field(description=TOOTH)
    start_roll_angle_deg: RollAngle = Field(
        description="Roll angle where the spall starts, on the flank that carries load "
        "in the gear's first mesh."
    )
    end_roll_angle_deg: RollAngle = Field(
        description="Roll angle where the spall ends, above its start."
    )
    width_share: Annotated[float, Field(gt=0.0, le=MAX_WIDTH_SHARE)] = Field(
        description="Part of the face width over which the flank is missing."
    )

    @model_validator(mode="after")
    def _in_order(self) -> SpallEntry:
        start, end = self.start_roll_angle_deg, self.end_roll_angle_deg
        if not end > start:
            raise ValueError(
                f"end_roll_angle_deg = {format_number(end)}; must be above "
                f"start_roll_angle_deg, {format_number(start)}"
            )
        return self

    def covers(self, angle: float) -> bool:
        """Whether the spall is at a roll angle [deg]."""
        return self.start_roll_angle_deg <= angle <= self.end_roll_angle_deg


class BrokenTipEntry(FaultEntry):
    """broken_tips of a gear."""

    tooth: ToothNumber = Field(description=TOOTH)
    height_mm: Length = Field(
        description="Height of the tooth that is missing below the tip circle, over "
        "the whole face width."
    )


class WearEntry(FaultEntry):
    """worn_teeth of a gear."""

    tooth: ToothNumber | None = Field(
        default=None,
        description="Number of the tooth from 1, in that order. [default: all teeth "
        "without wear of their own]",
    )
    roll_angle_deg: Listed[RollAngle] | None = Field(
        default=None, description="Roll angles of points on the flank, increasing."
    )
    diameter_mm: Listed[Length] | None = Field(
        default=None,
        description="Diameters of these points, instead of roll_angle_deg.",
    )
    depth_um: Listed[Depth] = Field(
        description="Depth of material missing at these points, on the flank that "
        "carries load in the gear's first mesh; constant beyond the first and the last."
    )
    interpolation: Interpolation = Field(
        default="cubic",
        description="Between points: shape-preserving cubic, or linear with a kink at "
        "each point.",
    )

    @property
    def point_key(self) -> str:
        """The one of the two exclusive keys that places the points."""
        return "diameter_mm" if self.roll_angle_deg is None else "roll_angle_deg"

    @property
    def points(self) -> tuple[float, ...]:
        return getattr(self, self.point_key) or ()

    @model_validator(mode="after")
    def _one_scale(self) -> WearEntry:
        scales = [self.roll_angle_deg, self.diameter_mm]
        if scales.count(None) != 1:
            start = "only one" if None not in scales else "one"
            raise ValueError(
                f"{start} of roll_angle_deg and diameter_mm is needed with depth_um"
            )
        if len(self.points) != len(self.depth_um):
            raise ValueError(
                f"{self.point_key} has {len(self.points)} entries and depth_um "
                f"{len(self.depth_um)}; as many are needed"
            )
        return self


Cracks = Annotated[
    Listed[CrackEntry], Field(description="Cracks at the roots of teeth.")
]
Spalls = Annotated[
    Listed[SpallEntry], Field(description="Flanks that are missing in part.")
]
BrokenTips = Annotated[
    Listed[BrokenTipEntry], Field(description="Teeth whose tips are broken off.")
]
MissingTeeth = Annotated[
    Listed[ToothNumber],
    Field(
        description="Numbers of teeth that are broken off, from 1 in the order in "
        "which teeth come into contact in the gear's first mesh, that of the reference "
        "pair first."
    ),
]
WornTeeth = Annotated[
    Listed[WearEntry], Field(description="Wear of the flanks, of one tooth or of all.")
]
Eccentricity = Annotated[
    float,
    Field(
        ge=0.0,
        le=1e5,
        description="Distance of the centre of the teeth from the axis of rotation.",
    ),
]
EccentricityAngle = Annotated[
    float,
    Field(
        ge=-1e5,
        le=1e5,
        description="Direction from the axis of rotation to the centre of the teeth "
        "when the gear set's first mesh is at its pitch point, counter-clockwise from "
        "the direction to the mate's axis in the gear's first mesh.",
    ),
]


class HasFaults(Protocol):
    """A gear's keys, as far as its faults are concerned."""

    teeth: Any
    internal: bool
    cracks: tuple[CrackEntry, ...]
    spalls: tuple[SpallEntry, ...]
    broken_tips: tuple[BrokenTipEntry, ...]
    missing_teeth: tuple[int, ...]
    worn_teeth: tuple[WearEntry, ...]
    eccentricity_um: float
    eccentricity_angle_deg: float


def require_faults(gear: HasFaults) -> None:
    """Require teeth that are there, each with a kind of fault once; ValueError."""
    if gear.internal and gear.cracks:
        raise ValueError("cracks: cracks of internal gears are not modelled")
    for key in ("cracks", "spalls", "broken_tips", "worn_teeth"):
        entries: Sequence[Any] = getattr(gear, key)
        numbers = [entry.tooth for entry in entries]
        _require_teeth(gear.teeth, key, numbers)
        _require_present(gear.missing_teeth, key, numbers)
    _require_teeth(gear.teeth, "missing_teeth", gear.missing_teeth)
    _require_once("missing_teeth", gear.missing_teeth)
    roots = [f"{crack.tooth} at the {crack.root} root" for crack in gear.cracks]
    _require_once("cracks", roots)
    _require_width(gear.spalls)
    _require_once("broken_tips", [tip.tooth for tip in gear.broken_tips])
    _require_once("worn_teeth", [wear.tooth for wear in gear.worn_teeth])
    if gear.eccentricity_angle_deg and not gear.eccentricity_um:
        raise ValueError(
            f"eccentricity_angle_deg = {gear.eccentricity_angle_deg:g}; "
            "eccentricity_um is needed with it"
        )


def _require_teeth(teeth: int, key: str, numbers: Sequence[int | None]) -> None:
    for position, number in enumerate(numbers, 1):
        if number is not None and number > teeth:
            name = key if key == "missing_teeth" else f"{key} entry {position}.tooth"
            raise ValueError(f"{name} = {number}; must be 1 to {teeth}")


def _require_present(
    missing: Sequence[int], key: str, numbers: Sequence[int | None]
) -> None:
    for position, number in enumerate(numbers, 1):
        if number in missing:
            raise ValueError(
                f"{key} entry {position}.tooth = {number}; must not be one of "
                "missing_teeth"
            )


def _require_width(spalls: Sequence[SpallEntry]) -> None:
    """Require that spalls side by side on a tooth leave a part of its width."""
    of_teeth: dict[int, list[SpallEntry]] = {}
    for position, spall in enumerate(spalls, 1):
        others = of_teeth.setdefault(spall.tooth, [])
        others.append(spall)
        if len(others) > MAX_SPALLS:
            raise ValueError(
                f"spalls: tooth {spall.tooth} has {len(others)}; at most {MAX_SPALLS} "
                "are allowed"
            )
        for start in (other.start_roll_angle_deg for other in others):
            missing = sum(o.width_share for o in others if o.covers(start))
            if missing > MAX_WIDTH_SHARE:
                most = f"{MAX_WIDTH_SHARE:g}"
                raise ValueError(
                    f"spalls entry {position}: at {start:g} deg of roll angle spalls "
                    f"of tooth {spall.tooth} take {apart_from(missing, most)} of the "
                    f"width; at most {most}"
                )


def _require_once(key: str, teeth: Iterable[int | str | None]) -> None:
    for tooth, count in Counter(teeth).items():
        if count > 1:
            which = "all teeth" if tooth is None else f"tooth {tooth}"
            raise ValueError(f"{key}: {which} is listed {count} times; once is allowed")
