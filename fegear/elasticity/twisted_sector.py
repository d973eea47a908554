"""Stiffness of a gear of finite width on the mesh of its plane sector.

A spur or helical gear is invariant along its axis z in a frame that turns with the
helix. With displacement R(tau z) u there, u along the turned axes x, y and the axis,
the derivative along the axis is

    D u = du/dz + tau (J u - du/dtheta),   J u = (-u_y, u_x, 0)

where tau = tan(beta_b) / r_b, the twist, is the same on all cylinders. Its coefficients
do not depend on z. With u = sum_k u_k(x, y) f_k(z) and the strain B0 u + B1 du/dz, the
stiffness between the functions k and l of z is

    K_kl = A0 M_kl + A1 D_kl + A1^T D_lk + A2 S_kl,
    A0 = int B0^T C B0,   A1 = int B0^T C B1,   A2 = int B1^T C B1   over the section,
    M_kl = int f_k f_l,   D_kl = int f_k f_l',   S_kl = int f_k' f_l'   over the width.

One constant function leaves plane strain. See F. Treyssede, Wave Motion 45 (2008) 457,
for waves in such a frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from fegear.elasticity.sector import RIGHT, CyclicSector
from lumped.common.array_types import Array, Indices


@dataclass(frozen=True, eq=False)
class TwistedSector:
    """Matrices of a sector in the turning frame, over freedoms (x, y) and along z.

    sector : in plane strain; its hub is held, or rests on springs over all the width
    """

    sector: CyclicSector

    @property
    def twist(self) -> float:
        """tau [rad/m], 0 of a spur gear."""
        return self.sector.gear.twist

    @cached_property
    def section_matrices(self) -> tuple[csr_array, csr_array, csr_array]:
        """A0 [Pa], A1 [Pa m] and A2 [Pa m2] over the freedoms of `freedoms`."""
        from skfem import BilinearForm

        basis = self._basis
        lame, twist = self._lame, self.twist

        def energy(one: Any, two: Any) -> Any:
            return _strain_energy(lame, one, two)

        def in_section(u: Any, w: Any) -> Any:
            return _section_strain(u, w.x, twist)

        forms = (
            lambda u, v, w: energy(in_section(u, w), in_section(v, w)),
            lambda u, v, w: energy(_axial_strain(u), in_section(v, w)),
            lambda u, v, _: energy(_axial_strain(u), _axial_strain(v)),
        )
        a0, a1, a2 = (csr_array(BilinearForm(form).assemble(basis)) for form in forms)
        return a0 + self._springs, a1, a2

    @property
    def _springs(self) -> csr_array:
        """Stiffness of the foundation of a ring [Pa], without entries if none."""
        springs, in_section = self.sector.springs.tocoo(), self.freedoms[0]
        places = in_section[springs.coords[0]], in_section[springs.coords[1]]
        return csr_array((springs.data, places), shape=(self._basis.N, self._basis.N))

    @property
    def _lame(self) -> tuple[float, float]:
        E, nu = self.sector.material.young_modulus, self.sector.material.poisson_ratio
        return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * E / (1.0 + nu)

    @cached_property
    def _basis(self) -> Any:
        from skfem import Basis, ElementTriP2, ElementVector

        plane = self.sector.basis
        return Basis(plane.mesh, ElementVector(ElementTriP2(), 3), intorder=4)

    @cached_property
    def freedoms(self) -> tuple[Indices, Indices]:
        """Freedoms of the matrices here, in the section and along z.

        The first are in the order of the plane sector's freedoms, the others in that
        of the nodes, as `node_of` counts them.
        """
        in_section = np.empty(self.sector.basis.N, np.int64)
        in_section[self._plane_nodes.ravel()] = self._nodes[:, :2].ravel()
        return in_section, self._nodes[:, 2]

    @cached_property
    def node_of(self) -> Indices:
        """Node (index along z) of each freedom of the plane sector."""
        nodes = np.empty(self.sector.basis.N, np.int64)
        nodes[self._plane_nodes] = np.arange(len(self._plane_nodes))[:, None]
        return nodes

    @cached_property
    def _plane_nodes(self) -> Indices:
        """Freedoms (n, 2) of the plane sector."""
        return _freedoms_by_node(self.sector.basis)

    @cached_property
    def _nodes(self) -> Indices:
        """Freedoms (n, 3) here."""
        return _freedoms_by_node(self._basis)

    @cached_property
    def flank_normals(self) -> tuple[Array, Array]:
        """Unit inward normals of the flank's points (n,), each a column.

        Over the freedoms of the plane sector, and along z over the nodes: forces of one
        in their direction, of which the displacement along the normal is the work.
        """
        flank = self.sector.flanks[RIGHT]
        points = np.arange(len(flank.arcs))
        x, y = flank.points.T
        # no motion along the helix, (-twist y, twist x, 1), leaves the flank
        along = self.twist * (flank.inward[:, 0] * y - flank.inward[:, 1] * x)
        cosine = 1.0 / np.hypot(1.0, along)
        in_section = np.zeros((self.sector.basis.N, points.size))
        for component in range(2):
            at = flank.dofs[:, component], points
            in_section[at] = cosine * flank.inward[:, component]
        axial = np.zeros((len(self._nodes), points.size))
        axial[self.node_of[flank.dofs[:, 0]], points] = cosine * along
        return in_section, axial

    def axial_constraint(self, phase: complex) -> csr_array:
        """(n, m) from axial displacement off hub and right cut to that of all nodes.

        The right cut moves `phase` times as much as the left one. Columns are the
        interior, then the left cut.
        """
        cut, nodes = self.sector.cut, self.node_of
        left, right = nodes[cut[: len(cut) // 2 : 2]], nodes[cut[len(cut) // 2 :: 2]]
        hub = np.unique(nodes[self.sector.hub])
        count = len(self._nodes)
        interior = np.setdiff1d(np.arange(count), np.concatenate([hub, left, right]))
        n, m = len(interior), len(left)
        rows = np.concatenate([interior, left, right])
        columns = np.concatenate([np.arange(n + m), n + np.arange(m)])
        values = np.concatenate([np.ones(n + m), np.full(m, phase)])
        return csr_array((values, (rows, columns)), shape=(count, n + m))


def _freedoms_by_node(basis: Any) -> Indices:
    """Freedoms (n, components) of vertices and mid-sides."""
    return np.vstack([basis.nodal_dofs.T, basis.facet_dofs.T])


def _section_strain(u: Any, x: Array, twist: float) -> tuple[Any, ...]:
    """B0 u: strains xx, yy, zz, and twice xy, xz, yz."""
    gradient = u.grad

    def turned(component: int) -> Any:
        return x[0] * gradient[component, 1] - x[1] * gradient[component, 0]

    return (
        gradient[0, 0],
        gradient[1, 1],
        -twist * turned(2),
        gradient[0, 1] + gradient[1, 0],
        gradient[2, 0] - twist * (u[1] + turned(0)),
        gradient[2, 1] + twist * (u[0] - turned(1)),
    )


def _axial_strain(u: Any) -> tuple[Any, ...]:
    """B1 u: strains as in `_section_strain`, of a displacement that grows along z."""
    none = 0.0 * u[0]
    return none, none, u[2], none, u[0], u[1]


def _strain_energy(lame: tuple[float, float], one: Any, two: Any) -> Any:
    """Density of the energy of two strains by Hooke's law, twice for equal ones."""
    first, mu = lame
    traces = sum(one[:3]) * sum(two[:3])
    normal = sum(a * b for a, b in zip(one[:3], two[:3], strict=True))
    shear = sum(a * b for a, b in zip(one[3:], two[3:], strict=True))
    return first * traces + mu * (2.0 * normal + shear)
