"""A machine at rest by a code of its own: beams, rigid discs and slices in contact.

It takes from the package what teeth yield and where lines of contact are. Shafts are
beams of many elements, displacements of points by rotation vectors and cross products,
contact points by circles, and the contact by projected steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

ELEMENTS = 48


@dataclass
class OwnShaft:
    """Uniform round shaft along z; bearings : (position, kx, ky, kz, tilt)."""

    length: float
    diameter: float
    bore: float
    bearings: list[tuple[float, float, float, float, float]]
    young: float = 206e9
    poisson: float = 0.3

    def compliance(self, place):
        """Displacement and rotation vector (6, 6) of the axis at a place, by force and
        moment there; no rotation about z."""
        d, m = self.diameter, self.bore / self.diameter
        area = math.pi / 4.0 * (d**2 - self.bore**2)
        inertia = math.pi / 64.0 * (d**4 - self.bore**4)
        nu, ring = self.poisson, (1.0 + m**2) ** 2
        kappa = (
            6.0
            * (1.0 + nu)
            * ring
            / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * m**2)
        )
        shear = kappa * area * self.young / 2.0 / (1.0 + nu)
        stops = {0.0, self.length, place, *(bearing[0] for bearing in self.bearings)}
        nodes = np.union1d(sorted(stops), np.linspace(0.0, self.length, ELEMENTS + 1))
        nodes = nodes[np.concatenate([[True], np.diff(nodes) > 1e-9])]
        n = nodes.size
        K = np.zeros((6 * n, 6 * n))
        for i, length in enumerate(np.diff(nodes)):
            # of the far end while the near end is clamped: moved and turned by a force
            # and a moment, in one plane
            flexible = np.array(
                [
                    [length**3 / 3.0, length**2 / 2.0],
                    [length**2 / 2.0, length],
                ]
            ) / (self.young * inertia)
            flexible[0, 0] += length / shear
            far = np.linalg.inv(flexible)
            carry = np.array([[1.0, length], [0.0, 1.0]])  # rigidly, from near to far
            both = np.hstack([-carry, np.eye(2)])
            plane = both.T @ far @ both
            for move, turn, sign in ((0, 4, 1.0), (1, 3, -1.0)):
                at = [6 * i + move, 6 * i + turn, 6 * i + 6 + move, 6 * i + 6 + turn]
                signs = np.array([1.0, sign, 1.0, sign])
                K[np.ix_(at, at)] += plane * np.outer(signs, signs)
            at = [6 * i + 2, 6 * i + 8]
            rod = self.young * area / length
            K[np.ix_(at, at)] += rod * np.array([[1.0, -1.0], [-1.0, 1.0]])
        for position, *stiffness, tilt in self.bearings:
            node = int(np.abs(nodes - position).argmin())
            for axis, value in zip(
                (0, 1, 2, 3, 4), (*stiffness, tilt, tilt), strict=True
            ):
                K[6 * node + axis, 6 * node + axis] += value
        free = [i for i in range(6 * n) if i % 6 != 5]
        node = int(np.abs(nodes - place).argmin())
        right = np.zeros((6 * n, 5))
        right[6 * node + np.arange(5), np.arange(5)] = 1.0
        solved = np.zeros((6 * n, 5))
        solved[free] = np.linalg.solve(K[np.ix_(free, free)], right[free])
        result = np.zeros((6, 6))
        result[:5, :5] = solved[6 * node : 6 * node + 5]
        return result


def contact_points(pair, radii, center_line, sense):
    """Points (p, 2) of the line of action at radii (p,) of the driver, and the push.

    The push of the driver on the driven gear, unit vector; external gears.
    """
    c = np.array([math.cos(center_line), math.sin(center_line)])
    across = sense * np.array(
        [-c[1], c[0]]
    )  # where the driver moves at the pitch point
    alpha = math.acos(
        (pair.driver.base_radius + pair.driven.base_radius) / pair.center_distance
    )
    push = math.cos(alpha) * across + math.sin(alpha) * c
    pitch = c * pair.center_distance * pair.driver.base_radius
    pitch /= pair.driver.base_radius + pair.driven.base_radius

    def on_line(radius):
        def off(way):
            return float(np.hypot(*(pitch + way * push)) - radius)

        # beyond where the line touches the base circle
        touch = -float(pitch @ push)
        return pitch + brentq(off, touch, touch + 1.0, xtol=1e-15) * push

    return np.array([on_line(radius) for radius in radii]), push


def solve_contact(compliance, of_contact, gap, closing, arm, torque):
    """Normal forces and transmission error at a torque.

    compliance : (p, p) but for the contact of every place itself
    of_contact : approach of that, and its slope, by forces
    """
    n = gap.size
    touching = np.ones(n, bool)
    force = np.full(n, torque / arm.sum())
    for _ in range(400):
        approach, slope = of_contact(np.maximum(force, 1e-9 * force.max()))
        index = np.flatnonzero(touching)
        t = index.size
        matrix = np.zeros((t + 1, t + 1))
        matrix[:t, :t] = compliance[np.ix_(index, index)] + np.diag(slope[index])
        matrix[:t, t] = -closing[index]
        matrix[t, :t] = arm[index]
        right = np.append(
            -closing[index] * gap[index]
            - approach[index]
            + slope[index] * force[index],
            torque,
        )
        solved = np.linalg.solve(matrix, right)
        new = np.zeros(n)
        new[index] = solved[:t]
        ste = solved[t]
        opening = closing * (gap - ste) + compliance @ new
        pulls = touching & (new < 0.0)
        overlaps = ~touching & (opening < -1e-15)
        change = np.abs(new - force).max() / np.abs(new).max()
        force = np.maximum(new, 0.0)
        if not pulls.any() and not overlaps.any() and change < 1e-12:
            return force, ste
        if pulls.any():
            touching[np.where(pulls, new, 0.0).argmin()] = False  # one at a time
        elif overlaps.any():
            touching[np.where(overlaps, opening, 0.0).argmin()] = True
    raise RuntimeError("not solved")
