"""What a file of a recording holds, before it is one: columns, and times or rates."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lumped.common.array_types import Array

TIME_NAMES = ("time_s", "time", "t")
RATE_NAMES = ("sampling_rate", "sample_rate", "samplerate", "rate", "fs")
STEP_NAMES = ("sampling_step", "dt")
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3}
SECONDS |= dict.fromkeys(("us", "\u00b5s", "\u03bcs"), 1e-6)  # two letters of Unicode
HERTZ = {"": 1.0, "hz": 1.0, "khz": 1e3, "mhz": 1e6}
# a unit in brackets, or behind a space or underscore; s and hz also without
UNIT = re.compile(r"[\s_]*(?:\[(.*)\]|\((.*)\)|(?<=[\s_])(ms|us|khz|mhz)|(hz|s))?\s*$")


@dataclass(frozen=True, eq=False)
class StoredChannels:
    """Columns of a file.

    columns : values (n,) by name, in the order of the file; their n may differ
    time : times of the samples (n,) [s], None where there are none
    rates : sampling rates by name [Hz], of the columns that have one
    starts : times of the first sample by name [s], of the columns that have one
    """

    columns: Mapping[str, Array]
    time: Array | None = None
    rates: Mapping[str, float] = field(default_factory=dict)
    starts: Mapping[str, float] = field(default_factory=dict)


def seconds_of(name: str) -> float | None:
    """Unit [s] of the times that a column of that name has, as `time_s`, `Time [ms]`.

    None where it has no times, or those of another unit.
    """
    return _unit_of(name, TIME_NAMES, SECONDS)


def recording_rank(names: Collection[str]) -> int:
    """How likely variables of these names are a recording, 0 where none is there."""
    is_timed = any(seconds_of(name) or _rate_of(name, 1.0) for name in names)
    return 2 * is_timed + bool(names)


def channels_of_arrays(arrays: Mapping[str, Any]) -> StoredChannels:
    """Channels of the arrays of numbers among variables.

    A vector is a channel, a matrix has one in each column, or row where these are
    longer. Single numbers are the rate, where that is their name, or left out.
    """
    columns: dict[str, Array] = {}
    time, rate = None, None
    for name, value in arrays.items():
        if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
            continue
        if value.size == 1:
            rate = _rate_of(name, float(value.ravel()[0])) or rate
        elif value.ndim == 1 or (value.ndim == 2 and 1 in value.shape):
            seconds = seconds_of(name)
            if time is None and seconds:
                time = seconds * value.ravel().astype(float)
            else:
                columns[name] = value.ravel().astype(float)
        elif value.ndim == 2:
            rows = value if value.shape[0] < value.shape[1] else value.T
            for number, row in enumerate(rows, start=1):
                columns[f"{name}{number}"] = np.array(row, float)
    return StoredChannels(columns, time, dict.fromkeys(columns, rate) if rate else {})


def _rate_of(name: str, value: float) -> float | None:
    """A sampling rate [Hz] that a number of that name gives."""
    hertz = _unit_of(name, RATE_NAMES, HERTZ)
    if hertz:
        return hertz * value
    seconds = _unit_of(name, STEP_NAMES, SECONDS)
    if seconds and value:
        return 1.0 / (seconds * value)
    return None


def _unit_of(
    name: str, names: Collection[str], units: Mapping[str, float]
) -> float | None:
    """Value of the unit at the end of a name; None where it is not one of the names."""
    lower = name.strip().lower()
    if lower in names:
        return 1.0
    match = UNIT.search(lower)
    if match is None or lower[: match.start()] not in names:
        return None
    unit = next((part for part in match.groups() if part is not None), "")
    return units.get(unit.strip())
