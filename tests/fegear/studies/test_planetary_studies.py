"""Studies of a planetary set: what is shown, modes, and vibration over speed."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import fegear
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.draw import gear_set_figure
from fegear.gearset.members import MEMBERS
from fegear.gearset.planetary_figures import loss_per_friction
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.solving import StaticsSettings, solve_mesh
from fegear.studies.trains import GearSetRef
from fegear.train.lumped_models import LumpedModel, StiffnessSource

SET = "planetary-24-36-96"
WAVES = tuple(
    f"planetary.1.{side}.{key}={value}"
    for side, mean in (("sun_mesh", 3e8), ("ring_mesh", 4e8))
    for key, value in (("mean_stiffness_N_per_m", mean), ("stiffness_variation", 0.3))
)
FIVE = (  # 36/24/84, in which five planets fit
    *("gear.sun.teeth=36", "gear.planet.teeth=24", "gear.planet.hub_radius_mm=12"),
    *("gear.ring.teeth=84", "gear.ring.rim_radius_mm=100"),
)


def set_of(planets: int, *edits: str) -> GearSetRef:
    """The set with given stiffness and a number of planets."""
    teeth = FIVE if planets > 4 else ()
    count = f"planetary.1.planets={planets}"
    return GearSetRef(name=SET, edits=(*teeth, *WAVES, count, *edits))


def modes(planets: int, *edits: str, translations: bool = True) -> list[dict]:
    study = fegear.NaturalModes(
        gear_set=set_of(planets, *edits), translations=translations
    )
    return fegear.run(study).summary["modes"]


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_modes_have_all_freedoms_but_the_held_and_their_families(planets):
    listed = modes(planets)
    assert len(listed) == 3 * (planets + 3) - 1
    families = [mode["family"] for mode in listed]
    assert families.count("rotational") == 5  # 6, less the ring's rotation
    assert families.count("translational") == 12
    assert families.count("planet") == 3 * (planets - 3)
    for mode in listed:
        if mode["family"] == "translational":
            assert mode["multiplicity"] == 2
        if mode["family"] == "planet":
            assert mode["multiplicity"] == planets - 3


def test_modes_without_translations_are_rotations():
    listed = modes(3, translations=False)
    assert [mode["family"] for mode in listed].count("planet") == 2
    assert len(listed) == 5  # sun, carrier and three planets


def test_modes_of_ordinary_trains_have_no_family():
    study = fegear.NaturalModes(gear_set=GearSetRef(name="liu-idler"))
    result = fegear.run(study)
    assert {mode["family"] for mode in result.summary["modes"]} == {None}
    assert "family" not in result.table.names


def test_one_stiffer_bearing_mixes_the_families():
    listed = modes(3, "gear.planet-2.bearing_kx_N_per_m=9e8")
    assert "mixed" in {mode["family"] for mode in listed}


def sweep(planets: int, *edits: str, **settings):
    model = LumpedModel(
        number=1, translations=True, stiffness=StiffnessSource(kind="rectangular")
    )
    study = fegear.Sweep(
        gear_set=set_of(planets, *edits), model=model, torque=(60.0,), **settings
    )
    return fegear.run(study)


@pytest.mark.parametrize("planets", [3, 4])
def test_planets_in_phase_vibrate_alike_and_lose_contact(planets):
    result = sweep(planets, speeds=tuple(np.arange(4000.0, 9000.0, 500.0)))
    rows = [
        dict(zip(result.table.names, row, strict=True)) for row in result.table.rows()
    ]
    by_speed: dict = {}
    for row in rows:
        key = row["mesh_frequency_Hz"], row["direction"], row["mesh"] % 2
        by_speed.setdefault(key, []).append(row["dte_rms_m"])
    for values in by_speed.values():
        assert len(values) == planets
        assert values == pytest.approx([values[0]] * planets, rel=1e-6)
    assert max(row["contact_loss_fraction"] for row in rows) > 0.1


def test_speed_is_that_of_the_input():
    result = sweep(3, rpm=(6000.0,))
    row = dict(zip(result.table.names, next(iter(result.table.rows())), strict=True))
    assert row["driver_speed_rpm"] == pytest.approx(6000.0)
    assert row["mesh_frequency_Hz"] == pytest.approx(100.0 * 24 * 96 / 120)


def test_harmonics_without_a_sum_leave_the_rotation_alone():
    """With z_s / N not whole the first harmonics drive no rotation of the members."""
    figures = fegear.run(fegear.DerivedGeometry(gear_set=set_of(5))).summary[
        "planetary"
    ]
    drives = [row["drives"] for row in figures["harmonics"]]
    assert drives == ["translation", "planets", "planets", "translation", "rotation"]


def test_show_draws_the_carrier_and_lists_equal_planets_once():
    result = fegear.run(fegear.DerivedGeometry(gear_set=GearSetRef(name=SET)))
    text = "\n".join(map(str, result.page()))
    assert "planet-3 > ring" in text
    assert "Flanks of sun > planet-1" in text
    assert "Flanks of sun > planet-2" not in text
    figure = gear_set_figure(GearSetRef(name=SET).loaded)
    assert "carrier" in figure.axes[0].get_title()


def test_single_planets_that_differ_are_listed():
    edits = ("gear.planet-2.mass_kg=2",)
    result = fegear.run(
        fegear.DerivedGeometry(gear_set=GearSetRef(name=SET, edits=edits))
    )
    assert any(
        "planet-2" in str(part) and "Mass" in str(part) for part in result.page()
    )


TORQUE, FRICTION = 60.0, 0.01


def slow_motion(gears, rpm: float, **model) -> tuple[list[dict], float]:
    """Meshes in a motion without vibration, and the power of the input [W]."""
    lumped = LumpedModel(number=1, friction=FRICTION, **model)
    study = fegear.Motion(gear_set=gears, rpm=rpm, torque=TORQUE, model=lumped)
    return fegear.run(study).summary["meshes"], TORQUE * rpm * math.pi / 30.0


@pytest.mark.parametrize("roles", [*itertools.permutations(MEMBERS)])
def test_power_and_loss_of_slow_motion_are_those_of_the_closed_forms(roles):
    """Pairs of a rectangular wave share the load equally, as rigid teeth do."""
    keys = zip(("input", "output", "held"), roles, strict=True)
    edits = [f"planetary.1.{key}={role}" for key, role in keys]
    gears = set_of(3, *edits, f"load.gear={roles[0]}").loaded
    stiffness = StiffnessSource(kind="rectangular")
    meshes, power = slow_motion(gears, 20.0, bending=0.0, stiffness=stiffness)
    rolling = abs(gears.carrier.members.rolling_power)
    for side in (0, 1):
        passed = sum(mesh["driver_power_mean_W"] for mesh in meshes[side::2])
        assert passed / power == pytest.approx(rolling, rel=3e-3)
    lost = sum(mesh["friction_power_mean_W"] for mesh in meshes)
    expected = FRICTION * loss_per_friction(gears)
    assert lost / power == pytest.approx(expected, rel=3e-3)


@pytest.mark.slow
def test_elastic_teeth_lose_what_their_shares_of_the_load_say():
    """Within 1 % of the closed form, for pairs share the load almost equally."""
    gears = load_gear_set(SET)
    settings = StaticsSettings(resolution="coarse", positions=64)
    source = StiffnessSource(resolution="coarse", positions=64)
    factors = [
        float(solve_mesh(gears, n, [on_driver], settings).loss_factors[0])
        for n, on_driver in enumerate(mesh_torques_at(gears, TORQUE)[:2])
    ]
    meshes, power = slow_motion(gears, 100.0, stiffness=source)
    lost = sum(mesh["friction_power_mean_W"] for mesh in meshes)
    expected = 0.8 * FRICTION * sum(factors)
    assert lost / power == pytest.approx(expected, rel=3e-3)
    closed_form = FRICTION * loss_per_friction(gears)
    assert lost / power == pytest.approx(closed_form, rel=0.012)
    assert expected > closed_form


@pytest.mark.slow
def test_relief_is_that_of_all_planets():
    """Teeth of the sun pass all planets; a mesh of the ring has other flanks."""
    study = fegear.ReliefDesign(
        gear_set=SET,
        mesh=1,
        torque=(30.0,),
        starts=1,
        elements=StaticsSettings(resolution="coarse", positions=16),
    )
    result = fegear.run(study)
    assert result.summary["meshes"] == [1, 3, 5]
    relieved = make_gear_set(result.tables)
    tips = [mesh.driver_tip_relief for mesh in relieved.meshes]
    assert tips[0] == tips[2] == tips[4] != tips[1]
    assert tips[1] == tips[3] == tips[5] is None
    assert "all have the relief" in "\n".join(map(str, result.page()))
