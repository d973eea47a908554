"""Axial forces of helical gears: size and sense against a flank in space."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from fegear.cli import run
from fegear.files.toml import toml_text
from fegear.gearset import make_gear_set
from fegear.gearset.axial_forces import shaft_axial_force
from fegear.gearset.tooth_forces import axis_forces, tooth_forces

HELIX = 24.0
TORQUES = [40.0, 90.0]


def tables(hand: str = "right", second: str | None = None) -> dict:
    """Two gears; with the hand of a third one a second mesh, driven by its shaft."""
    gear_set = {
        "name": "axial",
        "defaults": {
            "module_mm": 2.0,
            "helix_angle_deg": HELIX,
            "hub_radius_mm": 9.0,
            "face_width_mm": 25.0,
        },
        "gear": [
            {"name": "one", "teeth": 20, "hand": hand},
            {"name": "two", "teeth": 35},
        ],
        "mesh": [{"driver": "one", "driven": "two", "backlash_um": 80.0}],
        "load": {"gear": "one", "torques_Nm": TORQUES},
        "dynamics": {"damping_ratio": 0.05},
    }
    if second:
        gear_set["gear"] += [
            {"name": "three", "teeth": 22, "hand": second},
            {"name": "four", "teeth": 41},
        ]
        gear_set["mesh"].append(
            {"driver": "three", "driven": "four", "backlash_um": 80.0}
        )
        gear_set["shaft"] = [{"gears": ["two", "three"]}]
    return gear_set


def thrust(teeth: int, hand: str, moment: float) -> float:
    """Force toward the far end on a gear on which its mate exerts a moment [N m].

    x to the right and y up as seen from the near end, z toward its viewer; the moment
    is counter-clockwise. The force is normal to a flank, which is drawn in space.
    """
    radius = 0.5 * 2e-3 * teeth / math.cos(math.radians(HELIX))
    lead = 2.0 * math.pi * radius / math.tan(math.radians(HELIX))
    # a right-handed thread turns counter-clockwise as it comes toward the viewer
    turns_per_length = {"right": 1.0, "left": -1.0}[hand] / lead

    def flank(roll: float, z: float) -> np.ndarray:
        angle, base = roll + 2.0 * math.pi * turns_per_length * z, 0.93 * radius
        x = base * (math.cos(angle) + roll * math.sin(angle))
        y = base * (math.sin(angle) - roll * math.cos(angle))
        return np.array([x, y, z])

    step = 1e-6
    along = flank(0.4, step) - flank(0.4, -step)
    across = flank(0.4 + step, 0.0) - flank(0.4 - step, 0.0)
    normal, place = np.cross(across, along), flank(0.4, 0.0)
    moment_of_normal = place[0] * normal[1] - place[1] * normal[0]
    return -float(moment / moment_of_normal * normal[2])


@pytest.mark.parametrize("hand", ["right", "left"])
def test_the_force_is_normal_to_a_flank_in_space(hand):
    driver, driven = tooth_forces(make_gear_set(tables(hand)))
    other = {"right": "left", "left": "right"}[hand]
    for torque, on_driver, on_driven in zip(
        TORQUES, driver.axial, driven.axial, strict=True
    ):
        # the driver turns counter-clockwise, and the driven gear holds it back
        assert on_driver == pytest.approx(thrust(20, hand, -torque), rel=1e-6)
        # which turns clockwise, and is pushed by the driver
        moment = -torque * 35 / 20
        assert on_driven == pytest.approx(thrust(35, other, moment), rel=1e-6)


def test_a_right_handed_driver_is_pushed_toward_the_near_end():
    driver, driven = tooth_forces(make_gear_set(tables("right")))
    # F_t tan(beta), F_t over the reference diameter
    force = TORQUES[0] / (0.5 * 2e-3 * 20) * math.sin(math.radians(HELIX))
    assert driver.axial[0] == pytest.approx(-force, rel=1e-12)
    assert driven.axial[0] == pytest.approx(force, rel=1e-12)


@pytest.mark.parametrize("second", ["right", "left"])
def test_forces_of_two_meshes_add_on_a_shaft(second):
    gear_set = make_gear_set(tables("right", second))
    (row,) = axis_forces(gear_set, tooth_forces(gear_set))
    assert row.gears == (1, 2)
    # the shaft turns clockwise: its first gear is pushed, its second one held back
    torque = TORQUES[1] * 35 / 20
    force = thrust(35, "left", -torque) + thrust(22, second, torque)
    assert row.axial[1] == pytest.approx(force, rel=1e-6)
    assert shaft_axial_force(gear_set, 2, TORQUES[1]) == pytest.approx(force, rel=1e-6)


def test_the_idler_of_helical_gears_has_none():
    idler = tables()
    idler["gear"].append({"name": "three", "teeth": 30})
    idler["mesh"].append({"driver": "two", "driven": "three", "backlash_um": 80.0})
    gear_set = make_gear_set(idler)
    (row,) = axis_forces(gear_set, tooth_forces(gear_set))
    assert row.gears == (1,)
    assert row.axial == pytest.approx([0.0, 0.0], abs=1e-9)


def test_show_says_the_sense_in_words(tmp_path, capsys):
    path = tmp_path / "pair.toml"
    path.write_text(toml_text(tables("right", "left")))
    assert run(["show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    force = TORQUES[0] / (0.5 * 2e-3 * 20) * math.sin(math.radians(HELIX))
    (line,) = [line for line in lines if line.startswith("- one (right-handed)")]
    assert "driver of mesh 1: tangential " in line
    assert f"axial {-force:.5g} N, toward the near end" in line
    assert any(line.startswith("- two, three, sum on their axis: ") for line in lines)
    assert run(["show", str(path), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert [row["mesh"] for row in values["tooth_forces"]] == [1, 1, 2, 2]
    assert values["tooth_forces"][0]["axial_forces_N"][0] == pytest.approx(-force)
    assert [row["gears"] for row in values["axis_forces"]] == [["two", "three"]]
    assert run(["show", "liu-pair"]) == 0
    assert "axial" not in capsys.readouterr().out
