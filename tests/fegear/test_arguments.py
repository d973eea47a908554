"""Arguments from Python: other types than are asked for, and numbers of NumPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fegear

WRONG = [None, 5, 0.5, True, b"liu-pair", 1 + 2j, (1,), np.array(5.0), object()]
TABLES = {
    "name": "own",
    "defaults": {"module_mm": 2.0, "face_width_mm": 20.0, "hub_radius_mm": 8.0},
    "gear": [{"name": "pinion", "teeth": 30}, {"name": "wheel", "teeth": 40}],
    "mesh": [
        {"driver": "pinion", "driven": "wheel", "operating_pressure_angle_deg": 20.5}
    ],
}


@pytest.mark.parametrize("value", WRONG, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize(
    ("function", "name"),
    [
        (fegear.load_gear_set, "name_or_path"),
        (fegear.read_gear_set, "text"),
        (fegear.make_gear_set, "tables"),
        (lambda value: fegear.load_gear_set("liu-pair", value or 0), "edits"),
    ],
)
def test_other_types_are_refused_by_name(function, name, value):
    with pytest.raises(ValueError, match=f"^{name} must be ") as caught:
        function(value)
    assert "\n" not in str(caught.value)


def test_arrays_without_a_length_are_no_lists():
    gears = fegear.load_gear_set("liu-pair")
    for study in (fegear.Sweep, fegear.Dynamics):
        with pytest.raises(ValueError, match="torque must be a tuple"):
            study(gear_set=gears, torque=np.array(100.0), speeds=[2000.0])
    with pytest.raises(ValueError, match="torques must be a list"):
        fegear.solve_mesh(gears, torques=np.array(100.0))


def test_numbers_of_numpy_are_numbers():
    plain = fegear.make_gear_set(TABLES)
    gears = [{"name": "pinion", "teeth": np.int64(30)}, TABLES["gear"][1]]
    defaults = {key: np.float64(value) for key, value in TABLES["defaults"].items()}
    given = TABLES | {"gear": gears, "defaults": defaults}
    assert repr(fegear.make_gear_set(given)) == repr(plain)
    edits = {"gear.2.teeth": np.int32(40), "gear.1.profile_shift": np.float64(0.0)}
    assert repr(fegear.make_gear_set(TABLES, edits)) == repr(plain)
    assert fegear.LumpedModel(number=np.int64(2)).number == 2


def test_paths_are_names(tmp_path):
    source = Path(fegear.__file__).parent / "gearset" / "sets" / "liu-pair.toml"
    assert fegear.load_gear_set(source).name == "liu-pair"
