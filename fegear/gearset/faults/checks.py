"""What faults a gear set can run with, and which of them a model refuses."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset.faults.building import roll_length_below_tip
from fegear.gearset.faults.tooth_faults import (
    FAULT_KINDS,
    BrokenTip,
    FaultKind,
    Faults,
    Wear,
)
from fegear.gearset.model import Gear, GearSet, Mesh
from meshes import GearPair, GeometryError
from meshes.gear import ceiled, floored
from meshes.pairing import undercut_end

KEYS: dict[FaultKind, str] = {
    "cracks": "cracks",
    "spalls": "spalls",
    "broken_tips": "broken_tips",
    "missing": "missing_teeth",
    "worn": "worn_teeth",
    "eccentricity": "eccentricity_um",
}


def require_no_faults(
    gear_set: GearSet, kinds: Collection[FaultKind], model: str
) -> None:
    """Raise InputError where a gear has a fault of a kind that a model leaves out.

    model : such as "statics", in words
    """
    for gear in gear_set.gears:
        for kind in gear.faults.kinds:
            if kind in kinds:
                raise InputError(
                    f'{gear_set.name}: gear "{gear.name}": {KEYS[kind]}; not modelled '
                    f"by {model}, which would leave it out"
                )


def require_nominal(gear_set: GearSet, model: str) -> None:
    """Raise InputError for faults, and for errors of pitches and planets' positions.

    model : that leaves them all out, in words
    """
    require_no_faults(gear_set, FAULT_KINDS, model)
    left_out = f"not modelled by {model}, which would leave it out"
    for gear in gear_set.gears:
        if any(gear.pitch_errors):
            raise InputError(
                f'{gear_set.name}: gear "{gear.name}": pitch_errors_um; {left_out}'
            )
    if gear_set.carrier is not None and any(gear_set.carrier.position_errors):
        raise InputError(f"{gear_set.name}: position_errors_um; {left_out}")


def without_faults(
    gear_set: GearSet, kinds: Collection[FaultKind] = FAULT_KINDS
) -> GearSet:
    """The gear set without faults of some kinds, or of any."""
    gears = (
        replace(gear, faults=gear.faults.without(kinds)) if gear.faults.any else gear
        for gear in gear_set.gears
    )
    return replace(gear_set, gears=tuple(gears))


def with_equal_teeth(gear_set: GearSet) -> GearSet:
    """The gear set without faults but wear that all teeth of a gear have alike."""
    gears = (
        replace(gear, faults=Faults(worn=_common_wear(gear.faults)))
        if gear.faults.any
        else gear
        for gear in gear_set.gears
    )
    return replace(gear_set, gears=tuple(gears))


def _common_wear(faults: Faults) -> tuple[Wear, ...]:
    return tuple(wear for wear in faults.worn if wear.tooth is None)


def require_running(gear_set: GearSet) -> None:
    """Raise InputError where faults end the contact of a mesh or jam its teeth."""
    if not any(gear.faults.any for gear in gear_set.gears):
        return
    for gear in gear_set.gears:
        _require_crackable(gear_set, gear)
        if len(gear.faults.missing) == gear.geometry.teeth:
            raise InputError(
                f'gear "{gear.name}": missing_teeth has all {gear.geometry.teeth} '
                "teeth; some must be left"
            )
    for number, mesh in enumerate(gear_set.meshes):
        _require_handover(gear_set, number)
        _require_distances(gear_set, mesh)


def _require_crackable(gear_set: GearSet, gear: Gear) -> None:
    if gear.faults.cracks and gear_set.carrier is not None:
        raise InputError(
            f'gear "{gear.name}": cracks; cracks of planetary sets are not modelled'
        )


@dataclass(frozen=True)
class _Side:
    """A gear in a mesh.

    overlap : base pitches by which its helix leads
    width : common face width [m]
    """

    gear: Gear
    pair: GearPair
    drives: bool
    overlap: float
    width: float

    def path_end(self, tip: BrokenTip | None = None) -> float:
        """Driver's roll length [m] of the end of the path that the gear's tip limits.

        Where a corner is broken off, the rest of the tip is as far ahead or behind as
        the helix leads there: what is lost is no more than that.
        """
        if tip is None or tip.length is None:
            return self._path_end_below(0.0 if tip is None else tip.height)
        whole, broken = (self._path_end_below(h) for h in (0.0, tip.height))
        lead = self.overlap * self.pair.base_pitch * min(1.0, tip.length / self.width)
        return whole + float(np.clip(broken - whole, -lead, lead))

    def _path_end_below(self, height: float) -> float:
        tip = roll_length_below_tip(self.gear.geometry, height)
        if self.drives:
            return min(tip, self.pair.line_of_action - undercut_end(self.pair.driven))
        return max(self.pair.line_of_action - tip, undercut_end(self.pair.driver))

    def contact_ratio(self, tip: BrokenTip | None) -> float:
        """Total contact ratio of a tooth with a broken tip, its mate's being whole."""
        end = self.path_end(tip)
        length = end - self.pair.path_start if self.drives else self.pair.path_end - end
        return length / self.pair.base_pitch + self.overlap

    @property
    def earliest_end(self) -> float:
        """End of the path of the tooth that loses most of it, as of `path_end`."""
        ends = [self.path_end(tip) for tip in (None, *self.gear.faults.broken_tips)]
        return min(ends) if self.drives else max(ends)

    @property
    def longest_run(self) -> int:
        """Most missing teeth in a row."""
        return max((count for _, count in self.missing_runs()), default=0)

    def missing_runs(self) -> Iterator[tuple[int, int]]:
        """First tooth and number of missing teeth in a row."""
        teeth, missing = self.gear.geometry.teeth, set(self.gear.faults.missing)
        for first in sorted(missing):
            if (first - 1) % teeth in missing:
                continue
            count = 1
            while (first + count) % teeth in missing:
                count += 1
            yield first, count

    def require_handover(self, where: str) -> None:
        """Require that contact passes from each tooth to the next that is there."""
        name, teeth = f'gear "{self.gear.name}"', self.gear.geometry.teeth
        for position, tip in enumerate(self.gear.faults.broken_tips, 1):
            ratio = self.contact_ratio(tip)
            if not ratio >= 1.0:
                raise InputError(
                    f"{name}: broken_tips entry {position}.height_mm = "
                    f"{1e3 * tip.height:.9g}; leaves a contact ratio of "
                    f"{floored(max(0.0, ratio))} to tooth {tip.tooth + 1} in {where}, "
                    "at least 1 is needed"
                )
        for first, count in self.missing_runs():
            # the driver's tooth before them ends late, or the driven's after early
            neighbour = (first - 1 if self.drives else first + count) % teeth
            tips = {tip.tooth: tip for tip in self.gear.faults.broken_tips}
            ratio = self.contact_ratio(tips.get(neighbour))
            # tip corners of the teeth before and after reach half a base pitch past
            # the path of contact each
            if not ratio >= count:
                row = f"tooth {first + 1}" if count == 1 else f"{count} teeth in a row"
                raise InputError(
                    f"{name}: missing_teeth: {row}; at a contact ratio of "
                    f"{floored(ratio)} in {where} the teeth before and after cannot "
                    f"carry the load by their tips, at least {count} is needed"
                )


