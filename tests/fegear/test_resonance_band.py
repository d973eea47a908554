"""Which elastic modes a train has does not depend on the speeds that are asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fegear
from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.stepper import DynamicSettings
from fegear.gearset import load_gear_set, make_gear_set
from fegear.statics.excitation import Excitations
from fegear.studies.trains.model_texts import truncation_entries, truncation_warnings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.steady import truncation_check
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from lumped.steady.response import Status
from lumped.steady.steady_state import steady_state
from lumped.steady.truncation_check import check_truncation, leaves_modes_out

COUPLED = LumpedModel(number="coupled")
# an idler whose second harmonic meets a mode of its body at some 930 Hz
HEAVY_IDLER = {
    "name": "heavy-idler",
    "plane": "stress",
    "defaults": {"module_mm": 5.82, "face_width_mm": 51.7},
    "gear": [
        {"name": "a", "teeth": 21, "profile_shift": 0.377, "hub_radius_mm": 36.31}
        | {"inertia_kg_m2": 0.0127576},
        {"name": "b", "teeth": 95, "profile_shift": 0.23, "hub_radius_mm": 78.74}
        | {"inertia_kg_m2": 6.75009},
        {"name": "c", "teeth": 66, "profile_shift": 0.367, "hub_radius_mm": 130.55}
        | {"inertia_kg_m2": 1.23552},
    ],
    "mesh": [
        {"driver": "a", "driven": "b", "operating_pressure_angle_deg": 21.668}
        | {
            "tip_relief": {"magnitude_um": 20.4, "start": "HPSTC"}
            | {"shape": "parabolic"}
        },
        {"driver": "b", "driven": "c", "operating_pressure_angle_deg": 21.2501}
        | {"tip_relief": {"magnitude_um": 21.9, "start": "HPSTC"}},
    ],
    "load": {"gear": "a", "torques_Nm": [1300.0]},
    "dynamics": {"damping_ratio": 0.0279},
}


@pytest.fixture(scope="module")
def pair():
    return lumped_system(load_gear_set("liu-pair"), 100.0, COUPLED)


def with_modes(system, count):
    """The system with no more than so many families of body modes."""
    contacts = system.contacts
    mode_mask = np.isin(
        contacts.truncation_model.families,
        np.unique(contacts.truncation_model.families)[:count],
    )
    contacts = replace(
        contacts, modes=contacts.solved_modes.select(mode_mask), retained=mode_mask
    )
    return replace(system, contacts=contacts)


def test_a_speed_has_the_same_motion_alone_and_among_others():
    alone, among = (
        fegear.run(
            fegear.Sweep(
                gear_set="liu-idler", torque=[100.0], speeds=speeds, direction="up"
            )
        )
        for speeds in ([2300.0], [600.0, 2300.0, 6000.0])
    )
    one, other = alone.branches[0][1].responses[0], among.branches[0][1].responses[1]
    np.testing.assert_allclose(one.dte_rms, other.dte_rms, rtol=2e-3)
    assert alone.facts.summary["body_modes"] == among.facts.summary["body_modes"]


def test_finite_elements_keep_the_same_modes_at_any_speed():
    gear_set, excitations = load_gear_set("liu-idler"), Excitations()
    reference = lumped_system(
        gear_set, 100.0, LumpedModel(number=1), excitations=excitations
    )
    elastic_modes = {
        prepare(
            *(gear_set, 100.0, reference, speeds, FiniteElements(fidelity=fidelity)),
            *(DynamicSettings(), excitations),
        ).elastic
        for fidelity in ("auto", "reduced")
        for speeds in ([300.0], [2000.0], [300.0, 4000.0])
    }
    assert len(elastic_modes) <= 2  # one of each fidelity


def test_what_is_left_out_is_measured(pair):
    """Beside both motions from rest, which the check does not use."""
    few = with_modes(pair, 2)
    assert leaves_modes_out(few)
    one = respond(few, 5900.0)
    every = replace(few, contacts=few.contacts.with_all_modes)
    other = respond(every, 5900.0)
    (check,) = check_truncation(few, [one], Settings())
    expected = float(np.abs(other.dte_rms / one.dte_rms - 1.0).max())
    assert check.error == pytest.approx(expected, rel=0.02)
    assert check.frequency == 5900.0
    entries = truncation_entries(few, [check])
    assert f"{100.0 * check.error:.2g} %" in entries["body modes left out"]


def test_a_motion_that_diverges_with_all_modes_is_warned_of(pair, monkeypatch):
    few = with_modes(pair, 2)
    one = respond(few, 5900.0)
    diverged = replace(one, status=Status.DIVERGED, dte_rms=np.full(1, np.nan))
    monkeypatch.setattr(truncation_check, "steady_state", lambda *_: (diverged, None))
    checks = check_truncation(few, [one], Settings())
    assert [check.error for check in checks] == [np.inf]
    (warning,) = truncation_warnings(checks)
    assert "with all solved ones the motion diverges, allowed are" in warning
    entries = truncation_entries(few, checks)
    assert entries["body modes left out"].endswith("diverges at 5900 Hz")


def test_all_modes_leave_nothing_out(pair):
    every = replace(pair, contacts=pair.contacts.with_all_modes)
    assert not leaves_modes_out(every)
    assert check_truncation(every, [respond(every, 2900.0)], Settings()) == ()
    assert truncation_entries(every, ())["body modes left out"] == "none"


@pytest.mark.slow
def test_a_harmonic_that_meets_a_mode_of_a_body_is_seen():
    gear_set, excitations, speed = make_gear_set(HEAVY_IDLER), Excitations(), 930.0
    system = lumped_system(gear_set, 1300.0, COUPLED, excitations)
    response = respond(system, speed)
    reference = lumped_system(
        gear_set, 1300.0, LumpedModel(number=1), excitations=excitations
    )
    settings = DynamicSettings()
    elements = prepare(
        *(gear_set, 1300.0, reference, [speed], FiniteElements(fidelity="reduced")),
        *(settings, excitations),
    )
    expected, _ = steady_state(elements.stepper, speed, settings)
    np.testing.assert_allclose(response.dte_rms, expected.dte_rms, rtol=0.03)
    (check,) = check_truncation(system, [response], Settings())
    assert check.error < 0.02
    # one family alone is far off, and warned of
    few = with_modes(system, 1)
    one_family = respond(few, speed)
    assert np.abs(one_family.dte_rms / expected.dte_rms - 1.0).max() > 0.08
    checks = check_truncation(few, [one_family], Settings())
    assert len(list(truncation_warnings(checks))) == 1
