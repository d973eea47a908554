"""Contacts move with the modes of their own gears: the same results as from all modes.

The reference multiplies dense rows of all coordinates, in the steps, and solves for all
coordinates at once, at rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lumped import Settings
from lumped.kernels.arrays import Contacts
from lumped.kernels.coupled_steps import integrate_variations, settle_motion
from lumped.steady.steady_state import new_convergence
from lumped.train import coupled as coupled_model
from lumped.train.coupled import (
    BodyModes,
    CoupledContacts,
    ModalTrain,
    contact_grid,
    contact_loads,
    coupled_steps,
    coupled_system,
    loaded_state,
)
from lumped.train.propagator import LinearPart
from lumped.train.truncation import N_SPEEDS, TruncationModel

POSITIONS, CELLS, REACH = 6, 5, 1e-4  # of a mesh cycle, of a load curve, [m]
STIFFNESS, GROUND, LOAD = 2e8, 1e8, 2000.0  # N/m, N/m, N
FREQUENCY, STEPS = 1500.0, 40  # Hz, per period
CHANGES = 3
TRAINS = {
    "gears": st.integers(2, 4),
    "contacts": st.integers(1, 3),
    "standing": st.integers(0, 1),
    "pairs": st.integers(0, 3),
    "seed": st.integers(0, 2**32 - 1),
}


def random_chain(gears, contacts, standing, pairs, seed):
    """Contacts and springs of a chain of gears of mass 1 kg, the last one grounded."""
    rng = np.random.default_rng(seed)
    count, modes = (gears - 1) * contacts, gears * (standing + 2 * pairs)
    mesh_of = np.repeat(np.arange(gears - 1), contacts)
    of_standing = np.repeat(np.arange(gears), standing)
    of_pairs = np.repeat(np.arange(gears), pairs)
    mode_gears = np.concatenate([of_standing, of_pairs, of_pairs])
    is_pair = np.arange(modes) >= of_standing.size
    frequencies = rng.uniform(3e4, 8e4, of_standing.size + of_pairs.size)
    angular = np.concatenate([frequencies, frequencies[of_standing.size :]])
    touches = (mode_gears == mesh_of[:, None]) | (mode_gears == mesh_of[:, None] + 1)
    E = rng.normal(0.0, 0.3, (count, POSITIONS + 1, modes)) * touches[:, None]
    E[:, -1] = E[:, 0]
    G = np.where(is_pair, 0.0, 0.3)[:, None] * (mode_gears[:, None] == np.arange(gears))
    squares = angular**2
    hubs = (np.arange(gears) == mesh_of[:, None]) * 1.0
    hubs -= np.arange(gears) == mesh_of[:, None] + 1
    rows = np.repeat(hubs[:, None], POSITIONS + 1, axis=1)
    shared = np.abs(mesh_of[:, None] - mesh_of) <= 1
    compliance = shared * 2e-11 + np.eye(count) * 1e-10
    gap = rng.uniform(0.0, 3e-6, (count, POSITIONS + 1))
    gap[:, -1] = gap[:, 0]
    whirl = rng.uniform(0.01, 0.1, of_pairs.size)
    bodies = BodyModes(
        angular=angular,
        damping=0.02 * angular,
        coupling=G,
        mass=np.eye(modes),
        rows=E,
        whirl=np.concatenate([np.zeros(of_standing.size), whirl, whirl]),
        gears=mode_gears,
        nodal_diameters=is_pair.astype(np.int64),
    )
    contact_part = CoupledContacts(
        contacts=_contacts(mesh_of, gap, compliance + _products(E / squares, E)),
        mesh_of=mesh_of,
        pairs=np.arange(count),
        paths=np.tile([-1.0, 1.0], (gears - 1, 1)),
        rows=rows,
        penetration_rate=np.ones(rows.shape[:2]),
        inertia_rows=(E / squares) @ G + 1e-11 * rows,
        work=(G.T / squares) @ G + 1e-11 * np.eye(gears),
        modes=bodies,
    )
    last = (np.arange(gears) == gears - 1) * 1.0
    train = ModalTrain(
        stiffness=np.diag(GROUND * last),
        damping=rng.uniform(1e2, 1e3, gears),
        load=LOAD * (np.arange(gears) == 0),
        shapes=hubs[::contacts],
        rate=np.ones(gears - 1),
        start=np.linspace(2.0, 1.0, gears) * LOAD / GROUND,
    )
    return contact_part, train


def _products(one, two):
    return np.einsum("cpb,dpb->pcd", one, two)


def _contacts(mesh_of, gap, compliance):
    count, meshes = len(mesh_of), mesh_of[-1] + 1
    knots = REACH * np.linspace(0.0, 1.0, CELLS + 1) ** 2
    start, hardening = knots[:-1], 1e12
    curve = np.zeros((count, POSITIONS + 1, 2, CELLS, 4))
    curve[..., 0] = STIFFNESS * start + hardening * start**2
    curve[..., 1] = STIFFNESS + 2.0 * hardening * start
    curve[..., 2] = hardening
    return Contacts(
        first=np.searchsorted(mesh_of, np.arange(meshes + 1)),
        side=np.ones(count),
        gap=gap,
        sliding=np.ones((count, POSITIONS + 1)),
        arms=np.zeros((2, count, POSITIONS + 1)),
        knots=np.tile(knots, (meshes, 1)),
        load_curve=curve,
        normal_compliance=compliance,
        tangential_compliance=np.zeros(compliance.shape),
        errors=np.zeros((count, 0)),
    )


def dense_rows(system):
    """Rows of all coordinates, in place of those of the contact's own gears."""
    return system.rows, np.zeros(len(system.rows), np.int64), system.whirl.size


