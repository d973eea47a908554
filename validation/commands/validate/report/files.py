"""The files of a report: index.html, report.md, report.json, figures and tables."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fegear.files.output import make_directory, read_text, strict_json, write_text
from lumped.common.csv_text import format_records
from lumped.common.progress import Progress, silent
from validation.commands.validate.report import figures
from validation.commands.validate.report.tables import report_tables
from validation.commands.validate.report.totals import SUMMARY, totals_of
from validation.pages import SavedFigure, filled, save_figure
from validation.study.budget import budget_of
from validation.study.budget_figure import draw_budget
from validation.study.runs import CaseResult
from validation.study.tasks import FE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN: Mapping[figures.Column, str] = {
    "dte_rms": "vibration over speed; dots: where jumps land",
    "force_peak": "largest mesh force over speed",
    "contact_loss": "loss of contact over speed",
}


def write_report(
    values: Mapping[str, Any],
    results: Sequence[CaseResult],
    output: Path,
    report: Progress = silent,
) -> Path:
    """Write everything, report.json last; the path of index.html.

    Raises InputError where a file cannot be written.
    """
    drawn = {}
    for i, result in enumerate(results):
        report(f"figures of {result.case.name}", i, len(results))
        command = values["cases"][i]["command"]
        drawn[result.case.name] = list(_saved(result, output, command))
    cost = list(_cost_figure(results, output, values["command"]))
    tables = make_directory(output / "tables")
    for name, rows in report_tables(values).items():
        write_text(tables / f"{name}.csv", format_records(rows))
    shown = {**values, "figures": drawn, "cost_figure": cost, "fe": FE}
    write_text(output / "report.md", filled("report.md", **shown))
    write_text(output / "index.html", filled("report.html", **shown))
    if not values["quick"]:
        write_text(output / SUMMARY, strict_json(totals_of(values)))
    write_text(output / "report.json", strict_json(values))
    return output / "index.html"


def is_quick_report(path: Path) -> bool:
    """Whether a report.json is one of quick runs."""
    try:
        return bool(json.loads(read_text(path)).get("quick"))
    except (ValueError, AttributeError):  # no report
        return False


class Drawn(NamedTuple):
    """A figure of a case, before it is saved.

    torque_Nm : of the runs that it shows, None for all
    file : of every run that it is drawn from, else a table of the report
    """

    name: str
    caption: str
    figure: Figure
    torque_Nm: float | None = None
    file: str = "tables/verdicts.csv"


def _cost_figure(
    results: Sequence[CaseResult], output: Path, command: str
) -> Iterator[SavedFigure]:
    drawn = figures.draw_cost(results)
    if drawn is None:
        return
    caption = (
        "run time of a speed against distance from the finite elements, "
        "a mark for each case"
    )
    data = (("costs", "tables/costs.csv"), ("verdicts", "tables/verdicts.csv"))
    yield save_figure(drawn, output, "cost", caption, command, data)


def _saved(result: CaseResult, output: Path, command: str) -> Iterator[SavedFigure]:
    for drawn in _draw_figures(result):
        runs = [run for run in result.judged if drawn.torque_Nm in (None, run.torque)]
        data = tuple(
            (run.source, (run.directory / drawn.file).relative_to(output).as_posix())
            for run in runs
        )
        yield save_figure(
            drawn.figure,
            output,
            f"{result.case.name}-{drawn.name}",
            drawn.caption,
            command,
            ((Path(drawn.file).stem, drawn.file),) if "/" in drawn.file else data,
        )


def _draw_figures(result: CaseResult) -> Iterator[Drawn]:
    caption = "verdicts, a mark for each torque, mesh and direction"
    yield Drawn("verdicts", caption, figures.draw_verdicts(result))
    budget = budget_of(result)
    if budget is not None:
        figure = draw_budget(budget)
        caption = "error budget: differences of the models from the finite elements"
        yield Drawn("budget", caption, figure, file="tables/budget.csv")
    for torque in result.case.torques_Nm:
        yield from _drawn_at(result, torque)


def _drawn_at(result: CaseResult, torque: float) -> Iterator[Drawn]:
    case, at, end = result.case, f"{torque:g} N m", f"{torque:g}Nm"
    for column, quantity_label in SHOWN.items() if case.speeds else ():
        figure = figures.draw_over_speed(result, torque, column)
        name = f"{column.replace('_', '-')}-{end}"
        yield Drawn(name, f"{at}: {quantity_label}", figure, torque, "sweep.csv")
    labels = [wave.label for wave in case.single_speed if wave.torque_Nm == torque]
    for i, label in enumerate(labels, 1):
        figure = figures.draw_force_cycle(result, torque, label)
        name, caption = f"wave{i}-{end}", f"{at}: mesh forces at {label}"
        yield Drawn(name, caption, figure, torque, "waves.csv")
    figure = figures.draw_statics(result, torque)
    yield Drawn(f"statics-{end}", f"{at}: statics", figure, torque, "statics.csv")
