"""A whole wheel of finite elements, its bore held, under loads on its flanks.

As for the flanks of a tooth sector, displacements are those of a half-plane under a
line load plus a remainder that finite elements resolve; see `fegear.elasticity.flank`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU
from skfem import Basis
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity import halfplane
from fegear.elasticity.boundary import BoundaryQuadrature, edge_quadrature
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.plane_elements import dofs_of_nodes, plane_basis
from fegear.elasticity.sector import factorise
from lumped.common.array_types import Array, Indices
from meshes.eccentric.wheel_mesh import WheelMesh

ORDER, NEWTON = 2, 4  # of elements; steps to the nearest point of an edge


class FlankLoadPoints(NamedTuple):
    """Points on edges of the outline where loads act.

    point, inward : (n, 2) [m] and unit vectors, of the mesh
    outward : (n, 2) the way out of the wheel between its teeth
    edge : (n,) row of the outline; shape : (n, 3) factors of its nodes
    """

    point: Array
    inward: Array
    outward: Array
    edge: Indices
    shape: Array


@dataclass(frozen=True, eq=False)
class ElasticWheel:
    """Stiffness of a wheel, per unit face width."""

    mesh: WheelMesh
    material: PlaneMaterial

    @cached_property
    def basis(self) -> Basis:
        return plane_basis(self.mesh.points, self.mesh.triangles, ORDER)

    @cached_property
    def dofs(self) -> Indices:
        """(nodes, 2) of the mesh nodes."""
        return dofs_of_nodes(self.basis, self.mesh.triangles, ORDER)

    @cached_property
    def held(self) -> Indices:
        """Freedoms of the bore, as (x, y) pairs."""
        return self.dofs[np.unique(self.mesh.bore)].ravel()

    @cached_property
    def free(self) -> Indices:
        return np.setdiff1d(np.arange(self.basis.N), self.held)

    @cached_property
    def stiffness(self) -> csr_array:
        lame = self.material.lame
        return csr_array(linear_elasticity(*lame).assemble(self.basis))

    @cached_property
    def factor(self) -> SuperLU:
        return factorise(self.stiffness[self.free][:, self.free])

    @cached_property
    def boundary(self) -> BoundaryQuadrature:
        mesh = self.mesh
        return edge_quadrature(mesh.points, mesh.outline, self.dofs, self.basis.N)

    def places(
        self, points: Array, outward: Array, flanks: Indices, margin: float = 0.0
    ) -> FlankLoadPoints:
        """The places nearest to points (n, 2) [m], each on its own flank.

        outward : (n, 2) the way out of the wheel from there, between its teeth
        flanks : (n, k) rows of the outline, in order; where a tip corner is in contact,
            the edge of the tip land is as near
        margin : of an edge, that places keep from the ends of their flank
        """
        edge, xi = self._nearest_chords(points, flanks)
        nodes = self.mesh.points[self.mesh.outline[edge]]
        for _ in range(NEWTON):
            tangents = np.einsum("ap,pac->pc", _slope(xi), nodes)
            offset = points - np.einsum("ap,pac->pc", _shape(xi), nodes)
            xi += np.sum(offset * tangents, axis=1) / np.sum(tangents**2, axis=1)
        if margin > 0.0:
            low = np.where(edge == flanks[:, 0], 2.0 * margin - 1.0, -np.inf)
            high = np.where(edge == flanks[:, -1], 1.0 - 2.0 * margin, np.inf)
            xi = xi.clip(low, high)
        tangents = np.einsum("ap,pac->pc", _slope(xi), nodes)
        inward = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
        inward /= np.linalg.norm(inward, axis=1)[:, None]
        factors = _shape(xi)
        point = np.einsum("ap,pac->pc", factors, nodes)
        return FlankLoadPoints(point, inward, outward, edge, factors.T)

    def _nearest_chords(self, points: Array, edges: Indices) -> tuple[Indices, Array]:
        """Rows (n,) of the outline among (n, k), and where on them, from -1 to 1."""
        ends = self.mesh.points[self.mesh.outline[edges, :2]]
        span = ends[:, :, 1] - ends[:, :, 0]
        offset = points[:, None] - ends[:, :, 0]
        ratio = np.sum(offset * span, axis=2) / np.sum(span**2, axis=2)
        ratio = ratio.clip(0.0, 1.0)
        distance = np.linalg.norm(offset - ratio[..., None] * span, axis=2)
        nearest = np.arange(len(points)), distance.argmin(axis=1)
        return edges[nearest], 2.0 * ratio[nearest] - 1.0

    def respond(self, places: FlankLoadPoints) -> Array:
        """Displacement (freedoms, n) in addition to the half-plane's under unit loads
        into the flank [m/(N/m)]."""
        E, nu = self.material.modulus, self.material.poisson
        rim = self.mesh.points[np.unique(self.mesh.bore)]
        tractions, rims = [], []
        for x, n, out in zip(*places[:3], strict=True):
            traction = halfplane.traction(
                self.boundary.points, self.boundary.normals, x, n
            )
            tractions.append(traction.T.ravel())
            rims.append(halfplane.displacement(rim, x, n, E, nu, cut=out).ravel())
        field = np.zeros((self.basis.N, len(places.edge)))
        field[self.held] = -np.stack(rims, axis=1)
        load = -(self.boundary.operator @ np.stack(tractions, axis=1))
        load -= self.stiffness @ field
        field[self.free] = self.factor.solve(np.ascontiguousarray(load[self.free]))
        return field

    def compliance(self, places: FlankLoadPoints, fields: Array) -> Array:
        """Inward displacement at places (n,) under unit loads at each [m/(N/m)], of the
        loaded place itself in addition to the half-plane's own.

        fields : (freedoms, n) as `respond` returns
        """
        E, nu = self.material.modulus, self.material.poisson
        rows = self.dofs[self.mesh.outline[places.edge]]  # (n, 3, 2)
        displacement = np.einsum("pa,pacl->pcl", places.shape, fields[rows])
        for load, (x, n, out) in enumerate(zip(*places[:3], strict=True)):
            singular = halfplane.displacement(places.point, x, n, E, nu, cut=out)
            displacement[:, :, load] += singular
        return np.einsum("pc,pcl->pl", places.inward, displacement)


def _shape(xi: Array) -> Array:
    """Shape functions of both ends of an edge and its midpoint (3, n), xi from
    -1 to 1.
    """
    return np.stack([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi**2])


def _slope(xi: Array) -> Array:
    return np.stack([xi - 0.5, xi + 0.5, -2.0 * xi])
