"""Order tracking: signals over time at changing speed, as signals over an angle.

Computed order tracking (K. R. Fyfe and E. D. S. Munck, Mech. Syst. Signal Process. 11
(1997) 187): samples at equal steps of time are interpolated at the times at which a
gear is at equal angles. These times are known where the speed is, or follow from pulses
of a tachometer by a cubic spline through the angle of the pulses over time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array

MIN_PULSES = 4  # through which a cubic passes
NEWTON_STEPS, ANGLE_TOL = 10, 1e-9  # to an angle [turns]
TURN_TOL = 1e-9  # turns by which an angle may be short of a pulse or point


def pulse_times(time: ArrayLike, turns: ArrayLike, pulses: int = 1) -> Array:
    """Times of the pulses of a tachometer, at equal angles from 0 on.

    Parameters
    ----------
    time : (t,) array_like
        Times, rising [s].
    turns : (t,) array_like
        Rotation at these times, rising, so fine that cubics pass through it [turns].
    pulses : int, optional
        Pulses per turn.

    Returns
    -------
    (p,) array
        Times of the pulses within the rotation [s].

    Raises
    ------
    ValueError
        If the rotation does not rise everywhere.
    """
    from scipy.interpolate import CubicSpline

    rotation = np.asarray(turns, float)
    if not (np.diff(rotation) > 0.0).all():
        raise ValueError("turns must rise, the rotation turns back")
    first = math.ceil(pulses * rotation[0] - TURN_TOL)
    last = math.floor(pulses * rotation[-1] + TURN_TOL)
    angle = np.arange(first, last + 1) / pulses
    return np.asarray(CubicSpline(rotation, np.asarray(time, float))(angle))


def times_at_angles(pulse_time: ArrayLike, pulses: int, turns: ArrayLike) -> Array:
    """Times at which a gear is at angles, from the times of pulses.

    A cubic spline through the angles of the pulses over time, which is exact where the
    speed is linear in time.

    Parameters
    ----------
    pulse_time : (p,) array_like
        Times of successive pulses, the first at the angle 0 [s]; four or more.
    pulses : int
        Pulses per turn.
    turns : (k,) array_like
        Angles between those of the first and the last pulse [turns].

    Returns
    -------
    (k,) array
        Times [s].

    Raises
    ------
    ValueError
        If there are too few pulses, they are too irregular or an angle is not between
        them.
    """
    from scipy.interpolate import CubicSpline

    time, angle = np.asarray(pulse_time, float), np.asarray(turns, float)
    if time.size < MIN_PULSES:
        raise ValueError(f"{time.size} pulses, {MIN_PULSES} or more are needed")
    last = (time.size - 1) / pulses
    if angle.min() < -TURN_TOL or angle.max() > last + TURN_TOL:
        raise ValueError(f"turns must be from 0 to {last:g}, between the pulses")
    pulse_angle = np.arange(time.size) / pulses
    rotation = CubicSpline(time, pulse_angle)
    at = np.asarray(CubicSpline(pulse_angle, time)(angle))
    for _ in range(NEWTON_STEPS):
        at = np.clip(at - (rotation(at) - angle) / rotation(at, 1), time[0], time[-1])
    error = np.abs(rotation(at) - angle)
    if not (error < ANGLE_TOL).all():
        raise ValueError("pulse_time must be those of a rotation that rises smoothly")
    return at


def resample_at(time: ArrayLike, values: ArrayLike, at: ArrayLike) -> Array:
    """Signals at other times, by a cubic spline.

    Parameters
    ----------
    time : (t,) array_like
        Times of the samples, rising [s].
    values : (t,) or (t, c) array_like
        Samples of a signal, or of c signals.
    at : (k,) array_like
        Times within those of the samples [s].

    Returns
    -------
    (k,) or (k, c) array
        Values at these times, with an error of fourth order in the step.

    Raises
    ------
    ValueError
        If a time is outside of the samples.
    """
    from scipy.interpolate import CubicSpline

    samples, times = np.asarray(time, float), np.asarray(at, float)
    if times.min() < samples[0] or times.max() > samples[-1]:
        raise ValueError(
            f"at must be within the samples, {samples[0]:g} to {samples[-1]:g} s"
        )
    return np.asarray(CubicSpline(samples, np.asarray(values, float))(times))


@dataclass(frozen=True, eq=False)
class OrderMap:
    """Spectra of signals over windows of turns.

    Parameters
    ----------
    turns : (w,) array
        Middle of each window [turns].
    order : (o,) array
        Cycles per turn.
    amplitude : (w, o, c) array
        One-sided amplitudes of c signals.
    """

    turns: Array
    order: Array
    amplitude: Array


def order_map(
    values: ArrayLike, points: int, window_turns: int, max_order: float = math.inf
) -> OrderMap:
    """Spectra over Hann windows of some turns, which overlap by half.

    A line at an order that does not change has its amplitude where it is a multiple of
    1 over the turns of a window, and at least 0.85 of it between.

    Parameters
    ----------
    values : (t, c) array_like
        Samples of c signals at equal angles.
    points : int
        Samples in a turn.
    window_turns : int
        Turns in a window.
    max_order : float, optional
        Largest order of the map.

    Returns
    -------
    OrderMap
        Amplitudes of the windows that are full, and their orders.

    Raises
    ------
    ValueError
        If the samples do not fill a window.
    """
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import hann

    samples, size = np.asarray(values, float), window_turns * points
    if len(samples) < size:
        raise ValueError(
            f"{len(samples)} samples do not fill a window of {window_turns} turns of "
            f"{points}"
        )
    hop = max(1, size // 2)
    transform = ShortTimeFFT(
        hann(size, sym=False),
        hop=hop,
        fs=points,
        fft_mode="onesided2X",
        scale_to="magnitude",
    )
    first = math.ceil(transform.m_num_mid / hop)
    last = first + (len(samples) - size) // hop + 1
    lines = np.abs(transform.stft(samples, first, last, axis=0))  # (o, c, w)
    order = np.asarray(transform.f)
    shown = order <= max_order
    middle = (np.arange(first, last) * hop) / points
    return OrderMap(middle, order[shown], lines[shown].transpose(2, 0, 1))