def two_periods(system, start):
    """States after a period and, with small changes, after another."""
    size = system.load.size
    grid = contact_grid(system, STEPS, np.ones(system.rate.size, np.int64))
    steps = coupled_steps(system, LinearPart(system), grid, FREQUENCY, 1)
    state = np.stack([start, np.zeros(size)])
    angular = np.full(size, 1e4)
    convergence = new_convergence(system.shapes, angular, Settings())
    settle_motion(system, steps, 1e9, state, convergence, 1)
    changes = np.random.default_rng(1).normal(size=(2, CHANGES * size))
    changes[1] *= 1e4
    varied = np.concatenate([state, changes], axis=1)
    k = np.bincount(system.mesh_of).max()
    sections = np.empty((1, 6 + 2 * k, system.rate.size))
    growth = np.empty(1)
    integrate_variations(system, steps, 1e9, varied, angular, sections, growth)
    return state, varied, sections[0, :6], growth


@settings(max_examples=12, deadline=None)
@given(**TRAINS)
@example(gears=4, contacts=2, standing=1, pairs=2, seed=0)
@example(gears=3, contacts=2, standing=0, pairs=0, seed=0)
def test_steps_are_those_of_dense_rows(gears, contacts, standing, pairs, seed):
    system = coupled_system(*random_chain(gears, contacts, standing, pairs, seed))
    start = np.zeros(system.load.size)
    start[:gears] = np.linspace(2.0, 1.0, gears) * LOAD / GROUND
    blocks = two_periods(system, start)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coupled_model, "_rows_by_gear", dense_rows)
        dense = two_periods(system, start)
    for actual, expected in zip(blocks, dense, strict=True):
        for one, two in zip(
            np.atleast_2d(actual), np.atleast_2d(expected), strict=True
        ):
            atol = 1e-12 * np.abs(two).max()
            np.testing.assert_allclose(one, two, rtol=0.0, atol=atol)


def test_contacts_have_the_pairs_of_two_gears():
    system = coupled_system(*random_chain(5, 2, 1, 3, 0))
    rows, first, count = coupled_model._rows_by_gear(system)
    assert count == 2 * 3
    np.testing.assert_array_equal(first, np.repeat([0, 3, 6, 9], 2))
    assert rows.shape[2] == 5 + 5 + 2 * count


