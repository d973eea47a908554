"""A page for browsers that shows the contact: one file, which needs no network.

The template in this folder draws it by WebGL; what it is given is in millimetres
from the middle of the view, in the units shown, and single precision.
"""

from __future__ import annotations

import gzip
import json
import re
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fegear.rendering.fields import ContactField
from fegear.rendering.gear_fields import PairField
from fegear.rendering.labels import legend, pair_text, state_words
from fegear.rendering.look import COLOURS, RenderStyle, palette, ribbon_base, ribbon_of
from lumped.common.array_types import Array, Indices
from lumped.common.checks import require_present
from lumped.common.units import TO_MM

QUARTERS = ([0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5])  # of a six-node triangle
N_COLOURS = 200  # colours of a palette that are the map's
MIN_NODES_OF_CORNERS = 150_000  # nodes, from which on corners alone are drawn


def page(field: ContactField, looks: Sequence[RenderStyle], title: str) -> str:
    """The page as text; the first of the looks is shown at first."""
    details, table = ", ".join(state_words(field)), _table(field.pairs)
    return filled_page("page.html", title, details, table, _data(field, looks))


def filled_page(
    template: str, title: str, details: str, table: str, data: dict[str, Any]
) -> str:
    """A template of this folder with its texts, a table of HTML, and its data."""
    folder = Path(__file__).parent
    replacements = {
        "@STYLE@": (folder / "viewer.css").read_text("utf-8"),
        "@TITLE@": escape(title),
        "@DETAILS@": escape(details),
        "@TABLE@": table,
        # "</script>" within a text would end the data
        "@DATA@": json.dumps(data).replace("<", "\\u003c"),
    }
    text = (folder / template).read_text("utf-8")
    # in one pass: what is put in is not searched for marks
    return re.sub("|".join(replacements), lambda mark: replacements[mark[0]], text)


def _table(pairs: Sequence[PairField]) -> str:
    """Load of every pair, its share and largest pressure, with the sum."""
    if not pairs:
        return "<p>No tooth pair carries load.</p>"
    total = sum(pair.load for pair in pairs)
    rows = [
        f"<tr><td>{pair.tooth}</td><td>{pair.load:.0f}</td>"
        f"<td>{100.0 * pair.load / total:.1f}</td>"
        f"<td>{1e-6 * pair.pressure.max():.0f}</td></tr>"
        for pair in sorted(pairs, key=lambda pair: pair.tooth)
    ]
    return (
        "<table><thead><tr><th>pair</th><th>load [N]</th><th>[%]</th>"
        "<th>pressure [MPa]</th></tr></thead><tbody>"
        f"{''.join(rows)}<tr><td>sum</td><td>{total:.0f}</td><td>100</td><td></td></tr>"
        "</tbody></table>"
    )


@dataclass(frozen=True, eq=False)
class LinearMesh:
    """All gears in straight triangles (m, 3) and lines (k, 2).

    nodes : those needed, of all gears in a row
    starts : number of each gear's first node among them
    """

    nodes: Indices
    starts: list[int]
    triangles: Indices
    lines: Indices


def _values_of(field: ContactField) -> LinearMesh:
    """Elements in quarters, or whole where there are so many that none shows."""
    nodes, sides = field.nodes_of_gears("triangles"), field.nodes_of_gears("outline")
    if sum(len(gear.points) for gear in field.gears) > MIN_NODES_OF_CORNERS:
        triangles, lines = nodes[:, :3], sides[:, [0, 2]]
    else:
        triangles = nodes[:, np.array(QUARTERS)].reshape(-1, 3)
        lines = np.vstack([sides[:, :2], sides[:, 1:]])
    # an outline has mid-side nodes of elements that were cut into finer ones
    used_nodes = np.union1d(triangles, lines)
    return LinearMesh(
        nodes=used_nodes,
        starts=np.searchsorted(used_nodes, field.first_nodes).tolist(),
        triangles=np.searchsorted(used_nodes, triangles),
        lines=np.searchsorted(used_nodes, lines),
    )


