"""Line integrals over the boundary of a body, by Gauss quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fegear.elasticity.sector import CyclicSector

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class BoundaryQuadrature:
    """Gauss points on boundary edges.

    operator : (n, 2 q) from tractions at the points, with the component running
        slowest, to nodal loads
    points, normals : (q, 2), outward unit normals
    """

    operator: csr_array
    points: Array
    normals: Array


def boundary_quadrature(sector: CyclicSector, names: list[str]) -> BoundaryQuadrature:
    """Quadrature on every edge of the named boundaries of a sector."""
    edges = []
    for name in names:
        edge_nodes = sector.mesh.edges[name]
        # the right half's outline runs clockwise, its mirror image the other way
        edges.append(
            edge_nodes[:, [1, 0, 2]] if name.startswith("left_") else edge_nodes
        )
    return edge_quadrature(
        sector.mesh.points, np.vstack(edges), sector.node_freedoms, sector.basis.N
    )


def edge_quadrature(
    points: Array, edges: Indices, freedoms: Indices, size: int, count: int = 8
) -> BoundaryQuadrature:
    """Quadrature with `count` points on every edge (k, 3), ends and then mid-side, that
    runs clockwise around the body.

    points : (n, 2) of the mesh nodes; freedoms : (n, 2) of `size`, -1 at mid-sides
        where elements are linear
    """
    # Not scikit-fem's FacetBasis: its inverse mapping cannot reach its own
    # tolerance on the smallest edges, 1e-4 of their distance from the origin.
    xi, weight = np.polynomial.legendre.leggauss(count)
    shape = np.stack([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi**2])
    slope = np.stack([xi - 0.5, xi + 0.5, -2.0 * xi])
    nodes = points[edges]  # (edges, 3, 2)
    places = np.einsum("eac,aq->eqc", nodes, shape).reshape(-1, 2)
    along = np.einsum("eac,aq->eqc", nodes, slope)
    scale = np.hypot(along[..., 0], along[..., 1])
    normals = np.stack([-along[..., 1], along[..., 0]], axis=-1) / scale[..., None]
    if freedoms[edges[0, 2], 0] < 0:
        shape = np.stack([0.5 * (1.0 - xi), 0.5 * (1.0 + xi)])
        edges = edges[:, :2]
    values = shape[None] * (scale * weight)[:, None, :]  # (edges, nodes, q)
    place = np.arange(len(places)).reshape(len(edges), 1, count)
    place = np.stack([place, place + len(places)])  # of x, then of y
    rows = np.moveaxis(freedoms[edges], 2, 0)[..., None]
    rows, columns, entries = np.broadcast_arrays(rows, place, values)
    operator = csr_array(
        (entries.ravel(), (rows.ravel(), columns.ravel())), shape=(size, places.size)
    )
    return BoundaryQuadrature(operator, places, normals.reshape(-1, 2))
