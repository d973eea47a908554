"""Recordings of measurements: channels at one sampling rate, read and checked.

Formats are those of `recording_formats.READERS`. What a file holds is data: nothing of
it is run.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fegear.files.errors import InputError, nearest
from fegear.files.output import listed, read_content
from fegear.files.recording_formats import READERS
from fegear.files.stored_channels import TIME_NAMES, StoredChannels
from lumped.common.array_types import Array
from lumped.common.csv_text import format_exact

MIN_SAMPLES = 4  # through which a cubic passes
MAX_JITTER = 1e-3  # of a step between times, over the mean step
MIN_JITTER = 1e-7  # below which times are equal steps but for round-off
RATE_RTOL = 1e-3  # between a rate and the times of the file
MAX_VALUE = 1e30  # of a sample: products of a few stay in the range of doubles
RECORDING_FILE = listed([*READERS])  # for a help text


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """Channels of a measurement at equal steps of time.

    rate : sampling rate [Hz]
    start : time of the first sample [s]
    channels : samples (n,) by name
    source : name of the file
    notes : what was done to the samples, in sentences
    """

    rate: float
    start: float
    channels: Mapping[str, Array]
    source: str
    notes: tuple[str, ...] = ()

    @property
    def time(self) -> Array:
        """Times (n,) of the samples [s]."""
        first = next(iter(self.channels.values()))
        return self.start + np.arange(first.size) / self.rate


def read_recording(
    path: str,
    names: Collection[str] = (),
    rate: float | None = None,
    rate_name: str = "rate",
) -> Recording:
    """A recording by the ending of its name.

    names : of the channels to take, all where it is empty
    rate : sampling rate [Hz] where the file has none; rate_name : of it in messages

    Raises InputError, which names the file and what is wrong.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise InputError(f"{path}: the file's name must end in {RECORDING_FILE}")
    try:
        stored = reader(read_content(path), path)
    except MemoryError:
        raise InputError(f"{path}: too large for the memory") from None
    stored = _chosen(stored, names, path)
    _require_one_rate(stored.rates, path)
    _require_samples(stored, path)
    start = _start(stored, path)
    notes: tuple[str, ...] = ()
    if stored.time is None:
        return Recording(
            rate=_stored_rate(stored, rate, rate_name, path),
            start=start,
            channels=stored.columns,
            source=path,
        )
    measured_rate, jitter = _rate_of_times(stored.time, rate, rate_name, path)
    columns = stored.columns
    if rate is not None:
        notes = (f"times of the file are replaced by {rate_name} {rate:g}",)
    elif jitter > MIN_JITTER:
        columns = _at_equal_steps(stored.time, columns)
        notes = (
            f"steps of time differ by {jitter:.2g} of their mean: channels are "
            "interpolated at equal steps by cubic splines",
        )
    return Recording(
        rate=rate or measured_rate,
        start=start,
        channels=columns,
        source=path,
        notes=notes,
    )


def _chosen(
    stored: StoredChannels, names: Collection[str], path: str
) -> StoredChannels:
    """The channels of these names; InputError for one that is not there."""
    columns = stored.columns
    if not columns:
        raise InputError(f"{path}: has no channel, a vector of two or more numbers")
    for name in names:
        if name not in columns:
            known_names = ", ".join(columns)
            raise InputError(
                f"{path}: has no channel {name}{nearest(name, columns)}; it has "
                f"{known_names}"
            )
    if not names:
        return stored
    return StoredChannels(
        {name: columns[name] for name in columns if name in names},
        stored.time,
        {name: rate for name, rate in stored.rates.items() if name in names},
        {name: start for name, start in stored.starts.items() if name in names},
    )


def _require_samples(stored: StoredChannels, path: str) -> None:
    """Refuse columns of different lengths, too few samples and what is not finite."""
    columns = dict(stored.columns)
    if stored.time is not None:
        columns = {"time": stored.time} | columns
    first, *others = columns
    for name in others:
        if columns[name].size != columns[first].size:
            raise InputError(
                f"{path}: {first} has {columns[first].size} values, {name} "
                f"{columns[name].size}; all channels need as many"
            )
    if columns[first].size < MIN_SAMPLES:
        raise InputError(
            f"{path}: {first} has {columns[first].size} values; {MIN_SAMPLES} or more "
            "are needed"
        )
    for name, values in columns.items():
        _require_finite(name, values, path)


