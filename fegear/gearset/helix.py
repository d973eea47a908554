"""Hands of the helices of a gear set's gears."""

from __future__ import annotations

import math

from fegear.files.errors import InputError
from fegear.gearset.model import Gear
from fegear.gearset.problems import shown
from fegear.gearset.schema import Document, GearEntry, Hand
from meshes import SpurGear

SIGNS: dict[Hand, int] = {"right": 1, "left": -1}  # double helical gears have both
NAMES: dict[int, Hand] = {sign: hand for hand, sign in SIGNS.items()}


def hands(document: Document) -> list[int]:
    """1 for each gear with a right-handed helix, -1 for a left-handed one.

    Of a double helical gear that of the near half.

    Gears in mesh have opposite hands, an internal gear that of its mates. Where none is
    given, that of the first gear that is linked by meshes is right.

    Raises InputError where helices of two gears in mesh do not fit.
    """
    gears = {gear.name: gear for gear in document.gear}
    signs = {
        name: SIGNS[gear.hand]
        for name, gear in gears.items()
        if gear.hand and gear.hand in SIGNS
    }
    for name in gears:
        if name not in signs and not _linked(document, name) & signs.keys():
            signs[name] = 1
        _follow(document, signs)
    for mesh in document.mesh:
        one, two = gears.get(mesh.driver), gears.get(mesh.driven)
        if one is None or two is None:
            continue  # refused with the names
        if one.helix_angle_deg != two.helix_angle_deg:
            raise InputError(
                f"{mesh.label}: helix_angle_deg = {shown(two.helix_angle_deg)} of gear "
                f'"{two.name}"; must be {shown(one.helix_angle_deg)}, that of its mate '
                f'"{one.name}"'
            )
        if (one.hand == "double") != (two.hand == "double"):
            single = two if one.hand == "double" else one
            raise InputError(
                f'{mesh.label}: hand = "double" and gap_mm are needed of gear '
                f'"{single.name}" too, its mate is double helical'
            )
        fitting = signs[one.name] * hand_ratio(one, two)
        if one.helix_angle_deg and signs[two.name] != fitting:
            raise InputError(
                f'{mesh.label}: hand = "{NAMES[-fitting]}" of gear "{two.name}"; must '
                f'be "{NAMES[fitting]}", as its mate "{one.name}" is '
                f"{NAMES[signs[one.name]]}-handed"
                f"{' and one of them internal' if one.internal or two.internal else ''}"
            )
    return [signs[name] for name in gears]


def hand_ratio(one: GearEntry, two: GearEntry) -> int:
    """-1 where gears in mesh have opposite hands, 1 where one is internal."""
    return 1 if one.internal or two.internal else -1


def hand(teeth: SpurGear) -> Hand | None:
    """Hand of a helix, None of spur teeth."""
    return NAMES[int(math.copysign(1.0, teeth.twist))] if teeth.twist else None


def hand_of_gear(gear: Gear) -> Hand | None:
    """Hand of a gear, which may have halves of both."""
    return "double" if gear.groove else hand(gear.geometry)


def hand_inferences(document: Document) -> list[str]:
    """A sentence for each helical gear whose hand is not given."""
    return [
        f'gear "{gear.name}": hand = "{NAMES[sign]}", '
        f"{_hand_origin(document, gear.name)}"
        for gear, sign in zip(document.gear, hands(document), strict=True)
        if gear.helix_angle_deg and gear.hand is None
    ]


def _hand_origin(document: Document, name: str) -> str:
    """Rule by which a gear has its hand."""
    linked = _linked(document, name)
    gears = [gear for gear in document.gear if gear.name in linked]
    if not any(gear.hand for gear in gears) and gears[0].name == name:
        return "that of the first gear where no hand is given"
    mates = {
        mesh.driven if name == mesh.driver else mesh.driver
        for mesh in document.mesh
        if name in (mesh.driver, mesh.driven)
    }
    named = [f'"{gear.name}"' for gear in gears if gear.name in mates]
    noun = "mate" if len(named) == 1 else "mates"
    near = [gear for gear in gears if gear.name in mates or gear.name == name]
    relation = "as fits" if any(gear.internal for gear in near) else "opposite to"
    return f"{relation} that of its {noun} {', '.join(named)}"


def _linked(document: Document, name: str) -> set[str]:
    """Gears that a gear is linked to by meshes, itself included."""
    linked, waiting = set[str](), [name]
    while waiting:
        gear = waiting.pop()
        if gear in linked:
            continue
        linked.add(gear)
        for mesh in document.mesh:
            if gear in (mesh.driver, mesh.driven):
                waiting += [mesh.driver, mesh.driven]
    return linked


def _follow(document: Document, signs: dict[str, int]) -> None:
    """Give gears the hand that fits that of a mate whose hand is known."""
    gears = {gear.name: gear for gear in document.gear}
    for _ in document.gear:
        for mesh in document.mesh:
            pair = mesh.driver, mesh.driven
            for one, two in (pair, pair[::-1]):
                if one in signs and two not in signs and {one, two} <= gears.keys():
                    signs[two] = signs[one] * hand_ratio(gears[one], gears[two])
