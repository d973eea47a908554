"""Keys of double helical gears, what follows from them, and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fegear
from fegear.commands.show.force_values import force_figures
from fegear.contact.width.double import half_faces
from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.inertia import mass_of
from fegear.gearset.tooth_forces import tooth_forces
from fegear.statics.settings import StaticsSettings
from meshes.section import section_area


def tables(gear=(), mesh=(), **both):
    keys = {"hand": "double", "gap_mm": 8.0, "face_width_mm": 50.0} | both
    gears = [{"name": name, "teeth": z} | keys for name, z in (("a", 25), ("b", 40))]
    gears[1] |= dict(gear)
    gears[1] = {key: value for key, value in gears[1].items() if value is not None}
    return {
        "name": "double",
        "defaults": {"module_mm": 3.0, "helix_angle_deg": 20.0, "hub_radius_mm": 15.0},
        "gear": gears,
        "mesh": [{"driver": "a", "driven": "b", "backlash_um": 50.0} | dict(mesh)],
        "load": {"gear": "a", "torques_Nm": [300.0]},
    }


def test_halves_and_their_groove():
    """The wider groove and the narrower gear leave the common width of a half."""
    gear_set = make_gear_set(tables(gear={"gap_mm": 10.0, "face_width_mm": 48.0}))
    assert gear_set.common_groove(0) == pytest.approx(10e-3)
    assert gear_set.common_width(0) == pytest.approx(38e-3)
    assert gear_set.helix_width(0) == pytest.approx(19e-3)
    half = make_gear_set(
        tables(gear={"hand": None, "gap_mm": None}, face_width_mm=19.0)
        | {"gear": [{"name": n, "teeth": z, "face_width_mm": 19.0} for n, z in AB]}
    )
    assert gear_set.overlap_ratio(0) == pytest.approx(half.overlap_ratio(0))
    driver = gear_set.gears[0]
    assert driver.helix_width == pytest.approx(21e-3)
    teeth = driver.geometry
    cylinder = math.pi * (teeth.root_radius**2 - teeth.hub_radius**2)
    volume = 42e-3 * section_area(teeth) + 8e-3 * cylinder
    assert mass_of(driver) == pytest.approx(driver.density * volume)


AB = ("a", 25), ("b", 40)


def test_no_axial_force_of_two_hands():
    gear_set = make_gear_set(tables())
    assert gear_set.gears[0].geometry.twist > 0.0 > gear_set.gears[1].geometry.twist
    for force in tooth_forces(gear_set):
        assert force.axial == (0.0,)
        assert force.tangential[0] > 0.0
    row = force_figures(gear_set)["tooth_forces"][0]
    assert row["hand"] == "double"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"gear": {"hand": "left", "gap_mm": None}},
            'of gear "b" too, its mate is dou',
        ),
        ({"gear": {"gap_mm": None}}, "gap_mm is needed; a double helical gear"),
        ({"gear": {"hand": None}}, 'hand = "double" is needed; a double'),
        ({"gap_mm": 45.0}, "gap_mm = 45; must be at most 40, 0.8 of the face width"),
        ({"gear": {"face_width_mm": 8.4, "gap_mm": 1.0}}, "leaves 0.2 mm of each"),
        ({"mesh": {"offset_mm": 3.0}}, "offset_mm = 3; must be 0 of double helical"),
        (
            {"mesh": {"driver_lead": {"crowning_um": 5.0}}},
            "a lead modification of the driver; must not be given",
        ),
    ],
)
def test_refusals_say_what_is_needed(changes, message):
    with pytest.raises(InputError, match=message):
        make_gear_set(tables(**changes))


@pytest.mark.slow
def test_misaligned_halves_have_equal_loads_and_root_stress_over_both():
    settings = StaticsSettings(resolution="coarse", positions=8)
    gear_set = make_gear_set(tables(mesh={"misalignment_um": 12.0}))
    solved = fegear.solve_mesh(gear_set, settings=settings)
    near, far = (
        half.load.sum(axis=(2, 3)) for half, _ in half_faces(solved.cycle.face)
    )
    assert near == pytest.approx(far, rel=1e-3)  # torques are equal
    (mean,) = solved.cycle.face.per_width.mean(axis=1)
    for part in np.split(mean, 2):  # both halves are misaligned alike
        assert part[:4].sum() > 1.3 * part[-4:].sum()
    (figures,) = solved.key_figures
    # middles of the halves are 29 mm apart, of 50 mm in all
    opened = 12.0 * 29.0 / 50.0
    tangent = math.tan(gear_set.gears[0].geometry.base_helix_angle)
    assert figures["axial_float_um"] == pytest.approx(-0.5 * opened / tangent, rel=0.05)
    for root in solved.roots.over_width:
        assert abs(root.place).min() > 3.9e-3
        assert abs(root.place).max() == pytest.approx(25e-3, rel=1e-9)
        largest = root.over_cycle[0]
        assert largest[: largest.size // 2].max() > 0.0
        assert largest[largest.size // 2 :].max() > 0.0


@pytest.mark.slow
def test_k_fbeta_of_aligned_halves_is_that_of_one():
    """The groove, which has no root, is no part of the mean."""
    settings = StaticsSettings(resolution="coarse", positions=8, estimate_error=False)
    both = fegear.solve_mesh(make_gear_set(tables()), settings=settings)
    gears = [{"name": n, "teeth": z, "face_width_mm": 21.0} for n, z in AB]
    half = tables() | {"gear": gears, "load": {"gear": "a", "torques_Nm": [150.0]}}
    one = fegear.solve_mesh(make_gear_set(half), settings=settings)
    for name in ("driver", "driven"):
        key = f"{name}_root_stress_factor"
        assert both.key_figures[0][key] == pytest.approx(one.key_figures[0][key])
