"""Where compiled kernels are kept."""

from __future__ import annotations

from pathlib import Path

import pytest
from numba import config

from lumped import compiled as module

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


def test_other_users_of_numba_keep_their_cache_directory():
    before = config.CACHE_DIR
    with module._cache_in(Path("/elsewhere")):
        assert config.CACHE_DIR == "/elsewhere"
    assert before == config.CACHE_DIR
