"""Colours, dashes and markers of matplotlib in the words of plotly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.lines import Line2D

PIXELS_PER_INCH = 96.0
PIXELS_PER_POINT = PIXELS_PER_INCH / 72.0
TRANSPARENT = "rgba(0,0,0,0)"
SYMBOLS = {
    "o": "circle",
    ".": "circle",
    ",": "circle",
    "s": "square",
    "D": "diamond",
    "d": "diamond-tall",
    "^": "triangle-up",
    "v": "triangle-down",
    "<": "triangle-left",
    ">": "triangle-right",
    "P": "cross",
    "X": "x",
    "*": "star",
    "p": "pentagon",
    "h": "hexagon",
    "H": "hexagon2",
    "8": "octagon",
    "x": "x-thin",
    "+": "cross-thin",
    "|": "line-ns",
    "_": "line-ew",
    "1": "y-down",
    "2": "y-up",
    "3": "y-left",
    "4": "y-right",
}
STROKES = frozenset("x+|_1234")  # markers without an area
SIZES = {".": 0.5, ",": 0.0, "d": 1.0}  # over the size that matplotlib states
STEPS = {
    "steps": "vh",
    "steps-pre": "vh",
    "steps-mid": "hvh",
    "steps-post": "hv",
    "default": "linear",
}
DASHES: dict[str, tuple[float, ...]] = {
    "-": (),
    "solid": (),
    "--": (3.7, 1.6),
    "dashed": (3.7, 1.6),
    "-.": (6.4, 1.6, 1.0, 1.6),
    "dashdot": (6.4, 1.6, 1.0, 1.6),
    ":": (1.0, 1.65),
    "dotted": (1.0, 1.65),
}
INVISIBLE_STYLES = ("None", "none", " ", "")


def css(color: Any, alpha: float | None = None) -> str:
    """A colour of matplotlib for plotly.

    alpha : opacity in place of the colour's own
    """
    from matplotlib.colors import to_rgba

    red, green, blue, opacity = to_rgba(color, alpha)
    channels = ",".join(str(round(255 * part)) for part in (red, green, blue))
    return f"rgb({channels})" if opacity == 1.0 else f"rgba({channels},{opacity:.4g})"


def css_list(colors: Any) -> list[str]:
    """Colours (n, 4) for plotly; many of them are often equal."""
    rows = [tuple(row) for row in np.asarray(colors, float).round(6).tolist()]
    texts = {row: css(row) for row in dict.fromkeys(rows)}
    return [texts[row] for row in rows]


def opaque(color: Any) -> str:
    """A colour without its opacity, by which artists of one colour are found."""
    from matplotlib.colors import to_hex

    return to_hex(color)


def pixels(points: float) -> float:
    """Length on the screen of one in points."""
    return round(PIXELS_PER_POINT * float(points), 3)


def dash(style: Any, width: float) -> str:
    """Dashes of a line.

    style : a name, or the pair of an offset and lengths over the line's width
    width : of the line [points]
    """
    lengths = DASHES[style] if isinstance(style, str) else (style[1] or ())
    return ",".join(f"{pixels(part * width):g}px" for part in lengths) or "solid"


def scaled_dash(lengths: Sequence[float] | None) -> str:
    """Dashes whose lengths are in points."""
    return ",".join(f"{pixels(part):g}px" for part in lengths or ()) or "solid"


def line_style(line: Line2D) -> dict[str, Any] | None:
    """Line of a trace; None where points are not joined."""
    width = line.get_linewidth()
    if line.get_linestyle() in INVISIBLE_STYLES or width == 0.0:
        return None
    # matplotlib names the pattern of other dashes "--"
    pattern = getattr(line, "_unscaled_dash_pattern", line.get_linestyle())
    return {
        "color": css(line.get_color(), line.get_alpha()),
        "width": pixels(width),
        "dash": dash(pattern, width),
        "shape": STEPS[line.get_drawstyle()],
    }


def marker_style(line: Line2D) -> dict[str, Any] | None:
    """Marker of a trace; None where points are not marked."""
    marker: Any = line.get_marker()
    if marker is None or marker in INVISIBLE_STYLES:
        return None
    if marker not in SYMBOLS:
        raise TypeError(f"no interactive form of the marker {marker!r}")
    alpha, edge = line.get_alpha(), line.get_markeredgecolor()
    face = edge if marker in STROKES else line.get_markerfacecolor()
    size = SIZES.get(marker, 1.0) * line.get_markersize()
    edge_width = line.get_markeredgewidth()
    return {
        "symbol": SYMBOLS[marker],
        "size": max(1.0, pixels(size)),
        "color": clear_or_css(face, alpha),
        "line": {"color": clear_or_css(edge, alpha), "width": pixels(edge_width)},
    }


def clear_or_css(color: Any, alpha: float | None) -> str:
    """A colour for plotly, where "none" is one too."""
    return (
        TRANSPARENT if isinstance(color, str) and color == "none" else css(color, alpha)
    )
