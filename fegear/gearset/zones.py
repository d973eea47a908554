"""Where on a flank contact begins, ends and is borne by one pair alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fegear.files.errors import InputError
from fegear.gearset.modifications import Relief
from fegear.gearset.refusals import KeyOf
from fegear.gearset.schema import ReliefEntry
from meshes import GearPair, SpurGear
from meshes.gear import Bound, Comparison
from meshes.pairing import undercut_end


@dataclass(frozen=True)
class Zones:
    """Roll lengths sqrt(r^2 - rb^2) [m] of one gear's flank in one mesh.

    start : of the active profile (SAP), where the mate's tip touches
    low, high : lowest and highest point of single-tooth contact; low exceeds high
        where at least two pairs always touch
    """

    gear: SpurGear
    mate: SpurGear
    start: float
    low: float
    high: float
    tip: float

    def roll_angle_deg(self, roll_length: float) -> float:
        return math.degrees(roll_length / self.gear.base_radius)


def zones(pair: GearPair, role: str) -> Zones:
    """Zones of the "driver" or the "driven" gear."""
    gear, mate = pair.driver, pair.driven
    if role == "driven":
        gear, mate = mate, gear
    start = pair.line_of_action - mate.tip_roll_length
    start = max(start, undercut_end(gear))
    tip = gear.tip_roll_length
    low, high = tip - pair.base_pitch, start + pair.base_pitch
    return Zones(gear, mate, start, low, high, tip)


def relief(
    entry: ReliefEntry | None, pair: GearPair, role: str, place: str, where: KeyOf
) -> Relief | None:
    """The relief at the "tip" or "root" of a gear; InputError if it does not fit.

    Tip relief may begin at the form circle, root relief below the tip.
    """
    if entry is None:
        return None
    flank = zones(pair, role)
    start = _relief_start(entry, pair.base_pitch, flank, place, where)
    fits = {
        "tip": flank.gear.form_roll_length <= start < flank.tip,
        "root": flank.start < start < flank.tip,
    }
    if not fits[place]:
        raise _too_long(entry, start, pair.base_pitch, flank, place, where)
    return Relief(
        magnitude=entry.magnitude_um * 1e-6, start_roll_length=start, shape=entry.shape
    )


def _relief_start(
    entry: ReliefEntry, pitch: float, flank: Zones, place: str, where: KeyOf
) -> float:
    """Roll length [m]; one base pitch is one pitch angle times the base radius."""
    if entry.length_pitches is not None:
        length = entry.length_pitches * pitch
        return flank.tip - length if place == "tip" else flank.start + length
    if entry.start_roll_angle_deg is not None:
        return math.radians(entry.start_roll_angle_deg) * flank.gear.base_radius
    if flank.low > flank.high:
        ratio = (flank.tip - flank.start) / pitch
        raise InputError(
            f'{where.text}.start = "{entry.start}"; at a contact ratio of {ratio:.4g} '
            "there is no single-tooth contact, use length_pitches"
        )
    return flank.high if place == "tip" else flank.low


def _too_long(
    entry: ReliefEntry, start: float, pitch: float, flank: Zones, place: str, key: KeyOf
) -> InputError:
    """The error of a relief whose start [m] is beyond an end of the flank."""
    comparisons: tuple[Comparison, Comparison] = "at least", "must be below"
    ends = [(flank.gear.form_roll_length, "the form circle"), (flank.tip, "the tip")]
    if place == "root":
        comparisons = "must be above", "must be below"
        ends[0] = flank.start, "the start of contact"
    end = int(start > ends[0][0])
    roll, name = ends[end]
    reason = f"{name} of {key.gear}"
    if entry.length_pitches is not None:
        from_end = flank.tip if place == "tip" else flank.start
        reason = f"{'whole' if place == 'tip' else 'whole active'} profile"
        bound = Bound(comparisons[end], roll, f"the {reason} of {key.gear}")
        return key.refusal(
            "length_pitches", bound.mapped(lambda s: abs(s - from_end) / pitch)
        )
    bound = Bound(comparisons[end], roll, reason)
    if entry.start_roll_angle_deg is not None:
        angle = bound.mapped(flank.roll_angle_deg)
        return key.refusal("start_roll_angle_deg", angle, "deg")
    return InputError(f'{key.text}.start = "{entry.start}"; it is beyond {reason}')
