"""From a gear's keys of faults to frozen values in SI units, with its meshes known."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from fegear.files.errors import InputError
from fegear.gearset.faults.keys import CrackEntry, SpallEntry, WearEntry
from fegear.gearset.faults.tooth_faults import (
    BrokenTip,
    Faults,
    Spall,
    ToothCrack,
    Wear,
)
from fegear.gearset.model import Mesh
from fegear.gearset.modifications import FlankProfile
from fegear.gearset.profiles import MeasuredPoints, convert_measured_points
from fegear.gearset.schema import GearEntry
from fegear.gearset.zones import Zones, zones
from lumped.common.checks import format_number
from lumped.common.units import MM, UM
from meshes import SpurGear
from meshes.crack import Crack, crack_points, require_separate
from meshes.gear import ceiled, floored

CRACK_KEYS = {
    "depth": "depth_mm",
    "tangent_angle": "tangent_angle_deg",
    "direction": "direction_deg",
}
RANGE_RTOL = 1e-6  # of a flank, by which rounded roll angles may lie outside


def faults_of(
    entry: GearEntry, teeth: SpurGear, index: int, meshes: Sequence[Mesh]
) -> Faults:
    """The faults of a gear; InputError where one does not fit its teeth.

    index : of the gear; a gear without mesh cannot have faults of its flanks
    """
    where = f'gear "{entry.name}"'
    flank = _first_flank(index, meshes)
    if flank is None and (entry.spalls or entry.worn_teeth):
        key = "spalls" if entry.spalls else "worn_teeth"
        raise InputError(f"{where}: {key}; not allowed for a gear without mesh")
    return Faults(
        cracks=tuple(_cracks(entry, teeth, where)),
        spalls=tuple(_spalls(entry, flank, where)) if flank else (),
        broken_tips=tuple(_broken_tips(entry, teeth, where)),
        missing=tuple(sorted(tooth - 1 for tooth in entry.missing_teeth)),
        worn=tuple(_worn(entry, flank, where)) if flank else (),
        eccentricity=entry.eccentricity_um * UM,
        eccentricity_angle=math.radians(entry.eccentricity_angle_deg),
    )


def _first_flank(index: int, meshes: Sequence[Mesh]) -> Zones | None:
    """Flank that carries load in the first mesh of a gear, None without mesh."""
    for mesh in meshes:
        if index in mesh.gears:
            return zones(mesh.pair, "driver" if index == mesh.driver else "driven")
    return None


def _cracks(entry: GearEntry, teeth: SpurGear, where: str) -> Iterator[ToothCrack]:
    """Cracks within the sector of their tooth, apart from each other."""
    of_tooth: dict[int, list[Crack]] = {}
    for position, keys in enumerate(entry.cracks, 1):
        try:
            crack = _crack(keys)
            crack_points(teeth, crack)
            others = of_tooth.setdefault(keys.tooth, [])
            require_separate(teeth, [*others, crack])
        except ValueError as error:
            text = str(error)
            for field, key in CRACK_KEYS.items():
                text = re.sub(rf"^{field}\b", key, text)
            raise InputError(
                f"{where}: cracks entry {position}, tooth {keys.tooth}: {text}"
            ) from None
        others.append(crack)
        yield ToothCrack(tooth=keys.tooth - 1, crack=crack)


def _crack(entry: CrackEntry) -> Crack:
    direction = entry.direction_deg
    return Crack(
        depth=entry.depth_mm * MM,
        tangent_angle=math.radians(entry.tangent_angle_deg),
        direction=None if direction is None else math.radians(direction),
        left=entry.root == "back",
    )


def _spalls(entry: GearEntry, flank: Zones, where: str) -> Iterator[Spall]:
    broken = {
        tip.tooth: tip.height_mm * MM
        for tip in entry.broken_tips
        if tip.length_mm is None
    }
    for position, spall in enumerate(entry.spalls, 1):
        tip = roll_length_below_tip(flank.gear, broken.get(spall.tooth, 0.0))
        place = f"{where}: spalls entry {position}, tooth {spall.tooth}"
        _require_on_flank(spall, flank, tip, place)
        angles = spall.start_roll_angle_deg, spall.end_roll_angle_deg
        rolls = [math.radians(angle) * flank.gear.base_radius for angle in angles]
        yield Spall(
            tooth=spall.tooth - 1,
            start_roll_length=min(rolls),
            end_roll_length=max(rolls),
            width_share=spall.share_of(entry.face_width_mm),
            place=spall.place_mm * MM,
        )


def _broken_tips(entry: GearEntry, teeth: SpurGear, where: str) -> Iterator[BrokenTip]:
    """Broken tips and corners, below which flank is left."""
    most = abs(teeth.tip_radius - teeth.form_radius) / MM
    for position, tip in enumerate(entry.broken_tips, 1):
        if not tip.height_mm <= most:
            raise InputError(
                f"{where}: broken_tips entry {position}: height_mm = "
                f"{format_number(tip.height_mm)}; must be at most {floored(most)}, "
                "down to the form circle; missing_teeth has whole teeth"
            )
        yield BrokenTip(
            tooth=tip.tooth - 1,
            height=tip.height_mm * MM,
            length=None if tip.length_mm is None else tip.length_mm * MM,
            end=tip.end or "near",
        )


def roll_length_below_tip(gear: SpurGear, height: float) -> float:
    """Roll length [m] of a flank at a height below the tip circle.

    That of the form circle where the height leaves no flank.
    """
    radius = gear.tip_radius - height
    if not radius > gear.form_radius:
        return gear.form_roll_length
    return gear.sign * math.sqrt(max(0.0, radius**2 - gear.base_radius**2))


def _require_on_flank(spall: SpallEntry, flank: Zones, tip: float, place: str) -> None:
    limits = sorted(flank.roll_angle_deg(roll) for roll in (flank.start, tip))
    slack = RANGE_RTOL * (limits[1] - limits[0])
    for key in ("start_roll_angle_deg", "end_roll_angle_deg"):
        angle = getattr(spall, key)
        if not limits[0] - slack <= angle <= limits[1] + slack:
            raise InputError(
                f"{place}: {key} = {format_number(angle)}; must be from "
                f"{ceiled(limits[0])} to "
                f"{floored(limits[1])}, start of the active profile and tip"
            )


def _worn(entry: GearEntry, flank: Zones, where: str) -> Iterator[Wear]:
    for position, wear in enumerate(entry.worn_teeth, 1):
        profile = _wear_profile(wear, flank, f"{where}: worn_teeth entry {position}")
        tooth = None if wear.tooth is None else wear.tooth - 1
        yield Wear(tooth=tooth, profile=profile)


def _wear_profile(entry: WearEntry, flank: Zones, where: str) -> FlankProfile:
    depths = entry.depth_um
    places = [f"{where}.{{key}} entry {i}" for i in range(1, len(depths) + 1)]
    table = MeasuredPoints(entry.point_key, entry.points, depths, places, "depth_um")
    if len(depths) < 2:
        count = f"{len(depths)} entries"
        raise InputError(f"{where}.depth_um has {count}; at least 2 needed")
    rolls, missing = convert_measured_points(table, flank, where)
    return FlankProfile(
        roll_lengths=rolls,
        deviations=tuple(-depth for depth in missing),
        interpolation=entry.interpolation,
    )
