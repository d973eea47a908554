"""Case files: those that come along, and those that are wrong."""

from __future__ import annotations

import pytest

from fegear.files.errors import InputError
from fegear.files.speed_ranges import parsed_speeds
from fegear.gearset import load_gear_set
from validation.study.cases import case_names, load_case, read_case
from validation.study.metrics import METRICS
from validation.study.tasks import tasks_of

GOOD = """
name = "small"
title = "Small"
gear_set = "liu-pair"
torques_Nm = [100]
speeds_Hz = "1000:1100:50"

[[model]]
number = 1

[[metric]]
name = "rms_distance"
allowed = 0.2
reason = "for a test"

[[single_speed]]
torque_Nm = 100
speed_Hz = 1000

[[printed]]
quantity = "stiffness"
value = 3e8
unit = "N/m"
where = "Table 5.1"
figure = "mesh1.mean_stiffness"
"""

AT_REST = {"mean_stiffness", "stiffness_variation", "static_deflection"}


@pytest.mark.parametrize("name", case_names())
def test_built_in_cases_load_and_name_gear_sets_that_are_there(name):
    case = load_case(name)
    assert case.name == name
    for model in (None, *case.model):
        load_gear_set(case.gear_set, case.edits_of(model))
    assert all(len(entry.reason) > 20 for entry in case.metric)
    moving = {entry.name for entry in case.metric} - AT_REST
    assert bool(moving) == bool(case.speeds or case.single_speed)


def test_the_comparisons_of_the_source_are_there():
    assert set(case_names()) == {
        "idler",
        "idler-small-hubs",
        "idler-relief-a",
        "idler-relief-b",
        "idler-relief-a-50",
        "idler-bearings",
        "idler-forces",
        "idler-forces-relief-b",
        "countershaft",
        "friction-pair",
        "friction-resonance",
        "friction-sweep",
        "friction-relief",
        "planetary",
    }
    assert load_case("idler").torques_Nm == (50.0, 100.0, 150.0)
    assert load_case("idler-bearings").translations
    used = {entry.name for name in case_names() for entry in load_case(name).metric}
    assert used == set(METRICS)


def test_defaults_and_edits():
    case = read_case(
        GOOD.replace("number = 1", 'number = 1\nedits = ["mesh.1.phase=0.5"]')
    )
    assert (case.fidelity, case.directions) == ("reduced", ("up", "down"))
    assert case.speeds == (1000.0, 1050.0, 1100.0)
    assert case.edits_of() == {}
    assert case.edits_of(case.model[0]) == {"mesh.1.phase": 0.5}
    assert case.model[0].name == "model-1-edited"
    assert case.single_speed[0].label == "1000 Hz from rest"


def test_a_file_is_named_by_its_path(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(GOOD)
    assert load_case(str(path)).name == "small"
    path.write_bytes(b"\xff")
    with pytest.raises(InputError, match=r"own\.toml: not UTF-8 text"):
        load_case(str(path))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("allowed = 0.2", "allowed = -1", "metric 1, allowed = -1; must be at least 0"),
        ("allowed = 0.2", "alowed = 0.2", "unknown key alowed, did you mean allowed?"),
        ("allowed = 0.2", "allowed = nan", "allowed = nan; must be finite"),
        ('reason = "for a test"', "", "metric 1, reason is missing"),
        ('"rms_distance"', '"distance"', 'name = "distance"; must be one of rms_dist'),
        ("number = 1", "number = 4", "model 1, number = 4; must be 1, 2, 3 or coupled"),
        (
            "number = 1",
            "number = 1.5",
            "model 1, number = 1.5; must be 1, 2, 3 or coupled",
        ),
        ("torques_Nm = [100]", "torques_Nm = []", "torques_Nm"),
        ("torques_Nm = [100]", "torques_Nm = [-5]", "entry 1 = -5; must be above 0"),
        (
            "torques_Nm = [100]",
            "torques_Nm = [50]",
            "single_speed.torque_Nm = 100; must be",
        ),
        ("1000:1100:50", "fast", 'speeds_Hz = "fast"; must be positive numbers or'),
        ("1000:1100:50", "1:1e6:1", "1000000 speeds, at most 10000 are allowed"),
        ('title = "Small"', "tittle = 1", "unknown key tittle, did you mean title?"),
        ('title = "Small"', 'title = "S"\nfidelity = "rough"', 'fidelity = "rough"; '),
        ('title = "Small"', 'title = "S"\nedits = ["a"]', "KEY=VALUE is needed"),
        ('title = "Small"', 'title = "S"\nfriction = 0.5', "friction = 0.5; must be"),
        ('title = "Small"', 'title = "S"\ntranslations = 1', "translations = 1; "),
        ('title = "Small"', 'title = "S"\ndirections = ["left"]', "directions entry 1"),
        ("mesh1.mean_stiffness", "mesh1.colour", "must be natural or such as mesh1."),
        ('name = "small"', 'name = "Two words"', "must be small letters, digits and"),
        ("[[model]]", "[[model]]\nnumber = 1\n[[model]]", "model-1 is there 2"),
        ("[[model]]", "[model]", "model"),
        ("title", "= title", "TOML syntax"),
    ],
)
def test_a_wrong_file_gives_one_line(old, new, message):
    with pytest.raises(InputError) as caught:
        read_case(GOOD.replace(old, new, 1), "own.toml")
    line = str(caught.value)
    assert line.startswith("own.toml: ")
    assert message in line
    assert "\n" not in line


