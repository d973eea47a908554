"""fegear validate: lumped models against finite elements, case by case."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.lumped_options import AsJson, strict_json
from fegear.cli.options import progress_bar, require_outputs

if TYPE_CHECKING:
    from validation.cases import Case
    from validation.runs import CaseResult


class ValidationFidelity(StrEnum):
    reduced = "reduced"
    full = "full"
    quasistatic = "quasistatic"


def validate_command(
    cases: Annotated[
        list[str] | None,
        typer.Argument(metavar="[CASE ...]", help="Built-in cases or paths of cases."),
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="All built-in cases.")] = False,
    fidelity: Annotated[
        ValidationFidelity | None,
        typer.Option(help="Of the finite elements [default: each case's own]."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Writes index.html, report.md and report.json there, figures and "
            "tables beside them and all runs below runs; what is there already is not "
            "run again.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """How far each lumped model is from the finite elements, against tolerances.

    Exit code 1 if a tolerance fails. A run that was ended goes on with the same
    command.

    Example: fegear validate idler friction-pair -o report
    """
    from fegear.errors import InputError
    from fegear.output import make_directory, write_whole

    if output is None:
        raise InputError("-o DIR is missing; it keeps the runs")
    chosen = _chosen(cases or [], every, fidelity)
    store = make_directory(make_directory(output) / "runs")
    place = output / "report.json"
    require_outputs([place])
    from validation.report import report_values, write_report

    names = cases or [case.name for case in chosen]
    again = {
        case.name: _command([name], fidelity, output)
        for case, name in zip(chosen, names, strict=True)
    }
    whole = _command(["--all"] if every else names, fidelity, output)
    with progress_bar(enabled=not as_json) as report:
        results = _run(chosen, store, report)
        values = report_values(results, output, whole, again)
        page = write_report(values, results, output, report)
    text = strict_json(values)
    write_whole(place, lambda path: path.write_text(text, encoding="utf-8"))
    if as_json:
        typer.echo(text, nl=False)
    else:
        print_results(values["cases"])
        typer.echo(f"wrote {page}, {output / 'report.md'} and {place}")
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


def _command(
    words: Sequence[str], fidelity: ValidationFidelity | None, output: Path
) -> str:
    """What one types to do it again."""
    options = [] if fidelity is None else ["--fidelity", fidelity.value]
    return shlex.join(["fegear", "validate", *words, *options, "-o", str(output)])


def _run(
    chosen: Sequence[Case], store: Path, report: Callable[[str, int, int], None]
) -> list[CaseResult]:
    from validation.runs import run_case

    def of(case: Case) -> Callable[[str, int, int], None]:
        return lambda what, done, total: report(f"{case.name}: {what}", done, total)

    return [run_case(case, store, of(case)) for case in chosen]


def print_results(cases: Sequence[Mapping[str, Any]]) -> None:
    """Case by model, then a line for every verdict that is outside."""
    from rich.console import Console

    console = Console(highlight=False, markup=False)
    console.print(_overview(cases))
    lines = [
        failed_line(case["case"], each)
        for case in cases
        for each in case["verdicts"]
        if not each["within"]
    ]
    # not by rich, which would break the lines
    typer.echo("\n".join(["Outside", *lines] if lines else ["All are within."]))


def _overview(cases: Sequence[Mapping[str, Any]]) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(
        title="Verdicts", box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False
    )
    for name in ("case", "model", "within", "outside", "cost of FE\nover model"):
        text = name in ("case", "model")
        table.add_column(name, justify="left" if text else "right")
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