@settings(max_examples=12, deadline=None)
@given(**TRAINS)
def test_equilibrium_is_that_of_all_coordinates(gears, contacts, standing, pairs, seed):
    """Residuals of the equations of all contacts and coordinates, for units of each."""
    coupled, train = random_chain(gears, contacts, standing, pairs, seed)
    system = coupled_system(coupled, train)
    start = np.zeros(system.load.size)
    start[:gears] = train.start
    loaded = loaded_state(system, start)
    q, x, Q = loaded.coordinates, loaded.penetration, system.contacts.normal_compliance
    F, D = contact_loads(system, x)
    B = system.rows.transpose(1, 0, 2)
    opened = x + np.einsum("pcd,pd->pc", Q, F) - np.einsum("pci,pi->pc", B, q)
    opened += system.contacts.gap.T
    np.testing.assert_allclose(
        opened, 0.0, atol=1e-12 * np.abs(B @ q[:, :, None]).max()
    )
    unbalanced = q @ system.stiffness + np.einsum("pci,pc->pi", B, F) - system.load
    np.testing.assert_allclose(unbalanced, 0.0, atol=1e-11 * LOAD)
    inner = np.linalg.inv(np.eye(len(coupled.mesh_of)) + D[:, :, None] * Q)
    exact = np.einsum("pci,pcd,pd,pdj->pij", B, inner, D, B)
    of_meshes = loaded.tangent(slice(0, -1)).sum(axis=1)
    atol = 1e-12 * np.abs(exact).max()
    np.testing.assert_allclose(of_meshes, exact[:-1], rtol=0.0, atol=atol)
    mean = exact[:-1].mean(axis=0)
    np.testing.assert_allclose(loaded.meshes.sum(axis=0), mean, rtol=0.0, atol=atol)


def random_truncation(meshes, seed):
    """Modes of a chain's gears, alone or in pairs of one frequency."""
    rng, gears = np.random.default_rng(seed), meshes + 1
    alone, pairs = 2, 3
    families = np.concatenate(
        [
            g * 100 + np.r_[np.arange(alone), np.repeat(np.arange(10, 10 + pairs), 2)]
            for g in range(gears)
        ]
    )
    frequency_of = {n: rng.uniform(5e3, 5e4) for n in np.unique(families).tolist()}
    mesh = np.arange(meshes)[:, None]
    owner = families // 100
    share = rng.exponential(0.02, (meshes, families.size))
    return TruncationModel(
        frequencies_Hz=np.array([frequency_of[n] for n in families.tolist()]),
        damping_ratio=np.full(families.size, 0.01),
        families=families,
        compliance=share * ((owner == mesh) | (owner == mesh + 1)),
        unsolved_Hz=6e4,
        unsolved_compliance=rng.exponential(0.02, meshes),
        amplitudes=rng.normal(size=(meshes, 6)) / np.arange(1.0, 7.0) + 0j,
        rate=np.ones(meshes),
        resonances_Hz=rng.uniform(1e3, 8e3, meshes),
        energy=rng.dirichlet(np.ones(meshes + 1), meshes).T[:meshes],
        resonance_damping=0.04,
    )


def chosen_by_definition(model, band, max_error):
    """Families in order of their own errors, until those left out change little."""

    def error(left_out, unsolved=True):
        less = model if unsolved else _without_unsolved(model)
        bounds = less.largest_error(~left_out, band), less.flank_bound(~left_out, band)
        return max(bounds) if unsolved else bounds[0]

    families = np.unique(model.families)
    flanks = model._flanks(band)[:, :-1]
    alone = [
        max(
            error(model.families == n, unsolved=False),
            flanks[:, model.families == n].sum(axis=1).max(),
        )
        for n in families
    ]
    order = families[np.argsort(alone, kind="stable")[::-1]]
    for count in range(order.size):
        retained = np.isin(model.families, order[:count])
        if error(~retained) <= max_error:
            return retained
    return np.ones(model.families.size, bool)


def _without_unsolved(model):
    return replace(model, unsolved_compliance=np.zeros_like(model.unsolved_compliance))


@settings(max_examples=6, deadline=None)
@given(meshes=st.integers(1, 3), seed=st.integers(0, 2**32 - 1))
def test_modes_are_chosen_as_by_all_modes_in_all_meshes(meshes, seed):
    model, band = random_truncation(meshes, seed), (300.0, 9e3)
    for max_error in (0.02, 0.08, 0.3):
        np.testing.assert_array_equal(
            model.choose(band, max_error), chosen_by_definition(model, band, max_error)
        )
    assert model._speeds(band).size > N_SPEEDS
