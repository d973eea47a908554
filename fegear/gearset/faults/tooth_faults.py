"""Faults of a gear: damaged and worn teeth, and mounting off centre.

Teeth count from 0 as `Gear.pitch_errors` do: in the order in which they come into
contact, that of the reference pair of the gear's first mesh first. Faults of flanks are
on the flank that carries load in the gear's first mesh, which is the right flank of the
tooth frame (`meshes.profile`). All lengths are in metres and angles in radians.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from typing import Literal, get_args

from fegear.files.errors import InputError
from fegear.gearset.field_checks import require_fields, require_positive, require_within
from fegear.gearset.modifications import FlankProfile
from lumped.common.checks import format_number
from meshes.crack import Crack

FaultKind = Literal[
    "cracks", "spalls", "broken_tips", "missing", "worn", "eccentricity"
]
FAULT_KINDS: tuple[FaultKind, ...] = get_args(FaultKind)
WidthEnd = Literal["near", "far"]
MAX_SPALLS = 8  # of a tooth
MAX_WIDTH_SHARE = 0.95  # of the face width, what a spall takes at most


@dataclass(frozen=True, kw_only=True)
class ToothCrack:
    """A crack at the root of a tooth.

    The right fillet of the tooth frame is below the flank that carries load in the
    gear's first mesh, so that `crack.left` is False at the loaded root, which is in
    tension.
    """

    tooth: int
    crack: Crack

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, kw_only=True)
class Spall:
    """A stretch of the loaded flank that is missing over part of the face width.

    start_roll_length, end_roll_length : sqrt(r^2 - rb^2) of its ends, increasing toward
        the tip, negative on an internal gear
    width_share : missing part of the face width
    place : of its middle from that of the face width, toward the far end
    """

    tooth: int
    start_roll_length: float
    end_roll_length: float
    width_share: float
    place: float = 0.0

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, "width_share")
        if not self.width_share <= MAX_WIDTH_SHARE:
            raise InputError(
                f"width_share = {format_number(self.width_share)}; at most "
                f"{MAX_WIDTH_SHARE:g}"
            )
        if not self.start_roll_length < self.end_roll_length:
            raise InputError(
                f"end_roll_length = {format_number(self.end_roll_length)}; must be "
                "above "
                f"start_roll_length, {format_number(self.start_roll_length)}"
            )


@dataclass(frozen=True, kw_only=True)
class BrokenTip:
    """A tooth whose tip is missing over the whole face width, or one of its corners.

    height : from the tip circle down to where the tooth ends, of a corner at its end
        of the width
    length : of a corner along the width, at which its edge has come up to the tip,
        linear in the roll length; None of a tip
    end : of the width at which a corner is
    """

    tooth: int
    height: float
    length: float | None = None
    end: WidthEnd = "near"

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, "height", "length")

    @property
    def is_corner(self) -> bool:
        return self.length is not None


@dataclass(frozen=True, kw_only=True)
class Wear:
    """Material missing over the loaded flank of one tooth or of all.

    tooth : None for all teeth without wear of their own
    profile : measured points, whose deviations are negative by the depth of wear
    """

    tooth: int | None
    profile: FlankProfile

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, kw_only=True)
class Faults:
    """All faults of a gear; none by default.

    missing : teeth that are broken off
    eccentricity : distance of the centre of the teeth from the axis of rotation
    eccentricity_angle : direction from that axis to the centre when the gear set's
        first mesh is at its pitch point, counter-clockwise from the direction to the
        axis of the mate in the gear's first mesh. The teeth are then deepest in that
        mesh at 0, and at pi where one of its gears is internal. The first mesh's
        driver rotates counter-clockwise.
    """

    cracks: tuple[ToothCrack, ...] = ()
    spalls: tuple[Spall, ...] = ()
    broken_tips: tuple[BrokenTip, ...] = ()
    missing: tuple[int, ...] = ()
    worn: tuple[Wear, ...] = ()
    eccentricity: float = 0.0
    eccentricity_angle: float = 0.0

    def __post_init__(self) -> None:
        require_fields(self)
        require_within(self, "eccentricity", 0.0, 1e3)

    @property
    def any(self) -> bool:
        """Whether there is any fault."""
        return bool(self.kinds)

    @property
    def kinds(self) -> tuple[FaultKind, ...]:
        """Kinds of fault that the gear has."""
        return tuple(kind for kind in FAULT_KINDS if getattr(self, kind))

    @property
    def teeth(self) -> tuple[int, ...]:
        """Teeth that differ from the others, in order."""
        single: tuple[ToothCrack | Spall | BrokenTip | Wear, ...]
        single = (*self.cracks, *self.spalls, *self.broken_tips, *self.worn)
        teeth = {fault.tooth for fault in single if fault.tooth is not None}
        return tuple(sorted(teeth | set(self.missing)))

    def on_flank(self, is_first: bool) -> Faults:
        """The faults that a flank meets in its mesh.

        Spalls and wear are on the flank of the gear's first mesh, and a crack is open
        where the flank above its root carries the load.

        is_first : whether it is the flank of the gear's first mesh
        """
        cracks = (fault for fault in self.cracks if fault.crack.left != is_first)
        met = replace(self, cracks=tuple(cracks))
        return met if is_first else met.without(("spalls", "worn"))

    def broken_height(self, tooth: int) -> float:
        """Height of a tooth's broken tip, 0 without; a corner leaves it its tip."""
        tips = (tip for tip in self.broken_tips if not tip.is_corner)
        return sum(tip.height for tip in tips if tip.tooth == tooth)

    def wear_of(self, tooth: int) -> FlankProfile | None:
        """Wear of a tooth: its own, else that of all teeth."""
        profiles = {wear.tooth: wear.profile for wear in self.worn}
        return profiles.get(tooth, profiles.get(None))

    def without(self, kinds: Collection[FaultKind]) -> Faults:
        """The faults of other kinds."""
        hidden = {*kinds, *(["eccentricity_angle"] if "eccentricity" in kinds else [])}
        names = (entry.name for entry in fields(self) if entry.name not in hidden)
        return Faults(**{name: getattr(self, name) for name in names})


NO_FAULTS = Faults()