def _require_handover(gear_set: GearSet, number: int) -> None:
    mesh, overlap = gear_set.meshes[number], gear_set.overlap_ratio(number)
    gears = [gear_set.gears[gear] for gear in mesh.gears]
    where = f'mesh "{gears[0].name}"-"{gears[1].name}"'
    width = gear_set.common_width(number)
    sides = [
        _Side(gear, mesh.pair, drives, overlap, width)
        for gear, drives in zip(gears, (True, False), strict=True)
    ]
    for side in sides:
        side.require_handover(where)
    faulty = [
        side
        for side in sides
        if side.gear.faults.broken_tips or side.gear.faults.missing
    ]
    if len(faulty) < 2:
        return
    end, start = (side.earliest_end for side in sides)
    ratio = (end - start) / mesh.pair.base_pitch + overlap
    needed = 1 + sum(side.longest_run for side in sides)
    if not ratio >= needed:
        raise InputError(
            f"{where}: broken_tips and missing_teeth of both gears leave a contact "
            f"ratio of {floored(max(0.0, ratio))} where they meet; at least {needed} "
            "is needed"
        )


def _require_distances(gear_set: GearSet, mesh: Mesh) -> None:
    """Require teeth that mesh at the least and the largest centre distance."""
    gears = [gear_set.gears[gear] for gear in mesh.gears]
    eccentricity = sum(gear.faults.eccentricity for gear in gears)
    if not eccentricity:
        return
    pair, distance = mesh.pair, mesh.pair.center_distance
    where = f'mesh "{gears[0].name}"-"{gears[1].name}"'
    stated = " and ".join(
        f'gear "{gear.name}": eccentricity_um = {1e6 * gear.faults.eccentricity:.9g}'
        for gear in gears
        if gear.faults.eccentricity
    )
    for extreme in (distance - eccentricity, distance + eccentricity):
        place = f"{stated}; at a centre distance of {1e3 * extreme:.9g} mm in {where}"
        try:
            other = GearPair(pair.driver, pair.driven, extreme)
        except GeometryError as error:
            quantity = "" if error.field == "center_distance" else error.field
            text = f"{quantity.replace('_', ' ')} {error.message}".strip()
            raise InputError(f"{place}: {text}") from None
        room = mesh.backlash + other.backlash - pair.backlash
        if room < -1e-9 * pair.base_pitch:
            raise InputError(
                f"{place}: backlash {1e6 * room:.6g} um, of which "
                f"{ceiled(1e6 * mesh.backlash)} um without eccentricity; it must not "
                "be negative"
            )
