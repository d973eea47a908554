"""The coupled lumped model against the finite elements that it stands for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from fegear.dynamics.body_modes import body_modes
from fegear.dynamics.sides import contact_sides
from fegear.dynamics.stepper import DynamicSettings
from fegear.elasticity.gear_modes import lowest_modes
from fegear.gearset import load_gear_set
from fegear.gearset.phases import mesh_phases
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import BODIES
from fegear.statics.solving import solve_mesh
from fegear.train.coupled import contacts_from_load_curves
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.attractors.attractors import find_attractor
from lumped.branches.period_map import PeriodMap
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from lumped.steady.steady_state import steady_state
from lumped.steady.steppers import FixedStepper
from lumped.train.coupled import COMPONENTS, contact_loads

HIGH = 120e3  # Hz, elastic modes of the finite elements


@pytest.fixture(scope="module", params=["liu-pair", "liu-idler"])
def case(request, case_of):
    return case_of(request.param)


@pytest.fixture(scope="module")
def system(case):
    return coupled(case)


def coupled(case, **changes):
    args = case.gear_set, case.reference, case.laws, case.settings
    contacts = replace(contacts_from_load_curves(*args), **changes)
    return replace(case.reference, contacts=contacts)


def vibrating(case, families=range(3), count=2, **changes):
    """With so many body modes of each number of nodal diameters."""
    gear_set, settings = case.gear_set, case.settings
    sides = contact_sides(gear_set, case.laws)
    modes = [
        lowest_modes(settings.sector(gear), gear.density, families, count)
        for gear in gear_set.gears
    ]
    bodies = body_modes(gear_set, case.reference, sides, modes)
    return coupled(case, modes=bodies, **changes)


def frequencies_of_elements(model, system, place):
    """With gears that vibrate about a position, by the same contacts [Hz]."""
    modal, rows = model.modal, model.jacobian
    hubs, size = modal.damping.size, model.size
    mass, stiffness = np.eye(size), np.zeros((size, size))
    coupling = modal.coupling[:, None] * modal.rotation[modal.gear_of_mode]
    mass[hubs:, :hubs], mass[:hubs, hubs:] = coupling, coupling.T
    stiffness[:hubs, :hubs] = modal.stiffness
    stiffness[hubs:, hubs:] = np.diag(modal.rigidity)
    jacobian = np.zeros((model.contact_count, size))
    for c, m in enumerate(rows.mesh_of):
        width = rows.widths[m]
        jacobian[c, rows.columns[m, :width]] = rows.normal[c, place, :width]
    _, slopes = contact_loads(system.coupled_arrays, system.loaded.penetration)
    Q, D = model.contacts.normal_compliance[place], np.diag(slopes[place])
    pressed = np.linalg.solve(np.eye(len(D)) + D @ Q, D @ jacobian)
    squares = eigh(stiffness + jacobian.T @ pressed, mass, eigvals_only=True)
    frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi)
    return frequencies[frequencies > 1.0][: system.moving.size]


def frequencies_of(system, place):
    loaded = system.loaded
    stiffness = loaded.springs + loaded.tangent(place).sum(axis=0)
    return np.sqrt(np.linalg.eigvalsh(stiffness)) / (2.0 * math.pi)


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 20, 50, 90])
def test_natural_frequencies_are_those_of_the_elements(case, system, place):
    """What is left out are modes of the free gears: second order in the ratio."""
    expected = frequencies_of_elements(case.model(HIGH), system, place)
    error = np.abs(frequencies_of(system, place) / expected - 1.0)
    first = math.sqrt(case.model(HIGH).modal.rigidity.min()) / (2.0 * math.pi)
    assert (error < 0.1 * (expected / first) ** 2 + 1e-5).all()
    assert (error < 0.01).all()
    held = frequencies_of(coupled(case, without=("body",)), place)
    assert np.abs(held / expected - 1.0).max() > 3.0 * error.max()


def test_at_rest_it_is_the_static_contact_of_the_elements(case, system):
    """Within what pair laws cost; the idler's meshes deflect each other besides."""
    for m, phase in enumerate(mesh_phases(case.gear_set)):
        ste = system.loaded.deflection[:-1, m]
        alone = coupled(case, without=("meshes",)).loaded.deflection[:-1, m]
        assert np.ptp(ste) > 1e-6
        np.testing.assert_allclose(alone, ste, rtol=0.05)
        assert phase.value < 1.0


def test_loads_at_rest_balance_the_torque(case, system):
    train, loads = case.reference.train, system.loaded.load
    for m, mesh in enumerate(train.meshes):
        mesh_load = loads[:, system.contacts.mesh_of == m].sum(axis=1)
        gear = train.gears[0]
        # of an idler in both meshes; springs that hold the ends take half a per cent
        force = abs(gear.torque) / gear.base_radius
        assert mesh.driver in (0, 1)
        np.testing.assert_allclose(mesh_load, force, rtol=1e-2)


def test_compliance_in_mean_axes_is_symmetric(system):
    """To what the compliance between pairs is interpolated to."""
    compliance = system.coupled_arrays.contacts.normal_compliance
    skew = np.abs(compliance - compliance.transpose(0, 2, 1)).max()
    assert skew < 1e-4 * np.abs(compliance).max()


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1200.0, 2000.0, 2400.0])
def test_vibration_is_that_of_the_reduced_elements(case, system, speed):
    elements = case.stepper(30e3, remaining=0.9)
    settings = DynamicSettings(tolerance=1e-5)
    expected, _ = steady_state(elements, speed, settings)
    response, _ = steady_state(FixedStepper(system), speed, Settings(tolerance=1e-5))
    springs, _ = steady_state(FixedStepper(case.reference), speed, Settings())
    np.testing.assert_allclose(response.dte_rms, expected.dte_rms, rtol=0.05)
    np.testing.assert_allclose(response.force_peak, expected.force_peak, rtol=0.05)
    errors = [
        np.abs(r.dte_rms / expected.dte_rms - 1.0).max() for r in (springs, response)
    ]
    assert errors[1] < errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPONENTS)
