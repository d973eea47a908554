"""Ring and split against one direct solve of the whole gear.

The direct solve repeats the sector mesh around the gear, merges the nodes on the
cuts, holds the hub and loads nodes; it shares only the mesh with the program.
"""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make_gear
from scipy.spatial import cKDTree
from sector_stress import sector_stress
from skfem import Basis, ElementTriP2, ElementVector, MeshTri2, condense, solve
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity.body_stress import ToothLoad, hat_stresses
from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import FlankLoad, root_influence
from fegear.elasticity.sector import RIGHT, CyclicSector
from meshes import MeshSize, sector_mesh
from meshes.profile import flank_points, flank_tangents, roll_length_at_arc, turn

MATERIAL = PlaneMaterial(206e9, 0.3, "strain")
SIZE = MeshSize(flank_edges=20, flank_grading=3.0)
FINER = SIZE.refined(2.0)


@pytest.fixture(scope="module")
def gear():
    return make_gear(12, 5e-3, profile_shift=0.4, tip_radius=18.6e-3)


class WholeGear:
    def __init__(self, gear, size):
        self.gear, self.sector = gear, sector_mesh(gear, size)
        angles = 2.0 * np.pi * np.arange(gear.teeth) / gear.teeth
        copies = np.vstack([turn(self.sector.points, a) for a in angles])
        tree = cKDTree(copies)
        first = np.array([min(near) for near in tree.query_ball_point(copies, 1e-9)])
        unique_nodes, self.merged = np.unique(first, return_inverse=True)
        self.points = copies[unique_nodes]
        shift = len(self.sector.points) * np.arange(gear.teeth)[:, None, None]
        triangles = (self.sector.triangles[None] + shift).reshape(-1, 6)
        mesh = MeshTri2(self.points.T.copy(), self.merged[triangles].T.copy())
        self.basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
        E, nu = 206e9, 0.3
        lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), 0.5 * E / (1 + nu)
        self.stiffness = linear_elasticity(lam, mu).assemble(self.basis)
        places = self.basis.doflocs.T
        radius = np.hypot(*places.T)
        self.held = np.flatnonzero(radius < gear.hub_radius * (1 + 1e-6))
        self.places = cKDTree(places)

    def freedoms(self, points):
        """(n, 2) freedoms x, y at points."""
        pairs = self.places.query_ball_point(points, 1e-9)
        return np.array([sorted(pair) for pair in pairs])

    def displacement(self, force):
        return solve(*condense(self.stiffness, force, D=self.held))

    def root_stress(self, displacement):
        """Largest trace at the nodes of the first tooth's right fillet."""
        corners = np.array([[0, 1, 0, 0.5, 0.5, 0], [0, 0, 1, 0, 0.5, 0.5]])
        quadrature = corners, np.ones(6)
        basis = Basis(self.basis.mesh, self.basis.elem, quadrature=quadrature)
        grad = np.asarray(basis.interpolate(displacement).grad)
        E, nu = MATERIAL.modulus, MATERIAL.poisson
        trace = (grad[0, 0] + grad[1, 1]) * E / (1.0 - nu)  # of a plane stress state
        triangles = self.sector.triangles
        nodal = np.bincount(triangles.ravel(), trace[: len(triangles)].ravel())
        nodal = nodal / np.bincount(triangles.ravel())
        return nodal[np.unique(self.sector.edges["fillet"])].max()


@pytest.fixture(scope="module")
def whole(gear):
    return WholeGear(gear, SIZE)


def flank_frame(gear, mesh, tooth):
    """Points and inward normals of the flank vertices of a tooth."""
    angle = 2.0 * np.pi * tooth / gear.teeth
    tangent = flank_tangents(gear, roll_length_at_arc(gear, mesh.flank_arcs[1:]))
    inward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    return turn(mesh.points[mesh.flank_nodes[1:]], angle), turn(inward, angle)


@pytest.mark.parametrize("node", [3, 12, 17])
def test_ring_without_split_is_the_whole_gear(gear, whole, node):
    compliance = flank_compliance(CyclicSector(gear, MATERIAL, SIZE), split=False)
    points, inward = flank_frame(gear, whole.sector, 0)
    force = np.zeros(whole.basis.N)
    force[whole.freedoms(points[node : node + 1])[0]] = inward[node]
    u = whole.displacement(force)
    for tooth in (-2, -1, 0, 1, 3):
        points, inward = flank_frame(gear, whole.sector, tooth)
        direct = np.einsum("ic,ic->i", u[whole.freedoms(points)], inward)
        ring = compliance.normal[MAX_TOOTH_OFFSET + tooth][:, node]
        np.testing.assert_allclose(ring, direct, rtol=1e-8, atol=1e-6 * direct.max())


