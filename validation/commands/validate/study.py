"""Lumped models against finite elements, case by case."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, replace
from functools import cached_property, partial
from math import isnan
from pathlib import Path
from typing import Any, Literal

from fegear.files.errors import InputError
from fegear.files.output import make_directory, require_writable
from fegear.gearset.read import files_of_gear_set
from fegear.studies.page import Columns, Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument, refusal, setting
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table
from lumped.common.progress import Progress, silent
from lumped.common.workers import Cluster
from validation.commands.validate.random_sets import set_runs as random_sets
from validation.commands.validate.random_sets.set_runs import Extent, SetRun
from validation.commands.validate.report import (
    QUICK,
    is_quick_report,
    report_values,
    write_report,
)
from validation.study import runs as case_runs
from validation.study.cases import Case, case_names, load_case
from validation.study.interrupts import interrupted_by
from validation.study.metrics import METRICS
from validation.study.runs import CaseResult, make_runs
from validation.study.tasks import tasks_of

WRITTEN_FILES = ("index.html", "report.md", "report.json")
RANDOM_SETS = "random-sets"  # a word among the names of cases
MAX_LINES = 40  # of verdicts outside on the screen


def _per_cent(name: str, row: Mapping[str, Any]) -> str:
    return f"{100.0 * row['figures'][name]:.2g}" if row["figures"] else ""


def _figure_text(name: str, row: Mapping[str, Any]) -> str:
    return str(row["figures"][name]) if row["figures"] else ""


def _whole_number(name: str, row: Mapping[str, Any]) -> str:
    return f"{row['figures'][name]:.0f}" if row["figures"] else ""


SET_COLUMNS: Columns = {
    "set": lambda row: row["set"],
    "median\n%": partial(_per_cent, "median_error"),
    "90 %\n%": partial(_per_cent, "p90_error"),
    "other\nbranch": partial(_figure_text, "other_branch_speeds"),
    "modes": partial(_figure_text, "body_modes"),
    "bound\n%": partial(_per_cent, "left_out"),
    "natural\n%": partial(_per_cent, "natural_error"),
    "ms": partial(_whole_number, "coupled_ms"),
    "ms of FE": partial(_whole_number, "reduced_ms"),
    "verdict": lambda row: row["failure"] or row["verdict"],
}
CASE_COLUMNS: Columns = {
    "case": lambda row: row["case"],
    "model": lambda row: row["model"],
    "within": lambda row: str(row["within"]),
    "outside": lambda row: str(row["outside"]),
    "cost of FE\nover model": lambda row: (
        "" if isnan(row["cost_ratio"]) else f"{row['cost_ratio']:.0f}"
    ),
}
JUDGED_COLUMNS = "within", "outside", "verdict"


@dataclass(frozen=True, kw_only=True)
class Validation(
    Study, command="validate", example="validate idler friction-pair -o report"
):
    """Lumped models against finite elements, with tolerances.

    The exit code is 1 if a tolerance fails. The same command resumes an interrupted
    run; on a cluster only complete runs are stored.
    """

    pictures = NO_PICTURES
    partial = True
    distributes = True
    output_names = ()

    cases: tuple[str, ...] = argument(
        "CASE",
        "Names of built-in cases, or paths of case files (TOML); random-sets for the "
        "coupled model on 30 random gear sets.",
        (),
        reads=True,
    )
    every: bool = setting(
        False, "Run all built-in cases and the random gear sets.", option="--all"
    )
    fidelity: Literal["reduced", "full", "quasistatic"] | None = setting(
        None,
        "Model of the finite elements, as in `fegear dynamics`. [default: that of each "
        "case]",
    )
    quick: bool = setting(
        False,
        "Pass through all of the program with few speeds, torques and random gear "
        "sets, in minutes; nothing is judged.",
    )
    directory: str = setting(
        MISSING,
        "Directory for the report: index.html, report.md and report.json, figures, "
        "tables, and runs, which the next call reuses.",
        option="--output",
        metavar="DIR",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names and paths of the cases that were asked for."""
        return tuple(name for name in self.cases if name != RANDOM_SETS)

    @property
    def named_files(self) -> Iterator[str]:
        """Gear sets of the cases, and files that these name."""
        for case in map(load_case, self.names):
            yield case.gear_set
            for model in (None, *case.model):
                yield from files_of_gear_set(case.gear_set, case.edits_of(model))

    @property
    def random(self) -> bool:
        """Whether the random gear sets run as well."""
        return self.every or RANDOM_SETS in self.cases

    @property
    def chosen(self) -> tuple[Case, ...]:
        """The cases; raises InputError for a choice that cannot be run."""
        allowed = ", ".join([*case_names(), RANDOM_SETS])
        if self.every and self.names:
            raise InputError(f"--all and {self.names[0]} exclude each other")
        if not (self.every or self.names or self.random):
            raise InputError(f"a case or --all is missing; allowed are {allowed}")
        if not (self.every or self.names) and self.fidelity is not None:
            raise refusal(self, "fidelity", "the random sets have their own")
        cases = [load_case(n) for n in (case_names() if self.every else self.names)]
        case_names_taken = [case.name for case in cases]
        for name in case_names_taken:
            if case_names_taken.count(name) > 1:
                raise InputError(
                    f"case {name} is given {case_names_taken.count(name)} times"
                )
        if self.quick:
            cases = [case.quick for case in cases]
        if self.fidelity is None:
            return tuple(cases)
        return tuple(replace(case, fidelity=self.fidelity) for case in cases)

    @property
    def extent(self) -> Extent:
        """How many random gear sets, and how many speeds of each."""
        return random_sets.QUICK if self.quick else random_sets.FULL_EXTENT

    def tasks(self) -> Iterator[Task]:
        chosen, output = self.chosen, Path(self.directory)
        store = make_directory(make_directory(output) / "runs")
        for name in WRITTEN_FILES:
            require_writable(output / name)
        self._require_same_kind(output / "report.json")
        for case in chosen:
            list(tasks_of(case))  # refuses a gear set that cannot be used
        yield Task("cases", partial(self._validate, store))

    def _require_same_kind(self, path: Path) -> None:
        """Refuse to replace a report of full runs by a quick one, or the other."""
        if path.is_file() and is_quick_report(path) is not self.quick:
            kinds = ("full", "quick") if self.quick else ("quick", "full")
            raise refusal(
                self,
                "directory",
                f"has a report of {kinds[0]} runs; a {kinds[1]} one needs another "
                "directory",
            )

    def _validate(self, store: Path, job: Job) -> ValidationResult | None:
        report = interrupted_by(job)
        results = self._run(store, job, report)
        complete, sets = len(results) == len(self.chosen), list[SetRun]()
        if self.random and complete:
            sets, complete = random_sets.run_random_sets(
                store, report, job.workers, self.extent
            )
        if not (results or sets):
            return None
        output = Path(self.directory)
        values = report_values(results, output, self._commands, sets, self.quick)
        write_report(values, results, output, report if complete else silent)
        return ValidationResult(self, values, complete)

    def _run(self, store: Path, job: Job, report: Progress) -> list[CaseResult]:
        """Results of the cases, after Ctrl-C of those that were finished."""
        results: list[CaseResult] = []
        try:
            if isinstance(job.workers, Cluster):
                make_runs(self.chosen, store, job.workers, report)
            for case in self.chosen:
                of_case = partial(_report_with_case, report, case.name)
                results.append(case_runs.run_case(case, store, of_case))
        except KeyboardInterrupt:
            pass
        return results

    @property
    def _commands(self) -> dict[str, str]:
        """The command for each case by its name, and for all of them by ""."""

        def command(*names: str, **others: Any) -> str:
            study = replace(self, cases=names, every=False, **others)
            return shlex.join(["fegear", *study.argv])

        labels = self.names or [case.name for case in self.chosen]
        commands = {
            c.name: command(n) for c, n in zip(self.chosen, labels, strict=True)
        }
        random = command(RANDOM_SETS, fidelity=None)
        return commands | {RANDOM_SETS: random, "": shlex.join(["fegear", *self.argv])}


