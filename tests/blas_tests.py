"""Tests that `-m blas` runs: their numbers come from BLAS or LAPACK.

Kernels of these libraries differ between processors in their round-off. A file of tests
has the mark where it imports a module of mechanics that factorises, solves or finds
eigenvalues, or one that imports such a module. Tests of commands and pictures have
none: they compare fewer digits.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
IMPORT = re.compile(r"^\s*from ((?:fegear|lumped)(?:\.\w+)+) import", re.MULTILINE)
LINEAR_ALGEBRA = re.compile(r"\blinalg\b|\bsplu\(|\beigh?\(|\blstsq\(")
NOT_MECHANICS = "fegear.commands", "fegear.rendering"
MECHANICS = "tests/lumped", "tests/meshes", "tests/fegear"
OTHER_TESTS = tuple(
    f"tests/fegear/{folder}" for folder in ("cli", "commands", "rendering", "studies")
)


def pytest_itemcollected(item: pytest.Item) -> None:
    if item.path.is_relative_to(ROOT) and uses_linear_algebra(item.path):
        item.add_marker("blas")


@cache
def uses_linear_algebra(path: Path) -> bool:
    """Whether a file of tests is of mechanics, and of modules with linear algebra."""
    place = path.relative_to(ROOT).as_posix()
    if not place.startswith(MECHANICS) or place.startswith(OTHER_TESTS):
        return False
    modules = imports_of(path)
    return any(
        has_linear_algebra(module)
        for imported in modules
        for module in (imported, *imports_of(path_of(imported)))
    )


@cache
def has_linear_algebra(module: str) -> bool:
    path = path_of(module)
    if module.startswith(NOT_MECHANICS) or not path.exists():
        return False
    return LINEAR_ALGEBRA.search(path.read_text("utf-8")) is not None


@cache
def imports_of(path: Path) -> tuple[str, ...]:
    """Modules that a file names in its imports, none where it is a folder."""
    return tuple(IMPORT.findall(path.read_text("utf-8"))) if path.exists() else ()


def path_of(module: str) -> Path:
    return ROOT.joinpath(*module.split(".")).with_suffix(".py")
