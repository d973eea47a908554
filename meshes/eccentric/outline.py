"""Boundary of a wheel with its teeth, in the direction of the pitch point's motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.array_types import Array
from meshes.eccentric.base import LEADING, TRAILING, Side
from meshes.eccentric.teeth import ToothedWheel
from meshes.outline import Curve, Edges
from meshes.profile import Points

DENSE = 40  # points of an edge by which its length is measured
BELOW_ROOT = 0.5  # least body around the bore, in modules


@dataclass(frozen=True, kw_only=True)
class WheelEdges:
    """Edges along the outline of a wheel; the interior is graded from them.

    flank, fillet, tip : number of edges of each flank, fillet and tip land
    bore : number of edges around the bore
    growth : growth of edges inside with the distance from the boundary
    """

    flank: int = 16
    fillet: int = 8
    tip: int = 4
    bore: int = 32
    growth: float = 0.3

    def refined(self, factor: float) -> WheelEdges:
        """Return sizes with all edges shorter by `factor`."""
        flank, fillet, tip, bore = (
            max(2, round(count * factor))
            for count in (self.flank, self.fillet, self.tip, self.bore)
        )
        growth = self.growth / factor
        return WheelEdges(flank=flank, fillet=fillet, tip=tip, bore=bore, growth=growth)


def wheel_outline(wheel: ToothedWheel, edges: WheelEdges) -> list[Edges]:
    """Pieces in order around the wheel; names end with the number of the tooth."""
    teeth = range(wheel.teeth)
    return [piece for tooth in teeth for piece in _tooth(wheel, tooth, edges)]


def outline_points(wheel: ToothedWheel, edges: WheelEdges) -> Points:
    """Points (n, 2) of the closed outline, with the first repeated at the end [m]."""
    pieces = [piece.vertices[:-1] for piece in wheel_outline(wheel, edges)]
    return np.vstack([*pieces, pieces[0][:1]])


def flank_edges(outline: list[Edges]) -> dict[Side, NDArray[np.int64]]:
    """Indices (teeth, edges) of the edges on the flank of every tooth, by side."""
    counts = [piece.parameters.size - 1 for piece in outline]
    numbers = np.split(np.arange(sum(counts)), np.cumsum(counts)[:-1])

    def flanks(side: Side) -> NDArray[np.int64]:
        start = f"{_word(side)} flank "
        pieces = zip(outline, numbers, strict=True)
        return np.stack([edges for p, edges in pieces if p.name.startswith(start)])

    return {side: flanks(side) for side in (TRAILING, LEADING)}


def _tooth(wheel: ToothedWheel, tooth: int, edges: WheelEdges) -> Iterator[Edges]:
    rack = wheel.rack
    steepest = 0.5 * math.pi - rack.pressure_angle
    places = {side: float(wheel.place(side)[tooth]) for side in (TRAILING, LEADING)}

    def fillet(side: Side, start: float, end: float) -> Edges:
        place = places[side]

        def curve(angle: Array) -> Points:
            return wheel.fillet(place, angle, side)

        return _even(f"{_word(side)} fillet {tooth}", curve, start, end, edges.fillet)

    def flank(side: Side) -> Edges:
        place, tip = places[side], float(wheel.tips[side][0][tooth])
        form = place + side * rack.form

        def curve(arc: Array) -> Points:
            return wheel.flank(place, arc, side)

        start, end = (form, tip) if side == TRAILING else (tip, form)
        return _even(f"{_word(side)} flank {tooth}", curve, start, end, edges.flank)

    def land(name: str, start: float, end: float, height: float, count: int) -> Edges:
        arcs = np.linspace(start, end, count + 1)
        return Edges(f"{name} {tooth}", lambda arc: wheel.land(arc, height), arcs)

    yield fillet(TRAILING, 0.0, steepest)
    yield flank(TRAILING)
    start, end = (float(wheel.tips[side][1][tooth]) for side in (TRAILING, LEADING))
    yield land("tip", start, end, rack.addendum, edges.tip)
    yield flank(LEADING)
    yield fillet(LEADING, steepest, 0.0)
    start = places[LEADING] + rack.offset
    end = places[TRAILING] - rack.offset + rack.pitch
    if end - start > 1e-6 * rack.module:
        edge = 2.0 * rack.module / edges.fillet
        yield land("root", start, end, -rack.dedendum, math.ceil((end - start) / edge))


def _even(name: str, curve: Curve, start: float, end: float, count: int) -> Edges:
    """Edges of a curve with equal lengths and equal halves. Where a flank begins at its
    base curve, its points hardly move with the parameter."""
    dense = np.linspace(start, end, DENSE * count + 1)
    steps = np.hypot(*np.diff(curve(dense), axis=0).T)
    length = np.concatenate([[0.0], np.cumsum(steps)])

    def by_length(way: Array) -> Points:
        return curve(np.interp(way, length, dense))

    return Edges(name, by_length, np.linspace(0.0, length[-1], count + 1))


def _word(side: Side) -> str:
    return "leading" if side == LEADING else "trailing"
