"""Damping of a machine from a run-down that was measured."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.errors import InputError
from fegear.output import read_text
from lumped.csv_text import TableError, parse_csv
from lumped.rattle.machine import TURN
from lumped.rattle.run_down import fit_run_down

Array = NDArray[np.float64]
AGREE = 0.1  # by which the rates of both halves may differ if drag goes with speed
SURE = 3.0  # standard errors by which they may differ by chance
FEWEST = 6  # rows
TIME = "time_s"
TURNS_PER_SECOND = {
    "speed_rpm": 1.0 / 60.0,
    "speed_Hz": 1.0,
    "speed_rad_per_s": 1.0 / TURN,
}


def run_down_summary(
    path: str, speed: float | None = None, inertia: float | None = None
) -> dict[str, Any]:
    """Damping with its standard error, plain values ready for JSON.

    speed : at which the machine runs [rpm], by default that of the test's start
    inertia : of a shaft [kg m2], where its damping coefficient is asked for
    Raises InputError, in one line, on a file that cannot be used.
    """
    time, turns = _read(Path(path))
    half = time.size // 2
    if time.size < FEWEST:
        raise InputError(
            f"{path}: {FEWEST} rows at least are needed, half of them for each part of "
            f"the way, got {time.size}"
        )
    try:
        whole = fit_run_down(time, turns)
        first = fit_run_down(time[:half], turns[:half])
        second = fit_run_down(time[half:], turns[half:])
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{path}: {error}") from None
    if not whole.rate > 0.0:
        raise InputError(f"{path}: the speed does not fall, its rate is {whole.rate:g}")
    apart = abs(first.rate - second.rate)
    sure = SURE * math.hypot(first.rate_error, second.rate_error)
    running = whole.start if speed is None else speed / 60.0
    return {
        "file": path,
        "rows": int(time.size),
        "rate_per_s": whole.rate,
        "rate_standard_error_per_s": whole.rate_error,
        "rate_of_first_half_per_s": first.rate,
        "rate_of_second_half_per_s": second.rate,
        "drag_goes_with_speed": apart <= max(sure, AGREE * whole.rate),
        "speed_at_start_rpm": 60.0 * whole.start,
        "residual_rms_rpm": 60.0 * whole.residual,
        "speed_rpm": 60.0 * running,
        "damping": whole.rate / running,
        "damping_standard_error": whole.rate_error / running,
        "damping_coefficient_Nms_per_rad": (
            None if inertia is None else whole.rate * inertia
        ),
    }


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


def _number(place: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise InputError(f"{place}: {cell!r} is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{place}: {cell!r}; must be a finite number")
    return value
