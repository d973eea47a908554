"""The half-space's share in what a flank yields along the width, and its projection.

Where a force acts, a flank yields like a half-space: by exp(-R / d) / (pi E' R) at a
distance R, with a decay d beyond which the tooth itself is what counts. Each end of the
tooth adds an image of the force. Distances on a helical flank are those of the flank
itself: with l toward the root, z along the axis and roll length s at the radius r,

    R^2 = dl^2 - 2 tau s dl dz + (1 + tau^2 r^2) dz^2,

which is (dz / cos beta_b)^2 along a line of contact, dl = tau s dz. An image is at a
distance of R^2 = dl^2 + (1 + tau^2 r^2) (b - z - z')^2 from the end z = b / 2.

The tip corner has images too, of the force and of its images at both ends. Those of
forces at l and l' are further apart by 4 l l' sin^2(t), at an angle t between the
corner and the section, cos t = tau s / sqrt(1 + tau^2 r^2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from fegear.elasticity.width_functions import polynomial_values
from lumped.common.array_types import Array

DECAY = 1.0  # of the half-space's share, in modules
POINTS = 48  # of Gauss quadrature on each piece of the width
Place = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class LineKernel:
    """Half-space kernel on a flank of a width, with images at both ends.

    modulus : E' in plane strain [Pa]; width, decay : [m]; twist : [rad/m]
    base_helix_angle : [rad]
    tip_angle : of the material at the tip corner [rad]; pi has no image
    """

    modulus: float
    width: float
    decay: float
    twist: float = 0.0
    base_helix_angle: float = 0.0
    tip_angle: float = math.pi

    @property
    def images(self) -> tuple[float, float]:
        """Strength of the images at the lower and the upper end of the width.

        A force on the edge of a wedge of angle t has t / pi of the directions that it
        has on a half-space, and its edge yields pi / t as much.
        """
        low, high = (
            math.pi / (0.5 * math.pi + side * self.base_helix_angle) - 1.0
            for side in (-1.0, 1.0)
        )
        return low, high

    @property
    def tip_image(self) -> float:
        """Strength of the image at the tip corner."""
        return wedge_factor(self.tip_angle) - 1.0

    def farther(self, one: Array, two: Array, rolls: Array, metric: Array) -> Array:
        """Add to a squared distance [m2] for that of the image at the tip corner.

        one, two : arcs of both points from the corner [m]
        rolls, metric : s [m] and 1 + tau^2 r^2 between them
        """
        return np.asarray(4.0 * one * two * (1.0 - (self.twist * rolls) ** 2 / metric))

    @property
    def mirrored(self) -> LineKernel:
        """That of the helix in the other direction."""
        return replace(self, twist=-self.twist, base_helix_angle=-self.base_helix_angle)

    def of_distance(self, distance: Array) -> Array:
        """Displacement under a unit force at distances above zero [m/N]."""
        share = np.exp(-distance / self.decay) / distance
        return np.asarray(share / (math.pi * self.modulus))

    def projected(self, arcs: Array, rolls: Array, radii: Array, degree: int) -> Array:
        """Coefficients (n, k, n, k) of the kernel in `polynomials` [m/N].

        arcs, rolls, radii : (n,) of points of the flank [m], each arc but once; of a
            point itself the part that is left without -2 ln(dl) / (pi E')
        """
        arc = arcs[:, None] - arcs[None, :]
        least = 1e-7 * self.decay
        away = np.where(arc == 0.0, least, arc)
        roll = 0.5 * (rolls[:, None] + rolls[None, :])
        radius = 0.5 * (radii[:, None] + radii[None, :])
        metric = 1.0 + (self.twist * radius) ** 2
        cross = self.twist * roll * away
        squared = away**2
        total = self._integral(squared, cross, metric, degree)
        if self.tip_image:
            squared = squared + self.farther(arcs[:, None], arcs, roll, metric)
            of_tip = self._integral(squared, cross, metric, degree)
            total += self.tip_image * of_tip
        # a line load's own logarithm, the finite part of which is zero in the point
        logarithm = -2.0 * np.log(least) / (math.pi * self.modulus * self.width)
        finite_part = np.where(arc == 0.0, logarithm / np.sqrt(metric), 0.0)
        total -= finite_part[:, :, None, None] * np.eye(degree + 1)
        return np.ascontiguousarray(total.transpose(0, 2, 1, 3))

    def _integral(
        self, apart: Array, cross: Array, metric: Array, degree: int
    ) -> Array:
        """(n, n, k, k) for points with R^2 = apart in a section, cross = tau s dl."""
        width, total = self.width, np.zeros(1)
        overlaps = _correlations(width, degree, self.images)
        scale = np.sqrt(apart / metric)
        for sign in (1.0, -1.0):
            steps, weights = _graded_points(scale, width)
            squared = apart + steps * (metric * steps - 2.0 * sign * cross)
            values = weights * self.of_distance(np.sqrt(squared))
            overlap = overlaps[0] if sign > 0.0 else overlaps[0].transpose(0, 2, 1)
            total = total + _against(values, steps / width, overlap)
        steps, weights = _graded_points(scale, width)
        # an image is up to one width away, or between one and two
        for widths, overlap in enumerate(overlaps[1:]):
            distance = np.sqrt(apart + metric * (steps + widths * width) ** 2)
            values = weights * self.of_distance(distance)
            total = total + _against(values, steps / width, overlap)
        return np.asarray(total) / width**2


def wedge_factor(angle: float) -> float:
    """Return how much more the edge of a wedge yields than a half-plane.

    A line load acts along the edge, normal to one face. Displacement grows with the
    logarithm of the distance; the factor is that of Michell's wedge, under a force
    along its middle and one across.

    angle : of the material [rad]
    """
    half, sine = 0.5 * angle, math.sin(angle)
    along = math.sin(half) ** 2 / (angle + sine)
    across = math.cos(half) ** 2 / (angle - sine)
    return math.pi * (along + across)


def _graded_points(scale: Array, width: float) -> tuple[Array, Array]:
    """Gauss points (points, n, n) from 0 to a width, dense near 0 within a scale."""
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    last = np.arcsinh(width / scale)
    place = 0.5 * (1.0 + node)[:, None, None] * last
    weights = 0.5 * weight[:, None, None] * last * scale * np.cosh(place)
    return scale * np.sinh(place), weights


def _against(values: Array, place: Array, coefficients: Array) -> Array:
    """Sum of values times polynomials (c, k, k) over places in 0 .. 1."""
    basis = chebyshev.chebvander(2.0 * place - 1.0, len(coefficients) - 1)
    moments = np.einsum("pij,pijc->ijc", values, basis)
    return np.tensordot(moments, coefficients, 1)


def _correlations(width: float, degree: int, images: tuple[float, float]) -> Array:
    """Chebyshev coefficients (3, c, k, k) of the overlap of polynomials at a distance.

    Of f_k(z + t) f_l(z) over z, and of f_k(z) f_l(b - t - z) where t is below a width
    and where it is above it: both ends together, each by the strength of its image.
    """
    count = 2 * degree + 2
    node = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    t = 0.5 * (1.0 + node)
    point, weight = np.polynomial.legendre.leggauss(degree + 2)
    half = 0.5 * width
    parity = (-1.0) ** np.add.outer(np.arange(degree + 1), np.arange(degree + 1))

    def integral(low: Array, high: Array, first: Place, second: Place) -> Array:
        z = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * point
        weights = 0.5 * (high - low)[:, None] * weight
        one, two = (
            polynomial_values(width, degree, place.ravel())[0].reshape(*z.shape, -1)
            for place in (first(z), second(z))
        )
        return np.einsum("tp,tpk,tpl->tkl", weights, one, two)

    step, whole = width * t, np.full(count, half)
    shift = step[:, None]
    apart = integral(-whole, half - step, lambda z: z + shift, lambda z: z)
    near = integral(half - step, whole, lambda z: z, lambda z: width - shift - z)
    far = integral(
        -whole, half - step, lambda z: z, lambda z: -shift - z
    )  # a width more
    basis = chebyshev.chebvander(node, count - 1)
    both_ends = images[1] + images[0] * parity
    pieces = np.stack([apart, near * both_ends, far * both_ends])
    return np.stack([np.tensordot(np.linalg.inv(basis), piece, 1) for piece in pieces])
