"""Figures that a reader zooms into, by plotly, from figures of matplotlib."""

from fegear.figures.interactive.convert import to_plotly
from fegear.figures.interactive.html import interactive_page, interactive_part
from fegear.figures.interactive.source import notebook_part, set_plotly_source

__all__ = [
    "interactive_page",
    "interactive_part",
    "notebook_part",
    "set_plotly_source",
    "to_plotly",
]
