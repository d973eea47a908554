"""Gears at their centre distance, and tips that give a contact ratio."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from fegear.files.errors import InputError
from fegear.gearset.problems import shown
from fegear.gearset.refusals import Key, Refusal
from fegear.gearset.schema import Document, MeshEntry
from fegear.gearset.teeth import MM, Blank, Tip, blank_of
from lumped.common.checks import require_present
from meshes.gear import Bound, bisected
from meshes.involute import inverse_involute, involute

HIGHEST_ADDENDUM = 3.0  # modules, far beyond any pointed tooth
CONTACT_RATIO_TOLERANCE = 1e-3
FORM_MARGIN = 1e-4  # of a ring's tip from where the mate's fillet begins, relative


MIN_SHORTENING = 1e-6  # [m]; smaller ones are not listed as inferred


@dataclass(frozen=True)
class Spacing:
    """Two gears without tips at their centre distance [m].

    inference : sentence on the centre distance, empty where it is given
    """

    one: Blank
    two: Blank
    center_distance: float
    inference: str = ""

    @property
    def is_internal(self) -> bool:
        return self.one.sign * self.two.sign < 0

    @property
    def line_of_action(self) -> float:
        bases = self.one.base_radius + self.two.base_radius
        line = math.sqrt(self.center_distance**2 - bases**2)
        return -line if self.is_internal else line

    @property
    def shortening(self) -> float:
        """Difference of the sum of profile shifts and the distance of the reference
        circles [m]. Tips that are shortened by it keep their clearance (DIN 3960)."""
        one, two = self.one, self.two
        shifts = one.thickness.profile_shift + two.thickness.profile_shift
        reference = one.reference_radius + two.reference_radius
        return shifts * one.module - (self.center_distance - abs(reference))

    def contact_ratio(self, tip_one: float, tip_two: float) -> float:
        """Contact ratio with tip radii [m] of at least the base radii."""
        path = _roll_length(self.one, tip_one) + _roll_length(self.two, tip_two)
        return (path - self.line_of_action) / self.one.base_pitch


def _roll_length(gear: Blank, radius: float) -> float:
    return gear.sign * math.sqrt(max(0.0, radius**2 - gear.base_radius**2))


def spacing(mesh: MeshEntry, one: Blank, two: Blank) -> Spacing:
    """Place two gears; raises InputError if they cannot mesh at all."""
    pitches = one.base_pitch, two.base_pitch
    if abs(pitches[0] - pitches[1]) > 1e-9 * pitches[0]:
        raise InputError(f"{mesh.label}: {_unequal_pitches(one, two)}")
    if one.sign + two.sign < 0:
        raise InputError(f"{mesh.label}: both gears are internal; only one may be")
    bases = abs(one.base_radius + two.base_radius)
    if mesh.operating_pressure_angle_deg is not None:
        angle = math.radians(mesh.operating_pressure_angle_deg)
        return Spacing(one, two, bases / math.cos(angle))
    if mesh.center_distance_mm is None:
        distance = bases / math.cos(_angle_without_backlash(mesh, one, two))
        shifts = one.thickness.profile_shift + two.thickness.profile_shift
        inference = (
            f"{mesh.label}: center_distance_mm = {distance / MM:.7g} by default, at "
            f"which teeth of full thickness have no backlash; sum of profile shifts "
            f"{shifts:.6g}"
        )
        return Spacing(one, two, distance, inference)
    if not mesh.center_distance_mm * MM > bases:
        stated = f"center_distance_mm = {shown(mesh.center_distance_mm)}"
        bound = Bound("must be above", bases / MM, f"the {base_radii(one, two)}")
        key = Key("mesh", mesh.label, ("center_distance_mm",))
        raise Refusal(key, f"{mesh.label}: {stated}", bound, "mm")
    return Spacing(one, two, mesh.center_distance_mm * MM)


def _angle_without_backlash(mesh: MeshEntry, one: Blank, two: Blank) -> float:
    """Operating pressure angle [rad] at which teeth that are not thinned just fit."""
    shifts = one.thickness.profile_shift + two.thickness.profile_shift
    teeth = one.sign * one.teeth + two.sign * two.teeth
    alpha = one.pressure_angle
    value = involute(alpha) + 2.0 * math.tan(alpha) * shifts / teeth
    if value <= 0.0:
        raise InputError(
            f"{mesh.label}: center_distance_mm is missing; the sum of profile shifts "
            f"{shown(shifts)} fits none"
        )
    return inverse_involute(value)


def base_radii(one: Blank, two: Blank) -> str:
    """What bounds the centre distance from below, in words."""
    is_internal = one.sign * two.sign < 0
    return f"{'difference' if is_internal else 'sum'} of base radii"


def _unequal_pitches(one: Blank, two: Blank) -> str:
    """The keys by which the base pitches of two gears differ."""
    keys = [
        f"{key} = {shown(getattr(one.entry, key))} and {shown(getattr(two.entry, key))}"
        for key in ("module_mm", "pressure_angle_deg")
        if getattr(one.entry, key) != getattr(two.entry, key)
    ]
    pitches = (f"{blank.base_pitch / MM:.9g} mm" for blank in (one, two))
    return f"{', '.join(keys)}; base pitches {' and '.join(pitches)} must be equal"


def find_tips(document: Document, spacings: Sequence[Spacing]) -> list[Tip]:
    """Tips as given, else from the first contact ratio that needs them, else default.

    Of a mesh's gears, those still without a tip get the same addendum.
    """
    blanks = {entry.name: blank_of(entry) for entry in document.gear}
    tips = {name: tip for name, blank in blanks.items() if (tip := blank.given_tip)}
    for mesh, place in zip(document.mesh, spacings, strict=True):
        if mesh.contact_ratio is None:
            continue
        free = [name for name in (mesh.driver, mesh.driven) if name not in tips]
        if free:
            addendum = _equal_addendum(mesh, place, tips)
            origin = f"contact_ratio = {shown(mesh.contact_ratio)} of {mesh.label}"
            stated_tips = dict(tips)
            for name in free:
                tips[name] = _tip_of_contact_ratio(
                    mesh, place, stated_tips, blanks[name], addendum, origin
                )
        _require_contact_ratio(mesh, place, tips)
    for mesh, place in zip(document.mesh, spacings, strict=True):
        _require_shortening(mesh, place, tips)
    for name, blank in blanks.items():
        if name not in tips and not blank.entry.internal:
            tips[name] = _default_tip(blank, document, spacings)
    for name, blank in blanks.items():
        if name not in tips:
            tips[name] = _ring_tip(blank, document, spacings, tips)
    return [tips[name] for name in document.gear_names]


def _require_shortening(mesh: MeshEntry, place: Spacing, tips: dict[str, Tip]) -> None:
    """Refuse a shortening of tips that changes nothing; tips : that are given."""
    if not mesh.tip_shortening:
        return
    reason = ""
    if place.is_internal:
        reason = "is that of external gears"
    elif {mesh.driver, mesh.driven} <= tips.keys():
        reason = "changes nothing, as both tips are given"
    if reason:
        raise InputError(f"{mesh.label}: tip_shortening = true; {reason}")


def _default_tip(blank: Blank, document: Document, spacings: Sequence[Spacing]) -> Tip:
    """Default tip of an external gear, shortened where a mesh says so."""
    name, shortened, possible = blank.entry.name, 0.0, 0.0
    for mesh, place in zip(document.mesh, spacings, strict=True):
        if name in (mesh.driver, mesh.driven) and not place.is_internal:
            possible = max(possible, place.shortening)
            if mesh.tip_shortening:
                shortened = max(shortened, place.shortening)
    tip = blank.default_tip(shortened)
    if possible < MIN_SHORTENING:
        return tip
    change = f"shortened by {shortened / MM:.4g} mm"
    if not shortened:
        change = f"not shortened; tip_shortening = true takes {possible / MM:.4g} mm"
    stated = f"tip_radius_mm = {tip.radius / MM:.7g} by default"
    return replace(tip, inference=f'gear "{name}": {stated}, {change}')


def _ring_tip(
    ring: Blank, document: Document, spacings: Sequence[Spacing], tips: dict[str, Tip]
) -> Tip:
    """Default tip of an internal gear, which reaches no fillet of a mate.

    Nor does it go below the flank of its cutter.
    """
    default = ring.default_tip()
    rolls = [ring.cutter.line_of_action if ring.cutter else 0.0]
    by_cutter = rolls[0]
    for mesh, place in zip(document.mesh, spacings, strict=True):
        names = mesh.driver, mesh.driven
        if ring.entry.name not in names:
            continue
        mate, name = (
            (place.two, mesh.driven)
            if names[0] == ring.entry.name
            else (place.one, mesh.driver)
        )
        if name in tips:
            lowest = mate.cut(tips[name]).form_roll_length
            rolls.append(lowest - place.line_of_action)
    least = math.hypot(ring.base_radius, max(rolls))
    if least <= -default.radius:
        return default
    origin = f"tip_radius_mm = {shown(least / MM)} by default"
    tip = ring.tip_of_radius(-least * (1.0 + FORM_MARGIN), origin)
    why = "the flank that its cutter cuts ends there"
    if max(rolls) > by_cutter:
        why = "further in it would reach a fillet of its mate"
    inference = (
        f'gear "{ring.entry.name}": tip_diameter_mm = {-2.0 * tip.radius / MM:.7g} '
        f"instead of {-2.0 * default.radius / MM:.7g}; {why}"
    )
    return replace(tip, inference=inference)


def _tip_of_contact_ratio(
    mesh: MeshEntry,
    place: Spacing,
    tips: dict[str, Tip],
    blank: Blank,
    addendum: float,
    origin: str,
) -> Tip:
    """The tip of a gear that has none; tips : that are given."""

    def of_radius(radius: float) -> float:
        return _contact_ratio_of_addendum(
            mesh, place, tips, blank.sign * radius - blank.reference_radius
        )

    key = Key("mesh", mesh.label, ("contact_ratio",))
    return Tip(blank.reference_radius + addendum, origin, key, of_radius, unit="")


def _contact_ratio_of_addendum(
    mesh: MeshEntry, place: Spacing, tips: dict[str, Tip], addendum: float
) -> float:
    """Contact ratio with an addendum [m] of the gears without a tip."""
    one, two = (
        tips[name].radius if name in tips else blank.reference_radius + addendum
        for name, blank in ((mesh.driver, place.one), (mesh.driven, place.two))
    )
    return place.contact_ratio(one, two)


def _equal_addendum(mesh: MeshEntry, place: Spacing, tips: dict[str, Tip]) -> float:
    """Addendum [m] of the gears without a tip that gives the contact ratio."""
    wanted = require_present(mesh.contact_ratio, f"{mesh.label}: contact_ratio")
    sides = (mesh.driver, place.one), (mesh.driven, place.two)
    free = [blank for name, blank in sides if name not in tips]

    def ratio(addendum: float) -> float:
        return _contact_ratio_of_addendum(mesh, place, tips, addendum)

    # the teeth of an internal gear reach to its base circle at most
    to_base = [blank.base_radius - blank.reference_radius for blank in free]
    inward = [way for blank, way in zip(free, to_base, strict=True) if blank.sign < 0]
    lowest = min((way for way in to_base if way < 0.0), default=0.0)
    highest = min([HIGHEST_ADDENDUM * place.one.module, *inward])
    least, most = ratio(lowest), ratio(highest)
    if not least < wanted < most:
        reason = f"which addenda up to {HIGHEST_ADDENDUM:g} modules give"
        bound = Bound("must be below", most, reason)
        if not least < wanted:
            bound = Bound("must be above", max(0.0, least), reason)
        key = Key("mesh", mesh.label, ("contact_ratio",))
        stated = f"{mesh.label}: contact_ratio = {shown(wanted)}"
        raise Refusal(key, stated, bound)
    return bisected(lambda addendum: ratio(addendum) < wanted, lowest, highest)


def _require_contact_ratio(
    mesh: MeshEntry, place: Spacing, tips: dict[str, Tip]
) -> None:
    one, two = tips[mesh.driver], tips[mesh.driven]
    ratio = place.contact_ratio(one.radius, two.radius)
    wanted = require_present(mesh.contact_ratio, f"{mesh.label}: contact_ratio")
    if not abs(ratio - wanted) <= CONTACT_RATIO_TOLERANCE:
        raise InputError(
            f"{mesh.label}: contact_ratio = {shown(wanted)}; the tips are "
            f"fixed by {one.origin} and {two.origin}, which give {ratio:.6g}, "
            f"it may differ by {CONTACT_RATIO_TOLERANCE:g}"
        )
