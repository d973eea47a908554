"""Second-order triangle mesh of one tooth sector, with nodes on the true curves.

The right half is meshed by gmsh and mirrored: the two cuts then match node by
node when the sector is repeated around the gear, and the mesh has the symmetry
of the tooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from meshes.cracked_region import CrackTip
from meshes.gear import SpurGear
from meshes.gmsh_session import gmsh_model
from meshes.layers import body_layers, layer_radii
from meshes.outline import (
    Edges,
    MeshSize,
    floor_edges,
    floor_radius,
    half_sector_outline,
)
from meshes.profile import Points, polar
from meshes.triangles import Rows, Triangles, draw_chain, draw_point, make_triangles

__all__ = ["MeshSize", "SectorMesh", "sector_mesh"]


@dataclass(frozen=True)
class SectorMesh:
    """One tooth with its share of the body, with the tooth axis along y.

    points : (n, 2) [m]
    triangles : (m, 6) counterclockwise corners, then mid-sides of edges 01, 12, 20
    edges : (k, 3) ends, then mid-side, by boundary name on the right half; names
        with `left_` are the mirror images
    flank_nodes : (edges + 1,) vertices of the right flank, from the tip
        corner to the form circle
    flank_arcs : arc lengths of these vertices from the corner [m]
    tips : of cracks, whose faces are the edges `crack` of a crack at the right fillet
        and `left_crack` of one at the left fillet
    """

    points: Points
    triangles: Rows
    edges: dict[str, Rows]
    flank_nodes: Rows
    flank_arcs: NDArray[np.float64]
    tips: tuple[CrackTip, ...] = ()


def sector_mesh(gear: SpurGear, size: MeshSize | None = None) -> SectorMesh:
    """Mesh one sector of `gear`."""
    size = size or MeshSize()
    outline = [*half_sector_outline(gear, size), floor_edges(gear, size)]
    with gmsh_model("sector") as gmsh:
        half = _half_mesh(gmsh, gear, size, outline)
    half = _down_to_hub(gear, size, half)
    points, triangles, edges = _mirrored(*half)
    flank = edges["flank"]
    order = np.concatenate([flank[:, 0], flank[-1:, 1]])
    arcs = next(piece for piece in outline if piece.name == "flank").parameters
    return SectorMesh(points, triangles, edges, order, arcs)


def _half_mesh(
    gmsh: ModuleType, gear: SpurGear, size: MeshSize, outline: list[Edges]
) -> Triangles:
    """Triangles inside a closed chain of straight lines."""
    geo, module = gmsh.model.geo, gear.module
    *profile, floor = outline
    lines: dict[str, list[int]] = {}
    top = end = draw_point(gmsh, profile[0].vertices[0], size.tooth_size * module)
    for piece in profile:
        lines[piece.name], end = draw_chain(gmsh, piece, end)
    floor_start = draw_point(gmsh, floor.vertices[0], size.hub_size * module)
    lines["cut"] = [geo.addLine(end, floor_start)]
    lines["floor"], floor_end = draw_chain(gmsh, floor, floor_start)
    foot = polar(gear.root_radius - 0.2 * module, 0.0)
    middle = draw_point(gmsh, foot, 1.5 * size.tooth_size * module)
    lines["axis"] = [geo.addLine(floor_end, middle), geo.addLine(middle, top)]
    loop = geo.addCurveLoop([line for piece in lines.values() for line in piece])
    geo.addPlaneSurface([loop])
    return make_triangles(gmsh, lines, outline)


def _down_to_hub(gear: SpurGear, size: MeshSize, half: Triangles) -> Triangles:
    """Join the layers below the floor to the half sector."""
    points, triangles, edges = half
    floor = edges.pop("floor")
    radii = layer_radii(gear, size, floor_radius(gear, size))  # not from rounded points
    if len(radii) == 1:
        return points, triangles, edges | {"hub": floor}
    row = np.append(floor[:, [0, 2]].ravel(), floor[-1, 1])
    below, cells, lines = body_layers(len(floor), 0.5 * gear.pitch_angle, radii)
    place = np.arange(len(below)) + len(points) - len(row)
    place[: len(row)] = row
    for name, nodes in lines.items():
        both = [edges[name]] if name in edges else []
        edges[name] = np.concatenate([*both, place[nodes]])
    points = np.vstack([points, below[len(row) :]])
    return points, np.vstack([triangles, place[cells]]), edges


def _mirrored(points: Points, triangles: Rows, edges: dict[str, Rows]) -> Triangles:
    """Join the half sector to its mirror image along the tooth axis."""
    on_axis = np.zeros(len(points), bool)
    on_axis[edges["axis"]] = True
    points[on_axis, 0] = 0.0
    twin = np.where(on_axis, np.arange(len(points)), -1)
    twin[~on_axis] = len(points) + np.arange(np.count_nonzero(~on_axis))
    left = points[~on_axis] * [-1.0, 1.0]
    # gmsh follows the outline, clockwise; reversed triangles are counterclockwise
    turned = triangles[:, [0, 2, 1, 5, 4, 3]]
    both = {name: nodes for name, nodes in edges.items() if name != "axis"}
    both |= {f"left_{name}": twin[nodes] for name, nodes in both.items()}
    return np.vstack([points, left]), np.vstack([turned, twin[triangles]]), both
