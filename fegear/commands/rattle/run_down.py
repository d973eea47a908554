"""Damping of a machine from a run-down that was measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.output import read_text
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from lumped.common.array_types import Array
from lumped.common.csv_text import TableError, parse_csv
from lumped.common.options import Range
from lumped.rattle.machine import TURN
from lumped.rattle.run_down import ExponentialFit as Fitted
from lumped.rattle.run_down import fit_run_down

ABOVE = Range(above=0.0, below=math.inf)
AGREE = 0.1  # by which the rates of both halves may differ if drag goes with speed
MAX_Z = 3.0  # standard errors by which they may differ by chance
MIN_READINGS = 6  # rows
TIME = "time_s"
TURNS_PER_SECOND = {
    "speed_rpm": 1.0 / 60.0,
    "speed_Hz": 1.0,
    "speed_rad_per_s": 1.0 / TURN,
}


@dataclass(frozen=True, kw_only=True)
class RunDown(
    Study,
    command="rattle run-down",
    example="rattle run-down measured.csv --speed-rpm 3000",
):
    """Damping of a machine from its speed after the motor is switched off.

    An exponential is fitted to the speed; its rate over the speed in turns per second
    is the parameter `damping` of a machine.
    """

    pictures: ClassVar[Mapping[str, str]] = {}

    file: str = argument(
        "FILE",
        "CSV file of time_s and speed_rpm, speed_Hz or speed_rad_per_s.",
        reads=True,
    )
    speed_rpm: float | None = setting(
        None,
        "Speed at which the machine runs [rpm]. [default: the test's first]",
        ABOVE,
    )
    inertia_kgm2: float | None = setting(
        None,
        "Inertia of a shaft [kg m2], for its damping coefficient. [default: none]",
        ABOVE,
    )

    def tasks(self) -> Iterator[Task]:
        yield Task("fit", self._fit_decays)

    def _fit_decays(self, job: Job) -> RunDownResult:
        time, turns = _read(Path(self.file))
        half = time.size // 2
        if time.size < MIN_READINGS:
            raise InputError(
                f"{self.file}: {MIN_READINGS} rows at least are needed, half of them "
                f"for each part of the way, got {time.size}"
            )
        parts = slice(None), slice(half), slice(half, None)
        try:
            fits = [fit_run_down(time[part], turns[part]) for part in parts]
        except (ValueError, RuntimeError) as error:
            raise InputError(f"{self.file}: {error}") from None
        if not fits[0].rate > 0.0:
            reason = f"the speed does not fall, its rate is {fits[0].rate:g}"
            raise InputError(f"{self.file}: {reason}")
        return RunDownResult(self, time, turns, *fits)


@dataclass(frozen=True, eq=False)
class RunDownResult(StudyResult):
    """Exponentials fitted to a run-down and to both of its halves.

    time : (n,) [s]; turns : (n,) speed [turns per second]
    """

    study: RunDown
    time: Array
    turns: Array
    whole: Fitted
    first: Fitted
    second: Fitted

    @cached_property
    def summary(self) -> dict[str, Any]:
        whole, first, second = self.whole, self.first, self.second
        speed, inertia = self.study.speed_rpm, self.study.inertia_kgm2
        difference_in_errors = abs(first.rate - second.rate)
        has_agreeing_halves = MAX_Z * math.hypot(first.rate_error, second.rate_error)
        running = whole.start if speed is None else speed / 60.0
        return {
            "file": self.study.file,
            "rows": int(self.time.size),
            "rate_per_s": whole.rate,
            "rate_standard_error_per_s": whole.rate_error,
            "rate_of_first_half_per_s": first.rate,
            "rate_of_second_half_per_s": second.rate,
            "drag_is_linear": difference_in_errors
            <= max(has_agreeing_halves, AGREE * whole.rate),
            "speed_at_start_rpm": 60.0 * whole.start,
            "residual_rms_rpm": 60.0 * whole.residual,
            "speed_rpm": 60.0 * running,
            "damping": whole.rate / running,
            "damping_standard_error": whole.rate_error / running,
            "damping_coefficient_Nms_per_rad": (
                None if inertia is None else whole.rate * inertia
            ),
        }

    @property
    def table(self) -> Table:
        """The speeds that were measured, and the exponential at their times."""
        decay = np.exp(-self.whole.rate * (self.time - self.time[0]))
        columns = {
            TIME: self.time,
            "speed_rpm": 60.0 * self.turns,
            "fitted_speed_rpm": 60.0 * self.whole.start * decay,
        }
        return Table.of(columns, {"file": self.study.file})

    def page(self) -> Page:
        values = self.summary
        yield with_code(
            "E14",
            f"{values['file']}: rate {values['rate_per_s']:.4g} +- "
            f"{values['rate_standard_error_per_s']:.2g} per s from "
            f"{values['speed_at_start_rpm']:.4g} rpm, {values['rows']} rows",
        )
        yield with_code(
            "E14",
            f"damping {values['damping']:.4g} +- "
            f"{values['damping_standard_error']:.2g} at {values['speed_rpm']:.4g} rpm",
        )
        coefficient = values["damping_coefficient_Nms_per_rad"]
        if coefficient is not None:
            yield f"damping coefficient of a shaft {coefficient:.4g} N m s/rad"
        residual = f"residual {values['residual_rms_rpm']:.3g} rpm, root mean square"
        yield with_code("E15", residual)
        one, two = self.first.rate, self.second.rate
        halves = f"rate of the first half {one:.4g}, of the second half {two:.4g} per s"
        yield with_code("E16", halves)
        if not values["drag_is_linear"]:
            yield "they differ: the drag does not go with the speed alone"


def _read(path: Path) -> tuple[Array, Array]:
    """Times [s] and speeds [turns per second] (n,)."""
    try:
        table = parse_csv(read_text(path), str(path))
    except TableError as error:
        raise InputError(str(error)) from None
    speeds = [name for name in TURNS_PER_SECOND if name in table.names]
    if TIME not in table.names or len(speeds) != 1:
        raise InputError(
            f"{path}: columns {', '.join(table.names)}; needed are {TIME} and one of "
            f"{', '.join(TURNS_PER_SECOND)}"
        )
    places = table.names.index(TIME), table.names.index(speeds[0])
    rows = [
        [_number(place, row[i]) for i in places] for place, row in table.rows.items()
    ]
    time, speed = np.array(rows, float).reshape(-1, 2).T
    return time, speed * TURNS_PER_SECOND[speeds[0]]


def _number(place: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{place}: {text!r} is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{place}: {text!r}; must be a finite number")
    return value
