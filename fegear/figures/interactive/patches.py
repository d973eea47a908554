"""Areas of matplotlib as filled traces, and bands across a panel as shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.figures.interactive.coordinates import (
    Array,
    FigurePanel,
    data_points,
    in_data,
    joined,
    outlines,
)
from fegear.figures.interactive.elements import Element, Elements, label_of, trace
from fegear.figures.interactive.lines import layer, references
from fegear.figures.interactive.styles import TRANSPARENT, css, dash, pixels
from fegear.figures.interactive.texts import markup

if TYPE_CHECKING:
    from matplotlib.patches import FancyArrowPatch, Patch

HATCHES = "/\\x-|+."  # that plotly has


def add_patch(elements: Elements, panel: FigurePanel, patch: Patch) -> None:
    """A polygon; a rectangle as a shape where it goes from side to side."""
    from matplotlib.patches import Rectangle

    transform = patch.get_transform()
    if isinstance(patch, Rectangle) and in_data(panel, transform) != (True, True):
        elements.shapes.append(_band(panel, patch))
        return
    parts = outlines(panel, transform, patch.get_path())
    parts = [closed(part) for part in parts if len(part)]
    elements.traces.append(area(panel, patch, parts, **patch_style(patch)))


def area(panel: FigurePanel, artist: Any, parts: list[Array], **style: Any) -> Element:
    """A filled trace, which says its name and nothing of its points."""
    x, y = joined(parts)
    named = bool(label_of(artist))
    hover: dict[str, Any] = {
        "hoveron": "fills",
        "hoverinfo": "name" if named else "skip",
    }
    shape = {"mode": "lines", "fill": "toself", **hover, "hovertemplate": None}
    return trace(panel, artist, x, y, **shape, **style)


def closed(part: Array) -> Array:
    """Points of an outline that ends where it begins."""
    return part if np.array_equal(part[0], part[-1]) else np.vstack([part, part[:1]])


def patch_style(patch: Patch) -> dict[str, Any]:
    """Fill and edge of a patch."""
    face = css(patch.get_facecolor()) if patch.get_fill() else TRANSPARENT
    edge = patch.get_edgecolor()
    line = edge_style(edge, patch.get_linewidth(), patch.get_linestyle())
    style: dict[str, Any] = {"fillcolor": face, "line": line}
    if patch.get_hatch():
        style["fillpattern"] = hatch_pattern(patch.get_hatch(), edge, face)
    return style


def edge_style(color: Any, width: float, style: Any) -> dict[str, Any]:
    """Line around an area."""
    shown = {"color": css(color), "width": pixels(width)}
    if isinstance(style, str) and style not in ("-", "solid", "None", "none", ""):
        return shown | {"dash": dash(style, width)}
    return shown


def hatch_pattern(hatch: str, color: Any, face: str) -> dict[str, Any]:
    """Pattern in place of a fill."""
    sign = next((letter for letter in hatch if letter in HATCHES), "/")
    return {
        "shape": sign,
        "fgcolor": css(color),
        "bgcolor": face,
        "size": 8,
        "solidity": 0.2,
    }


def _band(panel: FigurePanel, patch: Any) -> Element:
    style = patch_style(patch)
    x, y = patch.get_xy()
    corners = {
        "x0": x,
        "x1": x + patch.get_width(),
        "y0": y,
        "y1": y + patch.get_height(),
    }
    return {
        "type": "rect",
        "fillcolor": style["fillcolor"],
        "line": style["line"],
        **{key: float(value) for key, value in corners.items()},
        "name": markup(label_of(patch)),
        "layer": layer(patch.get_zorder()),
        **references(panel, patch.get_transform()),
    }


def add_arrow(elements: Elements, panel: FigurePanel, arrow: FancyArrowPatch) -> None:
    """The line of an arrow, and its head as an area."""
    from matplotlib.transforms import IdentityTransform

    # the outline on the screen is that of matplotlib when the figure was last drawn
    path = arrow.get_path().transformed(arrow.get_transform())
    color, width = arrow.get_edgecolor(), arrow.get_linewidth()
    parts = outlines(panel, IdentityTransform(), path)
    heads = [part for part in parts if len(part) > 2 and np.allclose(part[0], part[-1])]
    for part in parts:
        is_head = any(part is head for head in heads)
        style = {"line": edge_style(color, width, arrow.get_linestyle())}
        if is_head:
            fill = css(arrow.get_facecolor())
            elements.traces.append(area(panel, arrow, [part], fillcolor=fill, **style))
        else:
            look: dict[str, Any] = {"mode": "lines", "hoverinfo": "skip", **style}
            x, y = data_points(panel, panel.axes.transData, part).T
            elements.traces.append(
                trace(panel, arrow, x, y, **look) | {"hovertemplate": None}
            )
