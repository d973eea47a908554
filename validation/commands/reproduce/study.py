"""Figures and tables of the sources, recomputed."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from fegear.files.errors import InputError, one_line
from fegear.files.output import make_directory, require_writable
from fegear.studies.page import Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument, refusal, setting
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table
from lumped.common.progress import silent
from validation.commands.reproduce import runs
from validation.commands.reproduce.report import report_values, write_report
from validation.commands.reproduce.runs import FigureResult, find_figure
from validation.commands.reproduce.source_figures import (
    figure_numbers,
    load_figure,
    omitted_figures,
)
from validation.study.interrupts import interrupted_by

DEFAULT = "figures"
PAGE, REPORT = WRITTEN_FILES = ("index.html", "report.json")


@dataclass(frozen=True, kw_only=True)
class Reproduction(Study, command="reproduce", example="reproduce 3.6 3.9 -o figures"):
    """Figures and tables of the sources, recomputed.

    Computed values are compared with the printed ones. Where they differ, the reason is
    given, and the exit code is 0; it is 1 where a figure fails, after all others are
    made. The same command resumes an interrupted run; figures that its directory
    already holds stay on the page.
    """

    pictures = NO_PICTURES
    partial = True
    output_names = ()

    numbers: tuple[str, ...] = argument(
        "NUMBER", "Numbers of figures and tables, see --list.", ()
    )
    every: bool = setting(False, "Make all figures and tables.", option="--all")
    listed: bool = setting(
        False, "List what can be made, and make nothing.", option="--list"
    )
    quick: bool = setting(
        False,
        "Check that every part of the figures still runs: each is computed at a few "
        "speeds, cells or starts, and its values are not compared with the sources.",
    )
    directory: str = setting(
        DEFAULT,
        "Directory for the page index.html, pictures, tables, and runs, which the next "
        "call reuses.",
        option="--output",
        metavar="DIR",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        numbers = tuple(number.strip() for number in self.numbers)
        object.__setattr__(self, "numbers", numbers)
        if self.listed:
            defaults = ("directory", DEFAULT), ("every", False), ("quick", False)
            for name, usual in defaults:
                if getattr(self, name) != usual:
                    raise refusal(self, name, "{listed} makes nothing")

    @property
    def chosen(self) -> tuple[str, ...]:
        """Numbers of the figures; raises InputError for a choice that is not there."""
        if self.every and self.numbers:
            raise InputError(f"--all and {self.numbers[0]} exclude each other")
        if not (self.every or self.numbers):
            raise InputError(
                "a number or --all is missing (fegear reproduce --list names all)"
            )
        for number in self.numbers:
            load_figure(number)
            count = self.numbers.count(number)
            if count > 1:
                raise InputError(f"figure {number} is given {count} times")
        return tuple(figure_numbers()) if self.every else self.numbers

    def tasks(self) -> Iterator[Task]:
        if self.listed:
            yield Task("list", self._list_figures)
            return
        chosen, output = self.chosen, Path(self.directory)
        earlier = is_quick_report(output / REPORT)
        if earlier not in (None, self.quick):
            kinds = {True: "a quick run", False: "a full run"}
            raise refusal(
                self,
                "directory",
                f"its page is that of {kinds[not self.quick]}, and {kinds[self.quick]} "
                "needs another directory",
            )
        store = make_directory(make_directory(output) / "runs")
        for name in WRITTEN_FILES:
            require_writable(output / name)
        yield Task("figures", partial(self._make_figures, chosen, store))

    def _list_figures(self, job: Job) -> FigureList:
        return FigureList(self)

    def _make_figures(
        self, chosen: Sequence[str], store: Path, job: Job
    ) -> ReproductionResult | None:
        report, output = interrupted_by(job), Path(self.directory)
        earlier = [n for n in numbers_of(output / REPORT) if n not in chosen]
        results: list[FigureResult] = []
        failed: dict[str, str] = {}
        try:
            for number in chosen:
                figure = load_figure(number, self.quick)
                try:
                    results.append(runs.run_figure(figure, store, report))
                except Exception as error:
                    if len(chosen) == 1:
                        raise
                    failed[number] = in_one_line(error)
        except KeyboardInterrupt:
            if not results:
                return None
        finished = len(results) + len(failed) == len(chosen)
        results = with_earlier(results, earlier, store, self.quick)
        made = [result.figure.number for result in results]
        commands = self._commands(made)
        values = report_values(results, output, commands, failed, self.quick)
        write_report(values, results, output, report if finished else silent)
        return ReproductionResult(self, values, tuple(earlier), finished)

    def _commands(self, made: Sequence[str]) -> dict[str, str]:
        """The command for each figure by its number, and for all of them by ""."""

        def command(*numbers: str) -> str:
            every = numbers == figure_numbers()
            study = replace(self, numbers=() if every else numbers, every=every)
            return shlex.join(["fegear", *study.argv])

        return {number: command(number) for number in made} | {"": command(*made)}


def in_one_line(error: Exception) -> str:
    """What an error says, with its kind unless a reader's input is the cause."""
    kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
    return one_line(f"{kind}{error}")


