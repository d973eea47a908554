"""Verdict of a run: which tooth of a gear is faulty, or that none can be named.

A fault adds a deflection to its mesh while its tooth is in contact. Signals answer it
by the receptances of the train and ring on after it. Least squares over all signals,
weighted by their noise, give the added deflection itself, without the ringing. The
longest quiet part of the turn ends where the fault begins.

A pulse over much of an engagement is that of the tooth whose engagement it is in the
middle of. A short one may be a broken tip, which ends at the end of the path at which
tips touch, or damage of the flank, which begins near the pitch point. Pulses of tips
are short and high. Where both readings are as likely, of different teeth, none is
named.

A tooth is named only if all meshes of its flank have the deflection, and no other gear
has a larger one in the averages over its turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lumped.common.array_types import Array
from lumped.signals.added_deflections import (
    MIN_DEFLECTION,
    MIN_HEIGHT,
    AddedDeflections,
    GearContacts,
    added_deflections,
    pulses_over_turn,
    turns_of,
)
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.sampling import TURN_RTOL, SampledSignals, Sampling
from lumped.train.system import LumpedSystem

PART_NOISE, PART_HEIGHT = 4.0, 0.15  # least height of parts over noise and height
# Height of a tooth in the mesh with the least, over that of its pulse: in all meshes of
# a flank it is the same but for their stiffness and the error of the receptances
SAME_FLANK_HEIGHT = 0.5
# Height of another gear over that of the gear, above which the fault is the other's.
# Teeth in a whole ratio have equal heights: the fault repeats with both
OTHER_HEIGHT = 1.15
QUIET = 0.75  # base pitches before a fault begins
BEYOND = 0.4  # base pitches that a fault may last longer than an engagement
MIN_SHARE = 0.6  # of a turn's deflection in that time, without which it rings
MAIN_HEIGHT = 0.65  # of a pulse, over the largest deflection in that time
BEFORE_REBOUND = 0.35  # the same of a pulse before a rebound
END_HEIGHT = 0.2  # of its ends, over its own height
MAX_BREAK = 0.3  # base pitches within a pulse
# Part of an engagement, and base pitches, above which a pulse is not short
LONG_SHARE, LONG_PITCHES = 0.55, 1.0
MISSING_HEIGHT, HELICAL_MISSING_HEIGHT = (
    1.25,
    0.7,
)  # over the deflection at rest, of a tooth that is not there
# Middle of a long pulse from that of the engagement, toward the tip that bends most,
# and most distance from there [base pitches]
LONG_SHIFT, LONG_REACH = 0.15, 0.47
# End of the pulse of a tip from the end of the path, its deviation and limits [base
# pitches]; of helical gears it is less sharp, of tips that touched too early beyond
TIP_END, TIP_STD, TIP_LIMITS = 0.08, 0.12, (-0.3, 0.5)
HELICAL_TIP_END, HELICAL_TIP_STD = -0.08, 0.12
EARLY_TIP_END, EARLY_TIP_STD, MAX_EARLY = 0.45, 0.3, 0.7
FLANK_STD, MAX_FLANK = 0.22, 0.36  # of the middle from the pitch point [base pitches]
# Height over the deflection at rest, and length, that tips and flanks have as often;
# deviations of their logarithms
EVEN_HEIGHT, HEIGHT_STD = 0.11, 0.8
EVEN_LENGTH, LENGTH_PER_OVERLAP, LENGTH_STD = 0.45, 0.3, 0.4
GAP_STD = 0.15  # of the middle of a fall from that of the gap [base pitches]
MIN_SCORE, MIN_LEAD = -3.5, 0.6  # logarithms of likelihoods


class Pulse(NamedTuple):
    """Added deflection of a fault.

    begin, end : positions of the mesh [base pitches]
    height : largest deflection, negative where it is less than without the fault [m]
    """

    begin: float
    end: float
    height: float


class NamedTooth(NamedTuple):
    """Number of the faulty tooth of a gear, from 1, if one can be named.

    tooth : None where none can be named
    doubt : which other gear the fault may be of, empty where there is no such gear
    """

    tooth: int | None = None
    doubt: str = ""


NOT_NAMED = NamedTooth()


def find_pulse(deflection: Array, contact: Engagement) -> Pulse | None:
    """The pulse of a fault in the deflection (p,) of a turn, None without one."""
    per_pitch = deflection.size // contact.teeth.size
    values, noise = pulses_over_turn(deflection, contact)
    size = np.abs(values)
    if not size.max() > MIN_HEIGHT * noise:
        return None
    least = max(PART_NOISE * noise, PART_HEIGHT * float(size.max()))
    parts = np.where(size > least, size, 0.0)
    most = round((contact.end - contact.start + BEYOND) * per_pitch)
    begin, share = _begin_of_fault(parts, QUIET * per_pitch, min(most, size.size))
    if share < MIN_SHARE:
        return None
    part = np.take(values, range(begin, begin + most), mode="wrap")
    first, last, sign = _main_lobes(part, PART_NOISE * noise, MAX_BREAK * per_pitch)
    height = sign * float((sign * part[first : last + 1]).max())
    at_begin = contact.first + begin / per_pitch
    return Pulse(at_begin + first / per_pitch, at_begin + last / per_pitch, height)


def name_tooth(pulse: Pulse, contact: Engagement, at_rest: float) -> int | None:
    """Number of the tooth of a pulse, from 1, None where it could be another's.

    at_rest : deflection of the mesh under its load [m]
    """
    pitch = np.arange(np.floor(pulse.begin) - 4.0, np.ceil(pulse.end) + 5.0)
    length, height = pulse.end - pulse.begin, abs(pulse.height) / at_rest
    middle = 0.5 * (pulse.begin + pulse.end) - pitch
    toward_tip = 1.0 if contact.drives else -1.0
    engagement = contact.end - contact.start
    most = min(LONG_SHARE * engagement, LONG_PITCHES + 0.5 * contact.overlap)
    missing = HELICAL_MISSING_HEIGHT if contact.overlap else MISSING_HEIGHT
    if length > most or height > missing:
        distance = toward_tip * (middle - 0.5 * (contact.start + contact.end))
        distance = np.abs(distance - LONG_SHIFT)
        best = int(distance.argmin())
        is_near = distance[best] < LONG_REACH
        return _tooth(contact, pitch[best]) if is_near else None
    beyond = pulse.end - pitch - contact.end
    if not contact.drives:
        beyond = contact.start - (pulse.begin - pitch)
    if pulse.height < 0.0:  # less deflection: a tip that no longer touches early
        score = 0.5 * ((beyond - EARLY_TIP_END) / EARLY_TIP_STD) ** 2
        best = int(score.argmin())
        return _tooth(contact, pitch[best]) if score[best] < MAX_EARLY else None
    even_length = EVEN_LENGTH + LENGTH_PER_OVERLAP * contact.overlap
    like_tip = np.log(height / EVEN_HEIGHT) / HEIGHT_STD
    like_tip -= np.log(length / even_length) / (LENGTH_STD * (1.0 + contact.overlap))
    place, std = TIP_END, TIP_STD
    if contact.overlap:
        place, std = HELICAL_TIP_END, HELICAL_TIP_STD
    tip = like_tip - 0.5 * ((beyond - place) / std) ** 2
    tip[(beyond < TIP_LIMITS[0]) | (beyond > TIP_LIMITS[1])] = -np.inf
    # what begins after the path of a tooth is no fault of its tip
    begins = pulse.begin - pitch - contact.end
    if not contact.drives:
        begins = contact.start - (pulse.end - pitch)
    tip[begins > 0.0] = -np.inf
    flank = -like_tip - 0.5 * (middle / FLANK_STD) ** 2
    flank[np.abs(middle) > MAX_FLANK] = -np.inf
    # between the paths of its neighbours a gear falls by a tooth that is not there
    from_gap = middle - 0.5 * (contact.start + contact.end)
    fall = like_tip - 0.5 * (from_gap / GAP_STD) ** 2
    is_between = pulse.begin - pitch > contact.end - 1.0
    is_between &= pulse.end - pitch < contact.start + 1.0
    flank = np.where(is_between, np.maximum(flank, fall), flank)
    return _likelier(contact, pitch, tip, flank)


def _likelier(
    contact: Engagement, pitch: Array, tip: Array, flank: Array
) -> int | None:
    """The tooth of the likelier reading, None of two that are as likely."""
    best_tip, best_flank = int(tip.argmax()), int(flank.argmax())
    scores = tip[best_tip], flank[best_flank]
    if max(scores) < MIN_SCORE:
        return None
    best = best_tip if scores[0] > scores[1] else best_flank
    if best_tip != best_flank and abs(scores[0] - scores[1]) < MIN_LEAD:
        return None
    return _tooth(contact, pitch[best])


def _tooth(contact: Engagement, pitch: float) -> int:
    return int(contact.teeth[int(pitch) % contact.teeth.size])


def _begin_of_fault(parts: Array, quiet: float, most: int) -> tuple[int, float]:
    """First point of the fault, and the share of the parts (p,) within `most` points.

    quiet : points without parts before it
    """
    active = np.flatnonzero(parts)
    gaps = np.diff(active, append=active[0] + parts.size)
    is_quiet = gaps >= min(quiet, gaps.max())
    begins = active[(np.flatnonzero(is_quiet) + 1) % active.size]
    sums = np.concatenate([[0.0], np.tile(parts, 2).cumsum()])
    within = sums[begins + most] - sums[begins]
    best = int(within.argmax())
    return int(begins[best]), float(within[best] / parts.sum())


def _main_lobes(values: Array, noise: float, most: float) -> tuple[int, int, float]:
    """First and last point of the pulse in values (p,), and its sign.

    Of the large lobes the first, and those of its sign until the deflection changes
    its sign. Where contact is lost a rebound may be larger than the pulse before it.

    noise : least height of a part; most : points without one within the pulse
    """
    large = MAIN_HEIGHT * float(np.abs(values).max())
    first = int((np.abs(values) >= large).argmax())
    if values[first] < 0.0:
        earlier = values[:first] >= BEFORE_REBOUND * np.abs(values).max()
        first = int(earlier.argmax()) if earlier.any() else first
    sign = float(np.sign(values[first]))
    lobes = sign * values
    turned = lobes[first:] <= -0.5 * lobes[first]
    stop = first + int(turned.argmax()) if turned.any() else lobes.size
    height = float(lobes[first:stop].max())
    high = np.flatnonzero(lobes[first:stop] >= MAIN_HEIGHT * height)
    last, least = first + int(high[-1]), max(noise, END_HEIGHT * height)
    before = _end(lobes[first::-1], least, most)
    return first - before, last + _end(lobes[last:], least, most), sign


def _end(values: Array, least: float, most: float) -> int:
    """Last point of a lobe of values (p,) that begins at the first.

    It ends where the deflection changes its sign, or is small for `most` points.
    """
    last = 0
    for point, value in enumerate(values):
        if value > least:
            last = point
        elif value < -least or point - last > most:
            break
    return last


def tooth_of_run(
    system: LumpedSystem,
    sampled: SampledSignals,
    sampling: Sampling,
    contacts: GearContacts,
    others: Sequence[GearContacts],
) -> NamedTooth:
    """Faulty tooth of the gear over whose turns the signals of a run are averaged.

    No tooth is named through a ramp and of motion in space.

    contacts : of the gear's teeth; others : of the teeth of all other gears in meshes
    """
    if not sampling.is_constant or system.space is not None:
        return NOT_NAMED
    added = added_deflections(system, sampled, sampling, contacts)
    if added is None:
        return NOT_NAMED
    tooth, height = tooth_of_deflections(added), added.height
    largest, larger, alternative = max(OTHER_HEIGHT * height, MIN_DEFLECTION), "", ""
    for other in others:
        is_mate = not other.by_mesh.keys().isdisjoint(contacts.by_mesh)
        turns = turns_of(sampling, other.gear)
        if turns < 1.0 - TURN_RTOL:
            if tooth is not None and is_mate:
                return NamedTooth(doubt=f"{other.gear.name} turns less than once")
            continue
        of_other = added_deflections(system, sampled, sampling, other)
        other_height = 0.0 if of_other is None else of_other.height
        if other_height > largest:
            largest, larger = other_height, other.gear.name
        elif (
            is_mate and turns == sampling.turns and OTHER_HEIGHT * other_height > height
        ):
            alternative = f"or the tooth of {other.gear.name} that meets it"
    if larger:
        return NamedTooth(doubt=f"{larger} differs more")
    return NOT_NAMED if tooth is None else NamedTooth(tooth, alternative)


def tooth_of_deflections(added: AddedDeflections) -> int | None:
    """The faulty tooth of a gear, None where none can be named."""
    columns = zip(added.values.T, added.contacts, strict=True)
    pulses = [find_pulse(deflection, contact) for deflection, contact in columns]
    heights = [
        0.0 if pulse is None else abs(pulse.height) / float(rest)
        for pulse, rest in zip(pulses, added.at_rest, strict=True)
    ]
    mesh = int(np.argmax(heights))
    pulse, contact = pulses[mesh], added.contacts[mesh]
    if pulse is None or heights[mesh] < MIN_DEFLECTION:
        return None
    tooth = name_tooth(pulse, contact, float(added.at_rest[mesh]))
    if tooth is None or len(pulses) == 1:
        return tooth
    least = float(added.flank_heights[int(contact.drives), tooth - 1])
    return tooth if least >= SAME_FLANK_HEIGHT * heights[mesh] else None
