"""A lumped model that one study has resolved is a setting that others take."""

from __future__ import annotations

from dataclasses import replace

import pytest

import fegear

STUDIES = {
    "branches": fegear.Branches(gear_set="liu-pair", speeds=(1000.0, 1200.0)),
    "sweep": fegear.Sweep(gear_set="liu-pair", speeds=(1000.0, 1200.0)),
    "motion": fegear.Motion(gear_set="liu-pair", speed=1000.0),
}


@pytest.mark.parametrize("taker", ["sweep", "motion"])
@pytest.mark.parametrize("giver", STUDIES)
def test_the_model_of_one_study_is_taken_by_another(giver, taker):
    model = STUDIES[giver].prepare().model
    again = replace(STUDIES[taker], model=model)
    assert again.prepare().model == model
