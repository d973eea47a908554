"""Gears at their centre distance, and tips that give a contact ratio."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from fegear.files.errors import InputError
from fegear.gearset.agreement import has_equal_base_helices, has_equal_pitches
from fegear.gearset.problems import shown
from fegear.gearset.rack_keys import RESTATED_RTOL
from fegear.gearset.refusals import Key, Refusal
from fegear.gearset.schema import Document, GearEntry, MeshEntry
from fegear.gearset.teeth import Blank, Tip, blank_of
from lumped.common.checks import require_present
from lumped.common.units import MM
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
        base_radii = self.one.base_radius + self.two.base_radius
        length = math.sqrt(self.center_distance**2 - base_radii**2)
        return -length if self.is_internal else length

    @property
    def shortening(self) -> float:
        """Difference of the sum of profile shifts and the distance of the reference
        circles [m]. Tips that are shortened by it keep their clearance (DIN 3960)."""
        one, two = self.one, self.two
        shifts = _shift_sum(one, two)
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
    if not has_equal_pitches(one, two):
        raise InputError(f"{mesh.label}: {_unequal_pitches_text(one, two)}")
    if not has_equal_base_helices(one, two):
        raise InputError(f"{mesh.label}: {_unequal_helices_text(one, two)}")
    if one.sign + two.sign < 0:
        raise InputError(f"{mesh.label}: both gears are internal; only one may be")
    base_radius_bound = abs(one.base_radius + two.base_radius)
    if mesh.operating_pressure_angle_deg is not None:
        angle = math.radians(mesh.operating_pressure_angle_deg)
        return Spacing(one, two, base_radius_bound / math.cos(angle))
    if mesh.center_distance_mm is None:
        distance = base_radius_bound / math.cos(
            _pressure_angle_without_backlash(mesh, one, two)
        )
        inference = (
            f"{mesh.label}: center_distance_mm = {distance / MM:.7g} by default, at "
            f"which teeth of full thickness have no backlash; sum of profile shifts "
            f"{_shift_sum(one, two) / one.helix_cosine:.6g}"
        )
        return Spacing(one, two, distance, inference)
    if not mesh.center_distance_mm * MM > base_radius_bound:
        stated_distance = f"center_distance_mm = {shown(mesh.center_distance_mm)}"
        bound = Bound(
            "must be above", base_radius_bound / MM, f"the {base_radii_text(one, two)}"
        )
        key = Key("mesh", mesh.label, ("center_distance_mm",))
        raise Refusal(key, f"{mesh.label}: {stated_distance}", bound, "mm")
    return Spacing(one, two, mesh.center_distance_mm * MM)


def _pressure_angle_without_backlash(mesh: MeshEntry, one: Blank, two: Blank) -> float:
    """Operating pressure angle [rad] at which teeth that are not thinned just fit."""
    shifts = _shift_sum(one, two)
    teeth = one.sign * one.teeth + two.sign * two.teeth
    alpha = one.pressure_angle
    operating_involute = involute(alpha) + 2.0 * math.tan(alpha) * shifts / teeth
    if operating_involute <= 0.0:
        raise InputError(
            f"{mesh.label}: center_distance_mm is missing; the sum of profile shifts "
            f"{shown(shifts / one.helix_cosine)} fits none"
        )
    return inverse_involute(operating_involute)


def _shift_sum(one: Blank, two: Blank) -> float:
    """Sum of profile shifts in modules of the section across the axis."""
    return one.thickness.profile_shift + two.thickness.profile_shift


def base_radii_text(one: Blank, two: Blank) -> str:
    """What bounds the centre distance from below, in words."""
    is_internal = one.sign * two.sign < 0
    return f"{'difference' if is_internal else 'sum'} of base radii"


def _unequal_pitches_text(one: Blank, two: Blank) -> str:
    """The keys by which the base pitches of two gears differ."""
    pitches = (f"{blank.base_pitch / MM:.9g} mm" for blank in (one, two))
    keys = _unequal_keys_text(one, two)
    return f"{keys}; base pitches {' and '.join(pitches)} must be equal"


def _unequal_helices_text(one: Blank, two: Blank) -> str:
    """The keys by which the helix angles on the base cylinders differ."""
    angles = (
        f"{math.degrees(abs(blank.base_helix_angle)):.9g}" for blank in (one, two)
    )
    keys = _unequal_keys_text(one, two)
    return f"{keys}; base helix angles {' and '.join(angles)} deg must be equal"


def _unequal_keys_text(one: Blank, two: Blank) -> str:
    gears = one.entry, two.entry
    pairs = (
        (gears[0].module_key, gears[1].module_key),
        (gears[0].pressure_angle_key, gears[1].pressure_angle_key),
    )
    return ", ".join(filter(None, (_unequal_key_text(*gears, *keys) for keys in pairs)))


def _unequal_key_text(
    one: GearEntry, two: GearEntry, key_of_one: str, key_of_two: str
) -> str:
    """Values of both gears with the keys that state them, empty if they are equal."""
    value, other = one.rack_value(key_of_one), two.rack_value(key_of_two)
    if math.isclose(one.rack_value(key_of_two), other, rel_tol=RESTATED_RTOL):
        return ""
    named_other = "" if key_of_two == key_of_one else f"{key_of_two} = "
    return f"{key_of_one} = {shown(value)} and {named_other}{shown(other)}"


def find_tips(document: Document, spacings: Sequence[Spacing]) -> list[Tip]:
    """Tips as given, else from the first contact ratio that needs them, else default.

    Of a mesh's gears, those still without a tip get the same addendum.
    """
    blanks = {entry.name: blank_of(entry) for entry in document.gear}
    tips = {name: tip for name, blank in blanks.items() if (tip := blank.given_tip)}
    for mesh, mesh_spacing in zip(document.mesh, spacings, strict=True):
        if mesh.contact_ratio is None:
            continue
        gears_without_tip = [
            name for name in (mesh.driver, mesh.driven) if name not in tips
        ]
        if gears_without_tip:
            addendum = _equal_addendum(mesh, mesh_spacing, tips)
            origin = f"contact_ratio = {shown(mesh.contact_ratio)} of {mesh.label}"
            stated_tips = dict(tips)
            for name in gears_without_tip:
                tips[name] = _tip_of_contact_ratio(
                    mesh, mesh_spacing, stated_tips, blanks[name], addendum, origin
                )
        _require_contact_ratio(mesh, mesh_spacing, tips)
    for mesh, mesh_spacing in zip(document.mesh, spacings, strict=True):
        _require_shortening(mesh, mesh_spacing, tips)
    for name, blank in blanks.items():
        if name not in tips and not blank.entry.internal:
            tips[name] = _default_tip(blank, document, spacings)
    for name, blank in blanks.items():
        if name not in tips:
            tips[name] = _ring_tip(blank, document, spacings, tips)
    return [tips[name] for name in document.gear_names]


def _require_shortening(
    mesh: MeshEntry, mesh_spacing: Spacing, tips: dict[str, Tip]
) -> None:
    """Refuse a shortening of tips that changes nothing; tips : that are given."""
    if not mesh.tip_shortening:
        return
    reason = ""
    if mesh_spacing.is_internal:
        reason = "is that of external gears"
    elif {mesh.driver, mesh.driven} <= tips.keys():
        reason = "changes nothing, as both tips are given"
    if reason:
        raise InputError(f"{mesh.label}: tip_shortening = true; {reason}")


def _default_tip(blank: Blank, document: Document, spacings: Sequence[Spacing]) -> Tip:
    """Default tip of an external gear, shortened where a mesh says so."""
    name, shortening, largest_shortening = blank.entry.name, 0.0, 0.0
    for mesh, mesh_spacing in zip(document.mesh, spacings, strict=True):
        if name in (mesh.driver, mesh.driven) and not mesh_spacing.is_internal:
            largest_shortening = max(largest_shortening, mesh_spacing.shortening)
            if mesh.tip_shortening:
                shortening = max(shortening, mesh_spacing.shortening)
    tip = blank.default_tip(shortening)
    if largest_shortening < MIN_SHORTENING:
        return tip
    shortening_text = f"shortened by {shortening / MM:.4g} mm"
    if not shortening:
        shortening_text = (
            "not shortened; tip_shortening = true takes "
            f"{largest_shortening / MM:.4g} mm"
        )
    radius_text = f"tip_radius_mm = {tip.radius / MM:.7g} by default"
    return replace(tip, inference=f'gear "{name}": {radius_text}, {shortening_text}')


def _ring_tip(
    ring: Blank, document: Document, spacings: Sequence[Spacing], tips: dict[str, Tip]
) -> Tip:
    """Default tip of an internal gear, which reaches no fillet of a mate.

    Nor does it go below the flank of its cutter.
    """
    default_tip = ring.default_tip()
    form_roll_lengths = [ring.cutter.line_of_action if ring.cutter else 0.0]
    cutter_roll_length = form_roll_lengths[0]
    for mesh, mesh_spacing in zip(document.mesh, spacings, strict=True):
        names = mesh.driver, mesh.driven
        if ring.entry.name not in names:
            continue
        mate, name = (
            (mesh_spacing.two, mesh.driven)
            if names[0] == ring.entry.name
            else (mesh_spacing.one, mesh.driver)
        )
        if name in tips:
            form_roll_length = mate.cut(tips[name]).form_roll_length
            form_roll_lengths.append(form_roll_length - mesh_spacing.line_of_action)
    least_radius = math.hypot(ring.base_radius, max(form_roll_lengths))
    if least_radius <= -default_tip.radius:
        return default_tip
    origin = f"tip_radius_mm = {shown(least_radius / MM)} by default"
    tip = ring.tip_of_radius(-least_radius * (1.0 + FORM_MARGIN), origin)
    reason = "the flank that its cutter cuts ends there"
    if max(form_roll_lengths) > cutter_roll_length:
        reason = "further in it would reach a fillet of its mate"
    inference = (
        f'gear "{ring.entry.name}": tip_diameter_mm = {-2.0 * tip.radius / MM:.7g} '
        f"instead of {-2.0 * default_tip.radius / MM:.7g}; {reason}"
    )
    return replace(tip, inference=inference)


def _tip_of_contact_ratio(
    mesh: MeshEntry,
    mesh_spacing: Spacing,
    tips: dict[str, Tip],
    blank: Blank,
    addendum: float,
    origin: str,
) -> Tip:
    """The tip of a gear that has none; tips : that are given."""

    def contact_ratio_of_radius(radius: float) -> float:
        return _contact_ratio_of_addendum(
            mesh, mesh_spacing, tips, blank.sign * radius - blank.reference_radius
        )

    key = Key("mesh", mesh.label, ("contact_ratio",))
    return Tip(
        blank.reference_radius + addendum, origin, key, contact_ratio_of_radius, unit=""
    )


def _contact_ratio_of_addendum(
    mesh: MeshEntry, mesh_spacing: Spacing, tips: dict[str, Tip], addendum: float
) -> float:
    """Contact ratio with an addendum [m] of the gears without a tip."""
    driver_radius, driven_radius = (
        tips[name].radius if name in tips else blank.reference_radius + addendum
        for name, blank in (
            (mesh.driver, mesh_spacing.one),
            (mesh.driven, mesh_spacing.two),
        )
    )
    return mesh_spacing.contact_ratio(driver_radius, driven_radius)


def _equal_addendum(
    mesh: MeshEntry, mesh_spacing: Spacing, tips: dict[str, Tip]
) -> float:
    """Addendum [m] of the gears without a tip that gives the contact ratio."""
    contact_ratio = require_present(mesh.contact_ratio, f"{mesh.label}: contact_ratio")
    gears_by_name = (mesh.driver, mesh_spacing.one), (mesh.driven, mesh_spacing.two)
    gears_without_tip = [blank for name, blank in gears_by_name if name not in tips]

    def ratio(addendum: float) -> float:
        return _contact_ratio_of_addendum(mesh, mesh_spacing, tips, addendum)

    # the teeth of an internal gear reach to its base circle at most
    base_addenda = [
        blank.base_radius - blank.reference_radius for blank in gears_without_tip
    ]
    internal_addenda = [
        base_addendum
        for blank, base_addendum in zip(gears_without_tip, base_addenda, strict=True)
        if blank.sign < 0
    ]
    lowest_addendum = min(
        (base_addendum for base_addendum in base_addenda if base_addendum < 0.0),
        default=0.0,
    )
    highest_addendum = min(
        [HIGHEST_ADDENDUM * mesh_spacing.one.module, *internal_addenda]
    )
    least_ratio, most_ratio = ratio(lowest_addendum), ratio(highest_addendum)
    if not least_ratio < contact_ratio < most_ratio:
        reason = f"which addenda up to {HIGHEST_ADDENDUM:g} modules give"
        bound = Bound("must be below", most_ratio, reason)
        if not least_ratio < contact_ratio:
            bound = Bound("must be above", max(0.0, least_ratio), reason)
        key = Key("mesh", mesh.label, ("contact_ratio",))
        stated_ratio = f"{mesh.label}: contact_ratio = {shown(contact_ratio)}"
        if most_ratio <= 0.0:
            distance = f"{mesh_spacing.center_distance / MM:.6g} mm"
            raise InputError(
                f"{stated_ratio}; no teeth touch at a distance of {distance}"
            )
        raise Refusal(key, stated_ratio, bound)
    return bisected(
        lambda addendum: ratio(addendum) < contact_ratio,
        lowest_addendum,
        highest_addendum,
    )


def _require_contact_ratio(
    mesh: MeshEntry, mesh_spacing: Spacing, tips: dict[str, Tip]
) -> None:
    driver_tip, driven_tip = tips[mesh.driver], tips[mesh.driven]
    ratio = mesh_spacing.contact_ratio(driver_tip.radius, driven_tip.radius)
    stated_ratio = require_present(mesh.contact_ratio, f"{mesh.label}: contact_ratio")
    if not abs(ratio - stated_ratio) <= CONTACT_RATIO_TOLERANCE:
        raise InputError(
            f"{mesh.label}: contact_ratio = {shown(stated_ratio)}; the tips are "
            f"fixed by {driver_tip.origin} and {driven_tip.origin}, which give "
            f"{ratio:.6g}, it may differ by {CONTACT_RATIO_TOLERANCE:g}"
        )
