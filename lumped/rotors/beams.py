"""Matrices of a spinning element with cubic shape functions.

Elements are Euler-Bernoulli beams. Stiffness may include shear, for loads at rest.

Both nodes have five coordinates: translations x and y, tilts about x and y, and the
rotation about the axis. A slope dx/dz is the tilt about y, and a slope dy/dz the
opposite of the tilt about x. Motion along the axis is apart from these, for it is
coupled with them by meshes alone.
"""

from __future__ import annotations

import numpy as np

from lumped.common.array_types import Array

NODE_COORDINATES = ("x", "y", "tilt x", "tilt y", "rotation")
NODE_SIZE = len(NODE_COORDINATES)
X, Y, TILT_X, TILT_Y, ROTATION = range(NODE_SIZE)
AXIAL_COORDINATE = "z"
# Coordinates of bending in both planes by their places in an element, and the signs
# that make the second one of each pair a slope
PLANE_XZ, SIGNS_XZ = (0, 3, 5, 8), np.array([1.0, 1.0, 1.0, 1.0])
PLANE_YZ, SIGNS_YZ = (1, 2, 6, 7), np.array([1.0, -1.0, 1.0, -1.0])
TWIST = 4, 9
# of a node: the quarter turn that takes x to y, and the tilts likewise
QUARTER_TURN = np.zeros((NODE_SIZE, NODE_SIZE))
QUARTER_TURN[1, 0] = QUARTER_TURN[3, 2] = 1.0
QUARTER_TURN[0, 1] = QUARTER_TURN[2, 3] = -1.0


def bending_stiffness(length: float, shear: float = 0.0) -> Array:
    """Stiffness (4, 4) of one plane per bending stiffness EI [1/m3, 1/m2 or 1/m].

    It is exact for loads at the nodes.

    shear : Timoshenko's number phi = 12 E I / (kappa G A L^2), 0 without shear
    """
    L, phi = length, shear
    return (
        np.array(
            [
                [12.0, 6.0 * L, -12.0, 6.0 * L],
                [6.0 * L, (4.0 + phi) * L**2, -6.0 * L, (2.0 - phi) * L**2],
                [-12.0, -6.0 * L, 12.0, -6.0 * L],
                [6.0 * L, (2.0 - phi) * L**2, -6.0 * L, (4.0 + phi) * L**2],
            ]
        )
        / L**3
        / (1.0 + phi)
    )


def translation_mass(length: float) -> Array:
    """Consistent mass (4, 4) of one plane per mass of a length rho A."""
    L = length
    return (
        L
        / 420.0
        * np.array(
            [
                [156.0, 22.0 * L, 54.0, -13.0 * L],
                [22.0 * L, 4.0 * L**2, 13.0 * L, -3.0 * L**2],
                [54.0, 13.0 * L, 156.0, -22.0 * L],
                [-13.0 * L, -3.0 * L**2, -22.0 * L, 4.0 * L**2],
            ]
        )
    )


def rotation_mass(length: float) -> Array:
    """Products of slopes (4, 4) over the element, per inertia of a length rho I."""
    L = length
    return np.array(
        [
            [36.0, 3.0 * L, -36.0, 3.0 * L],
            [3.0 * L, 4.0 * L**2, -3.0 * L, -(L**2)],
            [-36.0, -3.0 * L, 36.0, -3.0 * L],
            [3.0 * L, -(L**2), -3.0 * L, 4.0 * L**2],
        ]
    ) / (30.0 * L)


def in_both_planes(matrix: Array, xz: float, yz: float) -> Array:
    """Matrix (10, 10) of an element from that of a plane, times a factor of each."""
    element = np.zeros((2 * NODE_SIZE, 2 * NODE_SIZE))
    for plane, signs, factor in (
        (PLANE_XZ, SIGNS_XZ, xz),
        (PLANE_YZ, SIGNS_YZ, yz),
    ):
        element[np.ix_(plane, plane)] += factor * np.outer(signs, signs) * matrix
    return element


def gyroscopic_matrix(length: float) -> Array:
    """Skew-symmetric matrix (10, 10) per polar inertia of a length, 2 rho I.

    A slice has the moments I_p Omega (tilt y)' about x and -I_p Omega (tilt x)' about
    y, as a disk has.
    """
    slopes = rotation_mass(length)
    element = np.zeros((2 * NODE_SIZE, 2 * NODE_SIZE))
    # the slope in y-z is minus the tilt about x
    block = -np.outer(SIGNS_YZ, SIGNS_XZ) * slopes
    element[np.ix_(PLANE_YZ, PLANE_XZ)] += block
    element[np.ix_(PLANE_XZ, PLANE_YZ)] -= block.T
    return element


def twist_matrices(length: float) -> tuple[Array, Array]:
    """Stiffness per G I_p and mass per rho I_p (10, 10) of twisting."""
    stiffness, mass = np.zeros((2, 2 * NODE_SIZE, 2 * NODE_SIZE))
    at = np.ix_(TWIST, TWIST)
    stiffness[at], mass[at] = linear_matrices(length)
    return stiffness, mass


def linear_matrices(length: float) -> tuple[Array, Array]:
    """Stiffness and mass (2, 2) of linear shape functions, as of rods and twisting.

    They are per E A and per rho A of a rod [1/m and m].
    """
    stiffness = np.array([[1.0, -1.0], [-1.0, 1.0]]) / length
    mass = np.array([[2.0, 1.0], [1.0, 2.0]]) * length / 6.0
    return stiffness, mass


def rigid_arm(distance: float) -> Array:
    """Motion (5, 5) of a point by that of one at a distance before it [m]."""
    arm = np.eye(NODE_SIZE)
    arm[X, TILT_Y], arm[Y, TILT_X] = distance, -distance
    return arm
