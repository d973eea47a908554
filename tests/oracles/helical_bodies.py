"""Rigid gears in space whose teeth touch all over their plane of action.

Displacements and forces are vectors in space: a body moves by u + theta x (p - c), and
a force f at p has the moment (p - c) x f. Coordinates of a body are u and theta. Its
own derivation of where teeth touch begins at the pitch point.
"""

from __future__ import annotations

import math

import numpy as np

Z = np.array([0.0, 0.0, 1.0])
GAUSS = np.polynomial.legendre.leggauss(3)


class HelicalTeeth:
    """Teeth of a driver with its centre in the origin and of a driven gear.

    base_radii : positive of both
    internal : whether the driven gear is
    counter_clockwise : whether the driver rotates so
    pressure_angle : of operation, in the section
    helix : base helix angle, positive where the driver pushes along z
    path : distances along the push from the pitch point, start and end
    """

    def __init__(
        self,
        base_radii,
        pressure_angle,
        center_line,
        helix,
        path,
        width,
        internal=False,
        counter_clockwise=True,
        offsets=(0.0, 0.0),
    ):
        along = np.array([math.cos(center_line), math.sin(center_line), 0.0])
        one, two = (radius / math.cos(pressure_angle) for radius in base_radii)
        # a pinion touches its ring on the side away from the ring's centre
        toward = -along if internal else along
        self.centers = np.zeros(3), (two - one if internal else one + two) * along
        self.pitch_point = one * toward
        turning = np.cross(Z if counter_clockwise else -Z, toward)
        self.push = math.cos(pressure_angle) * turning
        self.push = self.push + math.sin(pressure_angle) * toward
        self.normal = math.cos(helix) * self.push + math.sin(helix) * Z
        self.path, self.width, self.helix = path, width, helix
        self.offsets = offsets

    def points(self):
        """Points of the plane of action from its middle, and weights that sum to 1."""
        start, end = self.path
        for one, weight in zip(*GAUSS, strict=True):
            for two, other in zip(*GAUSS, strict=True):
                roll = 0.5 * (start + end) + 0.5 * (end - start) * one
                point = self.pitch_point + roll * self.push
                yield point + 0.5 * self.width * two * Z, 0.25 * weight * other

    def closing(self, point):
        """Transmission error (12,) by both bodies' u and theta, at a point.

        Point 0 along z is the middle of the teeth, where gears are that have no offset.
        """
        row = []
        both = zip(self.centers, self.offsets, (1.0, -1.0), strict=True)
        for center, offset, side in both:
            arm = point + offset * Z - center
            row += [side * self.normal, side * np.cross(arm, self.normal)]
        return np.concatenate(row) / math.cos(self.helix)

    def matrix(self, stiffness):
        """Stiffness (12, 12), evenly spread, of transmission errors of all points."""
        total = np.zeros((12, 12))
        for point, weight in self.points():
            row = self.closing(point)
            total += weight * stiffness * np.outer(row, row)
        return total

    def energy_by_displacements(self, stiffness, motion):
        """Strain energy [J] of a motion (12,), by how points of both bodies move."""
        energy = 0.0
        for point, weight in self.points():
            moved = []
            for body, center in enumerate(self.centers):
                u, theta = motion[6 * body : 6 * body + 3], motion[6 * body + 3 :][:3]
                arm = point + self.offsets[body] * Z - center
                moved.append(u + np.cross(theta, arm))
            approach = (moved[0] - moved[1]) @ self.normal / math.cos(self.helix)
            energy += 0.5 * weight * stiffness * approach**2
        return energy
