"""A page for browsers that shows contact over the face width, to be turned by hand.

The template in this folder draws it by WebGL; lengths are in millimetres from the
middle of the view of the driver, values in the units shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fegear.rendering.flank_surfaces import band_surface, tooth_surface
from fegear.rendering.look import BODY, COLOURS, palette
from fegear.rendering.viewer_page import (
    N_COLOURS,
    filled_page,
    packed,
    packed_floats,
    packed_indices,
)
from fegear.rendering.width_contact import (
    PairLoad,
    WidthMoment,
    WidthMoments,
    pair_number,
)
from fegear.rendering.width_look import (
    EDGE_COLOUR,
    LIFT,
    Eye,
    WidthStyle,
    gear_text,
    how_drawn,
    numbered,
    state_words,
    style_of,
)
from lumped.common.array_types import Array, Indices
from lumped.common.units import TO_MM

ASPECT = 1.0  # of a view whose window may have any
EDGE = -1.0  # pressure of an edge, which has no limit


def width_page(moments: WidthMoments, title: str) -> str:
    """The page of the first of the moments as text."""
    moment, style = moments[0], style_of(moments, ASPECT)
    details = ", ".join([*state_words(moment), how_drawn(style.widening)])
    table = _table(moment.pair_loads(0))
    return filled_page("width_page.html", title, details, table, _data(moment, style))


def _table(pairs: Sequence[PairLoad]) -> str:
    """Normal force and largest pressure of every pair."""
    rows = [
        f"<tr><td>{pair_number(pair.pair)}</td><td>{pair.load:.0f}</td>"
        f"<td>{'edge' if pair.pressure is None else f'{1e-6 * pair.pressure:.0f}'}"
        "</td></tr>"
        for pair in pairs
    ]
    return (
        "<table><thead><tr><th>pair</th><th>load [N]</th><th>pressure [MPa]</th></tr>"
        f"</thead><tbody>{''.join(rows)}</tbody></table>"
    )


def _data(moment: WidthMoment, style: WidthStyle) -> dict[str, Any]:
    origin = style.eyes[0].middle
    colours = COLOURS["pressure"]
    return {
        "gears": [_gear(moment, style, index, origin) for index in (0, 1)],
        "title": colours.title.replace("\n", " "),
        "unit": colours.unit,
        "limit": 1e-6 * style.limit,
        "palette": packed(palette("pressure")[:N_COLOURS].tobytes()),
        "body": BODY,
        "edge": EDGE_COLOUR,
    }


def _gear(
    moment: WidthMoment, style: WidthStyle, index: int, origin: Array
) -> dict[str, Any]:
    """Teeth and contacts of a gear, and where it is looked at from."""
    gear, eye = moment.gears[index], style.eyes[index]
    teeth = [tooth_surface(gear, moment.place, pair) for pair in style.pairs]
    points = np.vstack([tooth.points for tooth in teeth])
    band = moment.band(index)
    surface = band_surface(gear, band, moment.place, style.widening)
    lift = LIFT * gear.teeth.module * eye.toward
    value = np.where(band.on_path[:, None], 1e-6 * surface.pressure, EDGE)
    line = band_surface(gear, band, moment.place).points
    middle = line[:, :, line.shape[2] // 2].mean(axis=1)
    return {
        "name": gear_text(gear),
        "eye": _eye(eye, origin),
        "points": packed_floats(TO_MM * (points - origin)),
        "triangles": packed_indices(_triangles(numbered(teeth, "faces"))),
        "edges": packed_indices(numbered(teeth, "edges")),
        "band": packed_floats(TO_MM * (surface.points + lift - origin)),
        "values": packed_floats(np.broadcast_to(value[:, None], surface.arc.shape)),
        "quads": packed_indices(_triangles(surface.faces)),
        "slices": [
            {
                "at": np.round(TO_MM * (place - origin), 4).tolist(),
                "text": text,
            }
            for place, text in zip(middle, _slice_texts(moment, index), strict=True)
        ],
        "ends": [
            {
                "text": text,
                "at": (TO_MM * (_beyond(eye, end) - origin)).tolist(),
            }
            for text, end in zip(("near end", "far end"), gear.ends, strict=True)
        ],
    }


def _slice_texts(moment: WidthMoment, index: int) -> list[str]:
    """What a reader points at: pair, pressure and place of each slice."""
    band, texts = moment.band(index), []
    for i in range(band.pair.size):
        value = f"{1e-6 * band.pressure[i]:.0f} MPa" if band.on_path[i] else "edge"
        place, arc = TO_MM * band.place[i].mean(), TO_MM * band.arc[i].mean()
        texts.append(
            f"pair {pair_number(int(band.pair[i]))}, {value}, {place:+.2f} mm from the "
            f"middle of the width, {arc:.2f} mm from the tip corner, half width "
            f"{1e6 * band.half_width[i]:.0f} um"
        )
    return texts


def _beyond(eye: Eye, end: float) -> Array:
    """A point (3,) a little beyond an end of the width."""
    return np.array([eye.middle[0], eye.middle[1], -1.1 * end])


def _eye(eye: Eye, origin: Array) -> dict[str, Any]:
    return {
        "right": eye.right.tolist(),
        "up": eye.up.tolist(),
        "toward": eye.toward.tolist(),
        "middle": (TO_MM * (eye.middle - origin)).tolist(),
        "half": TO_MM * eye.half_height,
    }


def _triangles(quads: Indices) -> Indices:
    """Two triangles (2 m, 3) of each quadrilateral (m, 4)."""
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
