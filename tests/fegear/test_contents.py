"""What a checkpoint depends on: values to the last bit, files by their content."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fegear
from fegear.commands.stability import study as stability
from fegear.files.contents import exact_repr
from fegear.files.errors import InputError
from fegear.files.store import CheckpointOptions
from fegear.statics.given_tables import GivenTables
from fegear.studies import load_study
from fegear.studies.registry import commands
from fegear.studies.settings import Setting, exposed_fields, group_of
from lumped.train.table import MeshTable, format_table

NAMES = "branches", "motion", "sharing", "signals", "stability", "sweep", "theory"
REQUIRED = {
    "branches": {"speeds": (1000.0, 1010.0)},
    "motion": {"speed": 1000.0},
    "signals": {"speed": 1000.0},
    "stability": {"over": "friction=0:0.1:3", "speeds": "1400:1800:200"},
    "sweep": {"speeds": (1000.0, 1010.0)},
}


@dataclass(frozen=True)
class Point:
    place: tuple[float, ...]
    values: object = None


def test_plain_values_are_their_repr():
    for value in (1, 0.1 + 0.2, "a", None, (), (1,), [1, (2.0, None)], {"a": (1,)}):
        assert exact_repr(value) == repr(value)
    teeth = fegear.load_gear_set("liu-idler").gears[0].geometry
    assert exact_repr(teeth) == repr(teeth)


def test_every_number_of_a_long_array_counts():
    values = np.linspace(0.0, 1.0, 5000)
    other = values.copy()
    other[2500] = np.nextafter(other[2500], 1.0)
    assert repr(values) == repr(other)
    texts = [
        exact_repr(Point((1.0,), {"x": v})) for v in (values, values.copy(), other)
    ]
    assert texts[0] == texts[1] != texts[2]
    assert exact_repr(values) != exact_repr(values.reshape(50, 100))
    assert exact_repr(np.zeros(2)) != exact_repr(np.zeros(2, int))


def mesh_table(scale: float = 1.0, amount: int = 40) -> MeshTable:
    position = np.arange(amount) / amount
    stiffness = scale * 4e8 * (1.0 + 0.2 * np.cos(2.0 * np.pi * position))
    columns = {"stiffness_N_per_m": stiffness[None]}
    return MeshTable(np.array([100.0]), position, columns)


def with_table(command: str, *names: str) -> fegear.Study:
    return load_study(command)(
        gear_set="liu-pair", table=names, **REQUIRED.get(command, {})
    )


def test_all_studies_with_tables_are_here():
    assert set(NAMES) == {
        command
        for command in commands()
        if any(e.name == "table" for e in exposed_fields(group_of(load_study(command))))
    }


@pytest.mark.parametrize("command", NAMES)
def test_an_edited_table_is_another_input(command, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text(format_table(mesh_table()))
    study = with_table(command, str(path))
    before = study.inputs
    assert before == with_table(command, str(path)).inputs
    path.write_text(format_table(mesh_table(1.0 + 1e-15)))
    after = with_table(command, str(path)).inputs
    different = {name for name in before if before[name] != after[name]}
    assert different == {f"content of {path}"}


def test_tables_from_python_are_inputs_to_the_last_bit():
    """Far more numbers than `repr` shows."""

    def inputs(scale: float) -> dict[str, str]:
        table = mesh_table(scale, 3000)
        source = GivenTables((("t.csv", table),))
        model = fegear.LumpedModel(number=1, excitation=source)
        return replace(with_table("branches"), model=model).inputs

    assert inputs(1.0) == inputs(1.0)
    assert inputs(1.0) != inputs(1.0 + 1e-15)


def test_files_by_place_are_declared():
    """Names of what is read: no output replaces them, and checkpoints hold them."""
    declarations = set[str]()

    def walk(group, command):
        for field in exposed_fields(group):
            if field.group is not None:
                walk(field.group, command)
            elif isinstance(field.declared, Setting) and field.declared.place:
                declarations.add(f"{field.declared.place} {field.declared.reads}")

    for command in commands():
        walk(group_of(load_study(command)), command)
    places = {"SET", "MACHINE", "GEARBOX", "FILE", "CASE"}
    assert declarations >= {f"{place} True" for place in places}
    assert not {f"{place} False" for place in places} & declarations


def test_an_edited_table_is_not_resumed(tmp_path, monkeypatch):
    """Two tables would be in one file."""
    from fegear.cli import run

    monkeypatch.chdir(tmp_path)
    gears = fegear.load_gear_set("liu-pair")
    elements = fegear.StaticsSettings(resolution="coarse", positions=8)
    table = fegear.solve_mesh(
        gears, torques_on_driver=(100.0,), settings=elements
    ).table
    Path("t.csv").write_text(format_table(table))
    study = with_table("stability", "t.csv")
    study = replace(study, model=fegear.LumpedModel(number=1, bending=0.39))
    argv = ["--debug", *study.argv, "-o", "m.csv"]
    scan, calls = stability.scan_stability, list[object]()

    def stopped(*args: Any) -> Any:
        calls.append(args)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return scan(*args)

    stiffer = {name: 1.1 * values for name, values in table.columns.items()}
    other = replace(table, columns=stiffer)
    with monkeypatch.context() as patched:
        patched.setattr(stability, "scan_stability", stopped)
        checkpoint_options = CheckpointOptions(checkpoint=Path("m.csv.partial"))
        assert not fegear.run(study, checkpoint_options, workers=1).complete
    Path("t.csv").write_text(format_table(other))
    with pytest.raises(InputError, match=r"^m\.csv\.partial: .* content of t\.csv = '"):
        run([*argv, "--resume"])
    Path("t.csv").write_text(format_table(table))
    run([*argv, "--resume"])
    run([*argv[:-1], "whole.csv"])
    assert Path("m.csv").read_bytes() == Path("whole.csv").read_bytes()
