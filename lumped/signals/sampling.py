"""Signals of a motion over the turns of a gear, and indicators of their averages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.signals.averages import TurnAverage, synchronous_average
from lumped.signals.sensors import CoordinateMotion, sensor_signals, with_noise
from lumped.steady.response import History
from lumped.train.system import LumpedSystem

Array = NDArray[np.float64]


class Sampling(NamedTuple):
    """How signals are sampled over the turns of a gear.

    turns : of the gear
    points : samples in a turn
    turn_frequency : turns per second
    orders : cycles per turn of the gear whose multiples are those of meshes
    """

    turns: int
    points: int
    turn_frequency: float
    orders: tuple[int, ...]

    @property
    def time(self) -> Array:
        """Times (t,) of the samples [s]."""
        turn_time = 1.0 / self.turn_frequency
        return turn_time * np.arange(self.turns * self.points) / self.points


@dataclass(frozen=True, eq=False)
class SampledSignals:
    """Signals of sensors at equal steps of time, and their averages.

    names : of the c signals, with their units
    values : (t, c) samples
    average : over the turns
    """

    names: tuple[str, ...]
    values: Array
    average: TurnAverage


def sample_signals(
    system: LumpedSystem,
    history: History,
    sampling: Sampling,
    noise: float = 0.0,
    seed: int = 0,
) -> SampledSignals:
    """Signals of a motion that repeats.

    history : motion over the time after which it repeats
    noise : standard deviation of white noise over that of each signal; seed : of it
    """
    clean = sensor_signals(CoordinateMotion(system, history), sampling.time)
    signals = with_noise(clean, noise, seed)
    values = np.stack(list(signals.values()), axis=1)
    average, turns = synchronous_average(values, sampling.points, sampling.points)
    average_over_turns = TurnAverage(average, turns, sampling.orders)
    return SampledSignals(tuple(signals), values, average_over_turns)


def residual_indicators(
    average: TurnAverage, tooth: NDArray[np.int64]
) -> Mapping[str, Array]:
    """Indicators (c,) of the residuals of averages by name.

    tooth : (p,) at the pitch point, from 1; `tooth` is the one during whose pitch the
        residual has the largest mean square: as many points belong to every tooth,
        unlike the peak, which may be at its ends. NaN where the residual is round-off
    """
    squares = average.residual**2
    by_tooth = [np.bincount(tooth, column).argmax() for column in squares.T]
    return {
        "residual_rms": np.sqrt(squares.mean(axis=0)),
        "residual_peak": average.peak,
        "residual_kurtosis": average.kurtosis,
        "tooth": np.where(average.has_residual, np.array(by_tooth, float), np.nan),
    }
