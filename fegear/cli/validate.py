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
from fegear.cli.options import (
    AsJson,
    Workers,
    progress_bar,
    refuse_idle,
    require_outputs,
)
from fegear.cli.screen import print_json, ruled_table, say, screen

if TYPE_CHECKING:
    from lumped.common.progress import Progress
    from lumped.common.workers import Cluster
    from validation.random_sets.runs import SetRun
    from validation.study.cases import Case
    from validation.study.runs import CaseResult

EXAMPLE = "fegear validate idler friction-pair -o report"
WRITTEN = ("index.html", "report.md", "report.json")
RANDOM_SETS = "random-sets"  # beside the names of cases
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
            help="Names of built-in cases, or paths of case files (TOML); random-sets "
            "for the coupled model on 30 random gear sets.",
        ),
    ] = None,
    every: Annotated[
        bool,
        typer.Option("--all", help="Run all built-in cases and the random gear sets."),
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
    from fegear.files.output import make_directory
    from validation.random_sets.runs import run_random_sets
    from validation.report import report_values, write_report

    names = [name for name in cases or [] if name != RANDOM_SETS]
    random = every or RANDOM_SETS in (cases or [])
    chosen = _chosen(names, every, fidelity, random)
    store = make_directory(make_directory(output) / "runs")
    require_outputs([output / name for name in WRITTEN])
    commands = _commands(chosen, names, cases or ["--all"], fidelity, output)
    with progress_bar(enabled=not as_json) as report:
        results = _run(chosen, store, workers.chosen, report)
        complete = len(results) == len(chosen)
        sets: list[SetRun] = []
        if random and complete:
            sets, complete = run_random_sets(store, report)
        values = report_values(results, output, commands, sets)
        write_report(values, results, output, report)
    if as_json:
        print_json(values)
    else:
        print_results(values["cases"], values["random_sets"], output)
    if not complete:
        raise KeyboardInterrupt
    within = all(each.within for result in results for each in result.verdicts)
    promised = values["random_sets"].get("of"), values["random_sets"].get("kept")
    if not within or promised[0] != promised[1]:
        raise typer.Exit(1)


def _chosen(
    names: Sequence[str], every: bool, fidelity: ValidationFidelity | None, random: bool
) -> list[Case]:
    """Cases by their names; random : whether the random sets run besides."""
    from fegear.files.errors import InputError
    from validation.study.cases import case_names, load_case

    known = ", ".join([*case_names(), RANDOM_SETS])
    if every and names:
        raise InputError(f"--all and {names[0]} exclude each other")
    if not (every or names or random):
        raise InputError(f"a case or --all is missing; allowed are {known}")
    if not (every or names):
        refuse_idle("the random sets have their own", fidelity=fidelity)
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
    names: Sequence[str],
    words: Sequence[str],
    fidelity: ValidationFidelity | None,
    output: Path,
) -> dict[str, str]:
    """Return the command for each case by its name, and for all of them by "".

    names : of the cases as they were given; words : all that was
    """
    options = [] if fidelity is None else ["--fidelity", fidelity.value]

    def command(*words: str) -> str:
        return shlex.join(["fegear", "validate", *words, *options, "-o", str(output)])

    given = names or [case.name for case in chosen]
    each = {c.name: command(name) for c, name in zip(chosen, given, strict=True)}
    random = shlex.join(["fegear", "validate", RANDOM_SETS, "-o", str(output)])
    return each | {RANDOM_SETS: random, "": command(*words)}


def _run(
    chosen: Sequence[Case], store: Path, workers: Cluster | None, report: Progress
) -> list[CaseResult]:
    """Results of the cases, after Ctrl-C of those that were finished."""
    from validation.study.runs import make_runs, run_case
    from validation.study.tasks import tasks_of

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


def print_results(
    cases: Sequence[Mapping[str, Any]], sets: Mapping[str, Any], output: Path
) -> None:
    """Case by model, and a line for every verdict that is outside if they are few.

    sets : the random gear sets, empty without
    """
    console = screen()
    if sets:
        console.print(_random_sets(sets))
        say(f"{sets['kept']} of {sets['of']} random gear sets keep what is promised")
    if cases:
        print_verdicts(cases, output)
    say(f"wrote {', '.join(str(output / name) for name in WRITTEN)}")


def print_verdicts(cases: Sequence[Mapping[str, Any]], output: Path) -> None:
    screen().print(_overview(cases))
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


def _random_sets(sets: Mapping[str, Any]) -> Any:
    columns = (
        *("set", "median\n%", "90 %\n%", "apart", "modes", "bound\n%"),
        *("natural\n%", "ms", "ms of FE", "verdict"),
    )
    table = ruled_table(*columns, title="Random gear sets", words=("set", "verdict"))
    for row in sets["rows"]:
        figures, cells = row["figures"], [""] * (len(columns) - 2)
        if figures:
            cells = [
                *(_per_cent(figures[n]) for n in ("median_error", "tenth_error")),
                *(str(figures[name]) for name in ("apart", "body_modes")),
                *(_per_cent(figures[n]) for n in ("left_out", "natural_error")),
                *(f"{figures[name]:.0f}" for name in ("coupled_ms", "reduced_ms")),
            ]
        table.add_row(row["set"], *cells, row["failure"] or row["verdict"])
    return table


def _per_cent(value: float) -> str:
    return f"{100.0 * value:.2g}"


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
    from validation.study.metrics import METRICS

    least = "at least " if METRICS[failed["metric"]].least else ""
    unit = "" if failed["unit"] == "1" else f" {failed['unit']}"
    return (
        f"  {case}, {failed['model']}, {failed['where']}: {failed['metric']} "
        f"{failed['measured']:.3g}{unit}, allowed {least}{failed['allowed']:g}{unit}"
    )
