"""The result of `fegear clatter`: its page, tables and figures."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.commands.clatter.gearboxes import NamedGearbox
from fegear.files.codes import with_code
from fegear.studies.page import Columns, Page, RowTable, cell, heading
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table, finite_or_none
from lumped.clatter.chaos import correlation_dimension
from lumped.clatter.gearbox import LooseWheel
from lumped.clatter.group_runs import GroupRun, is_superstable
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import noise_of
from lumped.common.csv_text import format_exact
from lumped.figures.clatter import draw_attractor, draw_motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SHOWN_PERIODS = 12  # periods of a plot of the motion

REST_WORDS = ", where it rests on an edge: the map ends there"

NOISE_KEYS = (  # of a play in the summary: what of its noise
    ("impacts", "impacts"),
    ("noise_m2_per_s3", "level"),
    ("lost_power_W", "power"),
    ("fastest_m_per_s", "fastest"),
)


@dataclass(frozen=True, eq=False)
class ClatterResult(StudyResult):
    """Impacts of a gearbox, by wheels that depend on each other.

    wheel : the one that is drawn
    """

    study: Any
    named: NamedGearbox
    wheel: LooseWheel
    runs: tuple[GroupRun, ...]

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            **self.named.heading,
            "map": self.study.kind,
            "wheels": [
                self._wheel_values(r, wheel)
                for r in self.runs
                for wheel in r.group.wheels
            ],
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        for run in self.runs:
            if run.seconds < self.study.seconds * (1.0 - 1e-12):
                rests = len(run.impacts) < self.study.impacts
                yield with_code(
                    "W21",
                    f"wheel {run.name}: ends after {run.seconds:.6g} s and "
                    f"{len(run.impacts)} impacts{REST_WORDS if rests else ''}",
                )

    def _wheel_values(self, run: GroupRun, wheel: LooseWheel) -> dict[str, Any]:
        noise = noise_of(run.group, run.impacts, run.seconds)
        plays = [
            {"play": play_noise.play}
            | {key: getattr(play_noise, name) for key, name in NOISE_KEYS}
            for play_noise in noise
            if play_noise.wheel == wheel.name
        ]
        values = {"name": wheel.name, "seconds": run.seconds, "plays": plays}
        values |= {key: sum(play[key] for play in plays) for key, _ in NOISE_KEYS[:3]}
        return values | (self._chaos_values(run, wheel) if self.study.chaos else {})

    def _chaos_values(self, run: GroupRun, wheel: LooseWheel) -> dict[str, Any]:
        unit, exponent = run.exponent(self.study.kind)
        phase, speed, _ = run.teeth(wheel)
        dimension = error = math.nan
        if not is_superstable(exponent):
            dimension, error = correlation_dimension(phase, speed)
        return {
            f"lyapunov_exponent_per_{unit}": finite_or_none(exponent),
            "superstable": is_superstable(exponent),
            "correlation_dimension": finite_or_none(dimension),
            "correlation_dimension_error": finite_or_none(error),
        }

    @property
    def table(self) -> Table:
        """A row for each contact that was struck, in the order of time."""
        header = {
            "gearbox": self.named.name,
            "map": self.study.kind,
            "seconds": format_exact(self.study.seconds),
        }
        for place, warning in enumerate(self._warnings(), 1):
            header[f"warning {place}"] = warning
        names = (
            *("time_s", "wheel", "play", "edge"),
            *("approach_speed_m_per_s", "impulse_Ns", "lost_energy_J"),
        )
        return Table(names, self._rows, header)

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        return heapq.merge(*map(_rows_of_run, self.runs), key=lambda row: row[0])

    @property
    def figures(self) -> dict[str, Draw]:
        wheel = self.wheel
        run = next(run for run in self.runs if wheel in run.group.wheels)
        title = f"{self.named.name}: {wheel.name}"
        return {
            "plot": partial(self._draw_motion, run.group),
            "attractor": partial(draw_attractor, *run.teeth(wheel), title),
        }

    def _draw_motion(self, group: WheelGroup) -> Figure:
        """Plays of the wheel over the first periods of the run."""
        lasts = min(SHOWN_PERIODS * group.excitation.period, self.study.seconds)
        times = np.linspace(0.0, lasts, 2400)
        start, wheel = self.study.start_of(group), self.wheel
        return draw_motion(group, wheel, start, times, self.named.name)

    def page(self) -> Page:
        yield from heading(self.named)
        wheels = self.summary["wheels"]
        plays = [{**wheel, **play} for wheel in wheels for play in wheel["plays"]]
        columns: Columns = {
            "wheel": itemgetter("name"),
            "play": itemgetter("play"),
            "impacts\nper s": cell("impacts", over="seconds"),
            "noise level\n[m2 per s3]": cell("noise_m2_per_s3"),
            "lost\n[mW]": cell("lost_power_W", scale=1e3),
            "fastest\n[mm/s]": cell("fastest_m_per_s", scale=1e3),
        }
        yield RowTable(plays, columns)
        for wheel in wheels:
            yield (
                f"wheel {wheel['name']}: {wheel['impacts']} impacts in "
                f"{wheel['seconds']:.6g} s, noise level {wheel['noise_m2_per_s3']:.4g} "
                "m2 per s3"
            )
            yield from _chaos_text(wheel)


def _chaos_text(wheel: Mapping[str, Any]) -> Iterator[str]:
    for unit in ("s", "impact"):
        exponent = wheel.get(f"lyapunov_exponent_per_{unit}")
        if exponent is not None:
            yield f"largest Lyapunov exponent {exponent:.4g} per {unit}"
    if wheel.get("superstable"):
        yield "no Lyapunov exponent: contact erases the initial state"
    elif "correlation_dimension" in wheel:
        dimension = wheel["correlation_dimension"]
        error = wheel["correlation_dimension_error"]
        if dimension is None:
            line = "no correlation dimension: impacts of teeth are few, or do not scale"
        else:
            line = (
                f"correlation dimension of its impacts {dimension:.2f} +- {error:.2f}"
            )
        yield with_code("E10", line)


def _rows_of_run(run: GroupRun) -> Iterator[tuple[Any, ...]]:
    names = [(wheel.name, play) for wheel, play in run.group.plays]
    impacts = run.impacts
    columns = (
        impacts.time,
        impacts.play,
        impacts.edge,
        impacts.speed,
        impacts.impulse,
        impacts.lost,
    )
    for time, play, edge, *rest in zip(*(c.tolist() for c in columns), strict=True):
        yield time, *names[play], "upper" if edge > 0 else "lower", *rest
