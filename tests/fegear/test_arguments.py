"""Arguments from Python: other types than are asked for, and numbers of NumPy."""

from __future__ import annotations

import json
import re
from dataclasses import fields, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import fegear
from fegear.files.contents import exact_repr
from fegear.gearset.faults.tooth_faults import Faults

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
    with pytest.raises(ValueError, match=rf"^{name} = .*; must be ") as caught:
        function(value)
    assert "\n" not in str(caught.value)


def test_an_array_without_a_length_is_a_number():
    gears = fegear.load_gear_set("liu-pair")
    for study in (fegear.Sweep, fegear.Dynamics):
        one = study(gear_set=gears, torque=100.0, speeds=np.array(2000.0))
        assert one.speeds == (2000.0,)
    with pytest.raises(ValueError, match=r"torques_on_driver = .* or a list"):
        fegear.solve_mesh(gears, torques_on_driver=np.array(100.0))


def test_one_torque_is_a_list_of_one_and_the_other_way_round():
    gears = fegear.load_gear_set("liu-pair")
    for torque in (240.0, 240, np.array(240.0), [240.0], np.array([240.0])):
        assert fegear.Sweep(gear_set=gears, torque=torque).torque == (240.0,)
        assert fegear.Motion(gear_set=gears, torque=torque, speed=1e3).torque == 240.0
    with pytest.raises(ValueError, match=r"torque = .*; must be"):
        fegear.Motion(gear_set=gears, torque=[240.0, 250.0], speed=1e3)
    with pytest.raises(ValueError, match=r"torque = .*; must be"):
        fegear.Sweep(gear_set=gears, torque=True)


def test_names_of_commands_say_which_study_theirs_is():
    with pytest.raises(AttributeError, match="`fegear modes` is NaturalModes"):
        _ = fegear.Modes
    with pytest.raises(AttributeError, match=r"no attribute 'Nothing'$"):
        _ = fegear.Nothing


def test_numbers_of_numpy_are_numbers():
    plain = fegear.make_gear_set(TABLES)
    gears = [{"name": "pinion", "teeth": np.int64(30)}, TABLES["gear"][1]]
    defaults = {key: np.float64(value) for key, value in TABLES["defaults"].items()}
    tables = TABLES | {"gear": gears, "defaults": defaults}
    assert exact_repr(fegear.make_gear_set(tables)) == exact_repr(plain)
    edits = {"gear.2.teeth": np.int32(40), "gear.1.profile_shift": np.float64(0.0)}
    assert exact_repr(fegear.make_gear_set(TABLES, edits)) == exact_repr(plain)
    assert fegear.LumpedModel(number=np.int64(2)).number == 2


def test_paths_are_names(tmp_path):
    source = Path(fegear.__file__).parent / "gearset" / "sets" / "liu-pair.toml"
    assert fegear.load_gear_set(source).name == "liu-pair"


QUICK = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)
ONE = {"speeds": [1000.0], "torque": [100.0], "model": QUICK}


@pytest.mark.parametrize("value", WRONG, ids=lambda value: type(value).__name__)
def test_what_is_no_gear_set_is_refused_by_studies(value):
    with pytest.raises(fegear.InputError, match=r"^gear_set = .*; must be ") as caught:
        fegear.Sweep(gear_set=value, speeds=[1000.0])
    assert "\n" not in str(caught.value)


WORKERS = "must be a whole number or a Cluster or None"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"study": None}, "study = None; must be a Study"),
        ({"study": fegear.Sweep}, "study = <class"),
        ({"workers": "2"}, f"workers = '2'; {WORKERS}"),
        ({"workers": 2.5}, f"workers = 2.5; {WORKERS}"),
        ({"workers": True}, f"workers = True; {WORKERS}"),
        ({"workers": 0}, "workers = 0; must be 1 to 1000"),
        ({"workers": -1}, "workers = -1; must be 1 to 1000"),
        (
            {"checkpoint_options": "x"},
            "checkpoint_options = 'x'; must be a CheckpointOptions",
        ),
        (
            {"checkpoint_options": None},
            "checkpoint_options = None; must be a CheckpointOptions",
        ),
        ({"progress": None}, "progress = None; must be a Callable"),
    ],
)
def test_run_names_what_it_cannot_use(arguments, message):
    kwargs = {"study": fegear.Sweep(gear_set="liu-pair", **ONE)} | arguments
    with pytest.raises(ValueError, match="^" + re.escape(message)):
        fegear.run(**kwargs)


@pytest.mark.parametrize(
    "changes",
    [
        {"torque": (np.float64(100.0),), "speeds": (np.float32(1000.0), 1100.0)},
        {"torque": [np.int64(100)], "speeds": [np.int64(1000)]},
        {"torque": np.array([100]), "speeds": np.array([1000.0], np.float32)},
        {"model": replace(QUICK, damping_ratio=np.float32(0.04), number=np.int64(1))},
    ],
)
def test_numbers_of_numpy_become_plain_in_summaries(changes):
    """Also in the inputs of a checkpoint, which would be others else."""
    study = fegear.Sweep(gear_set="liu-pair", **ONE | changes)
    assert json.loads(json.dumps(fegear.run(study).summary))["gear_set"] == "liu-pair"
    assert "np." not in repr(study.inputs)
    assert "np." not in " ".join(study.argv)


