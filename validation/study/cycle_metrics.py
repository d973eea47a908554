"""How two cycles of a mesh force differ."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array
from lumped.steady.response import History
from validation.study.metrics import CYCLE_POINTS, Measured, maximum, relative_error


@dataclass(frozen=True)
class CycleMatch:
    """Comparison of two mesh forces over a cycle.

    correlation : without a shift; phase : shift of the model's in cycles, -0.5 to 0.5,
        positive where it is late; peak : ratio of the largest values less 1
    """

    correlation: float
    phase: float
    peak: float


def force_cycle(history: History, mesh: int, period: float) -> Array:
    """Mesh force [N] of a mesh (from 0) at CYCLE_POINTS times over its first period."""
    sample_times = history.time[0] + period * np.arange(CYCLE_POINTS) / CYCLE_POINTS
    return np.interp(sample_times, history.time, history.force[:, mesh])


def match_cycles(reference: ArrayLike, model: ArrayLike) -> CycleMatch:
    """Match of mesh forces (n,) over a cycle; NaN where one does not vary."""
    a, b = np.asarray(reference, float), np.asarray(model, float)
    if a.shape != b.shape or a.ndim != 1:
        raise ValueError(f"must have one shape (n,), got {a.shape} and {b.shape}")
    peak = relative_error(maximum(np.abs(a)), maximum(np.abs(b)))
    x, y = a - a.mean(), b - b.mean()
    norm = math.sqrt(float((x**2).sum() * (y**2).sum()))
    variance_floor = 1e-12 * max(float((a**2).sum()), float((b**2).sum()))
    if not norm > variance_floor:
        return CycleMatch(math.nan, math.nan, peak)
    cross_correlation = (
        np.fft.irfft(np.fft.rfft(y) * np.conj(np.fft.rfft(x)), a.size) / norm
    )
    return CycleMatch(float(cross_correlation[0]), _peak_lag(cross_correlation), peak)


def _peak_lag(cross_correlation: Array) -> float:
    """Lag of the largest value of a periodic array, in parts of its length."""
    i = int(cross_correlation.argmax())
    left, top, right = (
        cross_correlation[i - 1],
        cross_correlation[i],
        cross_correlation[(i + 1) % cross_correlation.size],
    )
    curvature = 2.0 * top - left - right
    lag = (
        i + (0.5 * (right - left) / curvature if curvature > 0.0 else 0.0)
    ) / cross_correlation.size
    return float(lag - round(lag))


@dataclass(frozen=True, eq=False)
class ForceCycle:
    """Mesh force over a mesh cycle (n,) [N], at a single speed.

    period_multiple : cycles after which it repeats, 0 if it did not within the cap
    """

    label: str
    mesh: int
    force: Array
    contact_loss: float
    period_multiple: int = 1


def cycle_measures(reference: ForceCycle, model: ForceCycle) -> Iterator[Measured]:
    match = match_cycles(reference.force, model.force)
    yield "wave_correlation", "", match.correlation
    yield "wave_phase", "", match.phase
    yield "wave_peak_force", "", match.peak
    yield "wave_contact_loss", "", model.contact_loss - reference.contact_loss
