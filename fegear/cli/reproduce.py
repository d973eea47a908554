"""fegear reproduce: figures and tables of the sources, remade."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import AsJson, progress_bar, refuse_idle, require_outputs
from fegear.cli.screen import print_json, ruled_table, say, screen
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.statics import Progress
    from validation.reproduce import FigureResult

EXAMPLE = "fegear reproduce 3.6 3.9 -o figures"
USUAL = Path("figures")
WRITTEN = ("index.html", "report.json")


def reproduce_command(
    numbers: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NUMBER", help="Numbers of figures and tables, see --list."
        ),
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="Make all figures and tables.")
    ] = False,
    listed: Annotated[
        bool, typer.Option("--list", help="List what can be made, and make nothing.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Directory for the page index.html, pictures, tables, and runs, which "
            f"are found again by the next call. [default: {USUAL}]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Figures and tables of the sources, remade.

    Computed values stand beside the printed ones; where they differ, the reason is
    told, and the exit code is 0. The same command goes on with an interrupted run.
    """
    if listed:
        refuse_idle("--list makes nothing", output=output, all=every)
        _print_list(numbers or [], as_json)
        return
    from fegear.output import make_directory
    from validation.reproduce import report_values, write_report

    chosen, place = _chosen(numbers or [], every), output or USUAL
    store = make_directory(make_directory(place) / "runs")
    require_outputs([place / name for name in WRITTEN])
    with progress_bar(enabled=not as_json) as report:
        results = _run(chosen, store, report)
        values = report_values(results, place, _commands(chosen, numbers, place))
        write_report(values, results, place, report)
    if as_json:
        print_json(values)
    else:
        print_figures(values["figures"])
        say(f"wrote {', '.join(str(place / name) for name in WRITTEN)}")
    if len(results) < len(chosen):
        raise KeyboardInterrupt


def _chosen(numbers: Sequence[str], every: bool) -> list[str]:
    from validation.reproduce import figure_numbers, load_figure

    known = figure_numbers()
    if every and numbers:
        raise InputError(f"--all and {numbers[0]} exclude each other")
    if not (every or numbers):
        raise InputError(
            f"a number or --all is missing; allowed are {', '.join(known)}"
        )
    for number in numbers:
        load_figure(number)
        if numbers.count(number) > 1:
            raise InputError(f"figure {number} is given {numbers.count(number)} times")
    return list(known if every else numbers)


def _commands(
    chosen: Sequence[str], given: Sequence[str] | None, output: Path
) -> dict[str, str]:
    """What one types to make a figure again, by its number, and all of it by ""."""
    where = [] if output == USUAL else ["-o", str(output)]

    def command(*words: str) -> str:
        return shlex.join(["fegear", "reproduce", *words, *where])

    return {n: command(n) for n in chosen} | {"": command(*(given or ["--all"]))}


def _run(chosen: Sequence[str], store: Path, report: Progress) -> list[FigureResult]:
    """Results of the figures, after Ctrl-C of those that were finished."""
    from validation.reproduce import load_figure, run_figure

    figures = [load_figure(number) for number in chosen]
    results: list[FigureResult] = []
    try:
        for figure in figures:
            results.append(run_figure(figure, store, report))
    except KeyboardInterrupt:
        if not results:
            raise
    return results


def _print_list(numbers: Sequence[str], as_json: bool) -> None:
    from validation.reproduce import figure_numbers, load_figure

    chosen = [load_figure(number) for number in numbers or figure_numbers()]
    if as_json:
        rows = [{"number": each.number, "title": each.title} for each in chosen]
        print_json({"figures": rows})
        return
    table = ruled_table("figure", "title", words=("figure", "title"))
    for each in chosen:
        table.add_row(each.number, each.title)
    screen().print(table)


def print_figures(figures: Sequence[Mapping[str, Any]]) -> None:
    """A line for each figure, and below it one for each printed value."""
    for figure in figures:
        say(f"{figure['number']} {figure['title']}, {figure['seconds']:.1f} s")
        for row in figure["printed"]:
            say(f"  {row['line']}")
