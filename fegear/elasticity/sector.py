"""Stiffness of one tooth sector, condensed onto its two cuts.

The hub nodes are held. Displacements on the cuts are radial and tangential, so
that they mean the same to both neighbouring sectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu
from skfem import (
    Basis,
    BilinearForm,
    Element,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    MeshTri2,
)
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity.material import PlaneMaterial
from meshes import SectorMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
ELEMENTS: dict[int, type[Element]] = {1: ElementTriP1, 2: ElementTriP2}


@dataclass(frozen=True)
class SectorModel:
    """Assembled sector and the numbering of its freedoms.

    stiffness : (n, n) per unit width [Pa]
    inner, cut, hub : freedoms; hub as (x, y) pairs; cut holds the left cut, then
        the right one, each from root to hub as (x, y) pairs
    node_freedoms : (nodes, 2) freedoms (x, y) of the mesh nodes, -1 where none
    """

    basis: Basis
    order: int
    stiffness: csr_array
    inner: Indices
    cut: Indices
    hub: Indices
    node_freedoms: Indices

    @property
    def locations(self) -> Array:
        """Position (n, 2) of every freedom."""
        return self.basis.doflocs.T


def scikit_mesh(mesh: SectorMesh) -> MeshTri2:
    return MeshTri2(mesh.points.T.copy(), mesh.triangles.T.copy())


def boundary_facets(mesh: SectorMesh, grid: MeshTri2, names: list[str]) -> Indices:
    """Facet indices of the named boundaries in scikit-fem's numbering."""
    rank = np.unique(mesh.triangles[:, :3])
    ends = np.vstack([mesh.edges[name][:, :2] for name in names])
    ends = np.sort(np.searchsorted(rank, ends), axis=1)
    known = np.sort(grid.facets, axis=0).astype(np.int64)
    codes = known[0] * len(rank) + known[1]
    order = np.argsort(codes)
    wanted = ends[:, 0] * len(rank) + ends[:, 1]
    return order[np.searchsorted(codes[order], wanted)]


def assemble_sector(
    mesh: SectorMesh, material: PlaneMaterial, order: int = 2
) -> SectorModel:
    """Assemble the sector with elements of polynomial order 1 or 2."""
    grid = scikit_mesh(mesh)
    basis = Basis(grid, ElementVector(ELEMENTS[order]()), intorder=2 * order)
    stiffness = csr_array(linear_elasticity(*material.lame).assemble(basis))
    hub_facets = boundary_facets(mesh, grid, ["hub", "left_hub"])
    hub = _paired(basis, basis.get_dofs(hub_facets).flatten())
    cut = np.concatenate(
        [
            _cut_freedoms(basis, boundary_facets(mesh, grid, [name]), hub)
            for name in ("left_cut", "cut")
        ]
    )
    inner = np.setdiff1d(np.arange(basis.N), np.concatenate([cut, hub]))
    return SectorModel(
        basis, order, stiffness, inner, cut, hub, _node_freedoms(mesh, basis, order)
    )


def assemble_mass(model: SectorModel, density: float) -> csr_array:
    """Consistent mass (n, n) of the sector per unit width [kg/m], hub included.

    density : [kg/m3]
    """
    # two orders more than the product of displacements: the Jacobian of an element
    # with a curved side is a polynomial of degree two itself
    basis = Basis(model.basis.mesh, model.basis.elem, intorder=2 * model.order + 2)
    form = BilinearForm(lambda u, v, _: density * dot(u, v))
    return csr_array(form.assemble(basis))


def _node_freedoms(mesh: SectorMesh, basis: Basis, order: int) -> Indices:
    """Freedoms of the mesh nodes; scikit-fem numbers the vertices by rank."""
    freedoms = np.full((len(mesh.points), 2), -1)
    freedoms[np.unique(mesh.triangles[:, :3])] = basis.nodal_dofs.T
    if order == 2:
        facets = basis.mesh.t2f.T  # sides 01, 12, 02 as in the mesh
        freedoms[mesh.triangles[:, 3:]] = basis.facet_dofs.T[facets]
    return freedoms


def _paired(basis: Basis, dofs: Indices) -> Indices:
    """Freedoms sorted so that x and y of one place follow each other."""
    x, y = np.round(basis.doflocs[:, dofs], 12)
    return dofs[np.lexsort((dofs, x, y))]


