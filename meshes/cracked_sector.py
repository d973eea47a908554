"""Mesh of a sector whose tooth is cracked, which fits its healthy neighbours.

Layers of the body, cuts, hub, flanks and tip are those of the healthy sector node by
node. What is above the layers is meshed as a whole, around the cracks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.crack import (
    Crack,
    arc_lengths,
    crack_points,
    distance_to,
    graded_stops,
    mouth_normal_angle,
    require_separate,
    sector_pieces,
)
from meshes.cracked_region import (
    CrackedRegion,
    CrackLine,
    CrackTip,
    mesh_cracked_region,
)
from meshes.gear import SpurGear
from meshes.layers import layer_radii
from meshes.outline import Edges, MeshSize, floor_edges, floor_radius
from meshes.outline import half_sector_outline as outline_of
from meshes.profile import Points
from meshes.sector import SectorMesh, sector_mesh
from meshes.triangles import Rows

MAX_RING_RADIUS = 0.4  # of the outermost ring, per depth of the crack and in modules
MOUTH_EDGE = 0.2  # length of edges at the mouth, per depth of the crack
EDGE_GROWTH = 0.4  # of their length with the distance from the mouth


def cracked_sector_mesh(
    gear: SpurGear, size: MeshSize | None, cracks: Sequence[Crack]
) -> SectorMesh:
    """Mesh the sector of a tooth with a crack at one fillet or at both.

    Parameters
    ----------
    gear : SpurGear
        Gear whose tooth is cracked.
    size : MeshSize, optional
        Size of elements, as of `sector_mesh`; also that of the rings around the tips.
    cracks : sequence of Crack
        At most one at each fillet.

    Returns
    -------
    SectorMesh
        Mesh with edges `crack` or `left_crack`, both faces, and with tips.

    Raises
    ------
    ValueError
        If a crack leaves the tooth or its sector; see `crack_points`.
    """
    size = size or MeshSize()
    require_separate(gear, cracks)
    crack_corners = {_fillet_name(crack): crack_points(gear, crack) for crack in cracks}
    healthy_mesh = sector_mesh(gear, size)
    is_in_layers = _layer_triangles(gear, size, healthy_mesh)
    outline = _RemeshedOutline.around(healthy_mesh, ~is_in_layers)
    for crack in cracks:
        name = _fillet_name(crack)
        outline = outline.with_mouth(
            name, *_fillet_nodes(gear, size, crack, crack_corners[name])
        )
    lines = [
        CrackLine(
            name.replace("fillet", "crack"),
            outline.mouths[name],
            path,
            _ring_radius(gear, size, path),
            size.tooth_size * gear.module,
        )
        for name, path in crack_corners.items()
    ]
    region = mesh_cracked_region(outline.vertices, outline.midpoints, lines)
    return _join_layers_and_region(healthy_mesh, is_in_layers, outline, region)


def _fillet_name(crack: Crack) -> str:
    return "left_fillet" if crack.left else "fillet"


def _layer_triangles(
    gear: SpurGear, size: MeshSize, healthy: SectorMesh
) -> NDArray[np.bool_]:
    """Which triangles of a healthy sector are in its layers, the last of each half."""
    layers = len(layer_radii(gear, size, floor_radius(gear, size))) - 1
    layer_count = 2 * layers * (len(floor_edges(gear, size).parameters) - 1)
    half_count = len(healthy.triangles) // 2
    return np.arange(len(healthy.triangles)) % half_count >= half_count - layer_count


@dataclass(frozen=True, eq=False)
class _RemeshedOutline:
    """Counterclockwise outline of what is meshed anew.

    vertices, midpoints : (k, 2)
    nodes : (k, 2) of the healthy mesh, vertex and mid-side; -1 where there is none
    names : (k,) of edges on fillets that were divided anew
    mouths : rows of vertices by name of the fillet
    """

    vertices: Points
    midpoints: Points
    nodes: Rows
    names: tuple[str, ...]
    mouths: dict[str, int]
    fillets: dict[str, Rows]

    @classmethod
    def around(
        cls, mesh: SectorMesh, is_remeshed: NDArray[np.bool_]
    ) -> _RemeshedOutline:
        cells = mesh.triangles[is_remeshed]
        sides = np.concatenate(
            [cells[:, [0, 1, 3]], cells[:, [1, 2, 4]], cells[:, [2, 0, 5]]]
        )
        _, first_rows, count = np.unique(
            np.sort(sides[:, :2], axis=1), axis=0, return_index=True, return_counts=True
        )
        next_nodes = {
            int(a): (int(b), int(m)) for a, b, m in sides[first_rows[count == 1]]
        }
        start = int(mesh.flank_nodes[0])
        nodes: list[tuple[int, int]] = []
        node = start
        while not nodes or node != start:
            node_after, middle = next_nodes[node]
            nodes.append((node, middle))
            node = node_after
        rows = np.array(nodes)
        fillets = {n: mesh.edges[n] for n in ("fillet", "left_fillet")}
        return cls(
            mesh.points[rows[:, 0]],
            mesh.points[rows[:, 1]],
            rows,
            ("",) * len(rows),
            {},
            fillets,
        )

    def with_mouth(
        self, name: str, vertices: Points, midpoints: Points, mouth: int
    ) -> _RemeshedOutline:
        """Replace the edges of a fillet, by others in counterclockwise order.

        vertices : (m + 1, 2), the ends included; mouth : row of one of them
        """
        is_on_fillet = np.isin(self.nodes[:, 1], self.fillets[name][:, 2])
        (rows,) = np.nonzero(is_on_fillet)
        first, last = int(rows[0]), int(rows[-1]) + 1
        m = len(midpoints)
        added_nodes = np.full((m, 2), -1)
        added_nodes[0, 0] = self.nodes[first, 0]
        mouths = {
            n: r + (m - last + first) * (r > first) for n, r in self.mouths.items()
        }
        return _RemeshedOutline(
            np.concatenate(
                [self.vertices[: first + 1], vertices[1:-1], self.vertices[last:]]
            ),
            np.concatenate([self.midpoints[:first], midpoints, self.midpoints[last:]]),
            np.concatenate([self.nodes[:first], added_nodes, self.nodes[last:]]),
            (*self.names[:first], *(name,) * m, *self.names[last:]),
            mouths | {name: first + mouth},
            self.fillets,
        )


def _fillet_nodes(
    gear: SpurGear, size: MeshSize, crack: Crack, corners: Points
) -> tuple[Points, Points, int]:
    """Vertices and mid-sides of a fillet with a mouth, counterclockwise; its row."""
    piece = next(p for p in outline_of(gear, size) if p.name == "fillet")
    right_crack = crack.mirrored if crack.left else crack
    at_mouth = gear.form_normal_angle - mouth_normal_angle(gear, right_crack)
    fillet_parameters = piece.parameters
    dense_parameters = np.linspace(fillet_parameters[0], fillet_parameters[-1], 4001)
    lengths = arc_lengths(piece.curve(dense_parameters))
    mouth_arc = float(np.interp(at_mouth, dense_parameters, lengths))
    edge_arcs = np.interp(fillet_parameters, dense_parameters, lengths)

    def edge_length(arc: NDArray[np.float64]) -> NDArray[np.float64]:
        row = np.clip(np.searchsorted(edge_arcs, arc) - 1, 0, len(edge_arcs) - 2)
        length_near_mouth = MOUTH_EDGE * crack.depth + EDGE_GROWTH * np.abs(
            arc - mouth_arc
        )
        return np.minimum(np.diff(edge_arcs)[row], length_near_mouth)

    arcs_above = (
        mouth_arc - graded_stops(mouth_arc, lambda x: edge_length(mouth_arc - x))[::-1]
    )
    arcs_below = mouth_arc + graded_stops(
        float(lengths[-1]) - mouth_arc, lambda x: edge_length(mouth_arc + x)
    )
    arcs = np.concatenate([arcs_above, arcs_below[1:]])
    parameters = np.interp(arcs, lengths, dense_parameters)
    parameters[[0, -1]] = fillet_parameters[[0, -1]]
    parameters[len(arcs_above) - 1] = at_mouth
    divided_edges = Edges("fillet", piece.curve, parameters)
    vertices, midpoints, mouth = (
        divided_edges.vertices,
        divided_edges.midpoints,
        len(arcs_above) - 1,
    )
    vertices[mouth] = corners[0] * ([-1.0, 1.0] if crack.left else [1.0, 1.0])
    if crack.left:
        return vertices * [-1.0, 1.0], midpoints * [-1.0, 1.0], mouth
    return vertices[::-1], midpoints[::-1], len(vertices) - 1 - mouth


def _ring_radius(gear: SpurGear, size: MeshSize, corners: Points) -> float:
    """Radius of the outermost ring around a tip, clear of outline and bends."""
    length = float(arc_lengths(corners)[-1])
    radius = min(MAX_RING_RADIUS, size.tooth_size) * min(length, gear.module)
    last_length = float(np.hypot(*(corners[-1] - corners[-2])))
    pieces = sector_pieces(gear).values()
    clear_distance = min(float(distance_to(corners[-1:], piece)[0]) for piece in pieces)
    return min(radius, 0.5 * clear_distance, 0.9 * last_length)


def _join_layers_and_region(
    healthy: SectorMesh,
    is_in_layers: NDArray[np.bool_],
    outline: _RemeshedOutline,
    region: CrackedRegion,
) -> SectorMesh:
    """One mesh of the layers of a healthy sector and of a region with cracks."""
    points, new_row = [region.points], np.full(len(healthy.points), -1)
    for column in range(2):
        healthy_node = outline.nodes[:, column]
        exists = healthy_node >= 0
        new_row[healthy_node[exists]] = region.loop[exists, 2 * column]
    layer_nodes = np.setdiff1d(
        healthy.triangles[is_in_layers], np.flatnonzero(new_row >= 0)
    )
    new_row[layer_nodes] = len(region.points) + np.arange(len(layer_nodes))
    points.append(healthy.points[layer_nodes])
    cells = new_row[healthy.triangles[is_in_layers]]
    edges = {
        name: new_row[nodes]
        for name, nodes in healthy.edges.items()
        if name not in outline.mouths
    }
    for name in outline.mouths:
        # right fillets run clockwise and left ones are their mirror images
        mouth_chain = region.loop[[n == name for n in outline.names]]
        edges[name] = (
            mouth_chain if name.startswith("left_") else mouth_chain[::-1, [1, 0, 2]]
        )
    for name, faces in region.faces.items():
        edges[name] = faces[:, [1, 0, 2]] if name.startswith("left_") else faces
    tips: tuple[CrackTip, ...] = region.tips
    return SectorMesh(
        np.vstack(points),
        np.vstack([region.triangles, cells]),
        edges,
        new_row[healthy.flank_nodes],
        healthy.flank_arcs,
        tips,
    )
