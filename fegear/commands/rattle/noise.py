"""Noise level and probability of not rattling."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from operator import itemgetter
from typing import Any

import numpy as np

from fegear.commands.rattle.machine_studies import (
    MAX_RETURNS,
    MIN_RETURNS,
    Z_95,
    MachineStudy,
    default_returns,
    not_converged_warning,
)
from fegear.commands.rattle.machines import NamedMachine, header_of, parameters
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.studies.page import Columns, Page, RowTable, cell, heading
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name, setting
from fegear.studies.study import Study
from fegear.studies.table import Table, finite_or_none
from lumped.common.array_types import Array
from lumped.common.options import Range
from lumped.figures.rattle import axis_labels, draw_noise
from lumped.rattle import noise as of
from lumped.rattle.attractors import QUIET
from lumped.rattle.return_map import DEFAULT_RETURNS, settling_returns

PERCENTS = 5, 50, 95  # per cent of the runs that are less loud


@dataclass(frozen=True, kw_only=True)
class RattleNoise(
    MachineStudy,
    Study,
    command="rattle noise",
    example="rattle noise roots-scaled --starts 2000 -o noise.csv",
):
    """Noise level of a machine, and its probability of not rattling.

    The noise level of a run on its attractor is the sum of the squared speeds of
    impacts over the time. Runs start at random lift-offs from the upper flank; the
    same seed gives the same runs.
    """

    starts: int = setting(
        1000,
        "Number of runs from random lift-offs, uniform over a turn and the speeds.",
        Range(1, 10_000_000),
    )
    seed: int = setting(1, "Seed of the random lift-offs.", Range(0, 2**32))
    iterations: int | None = setting(
        None,
        "Returns to the upper flank before noise is measured; turns for machines "
        "with moving parts. [default: 1499, or more without parts where low "
        "damping prolongs transients]",
        Range(MIN_RETURNS, MAX_RETURNS),
    )
    turns: int = setting(
        200, "Turns of the machine over which noise is measured.", Range(1, 1_000_000)
    )

    def tasks(self) -> Iterator[Task]:
        yield Task("runs", self._measure_noise)

    def _measure_noise(self, job: Job) -> NoiseResult:
        named = self.named
        assembly, has_moving_parts = named.assembly, bool(named.assembly.more_equations)
        starts = of.random_initial_conditions(self.starts, self.speeds, self.seed)
        try:
            settling = (
                of.settling_turns(assembly)
                if has_moving_parts
                else settling_returns(named.machine)
            )
        except ValueError as error:
            raise InputError(f"{named.name}: {error}") from None
        iterations = self.iterations or (
            DEFAULT_RETURNS if has_moving_parts else default_returns(settling)
        )
        run_arguments = starts, iterations, self.turns, partial(job.report, "runs")
        if has_moving_parts:
            noise = of.measure_noise_of_parts(assembly, *run_arguments)
        else:
            noise = of.measure_noise(named.machine, *run_arguments)
        return NoiseResult(self, self.named, noise, iterations, settling)


@dataclass(frozen=True, eq=False)
class NoiseResult(StudyResult):
    """Noise of runs of a named machine.

    settling : returns or turns that transients take to fade
    """

    study: RattleNoise
    named: NamedMachine
    noise: of.NoiseSample
    iterations: int
    settling: float

    @property
    def _run_settings(self) -> dict[str, Any]:
        names = "starts", "seed", "iterations", "turns"
        settings = {name: getattr(self.study, name) for name in names}
        return settings | {"iterations": self.iterations}

    @cached_property
    def summary(self) -> dict[str, Any]:
        noise, count = self.noise, self.study.starts
        valid = np.isfinite(noise.level) & (noise.motion >= 0)
        level, undecided = noise.level[valid], int(np.sum(noise.motion < 0))
        quiet = [
            i for i, attractor in enumerate(noise.attractors) if attractor.name == QUIET
        ]
        quiet_count = int(np.isin(noise.motion, quiet).sum())
        deviation = float(level.std(ddof=1)) if level.size > 1 else math.nan
        percentile_levels = (
            np.percentile(level, PERCENTS) if level.size else [math.nan] * len(PERCENTS)
        )
        return {
            **self.named.heading,
            **parameters(noise.machine),
            **self._run_settings,
            "velocity_rad_per_turn": list(self.study.speeds),
            "noise_rad2_per_turn3": _mean(level),
            "noise_ci95_rad2_per_turn3": finite_or_none(
                Z_95 * deviation / math.sqrt(max(level.size, 1))
            ),
            "noise_percentiles_rad2_per_turn3": {
                str(percent): finite_or_none(float(value))
                for percent, value in zip(PERCENTS, percentile_levels, strict=True)
            },
            "impacts_per_turn": _mean(noise.impacts[valid]),
            "quiet_probability": quiet_count / count,
            # undecided runs may be quiet or not
            "quiet_probability_ci95": [
                proportion_limits(quiet_count, count)[0],
                proportion_limits(quiet_count + undecided, count)[1],
            ],
            "undecided_fraction": undecided / count,
            "motions": [
                self._motion_entry(number, attractor.name)
                for number, attractor in enumerate(noise.attractors)
            ],
            "warnings": list(self._warnings(undecided / count)),
        }

    def _motion_entry(self, number: int, name: str) -> dict[str, Any]:
        selected = self.noise.motion == number
        valid = selected & np.isfinite(self.noise.level)
        return {
            "name": name,
            "fraction": float(np.mean(selected)),
            "noise_rad2_per_turn3": _mean(self.noise.level[valid]),
            "impacts_per_turn": _mean(self.noise.impacts[valid]),
        }

    def _warnings(self, undecided: float) -> Iterator[str]:
        if not self.named.assembly.more_equations:
            if undecided:
                yield not_converged_warning(
                    self.study, undecided, "runs", self.iterations, int(self.settling)
                )
        elif self.iterations < self.settling:
            fading_time = "never"
            if math.isfinite(self.settling):
                option = display_name(self.study, "iterations")
                fading_time = f"in {self.settling:.0f} turns ({option})"
            yield with_code(
                "W23",
                f"transients of the parts fade to {of.INAUDIBLE:g} {fading_time}, runs "
                f"are given {self.iterations}: noise may still fall, unless impacts "
                "end them",
            )

    @property
    def table(self) -> Table:
        """A row for each run."""
        noise, (low, high) = self.noise, self.study.speeds
        motion_names = np.array(
            [*(attractor.name for attractor in noise.attractors), "undecided"]
        )
        columns = {
            "start_time_turns": noise.starts[:, 0],
            "start_speed_rad_per_turn": noise.starts[:, 1],
            "motion": motion_names[noise.motion],
            "noise_rad2_per_turn3": noise.level,
            "impacts_per_turn": noise.impacts,
        }
        header = {
            "machine": self.named.name,
            **header_of(parameters(noise.machine)),
        }
        run_arguments = {"velocity_rad_per_turn": f"{low}:{high}", **self._run_settings}
        return Table.of(
            columns, header | {key: str(run_arguments[key]) for key in run_arguments}
        )

    @property
    def figures(self) -> dict[str, Draw]:
        title = f"{self.named.name}: {axis_labels(self.noise.machine)}"
        return {"plot": partial(draw_noise, self.noise, title)}

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        low, high = (100.0 * limit for limit in values["quiet_probability_ci95"])
        yield with_code(
            "E07",
            f"quiet with a probability of {100.0 * values['quiet_probability']:.1f} %, "
            f"{low:.1f} to {high:.1f} % by {values['starts']} runs from speeds up to "
            f"{self.study.speeds[1]:.4g} rad per turn",
        )
        if values["noise_rad2_per_turn3"] is not None:
            error_limit = values["noise_ci95_rad2_per_turn3"]
            error = "" if error_limit is None else f" +- {error_limit:.2g}"
            yield with_code(
                "E08",
                f"noise level {values['noise_rad2_per_turn3']:.4g}{error} "
                f"rad2 per turn3, {values['impacts_per_turn']:.3g} impacts per turn",
            )
        columns: Columns = {
            "motion": itemgetter("name"),
            "part [%]": lambda row: f"{100.0 * row['fraction']:.2f}",
            "noise level\n[rad2 per turn3]": cell("noise_rad2_per_turn3"),
            "impacts\nper turn": cell("impacts_per_turn"),
        }
        yield RowTable(values["motions"], columns)
        if values["undecided_fraction"]:
            yield with_code(
                "E09",
                "attractor undecided, left out of the noise level: "
                f"{100.0 * values['undecided_fraction']:.2f} % of runs",
            )


def _mean(values: Array) -> float | None:
    """Mean, None without values."""
    return float(values.mean()) if values.size else None


def proportion_limits(count: int, of: int) -> tuple[float, float]:
    """95 % confidence interval of a probability (Wilson).

    E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
    """
    percent, square = count / of, Z_95**2 / of
    middle = (percent + 0.5 * square) / (1.0 + square)
    half = math.sqrt(percent * (1.0 - percent) * square + 0.25 * square**2) / (
        1.0 + square
    )
    return max(middle - half, 0.0), min(middle + half, 1.0)
