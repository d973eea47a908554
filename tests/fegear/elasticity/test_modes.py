"""Modes from one sector against a whole gear, a thick ring and statics.

See `whole_gear` for what the whole gear shares with the program.
"""

from __future__ import annotations

from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest
from oracles.thick_ring_modes import ThickRing, frequencies
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve
from whole_gear import (
    COARSE,
    DENSITY,
    STEEL,
    WholeGear,
    require_same_shapes,
    same_frequency,
    small_gear,
)

from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.gear_modes import cyclic_modes, gear_modes, mode_counts
from fegear.elasticity.ring import nodal_diameter_phase
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector
from meshes import MeshSize, SectorMesh, sector_mesh
from meshes.profile import polar

CUTOFF = 200e3  # modes at every n, of body and teeth


@pytest.fixture(scope="module")
def gear():
    return small_gear(12)


@pytest.fixture(scope="module")
def sector(gear):
    return CyclicSector(gear, STEEL, COARSE)


@pytest.fixture(scope="module")
def modes(gear):
    return gear_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, CUTOFF)


@pytest.fixture(scope="module")
def whole(gear):
    return WholeGear(gear, COARSE, CUTOFF)


def test_frequencies_are_those_of_the_whole_gear(modes, whole):
    assert len(modes.frequencies_Hz) == 29
    np.testing.assert_allclose(modes.frequencies_Hz, whole.frequencies, rtol=1e-8)
    assert set(modes.nodal_diameters) == set(range(7))


def test_odd_number_of_teeth():
    odd = small_gear(13)
    body_modes = gear_modes(CyclicSector(odd, STEEL, COARSE), DENSITY, CUTOFF)
    direct = WholeGear(odd, COARSE, CUTOFF).frequencies
    np.testing.assert_allclose(body_modes.frequencies_Hz, direct, rtol=1e-8)


@pytest.mark.parametrize("side", [RIGHT, LEFT])
@pytest.mark.parametrize("tooth", [0, 1, 5, -3])
def test_shapes_are_those_of_the_whole_gear(modes, whole, tooth, side):
    require_same_shapes(modes, whole, tooth, side)


def test_coupling_with_the_hub_is_that_of_the_whole_gear(modes, whole):
    rigid = whole.rigid()
    direct = whole.fields.T @ (whole.mass @ rigid)
    ring = np.column_stack([modes.rotation_coupling, modes.translation_coupling])
    for group in same_frequency(modes.frequencies_Hz):
        one, two = ring[group].T @ ring[group], direct[group].T @ direct[group]
        scale = np.sqrt([modes.inertia, modes.mass, modes.mass])
        np.testing.assert_allclose(
            one / scale / scale[:, None], two / scale / scale[:, None], atol=1e-9
        )
    inertia, *mass = np.einsum("ic,ic->c", rigid, whole.mass @ rigid)
    assert modes.inertia == pytest.approx(inertia, rel=1e-11)
    assert [modes.mass] * 2 == pytest.approx(mass, rel=1e-11)


def test_only_two_kinds_of_waves_couple_with_the_hub(modes, whole):
    """In the whole gear, where nothing says so."""
    direct = whole.fields.T @ (whole.mass @ whole.rigid())
    direct /= np.sqrt([modes.inertia, modes.mass, modes.mass])
    for group in same_frequency(modes.frequencies_Hz):
        n = modes.nodal_diameters[group][0]
        if n != 0:
            assert np.abs(direct[group, 0]).max() < 1e-9
        if n != 1:
            assert np.abs(direct[group, 1:]).max() < 1e-9


def test_pairs_are_symmetric_and_antisymmetric(modes):
    paired = (modes.nodal_diameters > 0) & (2 * modes.nodal_diameters < modes.teeth)
    right, left = (modes.normal_at(0, side)[paired] for side in (RIGHT, LEFT))
    scale = np.abs(right).max()
    np.testing.assert_allclose(left[0::2], right[0::2], atol=1e-8 * scale)
    np.testing.assert_allclose(left[1::2], -right[1::2], atol=1e-8 * scale)
    first = np.flatnonzero(modes.nodal_diameters == 1)[:2]
    shift = modes.translation_coupling[first] / np.sqrt(modes.mass)
    assert np.abs(np.diag(shift)).max() < 1e-9  # symmetric: along y; the other: x
    assert abs(shift[0, 1]) == pytest.approx(abs(shift[1, 0]), rel=1e-9) != 0.0


def constrained_matrices(sector, n):
    constraint = sector.cyclic_constraint(nodal_diameter_phase(n, sector.gear.teeth))
    matrices = sector.stiffness, sector.mass(DENSITY)
    return [(constraint.conj().T @ A @ constraint).toarray() for A in matrices]


