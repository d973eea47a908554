"""Studies of a planetary set: what is shown, modes, and vibration over speed."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from slow_tests import first_are_quick

import fegear
from fegear.commands.show.gear_set_figure import gear_set_figure
from fegear.commands.show.planetary_values import loss_per_friction
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.planetary.members import MEMBERS
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.train.model_settings import LumpedModel

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
        gear_set=set_of(planets, *edits), translations=translations, stiffness="given"
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


@pytest.mark.slow
def test_modes_under_load_have_the_families_of_rigid_bodies_and_what_bodies_add():
    study = fegear.NaturalModes(gear_set=SET, translations=True)
    result = fegear.run(study)
    listed, count = result.summary["modes"], 3 * 6 - 1
    families = [mode["family"] for mode in listed[:count]]
    assert families.count("rotational") == 5
    assert families.count("translational") == 12
    assert all(
        "body" in mode["kind"] or "rot" in mode["kind"] for mode in listed[count:]
    )
    averages = [mode["average_frequency_Hz"] for mode in listed]
    assert None not in averages[:count]
    assert set(averages[count:]) == {None}
    for mode in listed[1:count]:  # relief and averages make model 1 softer
        assert 0.85 < mode["average_frequency_Hz"] / mode["frequency_Hz"] < 1.0
    for mode in listed[1:]:
        parts = [mode[f"{part}_energy"] for part in ("shaft", "bearing", "body")]
        assert sum(parts) + sum(mode["mesh_energy"]) == pytest.approx(1.0)
        assert min(parts) > -1e-6


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
        number=1, translations=True, excitation=ExcitationSettings(kind="rectangular")
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


def at_speed(planets: int, rpm: float | None, *edits: str):
    study = fegear.NaturalModes(
        gear_set=set_of(planets, *edits),
        translations=True,
        rpm=rpm,
        stiffness="given",
    )
    return fegear.run(study)


@pytest.mark.parametrize("planets", [3, 4])
def test_speed_splits_translational_modes_into_both_senses(planets):
    """The carrier turns at a fifth of the sun's speed, 24 / (24 + 96)."""
    result, at_rest = at_speed(planets, 12000.0), modes(planets)
    listed = result.summary["modes"]
    assert result.modes.speed == pytest.approx(12000.0 / 60.0 * 2.0 * np.pi / 5.0)
    names = sorted(mode["family"] for mode in listed)
    assert names == sorted(mode["family"] for mode in at_rest)
    pairs = [mode for mode in listed if mode["family"] == "translational"]
    senses = [mode["whirl"] for mode in pairs]
    assert senses.count("forward") == senses.count("backward") == 6
    both = (pairs[0]["frequency_Hz"], pairs[1]["frequency_Hz"])
    lowest = next(m["frequency_Hz"] for m in at_rest if m["multiplicity"] == 2)
    assert 10.0 < lowest - both[0] < 40.0  # the carrier's 40 Hz at most
    assert 10.0 < both[1] - lowest < 40.0
    assert result.table.names[-1] == "whirl"
    assert "12000 rpm" in "\n".join(map(str, result.page()))


def test_a_result_at_speed_is_saved_and_loaded(tmp_path):
    result = at_speed(3, 12000.0)
    result.save(tmp_path / "modes.nc")
    again = fegear.load(tmp_path / "modes.nc")
    assert (again.modes.shapes == result.modes.shapes).all()
    assert again.summary["modes"] == result.summary["modes"]


@pytest.mark.parametrize(("name", "translations"), [("liu-idler", True), (SET, False)])
def test_speed_is_refused_where_it_changes_nothing(name, translations):
    study = fegear.NaturalModes(gear_set=name, translations=translations, rpm=1000.0)
    with pytest.raises(fegear.InputError, match="rpm = 1000; needs a planetary set"):
        fegear.run(study)


def codes_of(result, code: str = "[W41]") -> list[str]:
    return [line for line in result.summary["warnings"] if line.endswith(code)]


def test_bearings_in_space_that_differ_are_warned_of():
    (line,) = codes_of(at_speed(3, None, "gear.sun.bearing_kx_N_per_m=2e8"))
    assert line.startswith('"sun": bearing_kx_N_per_m = 2e+08')
    assert not codes_of(at_speed(3, None, "gear.planet.bearing_kx_N_per_m=3e8"))
    held = ("planetary.1.held=carrier", "planetary.1.output=ring")
    assert not codes_of(at_speed(3, None, *held, "gear.sun.bearing_kx_N_per_m=2e8"))


def test_a_carrier_above_its_critical_speed_is_warned_of():
    (line,) = codes_of(at_speed(3, 9e5))
    assert "above a critical speed" in line
    assert not codes_of(at_speed(3, 1e5))


def test_springs_leave_the_forces_of_the_carrier_out_and_say_where_it_matters():
    assert not codes_of(sweep(3, speeds=(3000.0,)))
    (line,) = codes_of(sweep(3, speeds=(8000.0,)))
    assert line.startswith("models 1 to 3 leave out gyroscopic")


def share_rows(*edits: str, torque: float = 60.0) -> dict[str, list[dict]]:
    """Planets at rest by model 1, by whether centres are fixed."""
    model = LumpedModel(
        number=1, translations=True, excitation=ExcitationSettings(kind="rectangular")
    )
    study = fegear.PlanetLoadSharing(
        gear_set=set_of(3, *edits), model=model, torque=(torque,)
    )
    result = fegear.run(study)
    assert len(list(result.table.rows())) == 6
    return {case["centers"]: case["planets"] for case in result.summary["cases"]}


