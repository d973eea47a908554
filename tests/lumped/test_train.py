"""What a train is made of: speeds, periods, messages."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped import Gear, Mesh, Shaft, Train, TrainError


def gear(teeth, name="gear", **changes):
    values = {"base_radius": 0.01 * teeth / 10, "inertia": 1e-3} | changes
    return Gear(name=name, teeth=teeth, **values)


def mesh(driver, driven, **changes):
    return Mesh(driver=driver, driven=driven, pressure_angle=0.35, **changes)


def countershaft(stiffness=None):
    return Train(
        gears=tuple(gear(z) for z in (51, 72, 19, 73)),
        meshes=(mesh(0, 1), mesh(2, 3)),
        shafts=(Shaft(gears=(1, 2), stiffness=stiffness),),
    )


def test_idler_turns_and_all_meshes_have_one_frequency(idler):
    train = idler()
    assert train.speeds == (1, Fraction(-38, 55), Fraction(38, 94))
    assert train.mesh_rates == (1, 1)
    assert train.common_period == (1, 1)
    assert [train.sense(i) for i in range(3)] == [1, -1, 1]


@pytest.mark.parametrize("stiffness", [None, 1e5])
def test_countershaft_has_two_periods(stiffness):
    """Omega 2 / omega 1 = z3 / z2: 72 periods of one mesh are 19 of the other."""
    train = countershaft(stiffness)
    assert train.mesh_rates == (1, Fraction(19, 72))
    assert train.common_period == (72, 19)
    assert train.speeds[1] == train.speeds[2] == Fraction(-51, 72)
    assert train.speeds[3] == Fraction(51, 72) * Fraction(19, 73)


@given(teeth=st.lists(st.integers(5, 200), min_size=4, max_size=4))
def test_common_period_is_the_shortest_whole_one(teeth):
    train = Train(
        gears=tuple(gear(z) for z in teeth),
        meshes=(mesh(0, 1), mesh(2, 3)),
        shafts=(Shaft(gears=(1, 2)),),
    )
    first, second = train.common_period
    assert Fraction(second, first) == train.mesh_rates[1]
    assert math.gcd(first, second) == 1


def test_closed_trains_that_can_turn_do():
    """Two idlers between the same gears: a power split."""
    train = Train(
        gears=tuple(gear(z) for z in (20, 30, 40, 50)),
        meshes=(mesh(0, 1), mesh(0, 2), mesh(1, 3), mesh(2, 3)),
    )
    assert train.speeds[3] == Fraction(20, 50)


def test_three_gears_in_a_ring_cannot_turn():
    with pytest.raises(TrainError, match="a closed train that cannot turn"):
        Train(
            gears=tuple(gear(z) for z in (20, 30, 40)),
            meshes=(mesh(0, 1), mesh(1, 2), mesh(2, 0)),
        )


def test_shaft_and_mesh_that_contradict_cannot_turn():
    with pytest.raises(TrainError, match="cannot turn"):
        Train(
            gears=(gear(20), gear(30)),
            meshes=(mesh(0, 1),),
            shafts=(Shaft(gears=(0, 1)),),
        )


def test_first_driver_sets_the_sense_even_if_listed_last():
    train = Train(gears=(gear(94), gear(55), gear(38)), meshes=(mesh(2, 1), mesh(1, 0)))
    assert train.speeds == (Fraction(38, 94), Fraction(-38, 55), 1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"teeth": 0}, r"gear 'a': teeth = 0; must be at least 1"),
        ({"base_radius": 0.0}, "base_radius = 0.0; must be finite and not 0"),
        ({"inertia": math.nan}, "inertia = nan"),
        ({"coupling_stiffness": -1.0}, "coupling_stiffness = -1.0; must be 0 or more"),
        ({"torque": math.inf}, "torque = inf; must be finite"),
        ({"bearing_stiffness": (1e8, 1e8)}, "mass is needed"),
        ({"bearing_stiffness": (-1.0, 1e8), "mass": 1.0}, "bearing_stiffness = -1.0"),
        ({"mass": 0.0}, "mass = 0.0"),
    ],
)
def test_gears_name_what_is_wrong(changes, message):
    values = {"teeth": 20, "base_radius": 0.02, "inertia": 1e-3} | changes
    with pytest.raises(TrainError, match=message):
        Gear(name="a", **values)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pressure_angle": 1.6}, "pressure_angle = 1.6; must be below a right angle"),
        ({"pressure_angle": math.nan}, "pressure_angle"),
        ({"backlash": -1e-6}, "backlash"),
        ({"backlash": math.nan}, "backlash"),
        ({"phase": math.inf}, "phase = inf; must be finite"),
        ({"center_line": math.nan}, "center_line"),
    ],
)
def test_meshes_name_what_is_wrong(changes, message):
    values = {"driver": 0, "driven": 1, "pressure_angle": 0.3} | changes
    with pytest.raises(TrainError, match=message):
        Mesh(**values)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"meshes": ()}, "at least one is needed"),
        ({"meshes": (mesh(0, 0),)}, "mesh of gear 0 with itself"),
        ({"meshes": (mesh(0, 2),)}, "gear index = 2; must be 0 to 1"),
        ({"shafts": (Shaft(gears=(0, -1)),)}, "gear index = -1"),
        ({"damping_ratio": -0.1}, "damping_ratio = -0.1"),
    ],
)
def test_trains_name_what_is_wrong(changes, message):
    values = {"gears": (gear(20), gear(30)), "meshes": (mesh(0, 1),)} | changes
    with pytest.raises(TrainError, match=message):
        Train(**values)


def test_shafts_name_what_is_wrong():
    with pytest.raises(TrainError, match=r"shaft stiffness = 0.0; must be positive"):
        Shaft(gears=(0, 1), stiffness=0.0)
