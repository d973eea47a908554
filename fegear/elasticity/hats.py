"""Displacement of a half-plane under a hat of surface load.

Flamant's field of `halfplane.displacement`, integrated over the hat. With depth y
below the surface, x along it and z = x + i y, all of it follows from log(-i z) and
y / z, whose integrals over a hat are second differences.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.array_types import Array, Complex


def hat_displacement(
    points: Array,
    origin: Array,
    inward: Array,
    half_length: float,
    forces: tuple[float, float],
    moduli: tuple[float, float],
) -> Array:
    """Displacement (n, 2) of points (n, 2) under a hat-shaped line load [m].

    The load falls linearly from `origin` to zero at half_length on either side.

    forces : resultants into the body and along the surface, turned
        counterclockwise from `inward` [N/m]
    moduli : E' [Pa] and nu' of the plane state
    """
    (normal, tangential), (modulus, poisson) = forces, moduli
    tangent = np.array([-inward[1], inward[0]])
    offset = points - origin
    x, y = offset @ tangent, offset @ inward
    log, pole = _hat_means(x + 1j * y, half_length)
    Y = (1.0 + poisson) * y * pole
    swirl = (1.0 - poisson) * log.imag
    into = normal * (-2.0 * log.real - Y.imag) + tangential * (Y.real - swirl)
    along = normal * (swirl + Y.real)
    along += tangential * (1.0 + poisson + Y.imag - 2.0 * log.real)
    field = into[:, None] * inward + along[:, None] * tangent
    return field / (math.pi * modulus)


def _hat_means(z: Complex, h: float) -> tuple[Complex, Complex]:
    """Means of log(-i (z - t)) and 1 / (z - t) over a hat in t, cut outside."""
    ends = (z + h, z, z - h)
    logs = [np.log(-1j * np.where(end == 0.0, 1.0, end)) for end in ends]
    square, line = (
        [end**power * log for end, log in zip(ends, logs, strict=True)]
        for power in (2, 1)
    )
    mean = 0.5 * (square[0] - 2.0 * square[1] + square[2]) / h**2 - 1.5
    return mean, (line[0] - 2.0 * line[1] + line[2]) / h**2
