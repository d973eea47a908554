"""Line integrals over the boundary of a sector, by Gauss quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fegear.elasticity.sector import CyclicSector

Array = NDArray[np.float64]


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


def boundary_quadrature(
    sector: CyclicSector, names: list[str], count: int = 8
) -> BoundaryQuadrature:
    """Quadrature with `count` points on every edge of the named boundaries."""
    # Not scikit-fem's FacetBasis: its inverse mapping cannot reach its own
    # tolerance on the smallest edges, 1e-4 of their distance from the origin.
    edges = np.vstack([sector.mesh.edges[name] for name in names])
    xi, weight = np.polynomial.legendre.leggauss(count)
    shape = np.stack([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi**2])
    slope = np.stack([xi - 0.5, xi + 0.5, -2.0 * xi])
    nodes = sector.mesh.points[edges]  # (edges, 3, 2)
    points = np.einsum("eac,aq->eqc", nodes, shape).reshape(-1, 2)
    along = np.einsum("eac,aq->eqc", nodes, slope)
    scale = np.hypot(along[..., 0], along[..., 1])
    # the right half's outline runs clockwise, its mirror image the other way
    left = [np.full(len(sector.mesh.edges[n]), n.startswith("left_")) for n in names]
    sign = np.where(np.concatenate(left), -1.0, 1.0)[:, None]
    normals = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    normals = normals * (sign / scale)[..., None]
    if sector.order == 1:
        shape = np.stack([0.5 * (1.0 - xi), 0.5 * (1.0 + xi)])
        edges = edges[:, :2]
    values = shape[None] * (scale * weight)[:, None, :]  # (edges, nodes, q)
    place = np.arange(len(points)).reshape(len(edges), 1, count)
    place = np.stack([place, place + len(points)])  # of x, then of y
    freedoms = np.moveaxis(sector.node_freedoms[edges], 2, 0)[..., None]
    rows, columns, entries = np.broadcast_arrays(freedoms, place, values)
    operator = csr_array(
        (entries.ravel(), (rows.ravel(), columns.ravel())),
        shape=(sector.basis.N, 2 * len(points)),
    )
    return BoundaryQuadrature(operator, points, normals.reshape(-1, 2))
