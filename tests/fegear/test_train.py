"""Lumped trains from gear sets: statics, senses, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from fegear.files.errors import InputError
from fegear.gearset import GearSet, Shaft, builtin_names, load_gear_set, read_gear_set
from fegear.gearset.inertia import inertia_of, mass_of
from fegear.gearset.lumped_train import train_of
from fegear.gearset.power_path import external_torques, input_torques, mesh_torques_at

SETS = {name: load_gear_set(name) for name in builtin_names()}
IDLER = SETS["liu-idler"]


def row(*meshes: tuple[str, str], more: str = "") -> GearSet:
    """Gears a to d of 30, 41, 36 and 25 teeth in meshes (driver, driven)."""
    text = 'name = "row"\n[defaults]\nmodule_mm = 2\nface_width_mm = 20\n'
    for name, teeth in zip("abcd", (30, 41, 36, 25), strict=True):
        text += f'[[gear]]\nname = "{name}"\nteeth = {teeth}\nhub_radius_mm = 10\n'
    for driver, driven in meshes:
        text += f'[[mesh]]\ndriver = "{driver}"\ndriven = "{driven}"\n'
        text += "operating_pressure_angle_deg = 20.5\n"
    return read_gear_set(text + more)


TRAINS = SETS | {
    "one stage": row(("a", "b")),
    "three meshes": row(("a", "b"), ("b", "c"), ("c", "d")),
    "listed backward": row(
        ("b", "c"), ("a", "b"), more='[load]\ngear = "a"\ntorques_Nm = [10, 20]\n'
    ),
    "two stages": row(("a", "b"), ("c", "d"), more='[[shaft]]\ngears = ["b", "c"]\n'),
}


@pytest.mark.parametrize("gear_set", TRAINS.values(), ids=list(TRAINS))
def test_power_in_is_power_out(gear_set):
    train = train_of(gear_set, 80.0)
    powers = [
        gear.torque * float(speed)
        for gear, speed in zip(train.gears, train.speeds, strict=True)
    ]
    assert max(powers) > 0.0 > min(powers)
    assert sum(power != 0.0 for power in powers) == 2
    assert math.fsum(powers) == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("gear_set", TRAINS.values(), ids=list(TRAINS))
def test_senses_are_those_of_the_lumped_train(gear_set):
    train = train_of(gear_set, 1.0)
    assert gear_set.senses == tuple(map(train.sense, range(len(gear_set.gears))))
    assert gear_set.senses[gear_set.meshes[0].driver] == 1


@pytest.mark.parametrize("gear_set", TRAINS.values(), ids=list(TRAINS))
def test_load_cases_pass_through_the_meshes(gear_set):
    for case, torque in enumerate(input_torques(gear_set)):
        expected = [mesh.torques[case] for mesh in gear_set.meshes]
        assert mesh_torques_at(gear_set, torque) == pytest.approx(expected)


def test_idler_torques_are_the_printed_ones():
    torques = [gear.torque for gear in train_of(IDLER, 100.0).gears]
    assert torques == pytest.approx([100.0, 0.0, -247.0], abs=0.5)
    assert mesh_torques_at(IDLER, 100.0) == pytest.approx((100.0, 144.7), abs=0.05)
    assert input_torques(IDLER) == (50.0, 100.0, 150.0)


def test_load_names_the_input_and_the_first_mesh_the_sense():
    """The input gear turns clockwise where an idler's mesh is listed first."""
    torques = external_torques(TRAINS["listed backward"], 10.0)
    assert torques == pytest.approx((-10.0, 0.0, 10.0 * 36 / 30, 0.0))
    assert input_torques(TRAINS["listed backward"]) == (10.0, 20.0)


def test_a_set_without_load():
    three = TRAINS["three meshes"]
    assert input_torques(three) == ()
    assert mesh_torques_at(three, 30.0) == pytest.approx((30.0, 41.0, 36.0))
    assert external_torques(three, 30.0) == pytest.approx((30.0, 0.0, 0.0, 25.0))


def test_a_gear_that_only_rides_along_bears_nothing():
    torques = external_torques(row(("a", "b"), ("c", "b")), 30.0)
    assert torques == pytest.approx((30.0, 41.0, 0.0, 0.0))
    assert mesh_torques_at(row(("a", "b"), ("c", "b")), 30.0) == (30.0, 0.0)


