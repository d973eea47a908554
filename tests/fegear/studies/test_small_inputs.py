"""Speeds that fall, one position, many natural frequencies, speeds of rotation."""

from __future__ import annotations

from dataclasses import replace

import pytest

import fegear
from fegear.cli import run
from fegear.files.errors import InputError
from fegear.gearset.speeds import cycles_per_turn
from fegear.studies.trains.axes import parsed_axis
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.headings import SHOWN_FREQUENCIES, first_frequencies
from validation.commands.ablation.study import Ablation

PAIR = GearSetRef(name="liu-pair")


@pytest.mark.parametrize("study", [fegear.Sweep, fegear.Dynamics])
@pytest.mark.parametrize("name", ["speeds", "rpm"])
def test_speeds_that_fall_are_refused(study, name):
    with pytest.raises(InputError, match=r"must rise; .*direction down passes them"):
        study(gear_set=PAIR, **{name: (3000.0, 2950.0, 2900.0)})
    study(gear_set=PAIR, **{name: (2900.0, 3000.0)}, direction="down")
    study(gear_set=PAIR, **{name: (2900.0, 3000.0, 2950.0)})


def test_the_message_has_the_option(capsys):
    assert run(["sweep", "liu-pair", "--speeds", "3000:2000:50"]) == 2
    line = capsys.readouterr().err
    assert "--speeds = 3000:2000:50; must rise; --direction down passes" in line


def test_one_position_is_refused(capsys):
    assert run(["stiffness", "liu-pair", "--positions", "1"]) == 2
    assert "positions = 1; must be 2 or more" in capsys.readouterr().err


def test_only_the_first_natural_frequencies_are_printed():
    few = [100.0 * n for n in range(1, SHOWN_FREQUENCIES + 1)]
    assert first_frequencies(few).endswith(f"{few[-1]:.1f}")
    text = first_frequencies([*few, 1e4, 1e5])
    assert text == f"{first_frequencies(few)} and 2 more, all by --json"


def test_bifurcations_over_the_speed_of_rotation():
    over = parsed_axis("driver_speed_rpm=1200:1500:4")
    study = fegear.Bifurcations(gear_set=PAIR, over=over)
    teeth = cycles_per_turn(fegear.load_gear_set("liu-pair"))
    problem = study.prepare()
    assert problem.study.over.name == "mesh_frequency_Hz"
    expected = [rpm * teeth / 60.0 for rpm in over.values]
    assert problem.study.over.values == pytest.approx(expected, rel=1e-15)
    with pytest.raises(InputError, match="driver_speed_rpm replaces it"):
        replace(study, at=1000.0)
    with pytest.raises(InputError, match=r"driver_speed_rpm = -1; must be above 0"):
        fegear.Bifurcations(gear_set=PAIR, over=parsed_axis("driver_speed_rpm=-1,2"))


def test_ablation_takes_one_form_of_speeds():
    with pytest.raises(InputError, match="is needed"):
        Ablation(gear_set=PAIR)
    with pytest.raises(InputError, match="exclude each other"):
        Ablation(gear_set=PAIR, speeds=(1000.0,), rpm=(1000.0,))
    assert Ablation(gear_set=PAIR, rpm=(1000.0, 1100.0)).rpm == (1000.0, 1100.0)