def is_quick_report(report: Path) -> bool | None:
    """Whether a report is that of a quick run; None where it cannot be read."""
    try:
        return bool(json.loads(report.read_text(encoding="utf-8")).get("quick", False))
    except (OSError, ValueError, AttributeError):
        return None


def numbers_of(report: Path) -> list[str]:
    """Numbers of the figures in a report, none where it cannot be read."""
    try:
        figures = json.loads(report.read_text(encoding="utf-8"))["figures"]
        numbers = {figure["number"] for figure in figures}
    except (OSError, ValueError, LookupError, TypeError):
        return []
    return [number for number in figure_numbers() if number in numbers]


def with_earlier(
    results: Sequence[FigureResult], earlier: Sequence[str], store: Path, quick: bool
) -> list[FigureResult]:
    """Results with earlier ones that are still valid, in the order of the source."""
    stored = [find_figure(load_figure(number, quick), store) for number in earlier]
    valid = [result for result in stored if result is not None]
    order = figure_numbers().index
    return sorted([*results, *valid], key=lambda result: order(result.figure.number))


@dataclass(frozen=True, eq=False)
class ReproductionResult(StudyResult):
    """Computed and printed values of figures; the page is written.

    values : those of report.json; earlier : figures of the page before this run
    """

    study: Reproduction
    values: dict[str, Any]
    earlier: tuple[str, ...]
    finished: bool

    @property
    def complete(self) -> bool:
        return self.finished and not self.values["failed"]

    @property
    def failure(self) -> str:
        failed = [row["number"] for row in self.values["failed"]]
        if not (self.finished and failed):
            return ""
        return (
            f"{len(failed)} of {len(self.study.chosen)} figures failed: "
            f"{', '.join(failed)} (fegear reproduce NUMBER --debug shows a traceback)"
        )

    @property
    def summary(self) -> dict[str, Any]:
        return self.values

    @property
    def table(self) -> Table:
        """A row for every printed value."""
        rows = [
            {"figure": figure["number"], **row}
            for figure in self.values["figures"]
            for row in figure["printed"]
        ]
        return Table.of_rows(rows, names=("figure",))

    def page(self) -> Page:
        figures = {figure["number"]: figure for figure in self.values["figures"]}
        if self.study.quick:
            yield "quick: few points of every part, no value compared with the sources"
        for number in self.study.chosen:
            if number in figures:
                yield from _lines(figures[number])
        for row in self.values["counts"]:
            yield (
                f"{row['lines']} {row['meaning']}: {row['within_1_percent']} to 1 %, "
                f"{row['within_5_percent']} to 5 %, "
                f"{row['within_10_percent']} to 10 %, "
                f"{row['beyond']} further off or not met, "
                f"{row['explained']} with a reason"
            )
        valid = [number for number in self.earlier if number in figures]
        gone = [number for number in self.earlier if number not in figures]
        if valid:
            yield f"made before, and on the page as well: {', '.join(valid)}"
        if gone:
            yield f"left out, for the program or their data changed: {', '.join(gone)}"
        for row in self.values["failed"]:
            yield f"{row['number']} failed: {row['reason']}"
        output = Path(self.study.directory)
        yield f"wrote {', '.join(str(output / name) for name in WRITTEN_FILES)}"


def _lines(figure: dict[str, Any]) -> Iterator[str]:
    """A line for a figure, and one for each printed value."""
    seconds = f"computed in {figure['seconds']:.1f} s"
    yield f"{figure['number']} {figure['title']}, {seconds}"
    yield from (f"  {row['line']}" for row in figure["printed"])


@dataclass(frozen=True, eq=False)
class FigureList(StudyResult):
    """Figures that can be made, and those that are left out."""

    study: Reproduction

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        chosen = map(load_figure, self.study.numbers or figure_numbers())
        return [
            {"number": figure.number, "title": figure.title, "missing": figure.missing}
            for figure in chosen
        ]

    @cached_property
    def left_out(self) -> list[dict[str, Any]]:
        if self.study.numbers:
            return []
        return [
            {"numbers": figure.numbers, "title": figure.title, "reason": figure.reason}
            for figure in omitted_figures()
        ]

    @property
    def summary(self) -> dict[str, Any]:
        return {"figures": self.rows, "left_out": self.left_out}

    @property
    def table(self) -> Table:
        """A row for every figure."""
        return Table.of_rows(self.rows)

    def page(self) -> Page:
        yield RowTable(
            self.rows,
            {"figure": lambda row: row["number"], "title": _title},
            text_columns=("figure", "title"),
        )
        if self.left_out:
            columns = {
                "not made": lambda row: row["numbers"],
                "title": lambda row: row["title"],
                "why": lambda row: row["reason"],
            }
            yield RowTable(self.left_out, columns, text_columns=tuple(columns))


def _title(row: Any) -> str:
    missing = f" (not made: {row['missing']})" if row["missing"] else ""
    return f"{row['title']}{missing}"