def test_figures_of_the_gears():
    train = train_of(IDLER, 100.0)
    for gear, lumped in zip(IDLER.gears, train.gears, strict=True):
        assert lumped.teeth == gear.geometry.teeth
        assert lumped.base_radius == gear.geometry.base_radius
        assert (lumped.inertia, lumped.mass) == (inertia_of(gear), mass_of(gear))
        assert lumped.coupling_stiffness == gear.coupling_stiffness
        assert lumped.bearing_stiffness is None


def test_figures_of_the_meshes():
    second = replace(IDLER.meshes[1], center_line=0.4, backlash=60e-6, phase=None)
    bent = replace(IDLER, meshes=(IDLER.meshes[0], second))
    one, two = train_of(bent, 100.0).meshes
    assert (one.center_line, two.center_line) == (0.0, 0.4)
    assert one.backlash == IDLER.meshes[0].pair.backlash
    assert two.backlash == 60e-6
    assert two.pressure_angle == pytest.approx(math.radians(21.02))
    expected = math.remainder(-0.048187 + 0.4 * 55 / (2.0 * math.pi), 1.0)
    assert two.phase == pytest.approx(expected, abs=1e-6)


def test_translations_keep_the_bearings_there_are():
    gears = (replace(IDLER.gears[0], bearing_stiffness=None), *IDLER.gears[1:])
    train = train_of(replace(IDLER, gears=gears), 100.0, translations=True)
    bearings = [gear.bearing_stiffness for gear in train.gears]
    assert bearings == [None, (1.4732e8,) * 2, (1.6637e8,) * 2]


def test_damping_of_the_caller_of_the_set_and_by_default():
    quiet = replace(IDLER, damping_ratio=0.01)
    assert train_of(quiet, 1.0, damping_ratio=0.0).damping_ratio == 0.0
    assert train_of(quiet, 1.0).damping_ratio == 0.01
    assert train_of(TRAINS["one stage"], 1.0).damping_ratio == 0.04


def test_long_shafts_are_chains():
    three = replace(
        TRAINS["one stage"], shafts=(Shaft(gears=(1, 2, 3), stiffness=5e5),)
    )
    shafts = train_of(three, 1.0).shafts
    assert [shaft.gears for shaft in shafts] == [(1, 2), (2, 3)]
    assert {shaft.stiffness for shaft in shafts} == {5e5}


REFUSALS = {
    "translations": (
        lambda: train_of(SETS["liu-pair"], 1.0, translations=True),
        "liu-pair: no gear has bearing_kx_N_per_m and bearing_ky_N_per_m; at least "
        "one is needed for translations",
    ),
    "negative torque": (
        lambda: train_of(IDLER, -5.0),
        "liu-idler: torque = -5 N m on the input gear; must be 0 or more and finite, "
        "in the sense of rotation",
    ),
    "torque that is no number": (
        lambda: mesh_torques_at(IDLER, math.nan),
        "liu-idler: torque = nan N m on the input gear; must be 0 or more and finite, "
        "in the sense of rotation",
    ),
    "branch": (
        lambda: train_of(row(("a", "b"), ("b", "c"), ("b", "d")), 1.0),
        'row: gear "b" or its shaft drives 2 meshes; the split of the torque is '
        "ambiguous, one mesh is allowed",
    ),
    "branch at the input": (
        lambda: input_torques(row(("a", "b"), ("a", "c"))),
        'row: gear "a" or its shaft drives 2 meshes; the split of the torque is '
        "ambiguous, one mesh is allowed",
    ),
    "closed": (
        lambda: train_of(row(("a", "b"), ("b", "c"), ("c", "a")), 1.0),
        'row: power returns to gear "a"; a train that ends in a driven gear is needed',
    ),
    "damping": (
        lambda: train_of(IDLER, 1.0, damping_ratio=-1.0),
        "liu-idler: damping_ratio = -1.0; must be 0 or more and finite",
    ),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refused_in_one_line(case):
    attempt, message = REFUSALS[case]
    with pytest.raises(InputError) as caught:
        attempt()
    assert str(caught.value) == message
