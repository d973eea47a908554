"""The page of remade figures: index.html, report.json, pictures and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fegear.output import make_directory, strict_json, write_text
from fegear.statics import Progress
from lumped.csv_text import format_records
from validation.pages import SavedFigure, filled, save_figure
from validation.provenance import provenance
from validation.reproduce.drawing import draw_figure
from validation.reproduce.runs import Compared, FigureResult, PartRun, curves_csv


def report_values(
    results: Sequence[FigureResult], output: Path, commands: Mapping[str, str]
) -> dict[str, Any]:
    """All of a report as plain values; paths are relative to the output.

    commands : by the number of a figure what makes it again, by "" what makes all
    """
    machines = {run.machine: None for each in results for run in each.runs}
    return {
        "command": commands[""],
        "about": {**dict(provenance()), "computed on": "; ".join(machines)},
        "figures": [
            _figure_values(each, output) | {"command": commands[each.figure.number]}
            for each in results
        ],
    }


def _figure_values(result: FigureResult, output: Path) -> dict[str, Any]:
    figure = result.figure
    return {
        "number": figure.number,
        "title": figure.title,
        "says": figure.says,
        "notes": figure.notes,
        "seconds": result.seconds,
        "csv": f"tables/{figure.number}.csv",
        "printed": [_compared_values(each) for each in result.compared],
        "parts": [_part_values(run, output) for run in result.runs],
    }


def _compared_values(compared: Compared) -> dict[str, Any]:
    given = compared.printed
    return {
        "quantity": given.quantity,
        "unit": given.unit,
        "where": given.where,
        "printed": given.value,
        "computed": compared.computed,
        "apart_percent": 100.0 * abs(compared.apart),
        "why": given.why,
        "line": compared.line,
    }


def _part_values(run: PartRun, output: Path) -> dict[str, Any]:
    return {
        "part": run.part.own_name,
        "label": run.part.label,
        "seconds": run.seconds,
        "reused": run.reused,
        "commands": list(run.commands),
        "directory": run.directory.relative_to(output).as_posix(),
        "found": {name: list(values) for name, values in run.result.found.items()},
    }


def write_report(
    values: Mapping[str, Any],
    results: Sequence[FigureResult],
    output: Path,
    report: Progress = lambda what, done, total: None,
) -> Path:
    """Write pictures, tables, report.json and index.html; the path of the last.

    Raises InputError where a file cannot be written.
    """
    tables = make_directory(output / "tables")
    drawn = {}
    for place, result in enumerate(results):
        number = result.figure.number
        report(f"picture of {number}", place, len(results))
        write_text(tables / f"{number}.csv", curves_csv(result.curves))
        drawn[number] = _saved(result, output, values["figures"][place]["command"])
    rows = [
        {"figure": figure["number"]} | {k: v for k, v in row.items() if k != "line"}
        for figure in values["figures"]
        for row in figure["printed"]
    ]
    write_text(tables / "printed.csv", format_records(rows))
    write_text(output / "report.json", strict_json(values))
    text = filled("reproduce.html", **values, drawn=drawn)
    write_text(output / "index.html", text)
    return output / "index.html"


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