def _report_with_case(
    report: Progress, case: str, stage: str, done: int, total: int
) -> None:
    report(f"{case}: {stage}", done, total)


@dataclass(frozen=True, eq=False)
class ValidationResult(StudyResult):
    """Verdicts on models, case by case; the report is written.

    values : those of report.json; finished : whether no run is missing
    """

    study: Validation
    values: dict[str, Any]
    finished: bool

    @property
    def summary(self) -> dict[str, Any]:
        return self.values

    @property
    def outside(self) -> list[tuple[str, Mapping[str, Any]]]:
        """Cases and verdicts outside their tolerances; none of quick runs."""
        return [
            (case["case"], verdict)
            for case in self.values["cases"]
            for verdict in case["verdicts"]
            if not (verdict["within"] or self.study.quick)
        ]

    @property
    def without_value(self) -> list[tuple[str, str, list[str]]]:
        """Case, model and the metrics of which it has no value, where there are any.

        Peaks or jumps that only one of both has are not compared.
        """
        missing = [
            (case["case"], model["model"], _metrics_without_value(case, model["model"]))
            for case in self.values["cases"]
            for model in case["models"]
        ]
        return [entry for entry in missing if entry[2]]

    @property
    def complete(self) -> bool:
        return self.finished and not self._reasons

    @property
    def failure(self) -> str:
        return " and ".join(self._reasons) if self.finished else ""

    @cached_property
    def _reasons(self) -> list[str]:
        """Why the models fail."""
        sets, reasons = self.values["random_sets"], list[str]()
        if self.study.quick:
            return reasons
        if self.outside:
            reasons.append(f"values outside their tolerances: {len(self.outside)}")
        unjudged = [
            f"{case['case']}, {model['model']}"
            for case in self.values["cases"]
            for model in case["models"]
            if model["within"] + model["outside"] == 0
        ]
        if unjudged:
            reasons.append(f"no value to judge: {'; '.join(unjudged)}")
        if sets.get("of") != sets.get("passed"):
            missed = sets["of"] - sets["passed"]
            reasons.append(f"random gear sets that break a promise: {missed}")
        return reasons

    @property
    def table(self) -> Table:
        """A row for every verdict."""
        rows = [
            {"case": case["case"], **verdict}
            for case in self.values["cases"]
            for verdict in case["verdicts"]
        ]
        return Table.of_rows(rows, names=("case",))

    def page(self) -> Page:
        sets, cases = self.values["random_sets"], self.values["cases"]
        if sets:
            yield RowTable(
                sets["rows"],
                self._columns_of_run(SET_COLUMNS),
                "Random gear sets",
                ("set", "verdict"),
            )
            passed, count = sets["passed"], sets["of"]
            if not self.study.quick:
                yield f"{passed} of {count} random gear sets keep what is promised"
        if cases:
            rows = [
                {"case": c["case"], **model} for c in cases for model in c["models"]
            ]
            title = "Costs" if self.study.quick else "Verdicts"
            yield RowTable(
                rows, self._columns_of_run(CASE_COLUMNS), title, ("case", "model")
            )
            yield from () if self.study.quick else self._verdicts()
        if self.study.quick:
            yield QUICK
        output = Path(self.study.directory)
        yield f"wrote {', '.join(str(output / name) for name in WRITTEN_FILES)}"

    def _columns_of_run(self, columns: Columns) -> Columns:
        """Columns of the screen, of quick runs without verdicts."""
        judged = JUDGED_COLUMNS if self.study.quick else ()
        return {name: cell for name, cell in columns.items() if name not in judged}

    def _verdicts(self) -> Page:
        outside = self.outside
        if len(outside) > MAX_LINES:
            table = Path(self.study.directory) / "tables" / "verdicts.csv"
            yield f"{len(outside)} outside, see {table}"
        elif outside:
            yield "Outside"
            yield from (failed_line(*failure) for failure in outside)
        for case, model, metrics in self.without_value:
            yield f"no value of {', '.join(metrics)}: {case}, {model}"
        if not outside and not self._reasons:
            yield "All are within."


def _metrics_without_value(case: Mapping[str, Any], model: str) -> list[str]:
    return [
        metric["metric"]
        for metric in case["metrics"]
        for entry in metric["models"]
        if entry["model"] == model and entry["of"] == 0
    ]


def failed_line(case: str, failed: Mapping[str, Any]) -> str:
    """`idler, model-2, 100 N m, up, mesh 1: rms_distance 0.61, allowed 0.5`."""
    least = "at least " if METRICS[failed["metric"]].allowed_is_minimum else ""
    unit = "" if failed["unit"] == "1" else f" {failed['unit']}"
    cause = f"; {failed['cause']}" if failed.get("cause") else ""
    return (
        f"  {case}, {failed['model']}, {failed['where']}: {failed['metric']} "
        f"{failed['measured']:.3g}{unit}, allowed {least}{failed['allowed']:g}{unit}"
        f"{cause}"
    )
