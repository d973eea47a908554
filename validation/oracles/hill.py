"""Hill's equation with a sawtooth, x'' + (a t + b) x = 0, and the source's recursion.

Eq. 4.57 of the multi-mesh source on 0 <= t < h. Its Bessel functions of order 1/3,
eq. 4.58, are Airy functions, which keep a t + b below 0 real.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from lumped.common.array_types import Array


def exact_transition(a: float, b: float, h: float) -> Array:
    """State transition (2, 2) of (x, x') over h, eq. 4.59."""
    from scipy.special import airy

    root = np.cbrt(a)

    def states(t: float) -> Array:
        ai, ai_rate, bi, bi_rate = airy(-(a * t + b) / root**2)
        return np.array([[ai, bi], [-root * ai_rate, -root * bi_rate]])

    return np.asarray(states(h) @ np.linalg.inv(states(0.0)), float)


def first_order_form(a: float, b: float) -> tuple[Array, Array]:
    """G_0 and G_1 of y' = (G_0 + G_1 t) y."""
    return (
        np.array([[0.0, 1.0], [-b, 0.0]]),
        np.array([[0.0, 0.0], [-a, 0.0]]),
    )


def recursion(coefficients: Sequence[Array], h: float, terms: int) -> Array:
    """State transition over h by so many terms of the series of Peano and Baker.

    Eq. 4.55 for y' = (G_0 + G_1 t + ...) y of any degree: term n is made of powers of
    h, each from those of the term before.
    """
    powers = [h ** (j + 1) * g / (j + 1) for j, g in enumerate(coefficients)]
    total = np.eye(len(coefficients[0])) + sum(powers)
    for n in range(2, terms + 1):
        powers = [
            sum(
                (
                    h ** (j + 1) * g @ powers[i - j]
                    for j, g in enumerate(coefficients)
                    if 0 <= i - j < len(powers)
                ),
                np.zeros_like(total),
            )
            / (n + i)
            for i in range(len(powers) + len(coefficients) - 1)
        ]
        total = total + sum(powers)
    return np.asarray(total)


def exponentials(coefficients: Sequence[Array], h: float, divisions: int) -> Array:
    """Multipliers by exponentials of mean G on parts of h, eq. 4.56."""
    from scipy.linalg import expm

    ends = h * np.arange(divisions + 1) / divisions
    total = np.eye(len(coefficients[0]))
    for start, end in pairwise(ends.tolist()):
        order = np.arange(1, len(coefficients) + 1)
        weights = (end**order - start**order) / order
        exponent = sum(w * g for w, g in zip(weights, coefficients, strict=True))
        total = expm(exponent) @ total
    return np.asarray(total)
