"""Quantities of a motion over whole periods."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.steady.response import History

ROWS_PER_BLOCK = 65_536  # rows of a motion whose largest values are determined at once
CROSSING_SUBSTEPS = 16  # parts of a step in which a contact changes


def measure_motion(history: History) -> dict[str, Array]:
    """Quantities of a motion over whole periods, each of shape (m,)."""
    h = np.diff(history.time)[:, None]
    span = history.time[-1] - history.time[0]
    s, rate = history.deflection, history.rate
    mean = _integral(s, rate, h) / span
    deviation = s - mean
    mean_square = _integral(deviation**2, 2.0 * deviation * rate, h) / span
    contact_fraction, back_fraction = (
        time / span for time in _contact_times(history, h)
    )
    return {
        "dte_rms": np.sqrt(mean_square),
        "dte_mean": mean,
        "dte_peak": _maximum(s, rate, h),
        "force_peak": _force_peak(history.force, history.force_before),
        "contact_loss": _remove_round_off(1.0 - contact_fraction),
        "back_side": back_fraction,
    }


def combine_windows(windows: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Combine the quantities of windows of equal length into those of all windows.

    The spread is the standard error of the mean of the windows' RMS.
    """
    table = {name: np.array([part[name] for part in windows]) for name in windows[0]}
    mean = table["dte_mean"].mean(axis=0)
    deviation = table["dte_mean"] - mean
    rms = np.sqrt((table["dte_rms"] ** 2 + deviation**2).mean(axis=0))
    stderr = np.zeros_like(rms)
    if len(windows) > 1:
        stderr = table["dte_rms"].std(axis=0, ddof=1) / math.sqrt(len(windows))
    return {
        "dte_rms": rms,
        "dte_rms_stderr": stderr,
        "dte_mean": mean,
        "dte_peak": table["dte_peak"].max(axis=0),
        "force_peak": table["force_peak"].max(axis=0),
        "contact_loss": table["contact_loss"].mean(axis=0),
        "back_side": table["back_side"].mean(axis=0),
    }


def _remove_round_off(fraction: Array) -> Array:
    """Remove round-off from fractions of the time."""
    return np.where(fraction < 1e-12, 0.0, np.minimum(fraction, 1.0))


def _integral(value: Array, slope: Array, h: Array) -> Array:
    """Integral of the piecewise cubic through values and slopes (t, m)."""
    ends = 0.5 * h * (value[:-1] + value[1:])
    return (ends + h**2 / 12.0 * (slope[:-1] - slope[1:])).sum(axis=0)


def _maximum(value: Array, slope: Array, h: Array) -> Array:
    """Largest value of the piecewise cubic through values and slopes (t, m)."""
    x = np.linspace(0.0, 1.0, 9)[1:-1, None, None]
    largest = value.max(axis=0)
    for start in range(0, len(h), ROWS_PER_BLOCK):
        ends = slice(start, start + ROWS_PER_BLOCK + 1)
        v, s, step = value[ends], slope[ends], h[start : start + ROWS_PER_BLOCK]
        p = v[:-1] * (1.0 + 2.0 * x) * (1.0 - x) ** 2 + v[1:] * x**2 * (3.0 - 2 * x)
        p = p + step * (s[:-1] * x * (1.0 - x) ** 2 - s[1:] * x**2 * (1.0 - x))
        largest = np.maximum(largest, p.max(axis=(0, 1)))
    return largest


def _force_peak(force: Array, before: Array) -> Array:
    """Largest size of a force (t, m), by a parabola where it is smooth."""
    magnitude = np.maximum(np.abs(force), np.abs(before))
    meshes = np.arange(magnitude.shape[1])
    index = np.clip(magnitude.argmax(axis=0), 1, magnitude.shape[0] - 2)
    neighbours = [index + i for i in (-1, 0, 1)]
    left, top, right = (magnitude[rows, meshes] for rows in neighbours)
    jump = np.max([np.abs(force - before)[rows, meshes] for rows in neighbours], axis=0)
    curvature = 2.0 * top - left - right
    parabola_peak = top + (left - right) ** 2 / (
        8.0 * np.where(curvature > 0.0, curvature, np.inf)
    )
    smooth = (left > 0.0) & (right > 0.0) & (top >= left) & (top >= right)
    smooth &= jump <= 1e-6 * top
    return np.where(smooth, parabola_peak, magnitude.max(axis=0))


def _contact_times(history: History, h: Array) -> tuple[Array, Array]:
    """Contact times (m,) of either flank, and of the back flank alone [s].

    Within a step, overlaps are curved like the deflection, whose rates are known, while
    the gaps are linear between samples. If the pairs of the two sides interchange
    within a step, both may touch: either counts as contact.
    """
    drive, back = (_both_ends(v) for v in (history.drive_overlap, history.back_overlap))
    h = np.broadcast_to(h, drive[0].shape)
    contact_time = np.where(np.maximum(drive[0], back[0]) > 0.0, h, 0.0)
    back_time = np.where(back[0] > 0.0, h, 0.0)
    slope = h * np.maximum(np.abs(history.rate[:-1]), np.abs(history.rate[1:]))
    may_cross = np.zeros(h.shape, bool)
    for start, end in (drive, back):
        may_cross |= ((start > 0.0) != (end > 0.0)) | (
            np.minimum(np.abs(start), np.abs(end)) < slope
        )
    x = np.linspace(0.0, 1.0, CROSSING_SUBSTEPS + 1)
    chord_deviation = _chord_deviation(history, h, may_cross, x)
    drive_overlap, back_overlap = (
        (1.0 - x) * start[may_cross, None] + x * end[may_cross, None]
        for start, end in (drive, back)
    )
    drive_overlap, back_overlap = (
        drive_overlap + chord_deviation,
        back_overlap - chord_deviation,
    )
    contact_time[may_cross] = h[may_cross] * _positive_fraction(
        np.maximum(drive_overlap, back_overlap)
    )
    back_time[may_cross] = h[may_cross] * _positive_fraction(back_overlap)
    return contact_time.sum(axis=0), back_time.sum(axis=0)


def _both_ends(overlap: Array) -> tuple[Array, Array]:
    """Overlaps (t - 1, m) at the start and end of every step. One replaces the other
    if no pair is engaged there; they are negative if none is engaged at both."""
    start, end = overlap[:-1], overlap[1:]
    first = np.where(np.isfinite(start), start, end)
    last = np.where(np.isfinite(end), end, start)
    return tuple(np.where(np.isfinite(v), v, -1.0) for v in (first, last))  # type: ignore[return-value]


def _chord_deviation(
    history: History, h: Array, steps: NDArray[np.bool_], x: Array
) -> Array:
    """Deflection minus its chord (steps, p) at parts x (p,) of some steps."""
    s, rate = history.deflection, history.rate
    chord = (s[1:] - s[:-1])[steps]
    v0, v1 = ((h * v)[steps] - chord for v in (rate[:-1], rate[1:]))
    return x * (1.0 - x) * ((1.0 - x) * v0[:, None] - x * v1[:, None])


def _positive_fraction(values: Array) -> Array:
    """Fraction of each row (n, p) that is positive, linear between its entries."""
    a, b = values[:, :-1], values[:, 1:]
    crossing = (a > 0.0) != (b > 0.0)
    change = np.where(crossing, np.abs(a - b), 1.0)
    part = np.where(crossing, np.maximum(a, b) / change, (a > 0.0).astype(float))
    return part.mean(axis=1)
