"""Linear train whose stiffness is a piecewise polynomial of time.

With modal coordinates q of unit mass,

    q'' + D q' + K(t) q = 0,

where K is the mean stiffness plus the terms k_i (v - mu sgn (b_0 + x b_1)) v' of the
pairs, and v are the deflections of a mesh in the modes. With friction K is not
symmetric. Modes that strain no mesh move with the others but do not affect them, and
are therefore left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Complex
from lumped.train.friction import base_pitch, friction_rows, sliding_sign
from lumped.train.system import LumpedSystem
from lumped.train.waves import Wave

STIFFNESS_DEGREE = 4  # degree of a cubic stiffness times a linear arm
N_GAUSS_NODES = 12  # nodes of Gauss quadrature on a piece


@dataclass(frozen=True, eq=False)
class PeriodicSystem:
    """n modes over the common period of all meshes' stiffness.

    angular : (n,) natural angular frequencies at mean stiffness [rad/s]
    damping : (n,) 2 zeta omega [1/s]
    edges : (p + 1,) edges of the pieces, in periods of the first mesh
    stiffness : (p, d + 1, n, n) coefficients of K over time from the start of a piece,
        in periods of the first mesh [1/s2]
    rates : mesh frequencies over that of the first, at whose harmonics K varies
    """

    angular: Array
    damping: Array
    edges: Array
    stiffness: Array
    rates: tuple[Fraction, ...] = (Fraction(1),)

    def __post_init__(self) -> None:
        n, pieces = self.angular.size, self.edges.size - 1
        if self.stiffness.ndim != 4 or self.stiffness.shape[2:] != (n, n):
            raise ValueError(
                f"shape of stiffness = {self.stiffness.shape}; must be "
                f"(p, d + 1, {n}, {n})"
            )
        if self.stiffness.shape[0] != pieces or not (np.diff(self.edges) > 0.0).all():
            raise ValueError(f"edges must rise and bound {len(self.stiffness)} pieces")
        for name in ("angular", "damping", "edges", "stiffness"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} must be finite")

    @property
    def modes(self) -> int:
        return self.angular.size

    @property
    def frequency_Hz(self) -> Array:
        """Natural frequencies (n,) at mean stiffness."""
        return self.angular / (2.0 * np.pi)

    @property
    def length(self) -> float:
        """Length of the common period, in periods of the first mesh."""
        return float(self.edges[-1])

    def orders(self, count: int) -> list[int]:
        """Orders of harmonics of K over the frequency of the common period, rising, up
        to `count` times the fastest mesh's frequency."""
        highest = count * max(self.rates)
        orders = {
            s * rate
            for rate in self.rates
            for s in range(1, math.floor(highest / rate) + 1)
        }
        return sorted(round(float(order) * self.length) for order in orders)

    def harmonic_of(self, order: int) -> tuple[int, int]:
        """Harmonic of a mesh that equals a harmonic of the common period's frequency,
        and the index of the first such mesh."""
        for mesh, rate in enumerate(self.rates):
            multiple = Fraction(order) / (Fraction(self.length) * rate)
            if multiple.denominator == 1:
                return int(multiple), mesh
        raise ValueError(f"order = {order}; must be a harmonic of a mesh")

    def at(self, time: Array, piece: NDArray[np.int64]) -> Array:
        """Stiffness K (t, n, n) at times from the starts of pieces."""
        powers = time[:, None] ** np.arange(self.stiffness.shape[1])
        return np.einsum("tj,tjab->tab", powers, self.stiffness[piece])

    def harmonic(self, order: int) -> Complex:
        """Fourier coefficient (n, n) of e^(2 pi i order t / length) in K."""
        start, step = self.edges[:-1, None], np.diff(self.edges)[:, None]
        nodes, weights = np.polynomial.legendre.leggauss(N_GAUSS_NODES)
        cuts = max(1, math.ceil(abs(order) * float(step.max()) / self.length))
        fraction = (np.arange(cuts)[:, None] + 0.5 * (1.0 + nodes)).ravel() / cuts
        weight = np.tile(0.5 * weights / cuts, cuts)
        time = (step * fraction).ravel()
        piece = np.repeat(np.arange(len(step)), fraction.size)
        turn = np.exp(
            -2j * np.pi * order * (start + step * fraction).ravel() / self.length
        )
        scale = (step * weight).ravel() / self.length * turn
        return np.asarray(np.einsum("t,tab->ab", scale, self.at(time, piece)), complex)

    @cached_property
    def mean(self) -> Array:
        """Mean (n, n) of K."""
        return np.asarray(self.harmonic(0).real)

    def averaged(self, divisions: int) -> PeriodicSystem:
        """Return the system with mean stiffness on parts of every piece (eq. 4.56)."""
        edges, rows = [], []
        for start, step, coefficients in zip(
            self.edges[:-1], np.diff(self.edges), self.stiffness, strict=True
        ):
            ends = step * np.arange(divisions + 1) / divisions
            edges.append(start + ends[:-1])
            order = np.arange(1, len(coefficients) + 1)
            powers = np.diff(ends[:, None] ** order / order, axis=0)
            rows.append(
                np.einsum("tj,jab->tab", powers, coefficients) * divisions / step
            )
        all_edges = np.concatenate([*edges, self.edges[-1:]])
        return replace(self, edges=all_edges, stiffness=np.concatenate(rows)[:, None])


