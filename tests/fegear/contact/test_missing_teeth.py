"""Missing teeth at ordinary contact ratios, beside geometry of rigid gears."""

from __future__ import annotations

import numpy as np
import pytest
from fallen_back import RigidPair

import fegear
from fegear.gearset import make_gear_set

SETTINGS = fegear.StaticsSettings(
    resolution="coarse", positions=16, estimate_error=False, root_stress=False
)


def random_pair(seed):
    """A pair of which a tooth is missing, of the driver or of the driven gear."""
    rng = np.random.default_rng(seed)
    teeth = rng.integers(18, 32), rng.integers(20, 45)
    gears = [
        {
            "name": name,
            "teeth": int(z),
            "module_mm": 3.0,
            "face_width_mm": 20.0,
            "pressure_angle_deg": float(pressure),
            "profile_shift": float(shift),
            "hub_radius_mm": 12.0,
        }
        for name, z, shift, pressure in zip(
            "ab",
            teeth,
            rng.uniform(-0.1, 0.2, 2),
            [rng.uniform(18.0, 24.0)] * 2,
            strict=True,
        )
    ]
    gear = int(rng.integers(0, 2))
    tooth = int(rng.integers(3, 15))
    gears[gear]["missing_teeth"] = [tooth]
    mesh = {"driver": "a", "driven": "b", "backlash_um": 100.0}
    return make_gear_set({"name": "gap", "gear": gears, "mesh": [mesh]}), gear, tooth


def rigid(gear_set):
    pair = gear_set.meshes[0].pair
    gears = pair.driver, pair.driven
    return RigidPair(
        [g.base_radius for g in gears],
        [g.tip_radius for g in gears],
        pair.center_distance,
    )


@pytest.mark.parametrize("seed", range(7400, 7410))
def test_the_driven_gear_falls_back_as_far_as_rigid_gears_do(seed):
    gear_set, gear, tooth = random_pair(seed)
    pair, teeth = gear_set.meshes[0].pair, gear_set.gears[gear].geometry.teeth
    assert 1.2 < pair.contact_ratio < 2.0
    result = fegear.run(
        fegear.MeshStiffness(gear_set=gear_set, torque=(1.0,), elements=SETTINGS)
    )
    rows = list(result.table.rows())
    names = result.table.names
    position, error, unloaded = (
        np.array([row[names.index(name)] for row in rows], float)
        for name in ("position", "ste_m", "nlte_m")
    )
    worst = int(unloaded.argmax())
    assert position[worst] % 1.0 != 0.5
    model, pitch = rigid(gear_set), 2.0 * np.pi / pair.driver.teeth
    # the pair that passes the pitch point at the nearest whole position is missing
    middle = round(float(position[worst]))
    near = np.abs(position - middle) <= 0.5
    # positions count the driven gear: its driver is ahead by the error
    ahead = unloaded[near] / pair.driver.base_radius
    thetas = (position[near] - middle) * pitch + ahead
    expected = np.array([model.fallen_back(one, pitch, {0}) for one in thetas])
    assert unloaded[near] == pytest.approx(expected, abs=2e-8)
    assert unloaded.max() > 1e-5
    assert (error[near] >= unloaded[near]).all()
    assert teeth
    assert tooth
