"""Benchmarks: run time against error, a study for each subject."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from fegear.files.output import strict_json, write_text
from fegear.gearset import load_gear_set
from fegear.gearset.model import GearSet
from fegear.studies.page import Columns, Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument, group_of, refuse_non_default, setting
from fegear.studies.study import Study
from fegear.studies.trains.loads import chosen_torque, torque_setting
from lumped.common.options import Range
from lumped.common.progress import Progress
from validation.commands.bench.benchmark import (
    POINTS,
    QUICK,
    Benchmark,
    write_benchmark,
    write_page,
)
from validation.commands.bench.one_benchmark import FOLDER, OneBenchmark
from validation.commands.bench.stress import stress_coupled, stress_lumped
from validation.commands.bench.stress.trials import Trial, run_trials, trials_csv
from validation.study.interrupts import interrupted_by

PAIR, TRAIN, FRICTION_TRAIN = "liu-pair", "liu-idler", "liu-friction"
TORQUE = 100.0  # N m, of `bench all`
SET = "Name of a built-in gear set, or path of a gear-set file (TOML)."
STRESS_COLUMNS: Columns = {
    "attempt": lambda row: row["name"],
    "expectation": lambda row: row["expectation"],
    "measured": lambda row: f"{row['measured']:.2g}",
    "allowed": lambda row: f"{row['bound']:.2g}",
    "passed": lambda row: "yes" if row["passed"] else "NO",
}


def damping_setting() -> Any:
    return setting(
        None,
        "Damping ratio of every vibration mode. [default: that of the gear set, else "
        "0.04]",
        Range(least=0.0, below=1.0),
    )


@dataclass(frozen=True, kw_only=True)
class StiffnessBenchmark(
    OneBenchmark,
    Study,
    command="bench stiffness",
    example="bench stiffness liu-pair -o bench",
):
    """Statics over mesh size, element order and contact grid."""

    output = f"{FOLDER} [default: bench-stiffness]"

    name: str = argument("SET", SET, PAIR, reads=True)
    torque: float = setting(TORQUE, "Torque on the driving gear of mesh 1 [N\u00a0m].")

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_stiffness

        gears = load_gear_set(self.name)
        load = chosen_torque(gears, self.torque, mesh=1)
        return bench_stiffness.measure(
            gears, load, report, sizes=self.sizes_of(bench_stiffness)
        )


@dataclass(frozen=True, kw_only=True)
class DynamicsBenchmark(
    OneBenchmark,
    Study,
    command="bench dynamics",
    example="bench dynamics liu-pair -o bench",
):
    """Finite-element dynamics over time steps and modes."""

    output = f"{FOLDER} [default: bench-dynamics]"

    name: str = argument("SET", SET, PAIR, reads=True)
    torque: float | None = torque_setting()

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_dynamics

        gears, load = loaded(self)
        return bench_dynamics.measure(
            gears, load, report, sizes=self.sizes_of(bench_dynamics)
        )


def loaded(study: Any) -> tuple[GearSet, float]:
    """The gear set of a benchmark, and the torque on its input gear [N m]."""
    gears = load_gear_set(study.name)
    return gears, chosen_torque(gears, study.torque)


@dataclass(frozen=True, kw_only=True)
class LumpedBenchmark(
    OneBenchmark,
    Study,
    command="bench lumped",
    example="bench lumped liu-idler -o bench",
):
    """Time integrators of the lumped models compared with those of SciPy."""

    output = f"{FOLDER} [default: bench-lumped, none with --stress]"

    name: str = argument("SET", SET, TRAIN, reads=True)
    stress: bool = setting(
        False, "Try to break the models instead, on one train of its own."
    )
    torque: float | None = torque_setting()
    damping_ratio: float | None = damping_setting()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stress:
            names = "name", "torque", "damping_ratio", "quick"
            reason = "{stress} runs on a train of its own"
            refuse_non_default(self, names, reason, group_of(self))

    @property
    def default_output(self) -> str | None:
        return None if self.stress else super().default_output

    @property
    def files(self) -> Sequence[str]:
        return ["stress.csv"] if self.stress else super().files

    def tasks(self) -> Iterator[Task]:
        yield Task(
            "lumped", self._run_stress_tests if self.stress else self._run_benchmark
        )

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_lumped

        return bench_lumped.measure(
            *loaded(self), self.damping_ratio, report, sizes=self.sizes_of(bench_lumped)
        )

    def _run_stress_tests(self, job: Job) -> StressTestResult:
        families = [*stress_lumped.TRIALS, *stress_coupled.TRIALS]
        return StressTestResult(self, tuple(run_trials(families, job.report)))


@dataclass(frozen=True, eq=False)
class StressTestResult(StudyResult):
    """Attempts to break the lumped models, with what was promised and measured."""

    study: LumpedBenchmark
    trials: tuple[Trial, ...]

    @property
    def passed_count(self) -> int:
        return sum(trial.passed for trial in self.trials)

    @property
    def complete(self) -> bool:
        return self.passed_count == len(self.trials)

    @property
    def failure(self) -> str:
        count = len(self.trials)
        return f"{count - self.passed_count} of {count} promises are not kept"

    @cached_property
    def summary(self) -> dict[str, Any]:
        rows = [asdict(trial) | {"passed": trial.passed} for trial in self.trials]
        return {"trials": rows}

    def write(self, path: str | Path) -> None:
        """Write the table of trials into a directory."""
        write_text(Path(path) / "stress.csv", trials_csv(self.trials))

    def page(self) -> Page:
        yield RowTable(
            self.summary["trials"],
            STRESS_COLUMNS,
            text_columns=("attempt", "expectation"),
        )
        yield f"{self.passed_count} of {len(self.trials)} promises kept"


@dataclass(frozen=True, kw_only=True)
class BranchesBenchmark(
    OneBenchmark,
    Study,
    command="bench branches",
    example="bench branches liu-idler -o bench",
):
    """Periodic motions by harmonic balance compared with sweeps."""

    output = f"{FOLDER} [default: bench-branches]"

    name: str = argument("SET", SET, TRAIN, reads=True)
    torque: float | None = torque_setting()
    damping_ratio: float | None = damping_setting()

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_branches

        return bench_branches.measure(
            *loaded(self),
            self.damping_ratio,
            report,
            sizes=self.sizes_of(bench_branches),
        )


@dataclass(frozen=True, kw_only=True)
class StabilityBenchmark(
    OneBenchmark,
    Study,
    command="bench stability",
    example="bench stability liu-friction -o bench",
):
    """Floquet multipliers of trains with tooth friction, and closed forms."""

    output = f"{FOLDER} [default: bench-stability]"

    name: str = argument("SET", SET, FRICTION_TRAIN, reads=True)
    torque: float | None = torque_setting()

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_stability

        _, load = loaded(self)
        return bench_stability.measure(
            self.name, load, report, sizes=self.sizes_of(bench_stability)
        )


@dataclass(frozen=True, kw_only=True)
class EccentricBenchmark(
    OneBenchmark, Study, command="bench eccentric", example="bench eccentric -o bench"
):
    """Eccentric wheels: centre distance, and contact over the mesh size."""

    output = f"{FOLDER} [default: bench-eccentric]"

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_eccentric

        return bench_eccentric.measure(report, sizes=self.sizes_of(bench_eccentric))


@dataclass(frozen=True, kw_only=True)
class WidthBenchmark(
    OneBenchmark, Study, command="bench width", example="bench width -o bench"
):
    """Loads over the face width: degree, mesh of the section and slices."""

    output = f"{FOLDER} [default: bench-width]"

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_width

        return bench_width.measure(report, sizes=self.sizes_of(bench_width))


@dataclass(frozen=True, kw_only=True)
class ClatterBenchmark(
    OneBenchmark, Study, command="bench clatter", example="bench clatter -o bench"
):
    """Clattering wheels: impacts per second, and the tolerance of events."""

    output = f"{FOLDER} [default: bench-clatter]"

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_clatter

        return bench_clatter.measure(report, sizes=self.sizes_of(bench_clatter))


@dataclass(frozen=True, kw_only=True)
class GrowthBenchmark(
    OneBenchmark, Study, command="bench growth", example="bench growth -o bench"
):
    """Run time of the lumped models over the number of gears."""

    output = f"{FOLDER} [default: bench-growth]"

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_growth

        return bench_growth.measure(report, sizes=self.sizes_of(bench_growth))


@dataclass(frozen=True, kw_only=True)
class CommandsBenchmark(
    OneBenchmark, Study, command="bench commands", example="bench commands -o bench"
):
    """Processor time and memory of whole commands, over those of fixed jobs."""

    output = f"{FOLDER} [default: bench-commands]"
    judged = True

    quick: bool = setting(
        False, "Half of the commands, in two minutes, by the same limits."
    )

    def measured(self, report: Progress) -> Benchmark:
        from validation.commands.bench import bench_commands

        return bench_commands.measure(report, sizes=self.sizes_of(bench_commands))


@dataclass(frozen=True, kw_only=True)
class AllBenchmarks(
    OneBenchmark, Study, command="bench all", example="bench all -o bench"
):
    """All benchmarks on one page, index.html."""

    output = "Directory for index.html and more. [default: bench]"

    @property
    def default_output(self) -> str | None:
        return f"bench{self.ending}"

    @property
    def benchmarks(self) -> tuple[Any, ...]:
        """The benchmarks, in the order of the page."""
        return (
            StiffnessBenchmark(quick=self.quick),
            LumpedBenchmark(torque=TORQUE, quick=self.quick),
            BranchesBenchmark(torque=TORQUE, quick=self.quick),
            StabilityBenchmark(torque=TORQUE, quick=self.quick),
            WidthBenchmark(quick=self.quick),
            EccentricBenchmark(quick=self.quick),
            ClatterBenchmark(quick=self.quick),
            GrowthBenchmark(quick=self.quick),
            DynamicsBenchmark(torque=TORQUE, quick=self.quick),
        )

    @property
    def files(self) -> Sequence[str]:
        names = [name for benchmark in self.benchmarks for name in benchmark.files]
        return ["index.html", "bench.json", *names]

    def tasks(self) -> Iterator[Task]:
        yield Task("all", self._run_benchmarks)

    def _run_benchmarks(self, job: Job) -> AllBenchmarksResult | None:
        report, measured = interrupted_by(job), list[Benchmark]()
        for benchmark in self.benchmarks:
            measured.append(
                benchmark.marked(
                    partial(_report_with_subject, report, benchmark.subject)
                )
            )
            if measured[-1].interrupted:
                break
        with_points = tuple(
            benchmark for benchmark in measured if benchmark.tables[POINTS]
        )
        return AllBenchmarksResult(self, with_points) if with_points else None


def _report_with_subject(
    report: Progress, subject: str, stage: str, done: int, total: int
) -> None:
    report(f"{subject}: {stage}", done, total)


@dataclass(frozen=True, eq=False)
class AllBenchmarksResult(StudyResult):
    """Run times and errors of all subjects."""

    study: AllBenchmarks
    measured: tuple[Benchmark, ...]

    @property
    def complete(self) -> bool:
        every = len(self.measured) == len(self.study.benchmarks)
        return every and not self.measured[-1].interrupted

    @property
    def summary(self) -> dict[str, Any]:
        return {benchmark.name: benchmark.values for benchmark in self.measured}

    def write(self, path: str | Path) -> None:
        """Write the page, its tables and figures into a directory."""
        output = Path(path)
        for benchmark in self.measured:
            write_benchmark(benchmark, output)
        write_text(output / "bench.json", strict_json(self.summary))
        command = shlex.join(["fegear", *self.study.argv, "-o", str(path)])
        write_page(self.measured, output, command)

    def page(self) -> Page:
        yield f"measured: {', '.join(benchmark.name for benchmark in self.measured)}"
        if self.study.quick:
            yield QUICK
