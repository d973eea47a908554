"""Layout of a narrow screen: panels below each other, each with its legend."""

from __future__ import annotations

from collections.abc import Iterator

from fegear.figures.interactive.axis import twin_host
from fegear.figures.interactive.coordinates import FigurePanel
from fegear.figures.interactive.elements import Element
from fegear.figures.interactive.layout import (
    ENTRY_LINE,
    GAP,
    LABEL_LINE,
    LETTER,
    TITLE_LETTER,
    PanelMargins,
    Picture,
    box_of,
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

WIDTH = 390.0  # pixels, of the page
MIN_HEIGHT, MAX_HEIGHT = 150.0, 320.0  # pixels, of a panel
MAX_EQUAL_HEIGHT = 420.0  # pixels, of one whose axes have equal units
TEXT_LINE = 15.0  # pixels, of a named tick
BAR_HEIGHT = 66.0  # pixels, of a horizontal colour bar with its numbers and label
LEGEND_FONT = 11.0  # pixels


def narrow_layout(picture: Picture, frames: dict[FigurePanel, PanelMargins]) -> Element:
    """What a layout has on a narrow screen, by paths of its attributes."""
    stack = _PanelStack(picture, frames)
    stack.put_all()
    return rounded(stack.layout)


class _PanelStack:
    """Parts below each other; down : pixels from the top of the figure."""

    def __init__(
        self, picture: Picture, frames: dict[FigurePanel, PanelMargins]
    ) -> None:
        self.picture, self.frames = picture, frames
        self.layout: Element = {}
        self.title, height = title_text(picture.title, "narrow", WIDTH - 2.0 * GAP)
        self.down = GAP + height
        self.heights = dict.fromkeys(picture.panels, 0.0)
        self.spans: dict[FigurePanel, tuple[float, float]] = {}
        self.below: list[tuple[str, float]] = []  # of keys of y, from the top

        hosts = picture.hosts
        self.left = max(self._left_margin(panel) for panel in hosts)
        self.right = max(
            GAP, *(self._margins_with_twins(panel).right for panel in hosts)
        )
        self.width = WIDTH - self.left - self.right

    def put_all(self) -> None:
        for panel in _sort_by_column(self.picture.hosts):
            self._put_panel(panel)
            self._put_bars(panel)
            self._put_legends(panel)
        self._put_legends(None)
        self._convert_to_fractions()

    def _margins_with_twins(self, panel: FigurePanel) -> PanelMargins:
        """Room around a panel and its twins."""
        panel_and_twins = [panel, *self._twins(panel)]
        return PanelMargins(
            *map(max, zip(*(self.frames[p] for p in panel_and_twins), strict=True))
        )

    def _twins(self, panel: FigurePanel) -> list[FigurePanel]:
        panels = self.picture.panels
        return [other for other in panels if twin_host(other, panels) is panel]

    def _left_margin(self, panel: FigurePanel) -> float:
        """Room for numbers and label, which may have more lines than in the picture."""
        n_lines = line_count(self._wrapped_y_label(panel))
        extra_lines = n_lines - line_count(markup(panel.axes.get_ylabel()))
        return self._margins_with_twins(panel).left + LABEL_LINE * max(0, extra_lines)

    def _wrapped_y_label(self, panel: FigurePanel) -> str:
        return wrapped(
            panel.axes.get_ylabel(),
            int(1.1 * self._panel_height(panel, 300.0) / LETTER),
        )

    def _panel_height(self, panel: FigurePanel, width: float) -> float:
        """Height of a panel; more where each tick has a name."""
        axes, pixels_per_inch = panel.axes, PIXELS_PER_INCH
        if axes.get_aspect() != "auto":
            (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
            ratio = float(axes.get_aspect()) * abs((high - low) / (right - left))
            return min(width * ratio, MAX_EQUAL_HEIGHT)
        figure_size = self.picture.figure.get_size_inches()
        x0, y0, x1, y1 = box_of(axes)
        drawn_height = pixels_per_inch * figure_size[1] * (y1 - y0)
        ratio = drawn_height / (pixels_per_inch * figure_size[0] * (x1 - x0))
        height = min(max(width * ratio, 0.8 * drawn_height, MIN_HEIGHT), MAX_HEIGHT)
        return max(height, TEXT_LINE * _count_named_ticks(panel))

    def _put_panel(self, panel: FigurePanel) -> None:
        frame, ending = self._margins_with_twins(panel), panel.ending
        letters = int(self.width / LETTER)
        x_label = wrapped(panel.axes.get_xlabel(), letters)
        extra_lines = line_count(x_label) - line_count(markup(panel.axes.get_xlabel()))
        self.down += frame.top + self._put_title(panel)
        height = self._panel_height(panel, self.width)
        self.spans[panel] = self.down, self.down + height
        for twin in (panel, *self._twins(panel)):
            self.spans[twin] = self.spans[panel]
            y_label = wrapped(twin.axes.get_ylabel(), int(1.1 * height / LETTER))
            self.layout[f"yaxis{twin.ending}.title.text"] = y_label
        self.layout[f"xaxis{ending}.title.text"] = x_label
        self.down += height + frame.bottom + LABEL_LINE * max(0, extra_lines) + GAP

    def _put_title(self, panel: FigurePanel) -> float:
        """Set the title of a panel; pixels that it takes more than in the picture."""
        for number, titled_panel, text in panel_titles(self.picture):
            if titled_panel is panel:
                wrapped_title = wrapped(
                    text, int((self.width + 0.3 * self.left) / TITLE_LETTER)
                )
                self.layout[f"annotations[{number}].text"] = wrapped_title
                return LABEL_LINE * max(
                    0, line_count(wrapped_title) - line_count(markup(text))
                )
        return 0.0

    def _put_bars(self, panel: FigurePanel) -> None:
        for number, (_, owner) in enumerate(self.picture.bars, 1):
            if owner is panel:
                key = f"coloraxis{number if number > 1 else ''}.colorbar"
                self.layout |= {
                    f"{key}.orientation": "h",
                    f"{key}.x": 0.5,
                    f"{key}.len": 1.0,
                    f"{key}.xanchor": "center",
                    f"{key}.yanchor": "top",
                    f"{key}.yref": "paper",
                    f"{key}.title.side": "bottom",
                }
                self.below.append((f"{key}.y", self.down))
                self.down += BAR_HEIGHT

    def _put_legends(self, panel: FigurePanel | None) -> None:
        for legend in self.picture.legends:
            if legend.panel is panel:
                self._put_legend(legend)

    def _put_legend(self, legend: ShownLegend) -> None:
        name = legend.name
        self.layout |= {
            f"{name}.orientation": "h",
            f"{name}.xref": "paper",
            f"{name}.yref": "paper",
            f"{name}.x": 0.5,
            f"{name}.xanchor": "center",
            f"{name}.yanchor": "top",
            f"{name}.font.size": LEGEND_FONT,
            f"{name}.maxheight": 1.0,
        }
        self.below.append((f"{name}.y", self.down))
        rows = legend_rows(legend.labels, self.width)
        breaks = max((label.count("\n") for label in legend.labels), default=0)
        self.down += ENTRY_LINE * rows * (1.0 + 0.75 * breaks) + 2.0 * GAP

    def _convert_to_fractions(self) -> None:
        """Pixels from the top become parts of the panels' height."""
        top = min(start for start, _ in self.spans.values())
        bottom = max(end for _, end in self.spans.values())
        for panel in self.picture.panels:
            start, end = self.spans.get(panel) or self._inset_span(panel)
            domain = [
                (bottom - end) / (bottom - top),
                (bottom - start) / (bottom - top),
            ]
            self.layout[f"yaxis{panel.ending}.domain"] = domain
            self.layout[f"xaxis{panel.ending}.domain"] = [0.0, 1.0]
        self.layout |= title_of_figure(self.picture, self.title, "narrow", top)
        if self.picture.title:  # to the middle of the page
            self.layout["annotations[0].xshift"] = 0.5 * (self.right - self.left)
        span = bottom - top
        self.layout |= {key: (bottom - down) / span for key, down in self.below}
        self.layout |= {
            "margin.l": self.left,
            "margin.r": self.right,
            "margin.t": top,
            "margin.b": self.down - bottom,
            "height": round(self.down),
        }

    def _inset_span(self, panel: FigurePanel) -> tuple[float, float]:
        raise TypeError("no interactive form of a panel in a panel")


def _count_named_ticks(panel: FigurePanel) -> int:
    """Number of names at the ticks of the ordinate; 0 where they are numbers."""
    from matplotlib.ticker import FixedFormatter

    axis = panel.axes.yaxis
    is_named = isinstance(axis.get_major_formatter(), FixedFormatter)
    return len(axis.get_majorticklocs()) if is_named else 0


def _sort_by_column(panels: list[FigurePanel]) -> Iterator[FigurePanel]:
    """Panels of a column one after the other, as numbers are on the lowest."""
    yield from sorted(
        panels, key=lambda p: (round(box_of(p.axes)[0], 2), -box_of(p.axes)[1])
    )
