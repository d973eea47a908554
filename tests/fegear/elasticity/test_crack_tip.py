"""Stress intensities and energy release rate against closed forms of an edge crack."""

from __future__ import annotations

import math

import numpy as np
import pytest
from skfem import condense, solve
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity.boundary import edge_quadrature
from fegear.elasticity.crack_tip import tip_field
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.plane_elements import dofs_of_nodes, plane_basis
from meshes.cracked_region import CrackLine, mesh_cracked_region

STRESS, STRAIN = (PlaneMaterial(2.0, 0.3, plane) for plane in ("stress", "strain"))
WIDTH, HALF_HEIGHT = 1.0, 2.0


def rectangle(edge):
    """Vertices of a strip counterclockwise, and the row of its right side's middle."""
    along, across = round(HALF_HEIGHT / edge), round(WIDTH / edge)
    y = np.linspace(-HALF_HEIGHT, HALF_HEIGHT, 2 * along + 1)
    x = np.linspace(0.0, WIDTH, across + 1)
    sides = [
        np.stack([np.full_like(y, WIDTH), y], axis=1),
        np.stack([x[::-1], np.full_like(x, HALF_HEIGHT)], axis=1),
        np.stack([np.zeros_like(y), y[::-1]], axis=1),
        np.stack([x, np.full_like(x, -HALF_HEIGHT)], axis=1),
    ]
    return np.vstack([side[:-1] for side in sides]), along


class Strip:
    """Strip with an edge crack from its right side, loaded at both ends."""

    def __init__(self, depth, material=STRESS, angle=0.0, edge=0.1, bends=()):
        vertices, mouth = rectangle(edge)
        tip = [WIDTH - depth * math.cos(angle), -depth * math.sin(angle)]
        corners = np.array([[WIDTH, 0.0], *bends, tip])
        line = CrackLine("crack", mouth, corners, 0.25 * depth, edge)
        midpoints = 0.5 * (vertices + np.roll(vertices, -1, axis=0))
        self.mesh = mesh = mesh_cracked_region(vertices, midpoints, [line])
        self.material = material
        self.basis = plane_basis(mesh.points, mesh.triangles, 2)
        self.dofs = dofs_of_nodes(self.basis, mesh.triangles, 2)
        self.stiffness = linear_elasticity(*material.lame).assemble(self.basis)
        self.tip = tip_field(
            mesh.points, mesh.triangles, self.dofs, mesh.tips[0], material
        )

    def solve(self, tension):
        """Displacement under tension(x) at both ends, and the load."""
        points, force = self.mesh.points, np.zeros(self.basis.N)
        for y in (-HALF_HEIGHT, HALF_HEIGHT):
            at_end = (np.abs(points[self.mesh.loop[:, :2], 1] - y) < 1e-9).all(axis=1)
            edges = self.mesh.loop[at_end]
            end = edge_quadrature(points, edges, self.dofs, self.basis.N)
            stress = math.copysign(1.0, y) * tension(end.points[:, 0])
            # edges run counterclockwise here; the sign of their lengths does not matter
            force += end.operator @ np.concatenate([np.zeros_like(stress), stress])
        corners = [np.argmin(np.hypot(points[:, 0], points[:, 1] - y)) for y in (-2, 2)]
        held = [*self.dofs[corners[0]], self.dofs[corners[1], 0]]
        return solve(*condense(self.stiffness, force, D=np.array(held))), force

    def intensities(self, tension):
        u = self.solve(tension)[0][self.tip.rows]
        rate = self.tip.energy_release_rate(u[:, None])[0]
        return self.tip.interaction @ u, self.tip.correlation @ u, rate


def tension_factor(ratio):
    """Tada, Paris & Irwin, 3rd ed. (2000), 2.10; 0.5 % for any ratio."""
    half = 0.5 * math.pi * ratio
    polynomial = 0.752 + 2.02 * ratio + 0.37 * (1.0 - math.sin(half)) ** 3
    return math.sqrt(math.tan(half) / half) * polynomial / math.cos(half)


