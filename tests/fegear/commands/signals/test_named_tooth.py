"""The faulty tooth that all signals of a run name, of teeth by finite elements."""

from __future__ import annotations

import numpy as np
import pytest
from fallen_back import random_pair
from slow_tests import first_are_quick

import fegear
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.train.model_settings import LumpedModel
from lumped.steady.maps import Axis

SOURCE = ExcitationSettings(positions=16, resolution="coarse")
PAIR = {
    "name": "15/45",
    "defaults": {"module_mm": 3.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "a", "teeth": 15, "hub_radius_mm": 10.0},
        {"name": "b", "teeth": 45, "hub_radius_mm": 30.0},
    ],
    "mesh": [{"driver": "a", "driven": "b", "backlash_um": 60.0}],
    "load": {"gear": "a", "torques_Nm": [80.0]},
}
SPALL = {"start_roll_angle_deg": 20.0, "end_roll_angle_deg": 28.0, "width_share": 0.5}
FAULTS = {
    "crack": {"cracks": [{"tooth": 8, "depth_mm": 1.5}]},
    "broken tip": {"broken_tips": [{"tooth": 8, "height_mm": 0.6}]},
    "spall": {"spalls": [{"tooth": 8, **SPALL}]},
    "wear": {
        "worn_teeth": [{"tooth": 8, "roll_angle_deg": [12, 35], "depth_um": [5, 9]}]
    },
}


def signals_of(gear_set, number=1, **settings):
    model = LumpedModel(number=number, excitation=SOURCE)
    return fegear.run(fegear.Signals(gear_set=gear_set, model=model, **settings))


@pytest.mark.parametrize("rpm", first_are_quick([3000.0, 600.0, 9000.0], 1))
@pytest.mark.parametrize("fault", FAULTS)
def test_tooth_8_of_15_is_named(compliance_cache, fault, rpm):
    gears = [PAIR["gear"][0] | FAULTS[fault], PAIR["gear"][1]]
    gear_set = fegear.make_gear_set(PAIR | {"gear": gears})
    result = signals_of(gear_set, rpm=rpm, noise_percent=10.0)
    assert result.summary["named_tooth"] == 8
    assert "faulty tooth of a by all signals: 8" in [*result.page()]


@pytest.mark.parametrize("seed", first_are_quick(range(9000, 9020), 3))
def test_a_missing_tooth_is_named_at_any_contact_ratio(compliance_cache, seed):
    gear_set, random = random_pair(seed), np.random.default_rng(seed + 1)
    (gear,) = (one for one in gear_set.gears if one.faults.missing)
    result = signals_of(
        gear_set,
        rpm=float(10.0 ** random.uniform(2.0, 3.5)),
        torque=float(random.uniform(30.0, 200.0)),
        turns=8,
        gear_name=gear.name,
        noise_percent=5.0,
    )
    assert result.summary["named_tooth"] == gear.faults.missing[0] + 1


@pytest.mark.parametrize("root", ["loaded", "back"])
def test_a_crack_of_an_idler_is_named_by_the_mesh_that_opens_it(compliance_cache, root):
    crack = f'gear.idler.cracks=[{{tooth=11,depth_mm=1.5,root="{root}"}}]'
    ref = GearSetRef(name="liu-idler", edits=(crack,))
    result = signals_of(ref, gear_name="idler", rpm=900.0)
    assert result.summary["named_tooth"] == 11


def test_equal_teeth_and_ramps_have_no_tooth(compliance_cache):
    gear_set = fegear.make_gear_set(PAIR)
    result = signals_of(gear_set, rpm=3000.0)
    assert result.summary["named_tooth"] is None
    assert not [line for line in result.page() if "faulty tooth" in str(line)]
    noisy = signals_of(gear_set, rpm=3000.0, noise_percent=50.0)
    assert "faulty tooth of a by all signals: not sure" in [*noisy.page()]
    gears = [PAIR["gear"][0] | FAULTS["crack"], PAIR["gear"][1]]
    faulty = fegear.make_gear_set(PAIR | {"gear": gears})
    ramp = signals_of(faulty, rpm=(2900.0, 3100.0), seconds=0.5)
    assert ramp.summary["named_tooth"] is None


def test_data_sets_have_the_named_tooth_of_every_run(compliance_cache):
    study = fegear.FaultSignals(
        gear_set="liu-pair",
        rpm=900.0,
        over=(Axis("crack", (0.0, 1.0, 2.0)),),
        tooth=12,
        noise_percent=20.0,
        model=LumpedModel(number=1, excitation=SOURCE),
    )
    result = fegear.run(study)
    named = list(result.table["named_tooth"])
    assert named[1:] == [12.0, 12.0]
    assert result.summary["named_runs"] == {"right": 2, "wrong": 0, "unsure": 0}
