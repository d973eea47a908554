"""fegear reproduce: figures and tables of the sources, remade."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import AsJson, progress_bar, refuse_idle, require_outputs
from fegear.cli.screen import print_json, ruled_table, say, screen
from fegear.files.errors import InputError

if TYPE_CHECKING:
    from lumped.common.progress import Progress
    from validation.reproduce import FigureResult

EXAMPLE = "fegear reproduce 3.6 3.9 -o figures"
USUAL = Path("figures")
WRITTEN = ("index.html", "report.json")


def _output_directory(text: str) -> Path:
    if not text:
        raise typer.BadParameter("a directory is needed")
    return Path(text)


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
            parser=_output_directory,
            help="Directory for the page index.html, pictures, tables, and runs, which "
            f"are found again by the next call. [default: {USUAL}]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Figures and tables of the sources, remade.

    Computed values stand beside the printed ones; where they differ, the reason is
    told, and the exit code is 0. The same command goes on with an interrupted run; the
    page keeps the figures that are in its directory already.
    """
    numbers = [number.strip() for number in numbers or []]
    if listed:
        refuse_idle("--list makes nothing", output=output, all=every)
        _print_list(numbers, as_json)
        return
    from fegear.files.output import make_directory
    from validation.reproduce import report_values, write_report

    chosen, place = _chosen(numbers, every), output or USUAL
    store = make_directory(make_directory(place) / "runs")
    require_outputs([place / name for name in WRITTEN])
    earlier = [n for n in _numbers_of(place / WRITTEN[1]) if n not in chosen]
    with progress_bar(enabled=not as_json) as report:
        results = _run(chosen, store, report, tell=not as_json)
        finished = len(results)
        results = _with_earlier(results, earlier, store)
        made = [each.figure.number for each in results]
        values = report_values(results, place, _commands(made, place))
        write_report(values, results, place, report)
    if as_json:
        print_json(values)
    else:
        _print_end(values, made, earlier, place)
    if finished < len(chosen):
        raise KeyboardInterrupt


def _numbers_of(report: Path) -> list[str]:
    """Numbers of the figures on a page that exists already, none where it cannot be
    read.
    """
    from validation.reproduce import figure_numbers

    try:
        figures = json.loads(report.read_text(encoding="utf-8"))["figures"]
        given = {figure["number"] for figure in figures}
    except (OSError, ValueError, LookupError, TypeError):
        return []
    return [number for number in figure_numbers() if number in given]


def _with_earlier(
    results: Sequence[FigureResult], earlier: Sequence[str], store: Path
) -> list[FigureResult]:
    """Results with those of an earlier run that are still valid, in the order of the
    source.
    """
    from validation.reproduce import figure_numbers, find_figure, load_figure

    found = [find_figure(load_figure(number), store) for number in earlier]
    kept = [each for each in found if each is not None]
    order = figure_numbers().index
    return sorted([*results, *kept], key=lambda each: order(each.figure.number))


def _print_end(
    values: Mapping[str, Any], made: Sequence[str], earlier: Sequence[str], place: Path
) -> None:
    """How many lines agree, and what the page holds."""
    for row in values["counts"]:
        say(
            f"{row['lines']} {row['meaning']}: {row['within_1_percent']} to 1 %, "
            f"{row['within_5_percent']} to 5 %, {row['within_10_percent']} to 10 %, "
            f"{row['beyond']} further off or not met, {row['with_a_reason']} with a "
            "reason"
        )
    kept = [number for number in earlier if number in made]
    gone = [number for number in earlier if number not in made]
    if kept:
        say(f"made before, and on the page as well: {', '.join(kept)}")
    if gone:
        say(f"left out, for the program or their data changed: {', '.join(gone)}")
    say(f"wrote {', '.join(str(place / name) for name in WRITTEN)}")


def _chosen(numbers: Sequence[str], every: bool) -> list[str]:
    from validation.reproduce import figure_numbers, load_figure

    known = figure_numbers()
    if every and numbers:
        raise InputError(f"--all and {numbers[0]} exclude each other")
    if not (every or numbers):
        raise InputError(
            "a number or --all is missing (fegear reproduce --list names all)"
        )
    for number in numbers:
        load_figure(number)
        if numbers.count(number) > 1:
            raise InputError(f"figure {number} is given {numbers.count(number)} times")
    return list(known if every else numbers)


def _commands(made: Sequence[str], output: Path) -> dict[str, str]:
    """What one types to make a figure again, by its number, and all of it by ""."""
    from validation.reproduce import figure_numbers

    where = [] if output == USUAL else ["-o", str(output)]

    def command(*words: str) -> str:
        return shlex.join(["fegear", "reproduce", *words, *where])

    every = tuple(made) == figure_numbers()
    return {n: command(n) for n in made} | {
        "": command(*(["--all"] if every else made))
    }


def _run(
    chosen: Sequence[str], store: Path, report: Progress, tell: bool
) -> list[FigureResult]:
    """Results of the figures, after Ctrl-C of those that were finished.

    tell : each on the screen as it is finished
    """
    from validation.reproduce import load_figure, run_figure
    from validation.reproduce.report import figure_values

    figures = [load_figure(number) for number in chosen]
    results: list[FigureResult] = []
    try:
        for figure in figures:
            results.append(run_figure(figure, store, report))
            if tell:
                print_figures([figure_values(results[-1], store.parent)])
                sys.stdout.flush()
    except KeyboardInterrupt:
        if not results:
            raise
    return results


def _print_list(numbers: Sequence[str], as_json: bool) -> None:
    from validation.reproduce import figure_numbers, left_out_figures, load_figure

    chosen = [load_figure(number) for number in numbers or figure_numbers()]
    left_out = () if numbers else left_out_figures()
    if as_json:
        rows = [
            {"number": each.number, "title": each.title, "missing": each.missing}
            for each in chosen
        ]
        print_json({"figures": rows, "left_out": [vars(each) for each in left_out]})
        return
    table = ruled_table("figure", "title", words=("figure", "title"))
    for each in chosen:
        missing = f" (not made: {each.missing})" if each.missing else ""
        table.add_row(each.number, each.title + missing)
    screen().print(table)
    if left_out:
        words = ("not made", "title", "why")
        table = ruled_table(*words, words=words)
        for other in left_out:
            table.add_row(other.numbers, other.title, other.why)
        screen().print(table)


def print_figures(figures: Sequence[Mapping[str, Any]]) -> None:
    """A line for each figure, and below it one for each printed value."""
    for figure in figures:
        seconds = f"computed in {figure['seconds']:.1f} s"
        say(f"{figure['number']} {figure['title']}, {seconds}")
        for row in figure["printed"]:
            say(f"  {row['line']}")
