"""Keys of a gear's faults in a gear-set file, and the checks that need no mesh."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, Literal, Protocol, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, model_validator

from fegear.gearset.faults.tooth_faults import MAX_SPALLS, MAX_WIDTH_SHARE, WidthEnd
from fegear.gearset.modifications import Interpolation
from lumped.common.checks import format_number
from meshes.gear import apart_from, ceiled, floored

Item = TypeVar("Item")
MAX_TEETH = 10000
WIDTH_RTOL = 1e-9  # of a face width, by which rounded places may lie outside
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
    width_share: Annotated[float, Field(gt=0.0, le=MAX_WIDTH_SHARE)] | None = Field(
        default=None,
        description="Part of the face width over which the flank is missing.",
    )
    length_mm: Length | None = Field(
        default=None,
        description="Length along the face width over which the flank is missing, "
        f"instead of width_share, at most {MAX_WIDTH_SHARE:g} of the width.",
    )
    place_mm: Annotated[float, Field(ge=-1e5, le=1e5)] = Field(
        default=0.0,
        description="Middle of the spall from the middle of the face width, along the "
        "axis toward the far end. Loads vary over the width unless it is 0.",
    )

    @model_validator(mode="after")
    def _stated_once(self) -> SpallEntry:
        sizes = [self.width_share, self.length_mm]
        if sizes.count(None) != 1:
            start = "only one" if None not in sizes else "one"
            raise ValueError(f"{start} of width_share and length_mm is needed")
        return self

    def share_of(self, face_width_mm: float) -> float:
        """Missing part of a face width [mm]."""
        if self.length_mm is None:
            return self.width_share or 0.0
        return self.length_mm / face_width_mm

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
        description="Height of the tooth that is missing below the tip circle: over "
        "the whole face width, or of a corner at its end of the width."
    )
    length_mm: Length | None = Field(
        default=None,
        description="Length along the face width of a corner that is broken off, "
        "over which its edge rises to the tip, linear in the roll angle; loads vary "
        "over the width. [default: the tip is missing over the whole width]",
    )
    end: WidthEnd | None = Field(
        default=None,
        description="End of the face width at which the corner is broken off.",
    )

    @model_validator(mode="after")
    def _whole_corner(self) -> BrokenTipEntry:
        if (self.length_mm is None) != (self.end is None):
            stated, missing = "length_mm", "end"
            if self.length_mm is None:
                stated, missing = missing, stated
            raise ValueError(f"{missing} is needed with {stated}")
        return self


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
    face_width_mm: float
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
    _require_within_face(gear)
    _require_width(gear.spalls, gear.face_width_mm)
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


def _require_within_face(gear: HasFaults) -> None:
    """Require that lengths along the face width lie within it."""
    width = gear.face_width_mm
    for position, spall in enumerate(gear.spalls, 1):
        where, share = f"spalls entry {position}", spall.share_of(width)
        if share > MAX_WIDTH_SHARE:
            raise ValueError(
                f"{where}.length_mm = {format_number(spall.length_mm or 0.0)}; must "
                f"be at most {floored(MAX_WIDTH_SHARE * width)}, {MAX_WIDTH_SHARE:g} "
                "of face_width_mm"
            )
        most = 0.5 * width * (1.0 - share)
        if abs(spall.place_mm) > most * (1.0 + WIDTH_RTOL):
            raise ValueError(
                f"{where}.place_mm = {format_number(spall.place_mm)}; must be from "
                f"{ceiled(-most)} to {floored(most)}, the spall ends "
                "within face_width_mm"
            )
    for position, tip in enumerate(gear.broken_tips, 1):
        if tip.length_mm is not None and tip.length_mm > width:
            raise ValueError(
                f"broken_tips entry {position}.length_mm = "
                f"{format_number(tip.length_mm)}; must be at most face_width_mm, "
                f"{format_number(width)}"
            )


def is_uneven(gear: HasFaults) -> bool:
    """Whether damage of a gear makes loads vary over the face width."""
    has_corner = any(tip.length_mm is not None for tip in gear.broken_tips)
    return has_corner or any(spall.place_mm for spall in gear.spalls)


def _require_width(spalls: Sequence[SpallEntry], face_width_mm: float) -> None:
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
            missing = sum(o.share_of(face_width_mm) for o in others if o.covers(start))
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
