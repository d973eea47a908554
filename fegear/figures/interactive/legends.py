"""Legends: an entry for each of matplotlib's, which hides the artists that it names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from fegear.figures.interactive.coordinates import FigurePanel
from fegear.figures.interactive.elements import Element, label_of
from fegear.figures.interactive.patches import patch_style
from fegear.figures.interactive.styles import (
    css,
    line_style,
    marker_style,
    opaque,
    pixels,
)
from fegear.figures.interactive.texts import markup

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

MAX_LETTERS = 46  # of a line of an entry
SWATCH = 13  # pixels, size of the sample of an area


class ShownLegend(NamedTuple):
    """A legend of matplotlib; name : in plotly; panel : None for one of the figure."""

    name: str
    legend: Legend
    panel: FigurePanel | None

    @property
    def labels(self) -> list[str]:
        return [text.get_text() for text in self.legend.get_texts()]


def shown_legends(figure: Figure, panels: Sequence[FigurePanel]) -> list[ShownLegend]:
    """Legends of the panels, then those of the figure."""
    legends: list[tuple[Any, FigurePanel | None]] = [
        (legend, panel) for panel in panels for legend in _legends_in(panel)
    ]
    legends += [(legend, None) for legend in figure.legends if legend.get_visible()]
    return [
        ShownLegend("legend" if i == 0 else f"legend{i + 1}", legend, panel)
        for i, (legend, panel) in enumerate(legends)
    ]


def _legends_in(panel: FigurePanel) -> Iterator[Legend]:
    from matplotlib.legend import Legend

    # a second legend of a panel is one of its artists
    for artist in panel.axes.get_children():
        if isinstance(artist, Legend) and artist.get_visible():
            yield artist


def group_of(label: str) -> str:
    """Name of the group of what an entry hides."""
    return markup(label)


def entries(shown: ShownLegend, anchor: FigurePanel) -> Iterator[Element]:
    """A trace without points for each entry of a legend."""
    for handle, label in zip(shown.legend.legend_handles, shown.labels, strict=True):
        yield {
            "type": "scatter",
            "x": [None],
            "y": [None],
            "hoverinfo": "skip",
            "xaxis": anchor.x,
            "yaxis": anchor.y,
            "showlegend": True,
            "name": markup(label, MAX_LETTERS),
            "legendgroup": group_of(label),
            "legend": shown.name,
            **sample(handle),
        }


def sample(handle: Any) -> Element:
    """Look of an entry, of what matplotlib draws in its legend."""
    from matplotlib.collections import LineCollection, PathCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if isinstance(handle, Line2D):
        return _line_sample(handle)
    if isinstance(handle, Patch):
        return _patch_sample(handle)
    if isinstance(handle, LineCollection):
        widths: Any = handle.get_linewidth()
        style = {"color": css(handle.get_color()[0]), "width": pixels(widths[0])}
        return {"mode": "lines", "line": style}
    if isinstance(handle, PathCollection):
        face = css(handle.get_facecolor()[0])
        return {"mode": "markers", "marker": {"color": face, "size": 8}}
    raise TypeError(f"no interactive form of {type(handle).__name__} in a legend")


def _line_sample(handle: Any) -> Element:
    joins, marks = line_style(handle), marker_style(handle)
    if marks is not None:  # nothing is seen of the smallest
        marks["size"] = max(marks["size"], 5.0)
    names = ["lines"] * (joins is not None) + ["markers"] * (marks is not None)
    style: Element = {"mode": "+".join(names) or "none"}
    style |= {} if joins is None else {"line": joins}
    return style | ({} if marks is None else {"marker": marks})


def _patch_sample(handle: Any) -> Element:
    style = patch_style(handle)
    if "fillpattern" in style:
        return {"mode": "lines", "fill": "toself", **style}
    line = {"color": style["line"]["color"], "width": min(style["line"]["width"], 1.5)}
    marker = {"symbol": "square", "size": SWATCH, "color": style["fillcolor"]}
    return {"mode": "markers", "marker": marker | {"line": line}}


def groups(shown: Sequence[ShownLegend], panels: Sequence[FigurePanel]) -> Groups:
    """Which entry hides an artist, by its label, else by its colour."""
    labels = {label for one in shown for label in one.labels}
    drawn = {
        label_of(artist) for panel in panels for artist in panel.axes.get_children()
    }
    by_color: dict[str, set[str]] = {}
    for one in shown:
        for handle, label in zip(one.legend.legend_handles, one.labels, strict=True):
            if label not in drawn:
                by_color.setdefault(main_color(handle), set()).add(label)
    unique = {color: min(names) for color, names in by_color.items() if len(names) == 1}
    return Groups(frozenset(labels), unique)


class Groups(NamedTuple):
    """labels : of all entries; by_color : of those for artists without a label."""

    labels: frozenset[str]
    by_color: dict[str, str]

    def label(self, artist: Any) -> str:
        """Label of the entry that an artist belongs to; empty where there is none."""
        label = label_of(artist)
        if label:
            return label if label in self.labels else ""
        return self.by_color.get(main_color(artist), "")


def main_color(artist: Any) -> str:
    """The colour by which a reader finds an artist in a legend."""
    from matplotlib.collections import Collection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if isinstance(artist, Line2D):
        is_marked = (
            line_style(artist) is None and artist.get_markerfacecolor() != "none"
        )
        return opaque(artist.get_markerfacecolor() if is_marked else artist.get_color())
    if isinstance(artist, Patch):
        return opaque(artist.get_facecolor())
    if isinstance(artist, Collection) and artist.get_array() is None:
        colors = artist.get_facecolor()
        colors = colors if len(colors) else artist.get_edgecolor()
        return opaque(colors[0]) if len(colors) == 1 else ""
    return ""
