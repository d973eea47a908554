"""Noise of a measured signal, from its spectrum over whole turns of a gear."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

MIN_TURNS = 4  # between whose multiples the spectrum has lines without neighbours
# lines above have less noise, as splines between samples are smooth
HIGHEST_LINE = 0.25  # of the sampling rate


def noise_floor(
    over_angle: ArrayLike, points: int, sampling_rate: float, duration: float
) -> float:
    """Standard deviation of the white noise of a signal.

    It follows from the median of the spectrum between the orders of the gear, which
    tones of other gears do not move.

    Parameters
    ----------
    over_angle : (k,) array_like
        Signal at equal angles over whole turns.
    points : int
        Samples in a turn.
    sampling_rate : float
        Rate at which the signal was sampled before [Hz].
    duration : float
        Time that the turns take [s].

    Returns
    -------
    float
        Standard deviation of the noise at that rate, in the unit of the signal.

    Raises
    ------
    ValueError
        If there are fewer than `MIN_TURNS` turns, or no line is below the highest.
    """
    signal = np.asarray(over_angle, float)
    turns = signal.size // points
    if turns < MIN_TURNS:
        raise ValueError(f"{turns} turns; noise needs {MIN_TURNS}")
    by_turn = signal[: turns * points].reshape(turns, points)
    residual = (by_turn - by_turn.mean(axis=0)).ravel()
    window = np.hanning(residual.size + 1)[:-1]
    power = np.abs(np.fft.rfft(window * residual)) ** 2 / np.mean(window**2)
    line = np.arange(power.size)
    from_order = np.abs((line + turns // 2) % turns - turns // 2)
    between = (from_order > 1) & (line < HIGHEST_LINE * sampling_rate * duration)
    if not between.any():
        raise ValueError("the turns are too short for the spectrum of noise")
    # squares of lines of white noise have an exponential distribution
    density = np.median(power[between]) / np.log(2.0) * duration / residual.size**2
    return float(np.sqrt(density * sampling_rate))
