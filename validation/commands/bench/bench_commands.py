"""Processor time and memory of whole commands, over those of fixed jobs.

What a user waits for is a process from its start to its end: it loads libraries,
compiles kernels where there are none, and solves. Seconds of another machine say
little. Each command is therefore run beside a job of `reference_jobs` that does not
change: cold ones, with nothing compiled or solved before, beside one that compiles;
warm ones beside one that solves. The ratios are compared with recorded ones.
"""

from __future__ import annotations

import csv
import math
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from fegear.files.errors import InputError
from lumped.common.progress import Progress
from validation.commands.bench import benchmark as bench

RECORDED_FILE = Path(__file__).with_name("commands.csv")
JOBS_SCRIPT = Path(__file__).with_name("reference_jobs.py")
MEASURING_SCRIPT = Path(__file__).with_name("process_usage.py")
COLD, WARM = "cold", "warm"
JOB_OF = {COLD: "compiling", WARM: "solving"}
MAX_RATIO_CHANGE = 1.5  # of a ratio over the recorded one
MAX_ROUNDS = 5  # of a command that is beyond it: another process may be to blame
IDLER = "liu-idler --torque 100"
COMMANDS = {  # words after fegear by name
    "show": "show liu-pair",
    "stiffness": "stiffness liu-pair --torque 100",
    "render": "render liu-pair --torque 100 --position 0.9 -o contact.png",
    "sweep, model 1": f"sweep {IDLER} --model 1 --speeds 1000:3600:100",
    "sweep, coupled": f"sweep {IDLER} --model coupled --speeds 1000:3600:100",
    "wear": "wear liu-pair --torque 100 --cycles 1e8 -o wear.csv",
    "modes": f"modes {IDLER}",
    "theory": f"theory {IDLER}",
    "branches, model 1": f"branches {IDLER} --model 1 --speeds 2000:3000 -o b.csv",
    "branches, coupled": (
        f"branches {IDLER} --model coupled --speeds 2500:2600 -o b.csv"
    ),
    "signals": "signals liu-pair --torque 100 --rpm 900 -o signals.csv",
    "tolerances": "tolerances liu-pair --torque 100 --grade 6 --samples 500",
    "sharing": "sharing planetary-24-36-96 --torque 60",
    "dynamics": f"dynamics {IDLER} --speeds 1000:3600:200 -o dynamics.csv",
}


@dataclass(frozen=True)
class Sizes:
    """Names of the commands that are measured, and how many times each is."""

    warm: tuple[str, ...] = tuple(COMMANDS)
    cold: tuple[str, ...] = (
        "stiffness",
        "sweep, coupled",
        "branches, model 1",
        "dynamics",
    )
    rounds: int = 3


