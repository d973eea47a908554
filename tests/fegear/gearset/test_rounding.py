"""Teeth that just fit, typed in with the digits of a drawing, run without backlash."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.plausibility import gear_set_warnings

MODULES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 14.0)
ANGLE = math.radians(20.0)


def inv(angle: float) -> float:
    return math.tan(angle) - angle


def tight_distance(z: float, shifts: float, module: float, helix: float) -> float:
    """DIN 3960: centre distance [mm] of teeth z1 + z2, of an internal pair z2 - z1."""
    across = math.atan(math.tan(ANGLE) / math.cos(helix))
    value = inv(across) + 2.0 * shifts * math.tan(ANGLE) / z
    angle = math.radians(30.0)
    for _ in range(50):
        angle -= (inv(angle) - value) / math.tan(angle) ** 2
    return 0.5 * z * module / math.cos(helix) * math.cos(across) / math.cos(angle)


def base_tangent(z: int, x: float, module: float, helix: float, count: int) -> float:
    across = math.atan(math.tan(ANGLE) / math.cos(helix))
    teeth = math.pi * (count - 0.5) + z * inv(across)
    return module * (math.cos(ANGLE) * teeth + 2.0 * x * math.sin(ANGLE))


def printed_set(kind: str, rng: np.random.Generator) -> dict:
    """Values of a pair, or of a planetary set, as a drawing prints them."""
    module = float(rng.choice(MODULES))
    helix_deg = round(float(rng.uniform(8.0, 30.0)), 4) if kind == "helical" else 0.0
    helix = math.radians(helix_deg)
    x1, x2 = (round(float(rng.uniform(0.0, 0.5)), 4) for _ in range(2))
    z1, z2 = int(rng.integers(20, 40)), int(rng.integers(30, 90))
    defaults = {"module_mm": module, "face_width_mm": 8.0 * module}
    if helix_deg:
        defaults["helix_angle_deg"] = helix_deg
    bore = {"hub_radius_mm": 0.25 * module * z1}
    one = {"name": "one", "teeth": z1, "profile_shift": x1, **bore}
    two = {"name": "two", "teeth": z2, "profile_shift": x2, **bore}
    two["hub_radius_mm"] = 0.3 * module * z2
    mesh: dict = {"driver": "one", "driven": "two"}
    if kind in ("spur", "helical"):
        distance = tight_distance(z1 + z2, x1 + x2, module, helix)
        if rng.random() < 0.4:  # thickness by a measure instead of the shift
            count = max(2, round(z1 / math.cos(helix) ** 3 * 0.12) + 1)
            span = base_tangent(z1, x1, module, helix, count)
            one |= {"span_mm": round(span, 3), "span_teeth": count}
    else:
        z2 = z1 + 2 * int(rng.integers(20, 30))
        x2 = round(float(rng.uniform(-0.1, 0.1)) - x1, 4)
        two = {
            "name": "two",
            "teeth": z2,
            "internal": True,
            "cutter_teeth": z1 + 3,
            "profile_shift": x2,
            "rim_radius_mm": module * (0.5 * z2 + 6.0),
            "addendum_mm": module * 0.25,
        }
        distance = tight_distance(z2 - z1, -x1 - x2, module, helix)
    shown = round(distance, 3)
    if rng.random() < 0.3 and kind != "internal":  # thinner teeth, by whole micrometres
        more = 0.05 * module
        across = math.atan(math.tan(ANGLE) / math.cos(helix))
        bases = 0.5 * (z1 + z2) * module / math.cos(helix) * math.cos(across)
        closer = round(distance - more, 3)
        lacking = inv(math.acos(bases / distance)) - inv(math.acos(bases / closer))
        thinning_um = 2e3 * bases * lacking / math.cos(across)
        two["tooth_thinning_um"] = float(round(thinning_um))
        shown = closer
    if "span_mm" in one:
        del one["profile_shift"]
    mesh["center_distance_mm"] = shown
    return {"name": kind, "defaults": defaults, "gear": [one, two], "mesh": [mesh]}


def printed_planets(rng: np.random.Generator) -> dict:
    """Sun, planets and ring at one distance, each mesh without backlash."""
    module = float(rng.choice(MODULES))
    sun, planet = 2 * int(rng.integers(12, 20)), 2 * int(rng.integers(12, 20))
    x_sun, x_planet = (round(float(rng.uniform(0.05, 0.3)), 4) for _ in range(2))
    distance = tight_distance(sun + planet, x_sun + x_planet, module, 0.0)
    ring = sun + 2 * planet
    bases = 0.5 * (ring - planet) * module * math.cos(ANGLE)
    operating = math.acos(bases / distance)
    shifts = (inv(operating) - inv(ANGLE)) * (ring - planet) / 2.0 / math.tan(ANGLE)
    planets = 3 if (sun + ring) % 3 == 0 else 2
    return {
        "name": "planetary",
        "defaults": {"module_mm": module, "face_width_mm": 8.0 * module},
        "gear": [
            {
                "name": "s",
                "teeth": sun,
                "profile_shift": x_sun,
                "hub_radius_mm": 0.2 * module * sun,
            },
            {
                "name": "p",
                "teeth": planet,
                "profile_shift": x_planet,
                "hub_radius_mm": 0.2 * module * planet,
            },
            {
                "name": "r",
                "teeth": ring,
                "internal": True,
                "cutter_teeth": planet + 3,
                "profile_shift": round(-x_planet - shifts, 4),
                "addendum_mm": 0.1 * module,
                "rim_radius_mm": module * (0.5 * ring + 6.0),
            },
        ],
        "planetary": [
            {
                "sun": "s",
                "planet": "p",
                "ring": "r",
                "planets": planets,
                "center_distance_mm": round(distance, 3),
            }
        ],
        "load": {"gear": "s", "torques_Nm": [10.0]},
    }


def printed_sets(kind: str) -> list[dict]:
    rng = np.random.default_rng([20261128, len(kind)])
    make = printed_planets if kind == "planetary" else lambda r: printed_set(kind, r)
    return [make(rng) for _ in range(75)]


@pytest.mark.parametrize("kind", ["spur", "helical", "internal", "planetary"])
def test_rounding_refuses_no_gears(kind):
    lacking = 0
    for tables in printed_sets(kind):
        gear_set = make_gear_set(tables)
        for mesh in gear_set.meshes:
            assert mesh.pair.backlash >= -1e-9 * mesh.pair.base_pitch
            lacking += mesh.pair.backlash_of_sizes < -1e-9 * mesh.pair.base_pitch
            # what rounding may take away is far below any allowance
            assert mesh.pair.rounding < 5e-6
    assert lacking > 10


def test_a_warning_says_that_rounding_took_the_backlash():
    tables = next(
        tables
        for tables in printed_sets("spur")
        if make_gear_set(tables).meshes[0].pair.backlash_of_sizes < -5e-8
    )
    (line,) = [w for w in gear_set_warnings(make_gear_set(tables)) if "[W55]" in w]
    assert "by the sizes, whose rounding explains up to" in line
    tables["mesh"][0]["backlash_um"] = 40.0
    with_backlash = make_gear_set(tables)
    assert with_backlash.meshes[0].backlash == pytest.approx(40e-6)
    assert not [w for w in gear_set_warnings(with_backlash) if "[W55]" in w]


@pytest.mark.parametrize("step_um", [3.0, 30.0])
def test_teeth_that_are_too_thick_jam(step_um):
    """More than the last digits explain is refused."""
    tables = printed_sets("spur")[0]
    distance = tables["mesh"][0]["center_distance_mm"]
    tables["mesh"][0]["center_distance_mm"] = round(distance - 1e-3 * step_um, 3)
    with pytest.raises(InputError, match="teeth would jam"):
        make_gear_set(tables)
