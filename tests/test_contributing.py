"""Files and names in CONTRIBUTING.md are there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from source_files import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
PATHS = sorted(set(re.findall(r"`((?:[\w.]+/)+[\w.]*)`", PAGE)))
NAMES = sorted(set(re.findall(r"`([a-z]+(?:_[a-z]+)+|[A-Z]\w+)`", PAGE)))
PACKAGES = "meshes", "lumped", "fegear", "validation", "tests"


# functions, classes, their fields and constants, at the beginning of a line
DEFINED = re.compile(
    r"^ *(?:(?:def|class) (\w+)|((?:\w+, )*\w+)(?::| =))", re.MULTILINE
)


def defined_in(path: Path) -> Iterator[str]:
    for name, assigned in DEFINED.findall(path.read_text("utf-8")):
        yield from [name] if name else assigned.split(", ")


def definitions() -> Iterator[str]:
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            yield from defined_in(path)


def test_files_are_there():
    assert [path for path in PATHS if not (ROOT / path).exists()] == []


def test_names_are_defined():
    assert set(NAMES) - set(definitions()) == set()


def test_names_are_in_the_files_that_are_said():
    """`NAME`, `file` and `NAME` in or of `file`: the file defines it."""
    pair = re.compile(r"`(\w+)`(?:,| in| of)\s+`((?:[\w.]+/)+\w+\.py)`")
    said = pair.findall(PAGE)
    assert len(said) > 15
    assert [
        (name, path) for name, path in said if name not in set(defined_in(ROOT / path))
    ] == []
