"""Triangles of a region with cracks: two faces each, and rings around the tips.

A line from the mouth to the rings is embedded in the region and its nodes are doubled
afterwards. Rings of triangles around a tip grow with the distance from it; mid-side
nodes of the innermost ones are at a quarter of their sides, so that displacement is
free to vary as the square root of the distance (Barsoum 1976).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from meshes.crack import along, arc_lengths, graded_stops
from meshes.gmsh_session import gmsh_model
from meshes.profile import Points
from meshes.triangles import Rows, draw_point, make_triangles

SPOKES = 16  # sides from a tip to the first ring
RINGS = 7
RING_GROWTH = 1.45  # radius of a ring over that of the next one inward
SIZE_GROWTH = 0.3  # of edges with their distance from the lines drawn


@dataclass(frozen=True, eq=False)
class CrackTip:
    """Tip of a crack in a mesh.

    Attributes
    ----------
    name : str
        Name of the edges of its faces.
    node : int
        Node at the tip.
    direction : (2,) array
        Unit vector along the crack at its tip, out of the tooth's surface.
    faces : (2, 2) array
        Nodes nearest to the tip of the face to the right of the crack and of that to
        the left, looking along it: at a quarter of the first side, and at its end.
    radius : float
        Radius of the outermost ring [m], within which the crack is straight.
    triangles : (m,) array
        Rows of the triangles within it.
    """

    name: str
    node: int
    direction: Points
    faces: Rows
    radius: float
    triangles: Rows


@dataclass(frozen=True, eq=False)
class CrackLine:
    """Polyline of a crack to be meshed.

    mouth : row of the loop's vertex where it begins
    corners : (n, 2), mouth, bends, tip; radius : of the outermost ring
    edge : length of edges far from the rings [m]
    """

    name: str
    mouth: int
    corners: Points
    radius: float
    edge: float


@dataclass(frozen=True, eq=False)
class CrackedRegion:
    """Mesh of a region with cracks.

    points, triangles : as in `SectorMesh`
    loop : (k, 3) edges of the outline, as they were given
    faces : edges (2 k, 3) of both faces of each crack, clockwise around the body
    """

    points: Points
    triangles: Rows
    loop: Rows
    faces: dict[str, Rows]
    tips: tuple[CrackTip, ...]


def mesh_cracked_region(
    vertices: Points, midpoints: Points, cracks: Sequence[CrackLine]
) -> CrackedRegion:
    """Mesh what a closed counterclockwise loop of short edges encloses.

    Parameters
    ----------
    vertices, midpoints : (k, 2) array
        Ends of the edges, and their mid-sides, which follow them.
    cracks : sequence of CrackLine
        Cracks from vertices of the loop.
    """
    with gmsh_model("cracked") as gmsh:
        points, triangles, edges = _draw(gmsh, vertices, cracks)
    loop = edges["loop"]
    points[loop[:, 2]] = midpoints
    triangles = _counterclockwise(points, triangles)
    faces, tips = {}, []
    for number, crack in enumerate(cracks):
        line, ring = edges[f"line {number}"], edges[f"ring {number}"]
        points, triangles, loop, other = _split(points, triangles, loop, line)
        points, triangles, tip = _add_rings(points, triangles, crack, ring, other)
        inner, outer = _spoke_edges(tip.spokes)
        right, left = np.vstack([line, inner]), np.vstack([other, outer])
        # the body is to the right of what runs clockwise around it
        faces[crack.name] = np.vstack([right, left[:, [1, 0, 2]]])
        tips.append(tip.tip)
    return CrackedRegion(points, triangles, loop, faces, tuple(tips))


def _draw(
    gmsh: ModuleType, vertices: Points, cracks: Sequence[CrackLine]
) -> tuple[Points, Rows, dict[str, Rows]]:
    """Triangles between the loop and the outermost rings, still without faces."""
    geo = gmsh.model.geo
    lengths = np.hypot(*(np.roll(vertices, -1, axis=0) - vertices).T)
    sizes = 0.5 * (lengths + np.roll(lengths, 1))
    tags = [
        draw_point(gmsh, xy, size) for xy, size in zip(vertices, sizes, strict=True)
    ]
    lines = {"loop": _join(gmsh, [*tags, tags[0]])}
    loops, embedded = [geo.addCurveLoop(lines["loop"])], []
    for number, crack in enumerate(cracks):
        ring_points = _ring_points(crack)
        edge = float(np.hypot(*(ring_points[1] - ring_points[0])))
        ring = [draw_point(gmsh, xy, edge) for xy in ring_points]
        lines[f"ring {number}"] = _join(gmsh, [*ring, ring[0]])
        loops.append(geo.addCurveLoop(lines[f"ring {number}"]))
        stations, around = _line_stations(crack, edge, sizes[crack.mouth])
        between = zip(stations[1:-1], around[1:-1], strict=True)
        chain = [draw_point(gmsh, xy, size) for xy, size in between]
        lines[f"line {number}"] = _join(gmsh, [tags[crack.mouth], *chain, ring[0]])
        embedded += lines[f"line {number}"]
    surface = geo.addPlaneSurface(loops)
    return make_triangles(gmsh, lines, (), SIZE_GROWTH, {surface: embedded})


def _join(gmsh: ModuleType, tags: Sequence[int]) -> list[int]:
    """Lines of one edge between points."""
    lines = [gmsh.model.geo.addLine(a, b) for a, b in pairwise(tags)]
    for line in lines:
        gmsh.model.geo.mesh.setTransfiniteCurve(line, 2)
    return lines


def _direction(crack: CrackLine) -> Points:
    last = crack.corners[-1] - crack.corners[-2]
    return np.asarray(last / np.hypot(*last))


def _ring_points(crack: CrackLine, radius: float | None = None) -> Points:
    """Points (SPOKES + 1, 2) of a ring, from one face counterclockwise to the other.

    Without a radius those of the outermost ring, the first of which is not repeated.
    """
    angles = np.linspace(-math.pi, math.pi, SPOKES + 1)
    ahead = _direction(crack)
    side = np.array([-ahead[1], ahead[0]])
    unit = np.cos(angles)[:, None] * ahead + np.sin(angles)[:, None] * side
    unit[[0, -1]] = -ahead
    points = crack.corners[-1] + (crack.radius if radius is None else radius) * unit
    return points[:-1] if radius is None else points


def _line_stations(
    crack: CrackLine, ring_edge: float, mouth_edge: float
) -> tuple[Points, NDArray[np.float64]]:
    """Points from the mouth to the outermost ring, and lengths of edges around them."""
    stops = arc_lengths(crack.corners)
    length = stops[-1] - crack.radius

    def size(position: NDArray[np.float64]) -> NDArray[np.float64]:
        near_ends = np.minimum(
            mouth_edge + 0.4 * position, ring_edge + 0.4 * (length - position)
        )
        return np.minimum(near_ends, crack.edge)

    ends = [0.0, *stops[1:-1], length]  # bends are nodes
    positions = np.zeros(1)
    for start, end in pairwise(ends):
        stops = graded_stops(end - start, lambda x, s=start: size(x + s))  # type: ignore[misc]
        positions = np.append(positions, start + stops[1:])
    return along(crack.corners, positions), size(positions)


def _counterclockwise(points: Points, triangles: Rows) -> Rows:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    turned = triangles[:, [0, 2, 1, 5, 4, 3]]
    return np.where((area > 0.0)[:, None], triangles, turned)


def _split(
    points: Points, triangles: Rows, loop: Rows, line: Rows
) -> tuple[Points, Rows, Rows, Rows]:
    """Double the nodes of a line: triangles to its left get their own.

    line : (k, 3) edges from the mouth to the outermost ring
    Also returns the edges of the left face.
    """
    nodes = np.append(np.unique(line[:, :2]), line[:, 2])
    twin = np.arange(len(points))
    twin[nodes] = len(points) + np.arange(len(nodes))
    ahead = {(int(a), int(b)) for a, b, _ in line}
    on_line = np.isin(triangles[:, :3], nodes).any(axis=1)
    is_left = np.zeros(len(triangles), bool)
    is_left[_left_triangles(triangles, np.flatnonzero(on_line), nodes, ahead)] = True
    triangles = np.where(is_left[:, None], twin[triangles], triangles)
    # the edge of the outline that leaves the mouth belongs to one of the faces
    of_triangles = {
        frozenset((int(a), int(b)))
        for row in triangles[on_line, :3]
        for a, b in zip(row, np.roll(row, -1), strict=True)
    }
    moved = twin[loop]
    sides = [frozenset((int(a), int(b))) for a, b in moved[:, :2]]
    belongs = np.array([side in of_triangles for side in sides])
    touches = np.isin(loop[:, :2], nodes).any(axis=1)
    loop = np.where((touches & belongs)[:, None], moved, loop)
    return np.vstack([points, points[nodes]]), triangles, loop, twin[line]


def _left_triangles(
    triangles: Rows, rows: Rows, nodes: Rows, ahead: set[tuple[int, int]]
) -> list[int]:
    """Triangles to the left of a line among those that touch it.

    They follow a directed edge of it, or share a side that ends on it with one.
    """
    touched = set(nodes.tolist())
    sides: dict[tuple[int, int], int] = {}
    for row in rows.tolist():
        a, b, c = triangles[row, :3].tolist()
        sides |= {(a, b): row, (b, c): row, (c, a): row}
    front = [row for side, row in sides.items() if side in ahead]
    left = set(front)
    while front:
        a, b, c = triangles[front.pop(), :3].tolist()
        for p, q in ((a, b), (b, c), (c, a)):
            neighbour = sides.get((q, p))
            crosses = (p, q) in ahead or (q, p) in ahead
            if neighbour is None or crosses or not {p, q} & touched:
                continue
            if neighbour not in left:
                left.add(neighbour)
                front.append(neighbour)
    return sorted(left)


@dataclass(frozen=True, eq=False)
class _Rings:
    """Tip, and nodes (2, 2 RINGS + 1) along both faces from the outermost ring."""

    tip: CrackTip
    spokes: Rows


def _add_rings(
    points: Points, triangles: Rows, crack: CrackLine, ring: Rows, other: Rows
) -> tuple[Points, Rows, _Rings]:
    """Fill the outermost ring, whose edges are `ring`, around the tip of a crack.

    other : edges of the left face as far as the ring
    """
    radii = crack.radius * RING_GROWTH ** -np.arange(RINGS, dtype=float)
    angles = 2 * SPOKES + 1
    # ring nodes at full and half spokes, and between rings; the tip is the last node
    middle = 0.5 * (radii[:-1] + radii[1:])
    levels = np.append(np.stack([radii[:-1], middle], axis=1).ravel(), radii[-1])
    fine = np.empty((len(levels), angles, 2))
    for level, radius in zip(fine, levels, strict=True):
        level[::2] = _ring_points(crack, radius)
        level[1::2] = 0.5 * (level[:-1:2] + level[2::2])
    # of diagonals, whose ends are a corner of one ring and the next one of the other
    half = SPOKES
    rising = 0.5 * (fine[:-1:2, 2 : half + 1 : 2] + fine[2::2, : half - 1 : 2])
    falling = 0.5 * (fine[:-1:2, half:-1:2] + fine[2::2, half + 2 :: 2])
    fine[1::2, 1::2] = np.concatenate([rising, falling], axis=1)
    tip_xy = crack.corners[-1]
    quarter = tip_xy + 0.25 * (fine[-1, ::2] - tip_xy)
    at = len(points) + np.arange(len(levels) * angles).reshape(len(levels), angles)
    outer = np.append(np.stack([ring[:, 0], ring[:, 2]], axis=1).ravel(), other[-1, 1])
    at = np.vstack([outer, at[1:] - angles])
    first = len(points) + (len(levels) - 1) * angles
    quarters, tip = first + np.arange(SPOKES + 1), first + SPOKES + 1
    added = [fine[1:].reshape(-1, 2), quarter, tip_xy[None]]
    cells = _ring_cells(at, quarters, tip)
    rows = len(triangles) + np.arange(len(cells))
    spokes = np.stack(
        [np.append(at[:, j], [quarters[k], tip]) for j, k in ((0, 0), (-1, -1))]
    )
    crack_tip = CrackTip(
        crack.name,
        int(tip),
        _direction(crack),
        spokes[:, [-2, -3]],
        crack.radius,
        rows,
    )
    return (
        np.vstack([points, *added]),
        np.vstack([triangles, cells]),
        _Rings(crack_tip, spokes),
    )


def _ring_cells(at: Rows, quarters: Rows, tip: int) -> Rows:
    """Counterclockwise triangles of rings, and of the fan around the tip.

    at : (2 rings - 1, 2 SPOKES + 1) nodes from the outermost ring inward
    """
    cells = []
    for i in range(0, len(at) - 1, 2):  # i outside, i + 2 inside
        for j in range(0, 2 * SPOKES, 2):
            a, b = at[i, j], at[i, j + 2]
            c, d = at[i + 2, j + 2], at[i + 2, j]
            ab, bc, cd, da = (
                at[i, j + 1],
                at[i + 1, j + 2],
                at[i + 2, j + 1],
                at[i + 1, j],
            )
            middle = at[i + 1, j + 1]
            if j < SPOKES:  # diagonals are mirror images at the crack
                cells += [[a, b, d, ab, middle, da], [b, c, d, bc, cd, middle]]
            else:
                cells += [[a, b, c, ab, bc, middle], [a, c, d, middle, cd, da]]
    for k in range(SPOKES):
        a, b = at[-1, 2 * k], at[-1, 2 * k + 2]
        cells.append([a, b, tip, at[-1, 2 * k + 1], quarters[k + 1], quarters[k]])
    return np.array(cells)


def _spoke_edges(spokes: Rows) -> tuple[Rows, Rows]:
    """Edges (RINGS, 3) of the two faces within the rings, toward the tip."""
    right, left = (
        np.stack([face[:-2:2], face[2::2], face[1::2]], axis=1) for face in spokes
    )
    return right, left
