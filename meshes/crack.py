"""Cracks at the root of a tooth: their path through the tooth, and what is refused.

A crack begins on a fillet, where the tangent of the fillet makes a stated angle with
the tooth's centre line, and follows a straight or a given path into the body. Points
are in the tooth frame of `meshes.profile`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from meshes.gear import SpurGear, apart_from, ceiled, floored
from meshes.outline import MeshSize, half_sector_outline
from meshes.profile import Points, fillet_points, polar

MIN_DEPTH = 1e-3  # modules
CLEARANCE = 0.1  # least distance of a crack from the outline of its sector, in modules
CLEARANCE_PER_LENGTH = 0.15  # the same near the mouth, per length along the crack
MIN_CHORD = 0.7  # least distance of two points of a path, per length between them
MIN_SURFACE_ANGLE = math.radians(20.0)  # between a crack and the fillet at its mouth
STATIONS = 401  # points of a crack at which its distances are checked
PIECE_NAMES = {
    "tip": "the tip of the tooth",
    "flank": "the {side} flank",
    "fillet": "the {side} fillet",
    "root": "the root circle on the {side}",
    "cut": "the {side} edge of the tooth's sector",
    "hub": "the hub",
}


@dataclass(frozen=True, kw_only=True)
class Crack:
    """Crack at the root of a tooth, open at a fillet.

    Parameters
    ----------
    depth : float
        Length along its path from the fillet to the tip [m].
    tangent_angle : float
        The crack begins where the tangent of the fillet makes this angle with the
        tooth's centre line [rad].
    direction : float, optional
        Angle between a straight path, from the fillet on, and the centre line toward
        the hub [rad]: 0 runs down along the tooth, pi/2 straight across. By default the
        path follows the inward normal of the fillet.
    left : bool
        Whether the crack begins at the left fillet, seen with the tooth pointing up,
        instead of the right one.
    path : tuple of (float, float), optional
        Further points (x, y) of a given path in the tooth frame [m], which the crack
        follows as far as its depth; excludes `direction`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its limits.
    """

    depth: float
    tangent_angle: float = math.radians(30.0)
    direction: float | None = None
    left: bool = False
    path: tuple[tuple[float, float], ...] | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.depth < math.inf:
            raise ValueError(f"depth = {1e3 * self.depth:g} mm; must be positive")
        angle = math.degrees(self.tangent_angle)
        if not 0.0 < angle < 90.0:
            raise ValueError(
                f"tangent_angle = {apart_from(angle, '0', '90')} deg; must be above "
                "0, below 90"
            )
        if self.direction is not None:
            if self.path is not None:
                raise ValueError("direction: only without path, which has its own")
            angle = math.degrees(self.direction)
            if not 0.0 <= angle <= 180.0:
                raise ValueError(
                    f"direction = {apart_from(angle, '0', '180')} deg; must be 0 to 180"
                )
        if self.path is not None:
            if not self.path:
                raise ValueError("path: at least one point is needed")
            if not all(map(math.isfinite, sum(self.path, ()))):
                raise ValueError("path: its coordinates must be finite")

    @property
    def mirrored(self) -> Crack:
        """The crack mirrored at the tooth's centre line, at the other fillet."""
        path = self.path and tuple((-x, y) for x, y in self.path)
        return replace(self, left=not self.left, path=path)


def crack_points(gear: SpurGear, crack: Crack) -> Points:
    """Points of a crack from its mouth on the fillet to its tip.

    Parameters
    ----------
    gear : SpurGear
        Gear whose tooth has the crack.
    crack : Crack
        Its description.

    Returns
    -------
    (n, 2) array
        Corners of the path in the tooth frame [m]: mouth, bends, tip.

    Raises
    ------
    ValueError
        If the crack begins beside the fillet, leaves the sector of its tooth, comes
        nearer to its outline than CLEARANCE modules, or meets itself; the message has
        the largest depth along that path.
    """
    if crack.left:
        return crack_points(gear, crack.mirrored) * [-1.0, 1.0]
    least = MIN_DEPTH * gear.module
    if crack.depth < least:
        least_text = ceiled(1e3 * least)
        raise ValueError(
            f"depth = {apart_from(1e3 * crack.depth, least_text)} mm; at least "
            f"{least_text} mm, "
            "which the mesh at its tip resolves"
        )
    normal_angle = mouth_normal_angle(gear, crack)
    mouth = fillet_points(gear, normal_angle)
    if crack.path is None:
        slope = crack.tangent_angle
        angle = 0.5 * math.pi - slope if crack.direction is None else crack.direction
        tip = mouth - crack.depth * np.array([math.sin(angle), math.cos(angle)])
        corners = np.stack([mouth, tip])
    else:
        corners = _cut_to_depth(np.vstack([mouth, crack.path]), crack.depth)
    _require_into_body(crack, corners)
    _require_clear(gear, crack, corners)
    return corners


