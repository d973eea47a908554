"""Where panels, legends and titles are: as in the picture, or below each other.

Both are in the figure: `layout.meta` has what differs, which the page applies by its
width.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fegear.figures.interactive.axis import twin_host
from fegear.figures.interactive.coordinates import FigurePanel
from fegear.figures.interactive.elements import Element
from fegear.figures.interactive.legends import ShownLegend
from fegear.figures.interactive.styles import PIXELS_PER_INCH
from fegear.figures.interactive.texts import line_count, markup

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import Figure

BREAKPOINT = 720.0  # pixels, width below which panels are below each other
MIN_SCALE = 0.6  # of the gaps between columns, which shrink with the width
ENTRY_LINE, LABEL_LINE = 20.0, 15.0  # pixels, height of a line
TITLE_SIZE = {"wide": 15, "narrow": 13}  # pixels
TITLE_LETTER = 7.0  # pixels, of a letter of the title of a panel
GAP = 10.0  # pixels between parts
LETTER, KEY_WIDTH = 6.2, 46.0  # pixels, of a letter of an entry, of its sample and gaps
FRAME_INCHES = 0.95 * PIXELS_PER_INCH  # pixels for an inch of ticks and labels


class PanelMargins(NamedTuple):
    """Pixels that ticks, labels and texts take around a panel."""

    left: float
    right: float
    top: float
    bottom: float


@dataclass(frozen=True)
class Picture:
    """What is laid out: panels, colour bars with the panel of each, and legends."""

    figure: Figure
    panels: Sequence[FigurePanel]
    bars: Sequence[tuple[Colorbar, FigurePanel]]
    legends: Sequence[ShownLegend]

    @property
    def title(self) -> str:
        return self.figure.get_suptitle()

    @property
    def hosts(self) -> list[FigurePanel]:
        """Panels with a frame of their own."""
        return [panel for panel in self.panels if twin_host(panel, self.panels) is None]


def breakpoint_of(picture: Picture) -> int:
    """Width of the page [pixels] below which panels are below each other."""
    columns = {round(box_of(panel.axes)[0], 2) for panel in picture.hosts}
    if len(columns) == 1:
        return round(BREAKPOINT)
    width = PIXELS_PER_INCH * picture.figure.get_figwidth()
    return round(max(BREAKPOINT, MIN_SCALE * width))


def measure_frames(
    figure: Figure, panels: Sequence[FigurePanel]
) -> dict[FigurePanel, PanelMargins]:
    """Frames of panels without legends; the figure is drawn for its positions."""
    from matplotlib.legend import Legend

    legends = [artist for artist in figure.findobj(Legend) if artist.get_in_layout()]
    figure.draw_without_rendering()
    for legend in legends:
        legend.set_in_layout(False)
    frames = {panel: _frame(panel.axes) for panel in panels}
    for legend in legends:
        legend.set_in_layout(True)
    return frames


def _frame(axes: Axes) -> PanelMargins:
    root: Any = axes.get_figure(root=True)
    inner, outer = axes.bbox, axes.get_tightbbox(for_layout_only=True)
    if outer is None:
        return PanelMargins(0.0, 0.0, 0.0, 0.0)
    inches = (
        *(inner.x0 - outer.x0, outer.x1 - inner.x1),
        *(outer.y1 - inner.y1, inner.y0 - outer.y0),
    )
    return PanelMargins(*(max(0.0, FRAME_INCHES * float(v) / root.dpi) for v in inches))


def box_of(axes: Axes) -> tuple[float, float, float, float]:
    """Left, low, right and high edge in parts of the figure, before aspects."""
    box = axes.get_position(original=axes.get_axes_locator() is None)
    return float(box.x0), float(box.y0), float(box.x1), float(box.y1)


def legend_rows(labels: Sequence[str], width: float) -> int:
    """Rows of a horizontal legend in a width [pixels]."""
    rows, filled = 1, 0.0
    for label in labels:
        entry = KEY_WIDTH + LETTER * max(map(len, label.split("\n")))
        if filled and filled + entry > width:
            rows, filled = rows + 1, 0.0
        filled += entry
    return rows


def title_text(text: str, kind: str, width: float) -> tuple[str, float]:
    """Title of the figure in lines for a width [pixels], and their height [pixels]."""
    marked = markup(text, int(width / (0.53 * TITLE_SIZE[kind])))
    lines = line_count(marked)
    return marked, 1.3 * TITLE_SIZE[kind] * lines + (1.5 * GAP if lines else 0.0)


def title_of_figure(picture: Picture, marked: str, kind: str, top: float) -> Element:
    """The title as the first annotation; top : pixels from it to the panels."""
    if not picture.title:
        return {}
    style = {"text": marked, "font.size": TITLE_SIZE[kind], "yshift": top - GAP}
    return {f"annotations[0].{key}": value for key, value in style.items()}


def panel_titles(picture: Picture) -> Iterator[tuple[int, FigurePanel, str]]:
    """Number among the annotations, panel and text of every title of a panel."""
    titled = [panel for panel in picture.panels if panel.axes.get_title()]
    for number, panel in enumerate(titled, 1 if picture.title else 0):
        yield number, panel, panel.axes.get_title()


def wrapped(text: str, letters: int) -> str:
    """A label in lines of a number of letters, unless its own are shorter."""
    lines = text.split("\n")
    if max(map(len, lines)) <= letters:
        return markup(text)
    return markup("\n".join(wrap(" ".join(lines), letters)))


def rounded(layout: Element) -> Element:
    """Lengths to a part of a pixel."""
    return {key: _rounded(value) for key, value in layout.items()}


def _rounded(value: Any) -> Any:
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    return round(float(value), 5) if isinstance(value, float | np.floating) else value
