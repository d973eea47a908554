"""Fourier series of periodic motions: mean, cosines and sines, (2 H + 1, d)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lumped.common.array_types import Array, Complex


@dataclass(frozen=True)
class Series:
    """Fourier series of H = `order` harmonics.

    Their period has a `length` in periods of the first mesh.
    """

    order: int
    length: int

    @property
    def rows(self) -> int:
        return 2 * self.order + 1

    def basis(self, times: Array, order: int = 0) -> Array:
        """Values (t, 2 H + 1) at times (t,); order : other than H."""
        harmonics = np.arange(1, (order or self.order) + 1)
        angle = 2.0 * math.pi / self.length * times[:, None] * harmonics
        ones = np.ones((times.size, 1))
        return np.concatenate([ones, np.cos(angle), np.sin(angle)], axis=1)

    def slope(self, x: Array) -> Array:
        """Series of the derivative by time in periods of the first mesh."""
        H = self.order
        turn = 2.0 * math.pi / self.length * np.arange(1, H + 1)[:, None]
        derivative = np.zeros_like(x)
        derivative[1 : H + 1] = turn * x[H + 1 :]
        derivative[H + 1 :] = -turn * x[1 : H + 1]
        return derivative

    def waves(self, x: Array) -> Complex:
        """Complex amplitudes (H + 1, d), of which a series is the real part."""
        H = self.order
        amplitudes = np.zeros((H + 1, *x.shape[1:]), complex)
        amplitudes[0] = x[0]
        amplitudes[1:] = x[1 : H + 1] - 1j * x[H + 1 :]
        return amplitudes

    def of_waves(self, waves: Complex) -> Array:
        return np.concatenate([waves.real, -waves[1:].imag])

    def of_samples(self, values: Array) -> Array:
        """Series of t > 2 H values (t, d) at equal steps from the period's start on."""
        waves = 2.0 * np.fft.rfft(values, axis=0)[: self.order + 1] / len(values)
        waves[0] *= 0.5
        return self.of_waves(waves)

    def products(self, moments: Array) -> Array:
        """Matrix (2 H + 1, 2 H + 1) that takes a series to its product with a function.

        moments : (4 H + 1,) mean of the function times each wave up to harmonic 2 H
        """
        H = self.order
        h = np.arange(H + 1)
        plus, minus = h[:, None] + h, h[:, None] - h
        cosine = moments[: 2 * H + 1]
        sine = np.concatenate([[0.0], moments[2 * H + 1 :]])
        odd = np.sign(minus) * sine[np.abs(minus)]
        matrix = np.empty((2 * H + 1, 2 * H + 1))
        matrix[: H + 1, : H + 1] = cosine[plus] + cosine[np.abs(minus)]
        matrix[: H + 1, H + 1 :] = (sine[plus] - odd)[:, 1:]
        matrix[H + 1 :, : H + 1] = (sine[plus] + odd)[1:]
        matrix[H + 1 :, H + 1 :] = (cosine[np.abs(minus)] - cosine[plus])[1:, 1:]
        matrix[0] *= 0.5  # the mean
        return matrix

    def filtered(self, receptance: Complex, matrix: Array) -> Array:
        """Multiply each column of a matrix, a series, by a receptance (H + 1,)."""
        H = self.order
        real, imaginary = receptance.real[:, None], receptance.imag[:, None]
        out = np.empty_like(matrix)
        out[: H + 1] = real * matrix[: H + 1]
        out[1 : H + 1] += imaginary[1:] * matrix[H + 1 :]
        out[H + 1 :] = real[1:] * matrix[H + 1 :] - imaginary[1:] * matrix[1 : H + 1]
        return out

    def delayed(self, x: Array, periods: float) -> Array:
        """The series of the same motion so many periods of the first mesh later."""
        H = self.order
        turn = 2.0 * math.pi / self.length * periods * np.arange(1, H + 1)[:, None]
        cosines, sines = x[1 : H + 1], x[H + 1 :]
        series = x.copy()
        series[1 : H + 1] = np.cos(turn) * cosines + np.sin(turn) * sines
        series[H + 1 :] = np.cos(turn) * sines - np.sin(turn) * cosines
        return series


@dataclass(frozen=True, eq=False)
class SampledSeries:
    """Series on the pieces of their period between edges (e + 1,).

    Each piece has five checks: its ends and three Gauss points, one in the middle.
    """

    series: Series
    edges: Array

    @cached_property
    def times(self) -> Array:
        """Times of the checks (e, 5), in periods of the first mesh."""
        from lumped.kernels.orbit import PIECE_CHECKS

        return np.asarray(
            self.edges[:-1, None] + np.diff(self.edges)[:, None] * PIECE_CHECKS
        )

    @property
    def points(self) -> Array:
        """Times of the Gauss points (3 e,)."""
        return self.times[:, 1:4].ravel()

    @cached_property
    def _checks(self) -> Array:
        return self.series.basis(self.times.ravel())

    @cached_property
    def twice(self) -> Array:
        """Waves up to 2 H at the Gauss points (3 e, 4 H + 1)."""
        return self.series.basis(self.points, 2 * self.series.order)

    def values(self, x: Array) -> Array:
        """Values of a series (2 H + 1, d) at the checks (e, 5, d)."""
        return (self._checks @ x).reshape(*self.times.shape, x.shape[1])