def _data(field: ContactField, looks: Sequence[RenderStyle]) -> dict[str, Any]:
    look, view, plain = looks[0], looks[0].view, _values_of(field)
    return {
        "names": [gear.name for gear in field.gears],
        "starts": plain.starts,
        "center": (TO_MM * view.middle).tolist(),
        "half": TO_MM * view.half_height,
        "aspect": view.aspect,
        "scale": look.motion_scale,
        "points": packed_floats(
            TO_MM * (field.of_gears("points")[plain.nodes] - view.middle)
        ),
        "motion": _rough(TO_MM * field.of_gears("motion")[plain.nodes]),
        "triangles": packed_indices(plain.triangles),
        "outline": packed_indices(plain.lines),
        "fields": [_field(field, plain, style) for style in looks],
        "ribbon": _ribbon(field.pairs, look),
        "labels": [*_loads(field.pairs, look), *_names(field, look)],
    }


def _field(field: ContactField, plain: LinearMesh, look: RenderStyle) -> dict[str, Any]:
    """Values of the gears, none where only the ribbon has colours."""
    colours = COLOURS[look.shown]
    values: Array = np.empty(0)
    if look.shown != "pressure":
        values = colours.scale * field.of_gears(colours.quantity)[plain.nodes]
    return {
        "title": colours.title.replace("\n", " "),
        "unit": colours.unit,
        "limits": look.limits,
        "notes": " ".join(legend(look)[1]),
        "ribbon": TO_MM * look.ribbon * look.view.half_height,
        "palette": packed(palette(look.shown)[:N_COLOURS].tobytes()),
        "values": _rough(values),
    }


def _ribbon(pairs: Sequence[PairField], look: RenderStyle) -> dict[str, str]:
    """Its crest is over the base by the ribbon's height times `crest`."""
    at_rest = look.still()
    ribbon = ribbon_of(pairs, at_rest)
    if ribbon is None:
        names = ("points", "motion", "crest", "values", "triangles")
        return dict.fromkeys(names, packed(b""))
    points, faces, pressure = ribbon
    moved = require_present(
        ribbon_of(pairs, look.still(1.0)), "pressure of the moved pairs"
    )
    base = points.copy()
    for quad in faces:
        base[quad[2:]] = points[quad[1::-1]]
    full = look.ribbon * look.view.half_height
    return {
        "points": packed_floats(TO_MM * (base - look.view.middle)),
        "motion": packed_floats(TO_MM * (moved[0] - points)),
        "crest": packed_floats((points - base) / full),
        "values": packed_floats(1e-6 * pressure),
        "triangles": packed_indices(faces[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)),
    }


def _loads(pairs: Sequence[PairField], look: RenderStyle) -> list[dict[str, Any]]:
    """Labels of the pairs, from below upwards."""
    labels = []
    for pair in sorted(pairs, key=lambda pair: float(pair.center[1])):
        top = int(pair.pressure.argmax())
        at = ribbon_base(pair, look.still())[top] - look.view.middle
        labels.append(
            {
                "text": pair_text(pair),
                "at": (TO_MM * at).tolist(),
                "motion": (TO_MM * pair.motion[top]).tolist(),
                "crest": pair.normals[top].tolist(),
            }
        )
    return labels


def _names(field: ContactField, look: RenderStyle) -> list[dict[str, Any]]:
    places = [TO_MM * (gear.center - look.view.middle) for gear in field.gears]
    return [
        {"text": gear.name, "at": place.tolist(), "motion": [0, 0]}
        for gear, place in zip(field.gears, places, strict=True)
    ]


def packed_floats(values: ArrayLike) -> str:
    """Numbers in single precision as text."""
    return packed(np.ascontiguousarray(values, "<f4").tobytes())


def _rough(values: ArrayLike) -> str:
    """To four digits, which makes files a third smaller."""
    bits = np.ascontiguousarray(values, "<f4").view("<u4")
    return packed((bits & np.uint32(0xFFFFF000)).tobytes())


def packed_indices(values: ArrayLike) -> str:
    """Counts and node numbers as text."""
    return packed(np.ascontiguousarray(values, "<u4").tobytes())


def packed(data: bytes) -> str:
    """Bytes as text."""
    small = gzip.compress(data, mtime=0)  # the same bytes at any time
    return b64encode(small).decode("ascii")
