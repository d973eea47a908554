"""Second-order triangle mesh of a whole wheel, with nodes on the true curves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.eccentric.base import Side
from meshes.eccentric.outline import (
    BELOW_ROOT,
    WheelEdges,
    flank_edges,
    wheel_outline,
)
from meshes.eccentric.teeth import ToothedWheel
from meshes.gear import GeometryError, apart_from, floored
from meshes.gmsh_session import gmsh_model
from meshes.outline import Edges
from meshes.profile import Points
from meshes.triangles import Rows, draw_chain, draw_point, make_triangles

SAMPLES = 720  # samples of the root curve
BORE = 0.4  # default bore over the least distance from the bearing to the root
BORE_NAME = "bore"


@dataclass(frozen=True, eq=False)
class WheelMesh:
    """Mesh of a wheel in its own frame, with the origin in its bearing.

    points : (n, 2) [m]
    triangles : (m, 6) corners, then mid-sides of edges 01, 12, 20, counterclockwise
    outline : (k, 3) ends, then mid-side, of successive edges clockwise around the teeth
    bore : (k, 3) ends, then mid-side, of edges around the bore, in any order
    flanks : (teeth, edges) rows of the outline on the flank of every tooth, by side
    """

    points: Points
    triangles: Rows
    outline: Rows
    bore: Rows
    flanks: Mapping[Side, Rows]


def largest_bore(wheel: ToothedWheel) -> float:
    """Largest bore radius with some body below the teeth [m]; negative if none has."""
    arcs = wheel.curve.length * np.arange(SAMPLES) / SAMPLES
    root = wheel.land(arcs, -wheel.rack.dedendum)
    return float(np.hypot(*root.T).min()) - BELOW_ROOT * wheel.rack.module


def default_bore(wheel: ToothedWheel) -> float:
    return BORE * largest_bore(wheel)


def wheel_mesh(
    wheel: ToothedWheel, bore: float, edges: WheelEdges | None = None
) -> WheelMesh:
    """Mesh a wheel with a bore of a radius [m].

    Raises GeometryError if the bore does not fit.
    """
    edges, module = edges or WheelEdges(), wheel.rack.module
    largest = largest_bore(wheel)
    if not 0.0 < bore <= largest:
        most = floored(1e3 * largest)
        raise GeometryError(
            "bore",
            f"{apart_from(1e3 * bore, '0', most)} mm; must be above 0, at most {most} "
            "mm, half a module below the roots",
        )
    outline, hole = wheel_outline(wheel, edges), _circle(bore, edges.bore)
    with gmsh_model("wheel") as gmsh:
        lines: dict[str, list[int]] = {}
        start = end = draw_point(gmsh, outline[0].vertices[0], module / edges.fillet)
        for number, piece in enumerate(outline, 1):
            last = start if number == len(outline) else None
            lines[piece.name], end = draw_chain(gmsh, piece, end, last)
        around = gmsh.model.geo.addCurveLoop(
            [i for tags in lines.values() for i in tags]
        )
        first = draw_point(gmsh, hole.vertices[0], module)
        lines[BORE_NAME], _ = draw_chain(gmsh, hole, first, first)
        inside = gmsh.model.geo.addCurveLoop(lines[BORE_NAME])
        gmsh.model.geo.addPlaneSurface([around, inside])
        pieces = [*outline, hole]
        points, triangles, boundaries = make_triangles(
            gmsh, lines, pieces, edges.growth
        )
    bored = boundaries.pop(BORE_NAME)
    teeth = np.concatenate(list(boundaries.values()))
    flanks = flank_edges(outline)
    if _area(points[teeth[:, 0]]) > 0.0:  # counterclockwise
        teeth = teeth[::-1, [1, 0, 2]]
        flanks = {side: len(teeth) - 1 - rows[:, ::-1] for side, rows in flanks.items()}
    return WheelMesh(points, _counterclockwise(points, triangles), teeth, bored, flanks)


def _circle(radius: float, count: int) -> Edges:
    angles = np.linspace(0.0, 2.0 * math.pi, count + 1)

    def curve(angle: NDArray[np.float64]) -> Points:
        return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    return Edges(BORE_NAME, curve, angles)


def _area(polygon: Points) -> float:
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _counterclockwise(points: Points, triangles: Rows) -> Rows:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    one, two = b - a, c - a
    turned = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0] < 0.0
    return np.where(turned[:, None], triangles[:, [0, 2, 1, 5, 4, 3]], triangles)
