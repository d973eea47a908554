"""Base of the benchmarks that have a page of their own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from fegear.gearset.read import files_of_gear_set
from fegear.studies.page import Columns, Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import setting
from fegear.studies.study import NO_PICTURES
from fegear.studies.table import Table
from lumped.common.progress import Progress
from validation.commands.bench.benchmark import (
    POINTS,
    QUICK,
    Benchmark,
    files_of,
    write_benchmark,
)
from validation.study.interrupts import interrupted_by

FOLDER = "Directory for the table and the figure."


@dataclass(frozen=True, kw_only=True)
class OneBenchmark:
    """The part that all benchmarks share."""

    pictures = NO_PICTURES
    partial = True
    folder = True
    judged: ClassVar[bool] = False  # whether a quick one is judged as a full one is

    quick: bool = setting(
        False,
        "Pass through all of the program with few and small points, in seconds; "
        "nothing can be judged by them.",
    )

    @property
    def subject(self) -> str:
        """The word after `bench`, by which its files are named."""
        name: str = self.command.split()[1]  # type: ignore[attr-defined]
        return name

    @property
    def default_output(self) -> str | None:
        """Default directory of the output."""
        return f"bench-{self.subject}{self.ending}"

    @property
    def ending(self) -> str:
        """End of the names of default directories."""
        return "-quick" if self.quick else ""

    def sizes_of(self, module: Any) -> Any:
        """The sizes that a benchmark has, quick or full.

        Parameters
        ----------
        module : module
            Module of `validation.commands.bench`, which declares both.

        Returns
        -------
        NamedTuple or dataclass
            Sizes that the functions of the module take.
        """
        return module.QUICK if self.quick else module.FULL

    @property
    def files(self) -> Sequence[str]:
        """Names of the files in the directory that is written."""
        return [path.name for path in files_of(self.subject, Path())]

    @property
    def named_files(self) -> Sequence[str]:
        """Files that the gear-set file names, of a benchmark that has one."""
        name = getattr(self, "name", None)
        return () if name is None else files_of_gear_set(name, {})

    def marked(self, report: Progress) -> Benchmark:
        """Run the benchmark, and mark it where it is quick.

        Parameters
        ----------
        report : callable
            Function of (stage, done, total), called during the run.

        Returns
        -------
        Benchmark
            What was measured.
        """
        return replace(self.measured(report), quick=self.quick and not self.judged)

    def measured(self, report: Progress) -> Benchmark:
        """Run the benchmark.

        Parameters
        ----------
        report : callable
            Function of (stage, done, total), called during the run.

        Returns
        -------
        Benchmark
            Run times and errors.
        """
        raise NotImplementedError

    def tasks(self) -> Iterator[Task]:
        """The benchmark as one task.

        Returns
        -------
        iterator of Task
            One task.
        """
        yield Task(self.subject, self._run_benchmark)

    def _run_benchmark(self, job: Job) -> BenchmarkResult | None:
        benchmark = self.marked(interrupted_by(job))
        return BenchmarkResult(self, benchmark) if benchmark.tables[POINTS] else None


@dataclass(frozen=True, eq=False)
class BenchmarkResult(StudyResult):
    """Run times and errors of one subject."""

    study: Any
    measured: Benchmark

    @property
    def complete(self) -> bool:
        return not (self.measured.interrupted or self.measured.failures)

    @property
    def failure(self) -> str:
        return "; ".join(self.measured.failures)

    @property
    def summary(self) -> dict[str, Any]:
        return self.measured.values

    @property
    def table(self) -> Table:
        """A row for every measured point."""
        rows = self.measured.tables[POINTS]
        return Table.of_rows(rows)

    @property
    def figures(self) -> dict[str, Any]:
        return {"plot": self.measured.draw}

    def write(self, path: str | Path) -> None:
        """Write the table and the figure into a directory."""
        write_benchmark(self.measured, Path(path))

    def page(self) -> Page:
        for rows in filter(None, self.measured.tables.values()):
            names = [name for name in rows[0] if name not in self.measured.left_out]
            columns: Columns = {
                name.replace("_", "\n"): partial(_cell, name) for name in names
            }
            yield RowTable(rows, columns)
        yield from self.measured.findings
        if self.measured.quick:
            yield QUICK


def _cell(name: str, row: Mapping[str, Any]) -> str:
    value = row[name]
    return value if isinstance(value, str) else f"{value:.3g}"
