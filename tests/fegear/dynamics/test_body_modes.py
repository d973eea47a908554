"""Body modes of the coupled model against the same modes in the frame of the gears."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fegear.dynamics.body_modes import DAMPING, body_modes, static_inertias
from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.gear_elasticity import elastic_damping
from fegear.dynamics.mesh_load_curves import pitch_point
from fegear.dynamics.model import dynamic_model
from fegear.dynamics.sides import contact_sides
from fegear.dynamics.stepper import DynamicSettings, ReducedStepper
from fegear.elasticity.gear_modes import gear_modes, lowest_modes
from fegear.train.coupled import contacts_from_load_curves
from lumped.steady.integration_settings import Settings
from lumped.steady.steady_state import steady_state
from lumped.steady.steppers import FixedStepper

FAMILIES, COUNT = range(4), 2


@pytest.fixture(scope="module", params=["liu-pair", "liu-idler-small-hubs"])
def case(request, case_of):
    return case_of(request.param)


@pytest.fixture(scope="module")
def modes(case):
    return [
        lowest_modes(case.settings.sector(gear), gear.density, FAMILIES, COUNT)
        for gear in case.gear_set.gears
    ]


@pytest.fixture(scope="module")
def contacts(case, modes):
    args = case.gear_set, case.reference, case.laws, case.settings
    sides = contact_sides(case.gear_set, case.laws)
    bodies = body_modes(case.gear_set, case.reference, sides, modes)
    return replace(contacts_from_load_curves(*args), modes=bodies)


def in_the_frame_of_the_gears(case, modes):
    """Finite elements in motion with the same modes, counted anew tooth by tooth."""
    elastic = [
        ElasticGear(elastic_modes, gear.face_width, elastic_damping(gear, DAMPING))
        for gear, elastic_modes in zip(case.gear_set.gears, modes, strict=True)
    ]
    model = dynamic_model(
        case.gear_set, case.reference, case.laws, elastic, case.beside
    )
    return ReducedStepper(model, DynamicSettings().scheme)


def without_relief_of_inertia(contacts):
    """As the finite elements: modes that are not kept have no inertia."""
    bodies = contacts.modes
    softness = bodies.angular**-2
    return replace(
        contacts,
        inertia_rows=np.einsum("cpb,bn->cpn", bodies.rows * softness, bodies.coupling),
        work=(bodies.coupling.T * softness) @ bodies.coupling,
    )


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.31, 0.62, 0.9, 1.3])
def test_both_frames_see_the_same_motion(case, modes, contacts, part):
    """Gyroscopic terms of one are the counting of teeth of the other; at some of these
    speeds harmonics of the mesh meet body modes."""
    system = replace(case.reference, contacts=without_relief_of_inertia(contacts))
    frequency = part * float(case.reference.resonances_Hz[-1])
    fine = Settings(steps=256, tolerance=1e-6)
    response, _ = steady_state(FixedStepper(system), frequency, fine)
    settings = DynamicSettings(
        steps=1024, step_angle=0.2, hub_angle=0.02, tolerance=1e-6
    )
    stepper = replace(in_the_frame_of_the_gears(case, modes), scheme=settings.scheme)
    exact, _ = steady_state(stepper, frequency, settings)
    assert response.multiple == exact.multiple == 1
    np.testing.assert_allclose(response.dte_rms, exact.dte_rms, rtol=4e-3)
    np.testing.assert_allclose(response.force_peak, exact.force_peak, rtol=6e-3)


def test_whirl_matters_where_gears_turn_fast(case, contacts):
    """So that the agreement of both frames is no accident: frequencies split."""
    bodies = contacts.modes
    assert np.abs(bodies.pair_whirl).min() > 0.005
    still = replace(bodies, whirl=0.0 * bodies.whirl)
    speed = 1.3 * case.reference.resonances_Hz[-1]
    forces = []
    for modes in (bodies, still):
        system = replace(case.reference, contacts=replace(contacts, modes=modes))
        fine = Settings(steps=256, tolerance=1e-6)
        forces.append(steady_state(FixedStepper(system), speed, fine)[1].force)
    size = np.ptp(forces[0], axis=0)
    assert (np.abs(forces[0] - forces[1]).max(axis=0) > 3e-3 * size).any()


def test_statics_do_not_depend_on_the_modes(case, contacts):
    loaded = replace(case.reference, contacts=contacts).loaded
    none = replace(case.reference, contacts=replace(contacts, modes=None)).loaded
    np.testing.assert_allclose(loaded.deflection, none.deflection, rtol=1e-9)
    np.testing.assert_allclose(loaded.load, none.load, atol=1e-6)


def test_rows_pass_from_a_pair_to_the_next_at_the_end_of_a_cycle(contacts):
    """The frame does not turn: what a place feels is the same cycle by cycle."""
    rows, scale = contacts.modes.rows, np.abs(contacts.modes.rows).max()
    compared = 0
    for c, m in enumerate(contacts.mesh_of):
        same = (contacts.mesh_of == m) & (contacts.contacts.side > 0.0)
        later = np.flatnonzero(same & (contacts.pairs == contacts.pairs[c] + 1))
        touching = contacts.contacts.gap[c, -1] < 1e-5
        if contacts.contacts.side[c] > 0.0 and later.size and touching:
            gap = np.abs(rows[c, -1] - rows[later[0], 0]).max()
            assert gap < 2e-3 * scale
            compared += 1
    assert compared >= len(contacts.paths)


@pytest.mark.slow
def test_inertia_of_all_modes_is_that_of_the_static_displacement(case):
    """Sum of w^2 / omega^4, of which the lowest modes are nearly all."""
    gear_set, settings = case.gear_set, case.settings
    sides = contact_sides(gear_set, case.laws)
    inertias = static_inertias(gear_set, sides, settings)
    modes = [
        gear_modes(settings.sector(gear), gear.density, 60e3) for gear in gear_set.gears
    ]
    bodies = body_modes(gear_set, case.reference, sides, modes)
    contacts = contacts_from_load_curves(gear_set, case.reference, case.laws, settings)
    for m, total in enumerate(inertias):
        pair, position = pitch_point(gear_set, m, bodies.rows.shape[1] - 1)
        pair_mask = (contacts.mesh_of == m) & (contacts.pairs == pair)
        c = int(np.flatnonzero(pair_mask & (contacts.contacts.side > 0.0))[0])
        part = (bodies.rows[c, position] ** 2 / bodies.angular**4).sum() / total
        assert 0.93 < part < 1.0 + 1e-3
