"""What moves and what yields in the modes of a train in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.rotors.beams import NODE_SIZE, TILT_X, TILT_Y
from lumped.rotors.gyroscopic import GyroscopicSystem
from lumped.train.coordinates import BEARING, SHAFT, TILT
from lumped.train.modes import Modes
from lumped.train.space import MotionInSpace

TORSION, BENDING, TILTING = "torsion", "bending", "tilting"
AXIAL, HOUSING = "axial", "housing"
MOTIONS = TORSION, BENDING, TILTING, AXIAL, HOUSING


@dataclass(frozen=True, eq=False)
class SpaceShares(ShortRepr):
    """Parts of the energies of n modes; those of strain add up to 1 with the meshes'.

    kinetic : (n,) by motion, one of MOTIONS: rotations about the axes, motions across
        them, rotations about diameters, motions along the axes, and the housing
    strain : (n,) in shafts, in bearings with the housing, and in teeth that tilt
        against each other
    shaft : (n,) that moves most, by its number from 0
    """

    kinetic: dict[str, Array]
    strain: dict[str, Array]
    shaft: NDArray[np.intp]

    def kind(self, mode: int) -> str:
        """The motion that has the largest part of the kinetic energy of a mode."""
        return max(MOTIONS, key=lambda motion: float(self.kinetic[motion][mode]))


def space_shares(space: MotionInSpace, modes: Modes) -> SpaceShares:
    """Parts of the energies of the modes of a train in space."""
    matrices = space.matrices
    shapes = space.basis @ modes.shapes
    energy = shapes * (matrices.mass @ shapes)
    kinetic = {
        motion: energy[mask].sum(axis=0) / energy.sum(axis=0)
        for motion, mask in _masks(matrices).items()
    }
    squares = modes.strain
    in_shafts = (shapes * (matrices.shaft_stiffness @ shapes)).sum(axis=0)
    tilts = space.tilt_stiffness @ (space.tilt_rows @ modes.shapes) ** 2
    strain = {SHAFT: _over(in_shafts, squares), TILT: _over(tilts, squares)}
    in_meshes = modes.mesh_energy.sum(axis=0)
    rest = 1.0 - in_meshes - strain[SHAFT] - strain[TILT]
    strain[BEARING] = np.where(squares > 0.0, np.maximum(rest, 0.0), 0.0)
    of_shafts = [
        energy[matrices.rotor_of == number].sum(axis=0)
        for number in range(len(matrices.nodes))
    ]
    return SpaceShares(kinetic, strain, np.argmax(of_shafts, axis=0))


def _masks(matrices: GyroscopicSystem) -> dict[str, NDArray[np.bool_]]:
    within = np.arange(matrices.size) % NODE_SIZE
    is_tilt = matrices.is_sideways & ((within == TILT_X) | (within == TILT_Y))
    return {
        TORSION: matrices.is_rotation,
        BENDING: matrices.is_sideways & ~is_tilt,
        TILTING: is_tilt,
        AXIAL: matrices.is_axial,
        HOUSING: matrices.is_housing,
    }


def _over(strain: Array, squares: Array) -> Array:
    parts = np.zeros_like(squares)
    return np.divide(strain, squares, out=parts, where=squares > 0.0)
