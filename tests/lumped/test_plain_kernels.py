"""Kernels by what numba offers to all, where its internals are not those known here."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from lumped.common import compiled as module

CONTACT = """
import json
import fegear
from lumped.common.compiled import is_linked
gears = fegear.load_gear_set("liu-pair")
settings = fegear.StaticsSettings(
    positions=8, resolution="coarse", estimate_error=False, root_stress=False
)
table = fegear.solve_mesh(gears, torques_on_driver=[100.0], settings=settings).table
print(json.dumps([is_linked(), table["ste_m"][0].tolist()]))
"""


@pytest.mark.parametrize(
    ("version", "linked"),
    [
        ("0.61.2", False),
        ("0.62.0", True),
        ("0.68.1", True),
        ("0.69.0rc1", False),
        ("1.0", False),
        ("unknown", False),
    ],
)
def test_releases_of_numba_that_are_not_known_compile_plainly(
    monkeypatch, version, linked
):
    monkeypatch.delenv(module.PLAIN_VARIABLE, raising=False)
    monkeypatch.setattr(module.numba, "__version__", version)
    assert module.is_linked() is linked
    monkeypatch.setenv(module.PLAIN_VARIABLE, "1")
    assert not module.is_linked()


def test_forms_that_are_linked_are_known_here(monkeypatch):
    monkeypatch.delenv(module.PLAIN_VARIABLE, raising=False)
    assert module.is_linked(), "numba is newer than NEWEST_LINKED: test and raise it"


def test_plain_functions_have_a_cache_of_their_own(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder = tmp_path / "sources"
    folder.mkdir()
    (folder / "kernel.py").write_text("def f(): ...")
    directories = []
    for value in ("", "1"):
        monkeypatch.setenv(module.PLAIN_VARIABLE, value)
        module.kernel_cache.cache_clear()
        directories.append(module.kernel_cache(folder))
    module.kernel_cache.cache_clear()
    assert None not in directories
    assert len(set(directories)) == 2


@pytest.mark.slow
def test_plain_kernels_have_the_same_numbers(tmp_path):
    """Only plain Python shows an index out of range, or a type the compiler chose."""
    results = []
    for value in ("", "1"):
        environment = {**os.environ, module.PLAIN_VARIABLE: value}
        environment["NUMBA_CACHE_DIR"] = str(tmp_path / f"kernels{value}")
        done = subprocess.run(
            [sys.executable, "-c", CONTACT],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        results.append(json.loads(done.stdout))
        said = "plain way" in done.stderr
        assert said == bool(value) or not done.stderr
    (linked, one), (plain, two) = results
    assert (linked, plain) == (True, False)
    assert two == pytest.approx(one, rel=1e-12)
