"""A file of another kind: the message says what it seems to be, and who reads it."""

from __future__ import annotations

import pytest
from rexs_files import RexsWriter, as_json, as_xml
from typer.testing import CliRunner

import validation.commands  # noqa: F401  # registers cases
from fegear import load_gear_set
from fegear.cli import app
from fegear.files.templates import template_text

TREE = RexsWriter(load_gear_set("liu-pair")).tree()
TABLE = "# fegear\nposition,stiffness_N_per_m\n0.0,1e8\n0.1,1.1e8\n"
GIVEN = [
    ("show", template_text("case"), "a case file, which `fegear validate` reads"),
    (
        "sweep",
        template_text("machine"),
        "a machine file, which `fegear rattle critical`",
    ),
    ("show", template_text("gearbox"), "a gearbox file, which `fegear clatter` reads"),
    ("clatter", template_text("pair"), "a gear-set file, which `fegear stiffness` and"),
    ("rattle critical", template_text("gearbox"), "a gearbox file, which"),
    ("clatter", template_text("case"), "a gearbox file is needed"),
    (
        "validate -o out",
        template_text("pair"),
        "a gear-set file, which `fegear stiffness`",
    ),
    ("show", TABLE, "seems to be a table, such as `fegear sweep` reads of meshes"),
    ("show", as_xml(TREE), "a REXS file, which `fegear new` reads"),
    ("show", as_json(TREE), "a REXS file, which `fegear new` reads"),
    ("show", "<html><p>page</p></html>", "seems to be XML or HTML"),
    ("show", "name = 'a'\n[[gear]\n", "TOML syntax"),
]


@pytest.mark.parametrize(
    ("command", "text", "message"), GIVEN, ids=[f"{c}-{m[:30]}" for c, _, m in GIVEN]
)
def test_a_file_of_another_kind(tmp_path, monkeypatch, command, text, message):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "given.toml"
    path.write_text(text)
    result = CliRunner().invoke(app, [*command.split(), str(path)])
    assert result.exit_code != 0
    assert message in str(result.exception)
    assert str(result.exception).startswith(str(path))


@pytest.mark.parametrize(
    ("name", "message"),
    [("box.rexs", "`fegear new`"), ("k.nc", "a table"), ("k.xlsx", "a table")],
)
def test_a_name_that_says_what_it_is(tmp_path, name, message):
    path = tmp_path / name
    path.write_bytes(b"\x89HDF\xff\x00")
    result = CliRunner().invoke(app, ["show", str(path)])
    assert message in str(result.exception)
