"""Missing and broken teeth at any contact ratio, beside geometry of rigid gears."""

from __future__ import annotations

import numpy as np
import pytest
from fallen_back import RigidPair, random_pair
from slow_tests import first_are_quick

import fegear
from fegear.contact.problem import OpenContact
from fegear.gearset import make_gear_set

SETTINGS = fegear.StaticsSettings(
    resolution="coarse", positions=16, estimate_error=False, root_stress=False
)


def rigid(gear_set):
    pair = gear_set.meshes[0].pair
    gears = pair.driver, pair.driven
    return RigidPair(
        [g.base_radius for g in gears],
        [g.tip_radius for g in gears],
        pair.center_distance,
    )


def unloaded(gear_set):
    """Positions, transmission errors under 1 N m and without load, the solution."""
    result = fegear.run(
        fegear.MeshStiffness(gear_set=gear_set, torque=(1.0,), elements=SETTINGS)
    )
    table = result.solved.table
    return table.position, table["ste_m"][0], table["nlte_m"][0], result


@pytest.mark.parametrize("seed", first_are_quick(range(7400, 7420), 10))
def test_gears_fall_back_as_far_as_rigid_ones_do(seed):
    gear_set = random_pair(seed)
    pair = gear_set.meshes[0].pair
    assert 1.0 < pair.contact_ratio < 2.0
    position, error, fallen, result = unloaded(gear_set)
    # the pair that passes the pitch point at the nearest whole position is missing
    middle = round(float(position[fallen.argmax()]))
    near = np.abs(position - middle) <= 0.5
    model, pitch = rigid(gear_set), 2.0 * np.pi / pair.driver.teeth
    # positions count the driven gear: its driver is ahead by the error
    ahead = fallen[near] / pair.driver.base_radius
    thetas = (position[near] - middle) * pitch + ahead
    expected = np.array([model.fallen_back(one, pitch, {0}) for one in thetas])
    assert fallen.max() > 1e-5
    assert fallen[near] == pytest.approx(expected, abs=1e-3 * fallen.max())
    assert fallen[near] == pytest.approx(expected, abs=5e-8)
    assert (error[near] >= fallen[near]).all()
    assert any("tip corners carry past the path" in str(line) for line in result.page())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7441])
def test_helical_gears_fall_back_as_far_as_their_sections(seed):
    """Rigid sections over the width, of which the one that is nearest carries."""
    gear_set = random_pair(seed, helical=True)
    pair, overlap = gear_set.meshes[0].pair, gear_set.overlap_ratio(0)
    position, _, fallen, result = unloaded(gear_set)
    middle = round(float(position[fallen.argmax()]))
    near = np.abs(position - middle) <= 0.5
    model, pitch = rigid(gear_set), 2.0 * np.pi / pair.driver.teeth
    place = result.solved.cycle.face.place / result.solved.problem.face_width
    turns = np.concatenate([place, -place]) * overlap * pitch
    ahead = fallen[near] / pair.driver.base_radius
    thetas = (position[near] - middle) * pitch + ahead
    expected = [
        min(model.fallen_back(one + turn, pitch, {0}) for turn in turns)
        for one in thetas
    ]
    assert fallen[near] == pytest.approx(expected, abs=2e-8)


@pytest.mark.parametrize("gear", [0, 1])
@pytest.mark.parametrize("height", [1.0, 3.0, 3.6])
def test_a_broken_tip_touches_by_its_new_corner(gear, height):
    """Even where it ends below the pitch point."""
    tables = [
        {"name": name, "teeth": z, "module_mm": 3.0, "face_width_mm": 20.0}
        for name, z in (("a", 25), ("b", 44))
    ]
    tables[gear]["broken_tips"] = [{"tooth": 7, "height_mm": height}]
    mesh = {"driver": "a", "driven": "b", "backlash_um": 100.0}
    defaults = {"hub_radius_mm": 15.0}
    gear_set = make_gear_set(
        {"name": "tip", "gear": [defaults | t for t in tables], "mesh": [mesh]}
    )
    position, _, fallen, _ = unloaded(gear_set)
    pair, whole = gear_set.meshes[0].pair, rigid(gear_set)
    pitch, tips = 2.0 * np.pi / pair.driver.teeth, list(whole.ra)
    tips[gear] -= 1e-3 * height
    broken = RigidPair(whole.rb, tips, whole.a)
    thetas = position * pitch + fallen / pair.driver.base_radius
    expected = [
        min(
            (broken if number == 6 else whole).lag(theta - number * pitch)
            for number in range(round(x) - 2, round(x) + 3)
        )
        for x, theta in zip(position, thetas, strict=True)
    ]
    assert fallen == pytest.approx(expected, abs=2e-8)
    if height > 2.0:
        assert fallen.max() > 1e-6


@pytest.mark.parametrize(
    ("teeth", "shifts", "addendum", "missing"),
    [
        ((19, 31), (0.3, 0.0), 1.0, {3, 4}),
        ((97, 17), (-0.3, 0.5), 1.0, {1, 2}),
        ((60, 80), (0.0, 0.0), 1.15, {4, 5, 6, 7}),
    ],
)
@pytest.mark.parametrize("relief", [0.0, 0.01])
def test_teeth_beside_several_missing_ones_reach_far(
    teeth, shifts, addendum, missing, relief
):
    """Falls of several millimetres; with a relief of next to nothing, too."""
    tables = [
        {
            "name": name,
            "teeth": z,
            "module_mm": 3.0,
            "face_width_mm": 15.0,
            "profile_shift": shift,
            "addendum_mm": 3.0 * (addendum + shift),
            "hub_radius_mm": 0.75 * z,
        }
        for name, z, shift in zip("ab", teeth, shifts, strict=True)
    ]
    tables[0]["missing_teeth"] = sorted(number + 1 for number in missing)
    mesh = {"driver": "a", "driven": "b", "backlash_um": 80.0}
    if relief:
        mesh["tip_relief"] = {"magnitude_um": relief, "length_pitches": 0.3}
    gear_set = make_gear_set({"name": "run", "gear": tables, "mesh": [mesh]})
    position, _, fallen, _ = unloaded(gear_set)
    pair, model = gear_set.meshes[0].pair, rigid(gear_set)
    near = (position > min(missing) - 1.0) & (position < max(missing) + 1.0)
    pitch = 2.0 * np.pi / pair.driver.teeth
    thetas = position * pitch + fallen / pair.driver.base_radius
    expected = [
        min(
            model.lag(theta - number * pitch)
            for number in range(round(x) - 4, round(x) + 5)
            if number not in missing
        )
        for x, theta in zip(position[near], thetas[near], strict=True)
    ]
    assert fallen.max() > 1e-3
    assert fallen[near] == pytest.approx(expected, abs=1e-6 * 2.0 * relief + 2e-8)


def test_the_angle_is_named_at_which_gears_are_apart():
    gear_set = fegear.load_gear_set("liu-pair", {"gear.1.missing_teeth": [5, 6, 7]})
    with pytest.raises(OpenContact, match=r"position \d.*base pitches, \d.* deg of"):
        unloaded(gear_set)
