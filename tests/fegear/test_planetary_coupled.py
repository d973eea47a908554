"""The coupled model of planetary sets, against model 1 and by symmetry."""

from __future__ import annotations

import numpy as np
import pytest

import fegear
from fegear.gearset import load_gear_set
from fegear.train.lumped_models import LumpedModel, StiffnessSource, lumped_system

SET = "planetary-24-36-96"
SOURCE = StiffnessSource(resolution="coarse", positions=64)


def system_of(number, without=(), translations=True, **edits):
    """The set at 60 N m; edits : of [[planetary]]."""
    changes = {f"planetary.1.{key}": value for key, value in edits.items()}
    model = LumpedModel(
        number=number, without=without, translations=translations, stiffness=SOURCE
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


@pytest.mark.slow
def test_transmission_errors_at_rest_are_those_of_the_tables():
    """Each mesh alone; that of the ring varies by 0.2 um only, which is 2.5 % off."""
    model = LumpedModel(
        number="coupled",
        without=("body",),
        stiffness=StiffnessSource(resolution="coarse"),
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
        model=LumpedModel(number="coupled", stiffness=SOURCE, **settings),
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
        source=SOURCE,
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