def test_an_unknown_case_names_those_that_are_there(tmp_path):
    with pytest.raises(InputError, match="did you mean idler"):
        load_case("idle")
    with pytest.raises(InputError, match="cannot be read, no such file"):
        load_case(str(tmp_path / "none.toml"))


def test_speeds():
    assert parsed_speeds("") == ()
    assert parsed_speeds("100, 100:101:0.5, 7") == (100.0, 100.5, 101.0, 7.0)
    assert parsed_speeds("3:1:1") == (3.0, 2.0, 1.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'speeds_Hz = "1000:1100:50"\n',
            "",
            "metric rms_distance needs speeds_Hz, which is missing",
        ),
        (
            '"rms_distance"',
            '"wave_phase"',
            "metric wave_phase needs single_speed, which is missing",
        ),
        (
            "number = 1",
            "number = 1\nfriction = true",
            "model model-1-friction needs friction above 0",
        ),
        (
            '"rms_distance"',
            '"friction_effect"',
            "metric friction_effect needs a model with friction",
        ),
        (
            "torques_Nm = [100]",
            "torques_Nm = [100, 100]",
            r"torques_Nm = \[100.0, 100.0\]; each is allowed once",
        ),
    ],
)
def test_what_cannot_be_judged_is_refused(old, new, message):
    without_wave = "[[single_speed]]\ntorque_Nm = 100\nspeed_Hz = 1000\n"
    text = GOOD.replace(without_wave, "") if "wave" in new else GOOD
    with pytest.raises(InputError, match=message):
        read_case(text.replace(old, new))


def test_the_effect_of_friction_needs_the_model_without():
    text = GOOD.replace("number = 1", "number = 1\nfriction = true", 1)
    text = text.replace('"rms_distance"', '"friction_effect"')
    text = text.replace("torques_Nm", "friction = 0.1\ntorques_Nm", 1)
    with pytest.raises(InputError, match="needs model-1 beside model-1-friction"):
        read_case(text)


@pytest.mark.parametrize(
    ("new", "message"),
    [
        ("number = 2\nfriction = true", "friction needs model 1"),
        ("number = 1\nbending = 0.4", "bending needs friction = true"),
        ("number = 1\nfriction = true\nbending = 1.0", "bending = 1; must be below 1"),
    ],
)
def test_friction_that_a_model_cannot_have(new, message):
    with pytest.raises(InputError, match=message):
        read_case(GOOD.replace("number = 1", new, 1))


def test_speeds_of_a_run_hold_the_way_to_its_waves():
    """Body modes and elastic modes are chosen for them."""
    case = load_case("idler-forces")
    for task in tasks_of(case):
        assert (min(task.speeds), max(task.speeds)) == (2470.0, 3600.0)
