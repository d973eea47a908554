"""Layout of a wide screen: panels where they are in the picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from fegear.figures.interactive.coordinates import Array, FigurePanel
from fegear.figures.interactive.elements import Element
from fegear.figures.interactive.layout import (
    ENTRY_LINE,
    GAP,
    LABEL_LINE,
    TITLE_LETTER,
    PanelMargins,
    Picture,
    box_of,
    breakpoint_of,
    legend_rows,
    panel_titles,
    rounded,
    title_of_figure,
    title_text,
    wrapped,
)
from fegear.figures.interactive.legends import ShownLegend
from fegear.figures.interactive.styles import PIXELS_PER_INCH
from fegear.figures.interactive.texts import line_count, markup

LEGEND_FONT = 11.0  # pixels
STRETCH = 1.1  # of heights, as numbers and labels of plotly take more room
AT_TOP = 0.99  # of the height of all panels
EDGE_PART = 0.38  # part of a panel from its edge, where a legend is at that edge


def wide_layout(picture: Picture, frames: dict[FigurePanel, PanelMargins]) -> Element:
    """What a layout has on a wide screen, by paths of its attributes."""
    size = PIXELS_PER_INCH * picture.figure.get_size_inches()
    boxes = {
        panel: np.array(box_of(panel.axes)).reshape(2, 2) for panel in picture.panels
    }
    corners = np.array(list(boxes.values()))
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    layout: Element = {}
    title, height = title_text(picture.title, "wide", 1.15 * size[0])
    sides = _margins(picture, frames, size, low, high)
    layout |= {f"margin.{side}": length for side, length in sides.items()}
    layout["margin.t"] += height
    domains = {panel: (box - low) / (high - low) for panel, box in boxes.items()}
    titles, added = _wrapped_titles(picture, domains, layout)
    layout["margin.t"] += added
    layout |= title_of_figure(picture, title, "wide", layout["margin.t"])
    inner = STRETCH * size[1] * (high[1] - low[1])
    layout["height"] = round(inner + layout["margin.t"] + layout["margin.b"])
    for panel, domain in domains.items():
        layout[f"xaxis{panel.ending}.domain"] = domain[:, 0].tolist()
        layout[f"yaxis{panel.ending}.domain"] = domain[:, 1].tolist()
        layout[f"xaxis{panel.ending}.title.text"] = markup(panel.axes.get_xlabel())
        layout[f"yaxis{panel.ending}.title.text"] = markup(panel.axes.get_ylabel())
    layout |= titles
    _place_bars(layout, picture, low, high)
    for shown in picture.legends:
        _place_legend(layout, shown, domains, height)
    return rounded(layout)


def _wrapped_titles(
    picture: Picture, domains: dict[FigurePanel, Array], layout: Element
) -> tuple[Element, float]:
    """Titles of panels in lines that fit on the narrowest page that is wide.

    The second value is what they take above the panels more than in the picture
    [pixels].
    """
    inner = breakpoint_of(picture) - layout["margin.l"] - layout["margin.r"]
    titles, added = Element(), 0.0
    for number, panel, text in panel_titles(picture):
        (left, right), (_, top) = domains[panel].T
        marked = wrapped(text, max(1, int(inner * (right - left) / TITLE_LETTER)))
        titles[f"annotations[{number}].text"] = marked
        if top > AT_TOP:
            added = max(added, line_count(marked) - line_count(markup(text)))
    return titles, LABEL_LINE * added


def _margins(
    picture: Picture,
    frames: dict[FigurePanel, PanelMargins],
    size: Array,
    low: Array,
    high: Array,
) -> dict[str, float]:
    """Pixels beside all panels; those above are without the title."""
    at_top = [p for p in picture.panels if box_of(p.axes)[3] > high[1] - 0.01]
    at_bottom = [p for p in picture.panels if box_of(p.axes)[1] < low[1] + 0.01]
    top = GAP + max(frames[panel].top for panel in at_top)
    bottom = GAP + max(frames[panel].bottom for panel in at_bottom)
    for shown in picture.legends:
        rows = legend_rows(shown.labels, size[0]) * ENTRY_LINE
        if shown.panel is not None:
            top += rows + GAP if _is_above_panel(shown) else 0.0
        elif _is_above(shown):
            top += rows
        else:
            bottom += rows
    return {
        "l": size[0] * low[0],
        "r": max(size[0] * (1.0 - high[0]), GAP),
        "t": top,
        "b": bottom,
    }


def _is_above_panel(shown: ShownLegend) -> bool:
    """Whether a legend is on top of its panel."""
    return shown.panel is not None and bool(
        shown.legend.get_window_extent().y0 >= shown.panel.axes.bbox.y1
    )


def _is_above(shown: ShownLegend) -> bool:
    """Whether a legend of the figure is in its upper half."""
    figure: Any = shown.legend.get_figure(root=True)
    box = shown.legend.get_window_extent()
    return bool(0.5 * (box.y0 + box.y1) > 0.5 * figure.bbox.height)


def _place_bars(layout: Element, picture: Picture, low: Array, high: Array) -> None:
    for number, (bar, _) in enumerate(picture.bars, 1):
        box = bar.ax.get_position()
        key = f"coloraxis{number if number > 1 else ''}.colorbar"
        x, y = (np.array([box.x0, 0.5 * (box.y0 + box.y1)]) - low) / (high - low)
        is_vertical = bar.orientation == "vertical"
        length = (box.height if is_vertical else box.width) / (high - low)[
            int(is_vertical)
        ]
        if not is_vertical:
            x = (0.5 * (box.x0 + box.x1) - low[0]) / (high - low)[0]
        layout |= {
            f"{key}.x": x,
            f"{key}.y": y,
            f"{key}.len": length,
            f"{key}.xanchor": "left" if is_vertical else "center",
            f"{key}.yref": "paper",
            f"{key}.yanchor": "middle",
            f"{key}.orientation": "v" if is_vertical else "h",
            f"{key}.title.side": "right" if is_vertical else "bottom",
        }


def _place_legend(
    layout: Element,
    shown: ShownLegend,
    domains: dict[FigurePanel, Array],
    height: float,
) -> None:
    """height : of the title [pixels]."""
    place: Element
    if shown.panel is None:
        place = _beside_panels(shown, layout["height"], height)
    else:
        place = _in_panel(shown, shown.panel, domains[shown.panel])
    place |= {"font.size": LEGEND_FONT, "maxheight": 1.0}
    layout |= {f"{shown.name}.{key}": value for key, value in place.items()}


def _beside_panels(shown: ShownLegend, height: float, title_height: float) -> Element:
    """Above or below all panels, over the width of the figure."""
    is_above = _is_above(shown)
    down = title_height / height
    return {
        "orientation": "h",
        "xref": "container",
        "yref": "container",
        "x": 0.5,
        "xanchor": "center",
        "y": 1.0 - down if is_above else 0.0,
        "yanchor": "top" if is_above else "bottom",
    }


def _in_panel(shown: ShownLegend, panel: FigurePanel, domain: Array) -> Element:
    """At the place of matplotlib in or beside a panel, held by the nearest edge."""
    box = shown.legend.get_window_extent()
    to_axes = panel.axes.transAxes.inverted()
    corners = to_axes.transform([(box.x0, box.y0), (box.x1, box.y1)])
    x, x_anchor = _held(corners[:, 0], ("left", "center", "right"))
    y, y_anchor = _held(corners[:, 1], ("bottom", "middle", "top"))
    low, high = domain
    return {
        "orientation": "h" if shown.legend._ncols > 1 else "v",  # type: ignore[attr-defined]
        "xref": "paper",
        "yref": "paper",
        "x": low[0] + x * (high - low)[0],
        "xanchor": x_anchor,
        "y": low[1] + y * (high - low)[1],
        "yanchor": y_anchor,
    }


def _held(ends: Array, anchors: tuple[str, str, str]) -> tuple[float, str]:
    """Coordinate of a legend along an axis of its panel, and its end that is there."""
    low, high = ends
    middle = 0.5 * (low + high)
    if low >= 1.0 or (0.0 <= middle < EDGE_PART and high < 1.0):
        return float(low), anchors[0]
    if high <= 0.0 or 1.0 - EDGE_PART < middle <= 1.0:
        return float(high), anchors[2]
    return float(middle), anchors[1]
