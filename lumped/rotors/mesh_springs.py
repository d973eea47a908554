"""Teeth in mesh as springs between two rotors: rows of deflections and matrices."""

from __future__ import annotations

import math

import numpy as np

from lumped.common.array_types import Array
from lumped.rotors.beams import AXIAL_COORDINATE, ROTATION, TILT_X, TILT_Y, X, Y
from lumped.rotors.description import RIGID_MOTIONS, MeshSpring
from lumped.rotors.gyroscopic import GyroscopicSystem, node_at


def mesh_rows(result: GyroscopicSystem, mesh: MeshSpring) -> tuple[Array, Array]:
    """Deflection of a mesh per displacement, and its slope over the face width (n,).

    The deflection is that in the section, the approach along the normal of the flanks
    over the cosine of the base helix angle, in the middle of the plane of action. At a
    distance along the axis it is larger by the slope times the distance, and by -slope
    times the tangent of the base helix angle along the push of the driver; both are
    positive where the teeth are pressed together. A tilt moves a point at a distance a
    from the gear's centre by a times its slope.
    """
    row, slope = np.zeros((2, result.size))
    cosine, sine = mesh.direction
    for gear, side in ((0, 1.0), (1, -1.0)):
        at = result.index(mesh.rotors[gear], mesh.positions[gear], "x")
        row[[at + X, at + Y]] += side * cosine, side * sine
        slope[[at + TILT_Y, at + TILT_X]] += side * cosine, -side * sine
        # both gears' rotations close the mesh in the driver's sense
        row[at + ROTATION] += mesh.sense * mesh.base_radii[gear]
        tilts = [at + TILT_X, at + TILT_Y]
        nodes, position = result.nodes[mesh.rotors[gear]], mesh.positions[gear]
        arm = position - nodes[node_at(nodes, position)]
        row[tilts] += (mesh.offsets[gear] + arm) * slope[tilts]
    if mesh.base_helix_angle:
        row += math.tan(mesh.base_helix_angle) * _axial_row(result, mesh)
    return row, slope


def _axial_row(result: GyroscopicSystem, mesh: MeshSpring) -> Array:
    """Approach along the axis in the middle of the path of contact (n,)."""
    row = np.zeros(result.size)
    push = np.array(mesh.direction)
    # from the driver's centre to the line of action
    normal = mesh.sense * np.array([push[1], -push[0]])
    for gear, side in ((0, 1.0), (1, -1.0)):
        rotor, position = mesh.rotors[gear], mesh.positions[gear]
        at = result.index(rotor, position, "x")
        roll, radius = mesh.middle_roll_lengths[gear], mesh.base_radii[gear]
        x, y = side * (roll * push + radius * normal)
        # a rotation moves the point at (x, y) along the axis
        row[[at + TILT_X, at + TILT_Y]] += side * y, -side * x
        if result.has_axial_motion:
            row[result.index(rotor, position, AXIAL_COORDINATE)] += side
    return row


def mesh_matrix(result: GyroscopicSystem, mesh: MeshSpring) -> Array:
    """Stiffness (n, n) of a mesh that is spread evenly over its plane of action.

    Both coordinates of the plane vary independently of each other, by b^2 / 12 over the
    face width and by l^2 / 12 over the path of contact. Or that of a matrix which the
    mesh has.
    """
    if mesh.matrix is not None:
        motions = rigid_motions(result, mesh)
        return np.asarray(motions.T @ np.array(mesh.matrix) @ motions)
    row, slope = mesh_rows(result, mesh)
    along_path = math.tan(mesh.base_helix_angle) * mesh.path_length
    tilting = mesh.width**2 / 12.0 + along_path**2 / 12.0
    return mesh.stiffness * (np.outer(row, row) + tilting * np.outer(slope, slope))


def rigid_motions(result: GyroscopicSystem, mesh: MeshSpring) -> Array:
    """Motions (11, n) of both gears per displacement, see `MeshSpring`."""
    motions = np.zeros((RIGID_MOTIONS, result.size))
    push = np.array(mesh.direction)
    normal = mesh.sense * np.array([push[1], -push[0]])
    for gear in range(2):
        rotor, position = mesh.rotors[gear], mesh.positions[gear]
        at, first = result.index(rotor, position, "x"), 1 + 5 * gear
        nodes = result.nodes[rotor]
        arm = position - nodes[node_at(nodes, position)]
        for row, direction in ((first, push), (first + 1, normal)):
            motions[row, [at + X, at + Y]] = direction
            # a slope of y is the opposite of the tilt about x
            motions[row + 3, [at + TILT_Y, at + TILT_X]] = direction[0], -direction[1]
            motions[row] += arm * motions[row + 3]
        if result.has_axial_motion:
            along = result.index(rotor, position, AXIAL_COORDINATE)
            motions[first + 2, along] = 1.0
        motions[0, at + ROTATION] = mesh.sense * mesh.base_radii[gear]
    return motions


def approach_of_motions(mesh: MeshSpring) -> Array:
    """Approach of flanks, and how it grows along the axis, by rigid motions (2, 11).

    In the middle of the plane of action, as `mesh_rows` has both per displacement.
    """
    rows = np.zeros((2, RIGID_MOTIONS))
    rows[0, 0] = 1.0
    axial = math.tan(mesh.base_helix_angle)
    for gear, side in ((0, 1.0), (1, -1.0)):
        ahead = side * mesh.middle_roll_lengths[gear]
        aside = side * mesh.base_radii[gear]
        along = mesh.offsets[gear] - axial * ahead
        first = 1 + 5 * gear
        rows[0, first : first + 5] = 1.0, 0.0, axial, along, -axial * aside
        rows[0, first : first + 5] *= side
        rows[1, first + 3] = side
    return rows
