"""What pictures of contact over the face width show, whoever draws them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.helix import hand
from fegear.rendering.flank_surfaces import GearInSpace, ToothSurface, tooth_surface
from fegear.rendering.look import BODY, COLOURS, HEADER, MARGIN, Shown
from fegear.rendering.width_contact import (
    PairLoad,
    WidthMoment,
    WidthMoments,
    pair_number,
)
from lumped.common.array_types import Array, Indices

LIFT = 0.006  # modules, by which contacts are drawn above a flank
EDGE_COLOUR = "#00a0c0"  # of edges in contact, which is none of the map
ASIDE = 0.30  # of the eye to the near end
# and over the teeth, from where flanks, and from where roots are seen
ELEVATION: dict[Shown, float] = {"pressure": 0.95, "root-stress": 1.7}
FRAME = 1.14  # height of the view over that of the teeth, for labels
VIEWS = 2  # of a picture


@dataclass(frozen=True, eq=False)
class Eye:
    """Where a gear is looked at from: unit vectors (3,) in space.

    toward : from the teeth to the eye; up : of the picture; right : of the picture
    middle : of the view (3,); half_height : of it [m]
    """

    toward: Array
    up: Array
    right: Array
    middle: Array
    half_height: float


@dataclass(frozen=True, eq=False)
class WidthStyle:
    """What is the same in all pictures of a film.

    shown : what the colours are; limit : of them [Pa]; pairs : whose teeth are drawn
    widening : drawn over true width of contacts
    eyes : on driver and driven gear
    """

    shown: Shown
    limit: float
    pairs: Sequence[int]
    widening: float
    eyes: tuple[Eye, Eye]


def style_of(moments: WidthMoments, aspect: float) -> WidthStyle:
    """Colours, teeth and views that suit all of the moments.

    aspect : width over height of the view of a gear
    """
    pairs = moments.pairs
    shown: Shown = "root-stress" if moments.tensions else "pressure"
    driver, driven = (
        _eye(gear, moments.positions, pairs, aspect, ELEVATION[shown])
        for gear in moments.gears
    )
    return WidthStyle(shown, moments.limit, pairs, moments.widening, (driver, driven))


def view_aspect(size: tuple[int, int]) -> float:
    """Width over height of the view of a gear in a picture (width, height)."""
    return size[0] * (1.0 - MARGIN) / VIEWS / (size[1] * (1.0 - HEADER))


def _eye(
    gear: GearInSpace,
    positions: Array,
    pairs: Sequence[int],
    aspect: float,
    elevation: float,
) -> Eye:
    """Above the teeth of a gear, toward its loaded flanks and the near end."""
    outward, ahead = gear.directions
    toward = ahead + elevation * outward + [0.0, 0.0, ASIDE]
    toward /= np.linalg.norm(toward)
    # the axis is level in the picture, so that the helix is inclined as it is
    axis = np.array([0.0, 0.0, np.cross(outward, toward)[2]])
    right = axis - (axis @ toward) * toward
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    extremes = np.unique([positions.min(), positions.max()])
    points = np.vstack(
        [tooth_surface(gear, at, pair).points for at in extremes for pair in pairs]
    )
    seen = points @ np.stack([right, up, toward], axis=1)
    low, high = seen.min(axis=0), seen.max(axis=0)
    half = 0.5 * (high - low)
    middle = 0.5 * (low + high) @ np.stack([right, up, toward])
    half_height = FRAME * max(half[1], half[0] / aspect)
    return Eye(toward, up, right, middle, float(half_height))


def legend_of(moment: WidthMoment, shown: Shown) -> tuple[str, list[str]]:
    """Title of the colour bar with its unit, and what the bar does not show."""
    colours = COLOURS[shown]
    notes = ["blue: edges,", "no limit"] if not moment.band(0).on_path.all() else []
    if shown == "root-stress":
        notes = ["black: lines", "of contact"]
    return f"{colours.title}\n[{colours.unit}]", notes


def details_of(moment: WidthMoment, style: WidthStyle) -> str:
    """Position, load and scale of a picture in one line."""
    return ", ".join([*state_words(moment), how_drawn(style.widening)])


def state_words(moment: WidthMoment) -> list[str]:
    """Position, load and transmission error."""
    return [
        f"position {moment.position:.3f} base pitches",
        f"torque {moment.torque:g} N m",
        f"transmission error {1e6 * moment.ste:.2f} um",
    ]


def how_drawn(widening: float) -> str:
    """What is true to scale, and what is not."""
    if widening == 1.0:
        return "flanks undeformed, contacts at their true width"
    return f"flanks undeformed, contacts {widening:g} times as wide as they are"


def gear_text(gear: GearInSpace) -> str:
    """Name, role, hand and face width of a gear."""
    helix = hand(gear.teeth)
    hand_text = [f"{helix}-handed"] if helix else []
    width = f"{1e3 * (gear.ends[1] - gear.ends[0]):g} mm wide"
    return ", ".join([gear.name, gear.role, *hand_text, width])


def pair_text(pair: PairLoad) -> str:
    """Load of a pair and its largest pressure away from edges."""
    load = f"pair {pair_number(pair.pair)}: {pair.load:.0f} N"
    if pair.pressure is None:
        return f"{load}, edge"
    return f"{load}, {1e-6 * pair.pressure:.0f} MPa"


def numbered(teeth: Sequence[ToothSurface], name: str) -> Indices:
    """Node numbers of all teeth, each tooth's after those of the teeth before."""
    starts = np.cumsum([0, *(len(tooth.points) for tooth in teeth)])
    parts = [
        getattr(tooth, name) + start
        for tooth, start in zip(teeth, starts[:-1], strict=True)
    ]
    return np.vstack(parts)


def width_palette(shown: Shown) -> NDArray[np.uint8]:
    """All colours of a picture (256, 3), for files that hold no more."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    painted = colormaps[COLOURS[shown].map](np.linspace(0.0, 1.0, 128))[:, :3]
    shaded = [
        np.linspace(to_rgb(one), to_rgb(other), count)
        for one, other, count in (
            ("black", BODY, 70),
            (BODY, "white", 30),
            (EDGE_COLOUR, "white", 28),
        )
    ]
    return np.round(255.0 * np.vstack([painted, *shaded])).astype(np.uint8)
