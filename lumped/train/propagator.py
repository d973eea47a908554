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
from numpy.typing import NDArray

from lumped.kernels.arrays import CoupledSystem, Propagator

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
NODES = np.array([1.0, 0.0, -1.0, -2.0])  # nodes of a force, in steps
RESOLVED = 1.0  # rad per step up to which a motion is resolved
FADING = 0.25  # logarithm of the decay in a step per rad beyond it
SOFT = 1e-10  # least part of the largest squared frequency: no defective eigenvalues
SMALL = 2.0  # |z| below which moments are integrated, otherwise by recurrence
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)
PLACES = 0.5 * (POINTS + 1.0)
POWERS = 0.5 * WEIGHTS * PLACES ** np.arange(4)[:, None]
CUBIC = np.linalg.inv(np.vander(NODES, increasing=True)).T  # values to coefficients
LINEAR = np.zeros((4, 4))
LINEAR[:2, :2] = np.linalg.inv(np.vander(NODES[:2], increasing=True)).T


@dataclass(frozen=True, eq=False)
class LinearPart:
    """Train without its contacts, and its eigenvalues."""

    system: CoupledSystem

    @property
    def waves(self) -> int:
        """Number of pairs of travelling modes."""
        return self.system.whirl.size

    @property
    def standing(self) -> int:
        """Number of coordinates that do not whirl."""
        return self.system.load.size - 2 * self.waves

    @cached_property
    def _modes(self) -> tuple[Complex, Complex, Complex]:
        """Eigenvalues (2 a,), eigenvectors as rows (2 a, 2 a), and their inverse."""
        a = self.standing
        standing, eye = slice(0, a), np.eye(a)
        stiffness = self.system.stiffness[standing, standing]
        stiffness = stiffness + SOFT * self._largest * eye
        matrix = np.block(
            [
                [np.zeros((a, a)), eye],
                [-stiffness, -self.system.damping[standing, standing]],
            ]
        )
        values, vectors = np.linalg.eig(matrix)
        return values.astype(complex), vectors.T.astype(complex), np.linalg.inv(vectors)

    @property
    def _largest(self) -> float:
        """Squared frequency of the contacts [1/s2]."""
        contacts, rows = self.system.contacts, self.system.rows[..., : self.standing]
        reach = contacts.knots[:, -1].max()
        slope = contacts.load_curve[:, 0, 0, -1, 0].max() / reach
        return float(slope * (rows**2).sum(axis=2).max())

    @cached_property
    def _wave_rates(self) -> tuple[Array, Array]:
        """Decay (w,) and damped angular frequency (w,) in the frame of the gear."""
        indices = np.arange(self.standing, self.standing + self.waves)
        squares, damping = (
            np.diag(matrix)[indices]
            for matrix in (self.system.stiffness, self.system.damping)
        )
        return 0.5 * damping, np.sqrt(squares - 0.25 * damping**2)

    def step(self, frequency: float, h: float) -> Propagator:
        """Step of size h [s] at a frequency of the first mesh [Hz]."""
        values, rows, inverse = self._modes
        decay, angular = self._wave_rates
        turn = 2.0 * math.pi * frequency * self.system.whirl
        rates = -decay + 1j * (turn + np.array([[1.0], [-1.0]]) * angular)
        turned = np.concatenate([np.abs(values), angular, angular]) * h
        all_factors = _factors(np.concatenate([values, *rates]), h, turned)
        factors = all_factors[:, : values.size]
        # the map of each variable, and finally of a force, over the step
        matrices = ((inverse.T[None] * factors[:, None]) @ rows).real
        waves = all_factors[:, values.size :].reshape(5, 2, self.waves)
        waves[1:] /= 2j * np.stack([angular, -angular])
        return Propagator(
            carry=np.concatenate([matrices[0], *matrices[2:, self.standing :]]),
            push=np.ascontiguousarray(matrices[1, self.standing :]),
            waves=_parts(waves.swapaxes(0, 1)).reshape(2, 10, self.waves),
            rates=_parts(rates),
        )


def _factors(rates: Complex, h: float, angle: Array) -> Complex:
    """Factors (5, ...): e^{rate h}, and weights of forces at NODES [s].

    angle : phase angle of a motion in a step [rad]
    """
    decays = FADING * np.maximum(angle - RESOLVED, 0.0)
    z = rates * h - decays
    moments = _moments(z)
    weights = np.tensordot(CUBIC, moments, axes=1)
    coarse = angle > RESOLVED
    if coarse.any():
        weights[:, coarse] = LINEAR @ moments[:, coarse]
        # constant forces give the same displacement however fast a motion decays
        weights[:, coarse] *= z[coarse] / (rates[coarse] * h)
    return np.concatenate([np.exp(z)[None], h * weights])


def _moments(z: Complex) -> Complex:
    """Moments int_0^1 e^{z (1 - s)} s^j ds (4, ...) for j = 0 to 3."""
    near = np.where(np.abs(z) < SMALL, z, 0.0)
    moments = np.tensordot(
        POWERS, np.exp(np.multiply.outer(1.0 - PLACES, near)), axes=1
    )
    far = np.abs(z) >= SMALL
    if far.any():
        moment = (np.exp(z[far]) - 1.0) / z[far]
        moments[0][far] = moment
        for j in range(1, 4):
            moment = (j * moment - 1.0) / z[far]
            moments[j][far] = moment
    return np.asarray(moments)


def _parts(values: Complex) -> Array:
    """Real and imaginary parts (k, 2, ..., w) of values (k, ..., w), contiguous."""
    return np.ascontiguousarray(np.stack([values.real, values.imag], axis=-2))
