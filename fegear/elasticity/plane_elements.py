"""Plane triangles with scikit-fem: bases, and which freedoms a mesh node has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lumped.common.array_types import Array, Indices

if TYPE_CHECKING:
    from skfem import Basis


def plane_basis(points: Array, triangles: Indices, order: int) -> Basis:
    """Displacements of an order on curved triangles; points (n, 2), corners and then
    mid-sides (m, 6)."""
    from skfem import Basis, ElementTriP1, ElementTriP2, ElementVector, MeshTri2

    element = {1: ElementTriP1, 2: ElementTriP2}[order]
    grid = MeshTri2(points.T.copy(), triangles.T.copy())
    return Basis(grid, ElementVector(element()), intorder=2 * order)


def dofs_of_nodes(basis: Basis, triangles: Indices, order: int) -> Indices:
    """(nodes, 2) freedoms (x, y) of the mesh nodes, -1 where there are none."""
    dofs = np.full((int(triangles.max()) + 1, 2), -1)
    # scikit-fem numbers the vertices by rank
    dofs[np.unique(triangles[:, :3])] = basis.nodal_dofs.T
    if order == 2:
        facets = basis.mesh.t2f.T  # sides 01, 12, 02 as in the mesh
        dofs[triangles[:, 3:]] = basis.facet_dofs.T[facets]
    return dofs
