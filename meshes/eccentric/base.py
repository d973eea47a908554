"""Base curves, whose involutes are the flanks, and the limits of their existence.

The line of action leaves the pitch point along d = cos(alpha) t +- sin(alpha) n. The
base curve is the envelope of these lines, at a distance sin(alpha) / kappa from the
pitch curve, where kappa is its curvature. The arc of the base curve that corresponds to
an arc ds of the pitch curve is

    (cos(alpha) -+ sin(alpha) d(1/kappa)/ds) ds.

While this and kappa are positive, the base curve bends in one direction without a cusp:
it is convex and does not intersect itself. Involute flanks then exist. This holds for
every pressure angle below a largest one, and for none above it.

See W. G. Eschmann, Mathematical problems in gear transmissions, ICTP 1987, part I
(iii).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from meshes.array_types import Array
from meshes.eccentric.pitch import MIN_GAP, EccentricPair, Frames, PitchCurve

Side = Literal[1, -1]
LEADING: Side = 1  # flanks that face the direction of the pitch point's motion
TRAILING: Side = -1
SAMPLES = 1024  # samples of a lobe, from which extremes are refined
ROOT_TOL = 1e-13


@dataclass(frozen=True)
class Feasibility:
    """Existence of involute flanks on both pitch curves.

    min_curvature : least curvature of the pitch curves times the radius; no flanks
        exist if it is 0 or less
    min_speed : least speed of the base curves along the pitch curves over cos(alpha);
        cusps and crossings exist if it is 0 or less
    inside : whether the base curve stays inside the pitch curve
    largest_pressure_angle : limit for this eccentricity [rad], 0 if there is none
    largest_eccentricity : limit for this pressure angle [m]
    """

    min_curvature: float
    min_speed: float
    inside: bool
    largest_pressure_angle: float
    largest_eccentricity: float

    @property
    def feasible(self) -> bool:
        return self.min_curvature > 0.0 and self.min_speed > 0.0 and self.inside

    @property
    def reason(self) -> str:
        """Reason why flanks do not exist, empty if they do."""
        if not self.min_curvature > 0.0:
            return "the driven pitch curve is not convex"
        if not self.min_speed > 0.0:
            return "the base curve has cusps and cuts itself"
        return "" if self.inside else "the base curve leaves the pitch curve"


def base_points(frames: Frames, pressure_angle: float, side: Side) -> Array:
    """Points (n, 2) of the base curve of leading or trailing flanks [m]."""
    along, out = math.cos(pressure_angle), side * math.sin(pressure_angle)
    action = along * frames.tangent + out * frames.normal
    return frames.point - (out / frames.curvature)[..., None] * action


@lru_cache(maxsize=8)
def feasibility(pair: EccentricPair, pressure_angle: float) -> Feasibility:
    """Feasibility of both wheels; the driver's base curve is a circle and exists."""
    curvature, steepest = min_curvature(pair), steepest_radius(pair)
    return Feasibility(
        curvature,
        1.0 - math.tan(pressure_angle) * steepest,
        curvature > 0.0 and _inside(pair.driven, pressure_angle),
        largest_pressure_angle(pair),
        largest_eccentricity(pair.radius, pair.ratio, pressure_angle),
    )


def min_curvature(pair: EccentricPair) -> float:
    """Least curvature of the driven pitch curve times the driver's radius."""

    def curvature(angle: ArrayLike) -> Array:
        return pair.driven_curvature(angle)[0] * pair.radius

    return min(1.0, _least(curvature))


def steepest_radius(pair: EccentricPair) -> float:
    """Largest change of the driven curve's radius of curvature along it; infinite if
    the curve is not convex."""
    if not min_curvature(pair) > 0.0:
        return math.inf

    def rate(angle: ArrayLike) -> Array:
        curvature, slope = pair.driven_curvature(angle)
        return -np.abs(slope) / curvature**2

    return -_least(rate)


def largest_pressure_angle(pair: EccentricPair) -> float:
    """Pressure angle below which involute flanks exist [rad]."""
    return math.atan2(1.0, steepest_radius(pair))


def largest_eccentricity(radius: float, ratio: float, pressure_angle: float) -> float:
    """Eccentricity below which involute flanks exist for a pressure angle [m]."""

    def room(part: float) -> float:
        pair = EccentricPair(radius, part * radius, ratio)
        return largest_pressure_angle(pair) - pressure_angle

    low, high = 0.0, 1.0 - MIN_GAP
    return radius * float(brentq(room, low, high, xtol=ROOT_TOL, rtol=ROOT_TOL))


def _least(function: Callable[[ArrayLike], Array]) -> float:
    """Least value over half a lobe; the other half is its mirror image."""
    angle = np.linspace(0.0, math.pi, SAMPLES)
    values = function(angle)
    index = int(values.argmin())
    low, high = angle[max(index - 1, 0)], angle[min(index + 1, SAMPLES - 1)]
    minimum = minimize_scalar(
        lambda one: float(function(one)), bounds=(low, high), options={"xatol": 1e-9}
    )
    return min(float(values[index]), float(minimum.fun))


def _inside(curve: PitchCurve, pressure_angle: float) -> bool:
    """Whether the base curve is closer to the bearing than the pitch curve, as seen
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
