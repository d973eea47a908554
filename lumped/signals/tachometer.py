"""Pulses of a tachometer in a recording: when they come, and which are wrong.

A pulse begins where the signal rises through the middle of its range; it must have
fallen clearly below before, so that noise on an edge is no pulse. Intervals between
pulses are compared with those around them: one of twice the length lacks a pulse, one
that is short has a pulse too many.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array, Indices
from lumped.signals.orders import MIN_PULSES

HYSTERESIS = 0.2  # of the range, by which a signal must fall below the middle
NEIGHBOURS = 9  # intervals whose median is that of the speed there
MAX_SHORT = 0.6  # of that interval, below which a pulse is too many
MAX_REPAIRED = 0.1  # part of the pulses


@dataclass(frozen=True, eq=False)
class PulseTrain:
    """Pulses at equal angles of a gear.

    Parameters
    ----------
    time : (p,) array
        Times of the pulses, rising [s].
    dropped : int
        Number of pulses that were missing, and are interpolated.
    doubled : int
        Number of pulses that were too many, and are left out.
    """

    time: Array
    dropped: int = 0
    doubled: int = 0

    @property
    def scatter(self) -> float:
        """RMS of the intervals over the mean of both neighbours, less 1."""
        intervals = np.diff(self.time)
        relative = intervals[1:-1] / (0.5 * (intervals[:-2] + intervals[2:])) - 1.0
        return float(np.sqrt((relative**2).mean()))

    @property
    def error(self) -> float:
        """RMS of the places of the pulses by their scatter, over the mean interval.

        Four of them are in an interval over the mean of both neighbours, with factors
        of 3/2 and 1/2; their errors are taken as independent.
        """
        return self.scatter / math.sqrt(5.0)


def rising_edges(time: ArrayLike, signal: ArrayLike) -> Array:
    """Times at which a signal rises through the middle of its range.

    Parameters
    ----------
    time : (t,) array_like
        Times of the samples, rising [s].
    signal : (t,) array_like
        Samples of a pulse train.

    Returns
    -------
    (p,) array
        Times of the edges, between samples by a line [s].
    """
    at, values = np.asarray(time, float), np.asarray(signal, float)
    low, high = float(values.min()), float(values.max())
    middle = low + 0.5 * (high - low)
    is_low = values < middle - HYSTERESIS * (high - low)
    is_high = values >= middle
    # the last sample so far that was clearly on either side
    steps = np.arange(values.size)
    last_low = np.maximum.accumulate(np.where(is_low, steps, -1))
    last_high = np.maximum.accumulate(np.where(is_high, steps, -1))
    rises = is_high[1:] & (last_low[:-1] > last_high[:-1])
    before = np.flatnonzero(rises)
    part = (middle - values[before]) / (values[before + 1] - values[before])
    return np.asarray(at[before] + part * (at[before + 1] - at[before]))


def repaired_pulses(time: ArrayLike) -> PulseTrain:
    """Pulses without those that are too many, and with those that are missing.

    A missing pulse is interpolated by a cubic spline through the others over their
    numbers.

    Parameters
    ----------
    time : (p,) array_like
        Times of the pulses, rising [s].

    Returns
    -------
    PulseTrain
        Pulses at equal angles.

    Raises
    ------
    ValueError
        If there are too few pulses, or more than a tenth of them is wrong.
    """
    pulses = np.asarray(time, float)
    _require_pulses(pulses.size)
    extra = _extra_pulses(pulses)
    _require_repairs(0, extra.size, pulses.size)
    single = np.delete(pulses, extra)
    _require_pulses(single.size)
    intervals = np.diff(single)
    steps = np.maximum(1, np.rint(intervals / _local_interval(intervals))).astype(int)
    number = np.concatenate([[0], np.cumsum(steps)])
    dropped = int(number[-1]) + 1 - single.size
    _require_repairs(dropped, extra.size, int(number[-1]) + 1)
    if dropped:
        from scipy.interpolate import CubicSpline

        single = np.asarray(CubicSpline(number, single)(np.arange(number[-1] + 1)))
    return PulseTrain(single, dropped, extra.size)


def _require_pulses(count: int) -> None:
    if count < MIN_PULSES:
        raise ValueError(f"{count} pulses, {MIN_PULSES} or more are needed")


def _require_repairs(dropped: int, doubled: int, pulses: int) -> None:
    if dropped + doubled > MAX_REPAIRED * pulses:
        raise ValueError(
            f"{dropped} missing and {doubled} doubled of {pulses} pulses; at most "
            f"{100 * MAX_REPAIRED:g} % are repaired"
        )


def _local_interval(intervals: Array) -> Array:
    """Median (p,) of the intervals around each one."""
    from scipy.ndimage import median_filter

    size = min(NEIGHBOURS, intervals.size)
    return np.asarray(median_filter(intervals, size, mode="mirror"))


def _extra_pulses(pulses: Array) -> Indices:
    """Indices (k,) of pulses that are too many.

    Of the two pulses at the ends of a short interval, the one without which the
    intervals are more even.
    """
    intervals = np.diff(pulses)
    usual = _local_interval(intervals)
    relative = np.concatenate([[np.nan], intervals / usual, [np.nan]])
    extra: list[int] = []
    for first in np.flatnonzero(intervals < MAX_SHORT * usual):
        if extra and extra[-1] >= first:  # has gone with the interval before
            continue
        # interval i between pulses i and i + 1 is entry i + 1
        without = (
            relative[first : first + 2].sum(),
            relative[first + 1 : first + 3].sum(),
        )
        error = np.abs(np.array(without) - 1.0)
        takes_first = not np.isnan(error[0]) and not error[1] <= error[0]
        extra.append(int(first) if takes_first else int(first) + 1)
    return np.array(extra, dtype=np.int64)
