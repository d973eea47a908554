"""Texts and annotations of matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.figures.interactive.coordinates import FigurePanel, from_screen, in_data
from fegear.figures.interactive.elements import Element, Elements
from fegear.figures.interactive.lines import references
from fegear.figures.interactive.styles import PIXELS_PER_POINT, css, pixels
from fegear.figures.interactive.texts import markup

if TYPE_CHECKING:
    from matplotlib.text import Annotation, Text

X_ANCHORS = {"left": "left", "center": "center", "right": "right"}
Y_ANCHORS = {
    "top": "top",
    "center": "middle",
    "bottom": "bottom",
    "baseline": "bottom",
    "center_baseline": "middle",
}
FONT_SCALE = 0.95  # of plotly's letters, which are wider, over those of matplotlib
HEAD_SIZE = 1.0


def add_text(elements: Elements, panel: FigurePanel, text: Text) -> None:
    """A text at a place in the data or in the panel."""
    if text.get_text():
        note = _placed(panel, text.get_transform(), text.get_position())
        elements.annotations.append(note | text_style(text))


def add_annotation(elements: Elements, panel: FigurePanel, note: Annotation) -> None:
    """A text beside its point, or an arrow from one place to another."""
    arrow = note.arrow_patch
    if arrow is None and not note.get_text():
        return
    transform = _point_transform(panel, note)
    place = _placed(panel, transform, note.xy)
    if note.get_text() or arrow is None:
        shift = _shift(panel, note, transform.transform(note.xy))
        style = {"xshift": shift[0], "yshift": shift[1]}
        elements.annotations.append(place | style | text_style(note))
    if arrow is not None:
        elements.annotations.append(place | _arrow(panel, note, arrow))


def _point_transform(panel: FigurePanel, note: Annotation) -> Any:
    """From the point of an annotation to pixels of matplotlib."""
    coordinates: Any = note.xycoords
    transforms = {
        "data": panel.axes.transData,
        "axes fraction": panel.axes.transAxes,
    }
    transform = (
        transforms.get(coordinates) if isinstance(coordinates, str) else coordinates
    )
    if transform is None:
        raise TypeError(f"no interactive form of annotations in {coordinates!r}")
    return transform


def _placed(panel: FigurePanel, transform: Any, point: Any) -> Element:
    """Coordinates of an annotation, which are exponents on a logarithmic axis."""
    refs = references(panel, transform)
    if (
        in_data(panel, transform) == (False, False)
        and transform != panel.axes.transAxes
    ):
        axes_point = panel.axes.transAxes.inverted().transform(
            transform.transform(point)
        )
        return {"x": float(axes_point[0]), "y": float(axes_point[1]), **refs}
    x, y = (float(part) for part in point)
    for_x = _axis_value(panel.axes.get_xscale(), x, refs["xref"])
    return {
        "x": for_x,
        "y": _axis_value(panel.axes.get_yscale(), y, refs["yref"]),
        **refs,
    }


def _axis_value(scale: str, value: float, reference: str) -> float:
    is_exponent = scale == "log" and "domain" not in reference
    return float(np.log10(value)) if is_exponent else value


def _shift(panel: FigurePanel, note: Annotation, point: Any) -> tuple[float, float]:
    """Pixels from the point of an annotation, in pixels of matplotlib, to its text."""
    root: Any = panel.axes.get_figure(root=True)
    text = np.asarray(note.get_transform().transform(note.get_position()), float)
    per_pixel = 72.0 / root.dpi * PIXELS_PER_POINT
    x, y = per_pixel * (text - point)
    return round(float(x), 2), round(float(y), 2)


def text_style(text: Any) -> Element:
    """Letters, and where they are about their place."""
    style: Element = {
        "text": markup(text.get_text()),
        "showarrow": False,
        "font": {
            "size": round(FONT_SCALE * pixels(text.get_fontsize()), 2),
            "color": css(text.get_color(), text.get_alpha()),
        },
        "textangle": -float(text.get_rotation()),
        "xanchor": X_ANCHORS[text.get_horizontalalignment()],
        "yanchor": Y_ANCHORS[text.get_verticalalignment()],
        "align": X_ANCHORS[text.get_horizontalalignment()],
    }
    box = text.get_bbox_patch()
    if box is not None:
        style["bgcolor"] = css(box.get_facecolor())
        style["borderpad"] = 1
        if box.get_linewidth() > 0.0 and box.get_edgecolor()[3] > 0.0:
            style["bordercolor"] = css(box.get_edgecolor())
    return style


def _arrow(panel: FigurePanel, note: Annotation, arrow: Any) -> Element:
    """An arrow from the place of the text to the point."""
    tail = note.get_transform().transform(note.get_position())
    start = from_screen(panel, np.asarray(tail, float)[None])[0]
    scales = panel.axes.get_xscale(), panel.axes.get_yscale()
    ax, ay = (_axis_value(s, float(v), "") for s, v in zip(scales, start, strict=True))
    style = str(note.arrowprops.get("arrowstyle", "-|>"))  # type: ignore[union-attr]
    return {
        "text": "",
        "showarrow": True,
        "ax": ax,
        "ay": ay,
        "axref": panel.x,
        "ayref": panel.y,
        "arrowcolor": css(arrow.get_edgecolor()),
        "arrowwidth": max(pixels(arrow.get_linewidth()), 0.5),
        "arrowhead": 2 if "|>" in style else 3 if ">" in style else 0,
        "arrowsize": HEAD_SIZE,
    }