OFF = "planetary.1.position_errors_um=[0, 2, 0]"
SOFT_SUN = ("gear.sun.bearing_kx_N_per_m=1e3", "gear.sun.bearing_ky_N_per_m=1e3")


def test_bearings_and_a_floating_sun_even_out_the_shares():
    stiff, soft = share_rows(OFF), share_rows(OFF, *SOFT_SUN)
    shares = {
        name: [planet["load_share"] for planet in cases]
        for name, cases in (stiff | {"floating": soft["on bearings"]}).items()
    }
    assert shares["fixed"][1] < shares["on bearings"][1] < shares["floating"][1]
    assert shares["floating"] == pytest.approx([1.0 / 3.0] * 3, abs=1e-4)
    assert [planet["position_error_um"] for planet in stiff["fixed"]] == [0.0, 2.0, 0.0]


@pytest.mark.parametrize(
    ("members", "sense"),
    [
        (("sun", "carrier", "ring"), -1),
        (("ring", "carrier", "sun"), -1),
        (("sun", "ring", "carrier"), -1),
        (("carrier", "sun", "ring"), 1),
        (("carrier", "ring", "sun"), 1),
    ],
)
def test_a_pin_ahead_carries_more_where_the_carrier_drives(members, sense):
    edits = [
        f"planetary.1.{role}={member}"
        for role, member in zip(("input", "output", "held"), members, strict=True)
    ]
    share = share_rows(OFF, *edits, f"load.gear={members[0]}", torque=300.0)["fixed"]
    assert sense * (share[1]["load_share"] - 1.0 / 3.0) > 0.005


def test_a_planet_without_load_is_warned_of():
    model = LumpedModel(
        number=1, translations=True, excitation=ExcitationSettings(kind="rectangular")
    )
    off = set_of(3, "planetary.1.position_errors_um=[0, 50, 0]")
    study = fegear.PlanetLoadSharing(gear_set=off, model=model, torque=(60.0,))
    result = fegear.run(study)
    (fixed, moving) = codes_of(result, "[W39]")
    assert "60 N m, centres fixed: no load on planet 2" in fixed
    assert "W39" in fixed
    assert "centres on bearings" in moving
    assert result.summary["cases"][0]["mesh_load_factor"] == pytest.approx(1.5)
    assert "largest share 1.5 times" in str(list(result.page()))


def test_load_sharing_needs_planets_and_a_load():
    with pytest.raises(fegear.InputError, match="liu-idler has no"):
        fegear.run(fegear.PlanetLoadSharing(gear_set="liu-idler"))
    study = fegear.PlanetLoadSharing(gear_set=SET, torque=(0.0,))
    with pytest.raises(fegear.InputError, match="torque = 0"):
        fegear.run(study)


@pytest.mark.parametrize(
    ("errors", "reason"),
    [("[0, 1]", "position_errors_um has 2 entries"), ("[0, 2000, 0]", "1000")],
)
def test_position_errors_that_do_not_fit_are_refused(errors, reason):
    with pytest.raises(fegear.InputError, match=reason):
        _ = set_of(3, f"planetary.1.position_errors_um={errors}").loaded


def test_motions_have_shares_at_rest_and_in_motion():
    model = LumpedModel(number=1, excitation=ExcitationSettings(kind="rectangular"))
    study = fegear.Motion(
        gear_set=set_of(3, OFF), model=model, torque=60.0, speed=200.0
    )
    planets = fegear.run(study).summary["planets"]
    for key in ("load_share_at_rest", "load_share"):
        assert sum(planet[key] for planet in planets) == pytest.approx(1.0)
    for planet in planets:  # slow: vibration is small
        rest, moving = planet["load_share_at_rest"], planet["load_share"]
        assert moving == pytest.approx(rest, abs=0.02)
        assert planet["load_share_peak"] > moving


TORQUE, FRICTION = 60.0, 0.01


def slow_motion(gears, rpm: float, **model) -> tuple[list[dict], float]:
    """Meshes in a motion without vibration, and the power of the input [W]."""
    lumped = LumpedModel(number=1, friction=FRICTION, **model)
    study = fegear.Motion(gear_set=gears, rpm=rpm, torque=TORQUE, model=lumped)
    return fegear.run(study).summary["meshes"], TORQUE * rpm * math.pi / 30.0


@pytest.mark.parametrize("roles", first_are_quick(itertools.permutations(MEMBERS)))
def test_power_and_loss_of_slow_motion_are_those_of_the_closed_forms(roles):
    """Pairs of a rectangular wave share the load equally, as rigid teeth do."""
    keys = zip(("input", "output", "held"), roles, strict=True)
    edits = [f"planetary.1.{key}={role}" for key, role in keys]
    gears = set_of(3, *edits, f"load.gear={roles[0]}").loaded
    excitation = ExcitationSettings(kind="rectangular")
    meshes, power = slow_motion(gears, 20.0, bending=0.0, excitation=excitation)
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
    source = ExcitationSettings(resolution="coarse", positions=64)
    factors = [
        float(solve_mesh(gears, n + 1, [on_driver], settings).loss_factors[0])
        for n, on_driver in enumerate(mesh_torques_at(gears, TORQUE)[:2])
    ]
    meshes, power = slow_motion(gears, 100.0, excitation=source)
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
    tips = [mesh.driver_flank.tip_relief for mesh in relieved.meshes]
    assert tips[0] == tips[2] == tips[4] != tips[1]
    assert tips[1] == tips[3] == tips[5] is None
    assert "all have the relief" in "\n".join(map(str, result.page()))
