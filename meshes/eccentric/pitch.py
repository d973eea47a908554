"""Pitch curves of a circle with an eccentric bearing and of the wheel that it drives.

The circle of radius r rotates about a point at a distance e from its centre. At the
centre angle theta the arc s = r theta has rolled, and the pitch point is at a distance
rho = sqrt(r^2 + e^2 - 2 r e cos theta) from the driver's bearing and c - rho from the
driven wheel's. Rolling without slip, the driven wheel rotates by

    d psi / ds = sqrt(1 - rho'^2) / (c - rho) = (r - e cos theta) / (rho (c - rho)),

which is the source's first-order system in polar coordinates, where no sign needs to be
chosen.

Each wheel has its own frame with the origin in its bearing. At theta = 0 the pitch
point is on the line of the bearings, at (r - e, 0) of the driver and (r - e - c, 0) of
the driven wheel. The driver then rotates clockwise and the driven wheel
counter-clockwise.

See W. G. Eschmann, Mathematical problems in gear transmissions, ICTP 1987, part I.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from meshes.array_types import Array
from meshes.gear import GeometryError, apart_from, floored

MIN_GAP = 1e-3  # least distance from the bearing to the circle, over the radius
MAX_LOBES = 100
MIN_SAMPLES, MAX_SAMPLES = 64, 1 << 17  # terms of a periodic function of the angle
ROUND_OFF = 4e-16
MARGIN = 1e-6  # margin over the radius in the search for the centre distance


class Frames(NamedTuple):
    """Frames at n points of a pitch curve, in the frame of the wheel.

    tangent : (n, 2) direction of the pitch point's motion
    normal : (n, 2) outward normal of the wheel
    curvature : (n,) curvature, positive where the curve is convex [1/m]
    slope : (n,) derivative of the curvature along the curve [1/m2]
    """

    point: Array
    tangent: Array
    normal: Array
    curvature: Array
    slope: Array


@dataclass(frozen=True)
class PitchCurve:
    """Closed pitch curve as a function of the driver's centre angle.

    radius : radius of the driver; arc lengths are radius times angle [m]
    turns : turns of the driver until the curve closes
    frames : function of centre angles (n,) [rad] that returns frames
    """

    radius: float
    turns: int
    frames: Callable[[ArrayLike], Frames]

    @property
    def length(self) -> float:
        return 2.0 * math.pi * self.radius * self.turns


@dataclass(frozen=True)
class EccentricPair:
    """Circular driver with an eccentric bearing and the wheel that it drives.

    radius, eccentricity : radius of the driver's pitch circle, and eccentricity of its
        bearing [m]
    ratio : turns of the driver per turn of the driven wheel, a whole number, which is
        the number of equal lobes of the driven pitch curve

    Raises GeometryError if no such pair exists.
    """

    radius: float
    eccentricity: float
    ratio: float = 1

    def __post_init__(self) -> None:
        r, e = self.radius, self.eccentricity
        if not 0.0 < r < math.inf:
            got = f"{1e3 * r:g} mm; must be positive and finite"
            raise GeometryError("radius", got)
        if not 0.0 <= e <= (1.0 - MIN_GAP) * r:
            most = floored(1e3 * (1.0 - MIN_GAP) * r)
            got = f"{apart_from(1e3 * e, most)} mm; must be from 0 to {most} mm, below"
            got = f"{got} the radius"
            raise GeometryError("eccentricity", got)
        whole = 1 <= self.ratio <= MAX_LOBES and self.ratio == int(self.ratio)
        if not whole:
            raise GeometryError(
                "ratio",
                f"{self.ratio:.12g}; must be a whole number from 1 to {MAX_LOBES}, "
                "else the driven pitch curve does not close",
            )

    @property
    def lobes(self) -> int:
        """Number of lobes of the driven pitch curve."""
        return int(self.ratio)

    @cached_property
    def center_distance(self) -> float:
        """Bearing distance at which the driven curve closes, to round-off [m]."""
        largest = self.radius + self.eccentricity

        def excess(distance: float) -> float:
            terms = _terms(lambda angle: self._turning(angle, distance))
            return float(terms[0]) - 1.0 / self.ratio

        low, high = largest + MARGIN * self.radius, largest + self.radius * self.ratio
        return float(brentq(excess, low, 2.0 * high, xtol=1e-300, rtol=ROUND_OFF * 4.0))

    @property
    def approximate_center_distance(self) -> float:
        """Burmester's approximation for small eccentricities [m]."""
        n, ratio = self.ratio, self.eccentricity / self.radius
        return self.radius * (n + 1) * (1.0 - (n - 2) / (4.0 * n) * ratio**2)

    def closing_error(self, distance: float) -> float:
        """Angle by which the driven curve fails to close after a turn of the driven
        wheel with a centre distance [m]; positive if it overlaps [rad]."""
        terms = _terms(lambda angle: self._turning(angle, distance))
        return 2.0 * math.pi * (self.ratio * float(terms[0]) - 1.0)

    def rolled(self, angle: ArrayLike, distance: float) -> Array:
        """Points (n, 2) that roll on the driver if the bearings are a distance apart,
        in the driven wheel's frame [m]; closed only at the centre distance."""
        angle = np.asarray(angle, float)
        terms = _terms(lambda theta: self._turning(theta, distance))
        turn = terms[0] * angle + _sine_sum(_integrated(terms), angle)
        along = np.stack([-np.cos(turn), np.sin(turn)], axis=-1)
        return (distance - self.driver_radius(angle))[..., None] * along

    @property
    def driver(self) -> PitchCurve:
        return PitchCurve(self.radius, 1, self._driver_frames)

    @property
    def driven(self) -> PitchCurve:
        return PitchCurve(self.radius, self.lobes, self._driven_frames)

    def driver_radius(self, angle: ArrayLike) -> Array:
        """Distance of the pitch point from the driver's bearing [m]."""
        r, e = self.radius, self.eccentricity
        half = np.sin(0.5 * np.asarray(angle, float))
        return np.sqrt((r - e) ** 2 + 4.0 * r * e * half**2)

    def driver_turn(self, angle: ArrayLike) -> Array:
        """Clockwise rotation of the driver [rad]."""
        return np.asarray(angle, float) + self._lean(angle)

    def driven_turn(self, angle: ArrayLike) -> Array:
        """Counter-clockwise rotation of the driven wheel [rad]."""
        angle = np.asarray(angle, float)
        return angle / self.ratio + _sine_sum(self._waves, angle)

    def torque_ratio(self, angle: ArrayLike) -> Array:
        """Output torque over input torque without losses."""
        rho = self.driver_radius(angle)
        return (self.center_distance - rho) / rho

    def driven_curvature(self, angle: ArrayLike) -> tuple[Array, Array]:
        """Curvature (n,) of the driven pitch curve, by Euler-Savary, and its slope."""
        r, e, theta = self.radius, self.eccentricity, np.asarray(angle, float)
        rho, c = self.driver_radius(theta), self.center_distance
        rest = c - rho
        ahead, rate = r - e * np.cos(theta), e * np.sin(theta) / rho
        scale = c / (rho**2 * rest)
        slope = e * np.sin(theta) / r - ahead * rate * (2.0 / rho - 1.0 / rest)
        return scale * ahead - 1.0 / r, scale * slope

    def _lean(self, angle: ArrayLike) -> Array:
        """Angle of the circle's normal from the line of the bearings [rad]."""
        r, e, theta = self.radius, self.eccentricity, np.asarray(angle, float)
        return np.arctan2(e * np.sin(theta), r - e * np.cos(theta))

    def _turning(self, angle: Array, distance: float) -> Array:
        """Derivative d psi / d theta."""
        rho = self.driver_radius(angle)
        ahead = self.radius - self.eccentricity * np.cos(angle)
        return self.radius * ahead / (rho * (distance - rho))

    @cached_property
    def _waves(self) -> Array:
        """Factors of sin(k theta), k = 1, 2, ..., in the driven wheel's rotation."""
        distance = self.center_distance
        return _integrated(_terms(lambda angle: self._turning(angle, distance)))

    def _driver_frames(self, angle: ArrayLike) -> Frames:
        r, e, theta = self.radius, self.eccentricity, np.asarray(angle, float)
        normal = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
        tangent = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
        curvature = np.full(theta.shape, 1.0 / r)
        point = r * normal - [e, 0.0]
        return Frames(point, tangent, normal, curvature, np.zeros(theta.shape))

    def _driven_frames(self, angle: ArrayLike) -> Frames:
        theta = np.asarray(angle, float)
        psi = self.driven_turn(theta)
        rest = self.center_distance - self.driver_radius(theta)
        point = rest[..., None] * np.stack([-np.cos(psi), np.sin(psi)], axis=-1)
        outward = math.pi - psi - self._lean(theta)
        normal = np.stack([np.cos(outward), np.sin(outward)], axis=-1)
        tangent = np.stack([normal[..., 1], -normal[..., 0]], axis=-1)
        return Frames(point, tangent, normal, *self.driven_curvature(theta))


def _terms(function: Callable[[Array], Array]) -> Array:
    """Factors of cos(k theta) of an even periodic function, halved except the first,
    as many as exceed round-off."""
    count = MIN_SAMPLES
    while True:
        angle = 2.0 * math.pi * np.arange(count) / count
        terms = np.fft.rfft(function(angle)).real / count
        tail = np.abs(terms[-count // 8 :]).max()
        if tail <= ROUND_OFF * abs(terms[0]) or count >= MAX_SAMPLES:
            break
        count *= 2
    seen = np.flatnonzero(np.abs(terms) > ROUND_OFF * abs(terms[0]))
    return terms[: seen[-1] + 1]


def _integrated(terms: Array) -> Array:
    """Factors of sin(k theta), k = 1, 2, ..., of the integral without its mean."""
    return 2.0 * terms[1:] / np.arange(1, terms.size)


def _sine_sum(factors: Array, angle: Array) -> Array:
    """Sum of factors sin(k angle), k = 1, 2, ..."""
    padded = np.concatenate([[0.0], factors])
    circle = np.exp(1j * angle)
    return np.polynomial.polynomial.polyval(circle, padded.astype(complex)).imag
