"""Flamant's half-plane under a line load: displacement, stress and kernels.

Plane elasticity in two constants: E' and nu', equal to E and nu in plane stress
and to E / (1 - nu^2) and nu / (1 - nu) in plane strain. Loads are per unit width.
Timoshenko & Goodier, Theory of Elasticity, 3rd ed. (1970), article 36.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array, Complex


def _local_polar(
    points: Array, origin: Array, inward: Array, cut: Array | None = None
) -> tuple[Array, Array]:
    """Polar coordinates about the load; the angle is from the inward normal.

    It is within pi of the direction opposite to the cut, by default the outward normal.
    """
    offset = points - origin
    tangent = np.array([-inward[1], inward[0]])
    branch_angle = 0.0 if cut is None else math.atan2(-tangent @ cut, -inward @ cut)
    c, s = math.cos(branch_angle), math.sin(branch_angle)
    depth, across = (
        offset @ (c * inward + s * tangent),
        offset @ (c * tangent - s * inward),
    )
    return np.hypot(depth, across), branch_angle + np.arctan2(across, depth)


def displacement(
    points: Array,
    origin: Array,
    inward: Array,
    modulus: float,
    poisson: float,
    load_angle: float = 0.0,
    cut: Array | None = None,
) -> Array:
    """Displacement (n, 2) of points (n, 2) per unit line load [m/(N/m)].

    The load acts at `origin`, turned by load_angle [rad] counterclockwise from
    the unit `inward` normal. The rigid motion is chosen so that the displacement
    of the surface along a normal load is -2 ln(r) / (pi E'), r in metres. The
    origin itself maps to zero: the finite part of that expression.

    cut : (2,) the way out from the origin across which displacements jump, by default
        along the outward normal; it must not meet the body
    """
    r, angle = _local_polar(points, origin, inward, cut)
    at_load = r == 0.0
    log_r = np.log(np.where(at_load, 1.0, r))
    theta = angle - load_angle
    c, s = np.cos(theta), np.sin(theta)
    spread = (1.0 - poisson) * angle  # `angle` for theta: differs by a translation
    radial = -2.0 * c * log_r - spread * s + (1.0 + poisson) * c
    tangential = 2.0 * s * log_r - spread * c
    along_r, along_theta = _axes(inward, angle)
    field = (radial[:, None] * along_r + tangential[:, None] * along_theta) / (
        math.pi * modulus
    )
    return np.where(at_load[:, None], 0.0, field)


def _axes(inward: Array, angle: Array) -> tuple[Array, Array]:
    side = np.array([-inward[1], inward[0]])
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return c * inward + s * side, c * side - s * inward


def traction(
    points: Array,
    normals: Array,
    origin: Array,
    inward: Array,
    load_angle: float = 0.0,
) -> Array:
    """Traction (n, 2) on unit outward normals (n, 2) per unit line load [1/m].

    Stress is purely radial: sigma_rr = -2 cos(theta) / (pi r).
    """
    r, angle = _local_polar(points, origin, inward)
    along_r, _ = _axes(inward, angle)
    stress = -2.0 * np.cos(angle - load_angle) / (math.pi * r)
    return (stress * np.einsum("ij,ij->i", along_r, normals))[:, None] * along_r


def normal_kernel(distance: ArrayLike, modulus: float) -> Array:
    """Surface displacement along a unit normal line load, finite part 0 at 0."""
    r = np.abs(np.asarray(distance, float))
    return -2.0 * np.log(np.where(r == 0.0, 1.0, r)) / (math.pi * modulus)


def tangential_kernel(distance: ArrayLike, modulus: float, poisson: float) -> Array:
    """Displacement along the surface, positive with `distance`, per normal load.

    Points on either side are drawn toward the load.
    """
    return -0.5 * (1.0 - poisson) / modulus * np.sign(distance)


def hat_stress(
    points: Array,
    origin: Array,
    inward: Array,
    half_length: float,
    normal: float,
    tangential: float,
) -> Array:
    """Stress (n, 3) as (xx, yy, xy) under a hat-shaped surface load [Pa].

    The load falls linearly from `origin` to zero at half_length on either side;
    normal and tangential are its resultants [N/m], into the body and along the
    surface turned counterclockwise from `inward`. Integral of Flamant's stress by
    F(z) = int p(t) / (z - t) dt, whose second difference in t is elementary.
    """
    side = np.array([-inward[1], inward[0]])
    offset = points - origin
    x, y = offset @ side, offset @ inward
    F, slope = _hat_potential(x + 1j * y, half_length)
    A, B, W, V = F.real, -F.imag, 0.5 * y * slope.imag, 0.5 * y * slope.real
    X, Y = 0.5 * B - V, 0.5 * B + V
    scale = -2.0 / math.pi
    along = scale * (normal * X + tangential * (A - W))
    into = scale * (normal * Y + tangential * W)
    shear = scale * (normal * W + tangential * X)
    return _turned_stress(along, into, shear, side, inward)


def _hat_potential(z: NDArray[np.complex128], h: float) -> tuple[NDArray, NDArray]:
    """F and dF/dz of a hat with unit resultant, cut along the outward normal."""

    def log(zeta: NDArray) -> NDArray:
        nonzero_zeta = np.where(zeta == 0.0, 1.0, zeta)
        return np.log(-1j * nonzero_zeta) + 0.5j * math.pi

    z_plus, z_centre, z_minus = z + h, z, z - h
    L = [log(z_plus), log(z_centre), log(z_minus)]
    F = (z_plus * L[0] - 2.0 * z_centre * L[1] + z_minus * L[2]) / h**2
    return F, (L[0] - 2.0 * L[1] + L[2]) / h**2


def _turned_stress(
    along: Array, into: Array, shear: Array, side: Array, inward: Array
) -> Array:
    """Components (xx, yy, xy) from those along the surface and into the body."""
    s, n = side, inward
    parts = [
        along * s[i] * s[j] + into * n[i] * n[j] + shear * (s[i] * n[j] + s[j] * n[i])
        for i, j in ((0, 0), (1, 1), (0, 1))
    ]
    return np.stack(parts, axis=-1)


def hat_displacement(
    points: Array,
    origin: Array,
    inward: Array,
    half_length: float,
    forces: tuple[float, float],
    moduli: tuple[float, float],
) -> Array:
    """Displacement (n, 2) of points (n, 2) under a hat-shaped line load [m].

    The load falls linearly from `origin` to zero at half_length on either side: the
    field of `displacement`, integrated over the hat. With depth y below the surface, x
    along it and z = x + i y, all of it follows from log(-i z) and y / z, whose
    integrals over a hat are second differences.

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