def mouth_normal_angle(gear: SpurGear, crack: Crack) -> float:
    """Parameter of `fillet_points` [rad] at the mouth of a crack on the right fillet.

    Tangents become steeper from the root circle to the flank.
    """
    low, high = 0.0, gear.form_normal_angle
    flattest, steepest = fillet_slope(gear, low), fillet_slope(gear, high)
    if not steepest <= crack.tangent_angle <= flattest:
        raise ValueError(
            f"tangent_angle = {math.degrees(crack.tangent_angle):g} deg; tangents of "
            f"the fillet make angles from {ceiled(math.degrees(steepest))} to "
            f"{floored(math.degrees(flattest))} deg with the centre line"
        )
    for _ in range(60):
        middle = 0.5 * (low + high)
        if fillet_slope(gear, middle) > crack.tangent_angle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def fillet_slope(gear: SpurGear, normal_angle: float) -> float:
    """Angle between tangent of the right fillet and centre line [rad]."""
    step = 1e-5
    below, above = fillet_points(gear, normal_angle + np.array([-step, step]))
    upward = above - below
    return math.atan2(-upward[0], upward[1])


def arc_lengths(points: Points) -> NDArray[np.float64]:
    """Length (n,) of a polyline from its first point to each one."""
    return np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))


def along(points: Points, lengths: NDArray[np.float64]) -> Points:
    """Points of a polyline at lengths from its first point."""
    stops = arc_lengths(points)
    return np.stack([np.interp(lengths, stops, part) for part in points.T], axis=1)


def _cut_to_depth(corners: Points, depth: float) -> Points:
    """A path as far as a depth, without a bend that is very near its end."""
    stops = arc_lengths(corners)
    if not np.all(np.diff(stops) > 0.0):
        raise ValueError("path: two points of it, or its first and the mouth, coincide")
    if depth > stops[-1] * (1.0 + 1e-9):
        most = floored(1e3 * stops[-1])
        raise ValueError(
            f"depth = {apart_from(1e3 * depth, most)} mm; at most {most} mm, the "
            "length of the path"
        )
    inner = corners[(stops > 0.0) & (stops < 0.97 * depth)]
    tip = along(corners, np.array([min(depth, stops[-1])]))
    return np.vstack([corners[:1], inner, tip])


def _require_into_body(crack: Crack, corners: Points) -> None:
    first = corners[1] - corners[0]
    slope = crack.tangent_angle
    inward = -np.array([math.cos(slope), math.sin(slope)])
    sine = float(first @ inward) / math.hypot(*first)
    if not sine >= math.sin(MIN_SURFACE_ANGLE):
        name = "path" if crack.path is not None else "direction"
        angle = math.degrees(math.asin(max(-1.0, min(1.0, sine))))
        least = f"{math.degrees(MIN_SURFACE_ANGLE):g}"
        raise ValueError(
            f"{name}: the crack begins at {apart_from(angle, least)} deg to the "
            "fillet; must be from "
            f"{least} deg into the tooth"
        )


def sector_pieces(gear: SpurGear) -> dict[str, Points]:
    """Outline of the whole sector as polylines, by what they are."""
    right = {
        piece.name: piece.vertices for piece in half_sector_outline(gear, MeshSize())
    }
    corner, half = list(right.values())[-1][-1], 0.5 * gear.pitch_angle
    hub = polar(gear.hub_radius, np.linspace(half, 0.0, 17))
    right |= {"cut": np.stack([corner, hub[0]]), "hub": hub}
    pieces = {PIECE_NAMES[n].format(side="right"): p for n, p in right.items()}
    for name, piece in right.items():
        label = PIECE_NAMES[name].format(side="left")
        mirrored = piece * [-1.0, 1.0]
        pieces[label] = (
            np.vstack([mirrored[:0:-1], piece]) if label in pieces else mirrored
        )
    return pieces


