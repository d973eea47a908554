"""Base curves: what the flanks are involutes of, and where there is none.

The line of action leaves the pitch point along d = cos(alpha) t +- sin(alpha) n. The
base curve is the envelope of these lines, a distance sin(alpha) / kappa from the pitch
curve, where kappa is its curvature. Along it an arc ds of the pitch curve measures

    (cos(alpha) -+ sin(alpha) d(1/kappa)/ds) ds.

While that is positive and kappa as well, the base curve turns one way without a cusp:
it is convex and does not cut itself. Flanks that are involutes exist then, which for
every pressure angle below a largest one holds, and above it for none.

W. G. Eschmann, Mathematical problems in gear transmissions, ICTP 1987, part I (iii).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize_scalar

from meshes.eccentric.pitch import LEAST_GAP, EccentricPair, Frames, PitchCurve

Array = NDArray[np.float64]
Side = Literal[1, -1]
LEADING: Side = 1  # flanks that look the way the pitch point goes
TRAILING: Side = -1
SAMPLES = 1024  # of a lobe, from which extremes are refined
EXACT = 1e-13


@dataclass(frozen=True)
class Feasibility:
    """Whether involute flanks can stand on both pitch curves.

    least_curvature : of the pitch curves times the radius; none at 0 and below
    least_speed : of the base curves along the pitch curves over cos(alpha); cusps and
        crossings at 0 and below
    inside : whether the base curve stays inside of the pitch curve
    largest_pressure_angle : for this eccentricity [rad], 0 where there is none
    largest_eccentricity : for this pressure angle [m]
    """

    least_curvature: float
    least_speed: float
    inside: bool
    largest_pressure_angle: float
    largest_eccentricity: float

    @property
    def feasible(self) -> bool:
        return self.least_curvature > 0.0 and self.least_speed > 0.0 and self.inside

    @property
    def reason(self) -> str:
        """Why not, empty where it is feasible."""
        if not self.least_curvature > 0.0:
            return "the driven pitch curve is not convex"
        if not self.least_speed > 0.0:
            return "the base curve has cusps and cuts itself"
        return "" if self.inside else "the base curve leaves the pitch curve"


def base_points(frames: Frames, pressure_angle: float, side: Side) -> Array:
    """Base curve of leading or trailing flanks (n, 2) [m]."""
    along, out = math.cos(pressure_angle), side * math.sin(pressure_angle)
    action = along * frames.tangent + out * frames.normal
    return frames.point - (out / frames.curvature)[..., None] * action


@lru_cache(maxsize=8)
def feasibility(pair: EccentricPair, pressure_angle: float) -> Feasibility:
    """Feasibility of both wheels; the driver's base curve is a circle and always
    exists.
    """
    curvature, steepest = least_curvature(pair), steepest_radius(pair)
    return Feasibility(
        curvature,
        1.0 - math.tan(pressure_angle) * steepest,
        curvature > 0.0 and _inside(pair.driven, pressure_angle),
        largest_pressure_angle(pair),
        largest_eccentricity(pair.radius, pair.ratio, pressure_angle),
    )


def least_curvature(pair: EccentricPair) -> float:
    """Least curvature of the driven pitch curve times the driver's radius."""

    def curvature(angle: ArrayLike) -> Array:
        return pair.driven_curvature(angle)[0] * pair.radius

    return min(1.0, _least(curvature))


def steepest_radius(pair: EccentricPair) -> float:
    """Largest change of the driven curve's radius of curvature along it; infinite
    where the curve is not convex."""
    if not least_curvature(pair) > 0.0:
        return math.inf

    def rate(angle: ArrayLike) -> Array:
        curvature, slope = pair.driven_curvature(angle)
        return -np.abs(slope) / curvature**2

    return -_least(rate)


def largest_pressure_angle(pair: EccentricPair) -> float:
    """Below which involute flanks exist [rad]."""
    return math.atan2(1.0, steepest_radius(pair))


def largest_eccentricity(radius: float, ratio: float, pressure_angle: float) -> float:
    """Below which involute flanks exist with a pressure angle [m]."""

    def room(part: float) -> float:
        pair = EccentricPair(radius, part * radius, ratio)
        return largest_pressure_angle(pair) - pressure_angle

    low, high = 0.0, 1.0 - LEAST_GAP
    return radius * float(brentq(room, low, high, xtol=EXACT, rtol=EXACT))


def _least(function: Callable[[ArrayLike], Array]) -> float:
    """Least value over half a lobe; the other half is its mirror image."""
    angle = np.linspace(0.0, math.pi, SAMPLES)
    values = function(angle)
    place = int(values.argmin())
    low, high = angle[max(place - 1, 0)], angle[min(place + 1, SAMPLES - 1)]
    found = minimize_scalar(
        lambda one: float(function(one)), bounds=(low, high), options={"xatol": 1e-9}
    )
    return min(float(values[place]), float(found.fun))


def _inside(curve: PitchCurve, pressure_angle: float) -> bool:
    """Whether the base curve is nearer to the bearing than the pitch curve, as seen
    from the bearing."""
    angle = np.linspace(0.0, 2.0 * math.pi * curve.turns, SAMPLES * curve.turns)
    frames = curve.frames(angle)
    base = base_points(frames, pressure_angle, LEADING)
    seen, radius = _polar(frames.point)
    at, base_radius = _polar(base)
    order = np.argsort(seen)
    limit = np.interp(at, seen[order], radius[order], period=2.0 * math.pi)
    return bool((base_radius <= limit * (1.0 + 1e-6)).all())


def _polar(points: Array) -> tuple[Array, Array]:
    angle = np.arctan2(points[:, 1], points[:, 0]) % (2.0 * math.pi)
    return angle, np.hypot(points[:, 0], points[:, 1])