@pytest.mark.slow
@pytest.mark.parametrize("cutoff", [20e3, 60e3, 200e3, 700e3])
def test_count_is_that_of_the_unskipped_problem(sector, cutoff):
    """At 700 kHz the inner freedoms alone have modes below the cut-off."""
    counts = mode_counts(sector, sector.mass(DENSITY), cutoff)
    for n, count in enumerate(counts):
        values = eigh(*constrained_matrices(sector, n), eigvals_only=True)
        assert count == np.count_nonzero(values < (2.0 * np.pi * cutoff) ** 2)


def test_count_says_which_nodal_diameters_are_skipped(sector):
    mass = sector.mass(DENSITY)
    families = list(cyclic_modes(sector, mass, 50e3))
    counts = mode_counts(sector, mass, 50e3)
    assert [len(modes.omega) for modes in families] == list(counts)
    assert any(len(modes.omega) == 0 for modes in families)
    all_families = list(cyclic_modes(sector, mass, CUTOFF))
    for modes, more in zip(families, all_families, strict=True):
        below = more.omega[more.omega < 2.0 * np.pi * 50e3]
        np.testing.assert_allclose(modes.omega, below, rtol=1e-10)


def test_effective_inertia_grows_to_that_of_the_free_nodes(gear, sector):
    """Sum of couplings squared over all modes: what is not the held hub's own."""
    mass = sector.mass(DENSITY)
    K, M = constrained_matrices(sector, 0)
    _, vectors = eigh(K, M)
    ties = sector.cyclic_constraint(1.0)
    momentum = ties.T @ (mass @ sector.rigid_body_modes[:, 0])
    inertias = gear.teeth * np.cumsum((vectors.T @ momentum) ** 2)
    limits = [
        gear_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, f) for f in (80e3, 300e3)
    ]
    for body_modes in limits:
        axial = body_modes.rotation_coupling[body_modes.nodal_diameters == 0]
        np.testing.assert_allclose(
            np.cumsum(axial**2), inertias[: len(axial)], rtol=1e-8
        )
    limit = gear.teeth * momentum @ spsolve((ties.T @ mass @ ties).tocsc(), momentum)
    assert inertias[-1] == pytest.approx(limit, rel=1e-10)
    shares = [np.sum(m.rotation_coupling**2) / m.inertia for m in limits]
    assert 0.9 < shares[0] < shares[1] < inertias[-1] / limits[0].inertia < 1.0


def test_effective_mass_is_nearly_all_and_alike_in_all_directions(gear):
    body_modes = gear_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, 600e3)
    share = np.sum(body_modes.translation_coupling**2, axis=0) / body_modes.mass
    assert share[0] == pytest.approx(share[1], rel=1e-9)
    assert 0.96 < share[0] < 1.0


@pytest.mark.slow
def test_frequencies_converge_from_above_at_third_order(gear):
    """The corners of the tips cost one of the four orders of a smooth body."""
    base = MeshSize(
        flank_edges=6, flank_grading=0.0, fillet_edges=3, tooth_size=0.5, hub_size=0.4
    )
    coarse, middle, fine = (
        gear_modes(
            CyclicSector(gear, STEEL, base.refined(f)), DENSITY, 110e3
        ).frequencies_Hz
        for f in (1.0, 2.0, 4.0)
    )
    assert len(coarse) == len(fine) == 16
    assert (coarse > middle).all()
    assert (middle > fine).all()
    order = np.log2((coarse - middle) / (middle - fine))
    assert np.median(order) == pytest.approx(3.0, abs=0.3)
    assert order.min() > 2.5


@pytest.fixture(scope="module")
def static(gear):
    return flank_compliance(CyclicSector(gear, STEEL, COARSE), split=False).normal


def test_sum_of_modes_tends_to_the_static_compliance(gear, static):
    """Under even pressure on a flank: from below on the loaded tooth, where local
    deflection is slow to come, and fast on the others."""
    load = np.diff(sector_mesh(gear, COARSE).flank_arcs)
    missing = []
    for cutoff in (100e3, 400e3, 1600e3):
        body_modes = gear_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, cutoff)
        force = (
            body_modes.normal_at(0)
            @ load
            / (2.0 * np.pi * body_modes.frequencies_Hz) ** 2
        )
        missing.append(
            [
                1.0
                - force
                @ (body_modes.normal_at(k) @ load)
                / (load @ static[MAX_TOOTH_OFFSET + k] @ load)
                for k in (0, 1, -2)
            ]
        )
    loaded, *others = np.array(missing).T
    assert (loaded > 0.0).all()
    assert (np.diff(np.log2(loaded)) < -0.7).all()
    assert np.abs(others)[:, 0].max() < 0.04
    assert np.abs(others)[:, 1:].max() < 2e-3


