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
UNIT = re.compile(r"[\s_]*(\[.*\]|\(.*\)|hz|s)?\s*$", re.IGNORECASE)


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


def is_time(name: str) -> bool:
    """Whether a column of that name has times, such as `time_s` and `Time [s]`."""
    return name.strip().lower() in TIME_NAMES or _base_name(name) in TIME_NAMES


def recording_rank(names: Collection[str]) -> int:
    """How likely variables of these names are a recording, 0 where none is there."""
    numbers = {_base_name(name) for name in names}
    is_timed = not numbers.isdisjoint((*TIME_NAMES, *RATE_NAMES, *STEP_NAMES))
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
            if time is None and is_time(name):
                time = value.ravel().astype(float)
            else:
                columns[name] = value.ravel().astype(float)
        elif value.ndim == 2:
            rows = value if value.shape[0] < value.shape[1] else value.T
            for number, row in enumerate(rows, start=1):
                columns[f"{name}{number}"] = np.array(row, float)
    return StoredChannels(columns, time, dict.fromkeys(columns, rate) if rate else {})


def _rate_of(name: str, value: float) -> float | None:
    """A sampling rate [Hz] that a number of that name gives."""
    base = _base_name(name)
    if base in RATE_NAMES:
        return value
    if base in STEP_NAMES and value:
        return 1.0 / value
    return None


def _base_name(name: str) -> str:
    """A name in small letters without the unit at its end."""
    lower = name.strip().lower()
    return lower if lower in RATE_NAMES else UNIT.sub("", lower)
