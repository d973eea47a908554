"""Closed forms for gear trains with constant mesh stiffness and rotating disks.

Multi-mesh gear dynamics (2007): eq. (3.2) for the idler; eqs. (4.1)-(4.3) for the
counter-shaft, with the second mesh between the gears 3 and 4 (eq. 4.1 prints 2 and
3) and the inverse of the mass matrix, which is not printed, derived from the
disks; eq. (2.10) for the response to transmission errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh, eigvals

from lumped.common.array_types import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearTrain:
    """n disks, m meshes of constant stiffness.

    inertia : (n,) [kg m2]
    rows : (m, n) mesh deflection per rotation [m]
    stiffness : (m,) [N/m]
    ground : (n, n) stiffness of couplings and shafts [N m/rad]
    torque : (n,) [N m]
    """

    inertia: Array
    rows: Array
    stiffness: Array
    ground: Array
    torque: Array
    damping_ratio: float

    @property
    def matrix(self) -> Array:
        """Stiffness matrix (n, n) in the rotations."""
        return self.ground + (self.rows.T * self.stiffness) @ self.rows


@dataclass(frozen=True, eq=False)
class Tone:
    """Part 2 Re(amplitude exp(i angular t)) of each mesh's transmission error (m,)."""

    angular: float  # rad/s
    amplitude: NDArray[np.complex128]  # m


def static_deflection(train: LinearTrain) -> Array:
    """Mesh deflections (m,) under the torques, which must balance [m]."""
    rotation = np.linalg.lstsq(train.matrix, train.torque, rcond=1e-13)[0]
    return np.asarray(train.rows @ rotation)


def harmonic_deflection(
    train: LinearTrain, tones: Sequence[Tone]
) -> NDArray[np.complex128]:
    """Complex deflections (tones, m) that the tones' transmission errors cause.

    M theta'' + C theta' + K theta = T + sum_n rows_n^T k_n e_n(t), solved mode by
    mode with one damping ratio; a motion that strains nothing is not excited.
    """
    squares, shapes = eigh(train.matrix, np.diag(train.inertia))
    angular = np.sqrt(np.maximum(squares, 0.0))
    deflections = train.rows @ shapes
    out = []
    for tone in tones:
        force = deflections.T @ (train.stiffness * tone.amplitude)
        w, damping = tone.angular, 2.0 * train.damping_ratio * angular
        out.append(deflections @ (force / (squares - w**2 + 1j * w * damping)))
    return np.array(out)


def rms(amplitudes: ArrayLike) -> Array:
    """RMS (m,) of sums of tones of different frequencies (tones, m)."""
    size = np.abs(np.asarray(amplitudes))
    return np.asarray(np.sqrt(2.0 * (size**2).sum(axis=0)))


def pair_frequency(
    stiffness: float, radii: Sequence[float], inertias: Sequence[float]
) -> float:
    """sqrt(k / m_eq) / 2 pi of two free disks, 1/m_eq = sum r^2 / J [Hz]."""
    flexibility = sum(r * r / j for r, j in zip(radii, inertias, strict=True))
    return math.sqrt(stiffness * flexibility) / (2.0 * math.pi)


def idler_mass(masses: Sequence[float]) -> Array:
    """Mass matrix (2, 2) of the mesh deflections, eq. (3.2), masses J/r^2 [kg]."""
    m1, m2, m3 = masses
    cross = m1 * m3
    return np.array([[(m2 + m3) * m1, cross], [cross, (m1 + m2) * m3]]) / (m1 + m2 + m3)


def idler_frequencies(
    masses: Sequence[float], stiffness: Sequence[float]
) -> tuple[float, float]:
    """Both frequencies of eq. (3.1) from the quadratic in omega^2 [Hz]."""
    (a, b), (_, d) = idler_mass(masses)
    k1, k2 = stiffness
    lead, middle, last = a * d - b * b, a * k2 + d * k1, k1 * k2
    root = math.sqrt(middle**2 - 4.0 * lead * last)
    squares = (2.0 * last / (middle + root), (middle + root) / (2.0 * lead))
    low, high = (math.sqrt(x) / (2.0 * math.pi) for x in squares)
    return low, high


def countershaft_flexibility(
    radii: Sequence[float], inertias: Sequence[float]
) -> Array:
    """Inverse mass matrix (3, 3) of x1, x2, x3 of eq. (4.1) [1/kg].

    A force f along x_i turns disk j by r f / J_j, so that the inverse is
    B J^-1 B^T with x = B psi; no condition on the rigid motion is needed.
    """
    r1, r2, r3, r4 = radii
    j1, j2, j3, j4 = inertias
    return np.array(
        [
            [r1 * r1 / j1 + r2 * r2 / j2, 0.0, r2 * r2 / j2],
            [0.0, r3 * r3 / j3 + r4 * r4 / j4, r2 * r3 / j3],
            [r2 * r2 / j2, r2 * r3 / j3, r2 * r2 / j2 + r2 * r2 / j3],
        ]
    )


def countershaft_frequencies(
    radii: Sequence[float],
    inertias: Sequence[float],
    mesh_stiffness: Sequence[float],
    shaft_stiffness: float,
) -> Array:
    """Three frequencies of eq. (4.2) [Hz]; k_s = k_r / r2^2.

    shaft_stiffness : k_r [N m/rad]
    """
    springs = np.diag([*mesh_stiffness, shaft_stiffness / radii[1] ** 2])
    squares = eigvals(countershaft_flexibility(radii, inertias) @ springs)
    return np.sqrt(np.sort(squares.real)) / (2.0 * np.pi)
