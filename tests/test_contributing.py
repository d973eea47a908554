"""Files and names in CONTRIBUTING.md are there."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from source_files import ROOT, parsed

PAGE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
PATHS = sorted(set(re.findall(r"`((?:[\w.]+/)+[\w.]*)`", PAGE)))
NAMES = sorted(set(re.findall(r"`([a-z]+(?:_[a-z]+)+|[A-Z]\w+)`", PAGE)))
PACKAGES = "meshes", "lumped", "fegear", "validation", "tests"


def definitions() -> Iterator[str]:
    """Functions, classes, their fields, and constants of modules."""
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(parsed(path)):
                if isinstance(node, ast.FunctionDef | ast.ClassDef):
                    yield node.name
                if isinstance(node, ast.Module | ast.ClassDef):
                    yield from _assigned(node)


def _assigned(scope: ast.Module | ast.ClassDef) -> Iterator[str]:
    for statement in scope.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            for node in ast.walk(statement):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    yield node.id


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
        (name, path)
        for name, path in said
        if name not in set(_defined_in(parsed(ROOT / path)))
    ] == []


def _defined_in(module: ast.Module) -> Iterator[str]:
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
    yield from _assigned(module)