def test_paths_are_taken_where_texts_are(tmp_path):
    path = tmp_path / "own.toml"
    assert fegear.Sweep(gear_set=path, **ONE) == fegear.Sweep(gear_set=str(path), **ONE)
    assert fegear.RattleNoise(machine=path).machine.name == str(path)
    assert fegear.Clatter(gearbox=path).gearbox == str(path)
    assert fegear.RunDown(file=path).file == str(path)
    for names in ((path,), [path]):
        study = fegear.Sweep(gear_set="liu-pair", speeds=[1000.0], table=names)
        assert study.table == (str(path),)
    assert fegear.Dynamics(gear_set="liu-pair", history=path).history == str(path)
    assert fegear.Validation(cases=[path], directory=path).cases == (str(path),)


def test_files_that_results_cannot_write(tmp_path):
    result = fegear.run(fegear.Sweep(gear_set="liu-pair", **ONE))
    endings = r"a picture's name must end in \.png, \.pdf, \.svg, \.html$"
    for name in ("x.jpg", "x"):
        with pytest.raises(fegear.InputError, match=rf"{name}: {endings}"):
            result.draw(tmp_path / name)
    for write in (result.draw, result.to_csv, result.write):
        with pytest.raises(
            fegear.InputError, match=r"^path = .*; must be text or a path"
        ):
            write(None)
    assert not list(tmp_path.iterdir())


def test_torques_of_a_table_are_given_once():
    gears = fegear.load_gear_set("liu-pair")
    with pytest.raises(
        fegear.InputError, match=r"^torques_on_driver = 5, 5; must differ from"
    ):
        fegear.solve_mesh(gears, torques_on_driver=[5.0, 5.0])


@pytest.mark.parametrize(
    ("part", "changes", "message"),
    [
        ("set", {"damping_ratio": 5.0}, "damping_ratio = 5; must be 0 to below 1"),
        (
            "set",
            {"damping_ratio": np.nan},
            "damping_ratio = nan; must be a finite number or",
        ),
        ("set", {"gears": None}, "gears = None; must be a list, each a Gear"),
        ("set", {"meshes": ()}, "meshes = (); one or more are needed"),
        ("gear", {"face_width": -1.0}, "face_width = -1; must be above 0"),
        ("gear", {"poisson_ratio": 0.5}, "poisson_ratio = 0.5; must be 0 to below 0.5"),
        ("gear", {"pitch_errors": (1e-6,)}, "pitch_errors = 1 values; 38 teeth need"),
        (
            "gear",
            {"faults": Faults(missing=(38,))},
            "faults of tooth 38; must be 0 to 37",
        ),
        ("mesh", {"backlash": -1e-6}, "backlash = -1e-06; must be 0 to below 1e+18"),
        ("mesh", {"torques": (100.0, 0.0)}, "torques = 0; must be above 0"),
    ],
)
def test_a_gear_set_checks_its_own_fields(part, changes, message):
    gears = fegear.load_gear_set("liu-pair")
    value = {"set": gears, "gear": gears.gears[0], "mesh": gears.meshes[0]}[part]
    with pytest.raises(fegear.InputError, match="^" + re.escape(message)):
        replace(value, **changes)


def test_a_mesh_is_of_gears_that_are_there():
    gears = fegear.load_gear_set("liu-pair")
    (mesh,) = gears.meshes
    with pytest.raises(fegear.InputError, match=r"^gear index = 7; must be 0 to 1, t"):
        replace(gears, meshes=(replace(mesh, driver=7),))


@pytest.mark.parametrize(
    "key", ["k" * 2_000_000, "a b " * 500_000], ids=["word", "words"]
)
def test_a_key_of_megabytes_is_not_echoed_whole(key):
    for values in (TABLES | {key: 1}, TABLES | {"gear": [{key: 1}]}):
        with pytest.raises(fegear.InputError) as caught:
            fegear.make_gear_set(values)
        assert len(str(caught.value)) < 5000
    with pytest.raises(fegear.InputError) as caught:
        fegear.Sweep(gear_set="liu-pair", speeds=key)
    assert len(str(caught.value)) < 5000


def test_a_model_is_auto_wherever_it_is_not_chosen():
    studies = fegear.Sweep, fegear.Motion, fegear.Branches, fegear.Signals
    for study in studies:
        (default,) = (f.default for f in fields(study) if f.name == "model")
        assert default == fegear.LumpedModel(), study
    assert fegear.LumpedModel().number == "auto"


def test_studies_of_model_1_take_a_model_that_is_auto():
    model = fegear.LumpedModel(excitation=QUICK.excitation)
    over, speeds = "damping_ratio=0.01:0.1:4", "1000:2000:100"
    stability = partial(fegear.Stability, over=over, speeds=speeds)
    for study in (fegear.Theory, stability):
        assert study(gear_set="liu-pair", model=model).model == QUICK


def test_one_torque_of_a_mesh_is_a_number():
    gears = fegear.load_gear_set("liu-pair")
    settings = fegear.StaticsSettings(
        positions=2, resolution="coarse", estimate_error=False
    )
    one, several = (
        fegear.solve_mesh(gears, torques_on_driver=torques, settings=settings)
        for torques in (100.0, [100.0])
    )
    assert one.table == several.table
    assert one.mesh == 1
