"""Words in pictures of the contact: loads, names, colour bar and title."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import wrap
from typing import Any

import numpy as np

from fegear.rendering.fields import ContactField
from fegear.rendering.gear_fields import GearField, PairField
from fegear.rendering.look import (
    ARROW,
    COLOURS,
    CUT,
    HEADER,
    INK,
    RenderStyle,
    mesh_forces,
    ribbon_base,
)
from fegear.rendering.recorded import Instant
from lumped.common.array_types import Array

SAME_AXIS = 1e-6  # m, between centres of gears on a shaft
EQUAL_GAPS = 1e-3  # rad
BAR_LETTERS = 18  # of a line next to the picture
LABEL_GAP = 0.005  # of the view's half height between a picture and its labels


def details(field: ContactField, look: RenderStyle) -> str:
    """Position, load and scale of a picture in one line."""
    parts = state_words(field)
    scale = look.motion_scale
    parts.append("true to scale" if scale == 1.0 else f"deformation scale {scale:g}")
    if look.force is not None:
        parts.append("arrows: mesh forces on driven gears")
    elif look.shown != "pressure":
        parts.append("ribbon: contact pressure")
    return ", ".join(parts)


def state_words(field: ContactField) -> list[str]:
    """Position, load and transmission error, or those of an instant of a motion."""
    return _at_rest(field) if field.instant is None else _in_motion(field.instant)


def _at_rest(field: ContactField) -> list[str]:
    if field.ste is None:
        return [
            f"position {field.position:.3f} base pitches of mesh 1",
            f"torque {field.torque:g} N m on the input",
        ]
    return [
        f"position {field.position:.3f} base pitches",
        f"torque {field.torque:g} N m",
        f"transmission error {1e6 * field.ste:.2f} um",
    ]


def _in_motion(instant: Instant) -> list[str]:
    speed = f"{instant.frequency:g} Hz {instant.direction}".strip()
    force = f"mesh force {instant.force:.0f} N"
    if not instant.loads:
        force += ", contact lost"
    elif instant.back:
        force += ", contact of the back flanks"
    return [
        f"{speed}, {1e3 * instant.time:.4f} ms",
        f"position {instant.position:.3f}",
        force,
        f"transmission error {1e6 * instant.ste:.2f} um",
    ]


def pair_text(pair: PairField) -> str:
    if pair.has_edge:
        return f"{pair.load:.0f} N, edge"
    return f"{pair.load:.0f} N, {1e-6 * pair.pressure.max():.0f} MPa"


def legend(look: RenderStyle) -> tuple[str, list[str]]:
    """Title of the colour bar with its unit, and what the bar does not show."""
    colours = COLOURS[look.shown]
    higher = f"up to {look.largest:.0f}" if look.exact else "higher"
    note = ""
    if look.largest > 1.001 * look.limits[1]:
        note = f"corners {higher}"
        if colours.clipped:
            note = f"colours up to the fillets, contact {higher}"
    return f"{colours.title}\n[{colours.unit}]", wrap(note, BAR_LETTERS)


def draw_loads(
    plotter: Any, pairs: Sequence[PairField], look: RenderStyle, size: tuple[int, int]
) -> None:
    """Load and largest pressure of every pair beyond the end of its ribbon."""
    font = scaled(22, size)
    lowest = -np.inf
    for pair in sorted(pairs, key=lambda pair: float(pair.center[1])):
        middle = int(pair.pressure.argmax())
        height = look.ribbon * min(float(pair.pressure[middle]) / look.pressure, CUT)
        away = (height + 0.03) * pair.normals[middle]
        at = ribbon_base(pair, look)[middle] + look.view.half_height * away
        row = 2.0 * font * _pixel(look, size)
        at[1] = min(at[1], look.view.y + look.view.half_height - row)
        at[1] = max(at[1], lowest)  # labels may not cover each other
        lowest = at[1] + row
        _draw_label(plotter, pair_text(pair), at, look, font)


def draw_names(
    plotter: Any, gears: Sequence[GearField], look: RenderStyle, size: tuple[int, int]
) -> None:
    """Each gear's name toward its body's middle, as far as the view goes.

    That of an internal gear is on the other side of the contact than its centre.
    """
    view, font = look.view, scaled(26, size)
    for gear in gears:
        away = gear.center - view.middle
        away = -away if gear.is_internal else away
        reach = 0.9 / max(0.9, float(np.max(np.abs(away) / view.half)))
        at = view.middle + reach * away
        at[0] -= 0.25 * font * len(gear.name) * _pixel(look, size)
        _draw_label(plotter, gear.name, at, look, font)


def draw_mesh_forces(
    plotter: Any, pairs: Sequence[PairField], look: RenderStyle, size: tuple[int, int]
) -> None:
    """Load of every mesh beside its contact, and its largest pressure where shown."""
    font = scaled(20, size)
    reach = ARROW if look.force else look.ribbon
    for force in mesh_forces(pairs):
        text = f"{force.load:.0f} N"
        if look.shown == "pressure":
            text += f", {1e-6 * force.pressure:.0f} MPa"
        half = np.array([0.28 * len(text), 0.8]) * font * _pixel(look, size)
        # so far that the label's edge touches the arrow's tip
        to_edge = (half / np.maximum(np.abs(force.direction), 1e-9)).min()
        away = (reach + 0.01) * look.view.half_height + to_edge
        at = force.base(look) + away * force.direction
        _draw_centred(plotter, text, at, look, size, font)


def draw_names_of_set(
    plotter: Any, field: ContactField, look: RenderStyle, size: tuple[int, int]
) -> None:
    """Names in the middle of gears; of internal gears and of those behind others on a
    shaft they are on their bodies, away from contacts.
    """
    for gear in field.gears:
        distant = [g for g in field.gears if not _on_one_axis(g, gear)]
        is_behind = any(
            other.layer < gear.layer for other in field.gears if other not in distant
        )
        at = gear.center
        if gear.is_internal or is_behind:
            at = _place_on_body(gear, [other.center for other in distant])
        _draw_centred(plotter, gear.name, at, look, size, scaled(24, size))


def _on_one_axis(one: GearField, other: GearField) -> bool:
    return bool(np.hypot(*(one.center - other.center)) < SAME_AXIS)


def _place_on_body(gear: GearField, mates: Sequence[Array]) -> Array:
    """A point (2,) between rim and teeth, in the middle of the widest gap between the
    directions of the mates' centres (2,), the highest one of equal gaps.
    """
    distance = np.hypot(*(gear.points - gear.center).T)
    rim = distance.max() if gear.is_internal else distance.min()
    radius = 0.5 * (rim + np.median(distance))
    away = [mate - gear.center for mate in mates]
    angles = np.sort([math.atan2(y, x) for x, y in away] or [0.0])
    gaps = np.diff([*angles, angles[0] + 2.0 * math.pi])
    middles = angles + 0.5 * gaps
    widest = middles[gaps > gaps.max() - EQUAL_GAPS]
    angle = widest[np.sin(widest).argmax()]
    return gear.center + radius * np.array([math.cos(angle), math.sin(angle)])


def _draw_centred(
    plotter: Any,
    text: str,
    at: Array,
    look: RenderStyle,
    size: tuple[int, int],
    font: int,
) -> None:
    """A label with its middle at a point (2,) of the world."""
    shift = np.array([0.25 * len(text), 0.5]) * font * _pixel(look, size)
    _draw_label(plotter, text, at - shift, look, font)


def _pixel(look: RenderStyle, size: tuple[int, int]) -> float:
    """Length of a pixel in the world [m]."""
    return 2.0 * look.view.half_height / (size[1] * (1.0 - HEADER))


def _draw_label(
    plotter: Any, text: str, at: Array, look: RenderStyle, font: int
) -> None:
    draw_label(plotter, text, np.array([*at, LABEL_GAP * look.view.half_height]), font)


def draw_label(plotter: Any, text: str, at: Array, font: int) -> None:
    """A label whose lower left corner is at a point (3,) of the world."""
    plotter.add_point_labels(
        at[None],
        [text],
        font_size=font,
        bold=False,
        text_color=INK,
        shape="rounded_rect",
        shape_color="white",
        shape_opacity=0.85,
        margin=5,
        show_points=False,
        always_visible=True,
        reset_camera=False,
        justification_horizontal="left",
        justification_vertical="bottom",
    )


def draw_bar(
    plotter: Any, mapper: Any, texts: tuple[str, list[str]], size: tuple[int, int]
) -> None:
    """The colour bar, below its title and the lines of its notes."""
    title, notes = texts
    plotter.add_text(
        "\n".join([title, *([""] if notes else []), *notes]),
        position=(0.06, 0.80),
        viewport=True,
        font_size=scaled(11, size),
        color=INK,
    )
    plotter.add_scalar_bar(
        title=" ",
        mapper=mapper,
        vertical=True,
        n_labels=6,
        fmt="%.4g",
        width=0.30,
        height=0.70,
        position_x=0.08,
        position_y=0.05,
        label_font_size=scaled(22, size),
        title_font_size=1,
        color=INK,
    )


def draw_title(
    plotter: Any, title: str, details_text: str, size: tuple[int, int]
) -> None:
    for text, height, points in ((title, 0.52, 17), (details_text, 0.10, 12)):
        plotter.add_text(
            text,
            position=(0.012, height),
            viewport=True,
            font_size=scaled(points, size),
            color=INK,
        )


def scaled(points: int, size: tuple[int, int]) -> int:
    """A font size at the height of a picture, given that at 1080 pixels."""
    return max(3, round(points * size[1] / 1080.0))
