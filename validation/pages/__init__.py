"""Pages that open anywhere: one file with its figures, tables and style inside."""

from validation.pages.figures import SavedFigure, save_figure
from validation.pages.templates import filled

__all__ = ["SavedFigure", "filled", "save_figure"]
