"""The report of validation cases: values, figures, and the files that show them."""

from validation.report.files import write_report
from validation.report.values import report_values

__all__ = ["report_values", "write_report"]
