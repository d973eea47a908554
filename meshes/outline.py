"""Boundary of the right half of a tooth sector as a chain of short edges.

Each edge carries its true curve, so that a mid-side node can be put on it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.gear import SpurGear
from meshes.profile import (
    Points,
    angle_of,
    fillet_points,
    flank_points,
    polar,
    roll_length_at_arc,
)

FLOOR_DEPTH = 6.0  # below the root circle, in modules
Curve = Callable[[NDArray[np.float64]], Points]


@dataclass(frozen=True, kw_only=True)
class MeshSize:
    """Edges along the tooth outline; the interior is graded from them.

    flank_edges : number of edges from the tip corner to the form circle
    flank_grading : edges grow like cosh from the corner; 0 is uniform. An undercut
        flank has one edge more, and they grow from both of its ends
    fillet_edges : number of edges along the trochoid; that of an undercut tooth has
        more, which grow from the flank
    tooth_size, hub_size : edge lengths inside the tooth and below it, in modules
    body_growth : thickness of a layer deep in the body over its depth
    largest_layer : largest thickness of a layer, in modules
    """

    flank_edges: int = 32
    flank_grading: float = 6.0
    fillet_edges: int = 10
    tooth_size: float = 0.30
    hub_size: float = 1.2
    body_growth: float = 0.15
    largest_layer: float = math.inf

    def refined(self, factor: float) -> MeshSize:
        """Return a size with edges shorter by `factor` (longer if it is below 1)."""
        return MeshSize(
            flank_edges=max(6, round(self.flank_edges * factor)),
            flank_grading=self.flank_grading,
            fillet_edges=max(3, round(self.fillet_edges * factor)),
            tooth_size=self.tooth_size / factor,
            hub_size=self.hub_size / factor,
            body_growth=self.body_growth / factor,
            largest_layer=self.largest_layer / factor,
        )


@dataclass(frozen=True)
class Edges:
    """Named piece of the outline, with nodes at curve parameters (n + 1,)."""

    name: str
    curve: Curve
    parameters: NDArray[np.float64]

    @property
    def vertices(self) -> Points:
        return self.curve(self.parameters)

    @property
    def midpoints(self) -> Points:
        return self.curve(0.5 * (self.parameters[1:] + self.parameters[:-1]))


def flank_arcs(gear: SpurGear, size: MeshSize) -> NDArray[np.float64]:
    """Arc lengths (edges + 1,) of the flank vertices from the tip corner."""
    beta = size.flank_grading
    if gear.is_undercut:
        t = np.linspace(-1.0, 1.0, size.flank_edges + 2)
        part = np.tanh(0.5 * beta * t) / math.tanh(0.5 * beta) if beta > 0.0 else t
        return 0.5 * gear.flank_length * (1.0 + part)
    t = np.linspace(0.0, 1.0, size.flank_edges + 1)
    if beta == 0.0:
        return gear.flank_length * t
    return gear.flank_length * np.sinh(beta * t) / math.sinh(beta)


def _equal_arcs(
    curve: Curve, low: float, high: float, edges: int
) -> NDArray[np.float64]:
    """Parameters that cut a curve into pieces of nearly equal length."""
    dense = np.linspace(low, high, 40 * edges + 1)
    steps = np.hypot(*np.diff(curve(dense), axis=0).T)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    return np.interp(np.linspace(0.0, length[-1], edges + 1), length, dense)


def _graded(length: float, first: float, largest: float) -> NDArray[np.float64]:
    """Positions from 0 to length, steps growing from `first` by at most 1.5."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(1.5 * steps[-1], largest))
    stops = np.concatenate([[0.0], np.cumsum(steps)])
    return stops * (length / stops[-1])


def _fillet_parameters(
    gear: SpurGear, size: MeshSize, fillet: Curve, arcs: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Normal angles, from the steepest on, of the vertices of the fillet.

    At the edge of an undercut the first edge is as long as the last one of the flank:
    a load near it acts on the fillet as it does on the tip land.
    """
    edges = size.fillet_edges
    steepest = gear.form_normal_angle
    if not gear.is_undercut:
        return _equal_arcs(fillet, 0.0, steepest, edges)
    dense = _equal_arcs(fillet, 0.0, steepest, 40 * edges)
    length = float(np.hypot(*np.diff(fillet(dense), axis=0).T).sum())
    stops = _graded(length, float(arcs[-1] - arcs[-2]), length / edges)
    return np.interp(stops, np.linspace(0.0, length, len(dense)), dense)


def half_sector_outline(gear: SpurGear, size: MeshSize) -> list[Edges]:
    """Tip land, flank, fillet and root land, from the tooth axis to the cut."""
    arcs = flank_arcs(gear, size)
    tip_angle = gear.half_angle(gear.tip_radius)
    land = _graded(
        gear.tip_radius * tip_angle, float(arcs[1]), size.tooth_size * gear.module
    )
    to_axis = tip_angle * (1.0 - land[::-1] / land[-1])
    steepest = gear.form_normal_angle

    def flank(arc: NDArray[np.float64]) -> Points:
        return flank_points(gear, roll_length_at_arc(gear, arc))

    def fillet(complement: NDArray[np.float64]) -> Points:
        return fillet_points(gear, steepest - complement)

    outline = [
        Edges("tip", lambda angle: polar(gear.tip_radius, angle), to_axis),
        Edges("flank", flank, arcs),
        Edges("fillet", fillet, _fillet_parameters(gear, size, fillet, arcs)),
    ]
    bottom = fillet_points(gear, 0.0)
    start, cut = angle_of(gear, bottom), 0.5 * gear.pitch_angle
    land_length = gear.root_radius * (cut - start)
    if land_length > 1e-6 * gear.module:
        edge = 2.0 * gear.module / size.fillet_edges
        angles = np.linspace(start, cut, 1 + max(1, math.ceil(land_length / edge)))
        outline.append(
            Edges("root", lambda angle: polar(gear.root_radius, angle), angles)
        )
    return outline


def floor_radius(gear: SpurGear, size: MeshSize) -> float:
    """Radius down to which triangles are unstructured; layers, if any, are below."""
    floor = gear.root_radius - FLOOR_DEPTH * gear.module
    layer = size.hub_size * gear.module
    return floor if floor > gear.hub_radius + layer else gear.hub_radius


def floor_edges(gear: SpurGear, size: MeshSize) -> Edges:
    """Arc at the floor radius from the cut back to the tooth axis."""
    radius, cut = floor_radius(gear, size), 0.5 * gear.pitch_angle
    count = max(1, math.ceil(radius * cut / (size.hub_size * gear.module)))
    angles = np.linspace(cut, 0.0, count + 1)
    return Edges("floor", lambda angle: polar(radius, angle), angles)
