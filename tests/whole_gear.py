"""A whole gear of finite elements, made from the mesh of a sector.

It repeats the sector mesh around the axis, merges the nodes on the cuts, holds the hub
and asks ARPACK; it shares only the mesh with the program.
"""

from __future__ import annotations

import numpy as np
from conftest import make_gear
from scipy.sparse import block_array, csr_array, eye_array, hstack
from scipy.sparse.linalg import eigsh, splu
from scipy.spatial import cKDTree
from skfem import (
    Basis,
    BilinearForm,
    ElementTriP2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshTri2,
)
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import RIGHT
from meshes import MeshSize, sector_mesh
from meshes.internal import InternalGear
from meshes.profile import flank_tangents, roll_length_at_arc, turn

STEEL = PlaneMaterial(206e9, 0.3)
DENSITY = 7850.0
COARSE = MeshSize(
    flank_edges=6, flank_grading=2.0, fillet_edges=3, tooth_size=0.6, hub_size=2.4
)


def small_gear(teeth):
    reference = 0.5 * 2.54e-3 * teeth
    return make_gear(teeth, 5e-3, profile_shift=0.4, tip_radius=reference + 3.36e-3)


def small_ring(teeth):
    reference = 0.5 * 2.54e-3 * teeth
    return InternalGear(
        teeth=teeth,
        module=2.54e-3,
        pressure_angle=np.deg2rad(25.0),
        profile_shift=0.0,
        tip_radius=-(reference - 1.5e-3),
        dedendum=2.9e-3,
        rack_tip_radius=0.35e-3,
        hub_radius=-(reference + 7e-3),
        cutter_teeth=9,
    )


class WholeGear:
    def __init__(self, gear, size, cutoff_Hz):
        self.gear, self.sector = gear, sector_mesh(gear, size)
        angles = gear.pitch_angle * np.arange(gear.teeth)
        copies = np.vstack([turn(self.sector.points, a) for a in angles])
        near = cKDTree(copies).query_ball_point(copies, 1e-9)
        unique, merged = np.unique([min(n) for n in near], return_inverse=True)
        shift = len(self.sector.points) * np.arange(gear.teeth)[:, None, None]
        triangles = (self.sector.triangles[None] + shift).reshape(-1, 6)
        mesh = MeshTri2(copies[unique].T.copy(), merged[triangles].T.copy())
        basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=6)
        E, nu = 206e9, 0.3
        law = linear_elasticity(E * nu / (1 - nu**2), 0.5 * E / (1 + nu))
        stiff_basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
        self.stiffness = law.assemble(stiff_basis).tocsc()
        form = BilinearForm(lambda u, v, _: DENSITY * dot(u, v))
        self.mass = form.assemble(basis).tocsc()
        self.basis = basis
        self.places = basis.doflocs.T
        self.along_y = np.isin(np.arange(basis.N), basis.split_indices()[1])
        radius = gear.sign * np.hypot(*self.places.T)
        slack = 1e-6 * abs(gear.hub_radius)
        self.free = np.flatnonzero(radius > gear.hub_radius + slack)
        if getattr(gear, "foundation", None) is not None:
            self.stiffness += self._springs(basis)
            self.free = np.arange(basis.N)
        self._solve(cutoff_Hz)

    def _outside(self, basis):
        """Facets on the outside of a ring."""
        mesh = basis.mesh
        ends = np.hypot(*mesh.p)[mesh.facets]
        at_rim = ends > -(1.0 - 1e-6) * self.gear.hub_radius
        outside = np.intersect1d(
            np.flatnonzero(at_rim.all(axis=0)), mesh.boundary_facets()
        )
        return outside

    def mean_outside(self, tooth):
        """Nodal loads (2, freedoms) of unit loads on the outside of one sector.

        Outward and clockwise.
        """
        outside, mesh = self._outside(self.basis), self.basis.mesh
        angle = -0.5 * np.pi - tooth * self.gear.pitch_angle
        middle = mesh.p[:, mesh.facets[:, outside]].mean(axis=1)
        turned = np.exp(-1j * angle) * (middle[0] + 1j * middle[1])
        near = np.abs(np.angle(turned)) < 0.5 * abs(self.gear.pitch_angle)
        edges = FacetBasis(mesh, self.basis.elem, facets=outside[near], intorder=12)
        length = edges.dx.sum()

        def outward(v, w):
            return dot(v, w.x / np.hypot(*w.x)) / length

        def clockwise(v, w):
            return dot(v, np.stack([w.x[1], -w.x[0]]) / np.hypot(*w.x)) / length

        return [LinearForm(form).assemble(edges) for form in (outward, clockwise)]

    def _springs(self, basis):
        """Stiffness of springs on the outside of a ring, by scikit-fem's own facets."""
        springs, outside = self.gear.foundation, self._outside(basis)
        edges = FacetBasis(basis.mesh, basis.elem, facets=outside, intorder=12)

        def work(u, v, w):
            radial = w.x / np.hypot(*w.x)
            across = np.stack([-radial[1], radial[0]])
            return springs.radial * dot(u, radial) * dot(v, radial) + (
                springs.tangential * dot(u, across) * dot(v, across)
            )

        return BilinearForm(work).assemble(edges).tocsc()

    def _solve(self, cutoff_Hz):
        K, M = (A[self.free][:, self.free] for A in (self.stiffness, self.mass))
        values, vectors = eigsh(K, 70, M, sigma=0.0)
        frequency = np.sqrt(values) / (2.0 * np.pi)
        assert frequency.max() > cutoff_Hz, "all modes below the cut-off are there"
        self.frequencies = frequency[frequency < cutoff_Hz]
        self.fields = np.zeros((len(self.places), len(self.frequencies)))
        self.fields[self.free] = vectors[:, frequency < cutoff_Hz]

    def rigid(self):
        """Fields of a unit clockwise turn and of unit shifts, (freedoms, 3)."""
        x, y = self.places.T
        turned = np.where(self.along_y, -x, y)
        return np.stack([turned, ~self.along_y, self.along_y], axis=1).astype(float)

    def flank(self, tooth, side, normal=True):
        """Inward (else rootward) displacement of flank points, (modes, points)."""
        pairs, wanted = self._flank_freedoms(tooth, side, normal)
        return np.einsum("icm,ic->mi", self.fields[pairs], wanted)

    def flank_rows(self, tooth, side=RIGHT, normal=True):
        """Of unit displacements of the freedoms, (points, freedoms)."""
        pairs, wanted = self._flank_freedoms(tooth, side, normal)
        rows = np.zeros((len(pairs), len(self.places)))
        rows[np.arange(len(pairs))[:, None], pairs] = wanted
        return rows

    def _flank_freedoms(self, tooth, side, normal):
        """Freedoms x, y of flank points, and the direction that is asked for."""
        angle = tooth * self.gear.pitch_angle
        arcs = self.sector.flank_arcs[1:]
        root = -flank_tangents(self.gear, roll_length_at_arc(self.gear, arcs))
        wanted = np.stack([root[:, 1], -root[:, 0]], axis=1) if normal else root
        mirror = [1.0, 1.0] if side == RIGHT else [-1.0, 1.0]
        points = turn(self.sector.points[self.sector.flank_nodes[1:]] * mirror, angle)
        wanted = turn(wanted * mirror, angle)
        dof_lists = cKDTree(self.places).query_ball_point(points, 1e-9)
        pairs = np.array(
            [sorted(pair, key=lambda d: self.along_y[d]) for pair in dof_lists]
        )
        return pairs, wanted


