"""Figures and tables of the sources, remade and compared with what is printed."""

from validation.reproduce.report import report_values, write_report
from validation.reproduce.runs import FigureResult, find_figure, run_figure
from validation.reproduce.source_figures import (
    figure_numbers,
    left_out_figures,
    load_figure,
)

__all__ = [
    "FigureResult",
    "figure_numbers",
    "find_figure",
    "left_out_figures",
    "load_figure",
    "report_values",
    "run_figure",
    "write_report",
]
