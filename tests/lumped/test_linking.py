"""Compiled functions that are put together from parts, in one process and the next."""

from __future__ import annotations

import hashlib
import subprocess
import sys

import pytest

from lumped.common.compiled import is_linked
from lumped.common.sealed_cache import DIGEST_SIZE

pytestmark = pytest.mark.skipif(not is_linked(), reason="kernels are compiled plainly")

PARTS = """
from lumped.common.compiled import (
    compiled, compiled_part, inlined, not_allocating, shared_part
)

@inlined
def square(x):
    return x * x

@compiled_part
def cube(x):
    return x * square(x)

@shared_part
def sum_of_cubes(array):
    total = 0.0
    for x in array:
        total += cube(x)
    return total

@compiled_part
def mean_of_cubes(array):
    return sum_of_cubes(array) / array.size

@not_allocating
def scaled(array, factor):
    return factor * mean_of_cubes(array) + sum_of_cubes(array)

@compiled
def twice(array):
    return 2.0 * sum_of_cubes(array)
"""
USE = """
import sys
import numpy as np
from lumped.common.compiled import CompileCount
import parts

with CompileCount() as count:
    for name in sys.argv[1:]:
        arguments = (np.array([1.0, 2.0, 3.0]), 0.5)
        function = getattr(parts, name)
        print(function(*arguments[: function.py_func.__code__.co_argcount]))
print(sorted({name.split(":")[0].split(".")[-1] for name in count.names}))
"""
SCALED, TWICE = 0.5 * 12.0 + 36.0, 72.0


@pytest.fixture
def use(tmp_path, monkeypatch):
    """Runs functions in a process of their own; results and what was compiled."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "parts.py").write_text(PARTS)
    (tmp_path / "use.py").write_text(USE)

    def used(*names: str) -> list[str]:
        command = [sys.executable, str(tmp_path / "use.py"), *names]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        return done.stdout.splitlines()

    return used


def cached_files(folder, name):
    return sorted(folder.rglob(f"parts.{name}*.nbc"))


def test_parts_are_compiled_once_for_all_that_call_them(use):
    parts = ["cube", "mean_of_cubes", "scaled", "square", "sum_of_cubes"]
    assert use("scaled") == [str(SCALED), str(parts)]
    assert use("twice") == [str(TWICE), "['twice']"]
    assert use("twice", "scaled") == [str(TWICE), str(SCALED), "[]"]


@pytest.mark.parametrize(
    "content",
    [None, *(pytest.param(c, marks=pytest.mark.slow) for c in (b"", b"x" * 900))],
)
def test_a_shared_part_that_is_gone_or_damaged_is_compiled_again(
    use, tmp_path, content
):
    use("scaled")
    (file,) = cached_files(tmp_path, "sum_of_cubes")
    file.unlink() if content is None else file.write_bytes(content)
    assert use("scaled") == [str(SCALED), "['sum_of_cubes']"]
    assert use("scaled") == [str(SCALED), "[]"]


@pytest.mark.slow
def test_shared_parts_have_the_same_name_in_all_processes(use, tmp_path):
    """Else machine code that calls them could not be loaded."""
    names = set()
    for order in (("twice", "scaled"), ("scaled", "twice")):
        for file in cached_files(tmp_path, ""):
            file.unlink()
        use(*order)
        (file,) = cached_files(tmp_path, "twice")
        content = file.read_bytes()
        begin = content.index(b"_ZN5parts12sum_of_cubes")
        names.add(content[begin : content.index(b"E", begin)])
    assert len(names) == 1


@pytest.mark.slow
def test_machine_code_that_calls_another_name_is_not_loaded(use, tmp_path):
    use("twice", "scaled")
    (file,) = cached_files(tmp_path, "twice")
    content = file.read_bytes()[DIGEST_SIZE:]
    content = content.replace(b"12sum_of_cubes", b"12sum_of_cubed")
    file.write_bytes(hashlib.sha256(content).digest() + content)
    assert use("scaled", "twice") == [str(SCALED), str(TWICE), "['twice']"]
