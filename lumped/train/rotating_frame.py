"""Inertial forces in the frame that rotates with the carrier of a planetary set.

At the angular speed W of the frame, coordinates q obey

    M q'' + W G q' + (K - W^2 C) q = f

with G and C of `lumped.train.coordinates.Coordinates` (Lin and Parker, 1999). Without
damping and while K - W^2 C is positive semidefinite, the equations in the state
(L'q, q'), L L' = K - W^2 C, have a skew matrix: natural frequencies are real, and those
of an undamped train are computed as such.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Complex
from lumped.train.modes import Modes

INDEFINITE_RTOL = 1e-12  # of the largest stiffness: a negative one that is round-off
# Part of the largest eigenvalue below which one is zero, or its real part is; double
# zeros are known to the root of round-off alone
ZERO_RTOL = 1e-6
SOFT_RTOL = 1e-14  # of the largest stiffness, below which one is round-off


@dataclass(frozen=True, eq=False)
class RotatingFrame:
    """Forces -W G v + W^2 C q in n coordinates of unit mass.

    gyroscopic, centripetal : (n, n) G, skew, and C, symmetric
    speed : angular speed W of the frame per Hz of the first mesh [rad/s]
    """

    gyroscopic: Array
    centripetal: Array
    speed: float

    def damping(self, frequency: float) -> Array:
        """Part (n, n) of the damping matrix at a frequency of the first mesh [Hz]."""
        return self.speed * frequency * self.gyroscopic

    def stiffness(self, frequency: float) -> Array:
        """Part (n, n) of the stiffness matrix at a frequency of the first mesh."""
        return -((self.speed * frequency) ** 2) * self.centripetal

    def in_coordinates(self, displacement: Array) -> RotatingFrame:
        """The forces in k others, of which the first n displacements (k, k) are these
        coordinates."""
        rows = displacement[: len(self.gyroscopic)]
        gyroscopic, centripetal = (
            rows.T @ matrix @ rows for matrix in (self.gyroscopic, self.centripetal)
        )
        return replace(self, gyroscopic=gyroscopic, centripetal=centripetal)


def rotating_frame(
    modes: Modes, moving: NDArray[np.intp], speed: float
) -> RotatingFrame:
    """The forces on the modes that take part in a motion.

    moving : (n,) their indices
    speed : angular speed of the frame per Hz of the first mesh [rad/s]
    """
    shapes = modes.shapes[:, moving]
    gyroscopic, centripetal = (
        shapes.T @ matrix @ shapes
        for matrix in (modes.coordinates.gyroscopic, without_free_motions(modes))
    )
    # round-off must do no work
    gyroscopic = 0.5 * (gyroscopic - gyroscopic.T)
    return RotatingFrame(gyroscopic, 0.5 * (centripetal + centripetal.T), speed)


def without_free_motions(modes: Modes) -> Array:
    """Centripetal matrix (n, n) of the other modes where free motions are left out.

    A free rotation V0 turns by the Coriolis forces on it, as moments of momentum
    persist: its speed is W V0'G'q. That it turns acts back as the stiffness
    W^2 G V0 V0'G'.
    """
    free = modes.shapes[:, modes.frequency_Hz == 0.0]
    moment = modes.coordinates.gyroscopic @ free
    return np.asarray(modes.coordinates.centripetal - moment @ moment.T)


@dataclass(frozen=True, eq=False)
class RotatingFrameModes(Modes):
    """Undamped modes in a rotating frame, by rising frequency.

    Displacements are the real part of the complex shapes times exp(i w t), energies
    means over a period.

    Attributes
    ----------
    speed : float
        Angular speed of the frame [rad/s].
    growth : (n,) array
        Rates at which modes grow [1/s], 0 where they only vibrate.
    total_strain : (n,) array
        Twice the mean strain energy of each mode [1/s2].
    is_supercritical : bool
        Whether centrifugal forces exceed those of the springs in some motion. Only
        gyroscopic forces then stabilise it, which damping in the frame undoes.
    """

    speed: float
    growth: Array
    total_strain: Array
    is_supercritical: bool

    @property
    def strain(self) -> Array:
        return self.total_strain


def whirl_modes(
    modes: Modes, speed: float, mesh_stiffness: Array | None = None
) -> RotatingFrameModes:
    """Modes at an angular speed of the frame.

    Parameters
    ----------
    modes : Modes
        Modes at rest, real.
    speed : float
        Angular speed of the frame [rad/s], positive counter-clockwise.
    mesh_stiffness : (m, n, n) array, optional
        Stiffness of each mesh in the modes at rest [1/s2]; by default that of springs
        with the mean stiffnesses.

    Returns
    -------
    RotatingFrameModes
        Modes at speed, as many.
    """
    space = modes.coordinates
    gyroscopic, centripetal = (
        modes.shapes.T @ matrix @ modes.shapes
        for matrix in (space.gyroscopic, space.centripetal)
    )
    stiffness = np.diag(modes.angular**2) - speed**2 * centripetal
    skew = 0.5 * speed * (gyroscopic - gyroscopic.T)
    values, vectors = _eigenvalues(stiffness, skew, modes)
    vectors = vectors / np.sqrt((np.abs(vectors) ** 2).sum(axis=0))
    shapes = modes.shapes @ vectors
    total_strain = modes.strain @ np.abs(vectors) ** 2
    if mesh_stiffness is None:
        rows = np.sqrt(modes.mean_stiffness)[:, None] * modes.mesh_shapes
        mesh_stiffness = rows[:, :, None] * rows[:, None, :]
    return RotatingFrameModes(
        coordinates=space,
        mean_stiffness=modes.mean_stiffness,
        frequency_Hz=values.imag / (2.0 * np.pi),
        shapes=shapes,
        mesh_shapes=modes.mesh_shapes @ vectors,
        mesh_energy=_mesh_energy(total_strain, vectors, mesh_stiffness),
        speed=speed,
        growth=values.real,
        total_strain=total_strain,
        is_supercritical=_is_indefinite(np.asarray(np.linalg.eigvalsh(stiffness))),
    )


def _eigenvalues(
    stiffness: Array, skew: Array, modes: Modes
) -> tuple[Complex, Complex]:
    """Eigenvalues (n,) [1/s] and modes (n, n) in those at rest, by rising frequency."""
    free = modes.frequency_Hz == 0.0
    squares, axes = np.linalg.eigh(stiffness)
    if _is_indefinite(squares):
        return _general_eigenvalues(stiffness, skew)
    # so soft a mode has the same round-off as a free motion
    soft = squares < SOFT_RTOL * squares.max()
    at_rest = np.eye(len(stiffness), dtype=complex)[:, free]
    if soft.sum() > free.sum():
        at_rest = axes[:, soft].astype(complex)
    n, zeros = len(stiffness), at_rest.shape[1]
    root = axes * np.sqrt(np.maximum(squares, 0.0))  # L
    matrix = np.block([[np.zeros((n, n)), root.T], [-root, -skew]])
    angular, states = np.linalg.eigh(-1j * matrix)
    # the eigenvalues are pairs of opposite sign
    angular, velocities = angular[n + zeros :], states[n:, n + zeros :]
    values = np.concatenate([np.zeros(zeros), angular])
    return 1j * values, np.concatenate([at_rest, velocities / (1j * angular)], axis=1)


def _is_indefinite(squares: Array) -> bool:
    return bool(squares.min() < -INDEFINITE_RTOL * squares.max())


def _general_eigenvalues(stiffness: Array, skew: Array) -> tuple[Complex, Complex]:
    """Eigenvalues and modes where the rotation makes the stiffness negative.

    One is taken of each pair of opposite eigenvalues: that with a frequency above 0, or
    the one that grows.
    """
    n = len(stiffness)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -skew]])
    values, states = np.linalg.eig(matrix)
    zero = ZERO_RTOL * np.abs(values).max()
    values.real[np.abs(values.real) < zero] = 0.0
    values.imag[np.abs(values.imag) < zero] = 0.0
    # all with a frequency, then those that grow most
    rank = np.lexsort([-values.real, -np.sign(values.imag)])
    upper = rank[:n]
    upper = upper[np.argsort(values.imag[upper], kind="stable")]
    return values[upper], states[:n, upper]


def _mesh_energy(total: Array, vectors: Complex, mesh_stiffness: Array) -> Array:
    """Part (m, n) of the strain energy of modes in each mesh, 0 of free motions.

    total : (n,) twice the strain energy of the modes [1/s2]
    vectors : (n, n) modes in those at rest
    """
    strain = (vectors.conj() * (mesh_stiffness @ vectors)).real.sum(axis=1)
    strained = total > 0.0
    return np.divide(strain, total, out=np.zeros_like(strain), where=strained)
