"""Noise of a machine: how loud it is, and how likely it runs quietly."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from fegear.errors import InputError
from fegear.rattle.choice import MovingMachine, limits
from fegear.rattle.limits import LEAST_RETURNS, MOST_RETURNS
from fegear.result import Result
from fegear.studies.page import Grid, Page, heading, number
from fegear.studies.study import Job, Range, Study, Task, setting

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fegear.rattle.machines import NamedMachine
    from fegear.studies.table import Table
    from lumped.rattle.noise import Noise as Measured

    Array = NDArray[np.float64]

SURE = 1.96  # standard errors of an interval that holds the value 19 times of 20
PARTS = 5, 50, 95  # per cent of the runs that are less loud


@dataclass(frozen=True, kw_only=True)
class Noise(
    Study,
    command="rattle noise",
    example="rattle noise roots-scaled --starts 2000 -o noise.csv",
):
    """How loud a machine is, and how likely it runs quietly.

    The noise level of a run that has settled is the sum of the squared speeds at which
    flanks meet, over the time. Runs start at random departures from the upper flank;
    the same seed gives the same runs.
    """

    machine: MovingMachine
    velocity: tuple[float, float] | None = limits(
        "velocity",
        "Speeds of departure that are looked at [rad per turn]. [default: 0 to 4 pi "
        "damping + 4 half backlashes, or what forcing can give]",
    )
    starts: int = setting(
        1000,
        "Runs from random departures, spread evenly over a turn and the speeds.",
        Range(least=1, most=10_000_000),
    )
    seed: int = setting(
        1,
        "Number from which the random departures are made.",
        Range(least=0, most=2**32),
    )
    iterations: int | None = setting(
        None,
        "Returns to the upper flank before noise is measured; turns where parts of the "
        "machine move on their own. [default: 1499, more where damping needs more to "
        "end transients, but not with parts]",
        Range(least=LEAST_RETURNS, most=MOST_RETURNS),
    )
    turns: int = setting(
        200,
        "Turns of the machine over which it is measured.",
        Range(least=1, most=10**6),
    )

    def tasks(self) -> Iterator[Task]:
        yield Task("runs", self._measured)

    def _measured(self, job: Job) -> NoiseResult:
        from lumped.rattle import noise as of
        from lumped.rattle.departures import RETURNS, settling_returns
        from lumped.rattle.orbits import usual_speed

        named = self.machine.named
        assembly, many = named.assembly, bool(named.assembly.more_equations)
        velocity = self.velocity or (0.0, usual_speed(assembly.shafts_in_impacts))
        starts = of.random_departures(self.starts, velocity, self.seed)
        try:
            settling = (
                of.settling_turns(assembly) if many else settling_returns(named.machine)
            )
        except ValueError as error:
            raise InputError(f"{named.name}: {error}") from None
        few = many or settling > MOST_RETURNS
        iterations = self.iterations or (RETURNS if few else int(settling))
        how = starts, iterations, self.turns, partial(job.report, "runs")
        if many:
            noise = of.measure_noise_of_parts(assembly, *how)
        else:
            noise = of.measure_noise(named.machine, *how)
        return NoiseResult(self, named, velocity, noise, iterations, settling)

    def gather(self, found: Mapping[str, Any]) -> NoiseResult:
        result: NoiseResult = found["runs"]
        return result


@dataclass(frozen=True, eq=False, repr=False)
class NoiseResult(Result):
    """Noise of runs of a named machine.

    velocity : lowest and highest speed of a start [rad per turn]
    settling : returns or turns that transients take to fade
    """

    study: Noise
    named: NamedMachine
    velocity: tuple[float, float]
    noise: Measured
    iterations: int
    settling: float

    @property
    def _asked(self) -> dict[str, Any]:
        own = self.study
        return {
            "velocity_rad_per_turn": list(self.velocity),
            "starts": own.starts,
            "seed": own.seed,
            "iterations": self.iterations,
            "turns": own.turns,
        }

    @cached_property
    def summary(self) -> dict[str, Any]:
        import numpy as np

        from fegear.rattle.machines import figures_of
        from lumped.rattle.attractors import QUIET

        noise, names = self.noise, self.noise.attractors
        level = noise.level[np.isfinite(noise.level) & (noise.motion >= 0)]
        impacts = noise.impacts[np.isfinite(noise.level) & (noise.motion >= 0)]
        quiet = [i for i, each in enumerate(names) if each.name == QUIET]
        silent = int(np.isin(noise.motion, quiet).sum())
        unclear, count = int(np.sum(noise.motion < 0)), len(noise.level)
        spread = float(level.std(ddof=1)) if level.size > 1 else math.nan
        parts = np.percentile(level, PARTS) if level.size else [math.nan] * len(PARTS)
        return {
            **self.named.heading,
            **figures_of(noise.machine),
            **self._asked,
            "noise_rad2_per_turn3": _mean(level),
            "noise_within_rad2_per_turn3": _plain(
                SURE * spread / math.sqrt(max(level.size, 1))
            ),
            "noise_percentiles_rad2_per_turn3": {
                str(part): _plain(float(value))
                for part, value in zip(PARTS, parts, strict=True)
            },
            "impacts_per_turn": _mean(impacts),
            "quiet_probability": silent / count,
            # runs that are not clear may be quiet or not
            "quiet_probability_within": [
                proportion_limits(silent, count)[0],
                proportion_limits(silent + unclear, count)[1],
            ],
            "unclear_fraction": unclear / count,
            "motions": [self._motion(i, each.name) for i, each in enumerate(names)],
            "warnings": list(self._warnings(unclear / count)),
        }

    def _motion(self, number: int, name: str) -> dict[str, Any]:
        own = self.noise.motion == number
        own_level = self.noise.level[own]
        known = own_level == own_level
        return {
            "name": name,
            "fraction": float(own.mean()),
            "noise_rad2_per_turn3": _mean(own_level[known]),
            "impacts_per_turn": _mean(self.noise.impacts[own][known]),
        }

    def _warnings(self, unclear: float) -> Iterator[str]:
        from fegear.rattle.basins import unsettled
        from lumped.rattle.noise import FADED

        if not self.named.assembly.more_equations:
            if unclear:
                yield unsettled(unclear, "runs", self.iterations, int(self.settling))
        elif self.iterations < self.settling:
            lasts = "never"
            if math.isfinite(self.settling):
                lasts = f"in {self.settling:.0f} turns (--iterations)"
            yield (
                f"transients of the parts fade to {FADED:g} {lasts}, runs are given "
                f"{self.iterations}: noise may still fall, unless impacts end them"
            )

    @property
    def table(self) -> Table:
        """A row for each run."""
        from fegear.rattle.machines import figures_of, header_of
        from fegear.studies.table import Table

        low, high = self.velocity
        asked = self._asked | {"velocity_rad_per_turn": f"{low}:{high}"}
        header = {
            "machine": self.named.name,
            **header_of(figures_of(self.noise.machine)),
            **{key: str(value) for key, value in asked.items()},
        }
        names = (
            *("start_time_turns", "start_speed_rad_per_turn", "motion"),
            *("noise_rad2_per_turn3", "impacts_per_turn"),
        )
        return Table(names, self._rows, header)

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        noise = self.noise
        words = [*(each.name for each in noise.attractors), "not clear"]
        motions = (words[number] for number in noise.motion)
        columns = (*noise.starts.T.tolist(), motions, noise.level, noise.impacts)
        return zip(*columns, strict=True)

    @property
    def figures(self) -> dict[str, Callable[[], Figure]]:
        from lumped.rattle.figure import draw_noise, words_of

        title = f"{self.named.name}: {words_of(self.noise.machine)}"
        return {"plot": partial(draw_noise, self.noise, title)}

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        low, high = (100.0 * each for each in values["quiet_probability_within"])
        yield (
            f"quiet with a probability of {100.0 * values['quiet_probability']:.1f} %, "
            f"{low:.1f} to {high:.1f} % by {values['starts']} runs from speeds up to "
            f"{self.velocity[1]:.4g} rad per turn"
        )
        if values["noise_rad2_per_turn3"] is not None:
            within = values["noise_within_rad2_per_turn3"]
            error = "" if within is None else f" +- {within:.2g}"
            yield (
                f"noise level {values['noise_rad2_per_turn3']:.4g}{error} "
                f"rad2 per turn3, {values['impacts_per_turn']:.3g} impacts per turn"
            )
        grid = Grid(
            ("motion", "part [%]", "noise level\n[rad2 per turn3]", "impacts\nper turn")
        )
        for each in values["motions"]:
            level, impacts = each["noise_rad2_per_turn3"], each["impacts_per_turn"]
            shown = ("" if v is None else number(v, 4) for v in (level, impacts))
            grid.add(each["name"], f"{100.0 * each['fraction']:.2f}", *shown)
        yield grid
        if values["unclear_fraction"]:
            yield (
                "not clear what is settled to, and left out of the noise level: "
                f"{100.0 * values['unclear_fraction']:.2f} % of runs"
            )


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
