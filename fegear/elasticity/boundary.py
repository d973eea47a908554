"""Line integrals over the boundary of a body, by Gauss quadrature; springs on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import block_array, csr_array, diags_array

from lumped.common.array_types import Array, Indices


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


def edge_quadrature(
    points: Array, edges: Indices, dofs: Indices, n_dofs: int, count: int = 8
) -> BoundaryQuadrature:
    """Gauss quadrature with `count` points on quadratic edges (k, 3).

    An edge has its ends and then its mid-side, and runs clockwise around the body.
    points : (n, 2) of the mesh nodes; dofs : (n, 2) of `n_dofs`, -1 at mid-sides
        where elements are linear
    """
    # Not scikit-fem's FacetBasis: its inverse mapping cannot reach its own
    # tolerance on the smallest edges, 1e-4 of their distance from the origin.
    xi, weight = np.polynomial.legendre.leggauss(count)
    shape = np.stack([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi**2])
    shape_gradient = np.stack([xi - 0.5, xi + 0.5, -2.0 * xi])
    nodes = points[edges]  # (edges, 3, 2)
    quadrature_points = np.einsum("eac,aq->eqc", nodes, shape).reshape(-1, 2)
    tangents = np.einsum("eac,aq->eqc", nodes, shape_gradient)
    det_jacobian = np.hypot(tangents[..., 0], tangents[..., 1])
    normals = (
        np.stack([-tangents[..., 1], tangents[..., 0]], axis=-1)
        / det_jacobian[..., None]
    )
    if dofs[edges[0, 2], 0] < 0:
        shape = np.stack([0.5 * (1.0 - xi), 0.5 * (1.0 + xi)])
        edges = edges[:, :2]
    values = shape[None] * (det_jacobian * weight)[:, None, :]  # (edges, nodes, q)
    point_columns = np.arange(len(quadrature_points)).reshape(len(edges), 1, count)
    point_columns = np.stack(
        [point_columns, point_columns + len(quadrature_points)]
    )  # of x, then of y
    rows = np.moveaxis(dofs[edges], 2, 0)[..., None]
    rows, columns, entries = np.broadcast_arrays(rows, point_columns, values)
    operator = csr_array(
        (entries.ravel(), (rows.ravel(), columns.ravel())),
        shape=(n_dofs, quadrature_points.size),
    )
    return BoundaryQuadrature(operator, quadrature_points, normals.reshape(-1, 2))


def foundation_stiffness(
    boundary: BoundaryQuadrature, radial: float, tangential: float
) -> csr_array:
    """Stiffness (n, n) of springs on a boundary, along and across the radius [Pa].

    It is the integral of radial u_r v_r + tangential u_t v_t over the boundary.

    radial, tangential : stiffness per area [N/m3]
    """
    operator, count = boundary.operator, len(boundary.points)
    # the shape functions at a point add up to 1, so that their sum is its weight
    weight = np.asarray(operator.sum(axis=0)).ravel()[:count]
    along = boundary.points / np.hypot(*boundary.points.T)[:, None]
    difference = radial - tangential

    def component(a: int, b: int) -> Any:
        isotropic = tangential if a == b else 0.0
        return diags_array(
            (isotropic + difference * along[:, a] * along[:, b]) / weight
        )

    law: Any = block_array([[component(a, b) for b in range(2)] for a in range(2)])
    return csr_array(operator @ law @ operator.T)
