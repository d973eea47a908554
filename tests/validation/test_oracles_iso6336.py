"""ISO 6336-1 mesh stiffness against worked values and its own factors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from validation.oracles import iso6336

TEETH, CONTACT_RATIO = (17, 43), 1.6211


def test_worked_single_stiffness():
    theoretical = iso6336.theoretical_single_stiffness(TEETH)
    assert theoretical == pytest.approx(16.032, abs=5e-4)
    assert iso6336.single_stiffness(theoretical) == pytest.approx(12.505, abs=5e-4)


def test_worked_mesh_stiffness():
    """18.330 needs C_M = 0.8 and C_B = 0.975, the rack of dedendum 1.25 m."""
    theoretical = iso6336.theoretical_single_stiffness(TEETH)
    single = iso6336.single_stiffness(theoretical)
    mesh = iso6336.mesh_stiffness(single, CONTACT_RATIO)
    assert mesh == pytest.approx(18.330, abs=5e-4)
    without = iso6336.single_stiffness(theoretical, rack_factor=1.0)
    assert iso6336.mesh_stiffness(without, CONTACT_RATIO) == pytest.approx(
        18.80, abs=0.005
    )


def test_stiffness_of_a_face_width():
    mean = iso6336.mean_mesh_stiffness(TEETH, CONTACT_RATIO, 10e-3)
    assert mean == pytest.approx(18.330 * 10.0 * 1e6, rel=1e-4)  # N/(mm um) mm um/m


def test_factors_can_be_given():
    bare = iso6336.mean_mesh_stiffness(TEETH, 1.0, 1e-3, factors=(1.0, 1.0, 1.0))
    assert bare == pytest.approx(16.032e6, rel=1e-4)


@pytest.mark.parametrize(
    ("dedendum", "angle_deg", "factor"),
    [(1.2, 20, 1.0), (1.25, 20, 0.975), (1.2, 25, 1.1)],
)
def test_basic_rack_factor(dedendum, angle_deg, factor):
    value = iso6336.basic_rack_factor(dedendum, math.radians(angle_deg))
    assert value == pytest.approx(factor)


def test_gear_blank_factor():
    assert iso6336.gear_blank_factor() == 1.0
    assert iso6336.gear_blank_factor(0.2, 1.0) == pytest.approx(
        1.0 + math.log(0.2) / (5.0 * math.exp(0.2))
    )
    assert iso6336.gear_blank_factor(0.1, 0.5) == iso6336.gear_blank_factor(0.2, 1.0)


@pytest.mark.parametrize(
    ("gap", "factor"), [(0.0, 1.0), (5e-6, 1.25), (20e-6, 2.0), (80e-6, 4.0)]
)
def test_face_load_factor_by_a_load_that_is_linear_over_the_width(gap, factor):
    """Springs over the width, closed by a load without moment: largest over mean."""
    specific, stiffness = 100e3, 10e9 / 0.85
    assert iso6336.face_load_factor(gap, stiffness, specific) == pytest.approx(factor)
    z = (np.arange(200_000) + 0.5) / 200_000
    low, high = -1.0, 1.0
    for _ in range(80):  # approach at which the springs carry the load
        approach = 0.5 * (low + high)
        load = 10e9 * np.maximum(approach - gap * z, 0.0)
        low, high = (approach, high) if load.mean() < specific else (low, approach)
    assert load.max() / load.mean() == pytest.approx(factor, rel=1e-4)


def test_low_load_factor():
    assert iso6336.low_load_factor(200e3) == 1.0
    assert iso6336.low_load_factor(100e3 / 16.0) == pytest.approx(0.5)


@given(st.integers(17, 200), st.integers(17, 200))
def test_more_teeth_are_stiffer(pinion, wheel):
    one = iso6336.theoretical_single_stiffness((pinion, wheel))
    assert iso6336.theoretical_single_stiffness((pinion + 1, wheel)) > one
    assert iso6336.theoretical_single_stiffness((pinion, wheel + 1)) > one


def test_two_racks():
    rack = iso6336.theoretical_single_stiffness((10**9, 10**9))
    assert rack == pytest.approx(1.0 / 0.04723, rel=1e-6)


@given(st.floats(1e-3, 0.2), st.floats(1.2, 1.9))
def test_scaling_with_width_and_contact_ratio(width, ratio):
    mean = iso6336.mean_mesh_stiffness(TEETH, ratio, width)
    unit = iso6336.mean_mesh_stiffness(TEETH, 1.0, 1.0)
    assert mean == pytest.approx(unit * width * (0.75 * ratio + 0.25), rel=1e-12)


def test_profile_shift_stiffens_the_pinion():
    plain = iso6336.theoretical_single_stiffness(TEETH)
    assert iso6336.theoretical_single_stiffness(TEETH, (0.3, 0.0)) > plain


def test_arguments_are_checked():
    with pytest.raises(ValueError, match="contact_ratio"):
        iso6336.mesh_stiffness(12.0, math.nan)
    with pytest.raises(ValueError, match="face_width"):
        iso6336.mean_mesh_stiffness(TEETH, 1.5, 0.0)
    with pytest.raises(ValueError, match="teeth"):
        iso6336.theoretical_single_stiffness((17, -43))


def test_the_materials_of_both_gears_count():
    assert iso6336.material_factor((206e9, 206e9)) == 1.0
    assert iso6336.material_factor((3e9, 3e9)) == pytest.approx(3.0 / 206.0)
    # two springs in series, each scaled with its modulus
    series = 1.0 / (0.5 * 206.0 / 118.0 + 0.5)
    assert iso6336.material_factor((118e9, 206e9)) == pytest.approx(series)
    assert series == pytest.approx(0.73, abs=0.005)  # grey iron on steel: 0.74 there
    with pytest.raises(ValueError, match="young_moduli"):
        iso6336.material_factor((206e9, 0.0))