def _cut_freedoms(basis: Basis, facets: Indices, hub: Indices) -> Indices:
    """Freedoms on a cut, off the hub, ordered from root to hub, x before y."""
    dofs = np.setdiff1d(basis.get_dofs(facets).flatten(), hub)
    radius = np.hypot(*basis.doflocs[:, dofs])
    component = np.zeros(basis.N, np.int64)
    component[basis.split_indices()[1]] = 1
    place = np.round(radius / radius.max() * 1e9).astype(np.int64)
    return dofs[np.lexsort((component[dofs], -place))]


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
    model: SectorModel, mesh: SectorMesh, names: list[str], count: int = 8
) -> BoundaryQuadrature:
    """Quadrature with `count` points on every edge of the named boundaries."""
    # Not scikit-fem's FacetBasis: its inverse mapping cannot reach its own
    # tolerance on the smallest edges, 1e-4 of their distance from the origin.
    edges = np.vstack([mesh.edges[name] for name in names])
    xi, weight = np.polynomial.legendre.leggauss(count)
    shape = np.stack([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi**2])
    slope = np.stack([xi - 0.5, xi + 0.5, -2.0 * xi])
    nodes = mesh.points[edges]  # (edges, 3, 2)
    points = np.einsum("eac,aq->eqc", nodes, shape).reshape(-1, 2)
    along = np.einsum("eac,aq->eqc", nodes, slope)
    normals, scale = _outward(along, names, mesh)
    if model.order == 1:
        shape = np.stack([0.5 * (1.0 - xi), 0.5 * (1.0 + xi)])
        edges = edges[:, :2]
    values = shape[None] * (scale * weight)[:, None, :]  # (edges, nodes, q)
    total = len(points)
    column = np.arange(total).reshape(len(edges), 1, count)
    rows, columns, entries = [], [], []
    for component in range(2):
        dofs = model.node_freedoms[edges, component][:, :, None]
        rows.append(np.broadcast_to(dofs, values.shape).ravel())
        place = component * total + column
        columns.append(np.broadcast_to(place, values.shape).ravel())
        entries.append(values.ravel())
    data = np.concatenate(entries)
    where = (np.concatenate(rows), np.concatenate(columns))
    operator = csr_array((data, where), shape=(model.basis.N, 2 * total))
    return BoundaryQuadrature(operator, points, normals.reshape(-1, 2))


def _outward(along: Array, names: list[str], mesh: SectorMesh) -> tuple[Array, Array]:
    """Outward unit normals (edges, q, 2) and line elements (edges, q).

    The right half's outline runs clockwise, its mirror image the other way.
    """
    left = [np.full(len(mesh.edges[n]), n.startswith("left_")) for n in names]
    sign = np.where(np.concatenate(left), -1.0, 1.0)[:, None]
    scale = np.hypot(along[..., 0], along[..., 1])
    normals = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    return normals * (sign / scale)[..., None], scale


@dataclass(frozen=True)
class CondensedSector:
    """Inner freedoms eliminated.

    factor : of the inner stiffness
    polar : (cut, cut) block-diagonal turn from polar to Cartesian components
    response : (inner, cut) displacement of inner freedoms per polar cut
        displacement, negated: K_II^-1 K_IB Q
    superelement : (cut, cut) stiffness in polar components
    """

    factor: SuperLU
    polar: Array
    response: Array
    superelement: Array


def condense(model: SectorModel, teeth: int) -> CondensedSector:
    inner, cut = model.inner, model.cut
    columns = model.stiffness[:, inner]
    factor = factorise(columns[inner])
    polar = _polar_turn(len(cut), math.pi / teeth)
    coupling = model.stiffness[inner][:, cut] @ polar
    response = factor.solve(np.ascontiguousarray(coupling))
    direct = polar.T @ (model.stiffness[cut][:, cut] @ polar)
    superelement = direct - coupling.T @ response
    return CondensedSector(
        factor, polar, response, 0.5 * (superelement + superelement.T)
    )


def factorise(matrix: csr_array) -> SuperLU:
    """Sparse factors of a symmetric positive definite matrix."""
    return splu(
        csc_array(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def _polar_turn(count: int, cut_angle: float) -> Array:
    """(x, y) of the left and right cut freedoms from (radial, clockwise) ones."""
    turn = np.zeros((count, count))
    half = count // 2
    for start, angle in ((0, -cut_angle), (half, cut_angle)):
        c, s = math.cos(angle), math.sin(angle)
        block = np.array([[s, c], [c, -s]])  # radial = (s, c), clockwise = (c, -s)
        for node in range(start, start + half, 2):
            turn[node : node + 2, node : node + 2] = block
    return turn
