"""The coupled model of planetary sets, against model 1 and by symmetry."""

from __future__ import annotations

import numpy as np
import pytest

import fegear
from fegear.gearset import load_gear_set
from fegear.gearset.lumped_train import train_of
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.train.equilibrium import mesh_forces_at_rest
from lumped.train.load_sharing import load_sharing

SET = "planetary-24-36-96"
SOURCE = ExcitationSettings(resolution="coarse", positions=64)


def system_of(number, without=(), translations=True, **edits):
    """The set at 60 N m; edits : of [[planetary]]."""
    changes = {f"planetary.1.{key}": value for key, value in edits.items()}
    model = LumpedModel(
        number=number, without=without, translations=translations, excitation=SOURCE
    )
    return lumped_system(load_gear_set(SET, changes), 60.0, model)


@pytest.mark.slow
@pytest.mark.parametrize("translations", [False, True])
def test_without_its_parts_it_has_the_frequencies_of_model_1(translations):
    """What is left of the difference is the tangent of the loaded teeth."""
    springs = system_of(1, translations=translations)
    coupled = system_of("coupled", ("body", "hardening", "meshes"), translations)
    expected = springs.resonances_Hz
    assert coupled.resonances_Hz == pytest.approx(expected, rel=0.015)


def test_turning_the_whole_set_changes_nothing():
    """Positions by 77 degrees further: contact rows turn with the carrier's."""
    turned = [77.0, 197.0, 317.0]
    systems = [
        system_of("coupled", ("body",)),
        system_of("coupled", ("body",), positions_deg=turned),
    ]
    one, two = (system.resonances_Hz for system in systems)
    assert two == pytest.approx(one, rel=1e-9)
    deflections = [np.sort(np.abs(system.static_deflection)) for system in systems]
    assert deflections[1] == pytest.approx(deflections[0], rel=1e-9)


def test_frequencies_of_equal_planets_come_in_pairs():
    frequencies = system_of("coupled", ("body",)).resonances_Hz
    gaps = np.diff(frequencies) / frequencies[:-1]
    assert (gaps < 1e-6).sum() == 6  # of translational modes of three planets


def test_a_carrier_at_rest_has_no_forces_of_a_frame():
    """With a held carrier; otherwise the sense of the sun's speed is the carrier's."""
    rest = system_of("coupled", ("body",), held="carrier", output="ring")
    assert rest.rotating_frame is None
    assert rest.train.carrier_speed == 0.0
    assert system_of("coupled", ("body",), translations=False).rotating_frame is None
    turning = system_of("coupled", ("body",))
    angular = turning.train.carrier_angular_speed(4800.0)
    assert angular == pytest.approx(2.0 * np.pi * 4800.0 / 96.0, rel=1e-14)
    members = {"input": "carrier", "output": "ring", "held": "sun"}
    edits = {f"planetary.1.{key}": value for key, value in members.items()}
    sun_held = load_gear_set(SET, edits | {"load.gear": "carrier"})
    # the sun turns counter-clockwise relative to the carrier
    assert train_of(sun_held, 60.0, True).carrier_speed == -1.0


@pytest.mark.parametrize("rpm", [None, 12000.0])
def test_modes_of_the_coupled_model_have_families(rpm):
    study = fegear.NaturalModes(
        gear_set=SET,
        torque=60.0,
        translations=True,
        stiffness="coupled",
        excitation=SOURCE,
        rpm=rpm,
    )
    listed = fegear.run(study).summary["modes"]
    assert {mode["family"] for mode in listed} == {"rotational", "translational"}
    senses = {None} if rpm is None else {"none", "forward", "backward"}
    assert {mode["whirl"] for mode in listed} == senses


def test_finite_elements_in_motion_leave_forces_of_the_frame_out():
    study = fegear.Dynamics(
        gear_set=SET,
        translations=True,
        torque=(60.0,),
        speeds=(8000.0,),
        excitation=SOURCE,
    )
    (line,) = study.prepare()._frame_warnings()
    assert line.startswith("finite elements in motion leave out gyroscopic")
    assert line.endswith("[W41]")


