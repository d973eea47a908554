"""What is said before anything is computed, and the model that all commands choose."""

from __future__ import annotations

import pytest
from counter_shafts import counter_shaft

import fegear
from fegear.studies import load_study
from fegear.studies.registry import commands
from fegear.studies.trains.train_study import TrainStudy

SPEEDS = tuple(float(speed) for speed in range(1000, 4000, 100))
MODELS = {  # settings that commands need besides the gear set
    "sweep": {},
    "map": {"over": ("mesh.1.phase=0:1:3",), "at": 1000.0},
    "motion": {"speed": 1000.0},
    "branches": {"speeds": (1000.0, 2000.0)},
    "bifurcations": {"over": "mesh_frequency_Hz=900:1000:3"},
    "signals": {"speed": 1000.0},
    "sharing": {},
}


def problem(command: str, gear_set, **settings):
    return load_study(command)(gear_set=gear_set, **settings).prepare()


def test_a_counter_shaft_says_after_how_many_periods_its_meshes_repeat():
    gears = counter_shaft(20.0)
    (line,) = problem("sweep", gears, speeds=SPEEDS).announcements
    assert "60 motions that repeat after 67 periods of the first mesh" in line
    assert "s to 3 min of processor time; number 1 takes a tenth or less" in line
    springs = fegear.LumpedModel(number=1)
    assert [*problem("sweep", gears, speeds=SPEEDS, model=springs).announcements] == []
    assert [*problem("sweep", gears, speeds=SPEEDS[:1]).announcements] == []


def test_sharing_says_what_its_seconds_are():
    gears = fegear.load_gear_set("planetary-24-36-96")
    (line,) = problem("sharing", gears).announcements
    assert line.startswith("coupled model: load curves of 6 meshes, solved 6 times, ")


@pytest.mark.parametrize(
    "command",
    [
        *("show", "stiffness", "modes", "theory", "sweep", "branches", "dynamics"),
        *("motion", "signals", "render", "export", "relief"),
    ],
)
def test_teeth_that_jam_are_told_before_anything_is_computed(command, tmp_path):
    gears = fegear.load_gear_set("liu-pair", {"mesh.1.backlash_um": 0.0})
    more = MODELS.get(command, {})
    if command == "render":
        more = {"file": tmp_path / "x.png"}
    study = load_study(command)(gear_set=gears, **more)
    line = next(iter(study.prepare().announcements), "")
    if command == "show":  # it computes nothing; its page has them
        line = fegear.run(study).summary["warnings"][0]
    assert line.startswith("mesh 1: no backlash, the teeth jam in motion")


@pytest.mark.parametrize("command", MODELS)
def test_all_commands_choose_the_coupled_model_or_the_one_that_is_needed(command):
    settings = MODELS[command]
    name = "planetary-24-36-96" if command == "sharing" else "liu-pair"
    gears = fegear.load_gear_set(name)
    assert problem(command, gears, **settings).model.number == "coupled"
    of_figures = fegear.LumpedModel(
        number="auto", excitation=fegear.ExcitationSettings(kind="rectangular")
    )
    if command != "sharing":
        needed = problem(command, gears, model=of_figures, **settings)
        assert needed.model.number == 1
        assert needed.reason.startswith("model 1: ")


def test_no_command_of_motion_is_missing_above():
    studies = [load_study(name) for name in commands()]
    trains = {s.command for s in studies if issubclass(s, TrainStudy)}
    # closed forms of model 1, one whose reference is that of signals, and evidence
    assert trains - {"theory", "stability", "faults", "ablation"} == MODELS.keys()
