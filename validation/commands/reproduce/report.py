"""The page of remade figures: index.html, report.json, pictures and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fegear.files.output import make_directory, strict_json, write_text
from lumped.common.csv_text import format_records
from lumped.common.progress import Progress, silent
from validation.commands.reproduce.comparison import (
    ReferenceCheck,
    count_lines,
    overview,
)
from validation.commands.reproduce.drawing import column_names, draw_figure
from validation.commands.reproduce.runs import FigureResult, PartRun, curves_csv
from validation.pages import SavedFigure, filled, save_figure
from validation.study.provenance import provenance


def report_values(
    results: Sequence[FigureResult],
    output: Path,
    commands: Mapping[str, str],
    failed: Mapping[str, str],
    quick: bool = False,
) -> dict[str, Any]:
    """All of a report as plain values; paths are relative to the output.

    commands : by the number of a figure what makes it again, by "" what makes all
    failed : why a figure is missing, by its number
    quick : whether its parts have few points
    """
    machines = {run.machine: None for result in results for run in result.runs}
    return {
        "command": commands[""],
        "quick": quick,
        "about": {**dict(provenance()), "computed on": "; ".join(machines)},
        "counts": count_lines(check for result in results for check in result.compared),
        "figures": [
            figure_values(result, output) | {"command": commands[result.figure.number]}
            for result in results
        ],
        "failed": [{"number": n, "reason": reason} for n, reason in failed.items()],
    }


def figure_values(result: FigureResult, output: Path) -> dict[str, Any]:
    figure, compared = result.figure, result.compared
    return {
        "number": figure.number,
        "title": figure.title,
        "caption": figure.caption,
        "notes": figure.notes,
        "missing": figure.missing,
        "seconds": result.seconds,
        "csv": f"tables/{figure.number}.csv",
        **overview(compared),
        "printed": [_compared_values(check) for check in compared],
        "parts": [_part_values(run, output) for run in result.runs],
    }


def _compared_values(compared: ReferenceCheck) -> dict[str, Any]:
    reference = compared.reference
    return {
        "quantity": reference.quantity,
        "unit": reference.unit,
        "origin": reference.origin,
        "where": reference.where,
        "bound": reference.bound,
        "reference": compared.value,
        "computed": compared.computed,
        "difference": compared.difference,
        "scale": compared.scale,
        "error_percent": 100.0 * compared.relative_error,
        "verdict": compared.verdict,
        "reason": reference.reason,
        "line": compared.line,
    }


def _part_values(run: PartRun, output: Path) -> dict[str, Any]:
    return {
        "part": run.part.own_name,
        "label": run.part.label,
        "seconds": run.seconds,
        "reused": run.reused,
        "commands": list(run.commands),
        "no_command": run.no_command,
        "directory": run.directory.relative_to(output).as_posix(),
        "found": {name: list(values) for name, values in run.result.values.items()},
    }


def write_report(
    values: Mapping[str, Any],
    results: Sequence[FigureResult],
    output: Path,
    report: Progress = silent,
) -> Path:
    """Write pictures, tables, report.json and index.html; the path of the last.

    Raises InputError where a file cannot be written.
    """
    tables = make_directory(output / "tables")
    drawn = {}
    for place, result in enumerate(results):
        number = result.figure.number
        report(f"picture of {number}", place, len(results))
        columns = column_names(result)
        write_text(tables / f"{number}.csv", curves_csv(result.curves, columns))
        drawn[number] = _saved(result, output, values["figures"][place]["command"])
    rows = [
        {"figure": _in_words(figure["number"])}
        | {key: _cell(value) for key, value in row.items() if key != "line"}
        for figure in values["figures"]
        for row in figure["printed"]
    ]
    write_text(tables / "printed.csv", format_records(rows))
    write_text(output / "report.json", strict_json(values))
    text = filled("reproduce.html", **values, drawn=drawn)
    write_text(output / "index.html", text)
    return output / "index.html"


def _in_words(number: str) -> str:
    """`figure 4.10`, which no spreadsheet takes for 4.1."""
    table = number.removeprefix("table-")
    return f"figure {number}" if table == number else f"table {table}"


def _cell(value: Any) -> Any:
    """Coordinates of a point in one cell."""
    return " ".join(map(str, value)) if isinstance(value, tuple) else value


def _saved(result: FigureResult, output: Path, command: str) -> SavedFigure:
    number = result.figure.number
    name = number if number.startswith("table") else f"figure-{number}"
    return save_figure(
        draw_figure(result),
        output,
        name.replace(".", "-"),
        result.figure.title,
        command,
        ((number, f"tables/{number}.csv"),),
    )
