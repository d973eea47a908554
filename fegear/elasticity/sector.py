"""The cyclic sector of a gear: one tooth with its share of the body, hub held.

The hub of a ring is what carries its outside, rigidly or by the springs of a
foundation. With springs no freedom of the ring is held: displacement is relative to
their base.

All teeth of a gear are equal, so one sector represents the gear: flank compliance,
modes, the cyclic gear, stress and pictures are functions of a `CyclicSector`.

Everything in `fegear.elasticity` is per unit face width. The face width has one rule:
a thing is as wide as what it acts on. A contact is as wide as the narrower gear of its
mesh (`GearSet.common_width`), and so are its pressure, its compliance and the root
stress that it causes; mass, modes and damping of a gear are as wide as that gear. Two
contacts in different meshes of a gear deflect each other over the wider of the two,
with which the compliance stays positive definite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from fegear.elasticity.boundary import (
    BoundaryQuadrature,
    edge_quadrature,
    foundation_stiffness,
)
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.plane_elements import dofs_of_nodes, plane_basis
from fegear.files.timing import stage
from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr
from meshes import MeshSize, SectorMesh, SpurGear, sector_mesh
from meshes.crack import Crack
from meshes.cracked_sector import cracked_sector_mesh
from meshes.internal import Foundation, InternalGear
from meshes.profile import flank_frame

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU
    from skfem import Basis

RIGHT, LEFT = 0, 1  # flanks of a tooth


@dataclass(frozen=True)
class FlankPoints:
    """Vertices of a flank where loads act, all but the corners at its ends.

    An undercut flank has one at both ends, others at the tip alone.

    points : (n, 2) [m]; inward, rootward : (n, 2) unit vectors
    arcs : (n,) from the tip corner [m]; dofs : (n, 2) along x and y
    """

    points: Array
    inward: Array
    rootward: Array
    arcs: Array
    dofs: Indices


@dataclass(frozen=True)
class CyclicSector(ShortRepr):
    """One tooth sector of a gear: mesh, stiffness, mass, condensation, flanks.

    Each part is computed when it is first asked for. `cyclic_sector` returns the same
    sector for the same arguments.

    order : polynomial order of the elements, 1 or 2
    cracks : of its tooth, which differs from the others then: such a sector is a part
        of a ring in `fegear.elasticity.damaged_ring` alone
    """

    gear: SpurGear
    material: PlaneMaterial
    size: MeshSize = field(default_factory=MeshSize)
    order: int = 2
    cracks: tuple[Crack, ...] = ()

    @cached_property
    def mesh(self) -> SectorMesh:
        with stage("meshing"):
            if self.cracks:
                return cracked_sector_mesh(self.gear, self.size, self.cracks)
            return sector_mesh(self.gear, self.size)

    @cached_property
    def basis(self) -> Basis:
        return plane_basis(self.mesh.points, self.mesh.triangles, self.order)

    @cached_property
    def stiffness(self) -> csr_array:
        """(n, n) over all freedoms, springs of a foundation included [Pa]."""
        from skfem.models.elasticity import linear_elasticity

        basis = self.basis
        with stage("assembling"):
            body = csr_array(linear_elasticity(*self.material.lame).assemble(basis))
            return body if self.foundation is None else body + self.springs

    @property
    def foundation(self) -> Foundation | None:
        """Springs that carry the outside of a ring; None where the hub is held."""
        gear = self.gear
        return gear.foundation if isinstance(gear, InternalGear) else None

    @cached_property
    def springs(self) -> csr_array:
        """Stiffness (n, n) of the foundation alone [Pa], without entries if none."""
        if self.foundation is None:
            return csr_array((self.basis.N, self.basis.N))
        edges = np.vstack([self.mesh.edges[name] for name in ("hub", "left_hub")])
        outside = edge_quadrature(self.mesh.points, edges, self.node_dofs, self.basis.N)
        return foundation_stiffness(
            outside, self.foundation.radial, self.foundation.tangential
        )

    def mass(self, density: float) -> csr_array:
        """Consistent mass (n, n) [kg/m], hub included; density in kg/m3."""
        from skfem import Basis, BilinearForm
        from skfem.helpers import dot

        # two orders more than the product of displacements: the Jacobian of an
        # element with a curved side is a polynomial of degree two itself
        order = 2 * self.order + 2
        basis = Basis(self.basis.mesh, self.basis.elem, intorder=order)
        form = BilinearForm(lambda u, v, _: density * dot(u, v))
        with stage("assembling"):
            return csr_array(form.assemble(basis))

    @property
    def locations(self) -> Array:
        """Position (n, 2) of every freedom [m]."""
        return self.basis.doflocs.T

    @cached_property
    def hub(self) -> Indices:
        """Freedoms held by the hub, as (x, y) pairs; none on a foundation."""
        if self.foundation is not None:
            return np.empty(0, np.int64)
        dofs = self._boundary_dofs(["hub", "left_hub"])
        x, y = np.round(self.basis.doflocs[:, dofs], 12)
        return dofs[np.lexsort((dofs, x, y))]

    @cached_property
    def cut(self) -> Indices:
        """Freedoms of the left cut, then of the right one, off the hub.

        Each from root to hub, as (x, y) pairs.
        """
        along_y = np.isin(np.arange(self.basis.N), self.basis.split_indices()[1])
        sides = []
        for name in ("left_cut", "cut"):
            dofs = np.setdiff1d(self._boundary_dofs([name]), self.hub)
            radius = np.hypot(*self.basis.doflocs[:, dofs])
            radial_rank = np.round(radius / radius.max() * 1e9).astype(np.int64)
            sides.append(dofs[np.lexsort((along_y[dofs], -radial_rank))])
        return np.concatenate(sides)

    @cached_property
    def interior(self) -> Indices:
        """Freedoms on neither cut nor hub."""
        boundary = np.concatenate([self.cut, self.hub])
        return np.setdiff1d(np.arange(self.basis.N), boundary)

    @cached_property
    def node_dofs(self) -> Indices:
        """(nodes, 2) freedoms (x, y) of the mesh nodes, -1 where there are none."""
        return dofs_of_nodes(self.basis, self.mesh.triangles, self.order)

    @cached_property
    def flanks(self) -> tuple[FlankPoints, FlankPoints]:
        """The right flank, and the left one as its mirror image."""
        mesh, mirror = self.mesh, np.array([-1.0, 1.0])
        # a load at the edge of an undercut has no field of a half-plane
        inner = slice(1, -1) if self.gear.is_undercut else slice(1, None)
        arcs, nodes = mesh.flank_arcs[inner], mesh.flank_nodes[inner]
        _, inward = flank_frame(self.gear, arcs)
        rootward = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
        points, dofs = mesh.points[nodes], self.node_dofs
        left_nodes = mesh.edges["left_flank"][:, 1]
        left = dofs[left_nodes[: len(nodes)]]
        return (
            FlankPoints(points, inward, rootward, arcs, dofs[nodes]),
            FlankPoints(
                points * mirror, inward * mirror, rootward * mirror, arcs, left
            ),
        )

    @property
    def flank_grid(self) -> tuple[float, float, int, bool]:
        """Length [m], grading, number of points and whether graded toward both ends.

        As `flank_stencils` takes them.
        """
        count = len(self.flanks[RIGHT].arcs)
        grading, both_ends = self.size.flank_grading, self.gear.is_undercut
        return self.gear.flank_length, grading, count, both_ends

    @cached_property
    def polar(self) -> Array:
        """(cut, cut) from radial and clockwise components on the cuts to (x, y).

        They mean the same to both sectors that meet in a cut.
        """
        rotation, half = np.zeros((len(self.cut), len(self.cut))), len(self.cut) // 2
        half_pitch = 0.5 * self.gear.pitch_angle
        for start, angle in ((0, -half_pitch), (half, half_pitch)):
            c, s = math.cos(angle), math.sin(angle)
            block = np.array([[s, c], [c, -s]])  # radial = (s, c), clockwise = (c, -s)
            for node in range(start, start + half, 2):
                rotation[node : node + 2, node : node + 2] = block
        return rotation

    @cached_property
    def condensation(self) -> Condensation:
        return condense(self, self.stiffness)

    @cached_property
    def rigid_body_modes(self) -> Array:
        """(n, 3): unit clockwise turn about the centre, unit shifts in x and y."""
        x, y = self.locations.T
        along_x = np.ones(self.basis.N, bool)
        along_x[self.basis.split_indices()[1]] = False
        return np.stack([np.where(along_x, y, -x), along_x, ~along_x], axis=1)

    def cyclic_constraint(self, phase: complex) -> csr_array:
        """(n, interior + m) from interior and polar left-cut displacement to all.

        The right cut moves `phase` times as much as the left one.
        """
        half, n_interior = len(self.cut) // 2, len(self.interior)
        cut = self.polar[:, :half] + phase * self.polar[:, half:]
        rows, columns = np.nonzero(cut)
        entries = np.concatenate([np.ones(n_interior), cut[rows, columns]])
        indices = (
            np.concatenate([self.interior, self.cut[rows]]),
            np.concatenate([np.arange(n_interior), n_interior + columns]),
        )
        return csr_array((entries, indices), shape=(self.basis.N, n_interior + half))

    def boundary_quadrature(self, names: list[str]) -> BoundaryQuadrature:
        """Quadrature on every edge of the named boundaries."""
        edges = []
        for name in names:
            edge_nodes = self.mesh.edges[name]
            # the right half's outline runs clockwise, its mirror image the other way
            edges.append(
                edge_nodes[:, [1, 0, 2]] if name.startswith("left_") else edge_nodes
            )
        return edge_quadrature(
            self.mesh.points, np.vstack(edges), self.node_dofs, self.basis.N
        )

    def _boundary_dofs(self, names: list[str]) -> Indices:
        """Freedoms on the named boundaries."""
        mesh, grid = self.mesh, self.basis.mesh
        rank = np.unique(mesh.triangles[:, :3])
        ends = np.vstack([mesh.edges[name][:, :2] for name in names])
        ends = np.sort(np.searchsorted(rank, ends), axis=1)
        grid_facets = np.sort(grid.facets, axis=0).astype(np.int64)
        codes = grid_facets[0] * len(rank) + grid_facets[1]
        order = np.argsort(codes)
        boundary_codes = ends[:, 0] * len(rank) + ends[:, 1]
        facets = order[np.searchsorted(codes[order], boundary_codes)]
        return self.basis.get_dofs(facets).flatten()


def cyclic_sector(
    gear: SpurGear,
    material: PlaneMaterial,
    size: MeshSize,
    order: int = 2,
    cracks: tuple[Crack, ...] = (),
) -> CyclicSector:
    """The sector of a gear in a plane state, shared by all callers."""
    sector = CyclicSector(gear, material.section, size, order, cracks)
    return _first_of_equals(sector)


@lru_cache(maxsize=8)
def _first_of_equals(sector: CyclicSector) -> CyclicSector:
    return sector


@dataclass(frozen=True, eq=False)
class Condensation:
    """A sector's matrix with the interior freedoms eliminated (Guyan 1965).

    factor : of the interior's own block
    response : (interior, cut) displacement of the interior per polar cut
        displacement, negated: K_II^-1 K_IB Q
    superelement : (cut, cut) in polar components
    """

    factor: SuperLU
    response: Array
    superelement: Array

    def solve(self, load: NDArray[Any]) -> NDArray[Any]:
        """Displacement of the interior with the cuts held; loads may be complex."""
        if np.isrealobj(load):
            return self.factor.solve(np.ascontiguousarray(load))
        parts = self.factor.solve(np.stack([load.real, load.imag], axis=1))
        return np.asarray(parts[:, 0] + 1j * parts[:, 1])


def condense(sector: CyclicSector, matrix: csr_array) -> Condensation:
    """Eliminate the interior freedoms from a matrix over all freedoms."""
    interior, cut, polar = sector.interior, sector.cut, sector.polar
    with stage("condensing"):
        columns = matrix[:, interior]
        factor = factorise(columns[interior])
        coupling = matrix[interior][:, cut] @ polar
        response = factor.solve(np.ascontiguousarray(coupling))
        direct = polar.T @ (matrix[cut][:, cut] @ polar)
        superelement = direct - coupling.T @ response
    return Condensation(factor, response, 0.5 * (superelement + superelement.T))


def factorise(matrix: csr_array) -> SuperLU:
    """Sparse factors of a symmetric positive definite matrix."""
    from scipy.sparse.linalg import splu

    return splu(
        csc_array(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
