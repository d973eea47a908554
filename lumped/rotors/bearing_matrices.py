"""Matrices of a bearing against six motions of the shaft in it.

They are the coordinates of a node, see `lumped.rotors.beams`, and motion along the
axis. Statics and vibration read bearings here, so that both have one law.
"""

from __future__ import annotations

import numpy as np

from lumped.common.array_types import Array
from lumped.rotors.beams import (
    AXIAL_COORDINATE,
    NODE_SIZE,
    QUARTER_TURN,
    ROTATION,
    TILT_X,
    TILT_Y,
    X,
    Y,
    rigid_arm,
)
from lumped.rotors.description import Bearing, RotorSystem
from lumped.rotors.gyroscopic import GyroscopicSystem, node_at
from lumped.rotors.housing import HOUSING_NODE_SIZE, HOUSING_Z, IN_HOUSING

Z = NODE_SIZE  # along the axis, after the coordinates of a node
BEARING_SIZE = NODE_SIZE + 1
ACROSS = [X, Y]
TILTS = [TILT_X, TILT_Y]
# motions of a shaft in a bearing at rest, along x, y, z and about x and y
STATIC_MOTIONS = np.array([X, Y, Z, TILT_X, TILT_Y])
ISOTROPY_RTOL = 1e-9  # of a linearised stiffness, that is round-off


def bearing_stiffness(bearing: Bearing) -> Array:
    """Stiffness (6, 6) of a bearing against motion of the shaft in it."""
    stiffness = np.zeros((BEARING_SIZE, BEARING_SIZE))
    if bearing.linearised is None:
        stiffness[np.ix_(ACROSS, ACROSS)] = np.reshape(bearing.stiffness, (2, 2))
        stiffness[TILTS, TILTS] = bearing.tilt_stiffness
        stiffness[Z, Z] = bearing.axial_stiffness
    else:
        at = np.ix_(STATIC_MOTIONS, STATIC_MOTIONS)
        stiffness[at] = bearing.linearised.stiffness
    stiffness[ROTATION, ROTATION] = bearing.torsional_stiffness
    return stiffness


def bearing_damping(bearing: Bearing) -> Array:
    """Damping (6, 6) of a bearing against motion of the shaft in it."""
    damping = np.zeros((BEARING_SIZE, BEARING_SIZE))
    damping[np.ix_(ACROSS, ACROSS)] = np.reshape(bearing.damping, (2, 2))
    damping[Z, Z] = bearing.axial_damping
    return damping


def force_at_rest(bearing: Bearing) -> Array:
    """Force (6,) of a bearing on a shaft in its place, which linearised ones have."""
    force = np.zeros(BEARING_SIZE)
    if bearing.linearised is not None:
        force[STATIC_MOTIONS] = bearing.linearised.force
    return force


def forces_at_rest(matrices: GyroscopicSystem, system: RotorSystem) -> Array:
    """Forces (n,) of all bearings on the coordinates of shafts in their places."""
    total = np.zeros(matrices.size)
    for number, rotor in enumerate(system.rotors):
        for index, bearing in enumerate(rotor.bearings):
            at, rows = bearing_motion(matrices, system, number, index)
            total[at] += rows.T @ force_at_rest(bearing)
    return total


def is_isotropic(bearing: Bearing) -> bool:
    """Whether a bearing is the same in all directions, so that it may be seen turning.

    A linearised one may differ by round-off.
    """
    turn = np.pad(QUARTER_TURN, (0, 1))
    for matrix in (bearing_stiffness(bearing), bearing_damping(bearing)):
        change = np.abs(matrix @ turn - turn @ matrix).max()
        allowed = 0.0 if bearing.linearised is None else ISOTROPY_RTOL
        if change > allowed * np.abs(matrix).max():
            return False
    return True


def seen_through(motion: Array, matrix: Array) -> Array:
    """Matrix (m, m) of coordinates that lead to motions by rows (k, m).

    It is symmetric to the last bit where the matrix (k, k) is.
    """
    product = motion.T @ matrix @ motion
    if (matrix == matrix.T).all():
        product = 0.5 * (product + product.T)
    return np.asarray(product)


def bearing_motion(
    matrices: GyroscopicSystem, system: RotorSystem, rotor: int, bearing: int
) -> tuple[list[int], Array]:
    """Motion of a shaft in one of its bearings, against ground or the housing.

    Returns the coordinates (m,) that move it, and the six motions by them (6, m). There
    is no motion along the axis where shafts have none. Rotations about the axis are
    against ground, for what drives or brakes a shaft is not part of the housing.
    """
    position = system.rotors[rotor].bearings[bearing].position
    nodes = matrices.nodes[rotor]
    first = matrices.index(rotor, position, "x")
    at = list(range(first, first + NODE_SIZE))
    rows = np.zeros((BEARING_SIZE, NODE_SIZE))
    rows[:NODE_SIZE] = rigid_arm(position - nodes[node_at(nodes, position)])
    if matrices.has_axial_motion:
        at.append(matrices.index(rotor, position, AXIAL_COORDINATE))
        rows = np.column_stack([rows, np.eye(BEARING_SIZE)[Z]])
    housing = system.housing
    node = None if housing is None else housing.node_of(rotor, bearing)
    if node is not None:
        first = matrices.shaft_size + HOUSING_NODE_SIZE * node
        moved = dict(IN_HOUSING)
        if matrices.has_axial_motion:
            moved[Z] = HOUSING_Z
        at += [first + place for place in moved.values()]
        rows = np.column_stack([rows, -np.eye(BEARING_SIZE)[:, list(moved)]])
    return at, rows
