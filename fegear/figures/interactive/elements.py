"""What artists of matplotlib become in plotly: traces, shapes and annotations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from fegear.figures.interactive.coordinates import FigurePanel
from fegear.figures.interactive.texts import markup, one_line

Element = dict[str, Any]


@dataclass(frozen=True)
class Elements:
    """Parts of a figure of plotly, in the order in which they are drawn."""

    traces: list[Element] = field(default_factory=list)
    shapes: list[Element] = field(default_factory=list)
    annotations: list[Element] = field(default_factory=list)
    images: list[Element] = field(default_factory=list)


def label_of(artist: Any) -> str:
    """Label that an author gave to an artist; empty for those of matplotlib."""
    label = str(artist.get_label() or "")
    return "" if label.startswith("_") else label


def trace(panel: FigurePanel, artist: Any, x: Any, y: Any, **style: Any) -> Element:
    """A trace of points, which is in no legend by itself."""
    return {
        "type": "scatter",
        "x": x,
        "y": y,
        "xaxis": panel.x,
        "yaxis": panel.y,
        "name": markup(label_of(artist)),
        "showlegend": False,
        "hovertemplate": hover_text(panel, label_of(artist)),
        **style,
    }


def hover_text(panel: FigurePanel, label: str, *more: str) -> str:
    """Name, x and y with the labels of the axes, which have the units."""
    names = axis_name(panel, "x"), axis_name(panel, "y")
    lines = [f"<b>{one_line(label)}</b>"] if label else []
    lines += [
        f"{name}: %{{{key}}}" for key, name in zip("xy", names, strict=True) if name
    ]
    return "<br>".join([*lines, *more]) + "<extra></extra>"


def axis_name(panel: FigurePanel, key: str) -> str:
    """Label of an axis, that of the axes that share it where it has none."""
    axes = panel.axes
    shared = axes.get_shared_x_axes() if key == "x" else axes.get_shared_y_axes()
    candidates = [axes, *shared.get_siblings(axes)]
    labels = (getattr(other, f"get_{key}label")() for other in candidates)
    return one_line(next(filter(None, labels), "")) or key
