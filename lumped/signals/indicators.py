"""Indicators of damage from averages over turns of a gear.

The regular part of an average is what sound gears give: its mean, the multiples of the
meshes, and the first sidebands on both sides, of the mean one cycle per turn. The
difference signal is the rest; the residual keeps the sidebands.

R. M. Stewart, Some useful data analysis techniques for gearbox diagnostics, report
MHM/R/10/77, University of Southampton (1977): FM4. H. R. Martin, Statistical moment
analysis as a means of surface damage detection, Proc. 7th Int. Modal Analysis Conf.
(1989) 1016: M6A. J. J. Zakrajsek, D. P. Townsend and H. J. Decker, An analysis of gear
fault detection methods as applied to pitting fatigue failure data, Technical Memorandum
105950 (1993): NA4, and definitions of the others. N. S. Swansson, Application of
vibration signal analysis techniques to condition monitoring, Conf. on Lubrication,
Friction and Wear in Engineering (1980): energy ratio.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array
from lumped.signals.averages import (
    RESIDUAL_RTOL,
    TurnAverage,
    kurtosis,
    residual_of,
)

FIRST = 1  # sidebands of the regular part, on each side of a multiple


def difference_of(average: Array, orders: Iterable[int]) -> Array:
    """Difference signal: average without its regular part.

    Parameters
    ----------
    average : (p, c) array
        Averages of c signals over a turn.
    orders : iterable of int
        Cycles per turn of the meshes.

    Returns
    -------
    (p, c) array
        Difference signals.
    """
    return residual_of(average, orders, FIRST)


def sixth_moment(values: Array) -> Array:
    """Sixth central moment over the third power of the variance of each column.

    It is 15 of Gaussian noise, and rises more than the kurtosis with rare peaks.

    Parameters
    ----------
    values : (t, c) array
        Samples of c signals.

    Returns
    -------
    (c,) array
        Sixth moment, NaN of a constant.
    """
    deviation = values - values.mean(axis=0)
    rms = np.sqrt((deviation**2).mean(axis=0))
    relative = deviation / np.where(rms == 0.0, np.nan, rms)
    moment: Array = (relative**6).mean(axis=0)
    return moment


def difference_indicators(average: TurnAverage) -> Mapping[str, Array]:
    """Indicators of the difference signals of averages.

    Parameters
    ----------
    average : TurnAverage
        Averages of c signals, and the orders of the meshes.

    Returns
    -------
    mapping of str to (c,) array
        ``fm4``, the kurtosis of the difference signal (Stewart 1977): 3 of noise.
        ``m6a``, its sixth moment (Martin 1989): 15 of noise. ``energy_ratio``, its RMS
        over that of the regular part without the mean (Swansson 1980). NaN where the
        difference signal is round-off, and the ratio also where the regular part is.
    """
    values = average.values
    difference = difference_of(values, average.orders)
    regular = values - values.mean(axis=0) - difference
    smallest = RESIDUAL_RTOL * np.abs(values).max(axis=0)
    has_difference = np.abs(difference).max(axis=0) > smallest
    has_regular = np.abs(regular).max(axis=0) > smallest
    rms, regular_rms = (np.sqrt((v**2).mean(axis=0)) for v in (difference, regular))
    ratio = rms / np.where(has_regular, regular_rms, np.nan)
    return {
        "fm4": np.where(has_difference, kurtosis(difference), np.nan),
        "m6a": np.where(has_difference, sixth_moment(difference), np.nan),
        "energy_ratio": np.where(has_difference, ratio, np.nan),
    }


def window_averages(values: ArrayLike, points: int, window_turns: int) -> Array:
    """Averages over successive windows of turns.

    Parameters
    ----------
    values : (t, c) array_like
        Samples of c signals at equal angles from the start of a turn.
    points : int
        Samples in a turn.
    window_turns : int
        Turns in a window.

    Returns
    -------
    (w, points, c) array
        Average of each window that is full.

    Raises
    ------
    ValueError
        If the samples do not fill a window.
    """
    samples = np.asarray(values, float)
    windows = len(samples) // (points * window_turns)
    if windows < 1:
        raise ValueError(
            f"{len(samples)} samples do not fill a window of {window_turns} turns of "
            f"{points}"
        )
    turns = samples[: windows * window_turns * points]
    return turns.reshape(windows, window_turns, points, -1).mean(axis=1)


def na4(averages: Array, orders: Iterable[int]) -> Array:
    """Fourth moment of the last residual over the squared mean variance of the run.

    Zakrajsek, Townsend and Decker (1993): the variance is the mean over all residuals
    of the run so far, so that NA4 also rises with the size of a residual and not only
    with the sharpness of its peaks. It is the kurtosis of the residual where all
    residuals of the run have one variance.

    Parameters
    ----------
    averages : (w, p, c) array
        Averages of c signals over a turn, in windows one after the other.
    orders : iterable of int
        Cycles per turn of the meshes.

    Returns
    -------
    (c,) array
        NA4 of the last window, NaN where residuals are round-off.
    """
    residuals = residual_of(averages, orders)
    variance = residuals.var(axis=1).mean(axis=0)
    last = residuals[-1] - residuals[-1].mean(axis=0)
    smallest = RESIDUAL_RTOL * np.abs(averages).max(axis=(0, 1))
    has_residual = np.abs(residuals).max(axis=(0, 1)) > smallest
    ratio = (last**4).mean(axis=0) / np.where(has_residual, variance, np.nan) ** 2
    return np.asarray(ratio)


def band_limited(average: Array, points: int) -> Array:
    """Averages at fewer points of a turn, without the orders that these do not have.

    Parameters
    ----------
    average : (..., m, c) array
        Averages of c signals at m points, `points` or more.
    points : int
        Points that remain.

    Returns
    -------
    (..., points, c) array
        Averages of the orders below half the number of points.
    """
    if average.shape[-2] == points:
        return average
    lines = np.fft.rfft(average, axis=-2)[..., : points // 2 + 1, :]
    if points % 2 == 0:
        lines[..., -1, :] = 0.0  # half of a pair, whose phase is lost
    return np.fft.irfft(lines, points, axis=-2) * (points / average.shape[-2])
