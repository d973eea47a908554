"""Names of the combinations of modes that grow, from the growing motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.stability.combinations import Combination, mean_modes, name_of
from lumped.stability.multipliers import Method, scale_by_growth, scaled_transition
from lumped.stability.periodic_system import PeriodicSystem

Names = NDArray[np.str_]
# excess of a multiplier over 1: two that coincide are known to half of the digits only,
# and with damping they coincide inside the unit circle
MIN_GROWTH, MIN_DAMPED_GROWTH = 1e-6, 1e-9
# Part of a mesh frequency within which modes match a harmonic of it
MAX_ORDER_DISTANCE = 0.5


@dataclass(frozen=True, eq=False)
class Candidates:
    """Combinations (c,) that may grow, and the modes (n,) of the mean stiffness.

    low, high : expected interval, both `at` if it is stable or unlimited [Hz]
    to_mean_modes : (n, n) matrix from modal coordinates of the system to those of the
        mean stiffness
    """

    names: Names
    first: NDArray[np.int64]
    second: NDArray[np.int64]
    order: Array
    at: Array
    low: Array
    high: Array
    angular: Array
    to_mean_modes: Array


def candidates(system: PeriodicSystem, expected: Sequence[Combination]) -> Candidates:
    """Candidates for the names of unstable combinations of a system.

    expected : combinations of the system
    """
    angular, modes = mean_modes(system)
    at = np.array([c.at for c in expected])
    low, high = np.array([(c.low, c.high) for c in expected]).reshape(-1, 2).T
    bounded = np.isfinite(low) & np.isfinite(high)
    return Candidates(
        names=np.array([c.name for c in expected], str),
        first=np.array([c.first for c in expected], int),
        second=np.array([c.second for c in expected], int),
        order=np.array([c.order for c in expected]),
        at=at,
        low=np.where(bounded, low, at),
        high=np.where(bounded, high, at),
        angular=angular,
        to_mean_modes=np.asarray(np.linalg.inv(modes), float),
    )


def growth(
    system: PeriodicSystem, speeds: Array, labels: Candidates, method: Method
) -> tuple[Array, Names]:
    """Largest multipliers (f,) at speeds (f,) [Hz], and names of growing modes."""
    scaled, exponent = scaled_transition(system, speeds, method)
    values, vectors = np.linalg.eig(scaled)
    worst = np.abs(values).argmax(axis=1)[:, None]
    multiplier = np.take_along_axis(values, worst, axis=1)[:, 0]
    largest = scale_by_growth(np.abs(multiplier), exponent)
    names = np.full(speeds.size, "", "U64")
    decay = 0.5 * float(system.damping.min()) * system.length / speeds
    least = np.where(decay > MIN_GROWTH, MIN_DAMPED_GROWTH, MIN_GROWTH)
    if (grows := largest > 1.0 + least).any():
        motion = np.take_along_axis(vectors, worst[..., None], axis=2)[grows, :, 0]
        energy = _energies(motion, speeds[grows], labels)
        names[grows] = _name_combinations(
            labels, energy, multiplier[grows], speeds[grows]
        )
    return largest, names


def _energies(
    motion: NDArray[np.complex128], speeds: Array, labels: Candidates
) -> Array:
    """Shares (f, n) of modes in the energy of motions (f, 2 n)."""
    n = labels.angular.size
    rates = motion[:, n:] * speeds[:, None]
    energy = (
        np.abs(motion[:, :n] @ labels.to_mean_modes.T * labels.angular) ** 2
        + np.abs(rates @ labels.to_mean_modes.T) ** 2
    )
    return np.asarray(energy / energy.sum(axis=1, keepdims=True))


def _name_combinations(
    labels: Candidates,
    energy: Array,
    multiplier: NDArray[np.complex128],
    speeds: Array,
) -> Names:
    """Nearest combination, within MAX_ORDER_DISTANCE, of the modes that move most.

    One mode grows with a real multiplier, since half a harmonic of the mesh frequency
    is locked to it. Two modes keep different frequencies, with energies in the ratio of
    these frequencies.
    """
    real = multiplier.imag == 0.0
    order = np.argsort(-energy, axis=1, kind="stable")
    one = order[:, :1]
    other = np.where(real[:, None], one, order[:, min(1, order.shape[1] - 1), None])
    fits = labels.first == np.minimum(one, other)
    fits &= labels.second == np.maximum(one, other)
    fits &= (
        np.abs(speeds[:, None] - labels.at) * labels.order
        <= MAX_ORDER_DISTANCE * speeds[:, None]
    )
    distance = np.abs(speeds[:, None] - 0.5 * (labels.low + labels.high))
    half = np.maximum(0.5 * (labels.high - labels.low), 1e-12 * speeds[:, None])
    # inside several intervals, the one with the nearest middle, per half width
    relative_distance = np.where(
        distance <= half, distance / half, 1.0 + (distance - half) / speeds[:, None]
    )
    is_named = fits.any(axis=1)
    names = np.full(speeds.size, "", "U64")
    if is_named.any():
        names[is_named] = labels.names[
            np.where(fits, relative_distance, np.inf)[is_named].argmin(axis=1)
        ]
    for number in np.flatnonzero(~is_named).tolist():
        hertz = labels.angular / (2.0 * np.pi * speeds[number])
        names[number] = _name_by_order(
            int(one[number, 0]), int(other[number, 0]), hertz
        )
    return names


def _name_by_order(one: int, other: int, over_speed: Array) -> str:
    """Name of two modes, or of one twice, by the multiple nearest to their sum.

    over_speed : (n,) frequencies of the modes over that of the first mesh
    """
    first, second = sorted((one, other))
    gap, both = (
        over_speed[second] - over_speed[first],
        over_speed[[first, second]].sum(),
    )
    if first == second:
        return name_of("single", first, first, _order(both))
    if abs(gap - _order(gap)) < abs(both - _order(both)):
        return name_of("difference", first, second, _order(gap))
    return name_of("sum", first, second, _order(both))


def _order(ratio: float) -> int:
    return max(1, round(ratio))
