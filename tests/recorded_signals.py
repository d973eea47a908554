"""Recordings with known signals: of a gear of 19 teeth whose speed rises a little."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

TEETH, RATE, SECONDS = 19, 20_000.0, 0.2
START, RISE = 105.0, 30.0  # turns per second, and its rate
PULSE_WIDTH = 0.02  # turns


def turns_at(time: np.ndarray) -> np.ndarray:
    """Rotation [turns] at times (t,) [s]."""
    return START * time + 0.5 * RISE * time**2


def pulse_signal(turns: np.ndarray, pulses: int = 1) -> np.ndarray:
    """Signal (t,) whose rising edges are at equal angles, but for that at 0."""
    phase = np.mod(pulses * turns + 0.5, 1.0) - 0.5
    signal = 0.5 * (np.tanh(phase / PULSE_WIDTH) + 1.0) * (phase < 0.25)
    return np.where(turns < 0.5 / pulses, 0.0, 5.0 * signal)


@cache
def recording() -> Mapping[str, np.ndarray]:
    """Columns: time, an acceleration, a force, pulses and the speed."""
    time = np.arange(round(RATE * SECONDS)) / RATE
    turns = turns_at(time)
    angle = 2.0 * np.pi * turns
    random = np.random.default_rng(20261130)
    shock = np.exp(-((np.mod(turns - 0.3, 1.0) / 0.01) ** 2))
    noise = 0.05 * random.standard_normal((2, time.size))
    return {
        "time_s": time,
        "acc": np.cos(TEETH * angle) + 2.0 * shock + noise[0],
        "force_N": 20.0 + np.cos(2 * TEETH * angle) + noise[1],
        "tacho": pulse_signal(turns),
        "rpm": 60.0 * (START + RISE * time),
    }


def recording_text(columns: Mapping[str, np.ndarray] | None = None) -> str:
    """A recording as CSV."""
    table = recording() if columns is None else columns
    rows = np.stack(list(table.values()), axis=1)
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows]
    return "\n".join([",".join(table), *lines])
