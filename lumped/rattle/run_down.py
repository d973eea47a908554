"""Damping from a run-down by an exponential fitted to the speed, eq. 2.17."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeWarning, curve_fit

from lumped.common.array_types import Array


@dataclass(frozen=True)
class ExponentialFit:
    """Fit speed(t) = start e^(-rate (t - first t)) by least squares.

    rate, rate_error : decay rate and its standard error for independent residuals [1/s]
    start, residual : initial speed and RMS of the residuals, in the unit of the data
    """

    rate: float
    rate_error: float
    start: float
    residual: float


def fit_run_down(time: Array, speed: Array) -> ExponentialFit:
    """Fit an exponential to speeds (n,) at times (n,) [s], with n at least 3.

    Raises ValueError if there are fewer speeds, or if not all are finite and positive.
    """
    if time.size < 3:
        raise ValueError(f"rows = {time.size}; must be 3 or more")
    if not (np.isfinite(time).all() and np.isfinite(speed).all()):
        raise ValueError("times and speeds must be finite")
    if not (np.diff(time) > 0.0).all():
        raise ValueError("times must rise")
    if not (speed > 0.0).all():
        raise ValueError("speeds must be above 0")
    length = time[-1] - time[0]
    at = (time - time[0]) / length
    slope, level = np.polyfit(at, np.log(speed), 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OptimizeWarning)  # the error is then infinite
        (start, loss), covariance = curve_fit(
            lambda t, first, lost: first * np.exp(-lost * t),
            *(at, speed / speed.max(), (math.exp(level) / speed.max(), -slope)),
        )
    left = speed / speed.max() - start * np.exp(-loss * at)
    return ExponentialFit(
        rate=float(loss / length),
        rate_error=float(math.sqrt(covariance[1, 1]) / length),
        start=float(start * speed.max()),
        residual=float(np.sqrt(np.mean(left**2)) * speed.max()),
    )
