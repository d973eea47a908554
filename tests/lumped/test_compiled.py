"""Where compiled kernels are kept."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest
from numba import config
from numba.core import event

from fegear.files.timing import COMPILING_STAGE, recorded_stages, stage
from lumped.common import compiled as module
from lumped.common import sealed_cache

FOLDER = Path(module.__file__).parent / "kernels"


@pytest.fixture
def fresh():
    module.kernel_cache.cache_clear()
    yield
    module.kernel_cache.cache_clear()


def test_without_a_writable_cache_functions_still_compile(monkeypatch):
    monkeypatch.setattr(module, "kernel_cache", lambda folder: None)

    @module.compiled
    def double(x):
        return 2.0 * x

    assert double(3.0) == 6.0
    assert double.py_func(3.0) == 6.0


def test_no_place_is_no_error(monkeypatch, fresh):
    def refuse(*_, **__):
        raise PermissionError

    monkeypatch.setattr(Path, "mkdir", refuse)
    assert module.kernel_cache(FOLDER) is None


def test_directory_follows_the_sources(monkeypatch, tmp_path, fresh):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    one = module.kernel_cache(FOLDER)
    module.kernel_cache.cache_clear()
    original = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: original(path) + b"#")
    assert module.kernel_cache(FOLDER) != one
    assert one.parent == tmp_path


CUBE = """
import logging
from lumped.common.compiled import compiled
logging.basicConfig(format="%(message)s", level="WARNING")

@compiled
def cube(x):
    return x * x * x

print(cube(3.0), sum(cube.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_damaged_kernels_are_compiled_again(tmp_path, monkeypatch):
    """Empty, cut, of random bytes, or with one bit turned."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    program = tmp_path / "cube.py"
    program.write_text(CUBE)

    def used() -> tuple[str, str]:
        command = [sys.executable, str(program)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        return done.stdout.strip(), done.stderr

    assert [used(), used()] == [("27.0 0", ""), ("27.0 1", "")]
    (file,) = (tmp_path / "kept").rglob("*.nbc")
    whole = file.read_bytes()
    turned = bytes([*whole[:-9], whole[-9] ^ 4, *whole[-8:]])
    for content in (b"", whole[:100], random.Random(1).randbytes(900), turned):
        file.write_bytes(content)
        result, said = used()
        assert result == "27.0 0"
        assert "damaged and compiled again" in said
        assert used() == ("27.0 1", "")


def test_a_full_disk_only_costs_time(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "kernel_cache", lambda folder: tmp_path)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sealed_cache._SealedFiles, "_open_for_write", full)

    @module.compiled
    def double(x):
        return 2.0 * x

    assert double(3.0) == 6.0


def test_other_users_of_numba_keep_their_cache_directory():
    before = config.CACHE_DIR
    with module._cache_in(Path("/elsewhere")):
        assert config.CACHE_DIR == "/elsewhere"
    assert before == config.CACHE_DIR


@pytest.mark.parametrize(("cached", "level"), [(True, "INFO"), (False, "WARNING")])
def test_the_first_compilation_is_said_once(monkeypatch, caplog, cached, level):
    if not cached:
        monkeypatch.setattr(module, "kernel_cache", lambda folder: None)
    monkeypatch.delenv(module.PLAIN_VARIABLE, raising=False)  # that is a warning
    watch = module.CompileClock()
    event.register("numba:compile", watch)
    caplog.set_level("INFO", "lumped")
    try:
        for factor in (2.0, 3.0):
            module.njit(lambda x, factor=factor: factor * x)(1.0)
    finally:
        event.unregister("numba:compile", watch)
    said = [r for r in caplog.records if "compiling numerical kernels" in r.message]
    assert [r.levelname for r in said][:1] == [level]
    assert len(said) <= 2  # the process's own watch may speak as well
    assert watch.seconds > 0.0


def test_the_clock_counts_kernels_that_others_compile_once():
    """The time of the outer one alone: it includes that of the inner ones."""
    watch = module.CompileClock()
    event.register("numba:compile", watch)
    begin = time.perf_counter()
    try:
        inner = module.njit(lambda x: x + 1.0)
        outer = module.njit(lambda x: 2.0 * inner(x))
        assert outer(1.0) == 4.0
        compiled = watch.seconds
        assert outer(2.0) == 6.0
    finally:
        event.unregister("numba:compile", watch)
    assert 0.0 < compiled <= time.perf_counter() - begin
    assert watch.seconds == compiled  # a second call compiles nothing


def test_stages_keep_compiling_apart():
    with recorded_stages() as seconds, stage("solving"):
        module.njit(lambda x: 3.0 * x)(1.0)
    assert set(seconds) == {"solving", COMPILING_STAGE}
    assert seconds[COMPILING_STAGE] > seconds["solving"] > 0.0


def test_a_mode_of_contact_is_compiled_once():
    """A plain int as an argument would compile the whole chain for each value."""
    from fegear.contact.plane.kernels.active_set import STE, TORQUE

    @module.njit
    def kind_of(kind):
        return kind

    for kind in (TORQUE, STE):
        kind_of(kind)
    assert len(kind_of.signatures) == 1
    assert not isinstance(TORQUE, int)
