"""A shaft in a housing by matrices of its own, which tests compare with.

Six coordinates a node: x, y, z and rotations about them. It shares no code with the
package; only descriptions of bearings and housings are read.
"""

from __future__ import annotations

import numpy as np

GAUSS = np.polynomial.legendre.leggauss(4)


def hermite(place, length):
    """Shape functions of a beam (4,) at a place from 0 to 1, and their derivatives."""
    s = place
    values = [1 - 3 * s**2 + 2 * s**3, s - 2 * s**2 + s**3]
    values += [3 * s**2 - 2 * s**3, s**3 - s**2]
    slopes = [
        6 * s**2 - 6 * s,
        1 - 4 * s + 3 * s**2,
        6 * s - 6 * s**2,
        3 * s**2 - 2 * s,
    ]
    curves = [12 * s - 6, 6 * s - 4, 6 - 12 * s, 6 * s - 2]
    scale = np.array([1.0, length, 1.0, length])
    return (
        scale * values,
        scale * slopes / length,
        scale * curves / length**2,
    )


def element(length, diameter, young, shear, density):
    """Stiffness, mass and gyroscopic matrix (12, 12) of a round beam."""
    area, second = 0.25 * np.pi * diameter**2, np.pi / 64.0 * diameter**4
    # deflections u along x and v along y by the coordinates of both nodes
    to_u, to_v = np.zeros((2, 4, 12))
    to_u[[0, 1, 2, 3], [0, 4, 6, 10]] = 1.0
    to_v[[0, 1, 2, 3], [1, 3, 7, 9]] = 1.0, -1.0, 1.0, -1.0
    stiffness, mass, gyroscopic = np.zeros((3, 12, 12))
    for place, weight in zip(0.5 * (GAUSS[0] + 1.0), 0.5 * GAUSS[1], strict=True):
        value, slope, curve = hermite(place, length)
        w = weight * length
        line = np.array([1.0 - place, place])
        for to in (to_u, to_v):
            for part, factor, target in (
                (curve @ to, young * second, stiffness),
                (value @ to, density * area, mass),
                (slope @ to, density * second, mass),
            ):
                target += w * factor * np.outer(part, part)
        about_x, about_y = -slope @ to_v, slope @ to_u
        polar = 2.0 * density * second * w
        gyroscopic += polar * (np.outer(about_x, about_y) - np.outer(about_y, about_x))
        for first, k, m in (
            (2, young * area, density * area),
            (5, 2.0 * shear * second, 2.0 * density * second),
        ):
            row, rate = np.zeros((2, 12))
            row[[first, first + 6]] = line
            rate[[first, first + 6]] = -1.0 / length, 1.0 / length
            stiffness += w * k * np.outer(rate, rate)
            mass += w * m * np.outer(row, row)
    return stiffness, mass, gyroscopic


def dense_machine(rotor, elements, bearing_tensors, housing):
    """Mass, damping, stiffness and gyroscopic matrix of a shaft in a housing.

    bearing_tensors : node of the shaft, stiffness and damping (5, 5) along x, y, z and
        about x and y, and first coordinate in the housing, None for ground
    """
    (section,) = rotor.sections
    size = 6 * (elements + 1)
    total = size + len(housing.stiffness)
    mass, damping, stiffness, gyroscopic = np.zeros((4, total, total))
    of_element = element(
        section.length / elements,
        section.diameter,
        rotor.young_modulus,
        rotor.shear_modulus,
        rotor.density,
    )
    for number in range(elements):
        at = np.s_[6 * number : 6 * number + 12, 6 * number : 6 * number + 12]
        for matrix, part in zip((stiffness, mass, gyroscopic), of_element, strict=True):
            matrix[at] += part
    gyroscopic *= rotor.speed_ratio
    for disk in rotor.disks:
        node = 6 * round(disk.position / section.length * elements)
        tilt, polar = disk.transverse_inertia, disk.polar_inertia
        for place, value in enumerate([*[disk.mass] * 3, tilt, tilt, polar]):
            mass[node + place, node + place] += value
        gyroscopic[node + 3, node + 4] += polar * rotor.speed_ratio
        gyroscopic[node + 4, node + 3] -= polar * rotor.speed_ratio
    for node, k, c, first in bearing_tensors:
        ends = [(6 * node, 1.0)] + ([] if first is None else [(size + first, -1.0)])
        for row, row_sign in ends:
            for column, column_sign in ends:
                at = np.s_[row : row + 5, column : column + 5]
                stiffness[at] += row_sign * column_sign * k
                damping[at] += row_sign * column_sign * c
    at = np.s_[size:, size:]
    mass[at] += housing.mass
    stiffness[at] += housing.stiffness
    damping[at] += housing.damping
    return mass, damping, stiffness, gyroscopic


def dense_eigenvalues(matrices, speed):
    """Eigenvalues with a positive frequency, by rising frequency [rad/s]."""
    mass, damping, stiffness, gyroscopic = matrices
    size = len(mass)
    scale = 1.0 / np.sqrt(np.diag(mass))
    mass, damping, stiffness, gyroscopic = (
        scale[:, None] * one * scale for one in (mass, damping, stiffness, gyroscopic)
    )
    state = np.block(
        [
            [np.zeros((size, size)), np.eye(size)],
            [
                -np.linalg.solve(mass, stiffness),
                -np.linalg.solve(mass, damping + speed * gyroscopic),
            ],
        ]
    )
    values = np.linalg.eigvals(state)
    values = values[values.imag > 1.0]
    return values[np.argsort(values.imag)]
