"""Operators of a whole gear from one sector against matrices of the whole gear.

The matrices repeat the sector mesh around the axis, merge the nodes on the cuts and
hold the hub. They share the mesh with the program and the order of the freedoms.
"""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make_gear
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh
from scipy.sparse import block_diag, coo_array, csc_array, eye_array, hstack
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementTriP2, ElementVector, MeshTri2
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from fegear.elasticity.cyclic_gear import (
    cyclic_gear,
    multiply_rows,
    sector_array,
    solve_triangular,
)
from fegear.elasticity.flank import (
    MAX_TOOTH_OFFSET,
    flank_compliance,
    rootward_compliance,
)
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.gear_modes import gear_modes
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector
from meshes import MeshSize, sector_mesh
from meshes.profile import flank_points, flank_tangents, roll_length_at_arc, turn

STEEL = PlaneMaterial(206e9, 0.3)
DENSITY = 7850.0
SIZE = MeshSize(
    flank_edges=6, flank_grading=2.0, fillet_edges=3, tooth_size=0.6, hub_size=2.4
)
STEP = (4.0 / 2e-7**2, 1.0)  # M and K of a time step


def small_gear(teeth):
    reference = 0.5 * 2.54e-3 * teeth
    return make_gear(teeth, 5e-3, profile_shift=0.4, tip_radius=reference + 3.36e-3)


