"""Natural frequencies and mode shapes about the mean mesh stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.train.bodies import TrainError
from lumped.train.coordinates import Coordinates, train_coordinates
from lumped.train.train import Train

# Least parts of a mode's strain energy in the meshes: of a mesh mode, of a resonance
# that meshes excite, and of a mode whose vibration reaches the meshes at all
MIN_MESH_MODE_ENERGY = 0.25
MIN_RESONANCE_ENERGY = 0.05
MIN_FELT_ENERGY = 1e-3
RIGID_RTOL = 1e-12  # frequency over the highest one below which a motion is rigid


@dataclass(frozen=True, eq=False)
class Modes(ShortRepr):
    """Undamped modes of n coordinates, by rising frequency.

    Attributes
    ----------
    coordinates : Coordinates
        Degrees of freedom of the train, with masses, loads and springs.
    mean_stiffness : (m,) array
        Mean stiffness of each mesh [N/m].
    frequency_Hz : (n,) array
        Natural frequencies [Hz], exactly 0 for motions that strain nothing.
    shapes : (n, n) array
        One mode per column, mass-normalised: ``V^T M V = 1``.
    mesh_shapes : (m, n) array
        Mesh deflection of each mode.
    mesh_energy : (m, n) array
        Fraction of the strain energy in each mesh.
    """

    coordinates: Coordinates
    mean_stiffness: Array
    frequency_Hz: Array
    shapes: Array
    mesh_shapes: Array
    mesh_energy: Array

    @property
    def angular(self) -> Array:
        """Natural angular frequencies (n,) [rad/s]."""
        return 2.0 * np.pi * self.frequency_Hz

    @property
    def strain(self) -> Array:
        """Twice the strain energy (n,) of each mode [1/s2]."""
        return np.asarray(self.angular**2)

    @property
    def mesh_resonances_Hz(self) -> Array:
        """Natural frequencies [Hz] of modes that strain the meshes."""
        strained = self.mesh_energy.sum(axis=0) >= MIN_RESONANCE_ENERGY
        return np.asarray(self.frequency_Hz[strained])

    def spring_energy(self, kind: str) -> Array:
        """Fraction of the strain energy of each mode in springs of a kind.

        Parameters
        ----------
        kind : str
            One of `lumped.train.coordinates.SPRING_KINDS`.

        Returns
        -------
        (n,) array
            Fractions, 0 of free motions.
        """
        parts = self.coordinates
        chosen = np.array([k == kind for k in parts.spring_kinds], bool)
        elongation = parts.spring_rows[chosen] @ self.shapes
        strain = parts.spring_stiffness[chosen] @ np.abs(elongation) ** 2
        return np.divide(
            strain, self.strain, out=np.zeros_like(strain), where=self.strain > 0.0
        )

    def rotation_of(self, gear: int) -> Array:
        """Rotation of a gear in each mode.

        Parameters
        ----------
        gear : int
            Index of the gear, from 0.

        Returns
        -------
        (n,) array
            Rotations, 0 of a gear that is held.
        """
        index = self.coordinates.indices.get((gear, "rotation"))
        return np.zeros(self.shapes.shape[1]) if index is None else self.shapes[index]

    @property
    def stiffness_matrix(self) -> Array:
        """Stiffness matrix (n, n) of meshes, bearings, couplings and shafts."""
        parts = self.coordinates
        rows = np.concatenate([parts.mesh_rows, parts.spring_rows])
        stiffness = np.concatenate([self.mean_stiffness, parts.spring_stiffness])
        return np.asarray(rows.T @ (stiffness[:, None] * rows))

    def damping_matrix(self, ratio: float) -> Array:
        """Damping matrix with the same damping ratio in every mode.

        Parameters
        ----------
        ratio : float
            Damping ratio.

        Returns
        -------
        (n, n) array
            Damping matrix in the coordinates of the train.
        """
        momentum = self.coordinates.mass[:, None] * self.shapes
        return (momentum * (2.0 * ratio * self.angular)) @ momentum.T


def natural_modes(
    train: Train,
    mean_stiffness: Sequence[float],
    coordinates: Coordinates | None = None,
) -> Modes:
    """Modes with the mean stiffnesses of the meshes.

    Parameters
    ----------
    train : Train
        Train with m meshes.
    mean_stiffness : (m,) array_like
        Mean stiffness of each mesh [N/m], positive.
    coordinates : Coordinates, optional
        Degrees of freedom in place of those of the train.

    Returns
    -------
    Modes
        Natural frequencies and mode shapes.

    Raises
    ------
    TrainError
        If the stiffnesses are not m positive numbers or nothing can move.

    Notes
    -----
    The stiffness matrix is never formed: its factor, with a row for each spring,
    preserves the digits of soft modes in the presence of stiff springs.
    """
    stiffness = np.array(mean_stiffness, float)
    if stiffness.shape != (len(train.meshes),) or not (stiffness > 0.0).all():
        raise TrainError(
            f"mean_stiffness = {mean_stiffness}; must hold {len(train.meshes)} "
            "positive numbers"
        )
    coordinates = coordinates or train_coordinates(train)
    rows = np.concatenate([coordinates.mesh_rows, coordinates.spring_rows])
    stiffness_roots = np.sqrt(np.concatenate([stiffness, coordinates.spring_stiffness]))
    scale = 1.0 / np.sqrt(coordinates.mass)
    _, singular, right_vectors = np.linalg.svd(stiffness_roots[:, None] * rows * scale)
    angular = np.zeros(coordinates.mass.size)
    angular[: singular.size] = singular
    angular[angular < RIGID_RTOL * angular.max()] = 0.0
    order = np.argsort(angular, kind="stable")
    angular = angular[order]
    shapes = _fix_signs(scale[:, None] * right_vectors[order].T)
    mesh_shapes = coordinates.mesh_rows @ shapes
    strain = stiffness[:, None] * mesh_shapes**2
    energy = np.divide(
        strain, angular**2, out=np.zeros_like(strain), where=angular > 0.0
    )
    mesh_shapes[:, angular == 0.0] = 0.0
    return Modes(
        coordinates, stiffness, angular / (2.0 * np.pi), shapes, mesh_shapes, energy
    )


def _fix_signs(shapes: Array) -> Array:
    """Columns with signs such that the largest entry is positive."""
    largest = np.abs(shapes).argmax(axis=0)
    signs = np.sign(shapes[largest, np.arange(shapes.shape[1])])
    return shapes * np.where(signs == 0.0, 1.0, signs)
