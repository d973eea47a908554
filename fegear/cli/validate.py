"""fegear validate: lumped models against finite elements, case by case."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import grouped
from fegear.cli.options import AsJson, Workers, progress_bar, require_outputs
from fegear.cli.screen import print_json, ruled_table, say, screen

if TYPE_CHECKING:
    from fegear.statics import Progress
    from lumped.workers import Cluster
    from validation.cases import Case
    from validation.runs import CaseResult

EXAMPLE = "fegear validate idler friction-pair -o report"
WRITTEN = ("index.html", "report.md", "report.json")
MOST_LINES = 40  # of verdicts outside on the screen


class ValidationFidelity(StrEnum):
    reduced = "reduced"
    full = "full"
    quasistatic = "quasistatic"


@grouped
def validate_command(
    *,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Directory for the report: index.html, report.md and report.json, "
            "figures, tables, and runs, which are found again by the next call. ",
        ),
    ],
    cases: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="CASE",
            help="Names of built-in cases, or paths of case files (TOML).",
        ),
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="Run all built-in cases.")
    ] = False,
    fidelity: Annotated[
        ValidationFidelity | None,
        typer.Option(
            "--fidelity",
            help="Model of the finite elements, as in `fegear dynamics`. [default: "
            "that of each case]",
        ),
    ] = None,
    workers: Workers,
    as_json: AsJson = False,
) -> None:
    """Lumped models against finite elements, with tolerances.

    The exit code is 1 if a tolerance fails. The same command goes on with an
    interrupted run, on a cluster with the runs that it had not finished.
    """
    from fegear.output import make_directory
    from validation.report import report_values, write_report

    chosen = _chosen(cases or [], every, fidelity)
    store = make_directory(make_directory(output) / "runs")
    require_outputs([output / name for name in WRITTEN])
    commands = _commands(chosen, cases, fidelity, output)
    with progress_bar(enabled=not as_json) as report:
        results = _run(chosen, store, workers.chosen, report)
        values = report_values(results, output, commands)
        write_report(values, results, output, report)
    if as_json:
        print_json(values)
    else:
        print_results(values["cases"], output)
    if len(results) < len(chosen):
        raise KeyboardInterrupt
    if any(not each.within for result in results for each in result.verdicts):
        raise typer.Exit(1)


def _chosen(
    names: Sequence[str], every: bool, fidelity: ValidationFidelity | None
) -> list[Case]:
    from fegear.errors import InputError
    from validation.cases import case_names, load_case

    known = ", ".join(case_names())
    if every and names:
        raise InputError(f"--all and {names[0]} exclude each other")
    if not (every or names):
        raise InputError(f"a case or --all is missing; allowed are {known}")
    chosen = [load_case(name) for name in (case_names() if every else names)]
    taken = [case.name for case in chosen]
    for name in taken:
        if taken.count(name) > 1:
            raise InputError(f"case {name} is given {taken.count(name)} times")
    if fidelity is None:
        return chosen
    return [replace(case, fidelity=fidelity.value) for case in chosen]


def _commands(
    chosen: Sequence[Case],
    names: Sequence[str] | None,
    fidelity: ValidationFidelity | None,
    output: Path,
) -> dict[str, str]:
    """What one types to make a case again, by its name, and all of it by ""."""
    options = [] if fidelity is None else ["--fidelity", fidelity.value]

    def command(*words: str) -> str:
        return shlex.join(["fegear", "validate", *words, *options, "-o", str(output)])

    given = names or [case.name for case in chosen]
    each = {c.name: command(name) for c, name in zip(chosen, given, strict=True)}
    return each | {"": command(*(names or ["--all"]))}


def _run(
    chosen: Sequence[Case], store: Path, workers: Cluster | None, report: Progress
) -> list[CaseResult]:
    """Results of the cases, after Ctrl-C of those that were finished."""
    from validation.runs import make_runs, run_case
    from validation.tasks import tasks_of

    def of(case: Case) -> Progress:
        return lambda what, done, total: report(f"{case.name}: {what}", done, total)

    for case in chosen:
        list(tasks_of(case))  # a gear set that cannot be used is told at once
    if workers is not None:
        make_runs(chosen, store, workers, report)
    results: list[CaseResult] = []
    try:
        for case in chosen:
            results.append(run_case(case, store, of(case)))
    except KeyboardInterrupt:
        if not results:
            raise
    return results


def print_results(cases: Sequence[Mapping[str, Any]], output: Path) -> None:
    """Case by model, and a line for every verdict that is outside if they are few."""
    console = screen()
    console.print(_overview(cases))
    lines = [
        failed_line(case["case"], each)
        for case in cases
        for each in case["verdicts"]
        if not each["within"]
    ]
    if len(lines) > MOST_LINES:
        say(f"{len(lines)} outside, see {output / 'tables' / 'verdicts.csv'}")
    else:  # not by the console, which would break the lines
        say("\n".join(["Outside", *lines] if lines else ["All are within."]))
    say(f"wrote {', '.join(str(output / name) for name in WRITTEN)}")


def _overview(cases: Sequence[Mapping[str, Any]]) -> Any:
    columns = ("case", "model", "within", "outside", "cost of FE\nover model")
    table = ruled_table(*columns, title="Verdicts", words=columns[:2])
    for case in cases:
        for model in case["models"]:
            table.add_row(
                *(case["case"], model["model"]),
                *(str(model["within"]), str(model["outside"])),
                "" if isnan(model["cost_ratio"]) else f"{model['cost_ratio']:.0f}",
            )
    return table


def failed_line(case: str, failed: Mapping[str, Any]) -> str:
    """`idler, model-2, 100 N m, up, mesh 1: rms_distance 0.61, allowed 0.5`."""
    from validation.metrics import METRICS

    least = "at least " if METRICS[failed["metric"]].least else ""
    unit = "" if failed["unit"] == "1" else f" {failed['unit']}"
    return (
        f"  {case}, {failed['model']}, {failed['where']}: {failed['metric']} "
        f"{failed['measured']:.3g}{unit}, allowed {least}{failed['allowed']:g}{unit}"
    )
