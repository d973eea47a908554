"""Figures that a reader zooms into, by plotly, from figures of matplotlib."""

from fegear.figures.interactive.convert import require_plotly, to_plotly
from fegear.figures.interactive.page import interactive_page, interactive_part

__all__ = ["interactive_page", "interactive_part", "require_plotly", "to_plotly"]
