"""Speeds of rotation are mesh frequencies of the first mesh over its driver's teeth."""

from __future__ import annotations

import pytest

import fegear
from fegear.gearset import load_gear_set
from fegear.gearset.speeds import cycles_per_turn, driver_rpm, mesh_frequency

TEETH = 38  # of the driver of liu-pair
PAIR = {"gear_set": "liu-pair"}
OVER = {"over": "damping_ratio=0.02:0.04:3"}
ENDS = {"over": "damping_ratio=0.02:0.04"}


def frequency(rpm: float) -> float:
    return rpm * TEETH / 60.0


PAIRS = [
    (fegear.Sweep, {}, "rpm", (900.0, 1500.0), "speeds"),
    (fegear.Dynamics, {}, "rpm", (900.0,), "speeds"),
    (fegear.Stability, {"over": "friction=0:0.1:2"}, "rpm", (900.0, 950.0), "speeds"),
    (fegear.Map, OVER, "rpm", (900.0,), "at"),
    (fegear.Map, OVER, "rpm", (900.0, 950.0), "band"),
    (fegear.Motion, {}, "rpm", 900.0, "speed"),
    (fegear.Branches, {}, "rpm", (900.0, 950.0), "speeds"),
    (fegear.Branches, ENDS, "rpm", (900.0,), "at"),
    (fegear.Bifurcations, OVER, "rpm", 900.0, "at"),
]


@pytest.mark.parametrize(("study", "settings", "name", "rpm", "in_Hz"), PAIRS)
def test_a_study_in_rpm_is_the_study_in_hertz(study, settings, name, rpm, in_Hz):
    numbers = rpm if isinstance(rpm, tuple) else (rpm,)
    hertz = tuple(map(frequency, numbers))
    single = in_Hz in ("at", "speed")
    turned = study(**PAIR, **settings, **{name: rpm})
    expected = study(**PAIR, **settings, **{in_Hz: hertz[0] if single else hertz})
    assert turned.prepare().study == expected
    assert dict(turned.prepare().inputs) == dict(expected.prepare().inputs)


def test_a_first_motion_may_have_its_own_unit():
    motion = fegear.Motion(**PAIR, rpm=1500.0, from_speed=900.0).prepare().study
    assert (motion.frequency, motion.from_speed) == (frequency(1500.0), 900.0)
    motion = fegear.Motion(**PAIR, speed=900.0, from_rpm=1500.0).prepare().study
    assert (motion.frequency, motion.from_speed) == (900.0, frequency(1500.0))


def test_the_driver_of_the_first_mesh_counts():
    problem = fegear.Motion(gear_set="liu-idler", rpm=900.0).prepare()
    driver = problem.gears.gears[problem.gears.meshes[0].driver]
    expected = 900.0 * driver.geometry.teeth / 60.0
    assert problem.study.frequency == pytest.approx(expected)


def test_the_conversion_leads_back():
    assert cycles_per_turn(load_gear_set("liu-pair")) == TEETH
    for rpm in (1500.0, 1.0 / 3.0, 2999.9):
        frequency = mesh_frequency(TEETH, rpm)
        assert driver_rpm(TEETH, frequency) == pytest.approx(rpm, rel=1e-14)
