"""Contact over the face width: slices against patches, balance, mirrors, slopes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sliced_pairs import COARSE, STEEL, TEETH, TORQUE, WIDTH, problem, slope

from fegear.contact.path import face_along_path
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFlank
from fegear.contact.result import largest_of_bands
from fegear.contact.solve import solve_cycle
from fegear.elasticity.cache import cached_flank_compliance
from fegear.statics.key_figures import loss_factors

POSITIONS = np.arange(12) / 12.0


# largest differences found, on the path and where corners touch, which those of an
# internal gear do longer
PLANE_SHARES = {None: (4e-3, 2e-2), "driven": (7e-3, 3e-2), "driver": (7e-3, 3e-2)}


@pytest.mark.parametrize("ring", PLANE_SHARES)
def test_equal_loads_are_those_of_patches(ring):
    """Of teeth of their width under uniform loads, but where a corner touches."""
    material = replace(STEEL, plane="width", width=WIDTH)
    sliced = problem(slices=24, ring=ring)
    driver, driven = (
        ContactFlank(compliance=cached_flank_compliance(gear, material, COARSE))
        for gear in (sliced.pair.driver, sliced.pair.driven)
    )
    uniform = replace(sliced, solver=PlaneContact(), driver=driver, driven=driven)
    one = solve_cycle(sliced, [TORQUE], POSITIONS)
    two = solve_cycle(uniform, [TORQUE], POSITIONS)
    apart = np.abs(one.ste / two.ste - 1.0)[0]
    on_path, with_corners = PLANE_SHARES[ring]
    assert np.sort(apart)[-3] < on_path
    assert apart.max() < with_corners
    share = np.abs(one.friction_bending[0, 3, 0] / two.friction_bending[0, 3, 0] - 1)
    assert share < 0.03


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_torques_balance(helix_angle_deg):
    cycle = solve_cycle(problem(helix_angle_deg, slope(10e-6)), [TORQUE], POSITIONS)
    base = cycle.base_radius
    moment = (cycle.load * cycle.closing).sum(axis=2) * base
    assert moment[0] == pytest.approx(TORQUE, rel=1e-9)
    length = (
        WIDTH / 16 / math.cos(problem(helix_angle_deg).pair.driver.base_helix_angle)
    )
    total = cycle.face.load.sum(axis=3) * length
    cosine = math.cos(problem(helix_angle_deg).pair.driver.base_helix_angle)
    assert cosine * total == pytest.approx(cycle.load, rel=1e-9)
    inside = np.abs(cycle.closing - 1.0).max(axis=2) < 1e-12
    ratio = TEETH[1] / TEETH[0]
    assert cycle.driven_torque[inside] == pytest.approx(ratio * TORQUE, rel=1e-9)


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_local_stiffness_is_the_slope(helix_angle_deg):
    step = 1e-4 * TORQUE
    cycle = solve_cycle(
        problem(helix_angle_deg, slope(5e-6)),
        [TORQUE, TORQUE - step, TORQUE + step],
        POSITIONS,
    )
    by_difference = 2.0 * step / cycle.base_radius / (cycle.ste[2] - cycle.ste[1])
    apart = np.abs(cycle.local_stiffness[0] / by_difference - 1.0)
    assert np.median(apart) < 1e-5  # slices come into contact at some
    assert apart.max() < 3e-2
    loads = (cycle.load[2] - cycle.load[1]) / (cycle.ste[2] - cycle.ste[1])[:, None]
    most = np.abs(loads).max()
    assert np.median(np.abs(cycle.load_slope[0] - loads)) < 1e-5 * most


def test_the_other_hand_mirrors_the_loads():
    one = solve_cycle(problem(18.0, slope(8e-6)), [TORQUE], POSITIONS)
    sliced = problem(18.0)
    twin = replace(
        sliced.solver.mirrored, gap=slope(8e-6)(sliced.solver.places)[::-1].copy()
    )
    other = replace(sliced, solver=twin)
    two = solve_cycle(other, [TORQUE], POSITIONS)
    assert two.ste == pytest.approx(one.ste, rel=1e-9)
    most = one.face.load.max()
    assert np.abs(two.face.load - one.face.load[..., ::-1]).max() < 1e-7 * most


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0, -18.0])
def test_pinion_and_ring_change_roles(helix_angle_deg):
    """With the same flanks in contact the motion is that backward in time."""
    keys = {"gap": slope(10e-6), "corner_contact": False}
    one = problem(helix_angle_deg, ring="driven", **keys)
    two = problem(helix_angle_deg, ring="driver", **keys)
    ratio = one.pair.driven.teeth / one.pair.driver.teeth
    forward = solve_cycle(one, [TORQUE], POSITIONS)
    backward = solve_cycle(two, [ratio * TORQUE], -POSITIONS)
    assert backward.ste == pytest.approx(forward.ste, rel=1e-9)
    loads = forward.face.load.sum(axis=2)
    assert backward.face.load.sum(axis=2) == pytest.approx(loads, rel=1e-6, abs=1e-3)


@pytest.mark.parametrize("ring", [None, "driven"])
def test_a_small_helix_is_none(ring):
    one = solve_cycle(problem(0.0, ring=ring), [TORQUE], POSITIONS)
    two = solve_cycle(problem(0.01, ring=ring), [TORQUE], POSITIONS)
    assert two.ste == pytest.approx(one.ste, rel=2e-3)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_pulls_and_nothing_overlaps(seed):
    chance = np.random.default_rng(seed)
    gap = chance.uniform(0.0, 30e-6, 16)
    helix = (0.0, 18.0)[seed % 2]
    sliced = problem(helix, lambda z: gap)
    cycle = solve_cycle(sliced, chance.uniform(5.0, 400.0, 3), POSITIONS[:5])
    assert (cycle.face.load >= 0.0).all()
    assert cycle.residual.max() < 1e-9
    touches = (cycle.face.load > 0.0).any(axis=2)
    # slices with the least material missing carry load before those with the most
    assert touches[..., gap.argmin()].all()
    assert cycle.ste[np.argsort(cycle.torque)] == pytest.approx(
        np.sort(cycle.ste, axis=0)
    )


def test_misalignment_loads_an_end_and_crowning_the_middle():
    even = solve_cycle(problem(), [TORQUE], [0.0]).face.load[0, 0, 0]
    tilted = solve_cycle(problem(gap=slope(20e-6)), [TORQUE], [0.0]).face.load[0, 0, 0]
    round_gap = problem(gap=lambda z: 15e-6 * (2.0 * z / WIDTH) ** 2)
    crowned = solve_cycle(round_gap, [TORQUE], [0.0]).face.load[0, 0, 0]
    assert tilted[0] > 1.5 * even[0] > tilted[-1]
    assert (np.diff(tilted)[1:] < 0.0).all()
    assert crowned[8] > 1.2 * even[8]
    assert crowned == pytest.approx(crowned[::-1], rel=1e-9)


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_pressure_is_that_of_hertz(helix_angle_deg):
    """Of the load per length of each slice, with the curvature across the line."""
    sliced = problem(helix_angle_deg, slope(5e-6))
    cycle, pair = solve_cycle(sliced, [TORQUE], POSITIONS), sliced.pair
    face = cycle.face
    one = pair.pitch_point + pair.base_pitch * face.path_position
    radius = one * (pair.line_of_action - one) / pair.line_of_action
    modulus = 0.5 * STEEL.young_modulus / (1.0 - STEEL.poisson_ratio**2)
    load, slices = face.load[0], face.on_path & (face.load[0] > 0.0)
    radius /= np.cos(face.base_helix_angle)
    hertz = np.sqrt(load[slices] * modulus / (np.pi * radius[slices]))
    assert face.pressure[0][slices] == pytest.approx(hertz, rel=1e-6)


def test_more_slices_change_little():
    cycles = [
        solve_cycle(problem(18.0, slices=count), [TORQUE], POSITIONS)
        for count in (16, 32, 64)
    ]
    coarse, fine = (np.abs(c.ste / cycles[-1].ste - 1.0).max() for c in cycles[:2])
    assert coarse < 1e-2
    assert fine < 0.6 * coarse
    assert abs(cycles[0].ste.mean() / cycles[-1].ste.mean() - 1.0) < 1e-3


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_friction_loses_what_the_loss_factor_says(helix_angle_deg):
    """By the torques of reaction, whose moment arms are those of the tooth pairs."""
    small, positions = 1e-3, np.arange(48) / 48.0
    sliced = problem(helix_angle_deg, friction=small, corner_contact=False)
    cycle = solve_cycle(sliced, [TORQUE], positions)
    ratio = np.abs(cycle.driven_torque[0]).mean() / TORQUE * TEETH[0] / TEETH[1]
    (factor,) = loss_factors(sliced.pair, cycle)
    assert (1.0 - ratio) / small == pytest.approx(factor, rel=5e-3)


def test_loads_of_one_tooth_along_the_path():
    """What is a function of the place on the path is found at any place."""
    gears = problem(18.0)
    cycle = solve_cycle(gears, [TORQUE], POSITIONS)
    face, places = cycle.face, np.linspace(-0.6, 0.6, 31)
    straight = 2.0 + 3.0 * face.path_position + face.place
    on_places = face_along_path(cycle, straight, places)
    expected = 2.0 + 3.0 * places[:, None] + face.place
    assert on_places == pytest.approx(expected, rel=1e-9)
    load = face_along_path(cycle, face.load[0], places)
    inside = load[np.abs(places) < 0.3]
    assert inside.min() > 0.3 * inside.max()
    # the mean over one tooth's path is that over the cycle of all teeth
    whole = np.linspace(-1.5, 1.5, 3001)
    over_path = face_along_path(cycle, face.load[0], whole)
    mean = over_path.sum(axis=0) * (whole[1] - whole[0])
    assert mean == pytest.approx(face.per_width[0].mean(axis=0), rel=1e-2)


def test_one_slice_is_refused():
    with pytest.raises(ValueError, match="slices = 1; must be at least 2"):
        problem(slices=1)


def test_widths_must_fit():
    with pytest.raises(ValueError, match="must be within"):
        problem(width=1.1 * WIDTH)


@pytest.mark.parametrize("slices", [1, 7, 24])
def test_a_band_is_a_slice_where_those_are_wide(slices):
    values = np.random.default_rng(slices).uniform(size=(2, slices))
    assert largest_of_bands(values) == pytest.approx(values.max(axis=1), rel=1e-13)


@pytest.mark.parametrize("slices", [25, 33, 36, 90])
def test_the_largest_band_is_that_of_a_sliding_mean(slices):
    values = np.random.default_rng(slices).uniform(size=slices)
    fine = np.repeat(values, 240)  # a band is slices * 10 of them
    length = slices * 10
    sliding = np.convolve(fine, np.full(length, 1.0 / length), "valid")
    assert largest_of_bands(values) == pytest.approx(sliding.max(), rel=1e-12)


def test_bands_at_a_sharp_edge_do_not_depend_on_slices():
    """The load per length grows as the root of the distance from the edge falls."""
    slices, bands = [], []
    for count in (24, 48, 96, 192):
        sums = np.sqrt(np.linspace(0.0, 1.0, count + 1))
        values = count * np.diff(sums)
        slices.append(values.max())
        bands.append(float(largest_of_bands(values)))
    assert slices[-1] > 2.5 * slices[0]
    assert bands == pytest.approx([bands[0]] * 4, rel=1e-12)


@pytest.mark.parametrize("depth", [12e-6, 300e-6])
@pytest.mark.parametrize("torque", [1e-6, 1e-3, 10.0])
def test_light_loads_are_solved_whatever_the_gap(torque, depth):
    """A gap below zero is one above it in a mirror, and a rotation."""
    one, other = (problem(gap=slope(sign * depth)) for sign in (1, -1))
    opened, closed = (solve_cycle(p, [torque], [0.1, 0.6]) for p in (one, other))
    largest = opened.face.load.max()
    apart = opened.face.load - closed.face.load[..., ::-1]
    assert np.abs(apart).max() < 1e-6 * largest
    deflections = (c.ste - c.no_load for c in (opened, closed))
    first, second = deflections
    assert second == pytest.approx(first, rel=1e-5)