def test_static_twist_under_a_smooth_load_needs_few_modes(gear, sector):
    """Inertial load of a steady angular acceleration of the hub."""
    stiffness, _ = constrained_matrices(sector, 0)
    ties = sector.cyclic_constraint(1.0)
    load = ties.T @ (sector.mass(DENSITY) @ sector.rigid_body_modes[:, 0])
    exact = gear.teeth * load @ np.linalg.solve(stiffness, load)
    missing = []
    for cutoff in (40e3, 200e3, 800e3):
        body_modes = gear_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, cutoff)
        omega = 2.0 * np.pi * body_modes.frequencies_Hz
        missing.append(
            1.0 - np.sum((body_modes.rotation_coupling / omega) ** 2) / exact
        )
    assert 1e-2 > missing[0] > missing[1] > missing[2] > 0.0
    assert missing[2] < 1e-5


class RingSector(CyclicSector):
    """A sector without a tooth on a mesh of its own."""

    @cached_property
    def mesh(self):
        return ring_mesh(RING, self.gear.teeth, *self.size)


def ring_sector(radial, angular, teeth=12):
    gear = SimpleNamespace(teeth=teeth, pitch_angle=2.0 * np.pi / teeth)
    return RingSector(gear, STEEL, (radial, angular))


def ring_mesh(ring, teeth, radial, angular):
    """Sector without a tooth, `radial` x `angular` x 2 triangles."""
    radius = np.linspace(ring.hub_radius, ring.outer_radius, 2 * radial + 1)
    angle = np.linspace(-np.pi / teeth, np.pi / teeth, 2 * angular + 1)
    points = polar(radius[:, None], angle[None, :]).reshape(-1, 2)
    node = np.arange(len(points)).reshape(len(radius), len(angle))

    def sub(i, j):
        return node[i : i + 2 * radial - 1 : 2, j : j + 2 * angular - 1 : 2].ravel()

    lower = [(0, 0), (0, 2), (2, 2), (0, 1), (1, 2), (1, 1)]
    upper = [(0, 0), (2, 2), (2, 0), (1, 1), (2, 1), (1, 0)]
    triangles = np.vstack(
        [np.stack([sub(*ij) for ij in tri], axis=1) for tri in (lower, upper)]
    )

    def chain(nodes):
        return np.stack([nodes[:-2:2], nodes[2::2], nodes[1::2]], axis=1)

    hub = chain(node[0])
    edges = {"left_cut": chain(node[:, 0]), "cut": chain(node[:, -1])}
    edges |= {"left_hub": hub[: angular // 2], "hub": hub[angular // 2 :]}
    return SectorMesh(points, triangles, edges, node[0], radius)


RING = ThickRing(
    hub_radius=20e-3,
    outer_radius=66e-3,
    young_modulus=206e9,
    poisson_ratio=0.3,
    density=DENSITY,
)


def test_ring_without_teeth_is_the_closed_form_at_fourth_order():
    highest, errors = 36e3, []
    exact = [frequencies(RING, n, highest) for n in range(7)]
    for refined in (1, 2, 4):
        sector = ring_sector(4 * refined, 2 * refined)
        families = list(cyclic_modes(sector, sector.mass(DENSITY), highest))
        assert [len(w.omega) for w in families] == [len(f) for f in exact]
        both = np.concatenate([w.omega for w in families]), np.concatenate(exact)
        errors.append(both[0] / (2.0 * np.pi * both[1]) - 1.0)
    errors = np.array(errors)
    assert (errors > 0.0).all()
    assert errors[-1].max() < 2e-5
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders[1].min() > 3.7
    assert orders.max() < 4.1


def test_held_hub_keeps_less_inertia_on_a_finer_mesh():
    """What no mode carries is the mass of the hub nodes: one layer of elements."""
    hub_shares = []
    for refined in (1, 2, 4):
        sector = ring_sector(4 * refined, 2)
        mass, rigid_turn = sector.mass(DENSITY), sector.rigid_body_modes[:, 0]
        ties = sector.cyclic_constraint(1.0)
        load = ties.T @ (mass @ rigid_turn)
        modal_inertia = load @ spsolve((ties.T @ mass @ ties).tocsc(), load)
        hub_shares.append(1.0 - modal_inertia / (rigid_turn @ mass @ rigid_turn))
    assert np.diff(np.log2(hub_shares)) == pytest.approx(-1.0, abs=0.2)
    assert 0.0 < hub_shares[-1] < 1e-3


def test_nothing_below_the_first_mode(gear):
    body_modes = gear_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, 1e3)
    assert body_modes.normal.shape == (0, 2, 6)
    assert body_modes.translation_coupling.shape == (0, 2)
    assert body_modes.normal_at(3).shape == (0, 6)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, np.nan, np.inf])
def test_cutoff_is_checked(gear, cutoff):
    with pytest.raises(ValueError, match="cutoff_Hz"):
        gear_modes(CyclicSector(gear, STEEL), DENSITY, cutoff)