FULL = Sizes()
QUICK = Sizes(FULL.warm[: len(COMMANDS) // 2], FULL.cold[:1], rounds=1)


@dataclass(frozen=True)
class CommandCost:
    """What a command takes, and that over what the job beside it takes.

    The recorded ratios are NaN where there are none.
    """

    command: str
    state: str
    arguments: str
    processor_s: float
    memory_MB: float
    processor_ratio: float
    memory_ratio: float
    recorded_processor_ratio: float
    recorded_memory_ratio: float

    @property
    def change(self) -> float:
        """The larger of both ratios over its recorded one."""
        return max(
            self.processor_ratio / self.recorded_processor_ratio,
            self.memory_ratio / self.recorded_memory_ratio,
        )

    @property
    def name(self) -> str:
        return f"{self.command}, {self.state}"


@dataclass(frozen=True)
class Usage:
    """Processor time [s] and peak memory [MB] of a process."""

    processor: float
    memory: float


@dataclass(frozen=True)
class CommandRunner:
    """Runs processes in a directory of their own, with caches in it."""

    directory: Path
    environment: Mapping[str, str] = field(default_factory=lambda: dict(os.environ))

    def command(self, arguments: str, state: str) -> Usage:
        """Usage of fegear with arguments: cold, it has caches of its own, empty."""
        cache_directories = {}
        if state == COLD:
            folder = tempfile.mkdtemp(dir=self.directory)
            cache_directories = {"NUMBA_CACHE_DIR": folder, "FEGEAR_CACHE_DIR": folder}
        return self._run(["-m", "fegear", *shlex.split(arguments)], cache_directories)

    def job(self, state: str) -> Usage:
        """Usage of the job beside which commands of a state are measured."""
        return self._run([str(JOBS_SCRIPT), JOB_OF[state]], {})

    def _run(
        self, arguments: Sequence[str], cache_directories: Mapping[str, str]
    ) -> Usage:
        if not hasattr(os, "wait4"):
            raise InputError("bench commands; this system does not tell what one uses")
        # the threads of a matrix product would count as often as there are processors
        threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        completed = subprocess.run(
            [sys.executable, "-S", str(MEASURING_SCRIPT), sys.executable, *arguments],
            cwd=self.directory,
            env={**self.environment, **threads, **cache_directories},
            capture_output=True,
            text=True,
            check=True,
        )
        code, processor, memory = completed.stdout.split()
        if code != "0":
            last = completed.stderr.strip().splitlines()[-1:]
            text = f"{shlex.join(arguments)} ended with exit code {code}"
            raise InputError(": ".join([text, *last]))
        per_MB = 1e6 if sys.platform == "darwin" else 1e3  # bytes, elsewhere kilobytes
        return Usage(float(processor), float(memory) / per_MB)


def measure(report: Progress, sizes: Sizes = FULL) -> bench.Benchmark:
    """Commands cold and warm, beside the ratios that are recorded."""
    rows, interrupted = bench.collect(_cost_rows(report, sizes))
    points = rows[bench.POINTS]
    return bench.Benchmark(
        name="commands",
        title="Whole commands: processor time and memory over those of fixed jobs",
        about="Cold commands, with nothing compiled or solved before, over a job that "
        "compiles; warm ones over a job that solves. On the diagonal nothing has "
        "changed since the ratios were recorded.",
        tables=bench.plain(rows),
        panels=[_panel(points)],
        left_out=["arguments"],
        findings=_findings(points),
        failures=_failures(points),
        interrupted=interrupted,
    )


def _cost_rows(report: Progress, sizes: Sizes) -> Iterator[tuple[str, Any]]:
    recorded = _recorded_ratios()
    with tempfile.TemporaryDirectory() as directory:
        runner = CommandRunner(Path(directory))
        command_states = [(command, COLD) for command in sizes.cold]
        command_states += [(command, WARM) for command in sizes.warm]
        for done, (command, state) in enumerate(command_states):
            report(f"{command}, {state}", done, len(command_states))
            before = recorded.get((command, state), (math.nan, math.nan))
            yield bench.POINTS, _cost(runner, command, state, sizes.rounds, before)


def _cost(
    runner: CommandRunner,
    command: str,
    state: str,
    rounds: int,
    recorded: tuple[float, float],
) -> CommandCost:
    """The middle one of some rounds, each between two runs of the job."""
    if state == WARM:
        runner.command(COMMANDS[command], state)  # compiles, and fills the caches
    jobs, usages = [runner.job(state)], list[Usage]()
    while True:
        usages.append(runner.command(COMMANDS[command], state))
        jobs.append(runner.job(state))
        cost = _median_cost(command, state, usages, jobs, recorded)
        needed_rounds = MAX_ROUNDS if cost.change > MAX_RATIO_CHANGE else rounds
        if len(usages) >= needed_rounds:
            return cost


def _median_cost(
    command: str,
    state: str,
    usages: Sequence[Usage],
    jobs: Sequence[Usage],
    recorded: tuple[float, float],
) -> CommandCost:
    """Costs of the rounds so far; jobs : one more than rounds"""
    ratios = [
        2.0 * usage.processor / (before.processor + after.processor)
        for usage, (before, after) in zip(usages, pairwise(jobs), strict=True)
    ]
    memory = statistics.median_low(usage.memory for usage in usages)
    return CommandCost(
        command=command,
        state=state,
        arguments=COMMANDS[command],
        processor_s=statistics.median_low(usage.processor for usage in usages),
        memory_MB=memory,
        processor_ratio=statistics.median_low(ratios),
        memory_ratio=memory / statistics.median_low(job.memory for job in jobs),
        recorded_processor_ratio=recorded[0],
        recorded_memory_ratio=recorded[1],
    )


def _recorded_ratios() -> dict[tuple[str, str], tuple[float, float]]:
    """Ratios of processor time and memory by command and state."""
    with RECORDED_FILE.open(newline="", encoding="utf-8") as file:
        return {
            (row["command"], row["state"]): (
                float(row["processor_ratio"]),
                float(row["memory_ratio"]),
            )
            for row in csv.DictReader(file)
        }


def _panel(points: Sequence[CommandCost]) -> bench.Panel:
    curves = [
        bench.CostCurve(
            state,
            marker,
            sorted(
                (point.recorded_processor_ratio, point.processor_ratio)
                for point in points
                if point.state == state
            ),
        )
        for state, marker in zip((COLD, WARM), bench.MARKERS, strict=False)
    ]
    return bench.Panel(
        "processor time over the job's, as recorded",
        "processor time over the job's, now",
        curves,
    )


def _failures(points: Sequence[CommandCost]) -> list[str]:
    """A line for each command that takes more than is allowed."""
    return [
        f"{point.name}: {point.change:.2f} times what is recorded, at most "
        f"{MAX_RATIO_CHANGE:g} times are allowed"
        for point in points
        if point.change > MAX_RATIO_CHANGE
    ]


def _findings(points: Sequence[CommandCost]) -> list[str]:
    """A line for each command that has become much faster than its record."""
    return [
        f"{point.name}: {point.change:.2f} times what is recorded; the record can be "
        "lowered"
        for point in points
        if point.change < 1.0 / MAX_RATIO_CHANGE
    ]
