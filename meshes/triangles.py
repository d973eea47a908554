"""Second-order triangles inside chains of short edges, with nodes on true curves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from meshes.outline import Edges
from meshes.profile import Points

Rows = NDArray[np.int64]
Triangles = tuple[Points, Rows, dict[str, Rows]]  # points, triangles, named edges


def draw_point(gmsh: ModuleType, xy: Points, edge: float) -> int:
    """Draw a point and return its tag.

    edge : length of the edges around it [m]
    """
    return int(gmsh.model.geo.addPoint(float(xy[0]), float(xy[1]), 0.0, edge))


def draw_chain(
    gmsh: ModuleType, piece: Edges, first: int | None = None, last: int | None = None
) -> tuple[list[int], int]:
    """Draw straight lines along a piece of an outline; also return its end point.

    first, last : points at its ends that already exist
    """
    geo, vertices = gmsh.model.geo, piece.vertices
    lengths = np.hypot(*np.diff(vertices, axis=0).T)
    point = first or draw_point(gmsh, vertices[0], lengths[0])
    lines = []
    for number, (xy, edge) in enumerate(zip(vertices[1:], lengths, strict=True), 1):
        existing = last if number == len(lengths) else None
        end = existing or draw_point(gmsh, xy, edge)
        lines.append(geo.addLine(point, end))
        geo.mesh.setTransfiniteCurve(lines[-1], 2)
        point = end
    return lines, point


def make_triangles(
    gmsh: ModuleType,
    lines: Mapping[str, list[int]],
    pieces: Iterable[Edges],
    growth: float = 0.0,
    embedded: Mapping[int, list[int]] | None = None,
) -> Triangles:
    """Mesh the surface drawn; mid-side nodes of the pieces lie on their curves.

    lines : straight lines by name, whose edges (k, 3), ends and then mid-side, are
        returned in the direction of the lines
    growth : growth of sizes with the distance from the lines; by default sizes are
        between those of the boundary and of points inside
    embedded : lines inside a surface that triangles follow, by its tag
    """
    gmsh.model.geo.synchronize()
    for surface, inside in (embedded or {}).items():
        gmsh.model.mesh.embed(1, inside, 2, surface)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0 if growth else 1)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0 if growth else 1)
    if growth:
        _grow_sizes(gmsh, [tag for chain in lines.values() for tag in chain], growth)
    gmsh.option.setNumber("Mesh.Algorithm", 6)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    row = np.zeros(int(tags.max()) + 1, np.int64)
    row[tags] = np.arange(len(tags))
    points = np.ascontiguousarray(coordinates.reshape(-1, 3)[:, :2])
    edges = {
        name: np.concatenate([_line_nodes(gmsh, tag, row) for tag in members])
        for name, members in lines.items()
    }
    for piece in pieces:
        points[edges[piece.name][:, 2]] = piece.midpoints
    _, _, nodes = gmsh.model.mesh.getElements(2)
    return points, row[nodes[0]].reshape(-1, 6), edges


def _grow_sizes(gmsh: ModuleType, lines: list[int], growth: float) -> None:
    """Let sizes grow from those of lines with the distance, without limit."""
    low_x, low_y, _, high_x, high_y, _ = gmsh.model.getBoundingBox(-1, -1)
    far = max(high_x - low_x, high_y - low_y)
    field = gmsh.model.mesh.field
    tag = field.add("Extend")
    field.setNumbers(tag, "CurvesList", lines)
    for name, value in (("DistMax", far), ("SizeMax", growth * far), ("Power", 1.0)):
        field.setNumber(tag, name, value)
    field.setAsBackgroundMesh(tag)


def _line_nodes(gmsh: ModuleType, line: int, row: Rows) -> Rows:
    """Edges (k, 3) of one straight gmsh line, in the direction of the line."""
    _, _, nodes = gmsh.model.mesh.getElements(1, line)
    return row[nodes[0]].reshape(-1, 3)