def test_each_ingredient_changes_what_it_should(case_of, name):
    case = case_of("liu-idler")
    complete, less = vibrating(case), vibrating(case, without=(name,))
    count = complete.moving.size  # body modes are higher
    ratio = less.resonances_Hz[1:count] / complete.resonances_Hz[1:count]
    assert (np.abs(ratio - 1.0) > 1e-4).any()
    # pairs and hardening are left out about the loaded state, body in motion only
    at_rest = less.loaded.deflection / complete.loaded.deflection
    allowed = {"hardening": 0.03, "meshes": 0.05}.get(name, 1e-9)
    assert np.abs(at_rest - 1.0).max() < allowed


def test_two_models_left_out_of_all_are_one(case_of):
    """Without anything the order of the names does not matter."""
    case = case_of("liu-idler")
    one, two = (
        coupled(case, without=names).resonances_Hz
        for names in (COMPONENTS, COMPONENTS[::-1])
    )
    np.testing.assert_array_equal(one, two)


def test_a_table_of_free_bodies_has_the_stiffness_of_the_coupled_model(case_of):
    """By another way: contact of all nodes on the compliance in mean axes."""
    case = case_of("liu-pair")
    system, gear_set = coupled(case), case.gear_set
    settings = replace(case.settings, positions=32, body="free", estimate_error=False)
    table = solve_mesh(gear_set, 1, [100.0], settings).table
    stiffness = table["local_stiffness_N_per_m"][0].mean()
    gears = case.reference.train.gears
    softness = sum(gear.base_radius**2 / gear.inertia for gear in gears)
    frequency = math.sqrt(stiffness * softness) / (2.0 * math.pi)
    assert frequency == pytest.approx(system.resonances_Hz[-1], rel=0.01)
    held = solve_mesh(gear_set, 1, [100.0], replace(settings, body="held")).table
    assert held["local_stiffness_N_per_m"].mean() < 0.97 * stiffness
    assert (table.header["body"], held.header["body"]) == tuple(
        BODIES[name] for name in ("free", "held")
    )


def reversed_torque(system):
    """The same gears, turned the other way against their back flanks."""
    train = system.train
    gears = tuple(replace(gear, torque=-gear.torque) for gear in train.gears)
    return replace(system, train=replace(train, gears=gears))


def test_back_flanks_are_as_stiff_as_drive_flanks(case_of):
    """Teeth are symmetric; the cycle is passed the other way and begins elsewhere."""
    case = case_of("liu-pair", backlash=2e-5)
    drive = coupled(case)
    back = reversed_torque(drive)
    (gap,) = {mesh.backlash for mesh in drive.train.meshes}
    np.testing.assert_allclose(back.resonances_Hz, drive.resonances_Hz, rtol=1e-3)
    one = drive.loaded.deflection[:-1, 0]
    two = -gap - back.loaded.deflection[:-1, 0]
    sizes = [np.abs(np.fft.rfft(signal))[:8] / signal.size for signal in (one, two)]
    np.testing.assert_allclose(sizes[1], sizes[0], rtol=2e-3, atol=3e-3 * np.ptp(one))
    sides = back.loaded.load[:, drive.contacts.contacts.side > 0.0]
    assert not sides.any(), "drive flanks are apart"


def test_it_does_not_matter_which_gear_drives():
    """Statics pass the cycle the other way round; natural frequencies are the same."""
    edits = {"mesh.1.driver": "idler", "mesh.1.driven": "pinion", "load.gear": "idler"}
    model = LumpedModel(number="coupled", excitation=ExcitationSettings(positions=64))
    one = lumped_system(load_gear_set("liu-pair"), 100.0, model)
    other = load_gear_set("liu-pair", edits)
    two = lumped_system(other, 100.0 * 55.0 / 38.0, model)
    np.testing.assert_allclose(two.resonances_Hz, one.resonances_Hz, rtol=1e-3)
    forward, back = (lumped_pair.loaded.deflection[:, 0] for lumped_pair in (one, two))
    np.testing.assert_allclose(back[::-1], forward, rtol=5e-3)


def test_a_fixed_point_of_the_period_is_the_settled_motion(case, system):
    """Where contact is lost; its multipliers are those of the attractor."""
    frequency = 0.97 * float(system.resonances_Hz[-1])
    fine = Settings(steps=512)
    response = respond(system, frequency, fine)
    motion = PeriodMap(system)
    x = motion.of_response(response, fine)
    for _ in range(8):
        errors, jacobian, _ = motion.equations(x, frequency)
        x = x - np.linalg.solve(jacobian, errors)
    assert np.abs(motion.errors(x, frequency)).max() < 1e-10 * motion.size
    figures = motion.figures(x, frequency)
    for name in ("dte_rms", "dte_mean", "force_peak"):
        np.testing.assert_allclose(figures[name], getattr(response, name), rtol=5e-3)
    transfer = motion.monodromy(x, frequency)
    damping = np.trace(system.coupled_arrays.damping)
    determinant = np.linalg.det(transfer)
    assert determinant == pytest.approx(math.exp(-damping / frequency), rel=1e-3)
    exponent = math.log(np.abs(np.linalg.eigvals(transfer)).max())
    attractor = find_attractor(system, response, fine)
    assert attractor.exponent == pytest.approx(exponent, rel=5e-3)
