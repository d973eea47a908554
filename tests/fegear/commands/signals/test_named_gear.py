"""The gear of a planetary set whose tooth is faulty, by signals over turns of each."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from slow_tests import first_are_quick

import fegear
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.model_settings import LumpedModel
from lumped.signals.sampling import sample_signals
from lumped.signals.tooth_verdict import NamedTooth, tooth_of_run
from lumped.steady.motion import bounded_response

SOURCE = ExcitationSettings(positions=16, resolution="coarse")
MODEL = LumpedModel(number=1, excitation=SOURCE)
# Sun and planets have equal numbers of teeth: the same teeth meet in every turn
TEETH = {"sun": 30, "planet-1": 30, "planet-2": 30, "planet-3": 30, "ring": 90}
SET = {
    "name": "30/30/90",
    "defaults": {"module_mm": 2.5, "face_width_mm": 25.0, "tooth_thinning_um": 40.0},
    "gear": [
        {"name": "sun", "teeth": 30, "hub_radius_mm": 18.0},
        {"name": "planet", "teeth": 30, "hub_radius_mm": 20.0},
        {"name": "ring", "teeth": 90, "internal": True, "rim_radius_mm": 132.0},
    ],
    "planetary": [
        {
            "sun": "sun",
            "planet": "planet",
            "ring": "ring",
            "planets": 3,
            "input": "sun",
            "output": "carrier",
            "held": "ring",
            "sun_mesh": {"tip_relief": {"magnitude_um": 12, "length_pitches": 0.25}},
        }
    ],
    "load": {"gear": "sun", "torques_Nm": [100.0]},
    "dynamics": {"damping_ratio": 0.04},
}
FAULTS = {
    "missing": ("missing_teeth", [5]),
    "tip": ("broken_tips", [{"tooth": 5, "height_mm": 1.5}]),
    "crack": ("cracks", [{"tooth": 5, "depth_mm": 1.5}]),
}
CASES = [
    *(("planet-2", "pitch error"), ("sun", "tip"), ("ring", "pitch error")),
    *(("planet-2", "missing"), ("planet-2", "tip"), ("planet-2", "crack")),
    *(("sun", "pitch error"), ("sun", "missing"), ("sun", "crack")),
    *(("ring", "tip"), ("ring", "missing")),
]


def edit_of(gear: str, fault: str) -> dict[str, object]:
    """Change of the gear set that is the fault of tooth 5 of a gear."""
    errors = [5.0 * (tooth == 5) for tooth in range(1, 1 + TEETH[gear])]
    key, value = FAULTS.get(fault, ("pitch_errors_um", errors))
    return {f"gear.{gear}.{key}": value}


def verdicts(edits: Mapping[str, object], noise: float = 0.0) -> dict[str, NamedTooth]:
    """Verdicts on all gears, by one motion and the default number of turns."""
    gear_set, response, verdicts = fegear.make_gear_set(SET, edits), None, {}
    for name in TEETH:
        settings = {"gear_name": name, "rpm": 900.0, "model": MODEL}
        study = fegear.Signals(gear_set=gear_set, **settings)
        problem = study.prepare()
        system, sampling = problem.system, problem.sampling
        if response is None:
            frequency = problem.study.frequency
            response = bounded_response(system, frequency, problem.integration)
        motion, _, integration = response
        sampled = sample_signals(system, motion, integration, sampling, noise)
        contacts = problem.contacts, problem.other_contacts
        verdicts[name] = tooth_of_run(system, sampled, sampling, *contacts)
    return verdicts


@pytest.mark.parametrize("case", first_are_quick(CASES), ids=" ".join)
def test_the_faulty_tooth_is_named_of_its_gear_alone(compliance_cache, case):
    gear, fault = case
    verdict = verdicts(edit_of(gear, fault))
    differs = NamedTooth(doubt=f"{gear} differs more")
    assert verdict == dict.fromkeys(TEETH, differs) | {gear: NamedTooth(5)}


@pytest.mark.slow
@pytest.mark.parametrize(("gear", "fault"), CASES[:6])
def test_noise_makes_no_other_gear_faulty(compliance_cache, gear, fault):
    verdict = verdicts(edit_of(gear, fault), noise=0.1)
    teeth = {name: verdict[name].tooth for name in TEETH}
    assert teeth == dict.fromkeys(TEETH) | {gear: 5}


def test_noise_and_faults_without_effect_name_no_tooth(compliance_cache):
    chipped = {"gear.planet-2.broken_tips": [{"tooth": 5, "height_mm": 0.01}]}
    for edits, noise in (({}, 0.2), (chipped, 0.0)):
        verdict = verdicts(edits, noise)
        assert {verdict[name].tooth for name in TEETH} == {None}


def test_the_page_says_which_gear_differs_more(compliance_cache):
    gear_set = fegear.make_gear_set(SET, edit_of("planet-2", "pitch error"))
    study = fegear.Signals(gear_set=gear_set, rpm=900.0, model=MODEL)
    result = fegear.run(study)
    assert result.summary["named_tooth"] is None
    line = "faulty tooth of sun by all signals: not sure, planet-2 differs more"
    assert line in [*result.page()]