class Explicit:
    """Matrices over the fields of `CyclicGear`, flattened by rows."""

    def __init__(self, gear):
        self.gear, self.sector = gear, sector_mesh(gear, SIZE)
        angles = 2.0 * np.pi * np.arange(gear.teeth) / gear.teeth
        copies = np.vstack([turn(self.sector.points, a) for a in angles])
        near = cKDTree(copies).query_ball_point(copies, 1e-9)
        unique_nodes, merged = np.unique([min(n) for n in near], return_inverse=True)
        shift = len(self.sector.points) * np.arange(gear.teeth)[:, None, None]
        triangles = (self.sector.triangles[None] + shift).reshape(-1, 6)
        mesh = MeshTri2(copies[unique_nodes].T.copy(), merged[triangles].T.copy())
        basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
        fine = Basis(mesh, ElementVector(ElementTriP2()), intorder=6)
        E, nu = 206e9, 0.3
        law = linear_elasticity(E * nu / (1 - nu**2), 0.5 * E / (1 + nu))
        form = BilinearForm(lambda u, v, _: DENSITY * dot(u, v))
        self.full_mass = form.assemble(fine)
        self.places = basis.doflocs.T
        self.along_y = np.isin(np.arange(basis.N), basis.split_indices()[1])
        self.fields = self._fields()
        self.stiffness = self.fields.T @ law.assemble(basis) @ self.fields
        self.mass = self.fields.T @ self.full_mass @ self.fields

    def _fields(self):
        """(freedoms of the whole gear, sector_size * teeth), orthonormal columns."""
        model, teeth = CyclicSector(self.gear, STEEL, SIZE), self.gear.teeth
        along_y = np.isin(
            np.arange(model.basis.N), model.basis.split_indices()[1]
        ).astype(int)
        left_cut = model.cut[: len(model.cut) // 2]
        rows, columns, entries = [], [], []
        for k in range(teeth):
            angle = 2.0 * np.pi * k / teeth
            directions = turn(np.eye(2), angle)[along_y[model.interior]]
            places = turn(model.locations[model.interior], angle)
            cut = turn(model.locations[left_cut], angle)
            radial = cut / np.hypot(*cut.T)[:, None]
            clockwise = np.stack([radial[:, 1], -radial[:, 0]], axis=1)
            polar = np.where(along_y[left_cut, None] == 0, radial, clockwise)
            pairs = self.freedoms(np.vstack([places, cut]))
            sector_size = len(pairs)
            rows.append(pairs.ravel())
            columns.append(np.repeat(np.arange(sector_size) * teeth + k, 2))
            entries.append(np.vstack([directions, polar]).ravel())
        where = np.concatenate(rows), np.concatenate(columns)
        shape = (len(self.places), sector_size * teeth)
        return csc_array(coo_array((np.concatenate(entries), where), shape=shape))

    def freedoms(self, points):
        """(n, 2) freedoms x, y at points."""
        pairs = cKDTree(self.places).query_ball_point(points, 1e-9)
        return np.array([sorted(pair, key=lambda d: self.along_y[d]) for pair in pairs])

    @property
    def turned(self):
        """Unit clockwise turn of all nodes."""
        x, y = self.places.T
        return np.where(self.along_y, -x, y)


@pytest.fixture(scope="module", params=[12, 13], ids=["even", "odd"])
def explicit(request):
    return Explicit(small_gear(request.param))


@pytest.fixture(scope="module")
def gear(explicit):
    return cyclic_gear(CyclicSector(explicit.gear, STEEL, SIZE), DENSITY)


@pytest.fixture(scope="module")
def factors(gear):
    return gear.factorised(*STEP)


def random_field(gear, seed=0):
    return np.random.default_rng(seed).standard_normal((gear.unknowns, gear.teeth))


def close(actual, desired, rtol):
    scale = np.abs(desired).max()
    np.testing.assert_allclose(actual, desired, rtol=0.0, atol=rtol * scale)


def test_fields_are_all_freedoms_off_the_hub_once(gear, explicit):
    products = explicit.fields.T @ explicit.fields
    count = gear.unknowns * gear.teeth
    assert products.shape == (count, count)
    assert np.abs((products - eye_array(count)).data).max() < 1e-12
    radius = np.hypot(*explicit.places.T)
    free = np.count_nonzero(radius > explicit.gear.hub_radius * (1 + 1e-6))
    assert count == free


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_products_are_those_of_the_cyclic_gear(gear, explicit, seed):
    u = random_field(gear, seed)
    for times, matrix in (
        (gear.stiffness_times, explicit.stiffness),
        (gear.mass_times, explicit.mass),
    ):
        close(times(u), (matrix @ u.ravel()).reshape(u.shape), 1e-10)


@pytest.mark.parametrize("weights", [STEP, (0.0, 1.0), (1.0, 0.0)])
def test_solution_is_that_of_the_cyclic_gear(gear, explicit, weights):
    load = random_field(gear)
    matrix = csc_array(weights[0] * explicit.mass + weights[1] * explicit.stiffness)
    direct = splu(matrix).solve(load.ravel()).reshape(load.shape)
    close(gear.factorised(*weights).solve(load), direct, 1e-9)


@given(seed=st.integers(0, 2**32 - 1), steps=st.floats(1e-9, 1e-3))
@settings(max_examples=10, deadline=None)
def test_solution_returns_the_load(gear, seed, steps):
    load, inertia = random_field(gear, seed), 4.0 / steps**2
    u = gear.factorised(inertia, 1.0).solve(load)
    close(inertia * gear.mass_times(u) + gear.stiffness_times(u), load, 1e-9)


def test_arguments_are_left_alone(gear, factors):
    u = random_field(gear)
    before = u.copy()
    gear.stiffness_times(u), gear.mass_times(u), factors.solve(u)
    np.testing.assert_array_equal(u, before)


def test_operators_are_symmetric_and_positive(gear, factors):
    for times in (gear.stiffness_times, gear.mass_times, factors.solve):
        for seed in range(3):
            u, v = random_field(gear, seed), random_field(gear, seed + 10)
            there, back = np.vdot(u, times(v)), np.vdot(v, times(u))
            scale = np.linalg.norm(u) * np.linalg.norm(times(v))
            assert abs(there - back) < 1e-12 * scale
            assert np.vdot(u, times(u)) > 0.0


def test_a_turn_by_one_tooth_turns_the_answer(gear, factors):
    load = random_field(gear)
    for operator in (gear.stiffness_times, gear.mass_times, factors.solve):
        expected = np.roll(operator(load), 1, axis=1)
        close(operator(np.roll(load, 1, axis=1)), expected, 1e-12)


def as_operator(function, gear):
    shape = gear.unknowns, gear.teeth
    return LinearOperator(
        (gear.unknowns * gear.teeth,) * 2,
        matvec=lambda u: function(u.reshape(shape)).ravel(),
        dtype=float,
    )


def test_lowest_frequencies_and_couplings_are_those_of_the_modes(gear, explicit):
    modes = gear_modes(CyclicSector(explicit.gear, STEEL, SIZE), DENSITY, 150e3)
    count = len(modes.frequencies_Hz)
    assert count > 5
    values, vectors = eigsh(
        as_operator(gear.stiffness_times, gear),
        count,
        as_operator(gear.mass_times, gear),
        sigma=0.0,
        OPinv=as_operator(gear.factorised(0.0, 1.0).solve, gear),
        v0=random_field(gear).ravel(),
    )
    order = np.argsort(values)
    frequency = np.sqrt(values[order]) / (2.0 * np.pi)
    np.testing.assert_allclose(frequency, modes.frequencies_Hz, rtol=1e-8)
    momentum = np.repeat(gear.momentum, gear.teeth)
    axial = modes.nodal_diameters == 0
    coupling = np.abs(momentum @ vectors[:, order])
    scale = np.sqrt(modes.inertia)
    np.testing.assert_allclose(
        coupling[axial], np.abs(modes.rotation_coupling[axial]), atol=1e-8 * scale
    )
    assert coupling[~axial].max() < 1e-7 * scale
    assert gear.inertia == pytest.approx(modes.inertia, rel=1e-12)
    assert gear.mass == pytest.approx(modes.mass, rel=1e-12)


def test_turn_and_its_momentum_are_those_of_the_cyclic_gear(gear, explicit):
    rigid_turn = explicit.turned
    rotation = (explicit.fields.T @ rigid_turn).reshape(gear.unknowns, gear.teeth)
    close(np.repeat(gear.rotation[:, None], gear.teeth, axis=1), rotation, 1e-10)
    momentum = explicit.fields.T @ (explicit.full_mass @ rigid_turn)
    close(
        np.repeat(gear.momentum[:, None], gear.teeth, axis=1),
        momentum.reshape(gear.unknowns, gear.teeth),
        1e-10,
    )
    assert gear.inertia == pytest.approx(
        rigid_turn @ explicit.full_mass @ rigid_turn, rel=1e-10
    )


def test_momentum_differs_from_that_of_the_free_nodes_at_the_hub_only(gear):
    """Nodes on the hub turn too and share their elements' mass with others."""
    everywhere = np.repeat(gear.rotation[:, None], gear.teeth, axis=1)
    missing = gear.momentum - gear.mass_times(everywhere)[:, 0]
    differ = np.abs(missing) > 1e-9 * np.abs(gear.momentum).max()
    assert 0 < np.count_nonzero(differ) < 0.2 * gear.unknowns
    share = gear.teeth * gear.momentum @ gear.rotation / gear.inertia
    assert share == pytest.approx(1.0, abs=2e-2)


@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_point_loads_give_the_compliance_of_the_flank(gear, explicit, side):
    static = gear.factorised(0.0, 1.0)
    compliance = flank_compliance(CyclicSector(explicit.gear, STEEL, SIZE), split=False)
    points = gear.flanks[side]
    for j in (1, 4):
        load = np.zeros((gear.unknowns, gear.teeth))
        load[points.dofs[j], 5] = points.inward[j]
        u = static.solve(load)[points.dofs]
        for offset in range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1):
            # the left flank sees the mirror image of the gear
            tooth = 5 + (offset if side == RIGHT else -offset)
            normal = np.einsum("ic,ic->i", u[:, :, tooth], points.inward)
            root = np.einsum("ic,ic->i", u[:, :, tooth], points.rootward)
            close(normal, compliance.normal[MAX_TOOTH_OFFSET + offset][:, j], 1e-9)
            close(root, compliance.tangential[MAX_TOOTH_OFFSET + offset][:, j], 1e-9)


