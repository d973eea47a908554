"""Tables of the page on cracked teeth, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache

import numpy as np

from fegear.gearset.read import load_gear_set
from validation.cracked_tooth.drops import (
    CRACK_ANGLE,
    DropCurves,
    compare_drops,
    root_thickness,
)
from validation.cracked_tooth.elements import ElementDrop
from validation.cracked_tooth.healthy import HealthyPair, stiffness_factors
from validation.cracked_tooth.shallow import mouth_stress
from validation.published.cases import pair_of

DEPTHS = 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5  # over the root thickness
TORQUE = 100.0  # N m
NAMES = {
    "parallel": "parallel line",
    "parabola": "parabola",
    "hinge": "hinge",
    "finite elements": "finite elements",
}


@cache
def pairs() -> tuple[HealthyPair, ...]:
    """The three pairs of the page."""
    return (
        HealthyPair("liu-pair", load_gear_set("liu-pair"), TORQUE),
        HealthyPair("small hubs", load_gear_set("liu-idler-small-hubs"), TORQUE),
        HealthyPair("ROSS 62/62", pair_of("ross_pair").gear_set, TORQUE),
    )


@cache
def drop_curves(pair: HealthyPair, angle: float) -> DropCurves:
    """Drops by all methods at `DEPTHS`; angle : of the crack, as `CRACK_ANGLE`."""
    elements = ElementDrop(pair, crack_angle=angle)
    return compare_drops(pair, DEPTHS, elements, angle)


def factor_table() -> str:
    """Ratio of mean stiffnesses of the three pairs, and its factors."""
    rows = []
    for pair in pairs():
        f = stiffness_factors(pair)
        factors = f.contact, f.tooth_and_body, f.other_pairs, f.twist, f.corners
        means = (f"{1e-8 * value:.3f}" for value in (f.energy, f.elements))
        rows.append(
            (pair.name, *means, f"{f.ratio:.3f}", *(f"{x:.3f}" for x in factors))
        )
    head = (
        *("pair", "potential energy [1e8 N/m]", "finite elements [1e8 N/m]", "ratio"),
        *("contact", "tooth and body", "other pairs", "of this, twist", "corners"),
    )
    return table(head, rows)


def parts_table() -> str:
    """Compliances of one pair at the pitch point by potential energy [nm/kN]."""
    rows = []
    for pair in pairs():
        rolls = pair.pair.pitch_point, pair.pair.line_of_action - pair.pair.pitch_point
        parts = np.zeros(5)
        for tooth, roll in zip(pair.teeth, rolls, strict=True):
            beam, body = tooth.beam(roll, pair.width), tooth.body(roll, pair.width)
            parts[:4] += *(float(part) for part in beam), body
        parts[4] = pair.contact_compliance
        rows.append((pair.name, *(f"{1e12 * part:.0f}" for part in parts)))
    return table(("pair", "bending", "shear", "thrust", "bodies", "contact"), rows)


def drop_table(number: int) -> str:
    """Drop of mesh stiffness of a pair [%]: at the pitch point, and over the path."""
    curves = drop_curves(pairs()[number], CRACK_ANGLE)
    head = "crack over root thickness", *(NAMES[name] for name in curves.drops)
    rows = [
        (
            f"{100 * depth:.0f} %",
            *(
                f"{100 * drops[i].at_pitch_point:.2f}, {100 * drops[i].over_path:.2f}"
                for drops in curves.drops.values()
            ),
        )
        for i, depth in enumerate(curves.depths)
    ]
    return table(head, rows)


def compliance_table(number: int, angle: float = CRACK_ANGLE) -> str:
    """What the crack adds to the compliance at the pitch point [nm/kN].

    angle : between the crack and the centre line [rad]
    """
    curves = drop_curves(pairs()[number], angle)
    head = "crack over root thickness", *(NAMES[name] for name in curves.drops)
    rows = [
        (
            f"{100 * depth:.0f} %",
            *(f"{1e12 * d[i].added_compliance:.1f}" for d in curves.drops.values()),
        )
        for i, depth in enumerate(curves.depths)
    ]
    return table(head, rows)


def corner_table() -> str:
    """Drop at the pitch point with and without contact of tip corners [%]."""
    rows = []
    for pair in pairs():
        depth = 0.5 * root_thickness(pair)
        drops = (ElementDrop(pair, corner_contact=on)(depth) for on in (True, False))
        values = (f"{100 * drop.at_pitch_point:.1f}" for drop in drops)
        rows.append((pair.name, *values))
    return table(("pair", "tip corners touch", "nominal path alone"), rows)


def stress_table() -> str:
    """Stress where the crack begins, by finite elements and as a beam."""
    rows = []
    for pair in pairs():
        stress = mouth_stress(pair)
        values = f"{1e-6 * stress.elements:.1f}", f"{1e-6 * stress.beam:.1f}"
        rows.append((pair.name, *values, f"{stress.concentration:.2f}"))
    return table(("pair", "finite elements [MPa]", "beam [MPa]", "ratio"), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Rows as a table in Markdown, numbers to the right."""
    lines = [head, ("---", *("---:" for _ in head[1:])), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
