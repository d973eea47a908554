"""Combinations of modes that a varying stiffness makes unstable, by multiple scales.

Near s W = w_p +- w_q + sigma, where W is the frequency of the common period, the
amplitudes satisfy

    (lambda + g_p) (lambda - i sigma + g_q) = +- Psi / 4,
    Psi = (K_s)_pq conj (K_s)_qp / (w_p w_q),

where K_s is the Fourier coefficient of the stiffness in the modes of its mean, and
g = zeta w the decay rate of a mode; see eq. 4.72 to 4.76 of the multi-mesh source. Its
Lambda, Theta, D and E are the terms of K_s. On the edges lambda is imaginary, so that
sigma is the root of a quadratic equation, eq. 4.82 to 4.84. The modes include the mean
of friction, which the source neglects.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lumped.common.array_types import Array
from lumped.stability.periodic_system import PeriodicSystem

Kind = Literal["single", "sum", "difference"]
KINDS: Mapping[int, Kind] = {1: "sum", -1: "difference"}
N_ORDERS = 12  # harmonics of the fastest mesh's frequency that are considered
MIN_EXCITATION = 1e-14  # excitation over squared frequencies that is round-off


@dataclass(frozen=True, eq=False)
class Combination:
    """Modes that take part, numbered from 0, and mesh frequencies [Hz].

    order : multiple of the first mesh's frequency that equals the sum or difference
    harmonic, mesh : the same as a multiple of the frequency of a mesh, numbered from 0
    at : mesh frequency at which it does
    low, high : ends of the interval of instability, NaN if it is stable
    """

    kind: Kind
    first: int
    second: int
    order: float
    harmonic: int
    mesh: int
    at: float
    low: float
    high: float

    @property
    def unstable(self) -> bool:
        return math.isfinite(self.low)

    @property
    def name(self) -> str:
        """Name as in the source, such as `f1 + f3` or `(2 f3) / 2 of mesh 2`."""
        label = name_of(self.kind, self.first, self.second, self.harmonic)
        return f"{label} of mesh {self.mesh + 1}" if self.mesh else label

    def comes_near(self, limits: tuple[float, float]) -> bool:
        """Whether it occurs, or is expected to grow, between mesh frequencies [Hz]."""
        low = min(self.low, self.at) if math.isfinite(self.low) else self.at
        high = max(self.high, self.at) if math.isfinite(self.high) else self.at
        return low <= limits[1] and high >= limits[0]


def name_of(kind: Kind, first: int, second: int, harmonic: int) -> str:
    """Name of two modes, from 0, at a multiple of the first mesh's frequency."""
    one, two = first + 1, second + 1
    label = f"2 f{one}" if kind == "single" else f"f{two} - f{one}"
    label = f"f{one} + f{two}" if kind == "sum" else label
    return label if harmonic == 1 else f"({label}) / {harmonic}"


def combinations(
    system: PeriodicSystem,
    limits: tuple[float, float] = (0.0, math.inf),
    orders: int = N_ORDERS,
) -> list[Combination]:
    """All combinations near mesh frequencies [Hz], by frequency, excited or not."""
    in_range = [c for c in _combinations(system, orders) if c.comes_near(limits)]
    return sorted(in_range, key=lambda combination: (combination.at, combination.order))


def _combinations(system: PeriodicSystem, orders: int) -> Iterator[Combination]:
    angular, modes = mean_modes(system)
    decay = 0.5 * np.einsum("ij,j,ji->i", np.linalg.inv(modes), system.damping, modes)
    for s in system.orders(orders):
        # factor from a frequency of modes to the first mesh's frequency
        frequency_ratio = system.length / (2.0 * math.pi * s)
        coupling = np.linalg.solve(modes, system.harmonic(s) @ modes)
        harmonic, mesh = system.harmonic_of(s)
        for p, q, sign in _pairs(system.modes):
            at = frequency_ratio * (angular[p] + sign * angular[q])
            psi = (
                coupling[p, q] * coupling[q, p].conjugate() / (angular[p] * angular[q])
            )
            low, high = math.nan, math.nan
            if abs(psi) >= MIN_EXCITATION * angular[p] * angular[q]:
                low, high = detunings(sign * psi / 4.0, decay[p], decay[q])
            yield Combination(
                kind="single" if p == q else KINDS[sign],
                first=q,
                second=p,
                order=s / system.length,
                harmonic=harmonic,
                mesh=mesh,
                at=at,
                low=at + frequency_ratio * low,
                high=at + frequency_ratio * high,
            )


def _pairs(modes: int) -> Iterator[tuple[int, int, int]]:
    """Pairs of modes, the higher one first, and the sign of the lower frequency."""
    for p in range(modes):
        yield p, p, 1
        for q in range(p):
            yield p, q, 1
            yield p, q, -1


def mean_modes(system: PeriodicSystem) -> tuple[Array, Array]:
    """Angular frequencies (n,) and modes, columns (n, n), of the mean stiffness.

    Raises ArithmeticError if friction makes the mean system unstable.
    """
    squares, modes = np.linalg.eig(system.mean)
    if np.iscomplexobj(squares) or not (squares > 0.0).all():
        raise ArithmeticError("the mean stiffness with friction is unstable")
    order = np.argsort(squares)
    return np.sqrt(squares[order]), modes[:, order]


def detunings(power: complex, first: float, second: float) -> tuple[float, float]:
    """Limits of sigma [rad/s] between which vibration grows, NaN if it does not.

    The limits are infinite if two modes without damping are unstable at any detuning.

    power : +-Psi / 4
    first, second : decay rates of the modes
    """
    decay_sum, product, real, imag = (
        first + second,
        first * second,
        power.real,
        power.imag,
    )
    if product == 0.0:
        if abs(imag) > 1e-9 * abs(power):
            return -math.inf, math.inf
        half = 2.0 * math.sqrt(real) if real > 0.0 else math.nan
        return -half, half
    inside = imag**2 + 4.0 * product * (real - product)
    if inside <= 0.0:
        return math.nan, math.nan
    middle, half = imag * (first - second), decay_sum * math.sqrt(inside)
    return (middle - half) / (2.0 * product), (middle + half) / (2.0 * product)