def same_frequency(frequency):
    """Slices of neighbours of equal frequency."""
    ends = np.flatnonzero(np.diff(frequency) > 1e-6 * frequency[1:]) + 1
    return [
        slice(a, b) for a, b in zip([0, *ends], [*ends, len(frequency)], strict=True)
    ]


def free_gear_displacement(whole, load, inertia):
    """Displacement of a gear under a load, in mean axes, and its acceleration.

    The hub turns as a rigid body about the centre; stiffness and mass of all nodes
    are singular in the turn, which the condition r'M x = 0 takes out:
    K x + M r a = f with r'M x = 0.
    """
    turn = whole.rigid()[:, 0]
    hub = np.zeros_like(turn)
    held = np.setdiff1d(np.arange(turn.size), whole.free)
    hub[held] = turn[held]
    eye = eye_array(turn.size, format="csc")[:, whole.free]
    basis = hstack([csr_array(hub[:, None]), eye]).tocsc()
    K, M = (basis.T @ A @ basis for A in (whole.stiffness, whole.mass))
    rigid = np.concatenate([[1.0], turn[whole.free]])
    momentum = M @ rigid
    momentum[0] += inertia - rigid @ momentum  # of the hub, beyond the mesh
    column = csr_array(1e9 * momentum[:, None])  # so that entries are of like size
    system = block_array([[K, column], [column.T, None]]).tocsc()
    solution = splu(system).solve(np.append(basis.T @ load, 0.0))
    return basis @ solution[:-1], 1e9 * solution[-1]


def require_same_shapes(modes, whole, tooth, side):
    """Products of two places, which do not ask how a pair is turned."""
    for group in same_frequency(modes.frequencies_Hz):
        for shape_at, normal in ((modes.normal_at, True), (modes.tangential_at, False)):
            ring = modes.normal_at(0)[group].T @ shape_at(tooth, side)[group]
            direct = (
                whole.flank(0, RIGHT)[group].T @ whole.flank(tooth, side, normal)[group]
            )
            scale = np.abs(modes.normal).max() ** 2
            np.testing.assert_allclose(ring, direct, atol=1e-6 * scale)