def _require_finite(name: str, values: Array, path: str) -> None:
    wrong = ~(np.abs(values) <= MAX_VALUE)
    if not wrong.any():
        return
    count, row = int(wrong.sum()), int(wrong.argmax())
    raise InputError(
        f"{path}: {name} has {values[row]:g} in sample {row + 1}, {count} such values; "
        f"allowed {-MAX_VALUE:g} to {MAX_VALUE:g}"
    )


def _start(stored: StoredChannels, path: str) -> float:
    """Time of the first sample [s]."""
    if stored.time is not None:
        return float(stored.time[0])
    first, *others = stored.starts or {"": 0.0}
    for name in others:
        if stored.starts[name] != stored.starts[first]:
            raise InputError(
                f"{path}: {first} starts at {stored.starts[first]:g} s, {name} at "
                f"{stored.starts[name]:g} s; take channels of one start"
            )
    return stored.starts[first] if stored.starts else 0.0


def _require_one_rate(rates: Mapping[str, float], path: str) -> None:
    """Refuse channels of different sampling rates [Hz]."""
    first = next(iter(rates), "")
    for name, value in rates.items():
        if value != rates[first]:
            raise InputError(
                f"{path}: {first} has {format_exact(rates[first])} Hz, {name} "
                f"{format_exact(value)} Hz; take channels of one rate"
            )


def _stored_rate(
    stored: StoredChannels, rate: float | None, rate_name: str, path: str
) -> float:
    """Sampling rate [Hz] of a file without times."""
    rates = stored.rates
    for name, value in rates.items():
        if not 0.0 < value < 1e9:
            raise InputError(
                f"{path}: {name} has a sampling rate of {value:g} Hz; must be above 0 "
                "to below 1e9"
            )
    first = next(iter(rates), "")
    if rates and rate is not None:
        raise InputError(
            f"{rate_name} = {format_exact(rate)}; {path} has a sampling rate of "
            f"{format_exact(rates[first])} Hz, leave it out"
        )
    if not rates and rate is None:
        raise InputError(
            f"{path}: has no times ({listed(TIME_NAMES)}) and no sampling rate; "
            f"{rate_name} in Hz is needed"
        )
    return rates[first] if rate is None else rate


def _rate_of_times(
    time: Array, rate: float | None, rate_name: str, path: str
) -> tuple[float, float]:
    """Sampling rate of times (n,) [Hz], and the jitter of their steps over the mean."""
    steps = np.diff(time)
    falls = ~(steps > 0.0)
    if falls.any():
        row = int(falls.argmax())
        raise InputError(
            f"{path}: time is {time[row]:.9g} s in sample {row + 1} and "
            f"{time[row + 1]:.9g} s in the next; times must rise"
        )
    mean = (time[-1] - time[0]) / steps.size
    deviation = np.abs(steps - mean)
    jitter = float(deviation.max() / mean)
    if rate is not None:
        if abs(rate * mean - 1.0) > RATE_RTOL:
            raise InputError(
                f"{rate_name} = {format_exact(rate)}; times of {path} have "
                f"{1.0 / mean:.6g} Hz, they may differ by {RATE_RTOL:g}"
            )
    elif jitter > MAX_JITTER:
        row = int(deviation.argmax())
        raise InputError(
            f"{path}: step of time after sample {row + 1} is {steps[row]:.6g} s, the "
            f"mean {mean:.6g} s; at most {MAX_JITTER:g} of it may be between, or "
            f"{rate_name} gives equal steps"
        )
    return 1.0 / mean, jitter


def _at_equal_steps(time: Array, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns (n,) at equal steps between the first and the last of times (n,)."""
    from scipy.interpolate import CubicSpline

    values = np.stack(list(columns.values()), axis=1)
    equal = np.linspace(time[0], time[-1], time.size)
    return dict(zip(columns, CubicSpline(time, values)(equal).T, strict=True))
