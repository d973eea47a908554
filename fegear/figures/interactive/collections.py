"""Collections of matplotlib: scattered markers, areas, lines and contours."""

from __future__ import annotations

from typing import Any

import numpy as np

from fegear.figures.interactive.coordinates import (
    Array,
    FigurePanel,
    data_points,
    joined,
    outlines,
)
from fegear.figures.interactive.elements import Elements, hover_text, label_of, trace
from fegear.figures.interactive.patches import area, closed, hatch_pattern
from fegear.figures.interactive.styles import (
    SYMBOLS,
    TRANSPARENT,
    css,
    css_list,
    pixels,
    scaled_dash,
)
from fegear.figures.interactive.texts import markup, one_line


def add_scatter(elements: Elements, panel: FigurePanel, points: Any) -> None:
    """Markers with sizes and colours of their own, and the values of the colours."""
    x, y = data_points(panel, points.get_offset_transform(), points.get_offsets()).T
    sizes = np.sqrt(points.get_sizes())
    faces, edges = points.get_facecolor(), points.get_edgecolor()
    widths = [pixels(width) for width in points.get_linewidths()]
    marker = {
        "symbol": _symbol(points.get_paths()[0]),
        "size": _one_or_all([pixels(size) for size in sizes], x.size),
        "color": _one_or_all(css_list(faces), x.size, TRANSPARENT),
        "line": {
            "color": _one_or_all(css_list(edges), x.size, TRANSPARENT),
            "width": _one_or_all(widths, x.size, 0.0),
        },
    }
    more: dict[str, Any] = {}
    values = points.get_array()
    if values is not None:
        bar = getattr(points, "colorbar", None)
        name = one_line(bar.ax.get_ylabel() or bar.ax.get_xlabel()) if bar else "value"
        text = hover_text(panel, label_of(points), f"{name}: %{{customdata:.5g}}")
        data: Any = np.ma.filled(np.ma.asarray(values, float), np.nan)
        more = {"customdata": data, "hovertemplate": text}
    elements.traces.append(
        trace(panel, points, x, y, mode="markers", marker=marker, **more)
    )


def _symbol(path: Any) -> str:
    """Symbol of a marker by its outline."""
    from matplotlib.markers import MarkerStyle

    for marker, symbol in SYMBOLS.items():
        style = MarkerStyle(marker)
        shape: Any = style.get_path().transformed(style.get_transform())
        if shape.vertices.shape == path.vertices.shape and np.allclose(
            shape.vertices, path.vertices
        ):
            return symbol
    raise TypeError("no interactive form of a marker's outline")


def _one_or_all(values: list[Any], count: int, default: Any = None) -> Any:
    """One value for all points, or one for each, repeated as matplotlib does."""
    if len(values) <= 1:
        return values[0] if values else default
    return [values[i % len(values)] for i in range(count)]


def _of(values: Any, index: int, default: Any) -> Any:
    """Value of a member of a collection, which repeats them."""
    return values[index % len(values)] if len(values) else default


def add_lines(elements: Elements, panel: FigurePanel, lines: Any) -> None:
    """A trace for each look of the lines."""
    _refuse_offsets(lines)
    groups: dict[tuple[str, float, str], list[Array]] = {}
    for index, path in enumerate(lines.get_paths()):
        look = _stroke(lines, index)
        groups.setdefault(look, []).extend(outlines(panel, lines.get_transform(), path))
    for (color, width, dashes), parts in groups.items():
        x, y = joined(parts)
        style = {"color": color, "width": width, "dash": dashes}
        elements.traces.append(trace(panel, lines, x, y, mode="lines", line=style))


def _refuse_offsets(collection: Any) -> None:
    """TypeError for shapes that are repeated at places, as arrows of a field."""
    if np.any(collection.get_offsets()):
        raise TypeError(f"no interactive form of {type(collection).__name__}")


def _stroke(collection: Any, index: int) -> tuple[str, float, str]:
    """Colour, width and dashes of the line of a member."""
    color = css(_of(collection.get_edgecolor(), index, (0.0, 0.0, 0.0, 0.0)))
    width = float(_of(collection.get_linewidth(), index, 1.0))
    _, lengths = _of(collection.get_linestyle(), index, (0.0, None))
    return color, pixels(width), scaled_dash(lengths)


def add_areas(elements: Elements, panel: FigurePanel, areas: Any) -> None:
    """A trace for each look of the areas."""
    _refuse_offsets(areas)
    groups: dict[tuple[str, str, float, str], list[Array]] = {}
    for index, path in enumerate(areas.get_paths()):
        face = css(_of(areas.get_facecolor(), index, (0.0, 0.0, 0.0, 0.0)))
        look = (face, *_stroke(areas, index))
        parts = outlines(panel, areas.get_transform(), path)
        groups.setdefault(look, []).extend(closed(part) for part in parts if len(part))
    hatch = areas.get_hatch()
    for (face, color, width, dashes), parts in groups.items():
        line = {"color": color, "width": width, "dash": dashes}
        style: dict[str, Any] = {"fillcolor": face, "line": line}
        if hatch:
            style["fillpattern"] = hatch_pattern(hatch, "black", face)
        elements.traces.append(area(panel, areas, parts, **style))


def add_contours(elements: Elements, panel: FigurePanel, contours: Any) -> None:
    """A trace for each level, named by it."""
    for index, path in enumerate(contours.get_paths()):
        parts = outlines(panel, contours.get_transform(), path)
        parts = [part for part in parts if len(part)]
        if not parts:
            continue
        if contours.filled:
            _add_band(elements, panel, contours, index, parts)
        else:
            _add_isoline(elements, panel, contours, index, parts)


def _add_isoline(
    elements: Elements,
    panel: FigurePanel,
    contours: Any,
    index: int,
    parts: list[Array],
) -> None:
    color, width, dashes = _stroke(contours, index)
    style = {"color": color, "width": width, "dash": dashes}
    x, y = joined(parts)
    text = hover_text(panel, f"{contours.levels[index]:.5g}")
    elements.traces.append(
        trace(panel, contours, x, y, mode="lines", line=style, hovertemplate=text)
    )


def _add_band(
    elements: Elements,
    panel: FigurePanel,
    contours: Any,
    index: int,
    parts: list[Array],
) -> None:
    low, high = contours.levels[index : index + 2]
    face = css(_of(contours.get_facecolor(), index, (0.0, 0.0, 0.0, 0.0)))
    style: dict[str, Any] = {"fillcolor": face, "line": {"width": 0.0}}
    hatches = contours.hatches
    hatch = hatches[index % len(hatches)] if hatches else None
    if hatch:
        style["fillpattern"] = hatch_pattern(hatch, "black", face)
    band = area(panel, contours, [closed(part) for part in parts], **style)
    if face != TRANSPARENT and not hatch:
        band |= {"name": markup(f"{low:.5g} to {high:.5g}"), "hoverinfo": "name"}
    elements.traces.append(band)