def bending_factor(ratio):
    """Gross & Srawley (1965), in Tada, Paris & Irwin 2.13; 0.2 % up to 0.6."""
    return np.polyval([14.0, -13.08, 7.33, -1.40, 1.122], ratio)


def uniform(x):
    return np.ones_like(x)


def linear(x):
    return 2.0 * x / WIDTH - 1.0


LOADS = {"tension": (uniform, tension_factor), "bending": (linear, bending_factor)}


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("ratio", [0.2, 0.3, 0.4, 0.5])
def test_edge_crack_is_that_of_the_closed_form(load, ratio):
    stress, factor = LOADS[load]
    exact = factor(ratio) * math.sqrt(math.pi * ratio * WIDTH)
    interaction, correlation, rate = Strip(ratio * WIDTH).intensities(stress)
    for intensity in (interaction, correlation):
        assert intensity[0] == pytest.approx(exact, rel=0.01)
        assert abs(intensity[1]) < 1e-3 * exact
    assert rate == pytest.approx(exact**2 / STRESS.modulus, rel=0.01)


@pytest.mark.parametrize("material", [STRESS, STRAIN], ids=["stress", "strain"])
@pytest.mark.parametrize("angle", [-0.5, 0.3, 0.7])
def test_inclined_cracks_have_one_rate_by_all_methods(material, angle):
    strip = Strip(0.4, material, angle)
    interaction, correlation, rate = strip.intensities(uniform)
    assert abs(interaction[1]) > 0.05 * interaction[0]
    np.testing.assert_allclose(correlation, interaction, rtol=0.01)
    assert (interaction**2).sum() / material.modulus == pytest.approx(rate, rel=2e-3)


def test_sliding_changes_sign_with_the_mirror_image():
    up, down = (
        Strip(0.4, STRESS, angle).intensities(uniform)[0] for angle in (0.5, -0.5)
    )
    np.testing.assert_allclose(up, down * [1.0, -1.0], rtol=2e-3)


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_rate_is_the_growth_of_the_work_of_the_load(angle):
    """Also that of the faces' sliding: Griffith's balance by differences of energy."""
    depth, step, work = 0.4, 0.02, []
    for length in (depth - step, depth + step):
        u, force = Strip(length, STRESS, angle).solve(uniform)
        work.append(0.5 * u @ force)
    rate = Strip(depth, STRESS, angle).intensities(uniform)[2]
    assert (work[1] - work[0]) / (2.0 * step) == pytest.approx(rate, rel=0.005)


def test_intensities_converge_with_the_mesh():
    fine = Strip(0.3, edge=0.02).intensities(uniform)[0][0]
    errors = [
        abs(Strip(0.3, edge=e).intensities(uniform)[0][0] - fine) for e in (0.2, 0.05)
    ]
    assert errors[1] < 0.5 * errors[0]
    assert errors[0] < 1e-3 * fine


def test_a_rigid_motion_has_no_intensity():
    strip = Strip(0.3, angle=0.4)
    x, y = strip.basis.doflocs
    along_y = np.isin(np.arange(strip.basis.N), strip.basis.split_indices()[1])
    for motion in (along_y, ~along_y, np.where(along_y, x, -y)):
        u = motion.astype(float)[strip.tip.rows]
        for rows in (strip.tip.interaction, strip.tip.correlation):
            assert np.abs(rows @ u).max() < 1e-9
        assert abs(strip.tip.energy_release_rate(u[:, None])[0]) < 1e-12


def test_a_bent_crack_is_meshed_along_its_path():
    bend = [WIDTH - 0.2, 0.05]
    strip = Strip(0.4, bends=[bend], angle=0.2)
    nodes = strip.mesh.points[strip.mesh.faces["crack"][:, :2].ravel()]
    assert np.hypot(*(nodes - bend).T).min() < 1e-12
    interaction, correlation, rate = strip.intensities(uniform)
    assert (interaction**2).sum() / STRESS.modulus == pytest.approx(rate, rel=2e-3)
    np.testing.assert_allclose(correlation[0], interaction[0], rtol=0.01)