def test_loads_toward_the_root_give_the_rootward_compliance(gear, explicit):
    """By Maxwell's theorem also its normal displacement is that of the flank."""
    static, sector = gear.factorised(0.0, 1.0), CyclicSector(explicit.gear, STEEL, SIZE)
    rootward = rootward_compliance(sector, split=False)
    reverse = flank_compliance(sector, split=False).tangential[::-1]
    points = gear.flanks[RIGHT]
    for j in (1, 4):
        load = np.zeros((gear.unknowns, gear.teeth))
        load[points.dofs[j], 5] = points.rootward[j]
        u = static.solve(load)[points.dofs]
        for offset in range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1):
            normal = np.einsum("ic,ic->i", u[:, :, 5 + offset], points.inward)
            root = np.einsum("ic,ic->i", u[:, :, 5 + offset], points.rootward)
            close(root, rootward[MAX_TOOTH_OFFSET + offset][:, j], 1e-9)
            close(normal, reverse[MAX_TOOTH_OFFSET + offset][j], 1e-9)


def test_rootward_compliance_is_smooth_under_its_load():
    """Without the half-plane's kernel, as the table of normal loads is."""
    sector = CyclicSector(make_gear(24, 15e-3), STEEL)
    table = rootward_compliance(sector)[MAX_TOOTH_OFFSET]
    middle = range(len(table) // 2, len(table) - 3)
    beside = [0.5 * (table[i, i - 1] + table[i, i + 1]) for i in middle]
    at_load = [table[i, i] for i in middle]
    # of the 1.3 / (pi E') by which the half-plane's surface moves there
    np.testing.assert_allclose(
        at_load, beside, atol=0.1 * 1.3 / (np.pi * STEEL.modulus)
    )
    assert np.abs(table - table.T).max() < 1e-2 * np.abs(table).max()


def normal_at(points, length, grading, u, arcs):
    """Inward displacement at arcs of a flank, from a column of the field."""
    index, weights = flank_stencils(arcs, length, grading, len(points.arcs))
    at_points = np.einsum("ic,ic->i", u[points.dofs], points.inward)
    return np.einsum("ia,ia->i", weights, at_points[index])


@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_flank_points_read_themselves(gear, explicit, side):
    points, u = gear.flanks[side], random_field(gear)[:, 3]
    grid = explicit.gear.flank_length, SIZE.flank_grading
    direct = np.einsum("ic,ic->i", u[points.dofs], points.inward)
    close(normal_at(points, *grid, u, points.arcs), direct, 1e-10)


@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_rigid_motion_is_read_between_points(explicit, side):
    """Lever arms of the normals: the base radius of a turn, also between points."""
    errors = []
    for factor in (2.0, 4.0):
        size = SIZE.refined(factor)
        fine = cyclic_gear(CyclicSector(explicit.gear, STEEL, size), DENSITY)
        arcs = np.linspace(0.3, 0.95, 12) * explicit.gear.flank_length
        grid = explicit.gear.flank_length, size.flank_grading
        arm = normal_at(fine.flanks[side], *grid, fine.rotation, arcs)
        roll = roll_length_at_arc(explicit.gear, arcs)
        tangent = flank_tangents(explicit.gear, roll)
        x, y = flank_points(explicit.gear, roll).T
        sign = 1.0 if side == RIGHT else -1.0
        exact = sign * (-tangent[:, 1] * y - tangent[:, 0] * x)
        close(np.abs(exact), explicit.gear.base_radius * np.ones(12), 1e-9)
        errors.append(np.abs(arm - exact).max() / explicit.gear.base_radius)
    assert errors[0] < 1e-5
    assert errors[1] < 1e-6


def test_kernel_and_python_agree(gear, factors):
    load = np.random.default_rng(0).standard_normal(
        (2 * gear.unknowns - gear.n_interior, 3)
    )
    for rows in (factors.forward, factors.backward):
        close(
            solve_triangular(*rows, load.copy()),
            solve_triangular.py_func(*rows, load.copy()),
            1e-13,
        )
    mass = gear.mass_matrix.indptr, gear.mass_matrix.indices, gear.mass_matrix.data
    close(multiply_rows(*mass, load), multiply_rows.py_func(*mass, load), 1e-13)


def test_between_elimination_and_substitution_loads_are_read_and_added(gear, factors):
    """As in a step, where the loads follow from displacement without them."""
    random = np.random.default_rng(1)
    load, teeth = random_field(gear), np.array([3, 0, gear.teeth - 1])
    added = np.zeros((factors.rows, teeth.size))
    added[: gear.unknowns] = random.standard_normal((gear.unknowns, teeth.size))
    x = sector_array(factors.rows, gear.teeth)
    x[: gear.unknowns, : gear.teeth] = load
    factors.eliminate(x)
    condensed = factors.condense(added)
    work = [row @ x[:, tooth] for row, tooth in zip(condensed, teeth, strict=True)]
    without = factors.solve(load)[:, teeth]
    close(np.array(work), (added[: gear.unknowns] * without).sum(axis=0), 1e-11)
    factors.add_loads(x, condensed, teeth)
    factors.substitute(x)
    load[:, teeth] += added[: gear.unknowns]
    close(x[: gear.unknowns, : gear.teeth], factors.solve(load), 1e-11)
    right_cuts = np.roll(x[gear.n_interior : gear.unknowns, : gear.teeth], -1, axis=1)
    close(x[gear.unknowns :, : gear.teeth], right_cuts, 1e-15)
    assert not x[:, gear.teeth :].any()


def test_mass_of_sector_arrays_is_that_of_fields(gear, factors):
    """Of both sides of a cut together; what follows the teeth stays zero."""
    u, x = random_field(gear), sector_array(factors.rows, gear.teeth)
    x[: gear.unknowns, : gear.teeth] = u
    x[gear.unknowns :, : gear.teeth] = np.roll(u[gear.n_interior :], -1, axis=1)
    momenta = gear.sector_mass_times(x)
    assert not momenta[:, gear.teeth :].any()
    left = momenta[: gear.unknowns, : gear.teeth]
    left[gear.n_interior :] += np.roll(
        momenta[gear.unknowns :, : gear.teeth], 1, axis=1
    )
    close(left, gear.mass_times(u), 1e-14)


def test_wrong_arguments_are_named(gear, factors, explicit):
    with pytest.raises(ValueError, match=r"shape of u = \(3, 2\); must be"):
        gear.mass_times(np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"shape of load = .*; must be"):
        factors.solve(np.zeros((gear.unknowns, 1)))
    for weights in ((0.0, 0.0), (-1.0, 1.0), (1.0, np.nan), (np.inf, 1.0)):
        with pytest.raises(ValueError, match="mass_factor, stiffness_factor = "):
            gear.factorised(*weights)
    with pytest.raises(ValueError, match=r"density = .*; must be positive"):
        cyclic_gear(CyclicSector(explicit.gear, STEEL, SIZE), -1.0)


@pytest.mark.slow
def test_free_gear_vibrates_as_the_cyclic_gear_does():
    """Hub free to turn, which only concerns waves that are equal in all sectors."""
    explicit, hub = Explicit(small_gear(12)), 2e-6  # inertia of the hub itself [kg m]
    # independent: the nodes on the hub turn with it as one
    free = hstack([explicit.fields, csc_array(explicit.turned[:, None])])
    mass = (free.T @ explicit.full_mass @ free).tolil()
    mass[-1, -1] += hub
    stiffness = block_diag([explicit.stiffness, csc_array((1, 1))], format="csc")
    values = eigsh(stiffness, 60, mass.tocsc(), sigma=-1e6, return_eigenvectors=False)
    expected = np.sqrt(np.sort(values)[1:])

    gear = cyclic_gear(CyclicSector(explicit.gear, STEEL, SIZE), DENSITY)
    K, M = np.zeros((2, gear.unknowns + 1, gear.unknowns + 1))
    for i in range(gear.unknowns):
        equal = np.zeros((gear.unknowns, gear.teeth))
        equal[i] = 1.0
        K[:-1, i] = gear.stiffness_times(equal).sum(axis=1)
        M[:-1, i] = gear.mass_times(equal).sum(axis=1)
    M[-1, :-1] = M[:-1, -1] = gear.teeth * gear.momentum
    M[-1, -1] = gear.inertia + hub
    frequencies = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=[1, 3]))
    frequencies = frequencies[frequencies < expected[-1]]
    assert frequencies.size > 1
    deviation = np.abs(frequencies[:, None] / expected - 1.0).min(axis=1)
    assert (deviation < 1e-6).all()

    errors = [
        np.abs(
            free_modes(explicit.gear, cutoff, hub)[: frequencies.size] / frequencies
            - 1.0
        ).max()
        for cutoff in (2.0 * frequencies[-1], 8.0 * frequencies[-1])
    ]
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] < 1e-3


def free_modes(gear, cutoff, hub):
    """Angular frequencies with the hub free, from the modes with the hub held."""
    modes = gear_modes(CyclicSector(gear, STEEL, SIZE), DENSITY, cutoff / (2.0 * np.pi))
    standing = modes.nodal_diameters == 0
    coupling = modes.rotation_coupling[standing]
    M = np.eye(coupling.size + 1)
    M[-1, -1] = modes.inertia + hub
    M[-1, :-1] = M[:-1, -1] = coupling
    K = np.diag([*(2.0 * np.pi * modes.frequencies_Hz[standing]) ** 2, 0.0])
    return np.sqrt(eigh(K, M, eigvals_only=True)[1:])
