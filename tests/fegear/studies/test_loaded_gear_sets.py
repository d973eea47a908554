"""A gear set that was loaded in Python is that of its name and edits."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import fegear
from fegear.files.errors import InputError

EDITS = {
    "mesh.1.tip_relief.magnitude_um": 10,
    "gear.idler.profile_shift": 0.05,
    "mesh.1.driver_lead": {"crowning_um": 3.5},
}
COARSE = fegear.StaticsSettings(positions=4, resolution="coarse")
WAVES = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)


def test_what_was_changed_is_in_the_command_and_read_back():
    gears = fegear.load_gear_set("liu-pair", EDITS)
    study = fegear.MeshStiffness(gears, elements=COARSE)
    argv = study.argv
    assert [argv[i + 1] for i, word in enumerate(argv) if word == "--set"] == [
        "mesh.1.tip_relief.magnitude_um=10",
        "gear.idler.profile_shift=0.05",
        "mesh.1.driver_lead={ crowning_um = 3.5 }",
    ]
    assert study.gear_set.loaded == gears


def test_what_was_changed_is_in_files():
    gears = fegear.load_gear_set("liu-pair", {"mesh.1.tip_relief.magnitude_um": 10})
    study = fegear.MeshStiffness(gears, torque=100.0, elements=COARSE)
    header = fegear.run(study).table.header
    assert header["set mesh.1.tip_relief.magnitude_um"] == "10"


def test_keys_of_a_loaded_set_are_varied():
    over = "mesh.2.phase=0,0.5"
    loaded = fegear.load_gear_set("liu-idler")
    one, other = (
        fegear.run(fegear.Map(gears, over=over, at=1600.0, torque=100.0, model=WAVES))
        for gears in (loaded, "liu-idler")
    )
    rows = [result.table["dte_rms_m"].tolist() for result in (one, other)]
    assert rows[0] == rows[1]
    assert len(set(rows[0])) > 1


@pytest.mark.parametrize("changed", [True, False])
def test_one_that_was_changed_since_is_itself(changed, tmp_path):
    path = tmp_path / "set.toml"
    path.write_text(PAIR.format(20), "utf-8")
    gears = fegear.load_gear_set(path)
    if changed:
        gears = replace(gears, damping_ratio=0.07)
    else:
        path.write_text(PAIR.format(21), "utf-8")
    study = fegear.MeshStiffness(gears, elements=COARSE)
    assert study.gear_set.preloaded is gears
    over = "gear.1.profile_shift=0,0.1"
    with pytest.raises(InputError, match="this one was made in Python"):
        fegear.run(fegear.Map(gears, over=over, at=1600.0, torque=1.0, model=WAVES))


def test_results_of_statics_are_copied_and_pickled():
    gears = fegear.load_gear_set("liu-pair")
    solved = fegear.solve_mesh(gears, torques_on_driver=np.int64(100), settings=COARSE)
    for twin in (copy.deepcopy(solved), pickle.loads(pickle.dumps(solved))):
        assert twin.table == solved.table
        assert twin.key_figures == solved.key_figures


def test_a_table_has_its_columns_by_all_their_names():
    gears = fegear.load_gear_set("liu-pair")
    table = fegear.solve_mesh(gears, torques_on_driver=100.0, settings=COARSE).table
    assert list(table) == list(table.flat)
    assert "ste_m" in table
    assert "ste_mm" not in table
    assert table["position"] is table.position
    with pytest.raises(ValueError, match="no column ste_mm; it has torque_Nm"):
        table["ste_mm"]


def test_wrong_arguments_are_told_with_the_right_ones():
    gears = fegear.load_gear_set("liu-pair")
    with pytest.raises(TypeError, match=r"^solve_mesh: .* 'torque'; .* torques_on_"):
        fegear.solve_mesh(gears, torque=100.0)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="positions = '32'; must be a whole number"):
        fegear.StaticsSettings(positions="32")  # type: ignore[arg-type]
    parts: list[str] = ["body"]
    coupled = fegear.LumpedModel(number="coupled", without=parts)  # type: ignore[arg-type]
    assert coupled.without == ("body",)


def test_speeds_in_any_order_are_those_of_the_table():
    study = fegear.Sweep(
        "liu-pair", torque=100.0, speeds=[1000, 3000, 2000, 1000], model=WAVES
    )
    assert study.speeds == (1000.0, 2000.0, 3000.0)


PAIR = """\
name = "pair"
[defaults]
module_mm = 2.0
face_width_mm = 12.0
hub_radius_mm = 8.0
[[gear]]
name = "driver"
teeth = {}
[[gear]]
name = "wheel"
teeth = 31
[[mesh]]
driver = "driver"
driven = "wheel"
"""
