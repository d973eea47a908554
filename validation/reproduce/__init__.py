"""Figures and tables of the sources, remade and compared with what is printed."""

from validation.reproduce.report import report_values, write_report
from validation.reproduce.runs import FigureResult, find_figure, run_figure
from validation.reproduce.source_figures import (
    figure_numbers,
    load_figure,
    omitted_figures,
)

__all__ = [
    "FigureResult",
    "figure_numbers",
    "find_figure",
    "load_figure",
    "omitted_figures",
    "report_values",
    "run_figure",
    "write_report",
]
