"""Values show themselves in a line, and their help fits on a screen."""

from __future__ import annotations

import pydoc
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from itertools import islice
from typing import Any

import numpy as np
import pytest

import fegear
from fegear.cli import run
from fegear.studies.command_packages import ROOT
from fegear.studies.registry import commands
from lumped.common.short_repr import MAX_LENGTH

PAIR = "liu-pair"
COARSE = fegear.StaticsSettings(positions=4, resolution="coarse", estimate_error=False)
FAST = fegear.LumpedModel(excitation=fegear.ExcitationSettings(kind="rectangular"))
SOLVED = fegear.LumpedModel(
    excitation=fegear.ExcitationSettings(resolution="coarse", positions=16)
)
STUDIES = {
    "sets": fegear.BuiltinSets(),
    "show": fegear.DerivedGeometry(PAIR),
    "stiffness": fegear.MeshStiffness(PAIR, torque=100.0, elements=COARSE),
    "theory": fegear.Theory(PAIR, torque=100.0, model=FAST),
    "modes": fegear.NaturalModes(PAIR, torque=100.0),
    "sweep": fegear.Sweep(PAIR, torque=100.0, speeds=[2000.0], model=FAST),
    "motion": fegear.Motion(PAIR, torque=100.0, speed=2000.0, model=FAST),
}
DEEPEST = 6


@pytest.fixture(scope="module")
def results():
    return {name: fegear.run(study) for name, study in STUDIES.items()}


@pytest.fixture(scope="module")
def values(results):
    gears = fegear.load_gear_set("liu-idler")
    return {
        "gears": gears,
        "statics": fegear.solve_mesh(gears, 2, 100.0, COARSE),
        "stress": fegear.solve_stress(gears, 100.0, settings=COARSE),
        "train": fegear.lumped_system(gears, 100.0, FAST),
        "coupled": fegear.lumped_system(gears, 100.0, SOLVED),
        "settings": (COARSE, FAST, fegear.FiniteElements(), fegear.PictureSettings()),
        "studies": STUDIES,
        "problems": {name: study.prepare() for name, study in STUDIES.items()},
        "results": results,
        "tables": [results[name].table for name in ("stiffness", "sweep", "motion")],
    }


def parts(value: Any, deep: int = 0) -> Iterator[Any]:
    """Dataclasses in a value, the first ones of each list."""
    if deep > DEEPEST:
        return
    if is_dataclass(value):
        yield value
        inner = [getattr(value, field.name) for field in fields(value)]
    elif isinstance(value, Mapping):
        inner = list(value.values())
    elif isinstance(value, list | tuple):
        inner = list(islice(value, 2)) if deep else list(value)
    else:
        return
    for item in inner:
        yield from parts(item, deep + 1)


def test_every_value_is_short(values):
    shown = {id(part): part for part in parts(values, 0)}.values()
    assert len({type(part) for part in shown}) > 60
    long = {
        f"{type(part).__module__}.{type(part).__name__}": len(repr(part))
        for part in shown
        if len(repr(part)) > MAX_LENGTH
    }
    assert long == {}


@pytest.mark.parametrize("name", sorted(STUDIES.keys() - {"stiffness"}))  # run times
def test_a_printed_result_is_what_the_command_prints(name, results, capsys):
    assert run(STUDIES[name].argv) == 0
    printed = capsys.readouterr().out
    page, _, end = printed.rpartition("wall time ")
    assert end.endswith(" s\n")
    assert str(results[name]) == page.removesuffix("\n")


def test_columns_of_every_table(values):
    for table in (*values["tables"], values["statics"].table):
        for name, column in table.columns.items():
            assert isinstance(column, np.ndarray)
            np.testing.assert_array_equal(table[name], column)
    with pytest.raises(fegear.InputError, match="no column nothing"):
        _ = values["tables"][0]["nothing"]


def test_help_is_one_screen():
    text = pydoc.plain(pydoc.render_doc(fegear))
    assert len(text.splitlines()) < 75
    assert len(text) < 4000
    listed = text.replace(",", " ").replace("`", " ").split()
    assert set(fegear.__all__) - {"__version__"} <= set(listed)


def test_what_is_listed():
    names = set(dir(fegear))
    assert names == set(fegear.__all__)
    assert {"MeshTable", "StaticsResult", "FaceLoads", "LumpedSystem"} <= names
    assert not {name for name in names if "Benchmark" in name}
    assert not names & {"Warmup", "Validation", "Ablation", "Reproduction"}
    assert fegear.Validation.command == "validate"  # for those who look for it


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: fegear.MeshStiffness(PAIR, positions=32),
            r"positions is a setting of elements: "
            r"MeshStiffness\(elements=StaticsSettings\(positions=32\)\)",
        ),
        (lambda: fegear.MeshStiffness(PAIR, 1), "by name; without it at most gear_set"),
        (lambda: fegear.MeshStiffness(PAIR, gear_set=PAIR), "gear_set is there twice"),
    ],
)
def test_settings_that_a_study_has_not(make, message):
    with pytest.raises(TypeError, match=message):
        make()


def test_the_gear_set_needs_no_name():
    assert fegear.MeshStiffness("liu-idler").gear_set.name == "liu-idler"
    assert fegear.RattleNoise("roots-scaled").machine.name == "roots-scaled"


def test_a_package_of_a_stranger_is_not_imported(tmp_path):
    package = tmp_path / "validation"
    for folder in (package, package / "commands"):
        folder.mkdir()
        (folder / "__init__.py").write_text("raise SystemExit(3)")
    code = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]; "
    code += (
        "import fegear; print(hasattr(fegear, 'Validation'), hasattr(fegear, 'Map'))"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.split() == ["False", "True"], done.stderr
    assert "validate" in commands()  # ours are there
