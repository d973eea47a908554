"""Exact steps of the linear part of a train, see `lumped.kernels.arrays.Propagator`.

With y' = A y + b g the step is y(t + h) = e^{Ah} y + h int_0^1 e^{Ah(1 - s)} b g ds,
where g is a polynomial in s through values at its nodes. Functions of A are evaluated
at its eigenvalues. For a motion that the step does not resolve, forces vary linearly
within the step and decay is added: a cubic through nodes that far apart would make it
grow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lumped.common.array_types import Array, Complex
from lumped.kernels.arrays import CoupledSystem, Propagator
from lumped.train.rotating_frame import RotatingFrame

NODES = np.array([1.0, 0.0, -1.0, -2.0])  # nodes of a force, in steps
MAX_RESOLVED_ANGLE = 1.0  # rad per step up to which a motion is resolved
DECAY_PER_ANGLE = 0.25  # logarithm of the decay in a step per rad beyond it
# Least part of the largest squared frequency: no defective eigenvalues
MIN_STIFFNESS_RATIO = 1e-10
# |z| below which moments are integrated, otherwise by recurrence
MAX_INTEGRATED_EXPONENT = 2.0
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)
GAUSS_NODES = 0.5 * (GAUSS_POINTS + 1.0)
MOMENT_WEIGHTS = 0.5 * GAUSS_WEIGHTS * GAUSS_NODES ** np.arange(4)[:, None]
CUBIC_COEFFICIENTS = np.linalg.inv(
    np.vander(NODES, increasing=True)
).T  # values to coefficients
LINEAR_COEFFICIENTS = np.zeros((4, 4))
LINEAR_COEFFICIENTS[:2, :2] = np.linalg.inv(np.vander(NODES[:2], increasing=True)).T


@dataclass(frozen=True, eq=False)
class LinearPart:
    """Train without its contacts, and its eigenvalues.

    frame : inertial forces of a rotating frame on the standing coordinates, if any
    """

    system: CoupledSystem
    frame: RotatingFrame | None = None

    @property
    def n_wave_pairs(self) -> int:
        """Number of pairs of travelling modes."""
        return self.system.whirl.size

    @property
    def n_standing(self) -> int:
        """Number of coordinates that do not whirl."""
        return self.system.load.size - 2 * self.n_wave_pairs

    def _modes(self, frequency: float) -> tuple[Complex, Complex, Complex]:
        """Eigenvalues (2 a,), eigenvectors as rows (2 a, 2 a), and their inverse.

        They depend on the speed in a rotating frame alone.
        """
        if self.frame is None:
            return self._modes_at_rest
        stiffness, damping = self._standing
        return self._modes_with(
            stiffness + self.frame.stiffness(frequency),
            damping + self.frame.damping(frequency),
        )

    @cached_property
    def _modes_at_rest(self) -> tuple[Complex, Complex, Complex]:
        return self._modes_with(*self._standing)

    @property
    def _standing(self) -> tuple[Array, Array]:
        """Stiffness (a, a) and damping (a, a) of the coordinates that do not whirl."""
        standing = slice(0, self.n_standing)
        system = self.system
        return (
            system.stiffness[standing, standing],
            system.damping[standing, standing],
        )

    def _modes_with(
        self, stiffness: Array, damping: Array
    ) -> tuple[Complex, Complex, Complex]:
        a = self.n_standing
        eye = np.eye(a)
        stiffness = stiffness + MIN_STIFFNESS_RATIO * self._largest * eye
        matrix = np.block([[np.zeros((a, a)), eye], [-stiffness, -damping]])
        values, vectors = np.linalg.eig(matrix)
        return values.astype(complex), vectors.T.astype(complex), np.linalg.inv(vectors)

    @property
    def _largest(self) -> float:
        """Squared frequency of the contacts [1/s2]."""
        contacts, rows = self.system.contacts, self.system.rows[..., : self.n_standing]
        max_penetration = contacts.knots[:, -1].max()
        slope = contacts.load_curve[:, 0, 0, -1, 0].max() / max_penetration
        return float(slope * (rows**2).sum(axis=2).max())

    @cached_property
    def _wave_rates(self) -> tuple[Array, Array]:
        """Decay (w,) and damped angular frequency (w,) in the frame of the gear."""
        indices = np.arange(self.n_standing, self.n_standing + self.n_wave_pairs)
        squares, damping = (
            np.diag(matrix)[indices]
            for matrix in (self.system.stiffness, self.system.damping)
        )
        return 0.5 * damping, np.sqrt(squares - 0.25 * damping**2)

    def step(self, frequency: float, h: float) -> Propagator:
        """Step of size h [s] at a frequency of the first mesh [Hz]."""
        values, rows, inverse = self._modes(frequency)
        decay, angular = self._wave_rates
        pattern_rate = 2.0 * math.pi * frequency * self.system.whirl
        rates = -decay + 1j * (pattern_rate + np.array([[1.0], [-1.0]]) * angular)
        phase_angles = np.concatenate([np.abs(values), angular, angular]) * h
        all_factors = _factors(np.concatenate([values, *rates]), h, phase_angles)
        factors = all_factors[:, : values.size]
        # the map of each variable, and finally of a force, over the step
        matrices = ((inverse.T[None] * factors[:, None]) @ rows).real
        waves = all_factors[:, values.size :].reshape(5, 2, self.n_wave_pairs)
        waves[1:] /= 2j * np.stack([angular, -angular])
        return Propagator(
            transition=np.concatenate([matrices[0], *matrices[2:, self.n_standing :]]),
            force_response=np.ascontiguousarray(matrices[1, self.n_standing :]),
            waves=_real_and_imaginary(waves.swapaxes(0, 1)).reshape(
                2, 10, self.n_wave_pairs
            ),
            rates=_real_and_imaginary(rates),
        )


def _factors(rates: Complex, h: float, angle: Array) -> Complex:
    """Factors (5, ...): e^{rate h}, and weights of forces at NODES [s].

    angle : phase angle of a motion in a step [rad]
    """
    decays = DECAY_PER_ANGLE * np.maximum(angle - MAX_RESOLVED_ANGLE, 0.0)
    z = rates * h - decays
    moments = _moments(z)
    weights = np.tensordot(CUBIC_COEFFICIENTS, moments, axes=1)
    coarse = angle > MAX_RESOLVED_ANGLE
    if coarse.any():
        weights[:, coarse] = LINEAR_COEFFICIENTS @ moments[:, coarse]
        # constant forces give the same displacement however fast a motion decays
        weights[:, coarse] *= z[coarse] / (rates[coarse] * h)
    return np.concatenate([np.exp(z)[None], h * weights])


def _moments(z: Complex) -> Complex:
    """Moments int_0^1 e^{z (1 - s)} s^j ds (4, ...) for j = 0 to 3."""
    small = np.where(np.abs(z) < MAX_INTEGRATED_EXPONENT, z, 0.0)
    moments = np.tensordot(
        MOMENT_WEIGHTS, np.exp(np.multiply.outer(1.0 - GAUSS_NODES, small)), axes=1
    )
    is_large = np.abs(z) >= MAX_INTEGRATED_EXPONENT
    if is_large.any():
        moment = (np.exp(z[is_large]) - 1.0) / z[is_large]
        moments[0][is_large] = moment
        for j in range(1, 4):
            moment = (j * moment - 1.0) / z[is_large]
            moments[j][is_large] = moment
    return np.asarray(moments)


def _real_and_imaginary(values: Complex) -> Array:
    """Real and imaginary parts (k, 2, ..., w) of values (k, ..., w), contiguous."""
    return np.ascontiguousarray(np.stack([values.real, values.imag], axis=-2))
