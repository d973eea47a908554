"""`import fegear`: the examples of its help and of its guide run, and it is cheap."""

from __future__ import annotations

import doctest
import pydoc
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import fegear
from fegear.files.version import package_version

GUIDE = Path(__file__).parents[2] / "docs" / "howto" / "python.md"
ROOT = GUIDE.parents[2]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "README.md", *ROOT.glob("docs/**/*.md"))
    if "```python\n" in path.read_text("utf-8") and path != GUIDE
)
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
SPEEDS = 2000.0, 2100.0
FAST = fegear.ExcitationSettings(kind="rectangular")


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
def test_examples_of_the_help():
    assert doctest.testmod(fegear).attempted > 10
    assert doctest.testmod(fegear).failed == 0


def test_examples_are_short():
    for block in re.findall(r"((?:^>>>.*\n(?:(?!>>>|$).*\n)*)+)", fegear.__doc__, re.M):
        assert 0 < block.count(">>>") < 10


@pytest.mark.slow
def test_the_guide():
    blocks = BLOCK.findall(GUIDE.read_text("utf-8"))
    assert len(blocks) >= 2
    names: dict[str, object] = {}
    for block in blocks:
        assert len(block.splitlines()) < 20
        exec(compile(block, GUIDE.name, "exec"), names)


@pytest.mark.parametrize("page", PAGES)
def test_python_of_other_pages(page):
    """Files that a page reads are those of commands, made here in a small size."""
    gears = fegear.load_gear_set("liu-pair")
    fegear.solve_mesh(gears, torques_on_driver=[100.0]).to_csv("t.csv")
    blocks = BLOCK.findall((ROOT / page).read_text("utf-8"))
    if any("import pandas" in block for block in blocks):
        pytest.importorskip("pandas")
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


def test_the_guide_promises_no_more_than_runs():
    """Calls stand in blocks that are run, and none is left out by dots."""
    section = GUIDE.read_text("utf-8")
    blocks = BLOCK.findall(section)
    assert not re.search(r"`fegear\.\w+\([^`)]", BLOCK.sub("", section))
    assert "..." not in section
    assert any("fegear.make_gear_set(" in block for block in blocks)
    text = pydoc.plain(pydoc.render_doc(fegear))
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.lstrip().startswith(">>>"))
    assert first < 20  # it begins with examples
    assert len(lines) < 75  # one screen
    assert "is one screen" in section


def test_what_it_offers_is_there():
    for name in fegear.__all__:
        assert getattr(fegear, name) is not None
    assert fegear.__version__ == package_version()
    assert set(fegear.__all__) == set(dir(fegear))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = fegear.nothing


def test_functions_and_results_say_what_they_are():
    for name in set(fegear.__all__) - {"__version__"}:
        assert (getattr(fegear, name).__doc__ or "").strip(), name


def test_it_is_a_program():
    command = [sys.executable, "-m", "fegear", "--version"]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    assert process.stdout == f"fegear {package_version()}\n"


def test_a_gear_set_made_in_python():
    gear = {"module_mm": 2.0, "pressure_angle_deg": 20.0, "face_width_mm": 20.0}
    tables = {
        "name": "made",
        "gear": [
            {"name": "a", "teeth": 30, "hub_radius_mm": 12.0, **gear},
            {"name": "b", "teeth": 45, "hub_radius_mm": 20.0, **gear},
        ],
        "mesh": [{"driver": "a", "driven": "b", "operating_pressure_angle_deg": 20}],
    }
    gear_set = fegear.make_gear_set(tables, {"gear.a.teeth": 31})
    assert [gear.geometry.teeth for gear in gear_set.gears] == [31, 45]
    with pytest.raises(fegear.InputError, match="teeth"):
        fegear.make_gear_set(tables, {"gear.a.teeth": 3})


def test_frames_where_pandas_is_there(monkeypatch):
    frames = SimpleNamespace(DataFrame=lambda data: data)
    monkeypatch.setitem(sys.modules, "pandas", frames)
    gears = fegear.load_gear_set("liu-pair")
    settings = fegear.StaticsSettings(positions=4, resolution="coarse")
    table = fegear.solve_mesh(gears, 1, [50.0, 100.0], settings)
    columns = table.to_frame()
    np.testing.assert_array_equal(columns["torque_Nm"], [50.0] * 4 + [100.0] * 4)
    np.testing.assert_array_equal(columns["position"], [0.0, 0.25, 0.5, 0.75] * 2)
    np.testing.assert_array_equal(columns["ste_m"], table.table["ste_m"].ravel())
    model = fegear.LumpedModel(number=1, excitation=FAST)
    study = fegear.Sweep(
        gear_set=gears, torque=[100.0], speeds=SPEEDS, model=model, direction="up"
    )
    assert fegear.run(study).to_frame()["mesh_frequency_Hz"] == SPEEDS


def test_the_summary_of_a_sweep_is_that_of_the_command(capsys):
    from fegear.cli import run

    gears = fegear.load_gear_set("liu-pair")
    model = fegear.LumpedModel(number=1, excitation=FAST)
    result = fegear.run(
        fegear.Sweep(gear_set=gears, torque=[100.0], speeds=SPEEDS, model=model)
    )
    command = "sweep liu-pair --excitation rectangular --torque 100 --speeds 2000,2100"
    assert run([*command.split(), "-o", "command.csv"]) == 0
    result.to_csv("python.csv")
    texts = (Path(f"{name}.csv").read_text() for name in ("command", "python"))
    assert len(set(texts)) == 1


def test_torques_that_are_nowhere():
    pair = fegear.load_gear_set("liu-pair")
    gears = replace(pair, meshes=(replace(pair.meshes[0], torques=()),))
    with pytest.raises(fegear.InputError, match="torque is missing"):
        fegear.run(fegear.Sweep(gear_set=gears, speeds=[2000.0]))


@pytest.mark.slow
def test_no_module_hides_what_is_offered():
    """A module of the package becomes its attribute once it is imported."""
    code = "import fegear; " + "; ".join(
        ("[getattr(fegear, name) for name in fegear.__all__]",) * 2
        + ("assert callable(fegear.lumped_system), fegear.lumped_system",)
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    members = [getattr(fegear, name) for name in fegear.__all__]
    assert not any(isinstance(member, ModuleType) for member in members)