@pytest.mark.slow
def test_transmission_errors_at_rest_are_those_of_the_tables():
    """Each mesh alone; that of the ring varies by 0.2 um only, which is 2.5 % off."""
    model = LumpedModel(
        number="coupled",
        without=("body",),
        excitation=ExcitationSettings(resolution="coarse"),
    )
    checks = lumped_system(load_gear_set(SET), 60.0, model).static_checks
    assert len(checks) == 6
    for check in checks:
        assert abs(check.error) < 0.03
        assert abs(check.mean_error) < 1e-3


def swept(speed=4500.0, **settings):
    """A sweep of the coupled model at one speed; settings : of the model."""
    return fegear.Sweep(
        gear_set=SET,
        torque=(60.0,),
        model=LumpedModel(number="coupled", excitation=SOURCE, **settings),
        speeds=(speed,),
        direction="up",
    )


@pytest.mark.slow
def test_planets_in_phase_vibrate_alike():
    table = fegear.run(swept(without=("modes",), translations=True)).table
    rows = [dict(zip(table.names, row, strict=True)) for row in table.rows()]
    errors = np.array([row["dte_rms_m"] for row in rows]).reshape(3, 2)
    assert errors == pytest.approx(np.tile(errors[0], (3, 1)), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "translations", "allowed"),
    [(4500.0, False, 0.03), (3100.0, False, 0.06), (5700.0, True, 0.08)],
)
def test_finite_elements_in_motion_vibrate_alike(speed, translations, allowed):
    """Fidelity reduced beside the coupled model; of ten speeds from 1000 to 7000 Hz
    the last two are those at which the meshes of the sun differ most."""
    study = fegear.Dynamics(
        gear_set=SET,
        torque=(60.0,),
        excitation=SOURCE,
        speeds=(speed,),
        direction="up",
        translations=translations,
    )
    model = swept(speed, translations=translations)
    errors = []
    for table in (fegear.run(study).table, fegear.run(model).table):
        rows = [dict(zip(table.names, row, strict=True)) for row in table.rows()]
        errors.append([row["dte_rms_m"] for row in rows])
    reduced, coupled = errors
    assert coupled == pytest.approx(reduced, rel=allowed)


def test_position_errors_are_gaps_of_both_meshes_of_a_planet():
    """The sun drives: a pin ahead of its place opens both drive sides of its planet."""
    equal = system_of("coupled", ("body",), translations=False)
    error = 2e-6
    off = system_of(
        "coupled", ("body",), translations=False, position_errors_um=[0.0, 2.0, 0.0]
    )
    mesh_of = equal.contacts.mesh_of
    opened = error * np.cos(off.train.meshes[0].pressure_angle)
    expected = np.where((mesh_of == 2) | (mesh_of == 3), opened, 0.0)
    both = off.contacts.contacts, equal.contacts.contacts
    difference = both[0].gap - both[1].gap
    facing = both[1].gap < 1e-3  # gaps of flanks that do not face are large
    gaps = np.broadcast_to((both[1].side * expected)[:, None], difference.shape)
    assert difference[facing] == pytest.approx(gaps[facing], abs=1e-12)
    # at rest a mesh alone has the transmission error of its table still
    assert all(abs(check.mean_error) < 1e-2 for check in off.static_checks)
    force = mesh_forces_at_rest(off)
    model_1 = system_of(1, translations=False, position_errors_um=[0.0, 2.0, 0.0])
    shares = load_sharing(off.train, force).share
    expected_shares = load_sharing(model_1.train, mesh_forces_at_rest(model_1)).share
    assert shares == pytest.approx(expected_shares, abs=0.02)  # teeth stiffen
    assert shares[1] < 0.2


@pytest.mark.slow
def test_a_planet_without_contact_leaves_the_load_to_the_others():
    """The rotation of planet 2 has no stiffness at rest."""
    system = system_of(
        "coupled", ("body",), translations=False, position_errors_um=[0.0, 20.0, 0.0]
    )
    share = load_sharing(system.train, mesh_forces_at_rest(system)).share
    assert share == pytest.approx([0.5, 0.0, 0.5], abs=1e-4)