def _require_clear(gear: SpurGear, crack: Crack, corners: Points) -> None:
    """Require a distance from all of the outline, which a path out of it crosses."""
    lengths = crack.depth * np.linspace(0.0, 1.0, STATIONS)[1:]
    stations = along(corners, lengths)
    least = np.minimum(CLEARANCE * gear.module, CLEARANCE_PER_LENGTH * lengths)
    pieces = sector_pieces(gear)
    distances = np.stack([distance_to(stations, piece) for piece in pieces.values()])
    outside = ~_is_inside(stations, _closed(list(pieces.values())))
    too_near = outside | (distances < least).any(axis=0)
    if too_near.any():
        first = int(np.argmax(too_near))
        label = list(pieces)[int(np.argmin(distances[:, first] - least[first]))]
        most = floored(1e3 * (lengths[first - 1] if first else 0.0))
        raise ValueError(
            f"depth = {apart_from(1e3 * crack.depth, most)} mm; at most {most} mm "
            f"along this path, which comes nearer than {1e3 * least[first]:.3g} mm to "
            f"{label}"
        )
    require_straight_enough(stations, lengths)


def require_straight_enough(stations: Points, lengths: NDArray[np.float64]) -> None:
    """Require that a path does not turn back to itself."""
    chord = np.hypot(*np.moveaxis(stations[:, None] - stations[None], -1, 0))
    between = np.abs(lengths[:, None] - lengths)
    bent = chord < (MIN_CHORD - 1e-9) * between
    if bent.any():
        i, j = np.unravel_index(int(np.argmax(bent)), bent.shape)
        raise ValueError(
            f"path: its points {1e3 * lengths[i]:.4g} mm and {1e3 * lengths[j]:.4g} mm "
            f"from the fillet are {1e3 * chord[i, j]:.4g} mm apart; at least "
            f"{MIN_CHORD:g} times the length between them is needed"
        )


def distance_to(points: Points, polyline: Points) -> NDArray[np.float64]:
    """Distance (n,) of points from a polyline."""
    start, way = polyline[:-1], np.diff(polyline, axis=0)
    offset = points[:, None] - start
    part = (offset * way).sum(axis=-1) / (way**2).sum(axis=-1)
    nearest = offset - np.clip(part, 0.0, 1.0)[..., None] * way
    return np.asarray(np.hypot(nearest[..., 0], nearest[..., 1]).min(axis=1))


def _closed(pieces: Sequence[Points]) -> Points:
    """Segments (n, 2, 2) of all polylines."""
    return np.concatenate([np.stack([p[:-1], p[1:]], axis=1) for p in pieces])


def _is_inside(points: Points, segments: Points) -> NDArray[np.bool_]:
    """Whether points lie within closed segments: rays to the right cross oddly many."""
    (x1, y1), (x2, y2) = segments[:, 0].T, segments[:, 1].T
    x, y = points[:, :1], points[:, 1:]
    spans = (y1 > y) != (y2 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x1 + (y - y1) / (y2 - y1) * (x2 - x1)
    return np.asarray((spans & (at > x)).sum(axis=1) % 2 == 1)


def require_separate(gear: SpurGear, cracks: Sequence[Crack]) -> None:
    """Require at most one crack at each fillet, and that two leave enough between."""
    if len({crack.left for crack in cracks}) < len(cracks):
        raise ValueError(
            f"{len(cracks)} cracks of a tooth; allowed one at each of its fillets"
        )
    if len(cracks) < 2:
        return
    paths = [crack_points(gear, crack) for crack in cracks]
    lengths = np.linspace(0.0, cracks[0].depth, STATIONS)
    nearest = float(distance_to(along(paths[0], lengths), paths[1]).min())
    least = 2.0 * CLEARANCE * gear.module
    if nearest < least or _cross(*paths):
        depths = " and ".join(f"{1e3 * crack.depth:.9g}" for crack in cracks)
        raise ValueError(
            f"depth = {depths} mm; the two cracks of the tooth come within "
            f"{1e3 * nearest:.3g} mm of each other, at least {1e3 * least:.3g} mm are "
            "needed"
        )


def _cross(one: Points, two: Points) -> bool:
    """Whether two polylines cross."""

    def side(a: Points, b: Points, p: Points) -> float:
        return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))

    return any(
        side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
        for a, b in pairwise(one)
        for c, d in pairwise(two)
    )


Size = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def graded_stops(length: float, size: Size) -> NDArray[np.float64]:
    """Positions from 0 to `length`, as far from each other as `size` says there."""
    dense = np.linspace(0.0, length, 2001)
    middle = 0.5 * (dense[1:] + dense[:-1])
    count = np.append(0.0, np.cumsum(np.diff(dense) / size(middle)))
    edges = max(1, math.ceil(count[-1] - 1e-9))
    return np.interp(np.linspace(0.0, count[-1], edges + 1), count, dense)