def periodic_system(system: LumpedSystem) -> PeriodicSystem:
    """Periodic system of a train in contact, with friction by nominal sliding.

    Raises ValueError for the coupled model and for tooth pairs that differ.
    """
    _require(system)
    moving = system.moving
    modes, arrays = system.modes, system.arrays
    # the stiffness repeats with the meshes, regardless of pitch errors
    length = float(system.train.common_period[0])
    times = np.concatenate([[0.0], system.excitation.breaks(), [length]])
    v, n = arrays.shapes, arrays.rigidity.size
    constant_stiffness = np.diag(arrays.rigidity) - np.einsum(
        "m,mi,mj->ij", arrays.mean_stiffness, v, v
    )
    stiffness = np.zeros((times.size - 1, STIFFNESS_DEGREE + 1, n, n))
    stiffness[:, 0] = constant_stiffness
    rows = friction_rows(system.train, modes.coordinates)
    at_pitch, _, per_metre = rows.on_modes(modes.shapes[:, moving])
    for m, excitation in enumerate(system.excitations):
        phase = system.train.meshes[m].phase % 1.0
        rate = float(system.train.mesh_rates[m])
        pitch = base_pitch(system.train, m)
        coefficient = system.friction[m].coefficient if system.has_friction else 0.0
        for pair in excitation.pairs:
            wave, position = _along(pair.stiffness, phase, rate, times)
            ahead = pair.ahead or 0
            signed_friction = coefficient * sliding_sign(ahead)
            arm = pitch * (position + ahead)
            steady = v[m] - signed_friction * (
                at_pitch[m] + arm[:, None] * per_metre[m]
            )
            growing = -signed_friction * pitch * rate * per_metre[m]
            stiffness[:, :4] += np.einsum("pd,pi,j->pdij", wave, steady, v[m])
            stiffness[:, 1:] += np.einsum("pd,i,j->pdij", wave, growing, v[m])
    rates = system.train.mesh_rates
    return PeriodicSystem(
        modes.angular[moving], arrays.damping, times, stiffness, rates
    )


def _along(wave: Wave, phase: float, rate: float, times: Array) -> tuple[Array, Array]:
    """Coefficients (p, 4) of a wave over pieces of time, and their positions (p,)."""
    start, middle = times[:-1], 0.5 * (times[:-1] + times[1:])
    whole = np.floor(phase + rate * middle)
    place = phase + rate * start - whole
    piece = np.searchsorted(wave.breaks, phase + rate * middle - whole, "right") - 1
    piece = np.clip(piece, 0, wave.breaks.size - 2)
    cubics = wave.shapes[0, piece]
    shift = place - wave.breaks[piece]
    out = np.zeros_like(cubics)
    for power in range(4):
        for j in range(power + 1):
            factor = comb(power, j) * shift ** (power - j) * rate**j
            out[:, j] += cubics[:, power] * factor
    return out, place


def _require(system: LumpedSystem) -> None:
    if system.contacts is not None:
        raise ValueError("model = coupled; must be 1, 2 or 3")
    for excitation in system.excitations:
        if max(len(pair.stiffness.shapes) for pair in excitation.pairs) > 1:
            raise ValueError("excitation must repeat after one base pitch")
