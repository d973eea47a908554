"""Functions of the coordinate along the axis, with their integrals over the width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lumped.common.array_types import Array

END_LAYERS = 1.5, 0.5  # decay of what the free ends change, in modules
POINTS = 200  # of Gauss quadrature over the width


@dataclass(frozen=True, eq=False)
class WidthFunctions:
    """Functions f_k at points of a quadrature over the width.

    values, slopes : (points, k) of f_k and df_k/dz [1/m]
    weights : (points,) of the quadrature [m], 0 at places that only values are for
    """

    values: Array
    slopes: Array
    weights: Array

    @cached_property
    def mass(self) -> Array:
        """M_kl (k, k), the integral of f_k f_l [m]."""
        return np.asarray(self.values.T @ (self.weights[:, None] * self.values))

    @cached_property
    def cross(self) -> Array:
        """D_kl (k, k), the integral of f_k f_l'."""
        return np.asarray(self.values.T @ (self.weights[:, None] * self.slopes))

    @cached_property
    def stretch(self) -> Array:
        """S_kl (k, k), the integral of f_k' f_l' [1/m]."""
        return np.asarray(self.slopes.T @ (self.weights[:, None] * self.slopes))

    @cached_property
    def scale(self) -> tuple[float, float, float]:
        """Largest of M_kl [m], D_kl and S_kl [1/m]."""
        mass, cross, stretch = (
            float(np.abs(matrix).max())
            for matrix in (self.mass, self.cross, self.stretch)
        )
        return mass, cross, stretch


def layered_functions(width: float, layers: Sequence[float]) -> WidthFunctions:
    """Functions for loads that are uniform over the width.

    Those of even number are even, 1 and cosh(z / l) for each layer l, and serve
    displacement in the section; the odd ones z and sinh(z / l) that along the axis.

    width, layers : [m]
    """
    z, weights = _quadrature(width)
    half = 0.5 * width
    linear = np.stack([np.ones_like(z), z / half], 1)
    slopes = np.stack([np.zeros_like(z), np.full_like(z, 1.0 / half)], 1)
    of_ends, slopes_of_ends = _end_layers(z, width, layers)
    return _orthogonal(
        np.hstack([linear, of_ends]), np.hstack([slopes, slopes_of_ends]), weights
    )


def layered_polynomials(
    width: float,
    degree: int,
    layers: Sequence[float],
    places: Array | None = None,
) -> WidthFunctions:
    """Functions for loads in `polynomials`, which come first, up to a degree.

    Free ends change displacement over lengths that no polynomial of that degree has:
    cosh(z / l) and sinh(z / l) for each layer l follow. Those of odd number are odd.

    width, layers : [m]
    places : (p,) behind the points of the quadrature [m]
    """
    z, weights = _quadrature(width)
    if places is not None:
        z = np.concatenate([z, places])
        weights = np.concatenate([weights, np.zeros(places.size)])
    values, slopes = polynomial_values(width, degree, z)
    exchanged = np.arange(2 * len(layers)) ^ (1 - degree % 2)
    of_ends, slopes_of_ends = _end_layers(z, width, layers)
    return _orthogonal(
        np.hstack([values, of_ends[:, exchanged]]),
        np.hstack([slopes, slopes_of_ends[:, exchanged]]),
        weights,
    )


def _orthogonal(values: Array, slopes: Array, weights: Array) -> WidthFunctions:
    """Functions of the same span, each without its parts along those before it.

    On narrow teeth layers are nearly alike, and so would be rows of a stiffness. Odd
    functions have odd numbers; the length of each stays.
    """
    _, factor = np.linalg.qr(np.sqrt(weights)[:, None] * values)
    number = np.arange(len(factor))
    factor[np.add.outer(number, number) % 2 == 1] = 0.0  # round-off
    lengths = np.linalg.norm(factor, axis=0) * np.sign(np.diag(factor))
    back = np.linalg.solve(factor, np.diag(lengths))
    return WidthFunctions(values @ back, slopes @ back, weights)


def _end_layers(z: Array, width: float, layers: Sequence[float]) -> tuple[Array, Array]:
    """cosh(z / l) and sinh(z / l) in turn at places (n,), and slopes (n, k) [1/m]."""
    half, values, slopes = 0.5 * width, [], []
    for layer in layers:
        # over cosh(half / layer), which may exceed all floats
        grows, falls = np.exp((z - half) / layer), np.exp(-(z + half) / layer)
        unit = 1.0 + np.exp(-width / layer)
        even, odd = (grows + falls) / unit, (grows - falls) / unit
        values += [even, odd]
        slopes += [odd / layer, even / layer]
    return np.stack(values, 1), np.stack(slopes, 1)


def polynomials(width: float, degree: int) -> WidthFunctions:
    """Legendre polynomials up to a degree: M_kl is the width where k = l, else 0."""
    z, weights = _quadrature(width)
    values, slopes = polynomial_values(width, degree, z)
    return WidthFunctions(values, slopes, weights)


def polynomial_values(width: float, degree: int, z: Array) -> tuple[Array, Array]:
    """Values and slopes [1/m] (n, degree + 1) of `polynomials` at places (n,) [m]."""
    from numpy.polynomial import legendre

    scale = np.sqrt(2.0 * np.arange(degree + 1) + 1.0)
    # coefficients (k, k) of the slopes of all polynomials
    derived = legendre.legder(np.eye(degree + 1))[:degree]
    slopes = np.vstack([derived, np.zeros(degree + 1)])
    values = legendre.legvander(2.0 * z / width, degree)
    return values * scale, values @ slopes * scale * (2.0 / width)


def _quadrature(width: float) -> tuple[Array, Array]:
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    return 0.5 * width * points, 0.5 * width * weights
