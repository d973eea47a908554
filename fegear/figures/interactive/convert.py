"""Figures of matplotlib as figures of plotly."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from fegear.figures.interactive.axis import INK, axis_pair
from fegear.figures.interactive.collections import (
    add_areas,
    add_contours,
    add_lines,
    add_scatter,
)
from fegear.figures.interactive.color_bars import color_axis, color_bar_of
from fegear.figures.interactive.coordinates import FigurePanel
from fegear.figures.interactive.elements import Element, Elements
from fegear.figures.interactive.images import add_image, add_mesh
from fegear.figures.interactive.layout import (
    Picture,
    breakpoint_of,
    measure_frames,
    panel_titles,
)
from fegear.figures.interactive.legends import (
    Groups,
    entries,
    group_of,
    groups,
    shown_legends,
)
from fegear.figures.interactive.lines import add_line
from fegear.figures.interactive.narrow import narrow_layout
from fegear.figures.interactive.notes import add_annotation, add_text
from fegear.figures.interactive.patches import add_arrow, add_patch
from fegear.figures.interactive.secondary import secondary_axes
from fegear.figures.interactive.styles import PIXELS_PER_INCH
from fegear.figures.interactive.wide import wide_layout
from fegear.files.errors import InputError
from fegear.files.output import PLOTLY_NEEDED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from plotly.graph_objects import Figure as PlotlyFigure

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"


def require_plotly() -> Any:
    """The module `plotly.graph_objects`; InputError where it is not installed."""
    try:
        from plotly import graph_objects
    except ImportError:
        raise InputError(PLOTLY_NEEDED) from None
    return graph_objects


def to_plotly(figure: Figure) -> PlotlyFigure:
    """Convert a figure of matplotlib to one of plotly.

    Every visible artist is converted, with its data as they are. Panels, limits and
    colours are those of the figure. `layout.meta` has two layouts, `wide` as in the
    figure and `narrow` with panels below each other, as attributes by their paths; the
    first is applied.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure that is drawn; its content does not change.

    Returns
    -------
    plotly.graph_objects.Figure

    Raises
    ------
    InputError
        If plotly is not installed.
    TypeError
        If there is no interactive form of an artist, a scale or a marker.
    """
    graph_objects = require_plotly()
    _refuse_others(figure)
    panels, bar_axes = _panels(figure)
    frames = measure_frames(figure, panels)
    bars = [(bar, _owner(bar, panels)) for bar in bar_axes]
    picture = Picture(figure, panels, bars, shown_legends(figure, panels))
    elements = _converted(picture)
    layout = _layout(picture, elements)
    variants = {
        "wide": wide_layout(picture, frames),
        "narrow": narrow_layout(picture, frames),
    }
    layout["meta"] = {"breakpoint": breakpoint_of(picture), **variants}
    drawn = graph_objects.Figure({"data": elements.traces, "layout": layout})
    for path, value in variants["wide"].items():
        drawn.layout[path] = value
    return drawn


def _refuse_others(figure: Figure) -> None:
    """TypeError for artists of the figure itself but its title and legends."""
    title = figure._suptitle  # type: ignore[attr-defined]
    texts = [text for text in figure.texts if text is not title and text.get_text()]
    others = [*texts, *figure.lines, *figure.patches, *figure.images, *figure.subfigs]
    if others:
        raise TypeError(
            f"no interactive form of {type(others[0]).__name__} of a figure"
        )


def _panels(figure: Figure) -> tuple[list[FigurePanel], list[Any]]:
    """Panels in the order of drawing, and colour bars."""
    from matplotlib.axes import Axes

    shown = [axes for axes in figure.axes if axes.get_visible()]
    bars = [bar for axes in shown if (bar := color_bar_of(axes)) is not None]
    main_axes = [axes for axes in shown if color_bar_of(axes) is None]
    insets = [
        child
        for axes in main_axes
        for child in axes.child_axes
        if isinstance(child, Axes) and child.get_visible()
    ]
    return [
        FigurePanel(axes, i) for i, axes in enumerate([*main_axes, *insets], 1)
    ], bars


def _owner(bar: Any, panels: Sequence[FigurePanel]) -> FigurePanel:
    """The panel that a colour bar explains."""
    axes = bar.mappable.axes
    return next((panel for panel in panels if panel.axes is axes), panels[-1])


def _converted(picture: Picture) -> Elements:
    elements = Elements()
    legend_groups = groups(picture.legends, picture.panels)
    if picture.title:
        elements.annotations.append(_figure_title())
    for _, panel, _ in panel_titles(picture):
        elements.annotations.append(_panel_title(panel))
    for panel in picture.panels:
        for artist in _artists(panel.axes):
            _convert(elements, panel, artist, legend_groups)
    for number, (_, panel) in enumerate(picture.bars, 1):
        elements.traces.append(_bar_trace(panel, number))
    for shown in picture.legends:
        elements.traces.extend(entries(shown, shown.panel or picture.panels[0]))
    return elements


def _artists(axes: Axes) -> Iterator[Any]:
    """Visible artists of a panel from back to front, without its frame."""
    from matplotlib.axes._base import _AxesBase
    from matplotlib.axis import Axis
    from matplotlib.legend import Legend
    from matplotlib.spines import Spine

    titles = axes.title, axes._left_title, axes._right_title  # type: ignore[attr-defined]
    parts = (Axis, Spine, Legend, _AxesBase)
    for artist in sorted(axes.get_children(), key=lambda child: child.get_zorder()):
        is_part = isinstance(artist, parts) or artist is axes.patch or artist in titles
        if artist.get_visible() and not is_part:
            yield artist


def _convert(
    elements: Elements, panel: FigurePanel, artist: Any, groups: Groups
) -> None:
    """Convert an artist; what hides it in the legend hides all that it became."""
    convert = _converter(artist)
    before = len(elements.traces), len(elements.shapes)
    convert(elements, panel, artist)
    label = groups.label(artist)
    if not label:
        return
    for trace in elements.traces[before[0] :]:
        trace["legendgroup"] = group_of(label)
        trace["name"] = trace["name"] or group_of(label)
    for shape in elements.shapes[before[1] :]:
        shape["legendgroup"] = group_of(label)


def _converter(artist: Any) -> Callable[[Elements, FigurePanel, Any], None]:
    for kind, convert in _converters():
        if isinstance(artist, kind):
            return convert
    raise TypeError(f"no interactive form of {type(artist).__name__}")


def _converters() -> Iterator[tuple[Any, Callable[[Elements, FigurePanel, Any], None]]]:
    """Classes of artists, special ones before what they are kinds of."""
    from matplotlib import collections, contour, image, lines, patches, text

    yield lines.Line2D, add_line
    yield text.Annotation, add_annotation
    yield text.Text, add_text
    yield contour.ContourSet, add_contours
    yield collections.QuadMesh, add_mesh
    yield collections.PathCollection, add_scatter
    yield collections.LineCollection, add_lines
    yield (collections.PolyCollection, collections.PatchCollection), add_areas
    yield patches.FancyArrowPatch, add_arrow
    yield patches.Patch, add_patch
    yield image.AxesImage, add_image


def _figure_title() -> Element:
    return {
        "xref": "paper",
        "yref": "paper",
        "text": "",
        "showarrow": False,
        "x": 0.5,
        "y": 1.0,
        "xanchor": "center",
        "yanchor": "top",
        "xshift": 0,
    }


def _panel_title(panel: FigurePanel) -> Element:
    # above what else is on top of the panel, as in the picture
    root: Any = panel.axes.get_figure(root=True)
    gap = panel.axes.title.get_window_extent().y0 - panel.axes.bbox.y1
    shift = max(2.0, round(PIXELS_PER_INCH / root.dpi * float(gap), 1))
    return {
        "xref": f"{panel.x} domain",
        "yref": f"{panel.y} domain",
        "text": "",
        "x": 0.5,
        "y": 1.0,
        "xanchor": "center",
        "yanchor": "bottom",
        "showarrow": False,
        "font": {"size": 12.5},
        "yshift": shift,
    }


def _bar_trace(panel: FigurePanel, number: int) -> Element:
    """A trace without points that a colour bar can belong to."""
    axis = f"coloraxis{number if number > 1 else ''}"
    return {
        "type": "scatter",
        "x": [None],
        "y": [None],
        "mode": "markers",
        "xaxis": panel.x,
        "yaxis": panel.y,
        "showlegend": False,
        "hoverinfo": "skip",
        "marker": {"color": [0.0], "coloraxis": axis},
    }


def _layout(picture: Picture, elements: Elements) -> Element:
    """What is the same on wide and on narrow screens."""
    layout: Element = {
        "shapes": elements.shapes,
        "annotations": elements.annotations,
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "hovermode": "closest",
        "font": {"family": FONT, "size": 12, "color": INK},
        "autosize": True,
        "template": None,
        "dragmode": "zoom",
        "uirevision": "fegear",
        "hoverlabel": {"align": "left", "namelength": -1},
    }
    for panel in picture.panels:
        layout |= axis_pair(panel, picture.panels)
    layout |= secondary_axes(elements.traces, picture.panels)
    for number, (bar, _) in enumerate(picture.bars, 1):
        layout[f"coloraxis{number if number > 1 else ''}"] = color_axis(bar)
    for shown in picture.legends:
        layout[shown.name] = _legend_style(shown)
    return layout


def _legend_style(shown: Any) -> Element:
    from fegear.figures.interactive.texts import markup

    is_framed = shown.panel is not None and shown.legend.get_frame_on()
    style: Element = {
        "bgcolor": "rgba(255,255,255,0.8)",
        "itemsizing": "trace",
        "borderwidth": 1 if is_framed else 0,
        "bordercolor": "#cccccc",
        "tracegroupgap": 0,
        "itemdoubleclick": "toggleothers",
    }
    face = shown.legend.get_frame().get_facecolor()
    if tuple(face[:3]) != (1.0, 1.0, 1.0) and shown.legend.get_frame_on():
        from fegear.figures.interactive.styles import css

        style["bgcolor"] = css(face)
    title = shown.legend.get_title().get_text()
    if title:
        style["title"] = {"text": markup(title)}
    return style
