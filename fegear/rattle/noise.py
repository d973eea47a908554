"""Noise level of a machine over random departures: measured, summed up and written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.errors import InputError
from fegear.rattle.basins import unsettled
from fegear.rattle.limits import MOST_RETURNS
from fegear.rattle.machines import NamedMachine, figures_of, header_of
from fegear.result import Result
from lumped.csv_text import format_csv
from lumped.rattle.attractors import QUIET
from lumped.rattle.departures import RETURNS, settling_returns
from lumped.rattle.figure import draw_noise, words_of
from lumped.rattle.noise import (
    FADED,
    Noise,
    measure_noise,
    measure_noise_of_parts,
    random_departures,
    settling_turns,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fegear.statics import Progress

Array = NDArray[np.float64]
SURE = 1.96  # standard errors of an interval that holds the value 19 times of 20
PARTS = 5, 50, 95  # per cent of the runs that are less loud


@dataclass(frozen=True, kw_only=True)
class Runs:
    """Which runs are made.

    starts : random departures; seed : that makes them again
    velocity : lowest and highest speed of a start [rad per turn]
    iterations : returns to the upper flank until noise is measured, of machines whose
        relative motion has more than one equation turns; by default what transients
        take to fade, RETURNS of such machines and where that is more than is allowed
    turns : over which it is measured
    """

    starts: int = 1000
    seed: int = 1
    velocity: tuple[float, float]
    iterations: int | None = None
    turns: int = 200


@dataclass(frozen=True, eq=False, repr=False)
class NoiseResult(Result):
    """Noise of runs of a named machine."""

    named: NamedMachine
    runs: Runs
    noise: Noise
    iterations: int
    settling: float  # returns or turns that transients take to fade

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        noise, names = self.noise, self.noise.attractors
        known = np.isfinite(noise.level) & (noise.motion >= 0)
        level = noise.level[known]
        count = len(noise.level)
        quiet = [i for i, each in enumerate(names) if each.name == QUIET]
        silent = int(np.isin(noise.motion, quiet).sum())
        unclear = int(np.sum(noise.motion < 0))
        # runs that are not clear may be quiet or not
        low, _ = proportion_limits(silent, count)
        _, high = proportion_limits(silent + unclear, count)
        spread = float(level.std(ddof=1)) if level.size > 1 else math.nan
        parts = np.percentile(level, PARTS) if level.size else [math.nan] * len(PARTS)
        return {
            **self.named.heading,
            **figures_of(noise.machine),
            "starts": count,
            "seed": self.runs.seed,
            "velocity_rad_per_turn": list(self.runs.velocity),
            "iterations": self.iterations,
            "turns": self.runs.turns,
            "noise_rad2_per_turn3": float(level.mean()) if level.size else None,
            "noise_within_rad2_per_turn3": _plain(
                SURE * spread / math.sqrt(max(level.size, 1))
            ),
            "noise_percentiles_rad2_per_turn3": {
                str(part): _plain(float(value))
                for part, value in zip(PARTS, parts, strict=True)
            },
            "impacts_per_turn": _mean(noise.impacts[known]),
            "quiet_probability": silent / count,
            "quiet_probability_within": [low, high],
            "unclear_fraction": float(np.mean(noise.motion < 0)),
            "motions": [self._motion(i, each.name) for i, each in enumerate(names)],
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        unclear = float(np.mean(self.noise.motion < 0))
        if self.named.assembly.more_equations:
            if self.iterations >= self.settling:
                return
            lasts = "never"
            if math.isfinite(self.settling):
                lasts = f"in {self.settling:.0f} turns (--iterations)"
            yield (
                f"transients of the parts fade to {FADED:g} {lasts}, runs are given "
                f"{self.iterations}: noise may still fall, unless impacts end them"
            )
        elif unclear:
            yield unsettled(unclear, "runs", self.iterations, int(self.settling))

    def _motion(self, number: int, name: str) -> dict[str, Any]:
        own = self.noise.motion == number
        level, impacts = self.noise.level[own], self.noise.impacts[own]
        return {
            "name": name,
            "fraction": float(np.mean(own)),
            "noise_rad2_per_turn3": _mean(level[np.isfinite(level)]),
            "impacts_per_turn": _mean(impacts[np.isfinite(level)]),
        }

    def csv(self) -> str:
        """A row for each run."""
        names = [
            *("start_time_turns", "start_speed_rad_per_turn", "motion"),
            *("noise_rad2_per_turn3", "impacts_per_turn"),
        ]
        low, high = self.runs.velocity
        how = {
            "velocity_rad_per_turn": f"{low}:{high}",
            "starts": self.runs.starts,
            "seed": self.runs.seed,
            "iterations": self.iterations,
            "turns": self.runs.turns,
        }
        header = {
            "machine": self.named.name,
            **header_of(figures_of(self.noise.machine)),
            **{key: str(value) for key, value in how.items()},
        }
        return format_csv(names, self._rows(), header)

    def _rows(self) -> Iterator[list[object]]:
        noise = self.noise
        words = [*(each.name for each in noise.attractors), "not clear"]
        rows = zip(noise.starts, noise.motion, noise.level, noise.impacts, strict=True)
        for (time, speed), motion, level, impacts in rows:
            yield [
                *map(float, (time, speed)),
                words[motion],
                *map(float, (level, impacts)),
            ]

    def draw(self) -> Figure:
        title = f"{self.named.name}: {words_of(self.noise.machine)}"
        return draw_noise(self.noise, title)


def _mean(values: Array) -> float | None:
    """None of no values."""
    return float(values.mean()) if values.size else None


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None


def proportion_limits(count: int, of: int) -> tuple[float, float]:
    """Between which a probability lies, 19 times of 20, of which so many were seen.

    E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
    """
    part, square = count / of, SURE**2 / of
    middle = (part + 0.5 * square) / (1.0 + square)
    half = math.sqrt(part * (1.0 - part) * square + 0.25 * square**2) / (1.0 + square)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def find_noise(
    named: NamedMachine,
    runs: Runs,
    report: Progress = lambda what, done, total: None,
) -> NoiseResult:
    """Noise of runs from random departures, once they have settled."""
    starts = random_departures(runs.starts, runs.velocity, runs.seed)
    many = bool(named.assembly.more_equations)
    try:
        settling = (
            settling_turns(named.assembly) if many else settling_returns(named.machine)
        )
    except ValueError as error:
        raise InputError(f"{named.name}: {error}") from None
    few = many or settling > MOST_RETURNS
    iterations = runs.iterations or (RETURNS if few else int(settling))
    how = iterations, runs.turns, lambda done, total: report("runs", done, total)
    if many:
        noise = measure_noise_of_parts(named.assembly, starts, *how)
    else:
        noise = measure_noise(named.machine, starts, *how)
    return NoiseResult(named, runs, noise, iterations, settling)
