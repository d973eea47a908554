"""Averages of signals over the turns of a gear, and what is left of them.

A time-synchronous average over whole turns of a gear retains what repeats with them.
Its lines are at whole orders of the gear: at multiples of its number of teeth where all
teeth are alike, and between them, as sidebands, where teeth differ. The residual is the
average without its mean and the multiples of the meshes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array

WHOLE_TURNS_TOL = 1e-6  # samples by which a turn may be short of its last point
# Residual over the largest value of the average below which it is round-off
RESIDUAL_RTOL = 1e-7


def synchronous_average(
    values: ArrayLike, samples_per_turn: float, points: int
) -> tuple[Array, int]:
    """Average of signals over the whole turns that they cover.

    Where samples and points do not coincide, a cubic spline through the samples is
    evaluated, whose error is of fourth order in the step.

    Parameters
    ----------
    values : (t, c) array_like
        Samples of c signals at equal steps of time, the first at the start of a turn.
    samples_per_turn : float
        Samples in a turn, which need not be a whole number.
    points : int
        Points of the average.

    Returns
    -------
    average : (points, c) array
        Average at equal angles from the start of a turn.
    turns : int
        Number of turns of which it is the average.

    Raises
    ------
    ValueError
        If the samples do not cover a turn.
    """
    samples = np.asarray(values, float)
    step = samples_per_turn / points
    last = len(samples) - 1 + WHOLE_TURNS_TOL
    turns = math.floor((last + step) / samples_per_turn)
    if turns < 1:
        raise ValueError(
            f"{len(samples)} samples do not cover a turn of {samples_per_turn:g}"
        )
    if step == 1.0:
        at_points = samples[: turns * points]
    else:
        from scipy.interpolate import CubicSpline

        position = np.minimum(step * np.arange(turns * points), len(samples) - 1)
        at_points = CubicSpline(np.arange(len(samples)), samples)(position)
    return at_points.reshape(turns, points, -1).mean(axis=0), turns


def order_amplitudes(average: Array) -> Array:
    """One-sided amplitudes of an average at the orders of its gear.

    Parameters
    ----------
    average : (p, c) array
        Averages of c signals over a turn.

    Returns
    -------
    (p // 2 + 1, c) array
        Amplitude at 0, 1, ... cycles per turn, the mean at 0.
    """
    points = len(average)
    amplitude = np.abs(np.fft.rfft(average, axis=0)) / points
    amplitude[1 : (points + 1) // 2] *= 2.0
    return amplitude


def residual_of(average: Array, orders: Iterable[int], sidebands: int = 0) -> Array:
    """Average without its mean and without all multiples of some orders.

    Parameters
    ----------
    average : (..., p, c) array
        Averages of c signals over a turn.
    orders : iterable of int
        Cycles per turn of the meshes.
    sidebands : int, optional
        Number of sidebands on each side of a multiple that are left out with it; the
        first one of the mean is at one cycle per turn.

    Returns
    -------
    (..., p, c) array
        Residuals.
    """
    points = average.shape[-2]
    lines = np.fft.rfft(average, axis=-2)
    order = np.arange(lines.shape[-2])
    regular = order <= sidebands
    for mesh in orders:
        distance = order % mesh
        regular |= np.minimum(distance, mesh - distance) <= sidebands
    lines[..., regular, :] = 0.0
    return np.fft.irfft(lines, points, axis=-2)


def kurtosis(values: Array) -> Array:
    """Fourth central moment over the square of the variance of each column.

    It is 3 of Gaussian noise, 1.5 of a sine, and larger the rarer and higher peaks are.

    Parameters
    ----------
    values : (t, c) array
        Samples of c signals.

    Returns
    -------
    (c,) array
        Kurtosis, NaN of a constant.
    """
    squares = (values - values.mean(axis=0)) ** 2
    variance = squares.mean(axis=0)
    fourth = (squares**2).mean(axis=0)
    constant = variance == 0.0
    ratio: Array = fourth / np.where(constant, np.nan, variance) ** 2
    return ratio


@dataclass(frozen=True, eq=False)
class TurnAverage:
    """Averages of c signals at p equal angles of a turn of a gear.

    Parameters
    ----------
    values : (p, c) array
        Averages.
    turns : int
        Number of turns of which they are the average.
    orders : tuple of int
        Cycles per turn whose multiples are those of meshes.
    """

    values: Array
    turns: int
    orders: tuple[int, ...]

    @cached_property
    def residual(self) -> Array:
        """Averages (p, c) without mean and multiples of the meshes."""
        return residual_of(self.values, self.orders)

    @cached_property
    def amplitude(self) -> Array:
        """Amplitudes (p // 2 + 1, c) at 0, 1, ... cycles per turn."""
        return order_amplitudes(self.values)

    @cached_property
    def has_residual(self) -> NDArray[np.bool_]:
        """Whether the residual of each signal (c,) is more than round-off."""
        largest = np.abs(self.residual).max(axis=0)
        scale = np.abs(self.values).max(axis=0)
        return np.asarray(largest > RESIDUAL_RTOL * scale)

    @cached_property
    def kurtosis(self) -> Array:
        """Kurtosis (c,) of the residuals, NaN where they are round-off."""
        return np.where(self.has_residual, kurtosis(self.residual), np.nan)

    @cached_property
    def peak(self) -> Array:
        """Largest magnitude (c,) of the residuals."""
        return np.asarray(np.abs(self.residual).max(axis=0))

    @property
    def peak_turn(self) -> Array:
        """Place (c,) of the peak, in turns from 0 to below 1; NaN of round-off."""
        place = np.abs(self.residual).argmax(axis=0) / len(self.residual)
        return np.where(self.has_residual, place, np.nan)
