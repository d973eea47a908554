"""The coupled model on systems small enough to be solved by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from lumped.kernels.arrays import Contacts
from lumped.train.coupled import (
    CoupledContacts,
    ModalTrain,
    contact_loads,
    coupled_system,
    loaded_state,
    static_transmission_error,
)

POSITIONS, CELLS, REACH = 4, 8, 1e-4  # grid of a mesh cycle, cells of a law, [m]
STIFFNESS = 2e8  # N/m of a contact
LOAD = 2000.0  # N


def contacts_of(count, hardening=0.0, coupling=0.0, mesh_of=None, gap=None):
    """Contacts with F = k x + hardening x^2, and a compliance between all of them."""
    knots = REACH * np.linspace(0.0, 1.0, CELLS + 1) ** 2
    law = np.zeros((count, POSITIONS + 1, 2, CELLS, 4))
    start = knots[:-1]
    law[..., 0] = STIFFNESS * start + hardening * start**2
    law[..., 1] = STIFFNESS + 2.0 * hardening * start
    law[..., 2] = hardening
    compliance = np.full((POSITIONS + 1, count, count), coupling)
    compliance[:, range(count), range(count)] = 0.0
    mesh_of = np.zeros(count, np.int64) if mesh_of is None else np.array(mesh_of)
    none = np.zeros((POSITIONS + 1, count, count))
    gaps = np.zeros(count) if gap is None else np.array(gap, float)
    meshes = mesh_of[-1] + 1
    return mesh_of, Contacts(
        first=np.searchsorted(mesh_of, np.arange(meshes + 1)),
        side=np.ones(count),
        gap=np.repeat(gaps[:, None], POSITIONS + 1, axis=1),
        sliding=np.ones((count, POSITIONS + 1)),
        arms=np.zeros((2, count, POSITIONS + 1)),
        knots=np.tile(knots, (meshes, 1)),
        load_curve=law,
        normal_compliance=compliance,
        tangential_compliance=none,
        errors=np.zeros((count, 0)),
    )


def one_mass(**options):
    """A mass that contacts hold, loaded by LOAD: the system and its loaded state."""
    coupled, train = one_mass_parts(**options)
    system = coupled_system(coupled, train)
    return system, loaded_state(system, train.start)


def one_mass_parts(mass=1.0, count=1, without=(), **options):
    """Contacts and train of `one_mass`; rows and mesh shapes are 1 / sqrt(mass)."""
    mesh_of, contacts = contacts_of(count, **options)
    shape = 1.0 / math.sqrt(mass)
    rows = np.full((count, POSITIONS + 1, 1), shape)
    coupled = CoupledContacts(
        contacts,
        mesh_of,
        np.arange(count),
        np.tile([-1.0, 1.0], (mesh_of[-1] + 1, 1)),
        rows,
        np.ones(rows.shape[:2]),
        np.zeros_like(rows),
        np.zeros((1, 1)),
        without=tuple(without),
    )
    train = ModalTrain(
        stiffness=np.zeros((1, 1)),
        damping=np.zeros(1),
        load=np.array([LOAD * shape]),
        shapes=np.full((mesh_of[-1] + 1, 1), shape),
        rate=np.ones(mesh_of[-1] + 1),
        start=np.array([LOAD / STIFFNESS / shape]),
    )
    return coupled, train


def test_a_linear_contact_is_a_spring():
    _, loaded = one_mass(mass=3.0)
    np.testing.assert_allclose(loaded.deflection, LOAD / STIFFNESS, rtol=1e-12)
    expected = math.sqrt(STIFFNESS / 3.0) / (2.0 * math.pi)
    np.testing.assert_allclose(loaded.frequency_Hz, expected, rtol=1e-12)


def test_hardening_is_the_tangent_and_left_out_the_secant():
    curved = 1e13
    _, loaded = one_mass(hardening=curved)
    x = (math.sqrt(STIFFNESS**2 + 4.0 * curved * LOAD) - STIFFNESS) / (2.0 * curved)
    np.testing.assert_allclose(loaded.deflection, x, rtol=1e-9)
    tangent = STIFFNESS + 2.0 * curved * x
    np.testing.assert_allclose(
        (2.0 * np.pi * loaded.frequency_Hz) ** 2, tangent, rtol=1e-9
    )
    _, straight = one_mass(hardening=curved, without=["hardening"])
    np.testing.assert_allclose(straight.deflection, x, rtol=1e-9)
    np.testing.assert_allclose(
        (2.0 * np.pi * straight.frequency_Hz) ** 2, LOAD / x, rtol=1e-9
    )


@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_pairs_deflect_each_other(gap):
    """Two contacts of one mesh: a linear system of two unknowns."""
    coupling = 1.5e-9
    gaps = np.array([0.0, gap])
    _, loaded = one_mass(count=2, coupling=coupling, gap=gaps)
    compliance = np.array([[1 / STIFFNESS, coupling], [coupling, 1 / STIFFNESS]])
    stiff = np.linalg.inv(compliance)
    s = (LOAD + (stiff @ gaps).sum()) / stiff.sum()
    np.testing.assert_allclose(loaded.deflection, s, rtol=1e-9)
    np.testing.assert_allclose(loaded.load[0], stiff @ (s - gaps), rtol=1e-9)
    np.testing.assert_allclose(
        (2.0 * np.pi * loaded.frequency_Hz) ** 2, stiff.sum(), rtol=1e-9
    )
    _, alone = one_mass(count=2, coupling=coupling, gap=gaps, without=["pairs"])
    np.testing.assert_allclose(alone.deflection, loaded.deflection, rtol=1e-9)
    np.testing.assert_allclose(alone.load, loaded.load, rtol=1e-9)


@pytest.mark.parametrize("mesh", [0, 1])
def test_static_transmission_error_is_that_of_a_mesh_alone(mesh):
    """Two meshes of two contacts each, of which one touches later than the other."""
    coupling, gaps = 1.5e-9, np.array([0.0, 1e-6, 2e-6, 0.0])
    coupled, _ = one_mass_parts(
        count=4, coupling=coupling, gap=gaps, mesh_of=[0, 0, 1, 1]
    )
    compliance = np.array([[1 / STIFFNESS, coupling], [coupling, 1 / STIFFNESS]])
    stiff, mesh_gaps = np.linalg.inv(compliance), gaps[2 * mesh : 2 * mesh + 2]
    expected = (LOAD + (stiff @ mesh_gaps).sum()) / stiff.sum()
    error = static_transmission_error(coupled, mesh, LOAD)
    np.testing.assert_allclose(error, expected, rtol=1e-9)


def test_contacts_of_other_meshes_are_left_alone_without_meshes():
    options = {"count": 2, "coupling": 1e-9, "mesh_of": [0, 1]}
    coupled, _ = one_mass(**options)
    separate, _ = one_mass(without=["meshes"], **options)
    assert (coupled.contacts.normal_compliance[:, 0, 1] == 1e-9).all()
    assert not separate.contacts.normal_compliance.any()


DAMPER = 1e3  # N m s on the hub of `free_rim`


def free_rim(spring, without=()):
    """A rim of inertia 2 on a damped hub of inertia 1; a contact presses on the rim.

    Moment arm 1. The system, its train, and angular frequency and damping of the
    lowest mode.
    """
    hub, rim = 1.0, 2.0
    total = hub + rim
    mesh_of, contacts = contacts_of(1)
    # held, the rim twists by F / spring under the contact force
    contacts = contacts._replace(
        normal_compliance=np.full((POSITIONS + 1, 1, 1), 1.0 / spring)
    )
    turn = 1.0 / math.sqrt(total)  # of the whole gear per modal coordinate
    rows = np.full((1, POSITIONS + 1, 1), turn)
    # the inertial load of the rim, turned by a unit acceleration, twists it by
    # rim / spring; a contact is pressed in where the rim goes ahead
    inertial = np.full((1, POSITIONS + 1, 1), rim / spring * turn)
    work = np.array([[rim**2 / spring * turn**2]])
    coupled = CoupledContacts(
        contacts,
        mesh_of,
        np.zeros(1, np.int64),
        np.array([[-1.0, 1.0]]),
        rows,
        np.ones(rows.shape[:2]),
        inertial,
        work,
        without=tuple(without),
    )
    train = ModalTrain(
        stiffness=np.zeros((1, 1)),
        damping=np.array([DAMPER * turn**2]),
        load=np.array([LOAD * turn]),
        shapes=np.array([[turn]]),
        rate=np.ones(1),
        start=np.array([LOAD / STIFFNESS / turn]),
    )
    springs = np.array([[spring, -spring], [-spring, spring + STIFFNESS]])
    squares, shapes = eigh(springs, np.diag([hub, rim]))
    lowest = math.sqrt(squares[0]), DAMPER * shapes[0, 0] ** 2
    return coupled_system(coupled, train), train, lowest


def test_a_rim_on_a_spring_is_right_to_second_order():
    """With stiffer spokes the error falls as the square of the frequency ratio."""
    errors, ratios = [], []
    for spring in (2e9, 8e9, 32e9):
        system, train, (exact, _) = free_rim(spring)
        loaded = loaded_state(system, train.start)
        errors.append(abs(2.0 * math.pi * loaded.frequency_Hz[0] / exact - 1.0))
        ratios.append(exact**2 / (spring * 1.5))  # over the free rim's own
    orders = np.diff(np.log(errors)) / np.diff(np.log(ratios))
    assert (orders > 1.8).all(), "of the frequency squared: fourth in the ratio itself"
    system, train, (exact, _) = free_rim(2e9, without=["body"])
    held = 2.0 * math.pi * loaded_state(system, train.start).frequency_Hz[0]
    assert abs(held / exact - 1.0) > 10.0 * errors[0]


def test_damping_acts_where_the_hub_is():
    """The rim and its hub swing by different angles: to the same order."""
    errors, ratios = [], []
    for spring in (2e9, 8e9, 32e9):
        system, _, (angular, exact) = free_rim(spring)
        errors.append(abs(system.damping[0, 0] / exact - 1.0))
        ratios.append(angular**2 / (spring * 1.5))
    orders = np.diff(np.log(errors)) / np.diff(np.log(ratios))
    assert (orders > 1.8).all()
    system, _, (_, exact) = free_rim(2e9, without=["body"])
    assert abs(system.damping[0, 0] / exact - 1.0) > 10.0 * errors[0]


def test_at_rest_the_hub_stands_as_with_the_hub_held():
    """Nothing accelerates: the rim's inertia must not be seen."""
    system, train, _ = free_rim(2e9)
    loaded = loaded_state(system, train.start)
    expected = LOAD / STIFFNESS + LOAD / 2e9
    np.testing.assert_allclose(loaded.deflection, expected, rtol=1e-12)


def test_loads_beyond_the_table_go_on_straight():
    system, _ = one_mass()
    load, slope = contact_loads(system, np.full((POSITIONS + 1, 1), 3.0 * REACH))
    np.testing.assert_allclose(load, 3.0 * STIFFNESS * REACH)
    np.testing.assert_allclose(slope, STIFFNESS)
    load, slope = contact_loads(system, np.full((POSITIONS + 1, 1), -REACH))
    assert not load.any()
    assert not slope.any()
