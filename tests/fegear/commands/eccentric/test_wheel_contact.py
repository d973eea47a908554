"""Contact of eccentric wheels: ordinary gears, balance, convergence, Hertz."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import fegear
from fegear.commands.eccentric.elastic_wheel import ElasticWheel
from fegear.commands.eccentric.wheel_contact import (
    pairs_at,
    share_load,
    solve_contact_cycle,
)
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.elasticity.flank import flank_compliance
from fegear.elasticity.material import PlaneMaterial, pressure_in_plane
from fegear.elasticity.sector import cyclic_sector
from fegear.files.errors import InputError
from meshes import GearPair, MeshSize, SpurGear
from meshes.eccentric import EccentricPair
from meshes.eccentric.base import TRAILING
from meshes.eccentric.outline import WheelEdges
from meshes.eccentric.teeth import ToothedPair
from meshes.eccentric.wheel_mesh import wheel_mesh

STEEL = PlaneMaterial(2.06e11, 0.3)
ALPHA = math.radians(20.0)


def wheels_of(toothed, bore, fineness=1.0):
    edges = WheelEdges().refined(fineness)
    wheels = (toothed.driver, toothed.driven)
    return [ElasticWheel(wheel_mesh(wheel, bore, edges), STEEL) for wheel in wheels]


@pytest.fixture(scope="module")
def turn():
    wheels = {"radius": 20.0, "eccentricity": 8.0, "teeth": 30}
    return fegear.run(fegear.Eccentric(**wheels, torque=20.0, positions=45))


@pytest.mark.slow
def test_without_eccentricity_the_pair_of_a_gear_set():
    """The same wheels by one tooth sector and contact patches: within 1e-3."""
    teeth, m, load = 24, 2e-3, 1e4
    radius = 0.5 * m * teeth
    gear = SpurGear(
        teeth=teeth,
        module=m,
        pressure_angle=ALPHA,
        profile_shift=0.0,
        tip_radius=radius + m,
        dedendum=1.25 * m,
        rack_tip_radius=0.3 * m,
        hub_radius=8e-3,
    )
    flank = flank_compliance(cyclic_sector(gear, STEEL, MeshSize()))
    pair = GearPair(gear, gear, 2.0 * radius)
    problem = ContactProblem(
        pair=pair,
        driver=ContactFlank(compliance=flank),
        driven=ContactFlank(compliance=flank),
        face_width=1.0,
        corner_contact=False,
    )
    position = np.array([-0.4, -0.21, 0.003, 0.18, 0.36])
    expected = solve_cycle(problem, [load], position)
    toothed = ToothedPair(EccentricPair(radius, 0.0), ALPHA, teeth)
    wheels = wheels_of(toothed, 8e-3)
    # the pair of teeth 0 is at its pitch point a quarter of a pitch early
    cycle = solve_contact_cycle(
        toothed, *wheels, load, toothed.rack.pitch * (position - 0.25)
    )
    error = cycle.driver_error * gear.base_radius
    np.testing.assert_allclose(error, expected.ste[0], rtol=1e-3)
    in_strain = pressure_in_plane(STEEL, STEEL, "strain")
    pressure = in_strain * expected.pressure[0].max(axis=1)
    uncut = [0, 2, 3, 4]  # where no tip corner cuts the contact off
    np.testing.assert_allclose(cycle.pressure[uncut], pressure[uncut], rtol=0.01)
    share = expected.load_share[0].max(axis=1)
    np.testing.assert_allclose(cycle.largest_share, share, atol=2e-3)


def test_torque_follows_the_kinematics(turn):
    columns = turn.columns
    ratio = columns["contact_torque_ratio"] / columns["torque_ratio"]
    np.testing.assert_allclose(ratio, 1.0, atol=5e-4)
    assert np.ptp(columns["torque_ratio"]) > 1.5
    assert turn.summary["contact"]["largest_deviation_of_torque_ratio"] < 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("ends", [0, 1], ids=["begin", "end"])
def test_torque_follows_the_kinematics_at_tip_corners(ends):
    """Where a pair of teeth comes into contact and leaves it, and just inside of its
    path: the tip corner belongs to the flank."""
    toothed = ToothedPair(EccentricPair(0.02, 0.007), ALPHA, 36)
    inside = (1 - 2 * ends) * 1e-9 * toothed.rack.pitch
    arcs = np.concatenate([toothed.contact[:9, ends] + i * inside for i in range(2)])
    cycle = solve_contact_cycle(toothed, *wheels_of(toothed, 4e-3, 0.7), 2e3, arcs)
    expected = toothed.pair.torque_ratio(arcs / toothed.pair.radius)
    np.testing.assert_allclose(cycle.torque_ratio / expected, 1.0, atol=1e-3)


def test_torque_off_the_kinematics_is_warned_of(turn):
    columns = dict(turn.columns)
    columns["contact_torque_ratio"] = columns["contact_torque_ratio"] * 1.002
    few_positions, line = replace(turn, columns=columns).summary["warnings"]
    assert turn.summary["warnings"] == [few_positions]
    assert "torque ratios against the kinematics are off by 0.002" in line


def test_the_turn_is_a_whole_one(turn):
    columns = turn.columns
    assert set(columns["pairs"]) == {1.0, 2.0}
    assert columns["driver_angle_deg"][0] == 0.0
    step = 8.0 * math.degrees(1.0)
    assert 360.0 - step < columns["driver_angle_deg"][-1] < 360.0
    shares = columns["largest_load_share"]
    np.testing.assert_allclose(shares[columns["pairs"] == 1.0], 1.0)
    assert (shares[columns["pairs"] == 2.0] < 0.9).all()


def test_a_turn_is_a_mirror_image_of_itself(turn):
    """Arms and torque ratio; teeth are not, as they stand a quarter of a pitch off."""
    arm = turn.columns["transmission_error_um"] / turn.columns["driver_error_urad"]
    ratio = turn.columns["torque_ratio"]
    np.testing.assert_allclose(ratio[1:], ratio[:0:-1], rtol=1e-9)
    assert np.ptp(arm) > 0.3 * arm.mean()


@pytest.mark.slow
def test_mesh_refinement():
    toothed = ToothedPair(EccentricPair(0.02, 0.004), ALPHA, 20)
    arcs = toothed.rack.pitch * np.array([3.0, 3.4, 17.7])
    errors = [
        solve_contact_cycle(toothed, *wheels_of(toothed, 4e-3, f), 2e3, arcs).error
        for f in (0.5, 1.0, 1.7)
    ]
    far, near = (np.abs(e / errors[-1] - 1.0).max() for e in errors[:2])
    assert near < 2e-3
    assert near < far


@pytest.mark.slow
def test_transmission_error_is_continuous_at_tip_corners():
    """From a tip corner on, over a thousandth of a pitch: a load on the corner itself
    was half as soft."""
    toothed = ToothedPair(EccentricPair(0.02, 0.007), ALPHA, 36)
    wheels = wheels_of(toothed, 4e-3)
    for corner, inward in zip(toothed.contact[5], (1.0, -1.0), strict=True):
        arcs = corner + inward * toothed.rack.pitch * np.array([0.0, 1e-4, 1e-3, 1e-2])
        error = solve_contact_cycle(toothed, *wheels, 2e3, arcs).error
        np.testing.assert_allclose(error, error[-1], rtol=0.01)


@pytest.mark.slow
def test_compliance_is_reciprocal_and_positive():
    toothed = ToothedPair(EccentricPair(0.02, 0.008), ALPHA, 40)
    driver, _ = wheels_of(toothed, 4e-3)
    pairs = pairs_at(toothed, 2.2 * toothed.rack.pitch)
    assert pairs.radius.size == 2
    middle = toothed.rack.pitch * pairs.driver_tooth
    outward = toothed.driver.curve.frames(middle / 0.02).normal
    flanks = driver.mesh.flanks[TRAILING][pairs.driver_tooth]
    places = driver.places(pairs.driver_point, outward, flanks)
    np.testing.assert_allclose(places.point, pairs.driver_point, atol=2e-8)
    matrix = driver.compliance(places, driver.respond(places))
    assert matrix[0, 1] == pytest.approx(matrix[1, 0], rel=2e-4)


def test_hertz_alone():
    """Approach of two half-planes at the middle of the semi-ellipse, by quadrature."""
    softness, radius, force = 2.0 / 2.06e11, 4e-3, 3e5
    stiff = np.zeros((1, 1))
    forces, approach = share_load(stiff, np.array([radius]), softness, force)
    assert forces == pytest.approx([force])
    b = math.sqrt(4.0 * force * radius * softness / math.pi)

    def under(x):
        return -2.0 * math.log(x) * 2.0 / (math.pi * b) * math.sqrt(1.0 - (x / b) ** 2)

    expected = 2.0 * quad(under, 0.0, b)[0] * force / math.pi * softness
    assert approach == pytest.approx(expected, rel=1e-8)


def test_loads_add_up_and_none_pulls():
    softness, radius = 2.0 / 2.06e11, np.array([4e-3, 4e-3, 2e-3])
    matrix = np.array([[4.0, 3.9, 0.1], [3.9, 4.1, 0.1], [0.1, 0.1, 0.2]]) / 2.06e11
    forces, _ = share_load(matrix, radius, softness, 1e5)
    assert forces.sum() == pytest.approx(1e5, rel=1e-12)
    assert (forces >= 0.0).all()


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        ({}, "^torque needs teeth"),
        ({"teeth": 40, "bore": 30.0}, "^bore = 30 mm"),
        ({"eccentricity": 1.0, "teeth": 1500}, "at most 2000 on both wheels in meshes"),
    ],
)
def test_loads_that_cannot_be(overrides, reason):
    wheels = {"radius": 20.0, "eccentricity": 6.0, "torque": 1.0}
    with pytest.raises(InputError, match=reason):
        fegear.run(fegear.Eccentric(**wheels | overrides))
