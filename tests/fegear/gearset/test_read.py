"""Gear set files: what is refused, and how the refusal reads."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fegear.files.errors import InputError
from fegear.gearset import (
    Shaft,
    builtin_names,
    load_gear_set,
    read_gear_set,
    read_gear_set_file,
)

BAD_FILES = sorted((Path(__file__).parent / "bad").glob("*.toml"))

PAIR = """\
name = "pair"

[defaults]
module_mm = 2.0
face_width_mm = 20

[[gear]]
name = "one"
teeth = 30
hub_radius_mm = 12

[[gear]]
name = "two"
teeth = 40
hub_radius_mm = 20

[[mesh]]
driver = "one"
driven = "two"
operating_pressure_angle_deg = 20
"""


def expected_message(path: Path) -> str:
    """The first line of a bad file says what is to be said about it."""
    first = path.read_bytes().splitlines()[0].decode("utf-8", "replace")
    assert first.startswith("# expect: ")
    return first.removeprefix("# expect: ")


@pytest.mark.parametrize("path", BAD_FILES, ids=lambda path: path.stem)
def test_bad_file_is_refused_in_one_line(path):
    with pytest.raises(InputError) as caught:
        read_gear_set_file(path)
    assert str(caught.value) == f"{path}: {expected_message(path)}"
    assert "\n" not in str(caught.value)


def test_there_are_many_bad_files():
    assert len(BAD_FILES) >= 20


def test_missing_file(tmp_path):
    path = tmp_path / "none.toml"
    with pytest.raises(InputError, match="cannot be read, no such file"):
        load_gear_set(str(path))


def test_directory_in_place_of_a_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read, is a directory"):
        load_gear_set(str(tmp_path))


@pytest.mark.parametrize("name", ["", "\0", "a\0.toml"])
def test_impossible_file_names(name):
    with pytest.raises(InputError):
        load_gear_set(name)


def test_unknown_name_offers_the_nearest_and_the_list():
    with pytest.raises(InputError) as caught:
        load_gear_set("liu-idlr")
    assert str(caught.value) == (
        "liu-idlr: neither a file nor a built-in gear set, did you mean liu-idler? "
        "(built-in: helical-machine, liu-countershaft, liu-countershaft-2, "
        "liu-friction, liu-idler, liu-idler-small-hubs, liu-pair, planetary-24-36-96, "
        "turbo-pair)"
    )


def test_builtin_and_its_file_are_equal(tmp_path):
    import fegear.gearset

    folder = Path(fegear.gearset.__file__).parent / "sets"
    for name in builtin_names():
        assert load_gear_set(name) == load_gear_set(str(folder / f"{name}.toml"))


def test_defaults_of_the_format():
    gear_set = read_gear_set(PAIR)
    gear, mesh = gear_set.gears[0], gear_set.meshes[0]
    assert gear.geometry.tip_radius == pytest.approx(32e-3)
    assert gear.geometry.dedendum == pytest.approx(2.5e-3)
    assert gear.geometry.rack_tip_radius == pytest.approx(0.6e-3)
    assert (gear.young_modulus, gear.poisson_ratio) == (206e9, 0.3)
    assert gear.pitch_errors == ()
    assert mesh.torques == ()
    assert mesh.phase == 0.0
    assert mesh.pair.center_distance == pytest.approx(70e-3)


def test_own_tip_overrides_the_shared_one():
    text = PAIR.replace("face_width_mm = 20", "face_width_mm = 20\naddendum_mm = 2.1")
    text = text.replace("teeth = 30\n", "teeth = 30\ntip_radius_mm = 31.5\n")
    one, two = (gear.geometry.tip_radius for gear in read_gear_set(text).gears)
    assert one == pytest.approx(31.5e-3)
    assert two == pytest.approx(42.1e-3)


def test_rack_tip_takes_what_fits_a_deep_space():
    text = PAIR.replace("teeth = 30\n", "teeth = 30\ndedendum_mm = 4\n")
    text = text.replace("teeth = 30\n", "teeth = 30\nprofile_shift = 0.3\n", 1)
    text = text.replace("_angle_deg = 20\n", "_angle_deg = 22\n")
    gear = read_gear_set(text).gears[0].geometry
    assert 0.0 < gear.rack_tip_radius < 0.6e-3
    assert gear.rack_tip_center[0] == pytest.approx(0.0, abs=1e-12)


def test_torques_pass_through_meshes_and_shafts():
    torques = [mesh.torques for mesh in load_gear_set("liu-idler").meshes]
    assert torques[0] == (50.0, 100.0, 150.0)
    assert torques[1] == pytest.approx([50 * 55 / 38, 100 * 55 / 38, 150 * 55 / 38])
    stages = load_gear_set("liu-countershaft").meshes
    assert stages[1].torques == pytest.approx([100 * 72 / 51])


def test_meshes_may_stand_in_any_order():
    text = PAIR + (
        '[load]\ngear = "zero"\ntorques_Nm = [10]\n'
        '[[gear]]\nname = "zero"\nteeth = 30\nhub_radius_mm = 12\n'
        '[[mesh]]\ndriver = "zero"\ndriven = "one"\n'
        "operating_pressure_angle_deg = 20\n"
    )
    assert [mesh.torques for mesh in read_gear_set(text).meshes] == [(10.0,), (10.0,)]


def test_closed_train_has_no_input():
    text = PAIR + (
        '[load]\ngear = "one"\ntorques_Nm = [10]\n'
        '[[gear]]\nname = "three"\nteeth = 30\nhub_radius_mm = 12\n'
        '[[mesh]]\ndriver = "two"\ndriven = "three"\n'
        "operating_pressure_angle_deg = 20\n"
        '[[mesh]]\ndriver = "three"\ndriven = "one"\n'
        "operating_pressure_angle_deg = 20\n"
    )
    with pytest.raises(InputError, match="every driver is driven"):
        read_gear_set(text)


def test_pitch_errors_are_metres():
    errors = ", ".join(str(n) for n in range(30))
    text = PAIR.replace("teeth = 30\n", f"teeth = 30\npitch_errors_um = [{errors}]\n")
    with pytest.raises(InputError, match="29 um; backlash 0 um, teeth would jam"):
        read_gear_set(text)
    gear_set = read_gear_set(text + "backlash_um = 50\n")
    assert gear_set.gears[0].pitch_errors[3] == pytest.approx(3e-6)


DYNAMIC = (
    PAIR.replace("[defaults]\n", "[defaults]\ncoupling_stiffness_Nm_per_rad = 100\n")
    .replace(
        "teeth = 30\n",
        "teeth = 30\nbearing_kx_N_per_m = 1e8\nbearing_ky_N_per_m = 2e8\n",
    )
    .replace(
        "_angle_deg = 20\n",
        "_angle_deg = 20\ncenter_line_deg = 90\nbacklash_um = 80\n"
        "mean_stiffness_N_per_m = 3e8\nstiffness_variation = 0.3\nload_share = 0.4\n",
    )
    + '[[gear]]\nname = "three"\nteeth = 30\nhub_radius_mm = 12\n'
    '[[shaft]]\ngears = ["two", "three"]\nstiffness_Nm_per_rad = 5e5\n'
    "[dynamics]\ndamping_ratio = 0.02\n"
)


def test_keys_of_lumped_models():
    gear_set = read_gear_set(DYNAMIC)
    one, two, _ = gear_set.gears
    assert one.bearing_stiffness == (1e8, 2e8)
    assert two.bearing_stiffness is None
    assert (one.coupling_stiffness, two.coupling_stiffness) == (100.0, 100.0)
    mesh = gear_set.meshes[0]
    assert mesh.center_line == pytest.approx(0.5 * math.pi)
    assert mesh.backlash == pytest.approx(80e-6)
    assert (mesh.mean_stiffness, mesh.stiffness_variation) == (3e8, 0.3)
    assert mesh.load_share == 0.4
    assert gear_set.shafts == (Shaft(gears=(1, 2), stiffness=5e5),)
    assert gear_set.damping_ratio == 0.02


def test_defaults_of_lumped_models():
    gear_set = read_gear_set(PAIR.replace("_angle_deg = 20\n", "_angle_deg = 21\n"))
    gear, mesh = gear_set.gears[0], gear_set.meshes[0]
    assert (gear.bearing_stiffness, gear.coupling_stiffness) == (None, 0.0)
    assert mesh.center_line is None
    assert mesh.backlash == mesh.pair.backlash > 0.0
    assert mesh.mean_stiffness is mesh.stiffness_variation is mesh.load_share is None
    assert gear_set.damping_ratio is None


def test_backlash_of_tight_teeth_is_not_negative():
    assert 0.0 <= read_gear_set(PAIR).meshes[0].backlash < 1e-12


RELIEFS = [
    ("tip_relief", "length_pitches = 0.4"),
    ("tip_relief", 'start = "HPSTC"'),
    ("root_relief", "length_pitches = 0.4"),
    ("root_relief", 'start = "LPSTC"'),
]


@pytest.mark.parametrize(("key", "start"), RELIEFS)
@pytest.mark.parametrize("role", ["driver", "driven"])
def test_shared_relief_goes_to_both_gears(key, start, role):
    mesh = read_gear_set(f"{PAIR}{key} = {{ magnitude_um = 10, {start} }}\n").meshes[0]
    pair = mesh.pair
    gear, mate = pair.driver, pair.driven
    if role == "driven":
        gear, mate = mate, gear
    relief = getattr(getattr(mesh, f"{role}_flank"), key)
    sap = pair.line_of_action - mate.tip_roll_length
    expected = {
        ("tip_relief", "length_pitches = 0.4"): gear.tip_roll_length
        - 0.4 * pair.base_pitch,
        ("tip_relief", 'start = "HPSTC"'): sap + pair.base_pitch,
        ("root_relief", "length_pitches = 0.4"): sap + 0.4 * pair.base_pitch,
        ("root_relief", 'start = "LPSTC"'): gear.tip_roll_length - pair.base_pitch,
    }
    assert relief.start_roll_length == pytest.approx(expected[key, start])
    assert relief.magnitude == pytest.approx(10e-6)
    assert relief.shape == "linear"


def test_relief_from_hpstc_is_the_contact_ratio_less_one_long():
    one = f'{PAIR}tip_relief = {{ magnitude_um = 10, start = "HPSTC" }}\n'
    ratio = read_gear_set(one).meshes[0].pair.contact_ratio
    length = f"length_pitches = {ratio - 1.0!r}"
    two = f"{PAIR}tip_relief = {{ magnitude_um = 10, {length} }}\n"
    starts = [
        read_gear_set(text).meshes[0].driver_flank.tip_relief.start_roll_length
        for text in (one, two)
    ]
    assert starts[0] == pytest.approx(starts[1], rel=1e-12)


def with_profile(table):
    return f"{PAIR}driver_profile = {table}\n"


POINTS = "diameter_mm;deviation_um\n57,5;1,5\n59;-2\n61,25;0\n"  # of a spreadsheet


def test_a_file_of_a_profile_lies_beside_the_gear_set(tmp_path, monkeypatch):
    (tmp_path / "profile.csv").write_text(POINTS)
    path = tmp_path / "set.toml"
    path.write_text(with_profile('{ file = "profile.csv", slope_um = 3 }'))
    profile = load_gear_set(str(path)).meshes[0].driver_flank.profile
    assert profile.slope == pytest.approx(3e-6)
    np.testing.assert_allclose(profile.deviations, [1.5e-6, -2e-6, 0.0])
    base = 30e-3 * math.cos(math.radians(20.0))
    radii = np.hypot(base, profile.roll_lengths)
    np.testing.assert_allclose(radii, [28.75e-3, 29.5e-3, 30.625e-3])
    monkeypatch.chdir(tmp_path)
    assert read_gear_set(path.read_text()).meshes[0].driver_flank.profile == profile


def test_roll_angles_and_diameters_are_the_same_points():
    base, angles = 60.0 * math.cos(math.radians(20.0)), (15.0, 22.0)
    diameters = [base * math.hypot(1.0, math.radians(angle)) for angle in angles]
    by_angle, by_diameter = (
        read_gear_set(
            with_profile(f"{{ {key} = {list(points)}, deviation_um = [1, 2] }}")
        )
        .meshes[0]
        .driver_flank.profile.roll_lengths
        for key, points in (("roll_angle_deg", angles), ("diameter_mm", diameters))
    )
    np.testing.assert_allclose(by_angle, by_diameter)


def test_a_profile_without_a_role_is_that_of_both_gears():
    mesh = read_gear_set(f"{PAIR}profile = {{ crowning_um = 4 }}\n").meshes[0]
    assert mesh.driver_flank.profile == mesh.driven_flank.profile
    assert mesh.driven_flank.profile.crowning == pytest.approx(4e-6)


def test_a_profile_of_zeros_is_none():
    mesh = read_gear_set(with_profile("{ crowning_um = 0, slope_um = 0 }")).meshes[0]
    assert mesh.driver_flank.profile is None
