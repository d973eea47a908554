"""Rotation of a gear in a recording, and signals at equal angles of it.

Rotation follows from pulses of a tachometer, from a speed over time by integration, or
is that of a constant speed. It starts at 0 with the first pulse or sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array
from lumped.signals.orders import resample_at, times_at_angles

TURN_TOL = 1e-9  # turns by which a rotation may be short of a whole number
MAX_REFINEMENT = 16  # of the points of a turn, against aliasing
MAX_POINTS = 20_000_000  # of all turns, when they are refined


@dataclass(frozen=True, eq=False)
class Rotation:
    """Rotation of a gear over time.

    Parameters
    ----------
    time : (m,) array
        Times, rising [s].
    turns : (m,) array
        Rotation at these times, rising from 0 [turns].
    pulses : int, optional
        Pulses per turn, at whose angles the times are; 0 where they are others.
    """

    time: Array
    turns: Array
    pulses: int = 0

    @property
    def total(self) -> float:
        """All turns."""
        return float(self.turns[-1])

    def whole_turns(self, ratio: Fraction, points: int) -> int:
        """Whole turns of a gear, of which the last point is the last sample at least.

        Parameters
        ----------
        ratio : Fraction
            Turns of that gear per turn of this one.
        points : int
            Points of its turn.

        Returns
        -------
        int
            Number of turns.
        """
        return math.floor(self.total * float(ratio) + 1.0 / points + TURN_TOL)

    @property
    def turn_frequency(self) -> float:
        """Mean speed [turns per second]."""
        return self.total / float(self.time[-1] - self.time[0])

    @property
    def speed_range(self) -> tuple[float, float]:
        """Lowest and highest speed, each over a turn or less [turns per second]."""
        stride = max(1, min(self.pulses, self.time.size - 1))
        turns = self.turns[stride:] - self.turns[:-stride]
        speeds = turns / (self.time[stride:] - self.time[:-stride])
        return float(speeds.min()), float(speeds.max())

    def times_at(self, turns: ArrayLike) -> Array:
        """Times at which the gear is at angles.

        Parameters
        ----------
        turns : (k,) array_like
            Angles from 0 to `total` [turns].

        Returns
        -------
        (k,) array
            Times [s].

        Raises
        ------
        ValueError
            If pulses are those of no rotation that rises smoothly.
        """
        if self.pulses:
            return times_at_angles(self.time, self.pulses, turns)
        from scipy.interpolate import CubicSpline

        angle = np.asarray(turns, float)
        at = np.asarray(CubicSpline(self.turns, self.time)(angle))
        return np.clip(at, self.time[0], self.time[-1])


def rotation_of_pulses(pulse_time: ArrayLike, pulses: int) -> Rotation:
    """Rotation from the pulses of a tachometer.

    Parameters
    ----------
    pulse_time : (p,) array_like
        Times of successive pulses, rising [s].
    pulses : int
        Pulses per turn.

    Returns
    -------
    Rotation
        Rotation from the first pulse to the last.
    """
    time = np.asarray(pulse_time, float)
    return Rotation(time, np.arange(time.size) / pulses, pulses)


def rotation_of_speed(time: ArrayLike, turn_frequency: ArrayLike) -> Rotation:
    """Rotation as the integral of a speed, by a cubic spline.

    Parameters
    ----------
    time : (t,) array_like
        Times of the samples, rising [s].
    turn_frequency : (t,) array_like
        Speed, above 0 [turns per second].

    Returns
    -------
    Rotation
        Rotation from the first sample to the last.

    Raises
    ------
    ValueError
        If a speed is not above 0, or its spline turns back.
    """
    from scipy.interpolate import CubicSpline

    at, speed = np.asarray(time, float), np.asarray(turn_frequency, float)
    if not (speed > 0.0).all():
        raise ValueError("turn_frequency must be above 0")
    turns = CubicSpline(at, speed).antiderivative()(at)
    if not (np.diff(turns) > 0.0).all():
        raise ValueError("turn_frequency changes too much between samples")
    return Rotation(at, np.asarray(turns))


def constant_rotation(start: float, end: float, turn_frequency: float) -> Rotation:
    """Rotation at a constant speed.

    Parameters
    ----------
    start, end : float
        Times of the first and the last sample [s].
    turn_frequency : float
        Speed [turns per second].

    Returns
    -------
    Rotation
        Rotation from the first sample to the last.
    """
    turns = turn_frequency * (end - start)
    return Rotation(np.array([start, end]), np.array([0.0, turns]))


@dataclass(frozen=True, eq=False)
class SignalsOverAngle:
    """Signals at equal angles over whole turns of a gear.

    Parameters
    ----------
    values : (k, c) array
        Signals.
    points : int
        Samples in a turn.
    """

    values: Array
    points: int


def signals_over_angle(
    time: ArrayLike, values: ArrayLike, rotation: Rotation, ratio: Fraction, points: int
) -> SignalsOverAngle:
    """Signals of a recording at equal angles over the whole turns of a gear.

    A turn has a multiple of so many points where the samples are closer than these, so
    that what lies above their orders does not appear below.

    Parameters
    ----------
    time : (t,) array_like
        Times of the samples, at equal steps [s].
    values : (t, c) array_like
        Samples of c signals.
    rotation : Rotation
        Rotation of another gear or this one, within the times.
    ratio : Fraction
        Turns of this gear per turn of that one.
    points : int
        Points of a turn of this gear.

    Returns
    -------
    SignalsOverAngle
        Signals over all whole turns.

    Raises
    ------
    ValueError
        If there is no whole turn, or pulses are those of no smooth rotation.
    """
    samples = np.asarray(time, float)
    rate = (samples.size - 1) / (samples[-1] - samples[0])
    slowest = rotation.speed_range[0] * float(ratio)
    refinement = min(
        math.ceil(rate / (points * slowest) - TURN_TOL),
        MAX_REFINEMENT,
        int(MAX_POINTS / (points * max(1.0, rotation.total * float(ratio)))),
    )
    refined = max(1, refinement) * points
    turns = rotation.whole_turns(ratio, refined)
    if turns < 1:
        raise ValueError(f"{rotation.total * float(ratio):.3g} turns, 1 is needed")
    angle = np.arange(turns * refined) / (refined * float(ratio))
    at = rotation.times_at(np.minimum(angle, rotation.total))
    at = np.clip(at, samples[0], samples[-1])
    columns = np.asarray(values, float).T  # one by one: splines take four times more
    resampled = [resample_at(samples, column, at) for column in columns]
    return SignalsOverAngle(np.stack(resampled, axis=1), refined)
