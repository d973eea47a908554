"""Contact of an internal gear: whole gears, limits, symmetries and balances."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from changed_flanks import with_flanks
from whole_contact import ste_of_whole_gears

from fegear.contact.solve import solve_cycle
from fegear.gearset import FlankProfile, Relief, make_gear_set
from fegear.statics.settings import RESOLUTIONS, Resolution, StaticsSettings
from fegear.statics.solving import solve_mesh
from meshes import MeshSize

TORQUE = 60.0
PLANET = {"name": "planet", "teeth": 20, "hub_radius_mm": 11.0}
RING = {"name": "ring", "teeth": 48, "internal": True, "rim_radius_mm": 58.0}
RATIO = 48 / 20
POSITIONS = np.arange(32) / 32
SMALL = MeshSize(fillet_edges=8)


def gear_set(*gears, distance=28.0, driver=0, torque=TORQUE, **keys):
    names = [gear["name"] for gear in gears]
    mesh = {"driver": names[driver], "driven": names[1 - driver]}
    return make_gear_set(
        {
            "name": "planet-ring",
            "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
            "gear": list(gears),
            "mesh": [mesh | {"center_distance_mm": distance} | keys],
            "load": {"gear": names[driver], "torques_Nm": [torque]},
        }
    )


@lru_cache(maxsize=8)
def solved(driver=0, resolution="default", friction=0.0, plane="stress"):
    torque = TORQUE * (RATIO if driver else 1.0)
    settings = StaticsSettings(
        resolution=resolution, estimate_error=False, friction=friction, plane=plane
    )
    gears = gear_set(PLANET, RING, driver=driver, torque=torque)
    return solve_mesh(gears, 1, [torque], settings)


@pytest.mark.slow
@pytest.mark.parametrize("position", [0.1, 0.5])
def test_deflection_is_that_of_whole_gears(position):
    """With two pairs, and with three at a tip corner's contact."""
    ste, direct, pairs = ste_of_whole_gears(solved().problem, TORQUE, position, SMALL)
    assert pairs >= 2
    assert ste == pytest.approx(direct, rel=2e-3)


@pytest.mark.parametrize("driver", [0, 1])
def test_torques_are_in_the_ratio_of_teeth_on_the_path(driver):
    problem = replace(solved(driver).problem, corner_contact=False)
    torque = TORQUE * (RATIO if driver else 1.0)
    cycle = solve_cycle(problem, [torque], POSITIONS)
    expected = torque * (1.0 / RATIO if driver else RATIO)
    np.testing.assert_allclose(cycle.driven_torque, expected, rtol=1e-9)
    assert (cycle.ste > 0.0).all()
    assert cycle.residual.max() < 1e-10


def test_driver_and_driven_gear_can_change_roles():
    one, two = (solved(driver).table["ste_m"][0] for driver in (0, 1))
    mirrored = np.roll(two[::-1], 1)  # position p is -p
    # at tip corners, approach and recess differ
    assert np.median(np.abs(mirrored / one - 1.0)) < 1e-6
    np.testing.assert_allclose(mirrored, one, rtol=1e-2)


def test_back_flanks_touch_as_the_drive_flanks_do():
    """Without backlash; teeth of half a pitch carry over at position 1/2 - p."""
    problem = solved().problem
    drive = solve_cycle(problem, [TORQUE], POSITIONS).ste[0]
    back = solve_cycle(problem, [-TORQUE], POSITIONS).ste[0]
    np.testing.assert_allclose(-np.roll(back[::-1], 17), drive, rtol=1e-6)


def test_balances_of_the_evidence_line():
    result = solved()
    assert np.abs(result.work_balance).max() < 1e-5
    assert np.abs(result.virtual_work).max() < 1e-5
    assert result.reciprocity_error < 1e-3


def test_stiffness_is_the_slope_of_the_load():
    problem, step = solved().problem, 1e-3
    torques = TORQUE * np.array([1.0 - step, 1.0, 1.0 + step])
    cycle = solve_cycle(problem, torques, POSITIONS)
    slope = np.diff(cycle.ste[[0, 2]], axis=0)[0]
    force = 2.0 * step * TORQUE / problem.pair.driver_arm
    # nodes of the contact grid come into contact one by one
    np.testing.assert_allclose(force / slope, cycle.local_stiffness[1], rtol=1e-2)
    mean = (force / slope).mean() / cycle.local_stiffness[1].mean()
    assert mean == pytest.approx(1.0, abs=1e-3)


def test_friction_loses_what_the_loss_factor_says():
    """Mean over a cycle; flanks of a planet and a ring slide little."""
    coefficient = 0.05
    result = solved(friction=coefficient)
    lost = 1.0 - result.cycle.driven_torque.mean() / (TORQUE * RATIO)
    assert lost == pytest.approx(coefficient * result.loss_factors[0], rel=0.02)
    other = solved(1, friction=coefficient)
    lost = 1.0 - other.cycle.driven_torque.mean() / TORQUE
    assert lost == pytest.approx(coefficient * other.loss_factors[0], rel=0.02)
    assert 0.0 < result.loss_factors[0] < 0.1


def test_plane_strain_is_stiffer():
    stress, strain = (
        solved(plane=plane).table["stiffness_N_per_m"].mean()
        for plane in ("stress", "strain")
    )
    assert 1.02 < strain / stress < 1.12


