"""Loss factors of rigid teeth against closed forms and sums over the path."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fegear.commands.show.planetary_values import loss_per_friction
from fegear.contact.path import loss_factor
from fegear.gearset import load_gear_set
from fegear.gearset.loss_factor import equal_share_loss_factor
from meshes import GearPair, SpurGear

SETS = ("liu-pair", "liu-idler", "planetary-24-36-96")


def signed_teeth(pair: GearPair) -> tuple[int, int]:
    return pair.driver.sign * pair.driver.teeth, pair.driven.sign * pair.driven.teeth


def of_one_to_two_pairs(pair: GearPair) -> float:
    """2 pi |1/z1 + 1/z2| (S + D) / 2 with integrals of |x| over the whole path, S, and
    over single contact, D, which for a ring lies beside the pitch point."""
    start, end = pair.path
    whole = start**2 + end**2
    single = (start + 1.0) * abs(start + 1.0) - (end - 1.0) * abs(end - 1.0)
    return (
        0.5 * math.pi * abs(sum(1.0 / z for z in signed_teeth(pair))) * (whole + single)
    )


@pytest.mark.parametrize("name", SETS)
def test_it_is_an_integral_for_a_contact_ratio_of_1_to_2(name):
    for mesh in load_gear_set(name).meshes:
        assert 1.0 < mesh.pair.contact_ratio < 2.0
        expected = of_one_to_two_pairs(mesh.pair)
        assert equal_share_loss_factor(mesh.pair) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["liu-pair", "liu-idler"])
def test_it_is_ohlendorfs_with_the_pitch_point_in_single_contact(name):
    for mesh in load_gear_set(name).meshes:
        start, end = mesh.pair.path
        share = 1.0 - (end - start) + start**2 + end**2
        expected = math.pi * sum(1.0 / z for z in signed_teeth(mesh.pair)) * share
        assert equal_share_loss_factor(mesh.pair) == pytest.approx(expected, rel=1e-12)


def pair_of(addendum: float) -> GearPair:
    """40 and 60 teeth of module 2 mm, tips by addenda [modules]."""
    one, two = (
        SpurGear(
            teeth=teeth,
            module=0.002,
            pressure_angle=math.radians(20.0),
            profile_shift=0.0,
            tip_radius=0.001 * teeth + 0.002 * addendum,
            dedendum=0.0032,
            rack_tip_radius=0.0004,
            hub_radius=0.012,
            tooth_thinning=2e-5,
        )
        for teeth in (40, 60)
    )
    return GearPair(one, two, 0.1)


@pytest.mark.parametrize("addendum", [0.9, 1.0, 1.3])
def test_it_is_the_sum_over_positions_of_pairs_with_equal_shares(addendum):
    """Contact ratios below and above 2."""
    pair = pair_of(addendum)
    assert (pair.contact_ratio > 2.0) == (addendum > 1.2)
    count = 20_000
    position = (np.arange(count) + 0.5) / count
    places = position[:, None] + np.arange(-3, 3)
    start, end = pair.path
    touching = (places > start) & (places < end)
    share = touching / touching.sum(axis=1, keepdims=True)
    expected = loss_factor(signed_teeth(pair), places, share)
    assert equal_share_loss_factor(pair) == pytest.approx(float(expected), rel=1e-4)


def test_power_is_the_balance_of_torques_of_a_rigid_pair():
    """One pair of teeth with friction, T2 / T1 of its forces by hand.

    With the contact x past the pitch point, N and its friction mu N act at the arms
    r_b and r_b tan(a) + x of the driver, r_b and r_b tan(a) - x of the driven gear.
    """
    pair, friction = pair_of(0.9), 1e-5
    start, end = pair.path
    x = np.linspace(start, end, 4001) * pair.base_pitch
    one, two = pair.driver.base_radius, pair.driven.base_radius
    slope = math.tan(pair.operating_pressure_angle)
    drag = friction * np.sign(x)
    into = one + drag * (one * slope + x)
    out = two + drag * (two * slope - x)
    lost = 1.0 - out / into * one / two
    teeth = 2.0 * math.pi * (1 / 40 + 1 / 60) * np.abs(x) / pair.base_pitch
    np.testing.assert_allclose(lost, friction * teeth, rtol=1e-3, atol=1e-12)


def test_both_meshes_of_a_planetary_set_lose_of_the_power_that_rolls():
    gear_set = load_gear_set("planetary-24-36-96")
    sun, ring = (of_one_to_two_pairs(mesh.pair) for mesh in gear_set.meshes[:2])
    assert loss_per_friction(gear_set) == pytest.approx(0.8 * (sun + ring), rel=1e-12)
