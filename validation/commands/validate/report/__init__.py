"""The report of validation cases: values, figures, and the files that show them."""

from validation.commands.validate.report.files import is_quick_report, write_report
from validation.commands.validate.report.values import QUICK, report_values

__all__ = ["QUICK", "is_quick_report", "report_values", "write_report"]