def test_split_agrees_away_from_the_load(gear):
    """Where the load is not near, point loads and split give the same field."""
    split = flank_compliance(CyclicSector(gear, MATERIAL, SIZE))
    direct = flank_compliance(CyclicSector(gear, MATERIAL, FINER), split=False)
    for tooth in (-2, -1, 1, 2):
        one, two = (
            split.normal[MAX_TOOTH_OFFSET + tooth],
            direct.normal[MAX_TOOTH_OFFSET + tooth],
        )
        np.testing.assert_allclose(one[2:, 2:], two[1::2, 1::2][2:, 2:], rtol=2e-3)


def test_split_obeys_maxwell_at_second_order_or_better(gear):
    errors = []
    for factor in (0.5, 1.0, 2.0):
        size = MeshSize().refined(factor)
        table = flank_compliance(CyclicSector(gear, MATERIAL, size)).normal[
            MAX_TOOTH_OFFSET
        ]
        # off the sharp corner and the jump of curvature at the form circle
        inner = table[len(table) // 3 : -2, len(table) // 3 : -2]
        errors.append(np.abs(inner - inner.T).max() / np.abs(table).max())
    assert errors[1] < 1e-3
    assert 0.5 * np.log2(errors[0] / errors[2]) > 2.0


def test_root_stress_is_that_of_the_whole_gear(gear):
    """A hat load at mid-flank, direct solve on a fine mesh."""
    fine = WholeGear(gear, MeshSize(flank_edges=60, flank_grading=0.0).refined(1.0))
    node = 25
    mesh = fine.sector
    points, inward = flank_frame(gear, mesh, 0)
    force = np.zeros(fine.basis.N)
    force[fine.freedoms(points[node : node + 1])[0]] = 1e5 * inward[node]
    direct = fine.root_stress(fine.displacement(force))
    load = ToothLoad(
        0, mesh.flank_arcs[1:][[node]], 5e-5, np.array([1e5]), np.array([0.0])
    )
    root = sector_stress(gear, MATERIAL, [load]).root_stress
    assert root == pytest.approx(direct, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("teeth", "shift"), [(10, 0.5), (12, 0.4), (17, 0.8), (38, 0.0)]
)
def test_root_influence_is_that_of_the_whole_gear(teeth, shift):
    """Nodal stress of a direct solve, its fillet edges a quarter as long."""
    gear = make_gear(teeth, 0.6e-3 * teeth, profile_shift=shift)
    fine = WholeGear(gear, MeshSize(flank_edges=60, flank_grading=0.0, fillet_edges=40))
    influence = root_influence(CyclicSector(gear, MATERIAL))
    points, inward = flank_frame(gear, fine.sector, 0)
    for node in (3, 15, 30, 45):
        force = np.zeros(fine.basis.N)
        force[fine.freedoms(points[node : node + 1])[0]] = 1e5 * inward[node]
        direct = fine.root_stress(fine.displacement(force))
        arc = fine.sector.flank_arcs[1:][node]
        stress = influence.stress([FlankLoad(0, RIGHT, arc, 1e5)])
        assert stress == pytest.approx(direct, rel=0.01)


def test_friction_toward_the_root_relieves_it(gear):
    arcs, normal = np.array([2e-3]), np.array([1e5])
    dry, slipping = (
        sector_stress(gear, MATERIAL, [ToothLoad(0, arcs, 5e-5, normal, f * normal)])
        for f in (0.0, 0.1)
    )
    assert slipping.root_stress < dry.root_stress


def test_stress_below_a_hertzian_contact(gear):
    """von Mises peaks below the surface near 0.786 of the half-width."""
    from validation.oracles import hertz

    b, peak = 1e-4, 8e8
    arcs = 2e-3 + np.linspace(-b, b, 41)
    step = arcs[1] - arcs[0]
    normal = hertz.pressure(arcs - 2e-3, b, peak) * step
    load = ToothLoad(0, arcs, step, normal, np.zeros_like(normal))

    roll = roll_length_at_arc(gear, np.array([2e-3]))
    tangent = flank_tangents(gear, roll)[0]
    inward = np.array([-tangent[1], tangent[0]])
    depth = np.linspace(0.2, 2.0, 181) * b
    line = flank_points(gear, roll) + depth[:, None] * inward
    xx, yy, xy = hat_stresses(load, gear, line).T
    shear = np.hypot(0.5 * (xx - yy), xy)
    assert depth[shear.argmax()] == pytest.approx(0.786 * b, rel=0.02)
    assert shear.max() == pytest.approx(0.300 * peak, rel=0.01)
