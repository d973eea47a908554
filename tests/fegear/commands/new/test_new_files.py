"""`fegear keys` and `fegear new`: what files may hold, and files to begin with."""

from __future__ import annotations

import json
import math
import re
import tomllib

import pytest
from pydantic import ValidationError
from typer.testing import CliRunner

import validation.commands  # noqa: F401  # registers the files of cases
from fegear import load_gear_set
from fegear.cli import app
from fegear.commands.bearing.file import bearing_of
from fegear.commands.clatter.gearboxes import load_gearbox
from fegear.commands.rattle.machines import load_machine
from fegear.files.keys import FILE_KINDS, file_keys, unit_of_key
from fegear.files.templates import TEMPLATE_PACKAGES, template_text
from fegear.gearset.read import load_tables
from fegear.gearset.schema import Document
from validation.study.cases import load_case


def load_bearing(path: str) -> object:
    bearing = bearing_of(load_tables(path, {}), {}, path)
    assert bearing is not None
    return bearing


READERS = {
    "machine": load_machine,
    "gearbox": load_gearbox,
    "case": load_case,
    "bearing": load_bearing,
}
GEAR_SETS = "pair", "idler", "counter-shaft", "planetary"
TEMPLATES_OF = {kind: (kind,) for kind in READERS} | {"gear-set": GEAR_SETS}
KEYS = {kind: file_keys(kind) for kind in FILE_KINDS}
WORD = re.compile(r"[A-Za-z_]\w*")


def run(*words: str) -> str:
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.mark.parametrize("kind", TEMPLATE_PACKAGES)
def test_a_new_file_is_read(tmp_path, kind):
    path = tmp_path / f"{kind}.toml"
    run("new", kind, "-o", str(path))
    assert path.read_text() == template_text(kind)
    READERS.get(kind, load_gear_set)(str(path))


def test_a_file_that_exists_is_not_replaced(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("edited = true\n")
    result = CliRunner().invoke(app, ["new", "pair", "-o", str(path)])
    assert result.exit_code != 0
    assert "mine.toml: exists" in str(result.exception)
    assert path.read_text() == "edited = true\n"


@pytest.mark.parametrize("kind", FILE_KINDS)
def test_every_key_is_explained(kind):
    for key in KEYS[kind]:
        assert key.meaning
        assert "default" not in key.meaning
        assert not key.required or key.default is None


@pytest.mark.parametrize("kind", FILE_KINDS)
def test_every_key_is_in_a_template(kind):
    texts = [template_text(template) for template in TEMPLATES_OF[kind]]
    words = set(WORD.findall("\n".join(texts)))
    assert {key.key for key in KEYS[kind]} <= words


@pytest.mark.parametrize(
    ("file", "kind"), [(f, kind) for kind, files in TEMPLATES_OF.items() for f in files]
)
def test_a_template_comments_keys_that_exist(file, kind):
    names = {key.key for key in KEYS[kind]}
    tables = {part for key in KEYS[kind] for part in WORD.findall(key.table)}
    commented = re.findall(r"^# (\w+) =", template_text(file), re.M)
    assert set(commented) <= names | tables


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("inertia_kg_m2", "kg m2"),
        ("mass_kg", "kg"),
        ("bearing_kx_N_per_m", "N/m"),
        ("coupling_stiffness_Nm_per_rad", "N m/rad"),
        ("axial_damping_Ns_per_m", "N s/m"),
        ("axial_drag_N", "N"),
        ("torques_Nm", "N m"),
        ("length_pitches", "base pitches"),
        ("damping", ""),
        ("name", ""),
    ],
)
def test_the_unit_is_at_the_end_of_a_key(key, unit):
    assert unit_of_key(key) == unit
    assert key in {entry.key for keys in KEYS.values() for entry in keys}


def listed(*words: str) -> list[dict]:
    return json.loads(run("keys", *words, "--json"))["keys"]


def test_keys_as_numbers_for_programs():
    (row,) = [
        row
        for row in listed("gear-set")
        if (row["table"], row["key"]) == ("[[gear]]", "pressure_angle_deg")
    ]
    assert {name: row[name] for name in ("unit", "default", "minimum", "maximum")} == {
        "unit": "deg",
        "default": 20.0,
        "minimum": 5.0,
        "maximum": 35.0,
    }


def test_all_files_by_default():
    assert [row["file"] for row in listed()] == [
        kind for kind, keys in KEYS.items() for _ in keys
    ]


BOUNDED = [
    (key, limit, outward)
    for key in KEYS["gear-set"]
    if key.table in ("[[gear]]", "[[mesh]]", "[load]", "[dynamics]")
    for limit, outward in ((key.minimum, -math.inf), (key.maximum, math.inf))
    if limit is not None
]


@pytest.mark.parametrize(
    ("key", "limit", "outward"), BOUNDED, ids=lambda value: getattr(value, "key", None)
)
def test_limits_are_those_that_are_checked(key, limit, outward):
    """A value just beyond a limit is refused, and the message is about its key."""
    tables = tomllib.loads(template_text("pair"))
    shared = tables.pop("defaults")
    tables["gear"] = [shared | gear for gear in tables["gear"]]
    table = tables[key.table.strip("[]")]
    entry = table[0] if isinstance(table, list) else table
    is_whole = key.key == "teeth"
    beyond = limit + math.copysign(1, outward) if is_whole else limit
    value = int(beyond) if is_whole else math.nextafter(beyond, outward)
    entry[key.key] = [value] if isinstance(entry.get(key.key), list) else value
    if key.key == "pitch_errors_um":
        entry[key.key] = [value] * entry["teeth"]
    with pytest.raises(ValidationError) as refused:
        Document.model_validate(tables)
    assert any(key.key in error["loc"] for error in refused.value.errors())