@pytest.mark.parametrize("role", ["driver", "driven"])
def test_a_tip_relief_is_a_measured_profile_that_equals_it(role):
    problem = solved().problem
    gear = getattr(problem.pair, role)
    tip, start = gear.tip_roll_length, gear.tip_roll_length - 1.2e-3
    relief = Relief(magnitude=8e-6, start_roll_length=start)
    profile = FlankProfile(
        roll_lengths=(start, tip), deviations=(0.0, -8e-6), interpolation="linear"
    )
    changes = {f"{role}_tip_relief": relief}, {f"{role}_profile": profile}
    one, two = (
        solve_cycle(with_flanks(problem, **change), [TORQUE], POSITIONS)
        for change in changes
    )
    # the slope of a profile ends at the tip, that of a relief does not
    np.testing.assert_allclose(two.ste, one.ste, rtol=5e-4)
    assert np.median(np.abs(two.ste / one.ste - 1.0)) < 1e-5
    plain = solve_cycle(problem, [TORQUE], POSITIONS)
    assert np.abs(one.ste - plain.ste).max() > 1e-7


def test_keys_of_a_ring_s_relief_and_profile():
    """A diameter grows from tip to root of a ring; depth is that of the relief."""
    relief = {"magnitude_um": 8.0, "length_pitches": 0.3}
    one = gear_set(PLANET, RING, driven_tip_relief=relief).meshes[0]
    gear, start = one.pair.driven, one.driven_flank.tip_relief.start_roll_length
    assert start == pytest.approx(gear.tip_roll_length - 0.3 * one.pair.base_pitch)
    radii = np.hypot(gear.base_radius, [gear.tip_roll_length, start])
    profile = {
        "diameter_mm": (2e3 * radii).tolist(),
        "deviation_um": [-8.0, 0.0],
        "interpolation": "linear",
    }
    two = gear_set(PLANET, RING, driven_profile=profile).meshes[0]
    np.testing.assert_allclose(
        two.driven_flank.profile.roll_lengths, [start, gear.tip_roll_length], rtol=1e-9
    )
    assert two.driven_flank.profile.deviations == pytest.approx((0.0, -8e-6))


def test_pitch_errors_of_the_ring():
    """All teeth set back: as much transmission error. One: as that of its mate."""
    thinned = PLANET | {"tooth_thinning_um": 100.0}
    settings = StaticsSettings(resolution="coarse", estimate_error=False, positions=8)

    def ste(planet_errors=None, ring_errors=None):
        planet, ring = dict(thinned), dict(RING)
        if planet_errors is not None:
            planet["pitch_errors_um"] = planet_errors
        if ring_errors is not None:
            ring["pitch_errors_um"] = ring_errors
        gears = gear_set(planet, ring)
        return solve_mesh(gears, 1, [TORQUE], settings).table["ste_m"][0]

    plain = ste()
    back = ste(ring_errors=[5.0] * 48)
    # but for the lever of a tip corner, which moves with the rotation
    np.testing.assert_allclose(back[: plain.size] - plain, 5e-6, rtol=5e-3)
    one = np.zeros(48)
    one[3] = 6.0
    mate = np.zeros(20)
    mate[3] = 6.0
    of_ring, of_planet = ste(ring_errors=one.tolist()), ste(mate.tolist())
    # until a tooth comes into contact anew, both make the same gap of a pair
    cycles = slice(8, 8 * 8)
    np.testing.assert_allclose(of_ring[cycles], of_planet[cycles], rtol=1e-9)
    assert np.ptp(of_ring[cycles]) > 1.2 * np.ptp(plain)


def stiffness(gears, size="default"):
    settings = StaticsSettings(estimate_error=False, resolution=size)
    return solve_mesh(gears, 1, [TORQUE], settings).table["stiffness_N_per_m"][0]


@pytest.mark.slow
def test_mesh_stiffness_converges(monkeypatch):
    """At second order or better on the path."""

    def means(factor):
        finer = Resolution(MeshSize().refined(factor), 1 + 2 * round(12 * factor))
        monkeypatch.setitem(RESOLUTIONS, "default", finer)
        problem = solved.__wrapped__().problem
        on_path = replace(problem, corner_contact=False)
        return solve_cycle(on_path, [TORQUE], POSITIONS).ste.mean()

    best = means(1.7)
    errors = [abs(means(factor) / best - 1.0) for factor in (0.35, 1.0)]
    assert errors[1] < 3e-4
    assert np.log(errors[0] / errors[1]) / np.log(1.0 / 0.35) > 1.8


@pytest.mark.slow
def test_root_stress_of_the_ring_is_that_of_a_finer_mesh(monkeypatch):
    def root_stress(factor):
        finer = Resolution(MeshSize().refined(factor), 1 + 2 * round(12 * factor))
        monkeypatch.setitem(RESOLUTIONS, "default", finer)
        table = solved.__wrapped__().table
        return [table[f"{role}_root_stress_Pa"].max() for role in ("driver", "driven")]

    np.testing.assert_allclose(root_stress(1.0), root_stress(2.0), rtol=0.02)


@pytest.mark.slow
def test_many_teeth_tend_to_the_rack_from_both_sides():
    """Mesh stiffness with a ring and with an external gear of ever more teeth."""
    differences = []
    for teeth in (400, 1600):
        outside = {"name": "wheel", "teeth": teeth, "hub_radius_mm": teeth - 9.0}
        inside = {
            "name": "ring",
            "teeth": teeth,
            "internal": True,
            "rim_radius_mm": teeth + 9.0,
            "addendum_mm": 2.0,
            "cutter_teeth": 100,
            "rack_tip_radius_mm": 0.6,
        }
        planet = PLANET | {"addendum_mm": 1.6}
        one = stiffness(gear_set(planet, outside, distance=teeth + 20.0))
        two = stiffness(gear_set(planet, inside, distance=teeth - 20.0))
        differences.append(two.mean() / one.mean() - 1.0)
    assert differences[0] > differences[1] > 0.0
    assert differences[1] < 0.01
    assert differences[0] / differences[1] == pytest.approx(4.0, rel=0.3)
