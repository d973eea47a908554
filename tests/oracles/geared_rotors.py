"""Two shafts with a gear each, assembled from energies, in another way than `lumped`.

Kinetic and strain energies are quadratic forms of displacements that are interpolated
at Gauss points; the gyroscopic matrix is that of the angular momentum of slices and
gears; teeth are springs at Gauss points over the face width, between points of both
gears that move as those of rigid bodies in space.
"""

from __future__ import annotations

import math

import numpy as np

GAUSS = np.polynomial.legendre.leggauss(4)
POLYNOMIAL = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [-3, -2, 3, -1], [2, 1, -2, 1]])


def hermite(s, length, derivative):
    """Values (4,) of the cubic shape functions, or of a derivative along the axis."""
    powers = [
        [1.0, s, s**2, s**3],
        [0.0, 1.0, 2.0 * s, 3.0 * s**2],
        [0.0, 0.0, 2.0, 6.0 * s],
    ][derivative]
    scale = np.array([1.0, length, 1.0, length])
    return np.array(powers) @ POLYNOMIAL * scale / length**derivative


class Assembly:
    """Coordinates of a node: u = (x, y), slopes (x', y'), twist."""

    def __init__(self, node_counts):
        self.first = np.concatenate([[0], np.cumsum(5 * np.array(node_counts))])
        size = int(self.first[-1])
        self.mass, self.stiffness, self.gyroscopic = np.zeros((3, size, size))

    def rows(self, rotor, node):
        """Rows (5, n) that pick x, y, x', y' and the twist of a node."""
        start = self.first[rotor] + 5 * node
        return np.eye(self.mass.shape[0])[start : start + 5]

    def add_slices(self, rotor, node, length, diameter, material, speed_ratio):
        """An element from a node to the next one."""
        area, inertia = math.pi * diameter**2 / 4.0, math.pi * diameter**4 / 64.0
        left, right = self.rows(rotor, node), self.rows(rotor, node + 1)
        for point, weight in zip(*GAUSS, strict=True):
            s, dz = 0.5 * (1.0 + point), 0.5 * weight * length
            fields = [
                [
                    np.array([left[a], left[2 + a], right[a], right[2 + a]]).T
                    @ hermite(s, length, order)
                    for a in (0, 1)
                ]
                for order in (0, 1, 2)
            ]
            twist = (1.0 - s) * left[4] + s * right[4]
            twist_rate = (right[4] - left[4]) / length
            rho, young, shear = material
            for a in (0, 1):
                self.mass += rho * area * dz * np.outer(fields[0][a], fields[0][a])
                self.mass += rho * inertia * dz * np.outer(fields[1][a], fields[1][a])
                bent = young * inertia * dz
                self.stiffness += bent * np.outer(fields[2][a], fields[2][a])
            self.mass += 2.0 * rho * inertia * dz * np.outer(twist, twist)
            torsional = 2.0 * shear * inertia * dz
            self.stiffness += torsional * np.outer(twist_rate, twist_rate)
            momentum = 2.0 * rho * inertia * speed_ratio * dz
            self._add_momentum(momentum, *fields[1])

    def _add_momentum(self, momentum, slope_x, slope_y):
        """The axis is (x', y', 1): the moments are momentum times its rate."""
        # virtual work of -H (y'' dot for x slopes and back): skew-symmetric
        self.gyroscopic += momentum * np.outer(slope_x, slope_y)
        self.gyroscopic -= momentum * np.outer(slope_y, slope_x)

    def add_gear(self, rotor, node, mass, polar, transverse, speed_ratio):
        x, y, slope_x, slope_y, twist = self.rows(rotor, node)
        for row, inertia in ((x, mass), (y, mass), (twist, polar)):
            self.mass += inertia * np.outer(row, row)
        for row in (slope_x, slope_y):
            self.mass += transverse * np.outer(row, row)
        self._add_momentum(polar * speed_ratio, slope_x, slope_y)

    def add_bearing(self, rotor, node, kx, ky):
        x, y, *_ = self.rows(rotor, node)
        self.stiffness += kx * np.outer(x, x) + ky * np.outer(y, y)

    def add_teeth(self, ends, points, push, stiffness, width):
        """Springs over the face width.

        ends : (rotor, node) of driver and driven
        points : of both gears on the line of action, from their centres (2,) [m]
        push : unit vector of the driver's push on the driven gear
        """
        for point, weight in zip(*GAUSS, strict=True):
            along = 0.5 * width * point
            closing = 0.0
            for (rotor, node), arm, side in zip(ends, points, (1.0, -1.0), strict=True):
                x, y, slope_x, slope_y, twist = self.rows(rotor, node)
                turn = np.array([-slope_y, slope_x, twist])  # vector of small rotation
                arm_matrix = np.array([arm[0], arm[1], along])
                moved = np.array([x, y, 0.0 * x])
                moved = moved + np.cross(turn.T, arm_matrix).T
                closing = closing + side * (push[0] * moved[0] + push[1] * moved[1])
            self.stiffness += 0.5 * weight * stiffness * np.outer(closing, closing)

    def frequencies(self, speed):
        """Natural frequencies at a speed, without those that are 0 [rad/s]."""
        size = self.mass.shape[0]
        inverse = np.linalg.inv(self.mass)
        state = np.block(
            [
                [np.zeros((size, size)), np.eye(size)],
                [-inverse @ self.stiffness, -speed * inverse @ self.gyroscopic],
            ]
        )
        values = np.linalg.eigvals(state)
        return np.sort(values.imag[values.imag > 1.0])
